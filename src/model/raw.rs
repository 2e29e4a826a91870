//! The mesh as every reader returns it, before cleaning.

use super::Attributes;
use glam::DVec3;

/// Limit of vertices, and of faces: 3 x 2^27 corners stay below 2^32 and fill an index buffer of 1.5 GiB.
pub const MAX_ITEMS: usize = 1 << 27;

/// A mesh as stored in the file. Lengths and indices are consistent; values are unchecked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Raw {
    pub positions: Vec<DVec3>,
    /// Each list is empty or has one entry for each position.
    pub attributes: Attributes,
    pub faces: Vec<[u32; 3]>,
}
