//! Stage 2, section 2.2: a geometry shader turns each block of `2^p x 2^p` pixels of the request image into points, one
//! for each triple that differs from the previous pixel's (the "memo"). A logic OR of `1 << q` merges equal triples in
//! the tile mask. The other variants of [`Dedup`] fill the same mask with compute shaders, or in the draw that textures
//! the mesh.
//!
//! Differences: points are drawn at texel centres, because the printed corners lose the tiles of row 0 and of column 0.
//! For p = 4 a block is split over two invocations, because 256 points of 5 components exceed the 1024 components that
//! Vulkan guarantees.

use super::choices::Dedup;
use super::tile_mask::{Mask, TileMask};
use super::{Config, TileAddress, footprint::FootprintPass, pyramid_constants, with};
use crate::frame::{FrameSlot, PerFrame};
use crate::math::pyramid::Pyramid;
use crate::vk::shader::virtual_texture as glsl;
use crate::vk::shader::{Blocks, MarkingFrame, Shader};
use crate::vk::{
    Blend, Clear, Cmd, ColorTarget, ComputePipeline, Format, Gpu, GraphicsInfo, GraphicsPipeline, Image,
    ReadAs, Resource, Result, Sampler, SamplerFilter, SamplerInfo,
};

/// Stage 2 of one variant, with its tile masks.
pub struct DedupPass {
    step: DedupStep,
    /// Marks the neighbouring tiles that the filter needs; `None` if it needs none.
    reach: Option<ComputePipeline>,
    /// Nearest filter: shaders fetch single texels or gather four.
    texels: Sampler,
}

enum DedupStep {
    /// One vertex per block of 2^p x 2^p pixels, and p.
    Blocks(GraphicsPipeline, u32, PerFrame<Image>),
    /// One point per pixel.
    Points(GraphicsPipeline, PerFrame<Image>),
    /// A compute pass, and the pixels of a workgroup: columns, rows.
    Compute(ComputePipeline, [u32; 2], PerFrame<TileMask>),
}

/// A compute variant's shader, and log2 of the side of the square of pixels that one invocation reads.
fn compute(dedup: Dedup) -> Option<(&'static Shader, u32)> {
    Some(match dedup {
        Dedup::Geometry | Dedup::Points | Dedup::Fused | Dedup::FusedExact => return None,
        Dedup::AtomicOr => (&glsl::dedup_atomic_or_comp::SHADER, 0),
        Dedup::TestOr => (&glsl::dedup_test_or_comp::SHADER, 0),
        Dedup::SubgroupUnique => (&glsl::dedup_subgroup_unique_comp::SHADER, 0),
        Dedup::SharedHash => (&glsl::dedup_shared_hash_comp::SHADER, 0),
        Dedup::TileMemo => (&glsl::dedup_tile_memo_comp::SHADER, 3),
        Dedup::Runs => (&glsl::dedup_runs_comp::SHADER, 3),
        Dedup::Bitset => (&glsl::dedup_bitset_comp::SHADER, 4),
        Dedup::MarkBytes => (&glsl::dedup_mark_bytes_comp::SHADER, 0),
    })
}

/// Push constants and vertex count of a draw with one vertex per block of the picture.
pub(super) fn blocks(size: [u32; 2], block_log2: u32) -> (Blocks, u32) {
    let [columns, rows] = size.map(|side| side.div_ceil(1 << block_log2));
    (Blocks { size, columns }, columns * rows)
}

impl DedupPass {
    /// # Errors
    /// The device cannot run the variant; out of memory.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config, stage1: &FootprintPass) -> Result<DedupPass> {
        assert_eq!(config.check(pyramid), Ok(()), "checked before");
        assert!(!config.dedup.fused(), "{}: not a pass of its own", config.dedup.name());
        gpu.require(&config.dedup.needs())?;
        let mut constants = with(
            pyramid_constants(pyramid, stage1.format, &config.filter),
            &[("OWN_LEVEL", u32::from(config.address == TileAddress::OwnLevel))],
        );
        // Only the pass that marks neighbouring tiles stores to the image, so only that pass needs a storage image.
        let images = || PerFrame::new(|| TileMask::image(gpu, pyramid, stage1.reaches));
        let step = match compute(config.dedup) {
            None if config.dedup == Dedup::Points => {
                let vertex = &glsl::dedup_points_vert::SHADER;
                DedupStep::Points(point_pipeline(gpu, vertex, None, &constants)?, images()?)
            }
            None => DedupStep::Blocks(blocks_pipeline(gpu, config, constants)?, config.block_log2, images()?),
            Some((shader, side_log2)) => {
                let [x, y, _] = shader.group.map(|invocations| invocations << side_log2);
                if side_log2 > 0 {
                    constants.push(("SIDE_LOG2", side_log2));
                }
                if config.dedup == Dedup::Bitset {
                    let words = pyramid.tile_count().div_ceil(32);
                    let advice = "choose variant.dedup = \"tile-memo\", or larger tiles";
                    gpu.require_shared("a bit for each tile", 4 * words, advice)?;
                    constants.push(("MASK_WORDS", words as u32));
                }
                let masks = PerFrame::new(|| TileMask::new(gpu, pyramid, config))?;
                DedupStep::Compute(gpu.compute_pipeline(shader.name, shader, &constants)?, [x, y], masks)
            }
        };
        let reach = match stage1.reaches {
            true => Some(reach_pipeline(gpu, pyramid, config, stage1.format)?),
            false => None,
        };
        let texels = SamplerInfo { filter: SamplerFilter::Nearest, wraps_in_s: false };
        let texels = gpu.sampler("request image texels", texels)?;
        Ok(DedupPass { step, reach, texels })
    }

    /// The mask of the frame in `slot`.
    pub fn mask(&self, slot: FrameSlot) -> Mask<'_> {
        match &self.step {
            DedupStep::Blocks(.., masks) | DedupStep::Points(_, masks) => Mask::of_image(&masks[slot]),
            DedupStep::Compute(.., masks) => masks[slot].of_frame(),
        }
    }

    /// Bytes of all masks.
    pub fn bytes(&self) -> u64 {
        match &self.step {
            DedupStep::Blocks(.., masks) | DedupStep::Points(_, masks) => {
                masks.iter().map(Image::bytes).sum()
            }
            DedupStep::Compute(.., masks) => masks.iter().map(TileMask::bytes).sum(),
        }
    }

    /// The number of workgroups, and the number of texels that the shaders fetch from a request image of `size` pixels.
    /// Invocations beyond the image's edges also fetch.
    pub fn groups_and_texels(&self, size: [u32; 2]) -> [u64; 2] {
        let area = |[columns, rows]: [u32; 2]| u64::from(columns) * u64::from(rows);
        match &self.step {
            DedupStep::Blocks(..) | DedupStep::Points(..) => [0, area(size)],
            DedupStep::Compute(_, pixels, _) => {
                let groups = area([size[0].div_ceil(pixels[0]), size[1].div_ceil(pixels[1])]);
                [groups, groups * area(*pixels)]
            }
        }
    }

    /// Clears the mask of the frame in `slot` and marks the triples of `requests`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn run(&self, cmd: &mut Cmd<'_>, requests: &Image, slot: FrameSlot) -> Result<()> {
        self.mark_own(cmd, requests, slot)?;
        let Some(reach) = &self.reach else { return Ok(()) };
        cmd.sync();
        self.dispatch(cmd, (reach, [8; 2]), requests, self.mask(slot))
    }

    fn dispatch(
        &self,
        cmd: &mut Cmd<'_>,
        (pipeline, pixels): (&ComputePipeline, [u32; 2]),
        requests: &Image,
        mask: Mask<'_>,
    ) -> Result<()> {
        // All of these shaders have the bindings of dedup.glsl.
        let resources = [
            (glsl::dedup_test_or_comp::REQUESTS, Resource::Sampled(requests, &self.texels)),
            (glsl::dedup_test_or_comp::TILE_MASK, mask.resource),
        ];
        let size = requests.info().size;
        let groups = [size[0].div_ceil(pixels[0]), size[1].div_ceil(pixels[1]), 1];
        let frame = MarkingFrame { number: mask.frame };
        let push = if mask.frame > 0 { bytemuck::bytes_of(&frame) } else { &[] };
        cmd.dispatch(pipeline, &resources, push, groups)
    }

    fn mark_own(&self, cmd: &mut Cmd<'_>, requests: &Image, slot: FrameSlot) -> Result<()> {
        let size = requests.info().size;
        match &self.step {
            DedupStep::Blocks(pipeline, block_log2, masks) => {
                let mask = &masks[slot];
                let (push, count) = blocks(size, *block_log2);
                let target = ColorTarget { image: mask, clear: Clear::Uint([0; 4]) };
                cmd.render(mask.info().size, &[target], None, |render| {
                    let resources =
                        [(glsl::dedup_geom::REQUESTS, Resource::Texture(requests, ReadAs::Whole))];
                    render.draw(pipeline, &resources, bytemuck::bytes_of(&push), count)
                })
            }
            DedupStep::Points(pipeline, masks) => {
                let mask = &masks[slot];
                let target = ColorTarget { image: mask, clear: Clear::Uint([0; 4]) };
                cmd.render(mask.info().size, &[target], None, |render| {
                    let resources =
                        [(glsl::dedup_points_vert::REQUESTS, Resource::Sampled(requests, &self.texels))];
                    render.draw(pipeline, &resources, &[], size[0] * size[1])
                })
            }
            DedupStep::Compute(pipeline, pixels, masks) => {
                masks[slot].begin(cmd);
                self.dispatch(cmd, (pipeline, *pixels), requests, masks[slot].of_frame())
            }
        }
    }
}

fn reach_pipeline(
    gpu: &Gpu,
    pyramid: &Pyramid,
    config: &Config,
    format: super::RequestFormat,
) -> Result<ComputePipeline> {
    let shader = &glsl::dedup_reach_comp::SHADERS[config.dedup.layout() as usize];
    let own_level = ("OWN_LEVEL", u32::from(config.address == TileAddress::OwnLevel));
    let constants = with(pyramid_constants(pyramid, format, &config.filter), &[own_level]);
    gpu.compute_pipeline(shader.name, shader, &constants)
}

fn blocks_pipeline(
    gpu: &Gpu,
    config: &Config,
    mut constants: Vec<(&'static str, u32)>,
) -> Result<GraphicsPipeline> {
    let shader = &glsl::dedup_geom::SHADERS[config.block_log2 as usize];
    // 5 components per point: position and mask. p = 4 runs two invocations of 128 points.
    let points = (1 << (2 * config.block_log2)).min(128);
    let invocations = if config.block_log2 == 4 { 2 } else { 1 };
    gpu.require_geometry(shader.name, points, 5 * points, invocations)?;
    constants.push(("MEMO", u32::from(config.memo)));
    point_pipeline(gpu, &glsl::blocks_vert::SHADER, Some(shader), &constants)
}

/// A pipeline that ORs points into the tile mask.
fn point_pipeline(
    gpu: &Gpu,
    vertex: &'static Shader,
    geometry: Option<&'static Shader>,
    specialization: &[(&str, u32)],
) -> Result<GraphicsPipeline> {
    gpu.graphics_pipeline(&GraphicsInfo {
        name: geometry.unwrap_or(vertex).name,
        vertex,
        geometry,
        fragment: Some(&glsl::dedup_frag::SHADER),
        specialization,
        points: true,
        depth: None,
        colors: &[Format::R32Uint],
        blend: Blend::LogicOr,
    })
}
