//! `ortelius view`: a scene in a window.
//!
//! The renderer draws into its own target, as in every other command. A later pass copies this picture to the
//! window, so the picture does not depend on the window. All input goes through egui. Input that the panels
//! do not take moves the camera.

mod act;
mod action;
mod app;
mod bookmarks;
mod compared;
mod control;
mod draw;
mod encode;
mod eye;
mod film;
mod filters;
mod ground;
mod inspector;
mod job;
mod judge;
mod labels;
#[cfg(test)]
mod laid_out;
mod levels;
mod live;
mod measure;
mod measured;
mod open_view;
mod overlay;
mod painter;
mod panels;
mod passes;
mod path;
mod probe;
mod reload;
mod response;
mod screen;
mod settings;
mod shot;
mod shown;
mod stage;
mod steer;
mod streamed;
mod timed;
mod variants;
mod views;

pub use measure::STEPS;
pub use open_view::OpenView;
pub use variants::Variant;

use ortelius::figure::Trade;
use ortelius::vk::PresentMode;
use std::path::PathBuf;

/// What to show, and how to show it.
pub struct ViewOptions {
    /// The name of the scene or of the figure.
    pub name: String,
    /// At least one view. The window opens with the first variant of the first view.
    pub views: Vec<OpenView>,
    /// Pixels.
    pub size: [u32; 2],
    /// Present modes in order of preference. The first mode that the window supports is used.
    pub present: Vec<PresentMode>,
    pub deterministic: bool,
    pub panels: bool,
    /// A sweep of the scene's settings; a slider in the panels selects points of its Pareto front.
    pub trade: Option<Trade>,
    /// Record the path, then close the window.
    pub record: bool,
    /// Fly along the path with this many frames per flight, print their times, then close the window.
    pub measure: Option<usize>,
    /// The file that these times are also written to.
    pub times: Option<PathBuf>,
    /// Part of the device's name, or its index.
    pub device: Option<String>,
    pub validate: bool,
    /// Folder for screenshots and recordings.
    pub folder: PathBuf,
}

/// No display is available.
#[derive(Debug, thiserror::Error)]
#[error("no window can be opened ({0}); without a display, use `ortelius render SCENE -o picture.png`")]
pub struct NoDisplay(pub String);

/// Opens the window. Returns after the window is closed.
///
/// # Errors
/// [`NoDisplay`]; an error that stops a renderer; a message of the validation layer; leaked device memory.
pub fn open(opening: ViewOptions) -> anyhow::Result<()> {
    app::run(opening)
}
