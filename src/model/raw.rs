//! The mesh as every reader returns it, before cleaning.

use super::Attributes;
use glam::DVec3;

/// The largest number of vertices, and of faces: corners of faces stay below 2^32 (an index buffer of 1.5 GiB).
pub const MOST: usize = 1 << 27;

/// A mesh as the file has it. Lengths and indices are consistent; values are unchecked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Raw {
    pub positions: Vec<DVec3>,
    /// Each list empty, or with one entry for each position.
    pub attributes: Attributes,
    pub faces: Vec<[u32; 3]>,
}
