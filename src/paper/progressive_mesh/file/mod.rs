//! `.pmesh` files: a progressive mesh, coarsest level first. A file truncated after its first chunk is
//! therefore a coarser mesh.
//!
//! docs/pmesh.md describes the bytes. The [`ProgressiveMesh`] is stored losslessly, without data that can be derived.
//! For a split, the faces around the split vertex take one cheap bit each, and the changed slots follow from these
//! bits. New faces are predicted from the gap that the split leaves, and permutations from the vertices that faces
//! share. An adaptive range coder (`coder`) encodes all symbols. H. Hoppe codes a split similarly, by its vertex and
//! two neighbours ("Progressive Meshes", SIGGRAPH 1996); his format has no slots and no permutations.
//!
//! Files are untrusted: every declared number is checked against the available bytes, and every index against
//! the live elements.

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
pub use read::{FileFlaw, PmeshError};
pub use write::MeshEncoder;

use super::mesh::{Births, ProgressiveMesh};
use serde::Serialize;

/// As in PNG: a byte above 127, a name, and line ends. Transfers in text mode damage these bytes.
const MAGIC: [u8; 8] = *b"\x89OPM\r\n\x1a\n";
/// The version of a mesh's file. Version 2 differs from version 1 only in that births are in place. Version 3 has a
/// flag for births and a flag for the metric.
pub fn version(mesh: &ProgressiveMesh) -> u32 {
    match (mesh.metric, mesh.births) {
        (Some(_), _) => 3,
        (None, Births::InPlace) => 2,
        (None, Births::Tail) => 1,
    }
}

/// The header's flags beyond [`level::Has`], from version 3 on: new faces are born in place; the errors have the metric
/// `appearance`.
const IN_PLACE: u32 = 1 << 3;
const APPEARANCE: u32 = 1 << 4;

const HEADER_BYTES: usize = 72;
const CHUNK_HEAD_BYTES: usize = 28;
/// Maximum number of vertices, faces, levels and moved faces per byte of a payload; a writer appends zeros to shorter
/// payloads. Real meshes take several bits for each item. The limit bounds the memory for a hostile file to a few
/// hundred times the file's size.
const ITEMS_PER_BYTE: u64 = 4;
/// Maximum number of corners that splits replace per byte of a payload; shorter payloads are padded, too. A split may
/// replace a corner in all faces of a vertex of high valence, at a cost of only a hundredth of a bit for each face.
const CORNERS_PER_BYTE: u64 = 16;

/// A loaded file.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedFile {
    /// The mesh. For a truncated file, the part that is present; its last level is not the full mesh.
    pub mesh: ProgressiveMesh,
    pub contents: Contents,
}

/// The contents of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contents {
    /// The file's length.
    pub bytes: u64,
    /// Bytes outside `sizes`: the header, the chunks' heads and the ends of the coded streams.
    pub frame_bytes: f64,
    /// Coded bits of the chunks that were read, by content.
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
    /// Number of levels, including level 0.
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
                "the end is missing: {} of {} chunks, {} of {} levels, {} of {} faces are present",
                read.chunks, whole.chunks, read.levels, whole.levels, read.faces, whole.faces
            )
        })
    }

    /// Bytes per split of the file without positions, attributes and header: the cost of the levels of
    /// detail. A level counts as one split; on a seam it adds several vertices.
    pub fn bytes_per_split(&self, mesh: &ProgressiveMesh) -> f64 {
        let splits = mesh.last_level().max(1) as f64;
        let Sizes { levels, splits: which, faces, swaps, .. } = self.sizes;
        ((levels + which + faces + swaps) / 8.0 + self.frame_bytes - HEADER_BYTES as f64) / splits
    }
}
