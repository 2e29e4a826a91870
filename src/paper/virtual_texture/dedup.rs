//! Stage 2, section 2.2: a geometry shader turns each block of `2^p x 2^p` pixels of `U1` into points, one for each
//! triple that differs from the one before (the "memo"); a logic OR of `1 << q` merges equal ones in `U2`.
//!
//! Where we differ: points sit on texel centres (the printed corners lose every tile's row and column 0), and
//! p = 4 is split over two invocations, because 256 points of 5 components exceed the 1024 that Vulkan promises.

use super::{Config, Keying, footprint::Footprint, pyramid_constants, with};
use crate::math::pyramid::Pyramid;
use crate::vk::shader::Blocks;
use crate::vk::shader::virtual_texture::{blocks_vert, dedup_frag, dedup_geom};
use crate::vk::{
    Clear, Cmd, ColorTarget, Format, Gpu, GraphicsInfo, GraphicsPipeline, Image, ImageInfo, Resource, Result,
    View,
};

pub struct Dedup {
    pipeline: GraphicsPipeline,
    block_log2: u32,
    grid: [u32; 2],
}

/// The draw of one vertex for each block of a picture.
pub(super) fn blocks(size: [u32; 2], block_log2: u32) -> (Blocks, u32) {
    let [columns, rows] = size.map(|side| side.div_ceil(1 << block_log2));
    (Blocks { size, columns }, columns * rows)
}

impl Dedup {
    /// # Errors
    /// The device's geometry shader cannot emit a block's points; out of memory.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config, stage1: &Footprint) -> Result<Dedup> {
        let constants =
            [("MEMO", u32::from(config.memo)), ("NATIVE_KEYING", u32::from(config.keying == Keying::Native))];
        let shader = &dedup_geom::SHADERS[config.block_log2 as usize];
        // 5 components a point: position and mask. p = 4 runs twice 128 points.
        let points = (1 << (2 * config.block_log2)).min(128);
        let invocations = if config.block_log2 == 4 { 2 } else { 1 };
        gpu.require_geometry(shader.name, points, 5 * points, invocations)?;
        Ok(Dedup {
            pipeline: gpu.graphics_pipeline(&GraphicsInfo {
                name: shader.name,
                vertex: &blocks_vert::SHADER,
                geometry: Some(shader),
                fragment: Some(&dedup_frag::SHADER),
                specialization: &with(pyramid_constants(pyramid, stage1.format), &constants),
                points: true,
                depth: None,
                colors: &[Format::R32Uint],
                logic_or: true,
            })?,
            block_log2: config.block_log2,
            grid: pyramid.tile_grid(0),
        })
    }

    /// An empty `U2`: a texel for each tile of level 0, a bit for each level.
    ///
    /// # Errors
    /// The device's images are not as large as the grid; out of memory.
    pub fn u2(&self, gpu: &Gpu) -> Result<Image> {
        gpu.image("U2", ImageInfo::target(self.grid, Format::R32Uint))
    }

    /// Clears `u2` and ORs the bits of `u1` into it.
    ///
    /// # Errors
    /// Out of memory.
    pub fn run(&self, cmd: &mut Cmd<'_>, u1: &Image, u2: &Image) -> Result<()> {
        let (push, count) = blocks(u1.info().size, self.block_log2);
        let target = ColorTarget { image: u2, clear: Clear::Uint([0; 4]) };
        cmd.render(self.grid, &[target], None, |render| {
            let resources = [(dedup_geom::U1, Resource::Texture(u1, View::Whole))];
            render.draw(&self.pipeline, &resources, bytemuck::bytes_of(&push), count)
        })
    }
}
