//! Section 4: the picture, from the resident tiles.
//!
//! A pixel's tile is exactly the one that stage 1 wrote into the request image. A pass over the same mesh, with the
//! same depth, computes only the position within the tile and the weights of the two levels.
//!
//! With [`RequestDraw::Texturing`], which is not in the paper, the pass itself writes the request image, as its second
//! colour attachment. Stages 2 and 3 then follow the texturing pass.

use super::choices::RequestDraw;
use super::config::Filter;
use super::{Config, Interpolation, footprint::FootprintPass, pyramid_constants, tile_pool::TilePool, with};
use crate::frame::{DrawList, Onto, Shape};
use crate::math::light::LightColours;
use crate::math::pyramid::{Pyramid, TileId};
use crate::texture::source::{TileError, TileFormat, TileSource};
use crate::vk::shader::Shader;
use crate::vk::shader::common::{lit_mesh_vert, mesh_vert, plain_frag};
use crate::vk::shader::virtual_texture::{texturing_frag, texturing_requests_frag};
use crate::vk::{
    Buffer, BufferUse, Cmd, ColorTarget, Depth, DepthTarget, Format, Gpu, GraphicsInfo, GraphicsPipeline,
    Image, ImageInfo, ReadAs, Resource, Result, Sampler, SamplerFilter, SamplerInfo,
};

/// Specialization constants of `filter.glsl`.
pub(super) fn constants(config: &Config, resident: &TilePool) -> Vec<(&'static str, u32)> {
    let filter = [
        ("LITERAL_INTERPOLATION", u32::from(config.filter.interpolation == Interpolation::Literal)),
        ("FADE_IN", u32::from(config.fade_in_frames > 0)),
    ];
    resident.constants().into_iter().chain(filter).chain(config.filter.constants()).collect()
}

/// The weight map of a filter, if it has one.
pub struct WeightTable(Option<Buffer>);

impl WeightTable {
    /// # Errors
    /// Out of memory.
    pub fn new(gpu: &Gpu, filter: &Filter) -> Result<WeightTable> {
        let words = filter.map_words();
        let buffer = words.map(|words| gpu.buffer_with("weight map", &words, BufferUse::Texels));
        Ok(WeightTable(buffer.transpose()?))
    }

    /// The binding for shaders that read the map. It is the same number in all of them.
    pub fn resource(&self) -> Option<(u32, Resource<'_>)> {
        self.0.as_ref().map(|buffer| (texturing_frag::WEIGHT_MAP, Resource::Buffer(buffer)))
    }

    /// The name and the bytes of the map, for lists of the memory.
    pub fn memory(&self) -> Option<(&'static str, u64)> {
        self.0.as_ref().map(|buffer| ("weight map", buffer.bytes()))
    }
}

/// The pipelines of a shading pass: for unlit shapes, and for shapes that the sun lights.
pub(super) struct ShadingPipelines {
    unlit: GraphicsPipeline,
    lit: Option<GraphicsPipeline>,
    pub weight_table: WeightTable,
}

impl ShadingPipelines {
    /// `info` describes the pipelines except their fragment shaders, which are the forms of `fragment` for `filter`.
    ///
    /// # Errors
    /// The driver's compiler fails.
    pub fn new(
        gpu: &Gpu,
        info: &GraphicsInfo<'_>,
        (fragment, filter): (&'static [Shader; 4], &Filter),
        lit: Option<LightColours>,
    ) -> Result<ShadingPipelines> {
        let [unlit, of_lit] = filter.forms(fragment).map(Some);
        let lit = lit.map(|light| {
            gpu.graphics_pipeline(&GraphicsInfo {
                vertex: &lit_mesh_vert::SHADER,
                fragment: of_lit,
                specialization: &[info.specialization, &light.constants()].concat(),
                ..*info
            })
        });
        Ok(ShadingPipelines {
            unlit: gpu.graphics_pipeline(&GraphicsInfo { fragment: unlit, ..*info })?,
            lit: lit.transpose()?,
            weight_table: WeightTable::new(gpu, filter)?,
        })
    }

    /// The pipeline for a shape. Without a light, all shapes are unlit.
    pub fn of(&self, shape: &Shape) -> &GraphicsPipeline {
        self.lit.as_ref().filter(|_| shape.normals.is_some()).unwrap_or(&self.unlit)
    }
}

pub struct Texturing {
    pub(super) shading: ShadingPipelines,
    /// True if the pass writes the request image; false if it reads it.
    pub(super) writes_requests: bool,
}

impl Texturing {
    /// `lit` is the light, if some shapes are lit.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        stage1: &FootprintPass,
        resident: &TilePool,
        (target, lit): (Format, Option<LightColours>),
    ) -> Result<Texturing> {
        Texturing::built(gpu, pyramid, config, stage1, &constants(config, resident), (target, lit))
    }

    /// An instrumented build of the pass. A pixel's colour is the number of texels that its filter reads: 8 for a
    /// sample of two levels, 4 for a sample of one level, 1 for a random texel. For the ellipse, it is the number of
    /// texels with a weight; for the published filters, the number of fetches.
    ///
    /// # Errors
    /// Out of memory.
    pub fn counting(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        stage1: &FootprintPass,
        resident: &TilePool,
        target: Format,
    ) -> Result<Texturing> {
        let mut constants = constants(config, resident);
        constants.push(("COUNTS_TEXELS", 1));
        let config = Config { request_draw: RequestDraw::Separate, ..*config };
        Texturing::built(gpu, pyramid, &config, stage1, &constants, (target, None))
    }

    fn built(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        stage1: &FootprintPass,
        constants: &[(&'static str, u32)],
        (target, lit): (Format, Option<LightColours>),
    ) -> Result<Texturing> {
        let writes_requests = config.request_draw == RequestDraw::Texturing;
        let colors = [target, stage1.format.image_format()];
        let (shaders, depth, colors) = match writes_requests {
            true => (&texturing_requests_frag::SHADERS, Depth::Write, &colors[..]),
            false => (&texturing_frag::SHADERS, Depth::Equal, &colors[..1]),
        };
        let info = GraphicsInfo {
            specialization: &with(pyramid_constants(pyramid, stage1.format, &config.filter), constants),
            depth: Some(depth),
            colors,
            ..GraphicsInfo::triangles(&mesh_vert::SHADER, &shaders[0])
        };
        Ok(Texturing {
            shading: ShadingPipelines::new(gpu, &info, (shaders, &config.filter), lit)?,
            writes_requests,
        })
    }

    /// Draws the picture. The pass reads the request image that `stage1` has drawn for the same view, or writes it.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw(
        &self,
        cmd: &mut Cmd<'_>,
        stage1: &FootprintPass,
        resident: &TilePool,
        seen: &DrawList<'_>,
        target: &Image,
    ) -> Result<()> {
        let color = ColorTarget { image: target, clear: seen.onto.clear() };
        let depth =
            DepthTarget { image: &stage1.depth, clear: self.writes_requests && seen.onto != Onto::Drawn };
        let mut colors = vec![color];
        let mut resources = vec![
            (texturing_frag::PAGE_TABLE, Resource::Buffer(&resident.page_table_words)),
            (texturing_frag::TILE_POOL, Resource::Sampled(&resident.tiles, &resident.sampler)),
        ];
        resources.extend(self.shading.weight_table.resource());
        match self.writes_requests {
            true => colors.push(stage1.target()),
            false => {
                resources.push((texturing_frag::REQUESTS, Resource::Texture(&stage1.requests, ReadAs::Whole)))
            }
        }
        cmd.render(target.info().size, &colors, Some(depth), |render| {
            seen.draw(render, &resources, |shape| self.shading.of(shape))
        })
    }
}

/// The baseline of `--compare-plain`: the same mesh with one plain RGBA8 texture, at most 4096 texels a side, filtered
/// in linear light like the tiles.
pub struct PlainBaseline {
    pipeline: GraphicsPipeline,
    texture: Image,
    sampler: Sampler,
    weight_table: WeightTable,
    depth: Image,
}

impl PlainBaseline {
    /// Reads the finest level with at most 4096 texels a side, and all coarser ones. If `filter` is a filter of paper
    /// 3, the shader applies it. Otherwise the sampler takes one trilinear sample.
    ///
    /// # Errors
    /// Out of memory; a tile cannot be read; the source is BC1 and has no RGBA8 texels.
    pub fn new(
        gpu: &Gpu,
        source: &dyn TileSource,
        target: &Image,
        filter: &Filter,
    ) -> std::result::Result<PlainBaseline, super::tile_pool::TilePoolError> {
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
        gpu.fill_levels(&texture, &levels)?;
        let constants = if filter.kind.is_of_paper_3() { filter.constants() } else { Vec::new() };
        let [unlit, _] = filter.forms(&plain_frag::SHADERS);
        let pipeline = gpu.graphics_pipeline(&GraphicsInfo {
            specialization: &constants,
            depth: Some(Depth::Write),
            colors: &[target.info().format],
            ..GraphicsInfo::triangles(&mesh_vert::SHADER, unlit)
        })?;
        Ok(PlainBaseline {
            pipeline,
            texture,
            sampler: gpu
                .sampler("plain sampler", SamplerInfo { filter: SamplerFilter::Linear, wraps_in_s: true })?,
            weight_table: WeightTable::new(gpu, filter)?,
            depth: gpu.image("plain depth", ImageInfo::target(target.info().size, Format::Depth32Float))?,
        })
    }

    pub fn size(&self) -> [u32; 2] {
        self.texture.info().size
    }

    /// # Errors
    /// Out of memory.
    pub fn draw(&self, cmd: &mut Cmd<'_>, seen: &DrawList<'_>, target: &Image) -> Result<()> {
        let color = ColorTarget { image: target, clear: seen.onto.clear() };
        let depth = DepthTarget { image: &self.depth, clear: true };
        let plain = (plain_frag::PLAIN, Resource::Sampled(&self.texture, &self.sampler));
        let resources: Vec<_> = self.weight_table.resource().into_iter().chain([plain]).collect();
        cmd.render(target.info().size, &[color], Some(depth), |render| {
            seen.draw(render, &resources, |_| &self.pipeline)
        })
    }
}

/// All texels of one level, from its tiles' payloads or from the resident tail.
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
