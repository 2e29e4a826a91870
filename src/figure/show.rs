//! What a window shows of a figure: views of shipped scenes, and the figure's variants. A variant is shown only if
//! scene settings can express it.

use super::Figure;

/// What a window shows of a figure.
#[derive(Clone, Copy)]
pub struct Show {
    pub views: Views,
    /// Variants of the figure that can be selected by settings in its views, in the figure's order. If there are none,
    /// the window has the variants of the view's scene.
    pub variants: fn() -> Vec<Setting>,
}

/// Where a figure's views come from.
#[derive(Clone, Copy)]
pub enum Views {
    /// Every scene of the figure that is named SCENE/CAMERA or SCENE/PATH, with these changes.
    Scenes(&'static [&'static str]),
    /// The figure's own list.
    Listed(fn() -> Vec<FigureView>),
    /// The figure computes without a picture.
    Nothing {
        /// What the figure computes, as a clause: "it times ...".
        why: &'static str,
        /// The shipped scene whose subject is nearest.
        nearest: &'static str,
    },
}

/// A view of a shipped scene, with a figure's changes to its settings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FigureView {
    pub name: String,
    /// A shipped scene.
    pub scene: String,
    /// One of the scene's cameras or paths; `None`: the scene's own view.
    pub eye: Option<String>,
    /// In the syntax of `-D`. `surface.NAME` is the scene's first surface.
    pub changes: Vec<String>,
}

/// A variant as settings of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The variant's name in the figure.
    pub name: String,
    /// As [`FigureView::changes`].
    pub changes: Vec<String>,
}

impl Show {
    pub const fn scenes(changes: &'static [&'static str]) -> Show {
        Show { views: Views::Scenes(changes), variants: Vec::new }
    }

    pub const fn views(views: fn() -> Vec<FigureView>) -> Show {
        Show { views: Views::Listed(views), variants: Vec::new }
    }

    pub const fn nothing(why: &'static str, nearest: &'static str) -> Show {
        Show { views: Views::Nothing { why, nearest }, variants: Vec::new }
    }

    pub const fn variants(self, variants: fn() -> Vec<Setting>) -> Show {
        Show { variants, ..self }
    }
}

impl FigureView {
    /// `scene`: SCENE, SCENE/CAMERA or SCENE/PATH.
    pub fn new<S: Into<String>>(
        name: impl Into<String>,
        scene: &str,
        changes: impl IntoIterator<Item = S>,
    ) -> FigureView {
        let (scene, eye) = match scene.split_once('/') {
            Some((scene, eye)) => (scene, Some(eye.to_owned())),
            None => (scene, None),
        };
        let changes = changes.into_iter().map(Into::into).collect();
        FigureView { name: name.into(), scene: scene.to_owned(), eye, changes }
    }
}

impl Setting {
    pub fn new<S: Into<String>>(name: impl Into<String>, changes: impl IntoIterator<Item = S>) -> Setting {
        Setting { name: name.into(), changes: changes.into_iter().map(Into::into).collect() }
    }
}

impl Figure {
    /// The views that a window shows, in order.
    pub fn views(&self) -> Vec<FigureView> {
        match self.show.views {
            Views::Scenes(changes) => {
                let views = self.scenes.iter().filter(|scene| scene.contains('/'));
                views.map(|scene| FigureView::new(*scene, scene, changes.iter().copied())).collect()
            }
            Views::Listed(views) => views(),
            Views::Nothing { .. } => Vec::new(),
        }
    }

    /// For a figure without a picture: one line that states this and names the nearest scene.
    pub fn without_picture(&self) -> Option<String> {
        let Views::Nothing { why, nearest } = self.show.views else { return None };
        Some(format!("figure {} has no picture: {why}; the nearest scene is {nearest}", self.id))
    }
}
