//! The frame loop ([`Run`]), shared by figures, the command line and the window. For each frame: retire the
//! results of the last frame in this slot, prepare, record, submit. A [`Technique`] draws a part of the
//! frame. Papers 1 and 2 implement one each; this module depends on no paper.

mod per_frame;
mod records;
mod run;
mod shape;
mod target;
mod technique;
mod view;

pub use per_frame::{FrameSlot, PerFrame};
pub use records::{HISTORY, Records};
pub use run::Run;
pub use shape::{DepthOnlyMesh, Draw, DrawList, Onto, Shape, world_view};
pub use target::Target;
pub use technique::{Allocations, Progress, STALL, Stalled, Technique};
pub use view::{FRAME_SECONDS, View};
