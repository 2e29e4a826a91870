//! The shown and the requested level of each pixel, for the window's overlays. A pass looks up the request image in the
//! page table.

use super::{
    Config, RequestFormat, footprint::FootprintPass, pyramid_constants, texturing, tile_pool::TilePool, with,
};
use crate::math::pyramid::Pyramid;
use crate::vk::shader::Shown as Push;
use crate::vk::shader::common::screen_vert;
use crate::vk::shader::virtual_texture::shown_frag;
use crate::vk::{
    Clear, Cmd, ColorTarget, Format, Gpu, GraphicsInfo, GraphicsPipeline, Image, ImageInfo, ReadAs, Resource,
    Result,
};

/// The picture of levels, and its pass.
pub struct ShownLevels {
    /// Level, row and column of the requested tile, and the level shown. All ones for the background.
    pub image: Image,
    pipeline: GraphicsPipeline,
}

impl ShownLevels {
    /// Creates the pass for a stage 1 with four words per pixel (`Rgba32`).
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        resident: &TilePool,
        stage1: &FootprintPass,
    ) -> Result<ShownLevels> {
        assert_eq!(stage1.format, RequestFormat::Rgba32, "request image");
        let constants = texturing::constants(config, resident);
        let known =
            |(name, _): &(&str, u32)| shown_frag::SHADER.specialization.iter().any(|(n, _)| n == name);
        let constants: Vec<_> = constants.into_iter().filter(known).collect();
        Ok(ShownLevels {
            image: gpu
                .image("levels shown", ImageInfo::target(stage1.requests.info().size, Format::Rgba32Uint))?,
            pipeline: gpu.graphics_pipeline(&GraphicsInfo {
                specialization: &with(pyramid_constants(pyramid, stage1.format, &config.filter), &constants),
                colors: &[Format::Rgba32Uint],
                ..GraphicsInfo::triangles(&screen_vert::SHADER, &shown_frag::SHADER)
            })?,
        })
    }

    /// Looks up the request image of `stage1`, with the last frame's level bias.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw(
        &self,
        cmd: &mut Cmd<'_>,
        stage1: &FootprintPass,
        resident: &TilePool,
        level_bias: u32,
    ) -> Result<()> {
        let color = ColorTarget { image: &self.image, clear: Clear::Uint([u32::MAX; 4]) };
        let resources = [
            (shown_frag::REQUESTS, Resource::Texture(&stage1.requests, ReadAs::Whole)),
            (shown_frag::PAGE_TABLE, Resource::Buffer(&resident.page_table_words)),
        ];
        cmd.render(self.image.info().size, &[color], None, |render| {
            render.draw(&self.pipeline, &resources, bytemuck::bytes_of(&Push { level_bias }), 3)
        })
    }
}
