//! Switches between the views of the window. A scene has one view; a figure has one or more.

use super::bookmarks::Bookmarks;
use super::eye::Eye;
use super::ground::GroundHeights;
use super::live::{ECHO, Live};
use anyhow::bail;
use ortelius::renderer::Kept;

impl Live {
    /// Requests another view of the figure.
    ///
    /// # Errors
    /// There is only one view; or as [`super::stage::Stage::show_view`].
    pub(super) fn show_view(&mut self, view: usize) -> anyhow::Result<(Option<Kept>, String)> {
        let count = self.stage.views.len();
        if count == 1 {
            bail!("there is one view; `ortelius view FIGURE` opens all views of a figure");
        }
        let kept = self.stage.show_view(view)?;
        Ok((kept, format!("view {} of {count}: {}", view + 1, self.stage.views[view].name)))
    }

    /// The view that is `by` positions after the view requested last.
    pub(super) fn view_after(&self, by: isize) -> usize {
        let [_, wanted] = self.stage.view();
        (wanted as isize + by).rem_euclid(self.stage.views.len() as isize) as usize
    }

    /// Takes over camera, path and bookmarks of the shown view, if the shown view has changed.
    pub(super) fn follow_view(&mut self) {
        let [shown, _] = self.stage.view();
        if std::mem::replace(&mut self.view, shown) == shown {
            return;
        }
        let view = &self.stage.views[shown];
        self.eye = Eye::new(view.camera);
        self.player = view.player();
        self.ground = GroundHeights::of(&view.scene);
        (self.frozen, self.hold, self.last_pose) = (None, None, None);
        let (bookmarks, read) = Bookmarks::open(&view.scene);
        self.bookmarks = bookmarks;
        let front = self.stage.front();
        self.trade.iter_mut().for_each(|trade| trade.select(front));
        self.echo = ECHO;
        if let Err(error) = read {
            self.report(&error);
        }
    }
}
