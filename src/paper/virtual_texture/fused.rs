//! Footprint (stage 1), tile mask (stage 2) and texturing (section 4) in one draw, which is not in the paper. The
//! fragment shader that textures a pixel also sets its tile's bit in the tile mask. There is no request image. Stage 3
//! compacts the mask as usual. With [`Compaction::FusedAppend`] the draw also makes the list: the first fragment that
//! sets a bit appends the bit's index to the visible-tile list, one word for each triple.
//!
//! A fragment that is hidden later has already set its bit, so [`Dedup::Fused`] lists a superset.
//! [`Dedup::FusedExact`] draws depth first and then shades with the depth test EQUAL: only visible fragments set
//! bits. Convex meshes also need the depth pass: snapping vertices to 1/256 pixel can flip slivers at the silhouette,
//! and flipped slivers overlap their neighbours. [`super::prepass`] decides which clusters the depth pass can skip.

use super::choices::{Compaction, Dedup};
use super::texturing::{ShadingPipelines, constants};
use super::tile_mask::{Mask, TileMask};
use super::visible_list::VisibleList;
use super::{Config, RequestFormat, TileAddress, prepass::Culling, pyramid_constants, tile_pool::TilePool};
use crate::frame::{DrawList, FrameSlot, Onto, PerFrame};
use crate::math::light::LightColours;
use crate::math::pyramid::Pyramid;
use crate::vk::shader::common::{depth_vert, mesh_vert};
use crate::vk::shader::virtual_texture::fused_frag;
use crate::vk::{
    Cmd, ColorTarget, Depth, DepthTarget, Format, Gpu, GraphicsInfo, GraphicsPipeline, Image, IndexRange,
    IndexedGeometry, Render, Resource, Result,
};

pub struct Fused {
    /// Present if the variant is exact.
    depth_alone: Option<DepthOnlyPipelines>,
    pub(super) shading: ShadingPipelines,
    lists: TileMarking,
    masks: PerFrame<TileMask>,
}

/// Draws that write depth only.
struct DepthOnlyPipelines {
    /// For shapes with a position-only vertex buffer.
    positions: GraphicsPipeline,
    /// For all other shapes.
    vertices: GraphicsPipeline,
}

/// What the draw records about its tiles, in the order of the constant LISTS in fused.frag.
#[derive(Clone, Copy, PartialEq, Eq)]
enum TileMarking {
    Nothing,
    TileMask,
    MaskAndList,
}

impl Fused {
    /// Creates the draw for a target of this format. The light is `None` if no shape is lit.
    ///
    /// # Errors
    /// The device has no stores from fragment shaders; out of memory.
    pub fn new(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        resident: &TilePool,
        target: (Format, Option<LightColours>),
    ) -> Result<Fused> {
        let lists = match config.compact {
            Compaction::FusedAppend => TileMarking::MaskAndList,
            _ => TileMarking::TileMask,
        };
        Fused::leaving(lists, gpu, pyramid, config, resident, target)
    }

    /// The same picture in one draw without a list: the baseline for the cost of the list.
    ///
    /// # Errors
    /// As [`Fused::new`].
    pub fn unlisted(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        resident: &TilePool,
        target: (Format, Option<LightColours>),
    ) -> Result<Fused> {
        let config = Config { dedup: Dedup::Fused, ..*config };
        Fused::leaving(TileMarking::Nothing, gpu, pyramid, &config, resident, target)
    }

    fn leaving(
        lists: TileMarking,
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        resident: &TilePool,
        (target, lit): (Format, Option<LightColours>),
    ) -> Result<Fused> {
        assert_eq!(config.check(pyramid), Ok(()), "checked before");
        gpu.require(&config.dedup.needs())?;
        let exact = config.draws_depth_alone();
        // No triple is stored, so the format has no effect.
        let mut specialization = constants(config, resident);
        specialization.extend(pyramid_constants(pyramid, RequestFormat::Rgb32, &config.filter));
        specialization.push(("OWN_LEVEL", u32::from(config.address == TileAddress::OwnLevel)));
        specialization.push(("LISTS", lists as u32));
        let shade = GraphicsInfo {
            specialization: &specialization,
            depth: Some(if exact { Depth::Equal } else { Depth::Write }),
            colors: &[target],
            ..GraphicsInfo::triangles(&mesh_vert::SHADER, &fused_frag::SHADERS[0])
        };
        Ok(Fused {
            depth_alone: if exact { Some(DepthOnlyPipelines::new(gpu, &shade)?) } else { None },
            shading: ShadingPipelines::new(gpu, &shade, (&fused_frag::SHADERS, &config.filter), lit)?,
            lists,
            masks: PerFrame::new(|| TileMask::new(gpu, pyramid, config))?,
        })
    }

    /// The mask of the frame in `slot`.
    pub fn mask(&self, slot: FrameSlot) -> Mask<'_> {
        self.masks[slot].of_frame()
    }

    /// Bytes of all masks.
    pub fn mask_bytes(&self) -> u64 {
        self.masks.iter().map(TileMask::bytes).sum()
    }

    /// Clears the mask, draws the picture and sets the bits of its tiles. With `FusedAppend`, also fills the
    /// visible-tile list.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw(
        &self,
        cmd: &mut Cmd<'_>,
        resident: &TilePool,
        seen: &DrawList<'_>,
        list: &VisibleList,
        (color, depth): (&Image, &Image),
    ) -> Result<()> {
        let mask = &self.masks[seen.view.slot()];
        if self.lists != TileMarking::Nothing {
            mask.begin(cmd);
        }
        if self.lists == TileMarking::MaskAndList {
            list.begin(cmd);
        }
        let size = color.info().size;
        let color = ColorTarget { image: color, clear: seen.onto.clear() };
        let depth = DepthTarget { image: depth, clear: seen.onto != Onto::Drawn };
        let resources = [
            (fused_frag::PAGE_TABLE, Resource::Buffer(&resident.page_table_words)),
            (fused_frag::TILE_POOL, Resource::Sampled(&resident.tiles, &resident.sampler)),
            (fused_frag::TILE_MASK, mask.of_frame().resource),
            (fused_frag::VISIBLE_LIST, Resource::Buffer(&list.triples)),
        ];
        let resources: Vec<_> = resources.into_iter().chain(self.shading.weight_table.resource()).collect();
        cmd.render(size, &[color], Some(depth), |render| {
            // Both draws are in one rendering scope, whose primitive order synchronises the depth accesses.
            if let Some(depth_alone) = &self.depth_alone {
                depth_alone.draw(render, seen)?;
            }
            seen.draw(render, &resources, |shape| self.shading.of(shape))
        })
    }
}

impl DepthOnlyPipelines {
    /// Creates the depth-only pipelines that match `shade`, the draw after them.
    fn new(gpu: &Gpu, shade: &GraphicsInfo<'_>) -> Result<DepthOnlyPipelines> {
        let pipeline = |vertex| {
            gpu.graphics_pipeline(&GraphicsInfo {
                name: "depth alone",
                vertex,
                fragment: None,
                specialization: &[],
                depth: Some(Depth::Write),
                ..*shade
            })
        };
        Ok(DepthOnlyPipelines {
            positions: pipeline(&depth_vert::SHADER)?,
            vertices: pipeline(&mesh_vert::SHADER)?,
        })
    }

    fn draw(&self, render: &mut Render<'_, '_>, seen: &DrawList<'_>) -> Result<()> {
        for (shape, slices) in seen.shapes() {
            let Some(alone) = &shape.depth_alone else {
                let geometry = IndexedGeometry { vertices: Some(&shape.vertices), indices: &shape.indices };
                render.draw_slices(&self.vertices, &[], geometry, slices)?;
                continue;
            };
            let push = slices.first().expect("a mesh in the world is drawn once").push;
            let runs = Culling::new(&push, seen.view.size).runs(&alone.clusters);
            let runs: Vec<_> = runs
                .into_iter()
                .map(|run| IndexRange { push, first_index: run.start, count: run.end - run.start })
                .collect();
            let geometry = IndexedGeometry { vertices: Some(&alone.vertices), indices: &alone.indices };
            render.draw_slices(&self.positions, &[], geometry, &runs)?;
        }
        Ok(())
    }
}
