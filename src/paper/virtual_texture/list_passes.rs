//! The passes that turn the request image into the list for streaming. Stages 2 and 3 make the list on the device, or
//! the host makes it from a copy of the request image, whole or subsampled. Only the chosen method's resources are
//! created.

use super::compact::CompactPass;
use super::dedup::DedupPass;
use super::feedback::{Feedback, Samples};
use super::footprint::Footprint;
use super::read_back::{HostCopy, HostList, HostPass};
use super::tile_mask::TileMask;
use super::visible_list::VisibleList;
use super::{Compaction, Config, Listing};
use crate::frame::{PerFrame, Slot};
use crate::math::pyramid::Pyramid;
use crate::vk::{Cmd, Frame, Gpu, Image, Result};
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
    rooms: PerFrame<Room>,
    pyramid: Pyramid,
    config: Config,
}

/// The mask and list of one frame in flight.
pub struct Room {
    pub mask: TileMask,
    pub list: VisibleList,
}

/// The triples in the grid of their tile addresses, and true if the visible-tile list was too short at first.
pub type Collected = (Vec<[u32; 3]>, bool);

impl Stage3 {
    /// # Errors
    /// A limit of the device; out of memory.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config) -> Result<Stage3> {
        let compact = CompactPass::new(gpu, pyramid, config)?;
        let rooms = rooms(gpu, &compact, (pyramid, config))?;
        let appended = config.compact == Compaction::FusedAppend;
        Ok(Stage3 { compact, appended, rooms, pyramid: *pyramid, config: *config })
    }

    /// The mask and list of the frame in `slot`.
    pub fn room(&self, slot: Slot) -> &Room {
        &self.rooms[slot]
    }

    /// Records the passes after the mask.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(&self, frame: &mut Frame<'_>, slot: Slot) -> Result<()> {
        if !self.appended {
            frame.pass("compact", |cmd| self.compact(cmd, slot))?;
        }
        frame.pass("read-back", |cmd| {
            self.rooms[slot].list.read_back(cmd);
            Ok(())
        })
    }

    /// Compacts the mask of the frame in `slot` into its list.
    ///
    /// # Errors
    /// Out of memory.
    pub fn compact(&self, cmd: &mut Cmd<'_>, slot: Slot) -> Result<()> {
        let Room { mask, list } = &self.rooms[slot];
        self.compact.run(cmd, mask, list)
    }

    /// Labels of the passes, in order.
    pub fn passes(&self) -> Vec<&'static str> {
        if self.appended { vec!["read-back"] } else { vec!["compact", "read-back"] }
    }

    /// The list of the frame in `slot`, which has ended.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn collect(&mut self, gpu: &Gpu, slot: Slot) -> Result<Collected> {
        let Room { mask, list } = &mut self.rooms[slot];
        self.compact.collect(gpu, mask, list)
    }

    /// (name, bytes) of all frames in flight.
    pub fn memory(&self) -> Vec<(&'static str, u64)> {
        let sum = |bytes: fn(&Room) -> u64| self.rooms.iter().map(bytes).sum();
        vec![
            ("tile mask", sum(|room| room.mask.bytes())),
            ("visible-tile list", sum(|room| room.list.bytes()[0])),
            ("visible-tile list on the host", sum(|room| room.list.bytes()[1])),
        ]
    }
}

fn rooms(gpu: &Gpu, compact: &CompactPass, (pyramid, config): (&Pyramid, &Config)) -> Result<PerFrame<Room>> {
    PerFrame::new(|| {
        let list = compact.list(gpu, u64::from(config.list_capacity))?;
        Ok(Room { mask: TileMask::new(gpu, pyramid, config)?, list })
    })
}

impl ListPasses {
    /// Creates the passes over the request image of `stage1`.
    ///
    /// # Errors
    /// A limit of the device; out of memory.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config, stage1: &Footprint) -> Result<ListPasses> {
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
    pub fn renew(&mut self, gpu: &Gpu, stage1: &Footprint) -> Result<()> {
        let (format, size) = (stage1.format, stage1.requests.info().size);
        match self {
            ListPasses::Device(_, stage3) => {
                stage3.rooms = rooms(gpu, &stage3.compact, (&stage3.pyramid, &stage3.config))?;
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
    pub fn record(&self, frame: &mut Frame<'_>, requests: &Image, slot: Slot) -> Result<()> {
        match self {
            ListPasses::Device(dedup, stage3) => {
                frame.pass("dedup", |cmd| dedup.run(cmd, requests, &stage3.room(slot).mask))?;
                stage3.record(frame, slot)
            }
            ListPasses::Host(_, copies) => frame.pass("copy request image", |cmd| {
                copies[slot].run(cmd, requests);
                Ok(())
            }),
            ListPasses::Feedback(feedback) => {
                let samples = &feedback.samples[slot];
                let number = feedback.frame.replace(feedback.frame.get() + 1);
                frame.pass("feedback", |cmd| feedback.gather.run(cmd, requests, samples, number))?;
                frame.pass("read-back", |cmd| {
                    samples.read_back(cmd);
                    Ok(())
                })
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
    pub fn collect(&mut self, gpu: &Gpu, slot: Slot) -> Result<Collected> {
        match self {
            ListPasses::Device(_, stage3) => stage3.collect(gpu, slot),
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
            ListPasses::Device(_, stage3) => stage3.memory(),
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
