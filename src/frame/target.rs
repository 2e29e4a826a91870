//! The colour and depth target that all techniques of a frame draw into.

use crate::picture;
use crate::vk::{Format, Gpu, Image, ImageInfo, Result};
use std::sync::Arc;

/// Colour and depth of the same size.
#[derive(Clone)]
pub struct Target {
    /// Linear light, stored in the format [`Target::kind`].
    pub color: Arc<Image>,
    /// Reversed: 0 is infinitely far.
    pub depth: Arc<Image>,
    pub kind: picture::PixelFormat,
}

impl Target {
    /// # Errors
    /// Out of memory.
    pub fn new(gpu: &Gpu, size: [u32; 2], kind: picture::PixelFormat) -> Result<Target> {
        Ok(Target {
            color: Arc::new(gpu.image("picture", ImageInfo::target(size, kind.into()))?),
            depth: Arc::new(gpu.image("depth", ImageInfo::target(size, Format::Depth32Float))?),
            kind,
        })
    }

    /// Pixels.
    pub fn size(&self) -> [u32; 2] {
        self.color.info().size
    }
}
