//! Stage 3, section 2.3: each set bit q of texel (i, j) of `U2` becomes a triple of `U3`, by a geometry shader and
//! transform feedback; then `U3` is read back. Beside it the variants of [`Compaction`], in compute shaders.
//!
//! The paper makes `U3` as long as the frame has pixels. Ours starts at `list_capacity`; where a frame needs more,
//! the count tells, and the same frame's marks are compacted again into a longer list: no tile is ever lost. The host
//! reads no more than a frame is likely to have; where it has more, the rest is read when the count is known.

use super::choices::Compaction;
use super::list::{Count, Entries, List};
use super::{Config, Keying, U1Format, dedup::blocks, marks::Marks, pyramid_constants, with};
use crate::math::pyramid::Pyramid;
use crate::vk::shader::virtual_texture::{
    blocks_vert, compact_append_comp, compact_count_comp, compact_geom, compact_ordered_comp,
    compact_subgroup_comp, compact_workgroup_comp,
};
use crate::vk::shader::{MarkingFrame, Shader};
use crate::vk::{
    Blend, Cmd, ComputePipeline, Gpu, GraphicsInfo, GraphicsPipeline, Resource, Result, TransformFeedback,
    View,
};

/// Stage 3 of one variant; lists are made by [`CompactPass::list`].
pub struct CompactPass {
    step: Step,
    /// Groups that a compute variant dispatches.
    groups: [u32; 3],
    entries: Entries,
}

enum Step {
    /// A point for each block of `U2`: p.
    Blocks(GraphicsPipeline, u32),
    Compute {
        /// Runs first where the list is ordered.
        count: Option<Dispatch>,
        write: Dispatch,
    },
}

/// A pipeline and the bytes of [`MarkingFrame`] that its shader reads: all, or none where marks are bits.
struct Dispatch(ComputePipeline, usize);

/// A compute variant's shaders, one for each [`Layout`], and how many words an invocation reads, as log2.
fn compute(compact: Compaction) -> Option<(&'static [Shader; 3], u32)> {
    Some(match compact {
        Compaction::TransformFeedback => return None,
        // The draw appends; from the marks a list is made only where the first one was too short.
        Compaction::Append | Compaction::FusedAppend => (&compact_append_comp::SHADERS, 0),
        Compaction::Subgroup => (&compact_subgroup_comp::SHADERS, 0),
        Compaction::Workgroup => (&compact_workgroup_comp::SHADERS, 4),
        Compaction::Ordered => (&compact_ordered_comp::SHADERS, 4),
    })
}

/// So many workgroups of a line, in two dimensions: one may hold no more than 65,535.
fn line(groups: u64) -> [u32; 3] {
    let rows = groups.div_ceil(32_768).max(1);
    [groups.div_ceil(rows) as u32, rows as u32, 1]
}

impl CompactPass {
    /// # Errors
    /// The device cannot run the variant; out of memory.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config) -> Result<CompactPass> {
        assert_eq!(config.check(pyramid), Ok(()), "asked before");
        gpu.require(&config.compact.needs())?;
        // Marks look the same whatever U1's format was.
        let constants = pyramid_constants(pyramid, U1Format::Rgb32);
        let Some((shaders, words_log2)) = compute(config.compact) else {
            let block_log2 = config.compact_block_log2;
            let step = Step::Blocks(geometry(gpu, block_log2, &constants)?, block_log2);
            return Ok(CompactPass { step, groups: [0; 3], entries: Entries::Triples });
        };
        let mut constants = with(constants, &[("NATIVE_KEYING", u32::from(config.keying == Keying::Native))]);
        let mut entries = Entries::Triples;
        if config.compact == Compaction::FusedAppend {
            entries = Entries::Places(*pyramid, config.keying);
            constants.push(("U3_PLACES", 1));
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
        let groups = line(Marks::words_of(pyramid, config).div_ceil(words_of_group));
        Ok(CompactPass { step: Step::Compute { count, write: dispatch(shaders)? }, groups, entries })
    }

    /// An empty list with room for `capacity` triples.
    ///
    /// # Errors
    /// Out of memory.
    pub fn list(&self, gpu: &Gpu, capacity: u64) -> Result<List> {
        let groups = self.groups.iter().map(|&n| u64::from(n)).product();
        match &self.step {
            Step::Blocks(..) => List::new(gpu, (capacity, self.entries), true, None),
            Step::Compute { count, .. } => {
                List::new(gpu, (capacity, self.entries), false, count.is_some().then_some(groups))
            }
        }
    }

    /// Writes the triples of `marks` to `list`'s `U3`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn run(&self, cmd: &mut Cmd<'_>, marks: &Marks, list: &List) -> Result<()> {
        match (&self.step, &list.count) {
            (Step::Blocks(pipeline, block_log2), Count::Stream { counter, query }) => {
                let u2 = marks.u2().expect("the geometry shader's layout");
                let (push, count) = blocks(u2.info().size, *block_log2);
                cmd.reset(query, 0);
                cmd.render(u2.info().size, &[], None, |render| {
                    let resources = [(compact_geom::U2, Resource::Texture(u2, View::Whole))];
                    let into = TransformFeedback { buffer: &list.u3, counter, query, query_index: 0 };
                    render.draw_into(pipeline, &resources, bytemuck::bytes_of(&push), count, &into)
                })
            }
            (Step::Compute { count, write }, Count::Stored) => {
                list.begin(cmd);
                let push = MarkingFrame { number: marks.frame() };
                // marks.glsl and u3.glsl number the bindings of all of them.
                let mut resources = vec![
                    (compact_append_comp::MARKS, marks.resource()),
                    (compact_append_comp::U3, Resource::Buffer(&list.u3)),
                ];
                resources.extend(list.sums.iter().map(|s| (compact_ordered_comp::SUMS, Resource::Buffer(s))));
                for Dispatch(pipeline, push_bytes) in count.iter().chain([write]) {
                    let push = &bytemuck::bytes_of(&push)[..*push_bytes];
                    cmd.dispatch(pipeline, &resources, push, self.groups)?;
                    cmd.sync();
                }
                Ok(())
            }
            _ => panic!("the list was made for another variant"),
        }
    }

    /// The triples of a frame that has ended. Where `U3` was too short it is made longer and filled again from the
    /// same `marks`; the flag says so.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn collect(&self, gpu: &Gpu, marks: &Marks, list: &mut List) -> Result<(Vec<[u32; 3]>, bool)> {
        let needed = list.needed()?;
        let overflowed = needed > list.capacity();
        if overflowed {
            let room = list.capacity();
            *list = self.list(gpu, needed.next_power_of_two())?;
            tracing::debug!(
                "the frame has {needed} triples, U3 room for {room}: compacted again, into room for {}",
                list.capacity()
            );
        }
        if overflowed || !list.has_read(needed) {
            list.expect(needed);
            let mut frame = gpu.frame()?;
            if overflowed {
                frame.pass("compact again", |cmd| self.run(cmd, marks, list))?;
            }
            frame.pass("read-back again", |cmd| {
                list.read_back(cmd);
                Ok(())
            })?;
            frame.submit()?.wait()?;
        }
        let triples = list.triples()?;
        list.expect(needed);
        Ok((triples, overflowed))
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
