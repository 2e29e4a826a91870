//! Writes a progressive mesh as bytes.

use super::coder::{Coder, Encoder};
use super::level::{Growing, Has, Left};
use super::{
    APPEARANCE, CHUNK_HEAD_BYTES, CORNERS_PER_BYTE, Contents, Extent, HEADER_BYTES, IN_PLACE, ITEMS_PER_BYTE,
    MAGIC, version,
};
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
    /// As [`Self::to_bytes`].
    pub fn write(&self, path: &Path) -> Result<Contents, FileError> {
        let (bytes, contents) = self.to_bytes();
        write_bytes(path, &bytes)?;
        Ok(contents)
    }

    /// The bytes of a `.pmesh` file, and its contents.
    ///
    /// # Panics
    /// If the mesh breaks a rule of its type. Such a mesh is detected because the encoder rebuilds the mesh, and the
    /// result is compared with the original.
    pub fn to_bytes(&self) -> (Vec<u8>, Contents) {
        let attributes = &self.vertices.attributes;
        let has = Has {
            normals: !attributes.normals.is_empty(),
            coordinates: !attributes.coordinates.is_empty(),
            colors: !attributes.colors.is_empty(),
        };
        let mut growing = Growing::new(Some(self), has);
        growing.mesh.vertices.centre = self.vertices.centre;
        (growing.mesh.births, growing.mesh.metric) = (self.births, self.metric);
        let chunks = chunks(&self.levels);
        let mut bytes = vec![0; HEADER_BYTES];
        for (number, levels) in chunks.iter().enumerate() {
            push_chunk(&mut growing, number, levels.clone(), &mut bytes);
        }
        assert!(growing.mesh == *self, "the progressive mesh to write breaks a rule of its type");
        let whole = Extent {
            chunks: u32::try_from(chunks.len()).expect("fewer than 2^32 chunks"),
            levels: self.last_level() + 1,
            vertices: self.vertices.positions.len() as u32,
            faces: self.faces.len() as u32,
        };
        let length = bytes.len() as u64;
        bytes[..HEADER_BYTES].copy_from_slice(&header(self, has, whole, length));
        let sizes = growing.sizes;
        let named: f64 = sizes.named().iter().map(|(_, bits)| bits / 8.0).sum();
        let frame_bytes = length as f64 - named;
        (bytes, Contents { bytes: length, frame_bytes, sizes, whole, read: whole })
    }
}

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

fn push_chunk(growing: &mut Growing, number: usize, levels: Range<usize>, bytes: &mut Vec<u8>) {
    let mesh = growing.source.expect("written from a mesh");
    let start = levels.start.checked_sub(1).map_or(Level::default(), |before| mesh.levels[before]);
    let end = mesh.levels[levels.end - 1];
    let moved =
        |at: usize| mesh.swaps.cycles_of(at).map(|cycle| mesh.swaps.cycles.row(cycle).len()).sum::<usize>();
    let carries = |&at: &usize| levels.contains(&(mesh.swaps.levels[at] as usize));
    let first = growing.mesh.swaps.levels.len();
    let moved = (first..mesh.swaps.levels.len()).take_while(carries).map(moved).sum::<usize>();
    let declared = Left {
        vertices: end.vertices - start.vertices,
        faces: end.faces - start.faces,
        moved: u32::try_from(moved).expect("fewer than 2^32 moved faces in a chunk"),
    };
    let (mut coder, mut left) = (Encoder::new(), declared);
    growing.room = u64::MAX;
    for level in levels.clone() {
        if let Err(fault) = growing.level(&mut coder, &mut left) {
            panic!("level {level} of a progressive mesh breaks a rule of its type: {}", fault.0);
        }
    }
    assert!(!coder.is_overrun() && left == Left::default(), "{left:?} of {declared:?}");
    let mut payload = coder.finish();
    let items = declared.items(levels.len() as u32);
    let corners = u64::MAX - growing.room;
    let min = items.div_ceil(ITEMS_PER_BYTE).max(corners.div_ceil(CORNERS_PER_BYTE));
    payload.resize(payload.len().max(min as usize), 0);
    let length = u32::try_from(payload.len()).expect("fewer than 2^32 bytes in a chunk");
    let at = bytes.len();
    let numbers = [length, levels.len() as u32, declared.vertices, declared.faces, declared.moved];
    numbers.iter().for_each(|number| bytes.extend(number.to_le_bytes()));
    bytes.extend([0; 8]);
    bytes.extend(payload);
    let checksum = chunk_checksum(number as u32, &bytes[at..]);
    bytes[at + CHUNK_HEAD_BYTES - 8..at + CHUNK_HEAD_BYTES].copy_from_slice(&checksum.to_le_bytes());
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
    /// The header's attribute bits: 0 normals, 1 coordinates, 2 colours.
    pub(super) fn flags(self) -> u32 {
        u32::from(self.normals) | u32::from(self.coordinates) << 1 | u32::from(self.colors) << 2
    }

    pub(super) fn of_flags(flags: u32) -> Option<Has> {
        let has = |bit: u32| flags >> bit & 1 == 1;
        (flags < 8).then(|| Has { normals: has(0), coordinates: has(1), colors: has(2) })
    }
}
