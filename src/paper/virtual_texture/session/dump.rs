//! Read-backs for dumps, tests and comparisons. All wait for the device.

use super::super::footprint::{BACKGROUND, Footprint, FootprintDump};
use super::super::pipeline::Pipeline;
use super::super::ruler::{RulerCheck, Verdicts};
use super::super::{U1Format, surface};
use super::{Session, SessionError};
use crate::math::{camera::Pose, pyramid::Pyramid};
use crate::vk::{self, Gpu, Image};

/// Stage 1 laid open: for each pixel, from the top left.
pub struct FootprintPicture {
    /// s, t, NaN where there is no landscape.
    pub coordinates: Vec<[f32; 2]>,
    /// ds/dx, dt/dx, ds/dy, dt/dy.
    pub derivatives: Vec<[f32; 4]>,
    /// (q, i, j) as in `U1`, (i, j) in M0; q = u32::MAX where there is no landscape.
    pub triples: Vec<[u32; 3]>,
}

/// An image's first level as 32-bit words.
///
/// # Errors
/// Device lost, out of memory.
pub fn read_words(gpu: &Gpu, image: &Image) -> vk::Result<Vec<u32>> {
    let bytes = gpu.read_image(image)?;
    Ok(bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect())
}

/// `U1` as it stands, decoded: (q, i, j) for each pixel.
///
/// # Errors
/// Device lost, out of memory.
pub fn read_u1(gpu: &Gpu, stage1: &Footprint, pyramid: &Pyramid) -> vk::Result<Vec<[u32; 3]>> {
    let words = read_words(gpu, &stage1.u1)?;
    Ok(match stage1.format {
        U1Format::Rgb32 => words.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
        U1Format::Rgba32 => words.chunks_exact(4).map(|c| [c[0], c[1], c[2]]).collect(),
        U1Format::Packed => {
            let [columns, rows] = pyramid.tile_grid(0);
            let unpack = |word: u32| match word {
                BACKGROUND => [BACKGROUND; 3],
                word => [word / columns / rows, word / columns % rows, word % columns],
            };
            words.into_iter().map(unpack).collect()
        }
    })
}

impl Session {
    /// A stage 1 that has drawn `pose`, where the variant has none of its own.
    fn own_stage1(&self, pose: &Pose) -> Result<Option<Footprint>, SessionError> {
        let (config, pyramid) = (&self.settings.config, self.source.pyramid());
        if !config.fused() {
            return Ok(None);
        }
        let stage1 = Footprint::new(&self.gpu, &pyramid, config, self.settings.size)?;
        let view = surface::view(pose, self.settings.size, self.bias);
        let mut frame = self.gpu.frame()?;
        frame.pass("footprint", |cmd| stage1.draw(cmd, &self.pipeline.surface, &view))?;
        frame.submit()?.wait()?;
        Ok(Some(stage1))
    }

    fn stage1_or<'a>(&'a self, own: &'a Option<Footprint>) -> &'a Footprint {
        own.as_ref().or(self.pipeline.stage1()).expect("a variant has a stage 1 or gets one")
    }

    /// `U1` of the last frame, decoded; a fused variant, which keeps none, draws it once more.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn u1(&mut self) -> Result<Vec<[u32; 3]>, SessionError> {
        self.drain()?;
        let (pose, _) = self.pose.expect("U1 is asked for after a frame");
        let own = self.own_stage1(&pose)?;
        Ok(read_u1(&self.gpu, self.stage1_or(&own), &self.source.pyramid())?)
    }

    /// Draws stage 1 once more from `pose`, with its inputs laid open.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn footprint(&mut self, pose: &Pose) -> Result<FootprintPicture, SessionError> {
        self.drain()?;
        let pyramid = self.source.pyramid();
        let own = self.own_stage1(pose)?;
        let stage1 = self.stage1_or(&own);
        let dump = FootprintDump::new(&self.gpu, &pyramid, &self.settings.config, stage1)?;
        let view = surface::view(pose, self.settings.size, self.bias);
        let mut frame = self.gpu.frame()?;
        frame.pass("footprint dump", |cmd| dump.draw(cmd, stage1, &self.pipeline.surface, &view))?;
        frame.submit()?.wait()?;
        let floats = |image| -> Result<Vec<[f32; 4]>, SessionError> {
            let bytes = self.gpu.read_image(image)?;
            Ok(bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect())
        };
        let coordinates = floats(&dump.coordinates)?.into_iter().map(|[s, t, ..]| [s, t]).collect();
        let derivatives = floats(&dump.derivatives)?;
        Ok(FootprintPicture { coordinates, derivatives, triples: read_u1(&self.gpu, stage1, &pyramid)? })
    }

    /// Judges the last frame, whose pose was `pose`, on a `ruler` texture: is every fetched texel the right one?
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn ruler_verdicts(&mut self, pose: &Pose) -> Result<Verdicts, SessionError> {
        self.drain()?;
        let pyramid = self.source.pyramid();
        let Pipeline { resident, surface: mesh, .. } = &self.pipeline;
        let own = self.own_stage1(pose)?;
        let stage1 = self.stage1_or(&own);
        let check = RulerCheck::new(&self.gpu, &pyramid, &self.settings.config, stage1, resident)?;
        let view = surface::view(pose, self.settings.size, self.bias);
        let mut frame = self.gpu.frame()?;
        frame.pass("ruler", |cmd| check.draw(cmd, stage1, resident, mesh, &view))?;
        frame.submit()?.wait()?;
        Ok(Verdicts::count(&read_words(&self.gpu, &check.verdict)?))
    }
}
