//! Extreme pictures, textures and cameras, and the comparison of every variant with the reference on each of them. The
//! figure vt.extremes and the tests use them.

mod contenders;
mod examine;
mod scenes;
mod shapes;

pub use contenders::variants;
pub use examine::{Examination, Examiner, ListOutcome, Settled};
pub use scenes::{EXTREMES, Expected, Extreme, Landscape, SIZE, Sight};
