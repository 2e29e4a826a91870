//! `U3`, section 2.3: the list of triples, on the device and where the host reads it.

use super::{Keying, marks::Marks};
use crate::math::pyramid::Pyramid;
use crate::vk::{Buffer, BufferUse, Cmd, Gpu, Result, StreamQuery};

/// What `U3` has of each triple.
#[derive(Clone, Copy)]
pub(super) enum Entries {
    /// q, i and j, the paper's.
    Triples,
    /// The place of its mark, in the order that pyramid and keying give.
    Places(Pyramid, Keying),
}

impl Entries {
    fn bytes(self) -> u64 {
        match self {
            Entries::Triples => 12,
            Entries::Places(..) => 4,
        }
    }

    /// (q, i, j) of an entry.
    fn triple(self, bytes: &[u8]) -> [u32; 3] {
        match self {
            Entries::Triples => bytemuck::pod_read_unaligned(bytes),
            Entries::Places(pyramid, keying) => {
                Marks::triple_at(&pyramid, keying, bytemuck::pod_read_unaligned(bytes))
            }
        }
    }
}

/// `U3` of one frame in flight.
pub struct List {
    pub(super) u3: Buffer,
    pub(super) count: Count,
    /// Marks of each group, where the list is ordered.
    pub(super) sums: Option<Buffer>,
    host: Buffer,
    entries: Entries,
    capacity: u64,
    /// Triples that the host gets of each frame: all there is room for until one frame has told its length.
    read: u64,
}

/// Where a list's length is told.
pub(super) enum Count {
    /// Transform feedback's own query.
    Stream { counter: Buffer, query: StreamQuery },
    /// The first word of `U3`.
    Stored,
}

impl Count {
    /// Bytes of `U3` before the first triple.
    fn header_bytes(&self) -> u64 {
        match self {
            Count::Stream { .. } => 0,
            Count::Stored => 4,
        }
    }
}

impl List {
    /// An empty list with room for `capacity` triples; `feedback`: for transform feedback; `groups`: ordered by so
    /// many.
    pub(super) fn new(
        gpu: &Gpu,
        (capacity, entries): (u64, Entries),
        feedback: bool,
        groups: Option<u64>,
    ) -> Result<List> {
        let (count, usage) = match feedback {
            true => {
                let usage = BufferUse::TransformFeedback;
                let counter = gpu.buffer("U3 counter", 4, usage)?;
                (Count::Stream { counter, query: gpu.stream_query("U3 stream query", 1)? }, usage)
            }
            false => (Count::Stored, BufferUse::Storage),
        };
        let bytes = count.header_bytes() + capacity * entries.bytes();
        Ok(List {
            u3: gpu.buffer("U3", bytes, usage)?,
            count,
            sums: groups.map(|groups| gpu.buffer("U3 sums", 4 * groups, BufferUse::Storage)).transpose()?,
            host: gpu.buffer("U3 on the host", bytes, BufferUse::Readback)?,
            entries,
            capacity,
            read: capacity,
        })
    }

    /// Triples that `U3` has room for.
    pub fn capacity(&self) -> u64 {
        self.capacity
    }

    /// Empties a list whose length is stored. Commands that follow in the pass see it.
    pub(super) fn begin(&self, cmd: &mut Cmd<'_>) {
        cmd.fill(&self.u3, self.count.header_bytes(), 0);
        cmd.sync();
    }

    /// Copies to where the host reads what it reads of a frame (`List::expect`).
    pub fn read_back(&self, cmd: &mut Cmd<'_>) {
        let bytes = self.count.header_bytes() + self.read * self.entries.bytes();
        cmd.copy_buffer(&self.u3, 0, &self.host, 0, bytes);
    }

    /// Whether the host has all `needed` triples of the frame that has ended.
    pub(super) fn has_read(&self, needed: u64) -> bool {
        needed <= self.read
    }

    /// From the next frame on the host reads a quarter and 1024 triples more than `needed`, where there are so many: a
    /// frame of native keying has some hundred of 65,536, which would be copied at 0.8 MB a frame.
    pub(super) fn expect(&mut self, needed: u64) {
        self.read = (needed + needed / 4 + 1024).min(self.capacity);
    }

    /// Bytes on the device, and where the host reads.
    pub fn bytes(&self) -> [u64; 2] {
        let sums = self.sums.as_ref().map_or(0, Buffer::bytes);
        let counter = match &self.count {
            Count::Stream { counter, .. } => counter.bytes(),
            Count::Stored => 0,
        };
        [self.u3.bytes() + counter + sums, self.host.bytes()]
    }

    /// Triples that the frame has, also where `U3` had no room for them; once it has ended.
    ///
    /// # Errors
    /// Device lost.
    pub(super) fn needed(&self) -> Result<u64> {
        Ok(match &self.count {
            Count::Stream { query, .. } => query.read(0)?.needed,
            Count::Stored => u64::from(bytemuck::pod_read_unaligned::<u32>(&self.host.mapped()[..4])),
        })
    }

    /// # Errors
    /// Device lost.
    pub(super) fn triples(&self) -> Result<Vec<[u32; 3]>> {
        let needed = self.needed()?;
        assert!(self.has_read(needed), "{needed} of {}: the rest was to be read again", self.read);
        let bytes = &self.host.mapped()[self.count.header_bytes() as usize..];
        let of_entry = self.entries.bytes() as usize;
        let bytes = &bytes[..needed as usize * of_entry];
        // As the shader wrote them.
        Ok(bytes.chunks_exact(of_entry).map(|entry| self.entries.triple(entry)).collect())
    }
}
