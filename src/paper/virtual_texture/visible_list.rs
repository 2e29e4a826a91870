//! The visible-tile list, section 2.3: the list of triples, on the device and on the host.

use super::{TileAddress, tile_mask::TileMask};
use crate::math::pyramid::Pyramid;
use crate::vk::{Buffer, BufferUse, Cmd, ComputePipeline, Gpu, GraphicsPipeline, Result, StreamQuery};
use std::sync::Arc;

/// How the visible-tile list stores a triple.
#[derive(Clone, Copy)]
pub(super) enum Entries {
    /// q, i and j, as in the paper.
    Triples,
    /// The index of the triple's bit in the tile mask. Pyramid and tile address determine the order of the bits.
    BitIndices(Pyramid, TileAddress),
}

impl Entries {
    fn bytes(self) -> u64 {
        match self {
            Entries::Triples => 12,
            Entries::BitIndices(..) => 4,
        }
    }

    /// (q, i, j) of an entry.
    fn triple(self, bytes: &[u8]) -> [u32; 3] {
        match self {
            Entries::Triples => bytemuck::pod_read_unaligned(bytes),
            Entries::BitIndices(pyramid, address) => {
                TileMask::triple_at(&pyramid, address, bytemuck::pod_read_unaligned(bytes))
            }
        }
    }
}

/// The visible-tile list of one frame in flight.
pub struct VisibleList {
    pub(super) triples: Buffer,
    pub(super) fill: Fill,
    host: Buffer,
    entries: Entries,
    capacity: u64,
    /// Number of triples copied to the host per frame: the capacity until the first frame has reported its length.
    read: u64,
}

/// The commands that fill a list, and where its length is stored.
pub(super) enum Fill {
    /// Transform feedback has its own query for the length.
    Feedback { draw: Arc<BlockDraw>, counter: Buffer, query: StreamQuery },
    /// The length is the first word of the visible-tile list. `sums`: the number of set bits that each
    /// workgroup found, if the list is ordered.
    Compute { dispatches: Arc<Dispatches>, sums: Option<Buffer> },
}

/// A draw with one vertex per block of 2^p x 2^p texels of the tile mask.
pub(super) struct BlockDraw {
    pub pipeline: GraphicsPipeline,
    /// The exponent p.
    pub block_log2: u32,
    /// Size of the tile mask.
    pub grid: [u32; 2],
}

pub(super) struct Dispatches {
    /// Runs first if the list is ordered.
    pub count: Option<Dispatch>,
    pub write: Dispatch,
    /// Number of workgroups along each axis.
    pub groups: [u32; 3],
}

/// A pipeline, and the size of its push constants in bytes: that of a `MarkingFrame` if the mask has a byte for each
/// tile, else 0.
pub(super) struct Dispatch(pub ComputePipeline, pub usize);

impl Fill {
    /// Creates the buffers of a list that `draw` fills.
    pub fn feedback(gpu: &Gpu, draw: &Arc<BlockDraw>) -> Result<Fill> {
        Ok(Fill::Feedback {
            draw: draw.clone(),
            counter: gpu.buffer("visible-tile list counter", 4, BufferUse::TransformFeedback)?,
            query: gpu.stream_query("visible-tile list stream query", 1)?,
        })
    }

    /// Creates the buffers of a list that `dispatches` fill.
    pub fn compute(gpu: &Gpu, dispatches: &Arc<Dispatches>) -> Result<Fill> {
        let groups: u64 = dispatches.groups.iter().map(|&n| u64::from(n)).product();
        let sums = || gpu.buffer("visible-tile list sums", 4 * groups, BufferUse::Storage);
        let sums = dispatches.count.is_some().then(sums).transpose()?;
        Ok(Fill::Compute { dispatches: dispatches.clone(), sums })
    }

    /// Bytes of the visible-tile list before the first triple.
    fn header_bytes(&self) -> u64 {
        match self {
            Fill::Feedback { .. } => 0,
            Fill::Compute { .. } => 4,
        }
    }
}

impl VisibleList {
    /// Creates an empty list with room for `capacity` triples.
    pub(super) fn new(gpu: &Gpu, (capacity, entries): (u64, Entries), fill: Fill) -> Result<VisibleList> {
        let usage = match fill {
            Fill::Feedback { .. } => BufferUse::TransformFeedback,
            Fill::Compute { .. } => BufferUse::Storage,
        };
        let bytes = fill.header_bytes() + capacity * entries.bytes();
        Ok(VisibleList {
            triples: gpu.buffer("visible-tile list", bytes, usage)?,
            fill,
            host: gpu.buffer("visible-tile list on the host", bytes, BufferUse::Readback)?,
            entries,
            capacity,
            read: capacity,
        })
    }

    /// Number of triples for which the list has room.
    pub fn capacity(&self) -> u64 {
        self.capacity
    }

    /// Sets the stored length to 0, if the list stores its length. Later commands of the pass see the empty list.
    pub(super) fn begin(&self, cmd: &mut Cmd<'_>) {
        cmd.fill(&self.triples, self.fill.header_bytes(), 0);
        cmd.sync();
    }

    /// Copies the expected number of triples to the host buffer (`VisibleList::expect`).
    pub fn read_back(&self, cmd: &mut Cmd<'_>) {
        let bytes = self.fill.header_bytes() + self.read * self.entries.bytes();
        cmd.copy_buffer(&self.triples, 0, &self.host, 0, bytes);
    }

    /// True if the host has all `needed` triples of the frame that has ended.
    pub(super) fn has_read(&self, needed: u64) -> bool {
        needed <= self.read
    }

    /// Sets the number of triples that the next frames copy: 1.25 x `needed` + 1024, at most the capacity. With
    /// own-level tile addresses a frame has a few hundred triples; the default capacity of 65,536 would copy 0.8 MB per
    /// frame.
    pub(super) fn expect(&mut self, needed: u64) {
        self.read = (needed + needed / 4 + 1024).min(self.capacity);
    }

    /// Bytes on the device, and on the host.
    pub fn bytes(&self) -> [u64; 2] {
        let filling = match &self.fill {
            Fill::Feedback { counter, .. } => counter.bytes(),
            Fill::Compute { sums, .. } => sums.as_ref().map_or(0, Buffer::bytes),
        };
        [self.triples.bytes() + filling, self.host.bytes()]
    }

    /// Number of triples of a frame that has ended, including those beyond the list's capacity.
    ///
    /// # Errors
    /// Device lost.
    pub(super) fn needed(&self) -> Result<u64> {
        Ok(match &self.fill {
            Fill::Feedback { query, .. } => query.read(0)?.needed,
            Fill::Compute { .. } => u64::from(self.host.mapped::<u32>()[0]),
        })
    }

    /// The triples of a frame that has ended.
    ///
    /// # Errors
    /// Device lost.
    pub(super) fn triples(&self) -> Result<Vec<[u32; 3]>> {
        let needed = self.needed()?;
        assert!(self.has_read(needed), "{needed} triples, but only {} were copied", self.read);
        let bytes = self.host.mapped::<u8>();
        let of_entry = self.entries.bytes() as usize;
        let bytes = &bytes[self.fill.header_bytes() as usize..][..needed as usize * of_entry];
        Ok(bytes.chunks_exact(of_entry).map(|entry| self.entries.triple(entry)).collect())
    }
}
