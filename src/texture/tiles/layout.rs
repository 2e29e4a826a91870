//! The position of every byte of a `.tiles` file: a pure function of the pyramid and the texel format.

use super::TileFileError;
use crate::math::pyramid::{Pyramid, PyramidError, TileId};
use crate::texture::source::TileFormat;
use std::path::Path;
use thiserror::Error;
use xxhash_rust::xxh3::xxh3_64;

/// Records start at multiples of this.
pub const PAGE_BYTES: u64 = 4096;
/// The header is one page.
pub const HEADER_BYTES: usize = PAGE_BYTES as usize;

/// Detects a file that was transferred as text: the first byte is not ASCII, a text transfer changes CR LF or LF, and
/// Ctrl-Z ends a text listing.
const MAGIC: [u8; 8] = *b"\x89ORT\r\n\x1a\n";
const VERSION: u32 = 1;
/// Checksums are the last 8 bytes of header and index.
const CHECKSUM_BYTES: usize = 8;
/// Keeps the index, which a reader holds in memory, at 512 MiB or less.
const MAX_TILES: u64 = 1 << 26;

/// Parameters that a `.tiles` file cannot store.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum LayoutError {
    #[error(
        "bc1 uses blocks of 4 x 4 texels on both levels of a tile, so the border must be a multiple of 4, not {0}"
    )]
    Bc1Border(u32),
    #[error("{0} tiles are more than a .tiles file can index ({MAX_TILES}); choose larger tiles")]
    TooManyTiles(u64),
}

/// Offsets and lengths, all in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileLayout {
    pyramid: Pyramid,
    format: TileFormat,
}

fn to_pages(bytes: u64) -> u64 {
    bytes.next_multiple_of(PAGE_BYTES)
}

impl FileLayout {
    /// The layout of a pyramid's file.
    ///
    /// # Errors
    /// [`LayoutError`]: a border that BC1 cannot store, or too many tiles.
    pub fn new(pyramid: Pyramid, format: TileFormat) -> Result<Self, LayoutError> {
        if format == TileFormat::Bc1 && !pyramid.border_texels().is_multiple_of(4) {
            return Err(LayoutError::Bc1Border(pyramid.border_texels()));
        }
        if pyramid.tile_count() > MAX_TILES {
            return Err(LayoutError::TooManyTiles(pyramid.tile_count()));
        }
        Ok(Self { pyramid, format })
    }

    pub fn pyramid(&self) -> Pyramid {
        self.pyramid
    }

    pub fn format(&self) -> TileFormat {
        self.format
    }

    /// Entries of the index: one for each tile, then one for each resident level.
    pub fn entry_count(&self) -> u64 {
        self.pyramid.tile_count() + u64::from(self.pyramid.resident_levels())
    }

    /// Bytes of both pictures of a tile, without padding.
    pub fn tile_bytes(&self) -> usize {
        self.format.tile_bytes(&self.pyramid)
    }

    /// Bytes of a tile's record: [`Self::tile_bytes`] padded with zeros to whole pages.
    pub fn record_bytes(&self) -> usize {
        to_pages(self.tile_bytes() as u64) as usize
    }

    pub fn index_offset(&self) -> u64 {
        PAGE_BYTES
    }

    /// Bytes of the index: entries, zeros up to a whole page, and the checksum in the last 8 bytes.
    pub fn index_bytes(&self) -> u64 {
        to_pages(self.entry_count() * 8 + CHECKSUM_BYTES as u64)
    }

    /// Bytes of a resident level in RGBA8, without padding.
    pub fn resident_bytes(&self, level: u32) -> usize {
        let [width, height] = self.pyramid.level_size(level).map(|side| side as usize);
        width * height * 4
    }

    pub fn resident_record_bytes(&self, level: u32) -> usize {
        to_pages(self.resident_bytes(level) as u64) as usize
    }

    /// Offset of a resident level's record. For the level after the coarsest: the offset of the tiles.
    pub fn resident_offset(&self, level: u32) -> u64 {
        let finer: u64 = (self.pyramid.first_resident_level()..level)
            .map(|finer| self.resident_record_bytes(finer) as u64)
            .sum();
        self.index_offset() + self.index_bytes() + finer
    }

    fn tiles_offset(&self) -> u64 {
        self.resident_offset(self.pyramid.coarsest_level() + 1)
    }

    /// Offset of the record of the tile with this index ([`Pyramid::tile_index`]).
    pub fn record_offset(&self, tile_index: u64) -> u64 {
        self.tiles_offset() + tile_index * self.record_bytes() as u64
    }

    /// The length of the file.
    pub fn total_bytes(&self) -> u64 {
        self.record_offset(self.pyramid.tile_count())
    }

    /// A resident level's position in the index.
    pub fn resident_entry(&self, level: u32) -> u64 {
        self.pyramid.tile_count() + u64::from(level - self.pyramid.first_resident_level())
    }

    /// The tile with this index: the inverse of [`Pyramid::tile_index`].
    pub fn tile(&self, tile_index: u64) -> TileId {
        let mut rest = tile_index;
        for level in 0..self.pyramid.first_resident_level() {
            let [columns, rows] = self.pyramid.tile_grid(level).map(u64::from);
            if rest < columns * rows {
                // Both are below 2^16.
                return TileId { level, row: (rest / columns) as u32, column: (rest % columns) as u32 };
            }
            rest -= columns * rows;
        }
        panic!("tile {tile_index} of {}", self.pyramid.tile_count());
    }

    /// The header page, checksum included.
    pub fn header_page(&self) -> [u8; HEADER_BYTES] {
        let pyramid = &self.pyramid;
        let format = match self.format {
            TileFormat::Rgba8 => 0,
            TileFormat::Bc1 => 1,
        };
        let mut page = [0; HEADER_BYTES];
        page[..8].copy_from_slice(&MAGIC);
        let numbers = [
            VERSION,
            pyramid.width_log2(),
            pyramid.height_log2(),
            pyramid.tile_log2(),
            pyramid.border_texels(),
            pyramid.resident_levels(),
            format,
            0,
        ];
        for (bytes, number) in page[8..].chunks_exact_mut(4).zip(numbers) {
            bytes.copy_from_slice(&number.to_le_bytes());
        }
        let lengths = [
            pyramid.tile_count(),
            self.tile_bytes() as u64,
            self.record_bytes() as u64,
            self.index_offset(),
            self.index_bytes(),
            self.resident_offset(pyramid.first_resident_level()),
            self.tiles_offset(),
            self.total_bytes(),
        ];
        for (bytes, length) in page[40..].chunks_exact_mut(8).zip(lengths) {
            bytes.copy_from_slice(&length.to_le_bytes());
        }
        seal(&mut page);
        page
    }

    /// Parses a header page, which must be exactly what [`Self::header_page`] writes.
    pub(super) fn parse(page: &[u8; HEADER_BYTES], path: &Path) -> Result<Self, TileFileError> {
        let path = path.to_path_buf();
        let number = |index: usize| {
            let at = 8 + 4 * index;
            u32::from_le_bytes([page[at], page[at + 1], page[at + 2], page[at + 3]])
        };
        if page[..8] != MAGIC {
            return Err(TileFileError::NotTiles { path });
        }
        if !is_sealed(page) {
            return Err(TileFileError::Header { path, reason: "its checksum differs".into() });
        }
        if number(0) != VERSION {
            return Err(TileFileError::Version { path, found: number(0), expected: VERSION });
        }
        let damaged = |reason: String| TileFileError::Header { path: path.clone(), reason };
        let pyramid = Pyramid::new(number(1), number(2), number(3), number(4), Some(number(5)))
            .map_err(|error: PyramidError| damaged(error.to_string()))?;
        let format = match number(6) {
            0 => TileFormat::Rgba8,
            1 => TileFormat::Bc1,
            other => return Err(damaged(format!("texel format {other}"))),
        };
        let layout = Self::new(pyramid, format).map_err(|error| damaged(error.to_string()))?;
        if layout.header_page() != *page {
            return Err(damaged("its lengths do not follow from its sizes and format".into()));
        }
        Ok(layout)
    }
}

/// The whole index with its checksum, from its entries.
pub fn index_page(layout: &FileLayout, entries: &[u64]) -> Vec<u8> {
    assert_eq!(entries.len() as u64, layout.entry_count(), "{layout:?}");
    let mut bytes = vec![0; layout.index_bytes() as usize];
    for (bytes, entry) in bytes.chunks_exact_mut(8).zip(entries) {
        bytes.copy_from_slice(&entry.to_le_bytes());
    }
    seal(&mut bytes);
    bytes
}

/// Writes the checksum of all but the last 8 bytes into the last 8.
fn seal(bytes: &mut [u8]) {
    let (content, checksum) = bytes.split_at_mut(bytes.len() - CHECKSUM_BYTES);
    checksum.copy_from_slice(&xxh3_64(content).to_le_bytes());
}

pub(super) fn is_sealed(bytes: &[u8]) -> bool {
    let (content, checksum) = bytes.split_at(bytes.len() - CHECKSUM_BYTES);
    checksum == xxh3_64(content).to_le_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layouts() -> Vec<FileLayout> {
        [(7, 6, 4, 2, None, TileFormat::Rgba8), (9, 9, 6, 4, Some(7), TileFormat::Bc1)]
            .map(|(m, n, k, border, resident, format)| {
                FileLayout::new(Pyramid::new(m, n, k, border, resident).unwrap(), format).unwrap()
            })
            .to_vec()
    }

    #[test]
    fn a_header_page_parses_to_its_layout() {
        for layout in layouts() {
            assert_eq!(FileLayout::parse(&layout.header_page(), Path::new("a.tiles")).unwrap(), layout);
        }
    }

    #[test]
    fn a_resealed_header_with_any_other_number_is_refused() {
        let page = layouts()[0].header_page();
        for at in 0..HEADER_BYTES - CHECKSUM_BYTES {
            let mut other = page;
            other[at] ^= 1;
            seal(&mut other);
            // Some other sizes form a valid pyramid, but then the stored lengths do not match.
            assert!(FileLayout::parse(&other, Path::new("a.tiles")).is_err(), "byte {at}");
        }
    }

    #[test]
    fn records_follow_each_other_without_gap_or_overlap() {
        for layout in layouts() {
            let pyramid = layout.pyramid();
            let mut end = PAGE_BYTES + layout.index_bytes();
            for level in pyramid.first_resident_level()..=pyramid.coarsest_level() {
                assert_eq!(layout.resident_offset(level), end);
                end += layout.resident_record_bytes(level) as u64;
            }
            for index in 0..pyramid.tile_count() {
                assert_eq!(layout.record_offset(index), end);
                assert_eq!(pyramid.tile_index(layout.tile(index)), index);
                end += layout.record_bytes() as u64;
            }
            assert_eq!(layout.total_bytes(), end);
            assert!(end.is_multiple_of(PAGE_BYTES));
        }
    }

    #[test]
    fn unstorable_parameters_are_refused_with_the_number() {
        let pyramid = Pyramid::new(9, 8, 5, 2, None).unwrap();
        assert_eq!(FileLayout::new(pyramid, TileFormat::Bc1), Err(LayoutError::Bc1Border(2)));
        let pyramid = Pyramid::new(20, 20, 4, 4, None).unwrap();
        assert!(matches!(FileLayout::new(pyramid, TileFormat::Rgba8), Err(LayoutError::TooManyTiles(_))));
    }
}
