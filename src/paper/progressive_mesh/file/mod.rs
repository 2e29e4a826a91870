//! `.pmesh` files: a progressive mesh from the coarsest level on, so that a file cut behind its first
//! chunk is a coarser mesh.
//!
//! The bytes are described in docs/pmesh.md. What is stored exactly is the [`ProgressiveMesh`]; what can be derived
//! is not stored: the slots of a split follow from which faces around the split vertex change (one cheap bit each),
//! the faces that appear from the gap which that leaves, and a permutation from which faces lie near each other. An
//! adaptive range coder (`coder`) packs the rest. Hoppe (1996) codes a split by its place and two neighbours in
//! the same spirit; slots and permutations are not his subject.
//!
//! A file is hostile until it was read: every declared number is held against the bytes that are there, and every
//! index against what is live.

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

use super::mesh::ProgressiveMesh;
use serde::Serialize;

/// 89 "OPM" and the line ends that transfers in text mode destroy, as PNG has them.
const MAGIC: [u8; 8] = *b"\x89OPM\r\n\x1a\n";
/// The format's version.
pub const VERSION: u32 = 1;
const HEADER_BYTES: usize = 72;
const CHUNK_HEAD_BYTES: usize = 28;
/// Vertices, faces, levels and moved faces that one byte of a payload can stand for at most; a writer pads the payload
/// where they took less. Real ones take some bits each; a hostile file so gets at most some hundred bytes of memory
/// for each of its own.
const ITEMS_PER_BYTE: u64 = 4;
/// Corners that splits replace for each byte of a payload, at most; padded likewise. A vertex may take all faces of a hub
/// for a hundredth of a bit each.
const CORNERS_PER_BYTE: u64 = 16;

/// What a file said.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// All of it, or as much as is there: then its last level is not the full mesh.
    pub mesh: ProgressiveMesh,
    pub contents: Contents,
}

/// What a file consists of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contents {
    /// The file's length.
    pub bytes: u64,
    /// Bytes of the header, the chunks' heads and the coder's ends: what is in none of `sizes`.
    pub frame_bytes: f64,
    /// Bits of the chunks that were read.
    pub sizes: Sizes,
    /// Chunks, levels, vertices and faces of the whole file.
    pub whole: Extent,
    /// Those that were read: less where the file is cut.
    pub read: Extent,
}

/// How much there is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Extent {
    pub chunks: u32,
    /// One more than the last level's number.
    pub levels: u32,
    pub vertices: u32,
    pub faces: u32,
}

impl Contents {
    /// Whether the end of the file is missing.
    pub fn is_cut(&self) -> bool {
        self.read != self.whole
    }

    /// What is missing at the end of the file, in words; none where it is whole.
    pub fn missing(&self) -> Option<String> {
        let Contents { read, whole, .. } = self;
        self.is_cut().then(|| {
            format!(
                "the end is missing: {} of {} chunks, {} of {} levels, {} of {} faces are here",
                read.chunks, whole.chunks, read.levels, whole.levels, read.faces, whole.faces
            )
        })
    }

    /// Bytes of the file but for positions, attributes and header, for each split: what the levels of detail cost. A
    /// split is a level; on a seam it brings several vertices.
    pub fn bytes_per_split(&self, mesh: &ProgressiveMesh) -> f64 {
        let splits = mesh.last_level().max(1) as f64;
        let Sizes { levels, splits: which, faces, swaps, .. } = self.sizes;
        ((levels + which + faces + swaps) / 8.0 + self.frame_bytes - HEADER_BYTES as f64) / splits
    }
}
