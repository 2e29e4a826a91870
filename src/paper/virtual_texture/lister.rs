//! From `U1` to the list that streaming gets, by whoever makes it: the device in stages 2 and 3, or the host from a
//! copy of `U1` or of few of its pixels. What only another one needs is not made.

use super::classic::{HostCopy, HostList, HostPass};
use super::compact::CompactPass;
use super::dedup::DedupPass;
use super::feedback::{Feedback, Samples};
use super::footprint::Footprint;
use super::list::List;
use super::marks::Marks;
use super::{Config, Listing};
use crate::math::pyramid::Pyramid;
use crate::vk::{Frame, Gpu, Image, Result};
use std::cell::Cell;

/// The passes between stage 1 and the host's list.
pub enum Lister {
    /// Stages 2 and 3.
    Device(Box<Stages>),
    /// All of `U1` goes to the host.
    Host(HostList),
    /// One pixel of each block does; the number of frames recorded so far says which.
    Feedback(Feedback, HostList, Cell<u64>),
}

/// Stages 2 and 3, and the room that their lists get at first.
pub struct Stages {
    pub dedup: DedupPass,
    pub compact: CompactPass,
    capacity: u64,
}

/// What a frame in flight keeps of its list.
pub enum Listed {
    Device { marks: Marks, list: Box<List> },
    Host(HostCopy),
    Feedback(Samples),
}

impl Lister {
    /// # Errors
    /// A limit or memory that the device lacks.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config, stage1: &Footprint) -> Result<Lister> {
        let host = |pass| HostList::new(pass, pyramid, stage1.format, config.keying);
        Ok(match config.list {
            Listing::Device => Lister::Device(Box::new(Stages {
                dedup: DedupPass::new(gpu, pyramid, config, stage1)?,
                compact: CompactPass::new(gpu, pyramid, config)?,
                capacity: u64::from(config.list_capacity),
            })),
            Listing::HostHash => Lister::Host(host(HostPass::Hash)?),
            Listing::HostBitmap => Lister::Host(host(HostPass::Bitmap)?),
            Listing::Feedback => {
                let feedback = Feedback::new(gpu, stage1.format, config.feedback_log2)?;
                Lister::Feedback(feedback, host(HostPass::Bitmap)?, Cell::new(0))
            }
        })
    }

    /// Room for one frame in flight.
    ///
    /// # Errors
    /// Out of memory.
    pub fn listed(&self, gpu: &Gpu, stage1: &Footprint) -> Result<Listed> {
        let size = stage1.u1.info().size;
        Ok(match self {
            Lister::Device(stages) => Listed::Device {
                marks: stages.dedup.marks(gpu)?,
                list: Box::new(stages.compact.list(gpu, stages.capacity)?),
            },
            Lister::Host(_) => Listed::Host(HostCopy::new(gpu, size, stage1.format)?),
            Lister::Feedback(feedback, ..) => Listed::Feedback(feedback.samples(gpu, size)?),
        })
    }

    /// Records the passes.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(&self, frame: &mut Frame<'_>, u1: &Image, into: &Listed) -> Result<()> {
        let [first, second, third] = self.labels();
        match (self, into) {
            (Lister::Device(stages), Listed::Device { marks, list }) => {
                frame.pass(first, |cmd| stages.dedup.run(cmd, u1, marks))?;
                frame.pass(second, |cmd| stages.compact.run(cmd, marks, list))?;
                frame.pass(third, |cmd| {
                    list.read_back(cmd);
                    Ok(())
                })
            }
            (Lister::Host(_), Listed::Host(copy)) => frame.pass(first, |cmd| {
                copy.run(cmd, u1);
                Ok(())
            }),
            (Lister::Feedback(feedback, _, number), Listed::Feedback(samples)) => {
                frame.pass(first, |cmd| feedback.run(cmd, u1, samples, number.replace(number.get() + 1)))?;
                frame.pass(second, |cmd| {
                    samples.read_back(cmd);
                    Ok(())
                })
            }
            _ => panic!("the room was made for another variant"),
        }
    }

    fn labels(&self) -> [&'static str; 3] {
        match self {
            Lister::Device(_) => ["dedup", "compact", "read-back"],
            Lister::Host(_) => ["copy U1", "", ""],
            Lister::Feedback(..) => ["feedback", "read-back", ""],
        }
    }

    /// Labels of the passes, in order.
    pub fn passes(&self) -> impl Iterator<Item = &'static str> {
        self.labels().into_iter().filter(|label| !label.is_empty())
    }

    /// The triples of a frame that has ended, in the keying's grid; and whether `U3` was too short at first.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn collect(&mut self, gpu: &Gpu, from: &mut Listed) -> Result<(Vec<[u32; 3]>, bool)> {
        match (self, from) {
            (Lister::Device(stages), Listed::Device { marks, list }) => {
                stages.compact.collect(gpu, marks, list)
            }
            (Lister::Host(host), Listed::Host(copy)) => Ok((host.list(copy.words()), false)),
            (Lister::Feedback(_, host, _), Listed::Feedback(samples)) => {
                Ok((host.list(samples.words()), false))
            }
            _ => panic!("the room was made for another variant"),
        }
    }
}

impl Listed {
    /// (name, bytes) on the device, and where the host reads.
    pub fn memory(&self) -> Vec<(&'static str, u64)> {
        match self {
            Listed::Device { marks, list } => {
                let [device, host] = list.bytes();
                vec![("U2", marks.bytes()), ("U3", device), ("U3 on the host", host)]
            }
            Listed::Host(copy) => vec![("U1 on the host", copy.bytes())],
            Listed::Feedback(samples) => {
                let [device, host] = samples.bytes();
                vec![("feedback", device), ("feedback on the host", host)]
            }
        }
    }
}
