//! Prefetch (optional, not in the paper): stages 1, 2 and 3 once more, at low resolution, from the extrapolated camera.
//!
//! The list comes from a draw, so prefetch works for any mesh. The picture has a quarter of the width and height, a
//! sixteenth of the pixels. A tile that falls between these pixels is found only when the camera comes nearer. The
//! camera is extrapolated by repeating the rigid motion of its last frame. This extrapolation is exact for a turn, an
//! orbit around the globe and a straight line.

use super::list_passes::Stage3;
use super::{Compaction, Config, Dedup, dedup::DedupPass, footprint::FootprintPass};
use crate::frame::{DrawList, FrameSlot, PerFrame, Shape, View};
use crate::math::camera::Pose;
use crate::math::pyramid::Pyramid;
use crate::vk::{Frame, Gpu, Result};

/// A pixel of the small picture covers 4 x 4 pixels of the frame.
const PIXEL_LOG2: u32 = 2;

/// Stages 1 to 3 for the extrapolated camera.
pub struct Prefetch {
    stage1: FootprintPass,
    stage2: DedupPass,
    stage3: Stage3,
    /// True if the frame has a list.
    ran: PerFrame<bool>,
}

impl Prefetch {
    /// Creates the passes for pictures of `size` pixels.
    ///
    /// # Errors
    /// A limit of the device; out of memory.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config, size: [u32; 2]) -> Result<Prefetch> {
        // This variant has the fewest device requirements. It need not be the fastest, because no figure compares its
        // time.
        let config = Config { dedup: Dedup::TestOr, compact: Compaction::Append, ..*config };
        let size = size.map(|side| side.div_ceil(1 << PIXEL_LOG2));
        let stage1 = FootprintPass::coarse(gpu, pyramid, &config, size, PIXEL_LOG2)?;
        Ok(Prefetch {
            stage2: DedupPass::new(gpu, pyramid, &config, &stage1)?,
            stage3: Stage3::new(gpu, pyramid, &config)?,
            stage1,
            ran: PerFrame::default(),
        })
    }

    /// Records the passes of the frame in `slot`; none if the camera cannot be extrapolated.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        slot: FrameSlot,
        shapes: &[Shape],
        pose: Option<&Pose>,
    ) -> Result<()> {
        let Prefetch { stage1, stage2, stage3, ran } = self;
        ran[slot] = pose.is_some();
        let Some(pose) = pose else { return Ok(()) };
        let seen = DrawList::new(shapes, View::new(pose, stage1.requests.info().size), 0);
        let list = stage3.list(slot);
        frame.pass("prefetch: footprint", |cmd| stage1.draw(cmd, &seen))?;
        frame.pass("prefetch: dedup", |cmd| stage2.run(cmd, &stage1.requests, slot))?;
        frame.pass("prefetch: compact", |cmd| list.compact(cmd, stage2.mask(slot)))?;
        frame.pass("prefetch: read-back", |cmd| list.read_back(cmd))
    }

    /// The triples of the frame in `slot`, which has ended; empty if it has no list.
    ///
    /// # Errors
    /// Device lost.
    pub fn collect(&mut self, gpu: &Gpu, slot: FrameSlot) -> Result<Vec<[u32; 3]>> {
        if !std::mem::take(&mut self.ran[slot]) {
            return Ok(Vec::new());
        }
        Ok(self.stage3.collect(gpu, slot, self.stage2.mask(slot))?.0)
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let lists = self
            .stage3
            .memory(self.stage2.bytes())
            .into_iter()
            .filter(|(name, _)| *name != "visible-tile list on the host");
        self.stage1.requests.bytes() + self.stage1.depth.bytes() + lists.map(|(_, bytes)| bytes).sum::<u64>()
    }
}
