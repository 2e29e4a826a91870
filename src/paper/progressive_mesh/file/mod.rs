//! `.pmesh` files: a progressive mesh from the coarsest level on, so that a file truncated after its first chunk is a
//! coarser mesh.
//!
//! docs/pmesh.md describes the bytes. The [`ProgressiveMesh`] is stored losslessly; derivable data are not stored. The
//! slots of a split follow from the faces around the split vertex that change (one cheap bit each), new faces from the
//! gap that this leaves, and a permutation from the faces near each other. An adaptive range coder (`coder`) packs the
//! rest. Hoppe (1996) similarly codes a split by its place and two neighbours; slots and permutations are not part of
//! his format.
//!
//! A file is untrusted: every declared number is checked against the available bytes, and every index against the live
//! elements.

mod coder;
#[cfg(test)]
mod hostile;
mod level;
mod live;
mod models;
mod moving;
mod permutation;
mod read;
#[cfg(test)]
mod tests;
mod vertex;
mod write;

pub use models::Sizes;
pub use read::{Flaw, PmeshError};

use super::mesh::{Births, ProgressiveMesh};
use serde::Serialize;

/// 89 "OPM" and the line ends that text-mode transfers destroy, as in PNG.
const MAGIC: [u8; 8] = *b"\x89OPM\r\n\x1a\n";
/// The format's versions. Version 2 differs only in that births are in place.
const VERSIONS: [(u32, Births); 2] = [(1, Births::Tail), (2, Births::InPlace)];
/// The file version for meshes with these births.
///
/// # Panics
/// Never: every variant has a version.
pub fn version(births: Births) -> u32 {
    VERSIONS.iter().find(|(_, of)| *of == births).expect("a version for each").0
}

const HEADER_BYTES: usize = 72;
const CHUNK_HEAD_BYTES: usize = 28;
/// Most vertices, faces, levels and moved faces for each byte of a payload; a writer pads a payload that would exceed
/// it. Real ones take several bits each. The limit bounds a hostile file to some hundred bytes of memory for each of
/// its own.
const ITEMS_PER_BYTE: u64 = 4;
/// Most corners that splits replace for each byte of a payload; padded likewise. A vertex may take all faces of a hub
/// at a hundredth of a bit each.
const CORNERS_PER_BYTE: u64 = 16;

/// A loaded file.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The mesh; of a truncated file the part that is present, whose last level is not the full mesh.
    pub mesh: ProgressiveMesh,
    pub contents: Contents,
}

/// The contents of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contents {
    /// The file's length.
    pub bytes: u64,
    /// Bytes of the header, the chunks' heads and the coder's ends, which are not in `sizes`.
    pub frame_bytes: f64,
    /// Bits of the chunks that were read.
    pub sizes: Sizes,
    /// Chunks, levels, vertices and faces of the whole file.
    pub whole: Extent,
    /// The part that was read: less than `whole` if the file is truncated.
    pub read: Extent,
}

/// The size of a file or of a part of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Extent {
    pub chunks: u32,
    /// The last level's number plus one.
    pub levels: u32,
    pub vertices: u32,
    pub faces: u32,
}

impl Contents {
    /// True if the end of the file is missing.
    pub fn is_cut(&self) -> bool {
        self.read != self.whole
    }

    /// Describes what is missing at the end of the file; `None` if it is complete.
    pub fn missing(&self) -> Option<String> {
        let Contents { read, whole, .. } = self;
        self.is_cut().then(|| {
            format!(
                "the end is missing: {} of {} chunks, {} of {} levels, {} of {} faces are here",
                read.chunks, whole.chunks, read.levels, whole.levels, read.faces, whole.faces
            )
        })
    }

    /// Bytes per split of the file without positions, attributes and header: the cost of the levels of detail. A split
    /// is a level; on a seam it adds several vertices.
    pub fn bytes_per_split(&self, mesh: &ProgressiveMesh) -> f64 {
        let splits = mesh.last_level().max(1) as f64;
        let Sizes { levels, splits: which, faces, swaps, .. } = self.sizes;
        ((levels + which + faces + swaps) / 8.0 + self.frame_bytes - HEADER_BYTES as f64) / splits
    }
}
