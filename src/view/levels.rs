//! Which level each pixel asks for, and where its tiles end: stage 1 of paper 1 once more, for the present pass to colour.

use ortelius::frame::{Onto, Target, View};
use ortelius::paper::virtual_texture::config::Config;
use ortelius::paper::virtual_texture::footprint::Footprint;
use ortelius::paper::virtual_texture::{U1Format, VirtualTexture, VirtualTextureError};
use ortelius::vk::{self, Depth, Frame, Gpu, Image};
use std::sync::Arc;

/// A stage 1 of its own: fused variants have none, and formats differ.
pub struct Levels(Footprint);

impl Levels {
    /// For the pictures that are drawn into `target`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(gpu: &Gpu, texture: &VirtualTexture, target: &Target) -> Result<Levels, VirtualTextureError> {
        let config = Config { u1: Some(U1Format::Rgba32), ..texture.settings.config };
        let depth = (target.depth.clone(), Depth::Equal);
        Ok(Levels(Footprint::on(gpu, &texture.source.pyramid(), &config, depth, 0)?))
    }

    /// Whether it still belongs to the target.
    pub fn fits(&self, target: &Target) -> bool {
        Arc::ptr_eq(&self.0.depth, &target.depth)
    }

    /// Draws it, on the depth that the frame has drawn.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw(&self, frame: &mut Frame<'_>, texture: &VirtualTexture, view: &View) -> vk::Result<()> {
        frame.pass("tile levels", |cmd| self.0.draw(cmd, &texture.seen(*view).onto(Onto::Drawn)))
    }

    /// (q, i, j) of each pixel, in four words.
    pub fn image(&self) -> &Image {
        &self.0.u1
    }
}
