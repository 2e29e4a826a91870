//! The tiles that the camera will see (ours, an option): stages 1, 2 and 3 once more, small, from where the eye will be
//! if it goes on as it does.
//!
//! Nothing is known of the landscape but what the device draws, so any mesh will do, as for the visible list. A quarter
//! of the width and of the height is a sixteenth of the pixels; a tile between two of them is found when it comes
//! nearer. The eye's way is the rigid motion of its last frame, repeated: a turn, a flight around the globe and a
//! straight line go on exactly.

use super::{
    Compaction, Config, Dedup, compact::CompactPass, dedup::DedupPass, footprint::Footprint, list::List,
    marks::Marks, surface, surface::Surface,
};
use crate::math::camera::Pose;
use crate::math::pyramid::Pyramid;
use crate::vk::{FRAMES_IN_FLIGHT, Frame, Gpu, Result};

/// A pixel of the small picture stands for 4 x 4.
const PIXEL_LOG2: u32 = 2;

/// Stages 1 to 3 for a camera that is not there yet.
pub struct Scout {
    stage1: Footprint,
    stage2: DedupPass,
    stage3: CompactPass,
    flights: Vec<Flight>,
}

/// What each frame in flight has for itself.
struct Flight {
    marks: Marks,
    list: List,
    /// Whether the frame has a list.
    ran: bool,
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
        let stage2 = DedupPass::new(gpu, pyramid, &config, &stage1)?;
        let stage3 = CompactPass::new(gpu, pyramid, &config)?;
        let flights = (0..FRAMES_IN_FLIGHT)
            .map(|_| {
                let list = stage3.list(gpu, u64::from(config.list_capacity))?;
                Ok(Flight { marks: stage2.marks(gpu)?, list, ran: false })
            })
            .collect::<Result<_>>()?;
        Ok(Scout { stage1, stage2, stage3, flights })
    }

    /// Records the pass for place `flight`; nothing where there is no way to go on.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        flight: usize,
        mesh: &Surface,
        pose: Option<&Pose>,
    ) -> Result<()> {
        let Scout { stage1, stage2, stage3, flights } = self;
        let Flight { marks, list, ran } = &mut flights[flight];
        *ran = pose.is_some();
        let Some(pose) = pose else { return Ok(()) };
        let view = surface::view(pose, stage1.u1.info().size, 0);
        frame.pass("scout: footprint", |cmd| stage1.draw(cmd, mesh, &view))?;
        frame.pass("scout: dedup", |cmd| stage2.run(cmd, &stage1.u1, marks))?;
        frame.pass("scout: compact", |cmd| stage3.run(cmd, marks, list))?;
        frame.pass("scout: read-back", |cmd| {
            list.read_back(cmd);
            Ok(())
        })
    }

    /// The triples of the frame that used place `flight` last, which has ended; empty where it had none.
    ///
    /// # Errors
    /// Device lost.
    pub fn collect(&mut self, gpu: &Gpu, flight: usize) -> Result<Vec<[u32; 3]>> {
        let Flight { marks, list, ran } = &mut self.flights[flight];
        if !std::mem::take(ran) {
            return Ok(Vec::new());
        }
        Ok(self.stage3.collect(gpu, marks, list)?.0)
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let lists = self.flights.iter().map(|flight| flight.marks.bytes() + flight.list.bytes()[0]);
        self.stage1.u1.bytes() + self.stage1.depth.bytes() + lists.sum::<u64>()
    }
}
