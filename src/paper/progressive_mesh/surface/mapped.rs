//! Index buffers in memory that the host writes and the device reads directly, one for each frame in flight.

use crate::frame::{FrameSlot, PerFrame};
use crate::vk::{Buffer, BufferUse, Gpu, IndexType, Result};
use std::ops::Range;
use std::sync::Arc;

/// The buffers. In each frame, one buffer receives the changes since the last frame that used it. The host never reads
/// the buffers, because such memory is often slow to read.
pub struct Mapped {
    index: IndexType,
    slots: PerFrame<Copied>,
}

/// One buffer, and the ranges of bytes in which it is out of date.
struct Copied {
    buffer: Arc<Buffer>,
    stale: Vec<Range<usize>>,
}

impl Mapped {
    /// # Errors
    /// Out of memory.
    pub fn new(gpu: &Gpu, name: &str, index: IndexType) -> Result<Mapped> {
        let empty = || gpu.buffer(name, 0, BufferUse::MappedIndices(index));
        let slots = PerFrame::new(|| Ok(Copied { buffer: Arc::new(empty()?), stale: Vec::new() }))?;
        Ok(Mapped { index, slots })
    }

    /// Brings the buffer of `slot`, whose last frame has ended, up to date: `touched` are the ranges of `bytes` that
    /// changed since the last call. Returns the buffer, and how many bytes were written.
    ///
    /// # Errors
    /// Out of memory.
    pub fn update(
        &mut self,
        gpu: &Gpu,
        slot: FrameSlot,
        bytes: &[u8],
        touched: &[Range<usize>],
    ) -> Result<(Arc<Buffer>, u64)> {
        self.slots.iter_mut().for_each(|copied| copied.stale.extend_from_slice(touched));
        let Copied { buffer, stale } = &mut self.slots[slot];
        // Shaders read whole words.
        let needed = (bytes.len() as u64).next_multiple_of(4);
        if needed > buffer.bytes() || Arc::get_mut(buffer).is_none() {
            let grown = if needed > buffer.bytes() { buffer.bytes() / 8 * 12 } else { buffer.bytes() };
            let usage = BufferUse::MappedIndices(self.index);
            *buffer = Arc::new(gpu.buffer(buffer.name(), needed.max(grown), usage)?);
            stale.clear();
            stale.push(0..bytes.len());
        }
        let mut memory = Arc::get_mut(buffer).expect("the slot's own buffer").mapped_mut();
        let mut written = 0;
        for range in stale.drain(..) {
            memory[range.clone()].copy_from_slice(&bytes[range.clone()]);
            written += range.len() as u64;
        }
        drop(memory);
        Ok((buffer.clone(), written))
    }

    /// Bytes of all buffers.
    pub fn bytes(&self) -> u64 {
        self.slots.iter().map(|copied| copied.buffer.bytes()).sum()
    }
}
