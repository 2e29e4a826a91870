//! `ortelius view`: a scene in a window.
//!
//! The renderer draws into its own target, as everywhere; a pass behind its passes shows that picture in the window, so
//! nothing that is seen depends on there being one. All input comes through egui: a key or a drag is the panels' where
//! they want it, and the eye's otherwise.

mod action;
mod app;
mod control;
mod eye;
mod film;
mod live;
mod painter;
mod panels;
mod path;
mod screen;
mod settings;
mod shot;
mod stage;

pub use stage::Variant;

use ortelius::scene::Scene;
use ortelius::scene::camera::Camera;
use ortelius::vk::PresentMode;
use std::path::PathBuf;

/// What is to be seen, and how.
pub struct Opening {
    pub scene: Scene,
    pub camera: Camera,
    /// Pixels.
    pub size: [u32; 2],
    /// The first is shown; empty: the scene's own, and those of its paper.
    pub variants: Vec<Variant>,
    pub present: PresentMode,
    pub deterministic: bool,
    pub panels: bool,
    /// Part of a device's name, or its index.
    pub device: Option<String>,
    pub validate: bool,
    /// Where screenshots and recordings go.
    pub folder: PathBuf,
}

/// There is nowhere to open a window.
#[derive(Debug, thiserror::Error)]
#[error("no window can be opened ({0}); without a display: `ortelius render SCENE -o picture.png`")]
pub struct NoDisplay(pub String);

/// Opens the window; returns when it is closed.
///
/// # Errors
/// [`NoDisplay`]; whatever stops a renderer; messages of the validation layer; device memory that was not given back.
pub fn open(opening: Opening) -> anyhow::Result<()> {
    app::run(opening)
}
