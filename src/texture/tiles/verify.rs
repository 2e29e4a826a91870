//! Verifies a whole `.tiles` file: checks every record and lists all damage.

use super::reader::{RecordFault, TileFile};
use super::{FileLayout, TileFileError};
use crate::math::pyramid::TileId;
use rayon::prelude::*;
use std::fmt;
use std::path::Path;

/// One record of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TileRecord {
    Tile(TileId),
    ResidentLevel(u32),
}

/// A record that does not match the index.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BadRecord {
    pub record: TileRecord,
    /// Offset of the record in the file.
    pub offset: u64,
    pub reason: String,
}

impl fmt::Display for BadRecord {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.record {
            TileRecord::Tile(TileId { level, row, column }) => {
                write!(formatter, "tile level {level} row {row} column {column}")?;
            }
            TileRecord::ResidentLevel(level) => write!(formatter, "resident level {level}")?,
        }
        write!(formatter, " at byte {}: {}", self.offset, self.reason)
    }
}

/// Result of [`verify`].
#[derive(Clone, Debug)]
pub struct VerifyReport {
    pub layout: FileLayout,
    /// In the order of the file's index: tiles, then resident levels.
    pub bad: Vec<BadRecord>,
}

/// Reads the whole file and verifies every checksum. `progress` receives the bytes of each finished record,
/// from several threads.
///
/// # Errors
/// [`TileFileError`] if header, length or index is wrong, so that no record can be checked.
pub fn verify(path: &Path, progress: &(dyn Fn(u64) + Sync)) -> Result<VerifyReport, TileFileError> {
    let file = TileFile::open(path)?;
    let layout = *file.layout();
    let pyramid = layout.pyramid();
    let check = |record, offset, bytes: &mut [u8], entry| {
        // Reads the whole record: the padding is checked too.
        let result = file.read_record(offset, bytes.len(), entry, bytes);
        progress(bytes.len() as u64);
        let reason = match result {
            Ok(()) => return None,
            Err(RecordFault::Checksum) => "its checksum differs".to_string(),
            Err(RecordFault::Read(_, error)) => error.to_string(),
        };
        Some(BadRecord { record, offset, reason })
    };
    let mut bad: Vec<BadRecord> = (0..pyramid.tile_count())
        .into_par_iter()
        .map_init(
            || vec![0; layout.record_bytes()],
            |bytes, index| {
                check(TileRecord::Tile(layout.tile(index)), layout.record_offset(index), bytes, index)
            },
        )
        .flatten()
        .collect();
    for level in pyramid.first_resident_level()..=pyramid.coarsest_level() {
        let mut bytes = vec![0; layout.resident_record_bytes(level)];
        let (offset, entry) = (layout.resident_offset(level), layout.resident_entry(level));
        bad.extend(check(TileRecord::ResidentLevel(level), offset, &mut bytes, entry));
    }
    Ok(VerifyReport { layout, bad })
}
