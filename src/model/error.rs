//! Errors in a model's file, with their position.

use std::path::PathBuf;
use thiserror::Error;

/// A model that cannot be opened. Each message is one line.
#[derive(Debug, Error)]
pub enum ModelError {
    #[error("{path}: cannot be read: {source}")]
    Read { path: PathBuf, source: std::io::Error },
    #[error(
        "{path}: the file name extension is not that of a model; known: .ply, .obj and .glb, each optionally followed \
         by .gz"
    )]
    Kind { path: PathBuf },
    #[error("{path}: {what} than the limit of {max} bytes")]
    Large { path: PathBuf, what: &'static str, max: u64 },
    /// A fault inside the file. Lines count from 1, bytes from 0.
    #[error("{path}{place}: {what}")]
    Content { path: PathBuf, place: FilePosition, what: String },
    #[error("{name} has not been fetched; run `ortelius fetch {name}`")]
    NotFetched { name: String },
    /// A generated model with an unsupported size.
    #[error("{0}")]
    Size(String),
    #[error("{name:?} is neither a file nor the name of a model; available: {names}")]
    Unknown { name: String, names: String },
}

/// Position in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilePosition {
    Line(usize),
    Byte(usize),
    /// The fault has no single position.
    Whole,
}

impl std::fmt::Display for FilePosition {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Line(line) => write!(f, ":{line}"),
            Self::Byte(byte) => write!(f, ": byte {byte}"),
            Self::Whole => Ok(()),
        }
    }
}

/// A [`ModelError::Content`] without the file's path, which readers do not know.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct ModelFault {
    pub place: FilePosition,
    pub what: String,
}

impl ModelFault {
    pub(super) fn line(line: usize, what: impl Into<String>) -> Self {
        Self { place: FilePosition::Line(line), what: what.into() }
    }

    pub(super) fn byte(byte: usize, what: impl Into<String>) -> Self {
        Self { place: FilePosition::Byte(byte), what: what.into() }
    }

    pub(super) fn whole(what: impl Into<String>) -> Self {
        Self { place: FilePosition::Whole, what: what.into() }
    }
}
