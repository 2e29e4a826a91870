//! The tile that each pixel requests and the level that the pixel shows, for overlays and the magnifier. For these
//! values, the footprint pass of paper 1 runs a second time. Besides the request image, this second pass writes the
//! inputs of each request: texture coordinates and derivatives.

use ortelius::frame::{Onto, Target, View};
use ortelius::paper::virtual_texture::config::Config;
use ortelius::paper::virtual_texture::footprint::{FootprintDump, FootprintPass};
use ortelius::paper::virtual_texture::shown::ShownLevels;
use ortelius::paper::virtual_texture::{RequestFormat, VirtualTexture, VirtualTextureError};
use ortelius::vk::{self, Depth, Frame, Gpu};
use std::sync::Arc;

/// A separate footprint pass, because fused variants have none and request formats differ.
pub struct Levels {
    stage1: FootprintPass,
    pub open: FootprintDump,
    pub shown: ShownLevels,
}

impl Levels {
    /// Creates the passes for pictures that are drawn into `target`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(gpu: &Gpu, texture: &VirtualTexture, target: &Target) -> Result<Levels, VirtualTextureError> {
        let config = Config { request_format: Some(RequestFormat::Rgba32), ..texture.settings.config };
        let (depth, pyramid) = ((target.depth.clone(), Depth::Equal), texture.source.pyramid());
        let stage1 = FootprintPass::on(gpu, &pyramid, &config, depth, 0)?;
        Ok(Levels {
            open: FootprintDump::new(gpu, &pyramid, &config, &stage1)?,
            shown: ShownLevels::new(gpu, &pyramid, &config, &texture.resident, &stage1)?,
            stage1,
        })
    }

    /// True if the passes were created for this target.
    pub fn fits(&self, target: &Target) -> bool {
        Arc::ptr_eq(&self.stage1.depth, &target.depth)
    }

    /// Draws both passes, with the depth image of the frame.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw(&self, frame: &mut Frame<'_>, texture: &VirtualTexture, view: &View) -> vk::Result<()> {
        let seen = texture.seen(*view).onto(Onto::Drawn);
        frame.pass("tile levels", |cmd| self.open.draw(cmd, &self.stage1, &seen))?;
        frame
            .pass("levels shown", |cmd| self.shown.draw(cmd, &self.stage1, &texture.resident, texture.bias()))
    }
}
