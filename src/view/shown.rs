//! The data that the panels show.

use super::action::CompareMode;
use super::labels::Label;
use super::overlay::Overlay;
use super::path::Player;
use super::probe::ProbedPixel;
use super::stage::Stage;
use egui::{Pos2, TextureHandle};
use ortelius::figure::{TimedSetting, Trade};
use ortelius::scene::camera::Camera;
use ortelius::vk::PassResources;

pub struct PanelInput<'a> {
    pub stage: &'a Stage,
    pub camera: &'a Camera,
    pub player: &'a Player,
    /// Frames of the recording: written, and total.
    pub film: Option<(usize, usize)>,
    pub comparison: CompareMode,
    /// The false-colour map over the window, and a line that describes it.
    pub judged: Option<(TextureHandle, String)>,
    pub trade: Option<&'a Front>,
    pub overlay: Option<Overlay>,
    /// The values of the magnified pixel.
    pub found: Option<&'a ProbedPixel>,
    /// Outline of the frozen camera's view, in points.
    pub outline: Vec<Option<Pos2>>,
    /// Names of the visible tiles, if the overlay of levels is shown.
    pub labels: &'a [Label],
    /// The resources of each pass of the last recorded frame; empty while no panel shows them.
    pub resources: &'a [PassResources],
}

#[cfg(test)]
impl<'a> PanelInput<'a> {
    /// Nothing but the scene.
    pub fn of(stage: &'a Stage, camera: &'a Camera, player: &'a Player) -> PanelInput<'a> {
        PanelInput {
            stage,
            camera,
            player,
            film: None,
            comparison: CompareMode::Pictures,
            judged: None,
            trade: None,
            overlay: None,
            found: None,
            outline: Vec::new(),
            labels: &[],
            resources: &[],
        }
    }
}

/// The Pareto-optimal settings of a sweep, from the smallest error to the shortest time, and the selected one.
pub struct Front {
    pub front: Vec<TimedSetting>,
    /// Name of the error measure.
    pub measure: String,
    pub at: Option<usize>,
}

impl Front {
    pub fn of(trade: &Trade) -> Front {
        let front = trade.front().into_iter().cloned().collect();
        Front { front, measure: trade.measure.clone(), at: None }
    }

    /// Selects the setting with these changes, if a setting was selected before.
    pub fn select(&mut self, changes: &[String]) {
        self.at = self.at.and(self.front.iter().position(|setting| setting.changes == changes));
    }
}
