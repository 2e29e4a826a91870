//! Reads tiles from a `.tiles` file. Data is used only after its checksum is verified. Memory is allocated only after
//! the file is known to be as long as its header says.

use super::layout::{FileLayout, HEADER_BYTES, is_sealed};
use super::{PAGE_BYTES, TileFileError};
use crate::file;
use crate::math::pyramid::{Pyramid, TileId};
use crate::texture::source::{TileError, TileFormat, TileSource};
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

/// An open `.tiles` file; its index is in memory (8 bytes per tile).
pub struct TileFile {
    pub(super) path: PathBuf,
    pub(super) file: File,
    layout: FileLayout,
    checksums: Vec<u64>,
}

impl TileFile {
    /// Opens a file and checks header, length and index. Records are checked when they are read.
    ///
    /// # Errors
    /// [`TileFileError`] names the faulty part.
    pub fn open(path: &Path) -> Result<Self, TileFileError> {
        let path = path.to_path_buf();
        let open_error = |source| TileFileError::Open { path: path.clone(), source };
        let file = file::open(&path).map_err(open_error)?;
        let found = file.metadata().map_err(open_error)?.len();
        let read = |bytes: &mut [u8], offset| {
            let read = file.read_exact_at(bytes, offset);
            read.map_err(|source| TileFileError::Read { path: path.clone(), offset, source })
        };
        if found < PAGE_BYTES {
            return Err(TileFileError::NotTiles { path });
        }
        let mut page = [0; HEADER_BYTES];
        read(&mut page, 0)?;
        let layout = FileLayout::parse(&page, &path)?;
        if found != layout.total_bytes() {
            return Err(TileFileError::Length { path, expected: layout.total_bytes(), found });
        }
        let mut index = vec![0; layout.index_bytes() as usize];
        read(&mut index, layout.index_offset())?;
        let entries = layout.entry_count() as usize * 8;
        let padding_is_zero = index[entries..index.len() - 8].iter().all(|&byte| byte == 0);
        if !is_sealed(&index) || !padding_is_zero {
            return Err(TileFileError::Index { path });
        }
        let checksums =
            index[..entries].as_chunks().0.iter().map(|bytes| u64::from_le_bytes(*bytes)).collect();
        Ok(Self { path, file, layout, checksums })
    }

    /// Sizes and offsets of everything in the file.
    pub fn layout(&self) -> &FileLayout {
        &self.layout
    }

    /// Reads the start of a record into `bytes`; the rest (padding) is only checked.
    pub(super) fn read_record(
        &self,
        offset: u64,
        record_bytes: usize,
        entry: u64,
        bytes: &mut [u8],
    ) -> Result<(), RecordFault> {
        let mut padding = [0; HEADER_BYTES];
        let padding = &mut padding[..record_bytes - bytes.len()];
        let read = |bytes: &mut [u8], offset| {
            self.file.read_exact_at(bytes, offset).map_err(|source| RecordFault::Read(offset, source))
        };
        read(bytes, offset)?;
        read(padding, offset + bytes.len() as u64)?;
        let checksum = if padding.is_empty() {
            xxh3_64(bytes)
        } else {
            let mut hasher = Xxh3::new();
            hasher.update(bytes);
            hasher.update(padding);
            hasher.digest()
        };
        if checksum == self.checksums[entry as usize] { Ok(()) } else { Err(RecordFault::Checksum) }
    }

    fn tile_error(&self, tile: TileId, offset: u64, fault: RecordFault) -> TileError {
        let path = self.path.display().to_string();
        match fault {
            RecordFault::Read(offset, source) => TileError::Read { path, tile, offset, source },
            RecordFault::Checksum => TileError::Checksum { path, tile, offset },
        }
    }
}

/// The fault of one record.
pub(super) enum RecordFault {
    Read(u64, std::io::Error),
    Checksum,
}

impl TileSource for TileFile {
    fn describe(&self) -> String {
        let pyramid = self.layout.pyramid();
        let format = match self.layout.format() {
            TileFormat::Rgba8 => "rgba8",
            TileFormat::Bc1 => "bc1",
        };
        format!("{}, 2^{} x 2^{}, {format}", self.path.display(), pyramid.width_log2(), pyramid.height_log2())
    }

    fn pyramid(&self) -> Pyramid {
        self.layout.pyramid()
    }

    fn format(&self) -> TileFormat {
        self.layout.format()
    }

    fn read_tile(&self, tile: TileId, bytes: &mut [u8]) -> Result<(), TileError> {
        assert_eq!(bytes.len(), self.layout.tile_bytes(), "{tile:?} of {:?}", self.layout);
        let index = self.layout.pyramid().tile_index(tile);
        let offset = self.layout.record_offset(index);
        self.read_record(offset, self.layout.record_bytes(), index, bytes)
            .map_err(|fault| self.tile_error(tile, offset, fault))
    }

    fn read_resident_level(&self, level: u32) -> Result<Vec<u8>, TileError> {
        let pyramid = self.layout.pyramid();
        let resident = pyramid.first_resident_level()..=pyramid.coarsest_level();
        assert!(resident.contains(&level), "level {level} of {pyramid:?}");
        let mut bytes = vec![0; self.layout.resident_bytes(level)];
        let offset = self.layout.resident_offset(level);
        let (record_bytes, entry) =
            (self.layout.resident_record_bytes(level), self.layout.resident_entry(level));
        self.read_record(offset, record_bytes, entry, &mut bytes)
            .map_err(|fault| self.tile_error(TileId { level, row: 0, column: 0 }, offset, fault))?;
        Ok(bytes)
    }
}
