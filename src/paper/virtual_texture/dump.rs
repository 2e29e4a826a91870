//! Read-backs for dumps, tests and comparisons. They all wait for the device.

use super::footprint::{BACKGROUND, FootprintDump, FootprintPass};
use super::ruler::{RulerCheck, Verdicts};
use super::technique::{VirtualTexture, VirtualTextureError};
use super::texturing::Texturing;
use super::{Config, RequestFormat, config::Filter, reach};
use crate::frame::{DrawList, Onto, Run, Target};
use crate::math::pyramid::Pyramid;
use crate::vk::{self, Depth, Format, Gpu, Image, ImageInfo};

/// Inputs and outputs of stage 1 for each pixel, from the top left.
pub struct FootprintPicture {
    /// s, t; NaN for the background.
    pub coordinates: Vec<[f32; 2]>,
    /// ds/dx, dt/dx, ds/dy, dt/dy; if the filter bounds footprints at a sphere's limb, after the bound.
    pub derivatives: Vec<[f32; 4]>,
    /// (q, i, j) as in the request image, (i, j) in level 0's tile grid; q = u32::MAX for the background.
    pub triples: Vec<[u32; 3]>,
    /// The neighbouring tiles that the filter also needs, as bits of [`reach`].
    pub reaches: Vec<u32>,
}

/// The mean of [`Run::texels_fetched`] over the covered pixels; NaN if there are none.
pub fn texels_per_pixel(fetched: &[u32]) -> f64 {
    let covered = fetched.iter().filter(|texels| **texels > 0).count();
    fetched.iter().map(|&texels| f64::from(texels)).sum::<f64>() / covered as f64
}

/// An image's first level as 32-bit words.
///
/// # Errors
/// Device lost, out of memory.
pub fn read_words(gpu: &Gpu, image: &Image) -> vk::Result<Vec<u32>> {
    let bytes = gpu.read_image(image)?;
    Ok(bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect())
}

/// The decoded request image: (q, i, j) for each pixel.
///
/// # Errors
/// Device lost, out of memory.
pub fn read_requests(gpu: &Gpu, stage1: &FootprintPass, pyramid: &Pyramid) -> vk::Result<Vec<[u32; 3]>> {
    Ok(read_reaches(gpu, stage1, pyramid)?.into_iter().map(|(triple, _)| triple).collect())
}

/// As [`read_requests`]; each triple comes with its reach.
///
/// # Errors
/// Device lost, out of memory.
pub fn read_reaches(
    gpu: &Gpu,
    stage1: &FootprintPass,
    pyramid: &Pyramid,
) -> vk::Result<Vec<([u32; 3], u32)>> {
    let words = read_words(gpu, &stage1.requests)?;
    let texel = |words: &[u32]| {
        let (first, reach) = if stage1.reaches { reach::split(words[0]) } else { (words[0], 0) };
        let [columns, rows] = pyramid.tile_grid(0);
        let triple = match (stage1.format, first) {
            (RequestFormat::Rgb32 | RequestFormat::Rgba32, q) => [q, words[1], words[2]],
            (RequestFormat::Packed, BACKGROUND) => [BACKGROUND; 3],
            (RequestFormat::Packed, word) => [word / columns / rows, word / columns % rows, word % columns],
        };
        (triple, reach)
    };
    Ok(words.chunks_exact(stage1.format.words()).map(texel).collect())
}

impl Run<VirtualTexture> {
    /// The decoded request image of the last frame. A fused variant has no request image; this call draws one.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn requests(&mut self) -> Result<Vec<[u32; 3]>, VirtualTextureError> {
        self.drain()?;
        self.technique.requests(&self.gpu, self.target())
    }

    /// Inputs and outputs of stage 1 of the last frame.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn footprint(&mut self) -> Result<FootprintPicture, VirtualTextureError> {
        self.drain()?;
        self.technique.footprint(&self.gpu, self.target())
    }

    /// The number of texels that `filter` fetches from the tile pool in each pixel of the last frame, counted by the
    /// shader ([`Texturing::counting`]); 0 for the background. `filter` must have the settings' `max_anisotropy`.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn texels_fetched(&mut self, filter: &Filter) -> Result<Vec<u32>, VirtualTextureError> {
        self.drain()?;
        self.technique.texels_fetched(&self.gpu, self.target(), filter)
    }

    /// Checks the last frame on a `ruler` texture: is every fetched texel the right one?
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn ruler_verdicts(&mut self) -> Result<Verdicts, VirtualTextureError> {
        self.drain()?;
        self.technique.ruler_verdicts(&self.gpu, self.target())
    }
}

/// These functions require that the last frame has ended, so that its depth is complete in the target.
impl VirtualTexture {
    /// The shapes of the last frame, to be drawn onto that frame's depth.
    fn last_seen(&self, target: &Target) -> DrawList<'_> {
        self.seen(self.last_view(target.size())).onto(Onto::Drawn)
    }

    /// Creates a stage 1 and draws the last frame with it; `None` if the variant already has a stage 1.
    fn own_stage1(&self, gpu: &Gpu, target: &Target) -> Result<Option<FootprintPass>, VirtualTextureError> {
        if self.stage1().is_some() {
            return Ok(None);
        }
        let depth = (target.depth.clone(), Depth::Equal);
        let stage1 = FootprintPass::on(gpu, &self.source.pyramid(), &self.settings.config, depth, 0)?;
        gpu.run_pass("footprint", |cmd| stage1.draw(cmd, &self.last_seen(target)))?;
        Ok(Some(stage1))
    }

    fn stage1_or<'a>(&'a self, own: &'a Option<FootprintPass>) -> &'a FootprintPass {
        own.as_ref().or(self.stage1()).expect("a variant has a stage 1 or gets one")
    }

    /// As [`Run::requests`].
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn requests(&self, gpu: &Gpu, target: &Target) -> Result<Vec<[u32; 3]>, VirtualTextureError> {
        let own = self.own_stage1(gpu, target)?;
        Ok(read_requests(gpu, self.stage1_or(&own), &self.source.pyramid())?)
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
        gpu.run_pass("footprint dump", |cmd| dump.draw(cmd, stage1, &self.last_seen(target)))?;
        let floats = |image| -> Result<Vec<[f32; 4]>, VirtualTextureError> {
            let bytes = gpu.read_image(image)?;
            Ok(bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect())
        };
        let coordinates = floats(&dump.coordinates)?.into_iter().map(|[s, t, ..]| [s, t]).collect();
        let derivatives = floats(&dump.derivatives)?;
        let (triples, reaches) = read_reaches(gpu, stage1, &pyramid)?.into_iter().unzip();
        Ok(FootprintPicture { coordinates, derivatives, triples, reaches })
    }

    /// As [`Run::texels_fetched`].
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn texels_fetched(
        &self,
        gpu: &Gpu,
        target: &Target,
        filter: &Filter,
    ) -> Result<Vec<u32>, VirtualTextureError> {
        let config = Config { filter: *filter, ..self.settings.config };
        let own = self.own_stage1(gpu, target)?;
        let (stage1, pyramid, format) = (self.stage1_or(&own), self.source.pyramid(), Format::Rgba32Float);
        let counts = gpu.image("texels fetched", ImageInfo::target(target.size(), format))?;
        let counting = Texturing::counting(gpu, &pyramid, &config, stage1, &self.resident, format)?;
        let seen = self.last_seen(target).onto(Onto::Cleared([0.0; 3]));
        gpu.run_pass("texels fetched", |cmd| counting.draw(cmd, stage1, &self.resident, &seen, &counts))?;
        let bytes = gpu.read_image(&counts)?;
        let count = |pixel: &[u8]| bytemuck::pod_read_unaligned::<f32>(&pixel[..4]) as u32;
        Ok(bytes.chunks_exact(16).map(count).collect())
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
        gpu.run_pass("ruler", |cmd| check.draw(cmd, stage1, &self.resident, &self.last_seen(target)))?;
        Ok(Verdicts::count(&read_words(gpu, &check.verdict)?))
    }
}
