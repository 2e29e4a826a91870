//! Encodes a progressive mesh as bytes.

use super::coder::Encoder;
use super::level::{Growing, Has, Left};
use super::{
    APPEARANCE, CHUNK_HEAD_BYTES, CORNERS_PER_BYTE, Contents, Extent, HEADER_BYTES, IN_PLACE, ITEMS_PER_BYTE,
    MAGIC, version,
};
use crate::model::Attributes;
use crate::paper::progressive_mesh::choices::ErrorMetric;
use crate::paper::progressive_mesh::mesh::{Births, Level, ProgressiveMesh};
use crate::picture::write::{FileError, write_bytes};
use std::ops::Range;
use std::path::Path;
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

/// A chunk ends when the number of faces has grown to 5/4 of the number at the chunk's start. So the incomplete last
/// chunk of a truncated file has about a fifth of the file's faces at most. In a mesh of a few thousand faces, the
/// heads of all chunks take 0.3 bytes per split.
const GROWTH: (u64, u64) = (5, 4);

impl ProgressiveMesh {
    /// Writes a `.pmesh` file atomically. Returns its contents.
    ///
    /// # Errors
    /// [`FileError`] names the path.
    ///
    /// # Panics
    /// As [`MeshEncoder`].
    pub fn write(&self, path: &Path) -> Result<Contents, FileError> {
        let (bytes, contents) = self.to_bytes();
        write_bytes(path, &bytes)?;
        Ok(contents)
    }

    /// The bytes of a `.pmesh` file, and its contents.
    ///
    /// # Panics
    /// As [`MeshEncoder`].
    pub fn to_bytes(&self) -> (Vec<u8>, Contents) {
        let mut encoder = MeshEncoder::new(self);
        encoder.encode(self, self.levels.len());
        encoder.finish(self)
    }
}

/// Encodes a mesh from the coarsest level to the finest. It can follow a builder that does not know the splits and
/// permutations of the finer levels yet.
///
/// Its methods panic if the mesh breaks a rule of its type. Such a mesh is detected because the encoder rebuilds the
/// mesh, and [`MeshEncoder::finish`] compares the result with the original.
pub struct MeshEncoder {
    growing: Growing,
    chunks: Vec<Range<usize>>,
    /// Number of finished chunks.
    finished: usize,
    /// The payload of the chunk in progress, and the items that its head may still declare.
    coder: Encoder,
    left: Left,
    bytes: Vec<u8>,
}

impl MeshEncoder {
    /// An encoder of `mesh`, whose splits and permutations may still be missing.
    pub fn new(mesh: &ProgressiveMesh) -> Self {
        let mut growing = Growing::new(Has::of(mesh));
        growing.mesh.vertices.centre = mesh.vertices.centre;
        (growing.mesh.births, growing.mesh.metric) = (mesh.births, mesh.metric);
        growing.room = u64::MAX;
        Self {
            growing,
            chunks: chunks(&mesh.levels),
            finished: 0,
            coder: Encoder::new(),
            left: MOST,
            bytes: vec![0; HEADER_BYTES],
        }
    }

    /// Encodes the first `levels` levels as far as they are not encoded yet. `mesh` needs their splits and
    /// permutations.
    pub fn encode(&mut self, mesh: &ProgressiveMesh, levels: usize) {
        for level in self.growing.mesh.levels.len()..levels {
            if let Err(fault) = self.growing.level(&mut self.coder, Some(mesh), &mut self.left) {
                panic!("level {level} of a progressive mesh breaks a rule of its type: {}", fault.0);
            }
            if level + 1 == self.chunks[self.finished].end {
                self.finish_chunk();
            }
        }
    }

    /// The bytes of the file, and its contents. All levels of `mesh` must be encoded.
    pub fn finish(self, mesh: &ProgressiveMesh) -> (Vec<u8>, Contents) {
        let MeshEncoder { growing: Growing { mesh: built, has, sizes, .. }, chunks, mut bytes, .. } = self;
        assert!(built == *mesh, "the progressive mesh to write breaks a rule of its type");
        let whole = Extent {
            chunks: u32::try_from(chunks.len()).expect("fewer than 2^32 chunks"),
            levels: mesh.last_level() + 1,
            vertices: mesh.vertices.positions.len() as u32,
            faces: mesh.faces.len() as u32,
        };
        let length = bytes.len() as u64;
        bytes[..HEADER_BYTES].copy_from_slice(&header(mesh, has, whole, length));
        let named: f64 = sizes.named().iter().map(|(_, bits)| bits / 8.0).sum();
        let frame_bytes = length as f64 - named;
        (bytes, Contents { bytes: length, frame_bytes, sizes, whole, read: whole })
    }

    /// Appends the chunk in progress to the file.
    fn finish_chunk(&mut self) {
        let levels = self.chunks[self.finished].len() as u32;
        let left = std::mem::replace(&mut self.left, MOST);
        let declared = Left {
            vertices: MOST.vertices - left.vertices,
            faces: MOST.faces - left.faces,
            moved: MOST.moved - left.moved,
        };
        let corners = u64::MAX - std::mem::replace(&mut self.growing.room, u64::MAX);
        let mut payload = std::mem::replace(&mut self.coder, Encoder::new()).finish();
        let min = declared.items(levels).div_ceil(ITEMS_PER_BYTE).max(corners.div_ceil(CORNERS_PER_BYTE));
        payload.resize(payload.len().max(min as usize), 0);
        let length = u32::try_from(payload.len()).expect("fewer than 2^32 bytes in a chunk");
        let at = self.bytes.len();
        let bytes = &mut self.bytes;
        let numbers = [length, levels, declared.vertices, declared.faces, declared.moved];
        numbers.iter().for_each(|number| bytes.extend(number.to_le_bytes()));
        bytes.extend([0; 8]);
        bytes.extend(payload);
        let checksum = chunk_checksum(self.finished as u32, &bytes[at..]);
        bytes[at + CHUNK_HEAD_BYTES - 8..at + CHUNK_HEAD_BYTES].copy_from_slice(&checksum.to_le_bytes());
        self.finished += 1;
    }
}

/// What the head of a chunk can declare.
const MOST: Left = Left { vertices: u32::MAX, faces: u32::MAX, moved: u32::MAX };

/// The levels of each chunk; the first chunk holds only level 0.
fn chunks(levels: &[Level]) -> Vec<Range<usize>> {
    let (mut chunks, mut start) = (Vec::from([Range { start: 0, end: 1 }]), 1);
    let is_grown = |from: usize, to: usize| {
        let [from, to] = [from, to].map(|level| u64::from(levels[level].faces));
        to * GROWTH.1 >= from * GROWTH.0
    };
    for level in 1..levels.len() {
        if level + 1 == levels.len() || is_grown(start - 1, level) {
            chunks.push(start..level + 1);
            start = level + 1;
        }
    }
    chunks
}

/// The checksum of a chunk: its number, its head (without the checksum) and its payload.
pub(super) fn chunk_checksum(number: u32, chunk: &[u8]) -> u64 {
    let head = xxh3_64_with_seed(&chunk[..CHUNK_HEAD_BYTES - 8], u64::from(number));
    xxh3_64_with_seed(&chunk[CHUNK_HEAD_BYTES..], head)
}

fn header(mesh: &ProgressiveMesh, has: Has, whole: Extent, length: u64) -> Vec<u8> {
    let mut header = MAGIC.to_vec();
    header.extend(version(mesh).to_le_bytes());
    header.extend((has.flags() | flags(mesh)).to_le_bytes());
    mesh.vertices.centre.to_array().iter().for_each(|number| header.extend(number.to_le_bytes()));
    [whole.vertices, whole.faces, whole.levels, whole.chunks]
        .iter()
        .for_each(|number| header.extend(number.to_le_bytes()));
    header.extend(length.to_le_bytes());
    header.extend(xxh3_64(&header).to_le_bytes());
    header
}

/// The header's flags, without the flags of [`Has`].
fn flags(mesh: &ProgressiveMesh) -> u32 {
    let Some(metric) = mesh.metric else { return 0 };
    let in_place = if mesh.births == Births::InPlace { IN_PLACE } else { 0 };
    in_place | if metric == ErrorMetric::Appearance { APPEARANCE } else { 0 }
}

impl Left {
    /// The number of items in a chunk that need memory when read.
    pub(super) fn items(self, levels: u32) -> u64 {
        [levels, self.vertices, self.faces, self.moved].iter().map(|&count| u64::from(count)).sum()
    }
}

impl Has {
    fn of(mesh: &ProgressiveMesh) -> Has {
        let Attributes { normals, coordinates, colors } = &mesh.vertices.attributes;
        Has { normals: !normals.is_empty(), coordinates: !coordinates.is_empty(), colors: !colors.is_empty() }
    }

    /// The header's attribute bits: 0 normals, 1 coordinates, 2 colours.
    pub(super) fn flags(self) -> u32 {
        u32::from(self.normals) | u32::from(self.coordinates) << 1 | u32::from(self.colors) << 2
    }

    pub(super) fn of_flags(flags: u32) -> Option<Has> {
        let has = |bit: u32| flags >> bit & 1 == 1;
        (flags < 8).then(|| Has { normals: has(0), coordinates: has(1), colors: has(2) })
    }
}
