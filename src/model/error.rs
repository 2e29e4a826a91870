//! Errors in a model's file, with their place.

use std::path::PathBuf;
use thiserror::Error;

/// A model that cannot be opened. Each message is one line.
#[derive(Debug, Error)]
pub enum ModelError {
    #[error("{path}: cannot be read: {source}")]
    Read { path: PathBuf, source: std::io::Error },
    #[error("{path}: no model by its ending; known are .ply, .obj and .glb, each also packed as .gz")]
    Kind { path: PathBuf },
    #[error("{path}: {what} than the {most} bytes that are read")]
    Large { path: PathBuf, what: &'static str, most: u64 },
    /// Something inside the file; lines count from 1, bytes from 0.
    #[error("{path}{place}: {what}")]
    Content { path: PathBuf, place: Place, what: String },
    #[error("{name} is not here: run `ortelius fetch {name}`")]
    NotFetched { name: String },
    /// A model that is generated, in a size that it cannot have.
    #[error("{0}")]
    Size(String),
    #[error("{name:?} is no file, and no model is called so; there are {names}")]
    Unknown { name: String, names: String },
}

/// Where in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    Line(usize),
    Byte(usize),
    /// The fault has no single place.
    Whole,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Line(line) => write!(f, ":{line}"),
            Self::Byte(byte) => write!(f, ": byte {byte}"),
            Self::Whole => Ok(()),
        }
    }
}

/// A [`ModelError::Content`] without its file: readers see bytes only.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Fault {
    pub place: Place,
    pub what: String,
}

impl Fault {
    pub(super) fn line(line: usize, what: impl Into<String>) -> Self {
        Self { place: Place::Line(line), what: what.into() }
    }

    pub(super) fn byte(byte: usize, what: impl Into<String>) -> Self {
        Self { place: Place::Byte(byte), what: what.into() }
    }

    pub(super) fn whole(what: impl Into<String>) -> Self {
        Self { place: Place::Whole, what: what.into() }
    }
}
