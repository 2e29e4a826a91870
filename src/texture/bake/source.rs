//! The source of a bake: a picture, or the name of a synthetic source.

use super::error::{BakeError, SourceError};
use super::input::{self, RowReader};
use crate::file;
use crate::math::pyramid::Pyramid;
use crate::texture::source::TileSource;
use crate::texture::source::earth::Earth;
use crate::texture::source::ruler::Ruler;
use std::os::unix::fs::{FileExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use xxhash_rust::xxh3::Xxh3;

/// Pictures up to this size are identified by a hash of all bytes. Larger ones are identified by length,
/// modification time and both ends: hashing 100 GB before each resume would take longer than resuming usually
/// saves.
const WHOLE_IDENTITY_BYTES: u64 = 256 << 20;
const END_BYTES: u64 = 1 << 20;

/// A source as the command line names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SourceName {
    /// `earth:M`: 2^M x 2^(M-1).
    Earth(u32),
    /// `ruler:M`: 2^M x 2^(M-1).
    Ruler(u32),
    /// Any other name is a path (`./earth:14` for a file of that name).
    Picture(PathBuf),
}

impl FromStr for SourceName {
    type Err = SourceError;

    fn from_str(name: &str) -> Result<Self, SourceError> {
        let size = |size: &str| {
            let digits = size.strip_prefix("2^").unwrap_or(size);
            let log2 = digits.parse().ok().filter(|log2| (5..=20).contains(log2));
            log2.ok_or_else(|| SourceError::Synthetic(name.to_string()))
        };
        if let Some(rest) = name.strip_prefix("earth:") {
            return Ok(Self::Earth(size(rest)?));
        }
        if let Some(rest) = name.strip_prefix("ruler:") {
            return Ok(Self::Ruler(size(rest)?));
        }
        Ok(Self::Picture(PathBuf::from(name)))
    }
}

impl std::fmt::Display for SourceName {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Earth(log2) => write!(formatter, "earth:{log2}"),
            Self::Ruler(log2) => write!(formatter, "ruler:{log2}"),
            Self::Picture(path) => write!(formatter, "{}", path.display()),
        }
    }
}

/// An opened source.
pub(super) enum Source {
    Synthetic(SourceName),
    Picture { rows: Box<dyn RowReader>, path: PathBuf, identity: Identity },
}

/// Identifies a source picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Identity {
    length: u64,
    changed_ns: i128,
    /// xxh3 of the whole content, or of both ends.
    content: u128,
}

impl Source {
    pub fn open(name: &SourceName) -> Result<Self, BakeError> {
        match name {
            SourceName::Earth(_) | SourceName::Ruler(_) => Ok(Self::Synthetic(name.clone())),
            SourceName::Picture(path) => {
                let rows = input::open(path)?;
                Ok(Self::Picture { rows, path: path.clone(), identity: Identity::of(path)? })
            }
        }
    }

    /// Width and height in texels.
    pub fn size(&self) -> [u32; 2] {
        match self {
            Self::Synthetic(SourceName::Earth(log2) | SourceName::Ruler(log2)) => {
                [1 << log2, 1 << (log2 - 1)]
            }
            Self::Synthetic(SourceName::Picture(path)) => unreachable!("{} is not synthetic", path.display()),
            Self::Picture { rows, .. } => rows.size(),
        }
    }

    /// The text that identifies this source in a journal.
    pub fn identity_text(&self) -> String {
        match self {
            Self::Synthetic(name) => name.to_string(),
            Self::Picture { identity, .. } => {
                let Identity { length, content, changed_ns } = identity;
                let changed = if *length <= WHOLE_IDENTITY_BYTES { 0 } else { *changed_ns };
                format!("picture {length} {content:032x} {changed}")
            }
        }
    }
}

/// Creates the tile source of a synthetic name.
pub(super) fn synthetic(name: &SourceName, pyramid: Pyramid) -> Result<Box<dyn TileSource>, BakeError> {
    match name {
        SourceName::Earth(_) => Ok(Box::new(Earth::new(pyramid)?)),
        SourceName::Ruler(_) => Ok(Box::new(Ruler::new(pyramid))),
        SourceName::Picture(path) => unreachable!("{} is not a synthetic source", path.display()),
    }
}

impl Identity {
    pub fn of(path: &Path) -> Result<Self, SourceError> {
        let read = || -> std::io::Result<Self> {
            let file = file::open(path)?;
            let metadata = file.metadata()?;
            let length = metadata.len();
            let mut hasher = Xxh3::new();
            let mut piece = vec![0; END_BYTES as usize];
            let starts: Vec<u64> = if length <= WHOLE_IDENTITY_BYTES {
                (0..length).step_by(END_BYTES as usize).collect()
            } else {
                vec![0, length - END_BYTES]
            };
            for start in starts {
                let piece = &mut piece[..END_BYTES.min(length - start) as usize];
                file.read_exact_at(piece, start)?;
                hasher.update(piece);
            }
            let changed_ns = i128::from(metadata.mtime()) * 1_000_000_000 + i128::from(metadata.mtime_nsec());
            Ok(Self { length, changed_ns, content: hasher.digest128() })
        };
        read().map_err(|source| SourceError::Open { path: path.to_path_buf(), source })
    }

    /// True if the file's length and modification time are unchanged.
    pub fn still_holds(&self, path: &Path) -> bool {
        std::fs::metadata(path).is_ok_and(|metadata| {
            let changed_ns = i128::from(metadata.mtime()) * 1_000_000_000 + i128::from(metadata.mtime_nsec());
            metadata.len() == self.length && changed_ns == self.changed_ns
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_synthetic_source_has_a_size_and_any_other_name_is_a_path() {
        assert_eq!("earth:14".parse::<SourceName>().unwrap(), SourceName::Earth(14));
        assert_eq!("ruler:2^9".parse::<SourceName>().unwrap(), SourceName::Ruler(9));
        assert_eq!("./earth:14".parse::<SourceName>().unwrap(), SourceName::Picture("./earth:14".into()));
        for wrong in ["earth:", "earth:21", "earth:4", "ruler:x", "earth:-9"] {
            assert!(matches!(wrong.parse::<SourceName>(), Err(SourceError::Synthetic(_))), "{wrong}");
        }
    }
}
