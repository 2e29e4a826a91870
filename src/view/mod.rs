//! `ortelius view`: a scene in a window.
//!
//! The renderer draws into its own target, as everywhere; a later pass shows that picture in the window, so the
//! picture does not depend on the window. All input goes through egui: the panels use a key or a drag if they want it;
//! otherwise the camera does.

mod act;
mod action;
mod app;
mod bookmarks;
mod compared;
mod control;
mod encode;
mod eye;
mod film;
mod inspector;
mod judge;
mod levels;
mod live;
mod measure;
mod overlay;
mod painter;
mod panels;
mod path;
mod probe;
mod reload;
mod screen;
mod settings;
mod shot;
mod shown;
mod stage;
mod terrain;

pub use stage::Variant;

use ortelius::figure::Trade;
use ortelius::scene::Scene;
use ortelius::scene::camera::Camera;
use ortelius::vk::PresentMode;
use std::path::PathBuf;

/// What to show, and how.
pub struct Opening {
    pub scene: Scene,
    pub camera: Camera,
    /// Pixels.
    pub size: [u32; 2],
    /// The first one is shown. If empty: the scene's own variant, and those of its paper.
    pub variants: Vec<Variant>,
    pub present: PresentMode,
    pub deterministic: bool,
    pub panels: bool,
    /// A sweep of the scene's settings; the slider follows its Pareto front.
    pub trade: Option<Trade>,
    /// Records the path, then closes.
    pub record: bool,
    /// Prints frame times along the path, then closes.
    pub measure: bool,
    /// Part of a device's name, or its index.
    pub device: Option<String>,
    pub validate: bool,
    /// Folder of screenshots and recordings.
    pub folder: PathBuf,
}

/// No display is available.
#[derive(Debug, thiserror::Error)]
#[error("no window can be opened ({0}); without a display: `ortelius render SCENE -o picture.png`")]
pub struct NoDisplay(pub String);

/// Opens the window; returns when it is closed.
///
/// # Errors
/// [`NoDisplay`]; any error that stops a renderer; messages of the validation layer; leaked device memory.
pub fn open(opening: Opening) -> anyhow::Result<()> {
    app::run(opening)
}
