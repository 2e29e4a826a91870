//! Stage 3, section 2.3: each set bit q of texel (i, j) of `U2` becomes a triple of `U3`, by a geometry shader and
//! transform feedback; then `U3` is read back. Beside it the variants of [`Compaction`], in compute shaders.
//!
//! The paper makes `U3` as long as the frame has pixels. Ours starts at `list_capacity`; where a frame needs more,
//! the count tells, and the same frame's marks are compacted again into a longer list: no tile is ever lost.

use super::list::{Count, List};
use super::{
    Config, Keying, U1Format, dedup::blocks, marks::Marks, pyramid_constants, variants::Layout, with,
};
use crate::math::pyramid::Pyramid;
use crate::scene::Compaction;
use crate::vk::shader::virtual_texture::{blocks_vert, compact_append_comp, compact_geom};
use crate::vk::shader::{Appending, Shader};
use crate::vk::{
    Cmd, ComputePipeline, Gpu, GraphicsInfo, GraphicsPipeline, Resource, Result, TransformFeedback, View,
};

/// Stage 3 of one variant; lists are made by [`CompactPass::list`].
pub struct CompactPass(Step);

enum Step {
    /// A point for each block of `U2`: p.
    Blocks(GraphicsPipeline, u32),
    /// A group for so many words of marks.
    Compute(ComputePipeline, u32),
}

/// A compute variant's shaders, one for each [`Layout`].
fn compute(compact: Compaction) -> Option<&'static [Shader; 3]> {
    match compact {
        Compaction::TransformFeedback => None,
        Compaction::Append => Some(&compact_append_comp::SHADERS),
    }
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
        Ok(CompactPass(match compute(config.compact) {
            None => {
                Step::Blocks(geometry(gpu, config.compact_block_log2, &constants)?, config.compact_block_log2)
            }
            Some(shaders) => {
                let shader = match config.dedup.layout() {
                    Layout::U2 => &shaders[0],
                    Layout::Bits => &shaders[1],
                    Layout::Bytes => &shaders[2],
                };
                let keying = ("NATIVE_KEYING", u32::from(config.keying == Keying::Native));
                let constants = with(constants, &[keying]);
                Step::Compute(gpu.compute_pipeline(shader.name, shader, &constants)?, shader.group[0])
            }
        }))
    }

    /// An empty list with room for `capacity` triples.
    ///
    /// # Errors
    /// Out of memory.
    pub fn list(&self, gpu: &Gpu, capacity: u64) -> Result<List> {
        List::new(gpu, capacity, matches!(self.0, Step::Blocks(..)))
    }

    /// Writes the triples of `marks` to `list`'s `U3`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn run(&self, cmd: &mut Cmd<'_>, marks: &Marks, list: &List) -> Result<()> {
        match (&self.0, &list.count) {
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
            (Step::Compute(pipeline, words), Count::Stored) => {
                list.begin(cmd);
                // marks.glsl and u3.glsl number the bindings of all of them.
                let resources = [
                    (compact_append_comp::MARKS, marks.resource()),
                    (compact_append_comp::U3, Resource::Buffer(&list.u3)),
                ];
                let push = Appending { capacity: list.capacity() as u32, frame: marks.frame() };
                let groups = line(marks.words().div_ceil(u64::from(*words)));
                cmd.dispatch(pipeline, &resources, bytemuck::bytes_of(&push), groups)
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
            tracing::info!("U3 holds {} triples, the frame has {needed}: compacted again", list.capacity());
            *list = self.list(gpu, needed.next_power_of_two())?;
            let mut frame = gpu.frame()?;
            frame.pass("compact again", |cmd| self.run(cmd, marks, list))?;
            frame.pass("read-back again", |cmd| {
                list.read_back(cmd);
                Ok(())
            })?;
            frame.submit()?.wait()?;
        }
        Ok((list.triples()?, overflowed))
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
        logic_or: false,
    })
}
