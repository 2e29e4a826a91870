//! The passes that turn the request image into the list for streaming. Stages 2 and 3 make the list on the device, or
//! the host makes it from a copy of the request image, whole or subsampled. Only the chosen method's resources are
//! created.

use super::compact::CompactPass;
use super::dedup::DedupPass;
use super::feedback::{Feedback, Samples};
use super::footprint::FootprintPass;
use super::read_back::{HostCopy, HostList, HostPass};
use super::tile_mask::Mask;
use super::visible_list::VisibleList;
use super::{Compaction, Config, Listing};
use crate::frame::{FrameSlot, PerFrame};
use crate::math::pyramid::Pyramid;
use crate::vk::{Frame, Gpu, Image, Result};
use std::cell::Cell;

/// The passes between stage 1 and the host's list, and their buffers for each frame in flight.
pub enum ListPasses {
    /// Stages 2 and 3.
    Device(Box<DedupPass>, Box<Stage3>),
    /// Copies the whole request image to the host.
    Host(Box<HostList>, Box<PerFrame<HostCopy>>),
    /// Copies one pixel of each block.
    Feedback(Box<Subsampled>),
}

/// The list from subsampled feedback.
pub struct Subsampled {
    gather: Feedback,
    list: HostList,
    /// Frames recorded so far; selects the pixels that the next frame samples.
    frame: Cell<u64>,
    samples: PerFrame<Samples>,
}

/// Stage 3 and its read-back.
pub struct Stage3 {
    compact: CompactPass,
    /// The fused draw also appends to the list, so there is no compaction pass.
    appended: bool,
    lists: PerFrame<VisibleList>,
    /// Capacity of a new list, in triples.
    capacity: u64,
}

/// The triples in the grid of their tile addresses, and true if the visible-tile list was too short at first.
pub type Collected = (Vec<[u32; 3]>, bool);

impl Stage3 {
    /// # Errors
    /// A limit of the device; out of memory.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config) -> Result<Stage3> {
        let compact = CompactPass::new(gpu, pyramid, config)?;
        let appended = config.compact == Compaction::FusedAppend;
        let capacity = u64::from(config.list_capacity);
        Ok(Stage3 { lists: PerFrame::new(|| compact.list(gpu, capacity))?, compact, appended, capacity })
    }

    /// The list of the frame in `slot`.
    pub fn list(&self, slot: FrameSlot) -> &VisibleList {
        &self.lists[slot]
    }

    /// Records the passes that read `mask`, the tile mask of the frame in `slot`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(&self, frame: &mut Frame<'_>, slot: FrameSlot, mask: Mask<'_>) -> Result<()> {
        let list = &self.lists[slot];
        if !self.appended {
            frame.pass("compact", |cmd| list.compact(cmd, mask))?;
        }
        frame.pass("read-back", |cmd| list.read_back(cmd))
    }

    /// Labels of the passes, in order.
    pub fn passes(&self) -> Vec<&'static str> {
        if self.appended { vec!["read-back"] } else { vec!["compact", "read-back"] }
    }

    /// The list of the frame in `slot`, which has ended. If the list was too short, a longer list is filled from
    /// `mask`.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn collect(&mut self, gpu: &Gpu, slot: FrameSlot, mask: Mask<'_>) -> Result<Collected> {
        self.compact.collect(gpu, mask, &mut self.lists[slot])
    }

    /// (name, bytes), summed over all frames in flight. `masks`: bytes of stage 2's tile masks.
    pub fn memory(&self, masks: u64) -> Vec<(&'static str, u64)> {
        let sum = |which: usize| self.lists.iter().map(|list| list.bytes()[which]).sum();
        vec![("tile mask", masks), ("visible-tile list", sum(0)), ("visible-tile list on the host", sum(1))]
    }
}

impl ListPasses {
    /// Creates the passes over the request image of `stage1`.
    ///
    /// # Errors
    /// A limit of the device; out of memory.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config, stage1: &FootprintPass) -> Result<ListPasses> {
        let (format, size) = (stage1.format, stage1.requests.info().size);
        let list = |pass| -> Result<HostList> {
            Ok(HostList::new(pass, pyramid, format, config.address)?.reaching(stage1.reaches))
        };
        let host = |pass| -> Result<ListPasses> {
            let copies = PerFrame::new(|| HostCopy::new(gpu, size, format))?;
            Ok(ListPasses::Host(Box::new(list(pass)?), Box::new(copies)))
        };
        Ok(match config.list {
            Listing::Device => {
                let dedup = DedupPass::new(gpu, pyramid, config, stage1)?;
                ListPasses::Device(Box::new(dedup), Box::new(Stage3::new(gpu, pyramid, config)?))
            }
            Listing::HostHash => host(HostPass::Hash)?,
            Listing::HostBitmap => host(HostPass::Bitmap)?,
            Listing::Feedback => {
                let gather = Feedback::new(gpu, format, config.feedback_log2)?;
                let samples = PerFrame::new(|| gather.samples(gpu, size))?;
                let (list, frame) = (list(HostPass::Bitmap)?, Cell::new(0));
                ListPasses::Feedback(Box::new(Subsampled { gather, list, frame, samples }))
            }
        })
    }

    /// Recreates the buffers for a `stage1` of another size.
    ///
    /// # Errors
    /// Out of memory.
    pub fn renew(&mut self, gpu: &Gpu, stage1: &FootprintPass) -> Result<()> {
        let (format, size) = (stage1.format, stage1.requests.info().size);
        match self {
            ListPasses::Device(_, stage3) => {
                stage3.lists = PerFrame::new(|| stage3.compact.list(gpu, stage3.capacity))?;
            }
            ListPasses::Host(_, copies) => **copies = PerFrame::new(|| HostCopy::new(gpu, size, format))?,
            ListPasses::Feedback(feedback) => {
                feedback.samples = PerFrame::new(|| feedback.gather.samples(gpu, size))?;
            }
        }
        Ok(())
    }

    /// Records the passes over `requests`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(&self, frame: &mut Frame<'_>, requests: &Image, slot: FrameSlot) -> Result<()> {
        match self {
            ListPasses::Device(dedup, stage3) => {
                frame.pass("dedup", |cmd| dedup.run(cmd, requests, slot))?;
                stage3.record(frame, slot, dedup.mask(slot))
            }
            ListPasses::Host(_, copies) => {
                frame.pass("copy request image", |cmd| copies[slot].run(cmd, requests))
            }
            ListPasses::Feedback(feedback) => {
                let samples = &feedback.samples[slot];
                let number = feedback.frame.replace(feedback.frame.get() + 1);
                frame.pass("feedback", |cmd| feedback.gather.run(cmd, requests, samples, number))?;
                frame.pass("read-back", |cmd| samples.read_back(cmd))
            }
        }
    }

    /// Labels of the passes, in order.
    pub fn passes(&self) -> Vec<&'static str> {
        match self {
            ListPasses::Device(_, stage3) => [vec!["dedup"], stage3.passes()].concat(),
            ListPasses::Host(..) => vec!["copy request image"],
            ListPasses::Feedback(_) => vec!["feedback", "read-back"],
        }
    }

    /// The list of the frame in `slot`, which has ended.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn collect(&mut self, gpu: &Gpu, slot: FrameSlot) -> Result<Collected> {
        match self {
            ListPasses::Device(dedup, stage3) => stage3.collect(gpu, slot, dedup.mask(slot)),
            ListPasses::Host(host, copies) => Ok((host.list(&copies[slot].words()), false)),
            ListPasses::Feedback(feedback) => {
                let Subsampled { list, samples, .. } = &mut **feedback;
                Ok((list.list(&samples[slot].words()), false))
            }
        }
    }

    /// (name, bytes) on the device and on the host.
    pub fn memory(&self) -> Vec<(&'static str, u64)> {
        match self {
            ListPasses::Device(dedup, stage3) => stage3.memory(dedup.bytes()),
            ListPasses::Host(_, copies) => {
                vec![("request image on the host", copies.iter().map(HostCopy::bytes).sum())]
            }
            ListPasses::Feedback(feedback) => {
                let sum = |which: usize| feedback.samples.iter().map(|samples| samples.bytes()[which]).sum();
                vec![("feedback", sum(0)), ("feedback on the host", sum(1))]
            }
        }
    }
}
