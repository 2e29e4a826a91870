//! Output of a renderer after a frame: its picture, and the report.

use super::report::Report;
use super::{RenderError, Renderer};
use crate::picture::write::Srgb8Picture;
use crate::picture::{Picture, PixelFormat};
use crate::scene::Scene;

impl Renderer {
    /// The last frame's picture in sRGB bytes; [`Srgb8Picture::save`] writes it as a PNG.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn picture(&mut self) -> Result<Srgb8Picture, RenderError> {
        let [width, height] = self.size();
        Ok(match self.kind() {
            PixelFormat::Srgb8 => Srgb8Picture { width, height, rgba: self.picture_bytes()? },
            PixelFormat::Linear32 => Srgb8Picture::from(&self.linear_picture()?),
        })
    }

    /// The last frame's picture in linear light: exact with [`PixelFormat::Linear32`], otherwise decoded from sRGB bytes.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn linear_picture(&mut self) -> Result<Picture, RenderError> {
        let [width, height] = self.size();
        let bytes = self.picture_bytes()?;
        let pixel = bytemuck::pod_read_unaligned::<[f32; 4]>;
        Ok(match self.kind() {
            PixelFormat::Srgb8 => Picture::from(&Srgb8Picture { width, height, rgba: bytes }),
            PixelFormat::Linear32 => Picture::new(width, height, bytes.chunks_exact(16).map(pixel).collect()),
        })
    }

    /// All measurements of the frames so far, for [`Report::save`]. `view` describes what the frames show.
    /// `ortelius render REPORT.json` cannot repeat such a run, because only the caller knows which frames were
    /// rendered.
    ///
    /// # Errors
    /// Device lost.
    pub fn report(&mut self, scene: &Scene, view: &str) -> Result<Report, RenderError> {
        self.drain()?;
        Ok(Report::of(self, &scene.name, view, None))
    }
}
