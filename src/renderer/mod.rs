//! Converts a scene to passes. A scene gets only the device features, memory and passes that its surfaces need.

pub mod auto;
pub mod figures;
pub mod report;
pub mod sections;
pub mod trade;
pub mod truth;

mod open;
mod picture;
mod plain;
pub mod relief_steps;
mod relief_truth;
mod surface;
mod switch;
mod technique;

pub use open::Options;
pub use switch::{Kept, LoadedSwitch, Switch};
pub use technique::{Carrier, Record, Surfaces};

use crate::frame::{Run, Stalled};
use crate::paper::progressive_mesh::{LoadError, SurfaceError};
use crate::paper::virtual_texture::config::TextureError;
use crate::paper::virtual_texture::{Unfit, VirtualTextureError};
use crate::scene::SceneError;
use crate::texture::plain::PlainError;
use crate::vk;
use thiserror::Error;

/// A scene on a device.
pub type Renderer = Run<Surfaces>;

/// Errors that stop rendering.
#[derive(Debug, Error)]
pub enum RenderError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Texture(#[from] TextureError),
    #[error("{place}: {error}")]
    Plain { place: String, error: PlainError },
    #[error(transparent)]
    Unfit(#[from] Unfit),
    #[error(transparent)]
    VirtualTexture(#[from] VirtualTextureError),
    #[error(transparent)]
    Load(#[from] LoadError),
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    #[error(transparent)]
    Stalled(#[from] Stalled),
    #[error(
        "--deterministic: governor.frame_ms follows measured times, which differ between runs; set \
         governor.frame_faces, a budget in faces"
    )]
    MeasuredBudget,
    #[error(
        "governor.frame_ms: this device has no timestamps; set governor.frame_faces, a budget in faces, or choose \
         another device"
    )]
    NoClock,
    /// [`Options::stop`] was set.
    #[error("stopped before the scene was open")]
    Stopped,
    #[error(transparent)]
    Vulkan(#[from] vk::Error),
}
