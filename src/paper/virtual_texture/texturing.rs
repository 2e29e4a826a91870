//! Section 4: the picture, from the tiles that are resident.
//!
//! The tile of a pixel is the one that stage 1 wrote into `U1`, bit for bit; a pass over the same mesh, with the
//! same depth, only adds where in the tile the pixel lies and how the two levels mix.

use super::{
    Config, Interpolation, footprint::Footprint, pyramid_constants, resident::Resident,
    resident::fill_levels, surface::Surface, with,
};
use crate::math::pyramid::{Pyramid, TileId};
use crate::texture::source::{TileError, TileFormat, TileSource};
use crate::vk::shader::View as ViewConstants;
use crate::vk::shader::virtual_texture::{mesh_vert, plain_frag, texturing_frag};
use crate::vk::{
    Clear, Cmd, ColorTarget, Depth, DepthTarget, Filter, Format, Gpu, GraphicsInfo, GraphicsPipeline, Image,
    ImageInfo, Resource, Result, Sampler, SamplerInfo, View,
};

/// Linear light of what is no landscape.
pub(super) const SKY: Clear = Clear::Float([0.0, 0.0, 0.0, 1.0]);

/// What `filter.glsl` is specialized with.
pub(super) fn constants(config: &Config, resident: &Resident) -> Vec<(&'static str, u32)> {
    let filter = [
        ("MAX_ANISOTROPY", config.filter.max_anisotropy),
        ("LITERAL_INTERPOLATION", u32::from(config.filter.interpolation == Interpolation::Literal)),
        ("FILTER", config.filter.kind as u32),
        ("SAMPLES", config.filter.samples),
        ("FADE_IN", u32::from(config.fade_in_frames > 0)),
    ];
    resident.constants().into_iter().chain(filter).collect()
}

pub struct Texturing {
    pipeline: GraphicsPipeline,
}

impl Texturing {
    /// # Errors
    /// Out of memory.
    pub fn new(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        stage1: &Footprint,
        resident: &Resident,
        target: Format,
    ) -> Result<Texturing> {
        let constants = constants(config, resident);
        let pipeline = gpu.graphics_pipeline(&GraphicsInfo {
            name: texturing_frag::SHADER.name,
            vertex: &mesh_vert::SHADER,
            geometry: None,
            fragment: Some(&texturing_frag::SHADER),
            specialization: &with(pyramid_constants(pyramid, stage1.format), &constants),
            points: false,
            depth: Some(Depth::Equal),
            colors: &[target],
            logic_or: false,
        })?;
        Ok(Texturing { pipeline })
    }

    /// Draws the picture; `stage1` must have drawn the same view.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw(
        &self,
        cmd: &mut Cmd<'_>,
        stage1: &Footprint,
        resident: &Resident,
        surface: &Surface,
        view: &ViewConstants,
        target: &Image,
    ) -> Result<()> {
        let color = ColorTarget { image: target, clear: SKY };
        let depth = DepthTarget { image: &stage1.depth, clear: false };
        let resources = [
            (texturing_frag::U1, Resource::Texture(&stage1.u1, View::Whole)),
            (texturing_frag::H1, Resource::Buffer(&resident.h1)),
            (texturing_frag::J1, Resource::Sampled(&resident.j1, &resident.sampler)),
        ];
        cmd.render(target.info().size, &[color], Some(depth), |render| {
            let push = bytemuck::bytes_of(view);
            render.draw_mesh(&self.pipeline, &resources, push, &surface.vertices, &surface.indices)
        })
    }
}

/// The yardstick of `--compare-plain`: the same mesh with one plain trilinear RGBA8 texture, at most 4096 wide,
/// filtered in linear light like the tiles.
pub struct Plain {
    pipeline: GraphicsPipeline,
    texture: Image,
    sampler: Sampler,
    depth: Image,
}

impl Plain {
    /// Reads the finest level that is at most 4096 texels a side, and all coarser ones.
    ///
    /// # Errors
    /// Out of memory; a tile cannot be read; BC1 sources have no RGBA8 texels to show.
    pub fn new(
        gpu: &Gpu,
        source: &dyn TileSource,
        target: &Image,
    ) -> std::result::Result<Plain, super::resident::ResidentError> {
        let pyramid = source.pyramid();
        let first = (0..=pyramid.coarsest_level())
            .find(|&level| pyramid.level_size(level).iter().all(|&side| side <= 4096));
        let first = first.expect("the coarsest level is one texel");
        let levels: Vec<Vec<u8>> = (first..=pyramid.coarsest_level())
            .map(|level| whole_level(source, level))
            .collect::<std::result::Result<_, _>>()?;
        let texture = gpu.image(
            "plain texture",
            ImageInfo::texture(pyramid.level_size(first), Format::Rgba8Srgb, levels.len() as u32),
        )?;
        fill_levels(gpu, &texture, &levels)?;
        let pipeline = gpu.graphics_pipeline(&GraphicsInfo {
            name: plain_frag::SHADER.name,
            vertex: &mesh_vert::SHADER,
            geometry: None,
            fragment: Some(&plain_frag::SHADER),
            specialization: &[],
            points: false,
            depth: Some(Depth::Write),
            colors: &[target.info().format],
            logic_or: false,
        })?;
        Ok(Plain {
            pipeline,
            texture,
            sampler: gpu
                .sampler("plain sampler", SamplerInfo { filter: Filter::Linear, wraps_in_s: true })?,
            depth: gpu.image("plain depth", ImageInfo::target(target.info().size, Format::Depth32Float))?,
        })
    }

    pub fn size(&self) -> [u32; 2] {
        self.texture.info().size
    }

    /// # Errors
    /// Out of memory.
    pub fn draw(
        &self,
        cmd: &mut Cmd<'_>,
        surface: &Surface,
        view: &ViewConstants,
        target: &Image,
    ) -> Result<()> {
        let color = ColorTarget { image: target, clear: SKY };
        let depth = DepthTarget { image: &self.depth, clear: true };
        let resources = [(plain_frag::PLAIN, Resource::Sampled(&self.texture, &self.sampler))];
        cmd.render(target.info().size, &[color], Some(depth), |render| {
            let push = bytemuck::bytes_of(view);
            render.draw_mesh(&self.pipeline, &resources, push, &surface.vertices, &surface.indices)
        })
    }
}

/// All texels of one level, from its tiles' payloads or from `G1`.
fn whole_level(source: &dyn TileSource, level: u32) -> std::result::Result<Vec<u8>, TileError> {
    let pyramid = source.pyramid();
    if level >= pyramid.first_resident_level() {
        return source.read_resident_level(level);
    }
    let refused =
        |tile| TileError::Refused { tile, reason: "a BC1 pyramid has no RGBA8 level to compare with".into() };
    let [columns, rows] = pyramid.tile_grid(level);
    let (size, border, stored) =
        (pyramid.tile_size() as usize, pyramid.border_texels() as usize, pyramid.stored_sides()[0] as usize);
    let width = pyramid.level_size(level)[0] as usize;
    let mut texels = vec![0; 4 * width * pyramid.level_size(level)[1] as usize];
    let mut tile_bytes = vec![0; source.format().tile_bytes(&pyramid)];
    for row in 0..rows {
        for column in 0..columns {
            let tile = TileId { level, row, column };
            if source.format() != TileFormat::Rgba8 {
                return Err(refused(tile));
            }
            source.read_tile(tile, &mut tile_bytes)?;
            for y in 0..size {
                let from = 4 * ((y + border) * stored + border);
                let to = 4 * ((row as usize * size + y) * width + column as usize * size);
                texels[to..to + 4 * size].copy_from_slice(&tile_bytes[from..from + 4 * size]);
            }
        }
    }
    Ok(texels)
}
