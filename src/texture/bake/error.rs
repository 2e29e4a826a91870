//! Errors of a bake. Each is one line that names the file.

use crate::texture::source::TileError;
use crate::texture::source::earth::EarthError;
use crate::texture::tiles::TileFileError;
use std::io;
use std::path::PathBuf;
use thiserror::Error;

/// A source picture that cannot be baked.
#[derive(Debug, Error)]
pub enum SourceError {
    #[error("{path}: cannot be opened: {source}")]
    Open { path: PathBuf, source: io::Error },
    #[error("{path}: cannot be read: {source}; run the same command again: a bake resumes")]
    Read { path: PathBuf, source: io::Error },
    #[error("{path}: neither PNG, JPEG nor TIFF")]
    Kind { path: PathBuf },
    #[error("{path}: {reason}")]
    Unsupported { path: PathBuf, reason: String },
    #[error("{path}: damaged or truncated: {reason}")]
    Damaged { path: PathBuf, reason: String },
    #[error("{path}: changed while it was read; run the command again")]
    Changed { path: PathBuf },
    #[error(
        "{0}: the synthetic sources are earth:M and ruler:M, of 2^M x 2^(M-1) texels, with M in 5 ..= 20"
    )]
    Synthetic(String),
}

impl SourceError {
    /// True if a later run cannot resume this bake, because the source is unusable or has changed. False for possibly
    /// temporary faults, such as a read error.
    pub(super) fn is_permanent(&self) -> bool {
        !matches!(self, Self::Open { .. } | Self::Read { .. })
    }
}

/// A bake that did not finish.
#[derive(Debug, Error)]
pub enum BakeError {
    #[error(transparent)]
    Source(#[from] SourceError),
    /// Settings that no file can have, or that do not fit this source.
    #[error("{0}")]
    Settings(String),
    #[error(transparent)]
    Earth(#[from] EarthError),
    #[error("{path}: exists already; --force replaces it")]
    Exists { path: PathBuf },
    #[error("{path}: {reason}")]
    Output { path: PathBuf, reason: String },
    #[error(
        "{path}: unfinished bake of another source, other settings or another version; run the command that began it \
         to finish it, or add --force to start over"
    )]
    OtherBake { path: PathBuf },
    #[error("{path}: another bake is writing it")]
    Busy { path: PathBuf },
    #[error(
        "{path}: disk full at byte {offset} of {needed}: {source}; \
         free some space and run the same command again; the bake resumes"
    )]
    Full { path: PathBuf, offset: u64, needed: u64, source: io::Error },
    #[error("{path}: cannot be written at byte {offset}: {source}")]
    Write { path: PathBuf, offset: u64, source: io::Error },
    #[error("{path}: cannot be read back at byte {offset}: {source}")]
    ReadBack { path: PathBuf, offset: u64, source: io::Error },
    #[error(transparent)]
    Tile(#[from] TileError),
    #[error("the finished file does not open: {0}")]
    Unreadable(#[from] TileFileError),
}

impl BakeError {
    /// A failed write. Distinguishes a full disk, a quota or a file size limit from other faults.
    pub(super) fn write(path: PathBuf, offset: u64, needed: u64, source: io::Error) -> Self {
        use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        match source.kind() {
            StorageFull | QuotaExceeded | FileTooLarge => Self::Full { path, offset, needed, source },
            _ => Self::Write { path, offset, source },
        }
    }
}
