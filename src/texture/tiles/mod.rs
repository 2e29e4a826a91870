//! `.tiles`: all tiles and resident levels of a pyramid in one file. Every byte is checksummed.
//!
//! Byte layout: docs/formats.md. Records have fixed sizes and computed offsets, so a tile is one read. Files are read
//! with `pread`, never mapped: a truncated mapping kills the process with SIGBUS, but a read returns an error.

mod layout;
mod reader;
mod verify;

pub use layout::{FileLayout, HEADER_BYTES, LayoutError, PAGE_BYTES, index_page};
pub use reader::TileFile;
pub use verify::{BadRecord, TileRecord, VerifyReport, verify};

use std::io;
use std::path::PathBuf;
use thiserror::Error;

/// A file that cannot be used as `.tiles`. A single bad record is a [`crate::texture::source::TileError`]
/// instead.
#[derive(Debug, Error)]
pub enum TileFileError {
    #[error("{path}: cannot be opened: {source}")]
    Open { path: PathBuf, source: io::Error },
    #[error("{path}: cannot be read at byte {offset}: {source}")]
    Read { path: PathBuf, offset: u64, source: io::Error },
    #[error("{path}: not a .tiles file, or its first bytes are damaged")]
    NotTiles { path: PathBuf },
    #[error("{path}: .tiles version {found}; this program reads version {expected}: bake the file again")]
    Version { path: PathBuf, found: u32, expected: u32 },
    #[error("{path}: the header is damaged ({reason}); bake the file again")]
    Header { path: PathBuf, reason: String },
    #[error("{path}: {found} bytes long instead of {expected}, so truncated or damaged; bake the file again")]
    Length { path: PathBuf, expected: u64, found: u64 },
    #[error("{path}: the index of checksums is damaged; bake the file again")]
    Index { path: PathBuf },
}

impl TileFileError {
    /// True if the file can be opened and read, but its bytes are wrong.
    pub fn is_damage(&self) -> bool {
        match self {
            TileFileError::NotTiles { .. }
            | TileFileError::Header { .. }
            | TileFileError::Length { .. }
            | TileFileError::Index { .. } => true,
            TileFileError::Open { .. } | TileFileError::Read { .. } | TileFileError::Version { .. } => false,
        }
    }
}
