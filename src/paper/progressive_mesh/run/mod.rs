//! Execution, sections 3 to 5: vsplit, ecol, tswap and its inverse, in place in an index buffer.
//!
//! Three implementations give identical bits:
//! - [`State`] is the paper's pseudocode on the paper's arrays, with the errata corrected. A split writes the new
//!   vertex's index (printed: "by CurNewTris"). tswap keeps the first face in a temporary (printed: no temporary). The
//!   inverse of tswap runs the cycle backwards (printed: forwards).
//! - [`Program`] is the production version: the same writes as three flat lists. Every execution writes the
//!   same corners, so each corner is looked up once, when the program is made. A split then neither reads nor
//!   compares faces, and a permutation goes through the buffer in order (see [`Moves`]).
//! - [`apply`](super::apply) runs the same lists on the GPU.
//!
//! Differs from the paper: [`Instances`] keep only drawn faces. Nothing writes a face that is not drawn, so a face is
//! copied from the shared buffer of level 0 when it is first drawn. If the steps of a jump would write more than a
//! construction of the level, the level is constructed instead ([`Program::change`], ours).

mod births;
mod direct;
mod index;
mod instances;
mod jump;
mod program;
mod slices;
mod state;
mod touched;

pub use direct::Direct;
pub use index::Index;
pub use instances::Instances;
pub use program::{Corners, Moves, Operation, Program};
pub use slices::{Slices, TooMany};
pub use state::{State, tswap, tswap_back};
pub use touched::{BLOCK_WORDS, DirtyBlocks, IgnoreWrites, WriteObserver};

use super::mesh::Level;

/// The coarsest level whose error is at most `error` object units; the last level if no level has such an error, or if
/// `error` is NaN.
///
/// # Panics
/// If there are no levels.
pub fn level_for_error(levels: &[Level], error: f32) -> u32 {
    let last = u32::try_from(levels.len() - 1).expect("fewer than 2^32 levels");
    // An error compared with NaN counts as too large, so NaN gives the last level.
    let coarser =
        levels.partition_point(|level| level.error.partial_cmp(&error).is_none_or(|order| order.is_gt()));
    (coarser as u32).min(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_coarsest_level_within_the_error_is_taken() {
        let levels: Vec<Level> =
            [3.0, 2.0, 2.0, 0.5, 0.0].map(|error| Level { error, ..Level::default() }).into();
        let found = |error| level_for_error(&levels, error);
        assert_eq!([4.0, 3.0, 2.9, 2.0, 1.0, 0.5, 0.1, 0.0].map(found), [0, 0, 1, 1, 3, 3, 4, 4]);
        assert_eq!([-1.0, f32::NAN, f32::INFINITY].map(found), [4, 4, 0]);
    }
}
