//! The `.tiles` file: contents read back unchanged, and damage to any byte is detected.

use ortelius::math::pyramid::{Pyramid, TileId};
use ortelius::texture::bake::{BakeSettings, SourceName, bake};
use ortelius::texture::source::earth::Earth;
use ortelius::texture::source::ruler::Ruler;
use ortelius::texture::source::{TileError, TileFormat, TileSource};
use ortelius::texture::tiles::{
    FileLayout, HEADER_BYTES, PAGE_BYTES, TileFile, TileFileError, TileRecord, verify,
};
use std::fs::{self, File, OpenOptions};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

fn baked(folder: &Path, source: SourceName, tile_side: u32, border_texels: u32) -> PathBuf {
    let output = folder.join("baked.tiles");
    let settings = BakeSettings {
        source,
        output: output.clone(),
        tile_side,
        border_texels,
        format: TileFormat::Rgba8,
        resident_levels: None,
        force: false,
    };
    bake(&settings, &()).unwrap();
    output
}

/// Nine pages: the header, the index, five resident levels and two tiles.
fn smallest(folder: &Path) -> PathBuf {
    baked(folder, SourceName::Ruler(5), 16, 2)
}

/// The number of tiles and resident levels of a file that differ from the source's.
fn differing(file: &TileFile, source: &dyn TileSource) -> usize {
    let pyramid = source.pyramid();
    assert_eq!(file.pyramid(), pyramid);
    let mut differing = 0;
    let mut stored = vec![0; file.format().tile_bytes(&pyramid)];
    let mut expected = stored.clone();
    for index in 0..pyramid.tile_count() {
        let tile = file.layout().tile(index);
        file.read_tile(tile, &mut stored).unwrap();
        source.read_tile(tile, &mut expected).unwrap();
        differing += usize::from(stored != expected);
    }
    for level in pyramid.first_resident_level()..=pyramid.coarsest_level() {
        let stored = file.read_resident_level(level).unwrap();
        differing += usize::from(stored != source.read_resident_level(level).unwrap());
    }
    differing
}

#[test]
fn synthetic_tiles_read_back_unchanged() {
    let folder = tempfile::tempdir().unwrap();
    let file = TileFile::open(&baked(folder.path(), SourceName::Ruler(8), 16, 4)).unwrap();
    let pyramid = Pyramid::new(8, 7, 4, 4, None).unwrap();
    assert_eq!(differing(&file, &Ruler::new(pyramid)), 0);
    // Near miss: none of another source's tiles is accepted.
    let earth = Earth::new(pyramid).unwrap();
    let all = pyramid.tile_count() as usize + pyramid.resident_levels() as usize;
    assert_eq!(differing(&file, &earth), all);

    let folder = tempfile::tempdir().unwrap();
    let file = TileFile::open(&baked(folder.path(), SourceName::Earth(9), 64, 4)).unwrap();
    let pyramid = Pyramid::new(9, 8, 6, 4, None).unwrap();
    assert_eq!(differing(&file, &Earth::new(pyramid).unwrap()), 0);
}

/// The record that contains the byte at `offset`; `None` in header and index.
fn record_at(layout: &FileLayout, offset: u64) -> Option<TileRecord> {
    let pyramid = layout.pyramid();
    let resident = (pyramid.first_resident_level()..=pyramid.coarsest_level()).find(|&level| {
        let start = layout.resident_offset(level);
        (start..start + layout.resident_record_bytes(level) as u64).contains(&offset)
    });
    if let Some(level) = resident {
        return Some(TileRecord::ResidentLevel(level));
    }
    let tiles = layout.record_offset(0);
    (offset >= tiles).then(|| TileRecord::Tile(layout.tile((offset - tiles) / layout.record_bytes() as u64)))
}

#[test]
fn a_flip_in_any_byte_is_detected_in_its_record() {
    let folder = tempfile::tempdir().unwrap();
    let path = smallest(folder.path());
    let whole = fs::read(&path).unwrap();
    let layout = *TileFile::open(&path).unwrap().layout();
    assert_eq!(whole.len() as u64, layout.total_bytes());
    let file = OpenOptions::new().write(true).open(&path).unwrap();
    for (offset, &byte) in whole.iter().enumerate() {
        let flipped = byte ^ 1 << (offset % 8);
        file.write_all_at(&[flipped], offset as u64).unwrap();
        let found = verify(&path, &|_| {});
        match record_at(&layout, offset as u64) {
            None => {
                let error = found.expect_err("a flip in header or index");
                assert!(error.is_damage(), "byte {offset}: {error}");
            }
            Some(record) => {
                let bad: Vec<TileRecord> = found.unwrap().bad.into_iter().map(|bad| bad.record).collect();
                assert_eq!(bad, [record], "byte {offset}");
            }
        }
        file.write_all_at(&[byte], offset as u64).unwrap();
    }
    assert!(verify(&path, &|_| {}).unwrap().bad.is_empty());
}

#[test]
fn a_damaged_tile_is_an_error_and_its_neighbour_still_reads() {
    let folder = tempfile::tempdir().unwrap();
    let path = smallest(folder.path());
    let file = TileFile::open(&path).unwrap();
    let layout = *file.layout();
    // The last byte of the first tile's record is padding; the checksum covers it too.
    let offset = layout.record_offset(1) - 1;
    OpenOptions::new().write(true).open(&path).unwrap().write_all_at(&[1], offset).unwrap();
    let mut bytes = vec![0; layout.tile_bytes()];
    let damaged = file.read_tile(TileId { level: 0, row: 0, column: 0 }, &mut bytes);
    assert!(matches!(damaged, Err(TileError::Checksum { .. })));
    file.read_tile(TileId { level: 0, row: 0, column: 1 }, &mut bytes).unwrap();
}

#[test]
fn a_file_of_any_other_length_does_not_open() {
    let folder = tempfile::tempdir().unwrap();
    let path = smallest(folder.path());
    let whole = fs::read(&path).unwrap();
    let lengths = (0..whole.len()).step_by(97).chain([whole.len() - 1, whole.len() + 1, 2 * whole.len()]);
    for length in lengths {
        let mut cut = whole.clone();
        cut.resize(length, 0);
        fs::write(&path, &cut).unwrap();
        let error = TileFile::open(&path).err().unwrap_or_else(|| panic!("{length} bytes open"));
        assert!(error.is_damage(), "{length} bytes: {error}");
    }
}

#[test]
fn a_file_cut_while_it_is_open_gives_errors_and_no_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = smallest(folder.path());
    let file = TileFile::open(&path).unwrap();
    OpenOptions::new().write(true).open(&path).unwrap().set_len(PAGE_BYTES).unwrap();
    let mut bytes = vec![0; file.layout().tile_bytes()];
    let read = file.read_tile(TileId { level: 0, row: 0, column: 0 }, &mut bytes);
    assert!(matches!(read, Err(TileError::Read { .. })));
    assert!(file.read_resident_level(5).is_err());
}

#[test]
fn a_header_that_declares_terabytes_is_rejected_before_any_allocation() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("huge.tiles");
    let pyramid = Pyramid::new(20, 19, 7, 4, None).unwrap();
    let layout = FileLayout::new(pyramid, TileFormat::Rgba8).unwrap();
    let mut bytes = layout.header_page().to_vec();
    bytes.resize(3 * HEADER_BYTES, 0);
    fs::write(&path, &bytes).unwrap();
    assert!(matches!(TileFile::open(&path), Err(TileFileError::Length { found: 12288, .. })));
}

#[test]
fn a_file_of_another_format_is_reported_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing.tiles");
    assert!(matches!(TileFile::open(&missing), Err(TileFileError::Open { .. })));
    assert!(matches!(TileFile::open(folder.path()), Err(TileFileError::Open { .. })));
    let text = folder.path().join("text.tiles");
    fs::write(&text, "not tiles\n".repeat(2000)).unwrap();
    assert!(matches!(TileFile::open(&text), Err(TileFileError::NotTiles { .. })));
    File::create(&text).unwrap();
    assert!(matches!(TileFile::open(&text), Err(TileFileError::NotTiles { .. })));
}
