//! Stage 3, section 2.3: each set bit q of texel (i, j) of `U2` becomes a triple of `U3`, by a geometry shader and
//! transform feedback; then `U3` is read back.
//!
//! The paper makes `U3` as long as the frame has pixels. Ours starts at `list_capacity`; where a frame needs more,
//! the stream query tells, and the same frame's `U2` is compacted again into a longer list: no tile is ever lost.

use super::{Config, U1Format, dedup::blocks, pyramid_constants};
use crate::math::pyramid::Pyramid;
use crate::vk::shader::virtual_texture::{blocks_vert, compact_geom};
use crate::vk::{
    Buffer, BufferUse, Cmd, Error, Gpu, GraphicsInfo, GraphicsPipeline, Image, Resource, Result, StreamCount,
    StreamQuery, TransformFeedback, View,
};

/// Bytes of a triple in `U3`.
const TRIPLE_BYTES: u64 = 12;

/// The pass; lists are made by [`Compact::list`].
pub struct Compact {
    pipeline: GraphicsPipeline,
    block_log2: u32,
}

/// `U3` of one frame in flight: on the device, and where the host reads it.
pub struct List {
    u3: Buffer,
    counter: Buffer,
    host: Buffer,
    query: StreamQuery,
    capacity: u64,
}

impl Compact {
    /// # Errors
    /// The device's geometry shader cannot emit a block's points.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config) -> Result<Compact> {
        let levels = pyramid.first_resident_level();
        if levels > 16 {
            let what = format!("{levels} streamed levels, compact.geom has room for 16; take larger tiles");
            return Err(Error::Limit { object: "U3".into(), what });
        }
        let shader = &compact_geom::SHADERS[config.compact_block_log2 as usize];
        let points = 16 << (2 * config.compact_block_log2);
        gpu.require_geometry(shader.name, points, 3 * points, 1)?;
        let pipeline = gpu.graphics_pipeline(&GraphicsInfo {
            name: shader.name,
            vertex: &blocks_vert::SHADER,
            geometry: Some(shader),
            fragment: None,
            // U2 looks the same whatever U1's format was.
            specialization: &pyramid_constants(pyramid, U1Format::Rgb32),
            points: true,
            depth: None,
            colors: &[],
            logic_or: false,
        })?;
        Ok(Compact { pipeline, block_log2: config.compact_block_log2 })
    }

    /// An empty list with room for `capacity` triples.
    ///
    /// # Errors
    /// Out of memory.
    pub fn list(&self, gpu: &Gpu, capacity: u64) -> Result<List> {
        let bytes = capacity * TRIPLE_BYTES;
        Ok(List {
            u3: gpu.buffer("U3", bytes, BufferUse::TransformFeedback)?,
            counter: gpu.buffer("U3 counter", 4, BufferUse::TransformFeedback)?,
            host: gpu.buffer("U3 on the host", bytes, BufferUse::Readback)?,
            query: gpu.stream_query("U3 stream query", 1)?,
            capacity,
        })
    }

    /// Appends the triples of `u2` to `list`'s `U3`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn run(&self, cmd: &mut Cmd<'_>, u2: &Image, list: &List) -> Result<()> {
        let (push, count) = blocks(u2.info().size, self.block_log2);
        cmd.reset(&list.query, 0);
        cmd.render(u2.info().size, &[], None, |render| {
            let resources = [(compact_geom::U2, Resource::Texture(u2, View::Whole))];
            let into = TransformFeedback {
                buffer: &list.u3,
                counter: &list.counter,
                query: &list.query,
                query_index: 0,
            };
            render.draw_into(&self.pipeline, &resources, bytemuck::bytes_of(&push), count, &into)
        })
    }

    /// The triples of a frame that has ended. Where `U3` was too short it is made longer and filled again from the
    /// same `u2`; the flag says so.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn collect(&self, gpu: &Gpu, u2: &Image, list: &mut List) -> Result<(Vec<[u32; 3]>, bool)> {
        let count = list.query.read(0)?;
        let overflowed = count.needed > count.written;
        if overflowed {
            tracing::info!(
                "U3 holds {} triples, the frame has {}: compacted again",
                list.capacity,
                count.needed
            );
            *list = self.list(gpu, count.needed.next_power_of_two())?;
            let mut frame = gpu.frame()?;
            frame.pass("compact again", |cmd| self.run(cmd, u2, list))?;
            frame.pass("read-back again", |cmd| {
                list.read_back(cmd);
                Ok(())
            })?;
            frame.submit()?.wait()?;
        }
        Ok((list.triples(list.query.read(0)?), overflowed))
    }
}

impl List {
    /// Copies `U3` to where the host reads it.
    pub fn read_back(&self, cmd: &mut Cmd<'_>) {
        cmd.copy_buffer(&self.u3, 0, &self.host, 0, self.capacity * TRIPLE_BYTES);
    }

    /// Bytes on the device, and where the host reads.
    pub fn bytes(&self) -> [u64; 2] {
        [self.u3.bytes() + self.counter.bytes(), self.host.bytes()]
    }

    fn triples(&self, count: StreamCount) -> Vec<[u32; 3]> {
        assert_eq!(count.written, count.needed, "a list that overflowed was run again");
        let bytes = &self.host.mapped()[..(count.written * TRIPLE_BYTES) as usize];
        // (q, i, j) as the shader wrote them.
        bytes.chunks_exact(TRIPLE_BYTES as usize).map(bytemuck::pod_read_unaligned).collect()
    }
}
