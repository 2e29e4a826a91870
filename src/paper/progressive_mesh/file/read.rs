//! Reads a progressive mesh from bytes.

use super::coder::Decoder;
use super::level::{Growing, Has, Left};
use super::write::chunk_checksum;
use super::{
    APPEARANCE, CHUNK_HEAD_BYTES, CORNERS_PER_BYTE, Contents, Extent, HEADER_BYTES, IN_PLACE, ITEMS_PER_BYTE,
    LoadedFile, MAGIC,
};
use crate::file;
use crate::paper::progressive_mesh::choices::ErrorMetric;
use crate::paper::progressive_mesh::mesh::{Births, ProgressiveMesh};
use glam::DVec3;
use std::io::Read;
use std::path::Path;
use thiserror::Error;
use xxhash_rust::xxh3::xxh3_64;

/// A `.pmesh` file that could not be read.
#[derive(Debug, Error)]
pub enum PmeshError {
    #[error("cannot read {path}: {source}")]
    Read { path: String, source: std::io::Error },
    #[error("{path}: {flaw}")]
    Flaw { path: String, flaw: FileFlaw },
}

/// What is wrong with the bytes.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FileFlaw {
    #[error("not a .pmesh file; build one with `ortelius mesh build`")]
    NotPmesh,
    #[error(".pmesh version {0}; this program reads versions 1 to 3: build the file again")]
    Version(u32),
    #[error("damaged in the header: {0}; build the file again, or fetch it again")]
    Header(&'static str),
    #[error(
        "cut off before its coarsest level is complete: {bytes} bytes of at least {needs}; fetch the file again"
    )]
    NoBase { bytes: u64, needs: u64 },
    #[error("damaged in chunk {chunk} at byte {offset}: {what}; build the file again, or fetch it again")]
    Chunk { chunk: u32, offset: u64, what: &'static str },
    #[error("damaged: {0} bytes after its end")]
    Longer(u64),
}

impl ProgressiveMesh {
    /// Reads a `.pmesh` file. If its end is missing, the mesh has the levels of the complete chunks: see
    /// [`Contents::is_cut`].
    ///
    /// # Errors
    /// [`PmeshError`] names the file, the fault and its position.
    pub fn read(path: &Path) -> Result<LoadedFile, PmeshError> {
        let shown = path.display().to_string();
        let read = || {
            let mut bytes = Vec::new();
            file::open(path)?.read_to_end(&mut bytes)?;
            Ok(bytes)
        };
        let bytes = read().map_err(|source| PmeshError::Read { path: shown.clone(), source })?;
        Self::from_bytes(&bytes).map_err(|flaw| PmeshError::Flaw { path: shown, flaw })
    }

    /// The mesh in the bytes of a `.pmesh` file, or in a prefix that includes the first chunk.
    ///
    /// # Errors
    /// [`FileFlaw`]: the fault and its position.
    pub fn from_bytes(bytes: &[u8]) -> Result<LoadedFile, FileFlaw> {
        let header = Header::parse(bytes)?;
        if let Some(longer) = (bytes.len() as u64).checked_sub(header.length).filter(|&longer| longer > 0) {
            return Err(FileFlaw::Longer(longer));
        }
        let mut growing = Growing::new(header.has);
        growing.mesh.vertices.centre = header.centre;
        (growing.mesh.births, growing.mesh.metric) = (header.births, header.metric);
        let (mut rest, mut chunks) = (&bytes[HEADER_BYTES..], 0);
        while chunks < header.whole.chunks {
            let offset = (bytes.len() - rest.len()) as u64;
            let flaw = |what| FileFlaw::Chunk { chunk: chunks, offset, what };
            let Some((chunk, after)) = split_chunk(rest) else { break };
            if chunk_checksum(chunks, chunk) != checksum_of(&chunk[..CHUNK_HEAD_BYTES]) {
                return Err(flaw("its checksum differs"));
            }
            read_chunk(&mut growing, chunk, header.whole).map_err(flaw)?;
            (rest, chunks) = (after, chunks + 1);
        }
        let is_cut = (bytes.len() as u64) < header.length;
        if chunks < header.whole.chunks && !is_cut {
            let offset = (bytes.len() - rest.len()) as u64;
            return Err(FileFlaw::Chunk { chunk: chunks, offset, what: "it ends beyond the file" });
        }
        if chunks == 0 {
            return Err(no_base(bytes));
        }
        let complete = bytes.len() - rest.len();
        loaded(bytes, growing, &header, (Extent { chunks, ..Extent::default() }, complete))
    }
}

/// The mesh of the chunks that were `read`, which end at byte `complete`.
fn loaded(
    bytes: &[u8],
    growing: Growing,
    header: &Header,
    (read, complete): (Extent, usize),
) -> Result<LoadedFile, FileFlaw> {
    let (mesh, sizes, whole) = (growing.mesh, growing.sizes, header.whole);
    let read = Extent {
        levels: mesh.levels.len() as u32,
        vertices: mesh.vertices.positions.len() as u32,
        faces: mesh.faces.len() as u32,
        ..read
    };
    let is_cut = (bytes.len() as u64) < header.length;
    // If all chunks were read, they must match the header and fill the file. If only a part of the chunks was read, the
    // part must not match the header, and the file must be truncated.
    if (read.chunks == whole.chunks) != (read == whole) || (read == whole) == is_cut {
        return Err(FileFlaw::Header("its levels, vertices, faces or bytes differ from those of the chunks"));
    }
    if !is_cut && mesh.levels.last().is_none_or(|last| last.error != 0.0) {
        return Err(FileFlaw::Header("the error of its last level is not 0"));
    }
    let named: f64 = sizes.named().iter().map(|(_, bits)| bits / 8.0).sum();
    let frame_bytes = complete as f64 - named;
    Ok(LoadedFile { mesh, contents: Contents { bytes: bytes.len() as u64, frame_bytes, sizes, whole, read } })
}

/// The flaw of a file that ends before the coarsest level is complete. That level needs the header and the first
/// chunk, whose head states the chunk's length.
fn no_base(bytes: &[u8]) -> FileFlaw {
    let head = bytes.get(HEADER_BYTES..HEADER_BYTES + CHUNK_HEAD_BYTES);
    let payload = head.map_or(0, |head| u64::from(u32_at(head, 0)));
    let needs = (HEADER_BYTES + CHUNK_HEAD_BYTES) as u64 + payload;
    FileFlaw::NoBase { bytes: bytes.len() as u64, needs }
}

/// The first chunk of `bytes` and the rest; `None` if the chunk is incomplete.
fn split_chunk(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let payload = u32_at(bytes.get(..CHUNK_HEAD_BYTES)?, 0) as usize;
    bytes.split_at_checked(CHUNK_HEAD_BYTES + payload)
}

fn read_chunk(growing: &mut Growing, chunk: &[u8], whole: Extent) -> Result<(), &'static str> {
    let [payload_bytes, levels, vertices, faces, moved] = std::array::from_fn(|n| u32_at(chunk, 4 * n));
    let mut left = Left { vertices, faces, moved };
    if left.items(levels) > ITEMS_PER_BYTE * u64::from(payload_bytes) {
        return Err("its head declares more items than its bytes can hold");
    }
    if levels == 0 || u64::from(levels) + growing.mesh.levels.len() as u64 > u64::from(whole.levels) {
        return Err("it has no level, or more levels than the header declares");
    }
    growing.room = CORNERS_PER_BYTE * u64::from(payload_bytes);
    let mut coder = Decoder::new(&chunk[CHUNK_HEAD_BYTES..]);
    for _ in 0..levels {
        growing.level(&mut coder, None, &mut left).map_err(|fault| fault.0)?;
    }
    if left != Left::default() {
        return Err("its head declares more items than it holds");
    }
    match coder.rest().iter().all(|&byte| byte == 0) {
        true => Ok(()),
        false => Err("its payload has bytes after its content"),
    }
}

struct Header {
    births: Births,
    metric: Option<ErrorMetric>,
    has: Has,
    centre: DVec3,
    whole: Extent,
    length: u64,
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<Header, FileFlaw> {
        if bytes.is_empty() || !bytes.starts_with(&MAGIC[..bytes.len().min(MAGIC.len())]) {
            return Err(FileFlaw::NotPmesh);
        }
        let header = bytes.get(..HEADER_BYTES).ok_or_else(|| no_base(bytes))?;
        let version = u32_at(header, 8);
        if !(1..=3).contains(&version) {
            return Err(FileFlaw::Version(version));
        }
        if xxh3_64(&header[..HEADER_BYTES - 8]) != checksum_of(header) {
            return Err(FileFlaw::Header("its checksum differs"));
        }
        let (births, metric, attributes) = kinds(version, u32_at(header, 12));
        let has =
            Has::of_flags(attributes).ok_or(FileFlaw::Header("attributes or flags of an unknown kind"))?;
        let centre = DVec3::from_array(std::array::from_fn(|n| f64::from_bits(u64_at(header, 16 + 8 * n))));
        if !centre.is_finite() {
            return Err(FileFlaw::Header("its centre is not finite"));
        }
        let [vertices, faces, levels, chunks] = std::array::from_fn(|n| u32_at(header, 40 + 4 * n));
        let whole = Extent { chunks, levels, vertices, faces };
        Ok(Header { births, metric, has, centre, whole, length: u64_at(header, 56) })
    }
}

/// Decodes a version and its flags: where faces are born, what the errors count, and the remaining flags.
fn kinds(version: u32, flags: u32) -> (Births, Option<ErrorMetric>, u32) {
    let births = |in_place| if in_place { Births::InPlace } else { Births::Tail };
    if version < 3 {
        return (births(version == 2), None, flags);
    }
    let metric = if flags & APPEARANCE == 0 { ErrorMetric::Geometry } else { ErrorMetric::Appearance };
    (births(flags & IN_PLACE != 0), Some(metric), flags & !(IN_PLACE | APPEARANCE))
}

/// The checksum in the last 8 bytes.
fn checksum_of(bytes: &[u8]) -> u64 {
    u64_at(bytes, bytes.len() - 8)
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"))
}
