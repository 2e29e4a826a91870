//! Stage 3, section 2.3: each set bit q of texel (i, j) of the tile mask becomes a triple of the visible-tile list. The
//! paper uses a geometry shader and transform feedback, and reads the list back. The other variants of [`Compaction`]
//! use compute shaders.
//!
//! The paper's visible-tile list has room for one entry per pixel. Ours starts with `list_capacity` entries. If a frame
//! has more triples, its mask is compacted again into a longer list, so no tile is lost. The host copies as many
//! entries as a frame is likely to have. If the frame has more, the host copies the list again.

use super::choices::Compaction;
use super::tile_mask::{Mask, TileMask};
use super::visible_list::{BlockDraw, Dispatch, Dispatches, Entries, Fill, VisibleList};
use super::{Config, RequestFormat, TileAddress, dedup::blocks, pyramid_constants, with};
use crate::math::pyramid::Pyramid;
use crate::vk::shader::virtual_texture::{
    blocks_vert, compact_append_comp, compact_count_comp, compact_geom, compact_ordered_comp,
    compact_subgroup_comp, compact_workgroup_comp,
};
use crate::vk::shader::{MarkingFrame, Shader};
use crate::vk::{
    Blend, Cmd, Gpu, GraphicsInfo, GraphicsPipeline, Resource, Result, TransformFeedback, group_line,
};
use std::sync::Arc;

/// Stage 3 of one variant. [`CompactPass::list`] creates the lists that it fills.
pub struct CompactPass {
    step: CompactStep,
    entries: Entries,
}

enum CompactStep {
    Feedback(Arc<BlockDraw>),
    Compute(Arc<Dispatches>),
}

/// A compute variant's shaders, one per [`MaskLayout`], and log2 of the number of words that an invocation reads.
fn compute(compact: Compaction) -> Option<(&'static [Shader; 3], u32)> {
    Some(match compact {
        Compaction::TransformFeedback => return None,
        // With fused-append the draw makes the list; this shader runs only if that list was too short.
        Compaction::Append | Compaction::FusedAppend => (&compact_append_comp::SHADERS, 0),
        Compaction::Subgroup => (&compact_subgroup_comp::SHADERS, 0),
        Compaction::Workgroup => (&compact_workgroup_comp::SHADERS, 4),
        Compaction::Ordered => (&compact_ordered_comp::SHADERS, 4),
    })
}

impl CompactPass {
    /// # Errors
    /// The device cannot run the variant; out of memory.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config) -> Result<CompactPass> {
        assert_eq!(config.check(pyramid), Ok(()), "checked before");
        gpu.require(&config.compact.needs())?;
        // The mask does not depend on the format of the request image.
        let constants = pyramid_constants(pyramid, RequestFormat::Rgb32, &config.filter);
        let Some((shaders, words_log2)) = compute(config.compact) else {
            let block_log2 = config.compact_block_log2;
            let pipeline = geometry(gpu, block_log2, &constants)?;
            let draw = BlockDraw { pipeline, block_log2, grid: pyramid.tile_grid(0) };
            return Ok(CompactPass {
                step: CompactStep::Feedback(Arc::new(draw)),
                entries: Entries::Triples,
            });
        };
        let mut constants =
            with(constants, &[("OWN_LEVEL", u32::from(config.address == TileAddress::OwnLevel))]);
        let mut entries = Entries::Triples;
        if config.compact == Compaction::FusedAppend {
            entries = Entries::BitIndices(*pyramid, config.address);
            constants.push(("LIST_PLACES", 1));
        }
        if words_log2 > 0 {
            constants.push(("WORDS_LOG2", words_log2));
        }
        let dispatch = |shaders: &'static [Shader; 3]| {
            let shader = &shaders[config.dedup.layout() as usize];
            Ok(Dispatch(gpu.compute_pipeline(shader.name, shader, &constants)?, shader.push_bytes as usize))
        };
        let count = config.compact == Compaction::Ordered;
        let count = count.then(|| dispatch(&compact_count_comp::SHADERS)).transpose()?;
        let words_of_group = u64::from(shaders[0].group[0] << words_log2);
        let groups = group_line(TileMask::words_of(pyramid, config).div_ceil(words_of_group));
        let dispatches = Dispatches { count, write: dispatch(shaders)?, groups };
        Ok(CompactPass { step: CompactStep::Compute(Arc::new(dispatches)), entries })
    }

    /// An empty list with room for `capacity` triples.
    ///
    /// # Errors
    /// Out of memory.
    pub fn list(&self, gpu: &Gpu, capacity: u64) -> Result<VisibleList> {
        let fill = match &self.step {
            CompactStep::Feedback(draw) => Fill::feedback(gpu, draw)?,
            CompactStep::Compute(dispatches) => Fill::compute(gpu, dispatches)?,
        };
        VisibleList::new(gpu, (capacity, self.entries), fill)
    }

    /// The triples of a frame that has ended. If the visible-tile list was too short, a longer one is filled from the
    /// same `mask`, and the returned flag is true.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn collect(
        &self,
        gpu: &Gpu,
        mask: Mask<'_>,
        list: &mut VisibleList,
    ) -> Result<(Vec<[u32; 3]>, bool)> {
        let needed = list.needed()?;
        let overflowed = needed > list.capacity();
        if overflowed {
            let room = list.capacity();
            *list = self.list(gpu, needed.next_power_of_two())?;
            tracing::debug!(
                "the frame has {needed} triples, the visible-tile list holds {room}: compacted again into a list for \
                 {}",
                list.capacity()
            );
        }
        if overflowed || !list.has_read(needed) {
            list.expect(needed);
            let mut frame = gpu.frame()?;
            if overflowed {
                frame.pass("compact again", |cmd| list.compact(cmd, mask))?;
            }
            frame.pass("read-back again", |cmd| list.read_back(cmd))?;
            frame.submit()?.wait()?;
        }
        let triples = list.triples()?;
        list.expect(needed);
        Ok((triples, overflowed))
    }
}

impl VisibleList {
    /// Fills the list with the triples of `mask`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn compact(&self, cmd: &mut Cmd<'_>, mask: Mask<'_>) -> Result<()> {
        match &self.fill {
            Fill::Feedback { draw, counter, query } => {
                let (push, count) = blocks(draw.grid, draw.block_log2);
                cmd.reset(query, 0);
                cmd.render(draw.grid, &[], None, |render| {
                    let resources = [(compact_geom::TILE_MASK, mask.resource)];
                    let into = TransformFeedback { buffer: &self.triples, counter, query, query_index: 0 };
                    render.draw_captured(&draw.pipeline, &resources, bytemuck::bytes_of(&push), count, &into)
                })
            }
            Fill::Compute { dispatches, sums } => {
                self.begin(cmd);
                let push = MarkingFrame { number: mask.frame };
                // All compute variants have the bindings of tile_mask.glsl and visible_list.glsl.
                let mut resources = vec![
                    (compact_append_comp::TILE_MASK, mask.resource),
                    (compact_append_comp::VISIBLE_LIST, Resource::Buffer(&self.triples)),
                ];
                resources.extend(sums.iter().map(|s| (compact_ordered_comp::SUMS, Resource::Buffer(s))));
                let Dispatches { count, write, groups } = &**dispatches;
                for Dispatch(pipeline, push_bytes) in count.iter().chain([write]) {
                    let push = &bytemuck::bytes_of(&push)[..*push_bytes];
                    cmd.dispatch(pipeline, &resources, push, *groups)?;
                    cmd.sync();
                }
                Ok(())
            }
        }
    }
}

fn geometry(gpu: &Gpu, block_log2: u32, constants: &[(&str, u32)]) -> Result<GraphicsPipeline> {
    let shader = &compact_geom::SHADERS[block_log2 as usize];
    let points = 16 << (2 * block_log2);
    gpu.require_geometry(shader.name, points, 3 * points, 1)?;
    gpu.graphics_pipeline(&GraphicsInfo {
        name: shader.name,
        vertex: &blocks_vert::SHADER,
        geometry: Some(shader),
        fragment: None,
        specialization: constants,
        points: true,
        depth: None,
        colors: &[],
        blend: Blend::Replace,
    })
}
