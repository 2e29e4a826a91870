//! The tiles that the camera will see (ours, an option): stages 1, 2 and 3 once more, small, from where the eye will be
//! if it goes on as it does.
//!
//! Nothing is known of the landscape but what the device draws, so any mesh will do, as for the visible list. A quarter
//! of the width and of the height is a sixteenth of the pixels; a tile between two of them is found when it comes
//! nearer. The eye's way is the rigid motion of its last frame, repeated: a turn, a flight around the globe and a
//! straight line go on exactly.

use super::lister::{Room, Stage3};
use super::{Compaction, Config, Dedup, dedup::DedupPass, footprint::Footprint};
use crate::frame::{PerFrame, Seen, Shape, Slot, View};
use crate::math::camera::Pose;
use crate::math::pyramid::Pyramid;
use crate::vk::{Frame, Gpu, Result};

/// A pixel of the small picture stands for 4 x 4.
const PIXEL_LOG2: u32 = 2;

/// Stages 1 to 3 for a camera that is not there yet.
pub struct Scout {
    stage1: Footprint,
    stage2: DedupPass,
    stage3: Stage3,
    /// Whether the frame has a list.
    ran: PerFrame<bool>,
}

impl Scout {
    /// For pictures of `size` pixels.
    ///
    /// # Errors
    /// A limit or memory that the device lacks.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config, size: [u32; 2]) -> Result<Scout> {
        // The variant that asks least of a device: it is not what is measured.
        let config = Config { dedup: Dedup::TestOr, compact: Compaction::Append, ..*config };
        let size = size.map(|side| side.div_ceil(1 << PIXEL_LOG2));
        let stage1 = Footprint::coarse(gpu, pyramid, &config, size, PIXEL_LOG2)?;
        Ok(Scout {
            stage2: DedupPass::new(gpu, pyramid, &config, &stage1)?,
            stage3: Stage3::new(gpu, pyramid, &config)?,
            stage1,
            ran: PerFrame::default(),
        })
    }

    /// Records the passes of the frame in `slot`; none where there is no way to go on.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        slot: Slot,
        shapes: &[Shape],
        pose: Option<&Pose>,
    ) -> Result<()> {
        let Scout { stage1, stage2, stage3, ran } = self;
        ran[slot] = pose.is_some();
        let Some(pose) = pose else { return Ok(()) };
        let seen = Seen::new(shapes, View::new(pose, stage1.u1.info().size), 0);
        let Room { marks, list } = stage3.room(slot);
        frame.pass("scout: footprint", |cmd| stage1.draw(cmd, &seen))?;
        frame.pass("scout: dedup", |cmd| stage2.run(cmd, &stage1.u1, marks))?;
        frame.pass("scout: compact", |cmd| stage3.compact(cmd, slot))?;
        frame.pass("scout: read-back", |cmd| {
            list.read_back(cmd);
            Ok(())
        })
    }

    /// The triples of the frame in `slot`, which has ended; empty where it had none.
    ///
    /// # Errors
    /// Device lost.
    pub fn collect(&mut self, gpu: &Gpu, slot: Slot) -> Result<Vec<[u32; 3]>> {
        if !std::mem::take(&mut self.ran[slot]) {
            return Ok(Vec::new());
        }
        Ok(self.stage3.collect(gpu, slot)?.0)
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let lists = self.stage3.memory().into_iter().filter(|(name, _)| *name != "U3 on the host");
        self.stage1.u1.bytes() + self.stage1.depth.bytes() + lists.map(|(_, bytes)| bytes).sum::<u64>()
    }
}
