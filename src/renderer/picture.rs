//! Output of a renderer after a frame: its picture, and the report.

use super::report::Report;
use super::{RenderError, Renderer};
use crate::picture::PixelFormat;
use crate::picture::write::Srgb8Picture;
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
