//! One loop drives every frame, for figures, the command line and the window alike: retire what the frame that used
//! this slot found out, prepare, record, submit ([`Run`]). What is drawn is a [`Technique`]; papers are techniques,
//! and this floor knows none of them.

mod per_frame;
mod records;
mod run;
mod shape;
mod target;
mod technique;
mod view;

pub use per_frame::{PerFrame, Slot};
pub use records::Records;
pub use run::Run;
pub use shape::{DepthAlone, Draw, Onto, Seen, Shape, world_view};
pub use target::Target;
pub use technique::{Memory, Progress, STALL, Stalled, Technique};
pub use view::View;
