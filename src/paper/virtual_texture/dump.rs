//! Read-backs for dumps, tests and comparisons. All wait for the device.

use super::U1Format;
use super::footprint::{BACKGROUND, Footprint, FootprintDump};
use super::ruler::{RulerCheck, Verdicts};
use super::technique::{VirtualTexture, VirtualTextureError};
use crate::frame::{Onto, Run, Seen, Target};
use crate::math::pyramid::Pyramid;
use crate::vk::{self, Depth, Gpu, Image};

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

impl Run<VirtualTexture> {
    /// `U1` of the last frame, decoded; a fused variant, which keeps none, draws it once more.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn u1(&mut self) -> Result<Vec<[u32; 3]>, VirtualTextureError> {
        self.drain()?;
        self.technique.u1(&self.gpu, self.target())
    }

    /// Stage 1 of the last frame laid open.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn footprint(&mut self) -> Result<FootprintPicture, VirtualTextureError> {
        self.drain()?;
        self.technique.footprint(&self.gpu, self.target())
    }

    /// Judges the last frame on a `ruler` texture: is every fetched texel the right one?
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn ruler_verdicts(&mut self) -> Result<Verdicts, VirtualTextureError> {
        self.drain()?;
        self.technique.ruler_verdicts(&self.gpu, self.target())
    }
}

/// Of the last frame, which has ended; its depth is complete in the target.
impl VirtualTexture {
    /// The shapes of the last frame, on its own depth.
    fn last_seen(&self, target: &Target) -> Seen<'_> {
        self.seen(self.last_view(target.size())).onto(Onto::Drawn)
    }

    /// A stage 1 that has drawn the last frame, where the variant has none of its own.
    fn own_stage1(&self, gpu: &Gpu, target: &Target) -> Result<Option<Footprint>, VirtualTextureError> {
        if self.stage1().is_some() {
            return Ok(None);
        }
        let depth = (target.depth.clone(), Depth::Equal);
        let stage1 = Footprint::on(gpu, &self.source.pyramid(), &self.settings.config, depth, 0)?;
        let mut frame = gpu.frame()?;
        frame.pass("footprint", |cmd| stage1.draw(cmd, &self.last_seen(target)))?;
        frame.submit()?.wait()?;
        Ok(Some(stage1))
    }

    fn stage1_or<'a>(&'a self, own: &'a Option<Footprint>) -> &'a Footprint {
        own.as_ref().or(self.stage1()).expect("a variant has a stage 1 or gets one")
    }

    /// As [`Run::u1`].
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn u1(&self, gpu: &Gpu, target: &Target) -> Result<Vec<[u32; 3]>, VirtualTextureError> {
        let own = self.own_stage1(gpu, target)?;
        Ok(read_u1(gpu, self.stage1_or(&own), &self.source.pyramid())?)
    }

    /// As [`Run::footprint`].
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn footprint(&self, gpu: &Gpu, target: &Target) -> Result<FootprintPicture, VirtualTextureError> {
        let pyramid = self.source.pyramid();
        let own = self.own_stage1(gpu, target)?;
        let stage1 = self.stage1_or(&own);
        let dump = FootprintDump::new(gpu, &pyramid, &self.settings.config, stage1)?;
        let mut frame = gpu.frame()?;
        frame.pass("footprint dump", |cmd| dump.draw(cmd, stage1, &self.last_seen(target)))?;
        frame.submit()?.wait()?;
        let floats = |image| -> Result<Vec<[f32; 4]>, VirtualTextureError> {
            let bytes = gpu.read_image(image)?;
            Ok(bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect())
        };
        let coordinates = floats(&dump.coordinates)?.into_iter().map(|[s, t, ..]| [s, t]).collect();
        let derivatives = floats(&dump.derivatives)?;
        Ok(FootprintPicture { coordinates, derivatives, triples: read_u1(gpu, stage1, &pyramid)? })
    }

    /// As [`Run::ruler_verdicts`].
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn ruler_verdicts(&self, gpu: &Gpu, target: &Target) -> Result<Verdicts, VirtualTextureError> {
        let own = self.own_stage1(gpu, target)?;
        let stage1 = self.stage1_or(&own);
        let check =
            RulerCheck::new(gpu, &self.source.pyramid(), &self.settings.config, stage1, &self.resident)?;
        let mut frame = gpu.frame()?;
        frame.pass("ruler", |cmd| check.draw(cmd, stage1, &self.resident, &self.last_seen(target)))?;
        frame.submit()?.wait()?;
        Ok(Verdicts::count(&read_words(gpu, &check.verdict)?))
    }
}
