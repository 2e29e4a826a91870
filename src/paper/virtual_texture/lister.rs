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
use crate::math::pyramid::Pyramid;
use crate::vk::{Frame, Gpu, Image, Result};
use std::cell::Cell;

/// The passes between stage 1 and the host's list.
pub enum Lister {
    /// Stages 2 and 3, each where it is a pass: a fused draw marks, and may append, itself.
    Device(Box<Stages>),
    /// All of `U1` goes to the host.
    Host(HostList),
    /// One pixel of each block does; the number of frames recorded so far says which.
    Feedback(Feedback, HostList, Cell<u64>),
}

/// Stages 2 and 3, and what their marks and lists are made for.
pub struct Stages {
    dedup: Option<DedupPass>,
    compact: CompactPass,
    pyramid: Pyramid,
    config: Config,
}

/// What a frame in flight keeps of its list.
pub enum Listed {
    Device { marks: Marks, list: Box<List> },
    Host(HostCopy),
    Feedback(Samples),
}

impl Lister {
    /// `stage1`: all but fused variants have one.
    ///
    /// # Errors
    /// A limit or memory that the device lacks.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config, stage1: Option<&Footprint>) -> Result<Lister> {
        let format = || stage1.expect("the host's lists are of U1").format;
        let host = |pass| HostList::new(pass, pyramid, format(), config.keying);
        Ok(match config.list {
            Listing::Device => Lister::Device(Box::new(Stages {
                dedup: stage1.map(|stage1| DedupPass::new(gpu, pyramid, config, stage1)).transpose()?,
                compact: CompactPass::new(gpu, pyramid, config)?,
                pyramid: *pyramid,
                config: *config,
            })),
            Listing::HostHash => Lister::Host(host(HostPass::Hash)?),
            Listing::HostBitmap => Lister::Host(host(HostPass::Bitmap)?),
            Listing::Feedback => {
                let feedback = Feedback::new(gpu, format(), config.feedback_log2)?;
                Lister::Feedback(feedback, host(HostPass::Bitmap)?, Cell::new(0))
            }
        })
    }

    /// Room for one frame in flight.
    ///
    /// # Errors
    /// Out of memory.
    pub fn listed(&self, gpu: &Gpu, stage1: Option<&Footprint>) -> Result<Listed> {
        Ok(match (self, stage1) {
            (Lister::Device(stages), _) => Listed::Device {
                marks: Marks::new(gpu, &stages.pyramid, &stages.config)?,
                list: Box::new(stages.compact.list(gpu, u64::from(stages.config.list_capacity))?),
            },
            (Lister::Host(_), Some(Footprint { u1, format, .. })) => {
                Listed::Host(HostCopy::new(gpu, u1.info().size, *format)?)
            }
            (Lister::Feedback(feedback, ..), Some(Footprint { u1, .. })) => {
                Listed::Feedback(feedback.samples(gpu, u1.info().size)?)
            }
            (_, None) => panic!("the host's lists are of U1"),
        })
    }

    /// Records the passes; `u1` where there is one.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(&self, frame: &mut Frame<'_>, u1: Option<&Image>, into: &Listed) -> Result<()> {
        let [first, second, third] = self.labels();
        let of_u1 = || u1.expect("stage 1 has drawn U1");
        match (self, into) {
            (Lister::Device(stages), Listed::Device { marks, list }) => {
                if let Some(dedup) = &stages.dedup {
                    frame.pass(first, |cmd| dedup.run(cmd, of_u1(), marks))?;
                }
                if !second.is_empty() {
                    frame.pass(second, |cmd| stages.compact.run(cmd, marks, list))?;
                }
                frame.pass(third, |cmd| {
                    list.read_back(cmd);
                    Ok(())
                })
            }
            (Lister::Host(_), Listed::Host(copy)) => frame.pass(first, |cmd| {
                copy.run(cmd, of_u1());
                Ok(())
            }),
            (Lister::Feedback(feedback, _, number), Listed::Feedback(samples)) => {
                frame.pass(first, |cmd| {
                    feedback.run(cmd, of_u1(), samples, number.replace(number.get() + 1))
                })?;
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
            Lister::Device(stages) => [
                if stages.dedup.is_some() { "dedup" } else { "" },
                // The draw has appended.
                if stages.config.compact == Compaction::FusedAppend { "" } else { "compact" },
                "read-back",
            ],
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
    /// What stages 2 and 3 fill, or the draw that marks.
    pub fn on_the_device(&self) -> Option<(&Marks, &List)> {
        match self {
            Listed::Device { marks, list } => Some((marks, list)),
            _ => None,
        }
    }

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
