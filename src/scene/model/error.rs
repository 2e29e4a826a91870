//! What can be wrong with a model's file, and where.

use std::path::PathBuf;
use thiserror::Error;

/// A model that cannot be had; each is one line.
#[derive(Debug, Error)]
pub enum ModelError {
    #[error("{path}: cannot be read: {source}")]
    Read { path: PathBuf, source: std::io::Error },
    #[error("{path}: no model by its name; known are .ply, .obj and .glb, each also with .gz")]
    Kind { path: PathBuf },
    /// Something inside the file; lines count from 1, bytes from 0.
    #[error("{path}{place}: {what}")]
    Content { path: PathBuf, place: Place, what: String },
    #[error("{path}: none of its {faces} faces can be used: {why}")]
    Empty { path: PathBuf, faces: usize, why: String },
    #[error(
        "{name}: no file, and no model of that name; shipped are {shipped}, a size may follow ({example})"
    )]
    Unknown { name: String, shipped: String, example: &'static str },
}

/// Where in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    Line(usize),
    Byte(usize),
    /// Not at one place.
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

/// A [`ModelError::Content`] that does not know its file yet.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Trouble {
    pub place: Place,
    pub what: String,
}

impl Trouble {
    pub(super) fn line(line: usize, what: impl Into<String>) -> Self {
        Self { place: Place::Line(line), what: what.into() }
    }
}
