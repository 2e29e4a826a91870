//! Checks the texturing of the paper's section 4 with the `ruler` source. Every texel that texturing would filter is
//! fetched unfiltered. The fetched value is compared with the hash of the level and position that the pixel's (s, t)
//! requires. The check covers the pixel's level and the next coarser one, borders, wrapping, poles, and the resident
//! tail.

use super::{Config, footprint::FootprintPass, pyramid_constants, tile_pool::TilePool, with};
use crate::frame::DrawList;
use crate::math::pyramid::Pyramid;
use crate::vk::shader::common::mesh_vert;
use crate::vk::shader::virtual_texture::ruler_frag;
use crate::vk::{
    Clear, Cmd, ColorTarget, Depth, DepthTarget, Format, Gpu, GraphicsInfo, GraphicsPipeline, Image,
    ImageInfo, ReadAs, Resource, Result,
};

pub struct RulerCheck {
    pipeline: GraphicsPipeline,
    /// One verdict per pixel; [`Verdicts::count`] sums them.
    pub verdict: Image,
}

/// Pixel counts of the check.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Verdicts {
    /// Pixels that the textured surface covers.
    pub covered: u64,
    /// Covered pixels with at least one wrong texel.
    pub wrong: u64,
    /// Covered pixels that show the resident tail.
    pub from_g1: u64,
    /// Covered pixels whose own tile is not resident.
    pub not_resident: u64,
}

impl RulerCheck {
    /// # Errors
    /// Out of memory.
    pub fn new(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        stage1: &FootprintPass,
        resident: &TilePool,
    ) -> Result<RulerCheck> {
        let anisotropy = [("MAX_ANISOTROPY", config.filter.max_anisotropy)];
        let constants: Vec<_> = resident.constants().into_iter().chain(anisotropy).collect();
        let pipeline = gpu.graphics_pipeline(&GraphicsInfo {
            specialization: &with(pyramid_constants(pyramid, stage1.format, &config.filter), &constants),
            depth: Some(Depth::Equal),
            colors: &[Format::R32Uint],
            ..GraphicsInfo::triangles(&mesh_vert::SHADER, &ruler_frag::SHADER)
        })?;
        let verdict =
            gpu.image("verdicts", ImageInfo::target(stage1.requests.info().size, Format::R32Uint))?;
        Ok(RulerCheck { pipeline, verdict })
    }

    /// Checks the frame whose stage 1 is `stage1`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw(
        &self,
        cmd: &mut Cmd<'_>,
        stage1: &FootprintPass,
        resident: &TilePool,
        seen: &DrawList<'_>,
    ) -> Result<()> {
        let color = ColorTarget { image: &self.verdict, clear: Clear::Uint([0; 4]) };
        let depth = DepthTarget { image: &stage1.depth, clear: false };
        let resources = [
            (ruler_frag::REQUESTS, Resource::Texture(&stage1.requests, ReadAs::Whole)),
            (ruler_frag::PAGE_TABLE, Resource::Buffer(&resident.page_table_words)),
            (ruler_frag::TILE_POOL, Resource::Texture(&resident.tiles, ReadAs::Raw)),
        ];
        cmd.render(self.verdict.info().size, &[color], Some(depth), |render| {
            seen.draw(render, &resources, |_| &self.pipeline)
        })
    }
}

impl Verdicts {
    /// Sums the verdicts of ruler.frag.
    pub fn count(words: &[u32]) -> Verdicts {
        let mut sum = Verdicts::default();
        for &word in words.iter().filter(|word| **word != 0) {
            sum.covered += 1;
            sum.wrong += u64::from(word & 0x3fff_ffff != 1);
            sum.from_g1 += u64::from(word >> 30 & 1);
            sum.not_resident += u64::from(word >> 31);
        }
        sum
    }
}
