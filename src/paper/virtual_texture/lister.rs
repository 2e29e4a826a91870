//! From `U1` to the list that streaming gets, by whoever makes it: the device in stages 2 and 3, or the host from a
//! copy of `U1` or of few of its pixels. What only another one needs is not made.

use super::classic::{HostCopy, HostList, HostPass};
use super::compact::CompactPass;
use super::dedup::DedupPass;
use super::feedback::{Feedback, Samples};
use super::footprint::Footprint;
use super::list::List;
use super::marks::Marks;
use super::{Compaction, Config, Listing};
use crate::frame::{PerFrame, Slot};
use crate::math::pyramid::Pyramid;
use crate::vk::{Cmd, Frame, Gpu, Image, Result};
use std::cell::Cell;

/// The passes between stage 1 and the host's list, and the room that each frame in flight has for its own.
pub enum Lister {
    /// Stages 2 and 3.
    Device(Box<DedupPass>, Box<Stage3>),
    /// All of `U1` goes to the host.
    Host(Box<HostList>, Box<PerFrame<HostCopy>>),
    /// One pixel of each block does.
    Feedback(Box<Subsampled>),
}

/// The list of few pixels.
pub struct Subsampled {
    gather: Feedback,
    list: HostList,
    /// Frames recorded so far: which pixels the next one looks at.
    frame: Cell<u64>,
    samples: PerFrame<Samples>,
}

/// What comes after the marks, whoever sets them: stage 3 and its read-back.
pub struct Stage3 {
    compact: CompactPass,
    /// The draw that marks appends, too: no pass compacts.
    appended: bool,
    rooms: PerFrame<Room>,
    pyramid: Pyramid,
    config: Config,
}

/// What a frame in flight keeps of its list.
pub struct Room {
    pub marks: Marks,
    pub list: List,
}

/// A list that the device or the host made: triples in the keying's grid, and whether `U3` was too short at first.
pub type Collected = (Vec<[u32; 3]>, bool);

impl Stage3 {
    /// # Errors
    /// A limit or memory that the device lacks.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config) -> Result<Stage3> {
        let compact = CompactPass::new(gpu, pyramid, config)?;
        let rooms = rooms(gpu, &compact, (pyramid, config))?;
        let appended = config.compact == Compaction::FusedAppend;
        Ok(Stage3 { compact, appended, rooms, pyramid: *pyramid, config: *config })
    }

    /// What the frame in `slot` marks.
    pub fn room(&self, slot: Slot) -> &Room {
        &self.rooms[slot]
    }

    /// Records the passes behind the marks.
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

    /// From the marks of the frame in `slot` to its list.
    ///
    /// # Errors
    /// Out of memory.
    pub fn compact(&self, cmd: &mut Cmd<'_>, slot: Slot) -> Result<()> {
        let Room { marks, list } = &self.rooms[slot];
        self.compact.run(cmd, marks, list)
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
        let Room { marks, list } = &mut self.rooms[slot];
        self.compact.collect(gpu, marks, list)
    }

    /// (name, bytes) of all frames in flight.
    pub fn memory(&self) -> Vec<(&'static str, u64)> {
        let sum = |bytes: fn(&Room) -> u64| self.rooms.iter().map(bytes).sum();
        vec![
            ("U2", sum(|room| room.marks.bytes())),
            ("U3", sum(|room| room.list.bytes()[0])),
            ("U3 on the host", sum(|room| room.list.bytes()[1])),
        ]
    }
}

fn rooms(gpu: &Gpu, compact: &CompactPass, (pyramid, config): (&Pyramid, &Config)) -> Result<PerFrame<Room>> {
    PerFrame::new(|| {
        let list = compact.list(gpu, u64::from(config.list_capacity))?;
        Ok(Room { marks: Marks::new(gpu, pyramid, config)?, list })
    })
}

impl Lister {
    /// A list of what `stage1` draws.
    ///
    /// # Errors
    /// A limit or memory that the device lacks.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config, stage1: &Footprint) -> Result<Lister> {
        let (format, size) = (stage1.format, stage1.u1.info().size);
        let list = |pass| HostList::new(pass, pyramid, format, config.keying);
        let host = |pass| -> Result<Lister> {
            let copies = PerFrame::new(|| HostCopy::new(gpu, size, format))?;
            Ok(Lister::Host(Box::new(list(pass)?), Box::new(copies)))
        };
        Ok(match config.list {
            Listing::Device => {
                let dedup = DedupPass::new(gpu, pyramid, config, stage1)?;
                Lister::Device(Box::new(dedup), Box::new(Stage3::new(gpu, pyramid, config)?))
            }
            Listing::HostHash => host(HostPass::Hash)?,
            Listing::HostBitmap => host(HostPass::Bitmap)?,
            Listing::Feedback => {
                let gather = Feedback::new(gpu, format, config.feedback_log2)?;
                let samples = PerFrame::new(|| gather.samples(gpu, size))?;
                let (list, frame) = (list(HostPass::Bitmap)?, Cell::new(0));
                Lister::Feedback(Box::new(Subsampled { gather, list, frame, samples }))
            }
        })
    }

    /// Makes new room, for the lists of a `stage1` of another size.
    ///
    /// # Errors
    /// Out of memory.
    pub fn renew(&mut self, gpu: &Gpu, stage1: &Footprint) -> Result<()> {
        let (format, size) = (stage1.format, stage1.u1.info().size);
        match self {
            Lister::Device(_, stage3) => {
                stage3.rooms = rooms(gpu, &stage3.compact, (&stage3.pyramid, &stage3.config))?;
            }
            Lister::Host(_, copies) => **copies = PerFrame::new(|| HostCopy::new(gpu, size, format))?,
            Lister::Feedback(feedback) => {
                feedback.samples = PerFrame::new(|| feedback.gather.samples(gpu, size))?;
            }
        }
        Ok(())
    }

    /// Records the passes over `u1`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(&self, frame: &mut Frame<'_>, u1: &Image, slot: Slot) -> Result<()> {
        match self {
            Lister::Device(dedup, stage3) => {
                frame.pass("dedup", |cmd| dedup.run(cmd, u1, &stage3.room(slot).marks))?;
                stage3.record(frame, slot)
            }
            Lister::Host(_, copies) => frame.pass("copy U1", |cmd| {
                copies[slot].run(cmd, u1);
                Ok(())
            }),
            Lister::Feedback(feedback) => {
                let samples = &feedback.samples[slot];
                let number = feedback.frame.replace(feedback.frame.get() + 1);
                frame.pass("feedback", |cmd| feedback.gather.run(cmd, u1, samples, number))?;
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
            Lister::Device(_, stage3) => [vec!["dedup"], stage3.passes()].concat(),
            Lister::Host(..) => vec!["copy U1"],
            Lister::Feedback(_) => vec!["feedback", "read-back"],
        }
    }

    /// The list of the frame in `slot`, which has ended.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn collect(&mut self, gpu: &Gpu, slot: Slot) -> Result<Collected> {
        match self {
            Lister::Device(_, stage3) => stage3.collect(gpu, slot),
            Lister::Host(host, copies) => Ok((host.list(copies[slot].words()), false)),
            Lister::Feedback(feedback) => {
                let Subsampled { list, samples, .. } = &mut **feedback;
                Ok((list.list(samples[slot].words()), false))
            }
        }
    }

    /// (name, bytes) on the device, and where the host reads.
    pub fn memory(&self) -> Vec<(&'static str, u64)> {
        match self {
            Lister::Device(_, stage3) => stage3.memory(),
            Lister::Host(_, copies) => vec![("U1 on the host", copies.iter().map(HostCopy::bytes).sum())],
            Lister::Feedback(feedback) => {
                let sum = |which: usize| feedback.samples.iter().map(|samples| samples.bytes()[which]).sum();
                vec![("feedback", sum(0)), ("feedback on the host", sum(1))]
            }
        }
    }
}
