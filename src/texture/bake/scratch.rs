//! The scratch file: the payloads (without borders) of all tiles in RGBA8, from which the stored tiles are assembled.

use super::error::BakeError;
use crate::math::pyramid::{Pyramid, TileId};
use crate::picture::srgb;
use crate::texture::source::border::true_texel;
use crate::texture::source::{TileError, TileFormat, TileSource};
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_64;

/// Bytes of one tile without border.
pub(super) fn payload_bytes(pyramid: &Pyramid) -> usize {
    4 << (2 * pyramid.tile_log2())
}

/// Reads back a job's output. If it ends beyond the file's end, part of it was never written, and all its bytes read as
/// zeros. Zeros match the job's hash only if the output consists of zeros.
pub(super) fn read_back(file: &File, path: &Path, bytes: &mut [u8], offset: u64) -> Result<(), BakeError> {
    match file.read_exact_at(bytes, offset) {
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
            bytes.fill(0);
            Ok(())
        }
        other => other.map_err(|source| BakeError::ReadBack { path: path.to_path_buf(), offset, source }),
    }
}

pub(super) struct Scratch {
    path: PathBuf,
    file: File,
    pyramid: Pyramid,
    total_bytes: u64,
    /// The finest resident level. The coarsest streamed tiles have it as their second mip level.
    pub first_resident: Vec<u8>,
}

/// Consecutive rows (or columns) of a region that lie in one row (or column) of tiles.
struct Run {
    /// Start of the run in the region, and its length.
    at: usize,
    length: usize,
    /// The tile, and the first texel in it. Texels count down if `step` is -1.
    tile: u32,
    inside: u32,
    step: i64,
    /// Half a turn to add to columns in rows beyond a pole.
    turn: i64,
}

impl Scratch {
    pub fn open(path: &Path, pyramid: Pyramid) -> Result<Self, BakeError> {
        let total_bytes = pyramid.tile_count() * payload_bytes(&pyramid) as u64;
        let failed = |source| BakeError::write(path.to_path_buf(), 0, total_bytes, source);
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
        let file = file.map_err(failed)?;
        Ok(Self { path: path.to_path_buf(), file, pyramid, total_bytes, first_resident: Vec::new() })
    }

    fn offset(&self, tile: TileId) -> u64 {
        self.pyramid.tile_index(tile) * payload_bytes(&self.pyramid) as u64
    }

    fn write(&self, bytes: &[u8], offset: u64) -> Result<(), BakeError> {
        let written = self.file.write_all_at(bytes, offset);
        written.map_err(|source| BakeError::write(self.path.clone(), offset, self.total_bytes, source))
    }

    fn read(&self, bytes: &mut [u8], offset: u64) -> Result<(), BakeError> {
        let read = self.file.read_exact_at(bytes, offset);
        read.map_err(|source| BakeError::ReadBack { path: self.path.clone(), offset, source })
    }

    /// Writes whole rows of level 0 into their tiles. Rows must stay within one row of tiles.
    pub fn write_band(&self, top: u32, rgba: &[u8]) -> Result<(), BakeError> {
        let side = self.pyramid.tile_size() as usize;
        let row_bytes = self.pyramid.level_size(0)[0] as usize * 4;
        let rows = rgba.len() / row_bytes;
        let (tile_row, inside) = (top / side as u32, top as usize % side);
        assert!(inside + rows <= side, "rows {top} + {rows} of tiles of {side}");
        let mut piece = vec![0; rows * side * 4];
        for column in 0..(row_bytes / (side * 4)) {
            for (line, row) in piece.chunks_exact_mut(side * 4).zip(rgba.chunks_exact(row_bytes)) {
                line.copy_from_slice(&row[column * side * 4..][..side * 4]);
            }
            let tile = TileId { level: 0, row: tile_row, column: column as u32 };
            self.write(&piece, self.offset(tile) + (inside * side * 4) as u64)?;
        }
        Ok(())
    }

    /// Hash of the bytes written by [`Self::write_band`].
    pub fn band_hash(&self, top: u32, rows: u32) -> Result<u64, BakeError> {
        let side = self.pyramid.tile_size() as usize;
        let row_bytes = self.pyramid.level_size(0)[0] as usize * 4;
        let mut rgba = vec![0; rows as usize * row_bytes];
        let mut piece = vec![0; rows as usize * side * 4];
        for column in 0..(row_bytes / (side * 4)) {
            let tile = TileId { level: 0, row: top / side as u32, column: column as u32 };
            let offset = self.offset(tile) + u64::from(top % side as u32) * side as u64 * 4;
            read_back(&self.file, &self.path, &mut piece, offset)?;
            for (line, row) in piece.chunks_exact(side * 4).zip(rgba.chunks_exact_mut(row_bytes)) {
                row[column * side * 4..][..side * 4].copy_from_slice(line);
            }
        }
        Ok(xxh3_64(&rgba))
    }

    /// Hash of the bytes written by [`Self::write_payload`].
    pub fn payload_hash(&self, tile: TileId) -> Result<u64, BakeError> {
        let mut payload = vec![0; payload_bytes(&self.pyramid)];
        read_back(&self.file, &self.path, &mut payload, self.offset(tile))?;
        Ok(xxh3_64(&payload))
    }

    pub fn read_payload(&self, tile: TileId, payload: &mut [u8]) -> Result<(), BakeError> {
        self.read(payload, self.offset(tile))
    }

    pub fn write_payload(&self, tile: TileId, payload: &[u8]) -> Result<(), BakeError> {
        self.write(payload, self.offset(tile))
    }

    /// Computes a tile of level 1 or coarser from the stored texels of the next finer level.
    pub fn mean_payload(&self, tile: TileId, finer: &mut [u8], payload: &mut [u8]) -> Result<(), BakeError> {
        let side = self.pyramid.tile_size() as usize;
        for quarter in 0..4u32 {
            let (right, low) = (quarter % 2, quarter / 2);
            let child =
                TileId { level: tile.level - 1, row: 2 * tile.row + low, column: 2 * tile.column + right };
            self.read_payload(child, finer)?;
            let left = [right, low].map(|half| half as usize * side / 2);
            mean_square(finer, side, payload, side, left);
        }
        Ok(())
    }

    /// Copies a rectangle into `rgba`, in rows of `width` texels. The rectangle may extend beyond the level's edges.
    /// `tile_rows` is scratch memory. An error names its tile and offset.
    fn region(
        &self,
        level: u32,
        [left, top]: [i64; 2],
        [width, height]: [usize; 2],
        tile_rows: &mut Vec<u8>,
        rgba: &mut [u8],
    ) -> Result<(), (TileId, BakeError)> {
        assert_eq!(rgba.len(), width * height * 4);
        let size = self.pyramid.level_size(level);
        if level == self.pyramid.first_resident_level() {
            let resident = self.first_resident.as_chunks::<4>().0;
            for (index, texel) in rgba.as_chunks_mut::<4>().0.iter_mut().enumerate() {
                let [x, y] = true_texel(size, left + (index % width) as i64, top + (index / width) as i64);
                *texel = resident[(y * size[0] + x) as usize];
            }
            return Ok(());
        }
        let side = self.pyramid.tile_size() as usize;
        for rows in self.runs(height, |at| true_row(size, top + at as i64)) {
            let columns = |at: usize| {
                let column = (left + at as i64 + rows.turn).rem_euclid(i64::from(size[0]));
                (column as u32, 0)
            };
            for columns in self.runs(width, columns) {
                let tile = TileId { level, row: rows.tile, column: columns.tile };
                // One read of whole rows, at most a tile, instead of one read for each row.
                let last = i64::from(rows.inside) + rows.step * (rows.length as i64 - 1);
                let first = last.min(i64::from(rows.inside));
                tile_rows.resize(rows.length * side * 4, 0);
                let offset = self.offset(tile) + first as u64 * side as u64 * 4;
                self.read(tile_rows, offset).map_err(|error| (tile, error))?;
                for row in 0..rows.length {
                    let stored = (i64::from(rows.inside) + rows.step * row as i64 - first) as usize;
                    let from = (stored * side + columns.inside as usize) * 4;
                    let to = ((rows.at + row) * width + columns.at) * 4;
                    rgba[to..to + columns.length * 4]
                        .copy_from_slice(&tile_rows[from..from + columns.length * 4]);
                }
            }
        }
        Ok(())
    }

    /// Splits `length` positions at tile edges and at changes of direction. `place` returns a texel's true
    /// index and its turn.
    fn runs(&self, length: usize, place: impl Fn(usize) -> (u32, i64)) -> Vec<Run> {
        let log2 = self.pyramid.tile_log2();
        let mask = self.pyramid.tile_size() - 1;
        let mut runs: Vec<Run> = Vec::new();
        for at in 0..length {
            let (index, turn) = place(at);
            let (tile, inside) = (index >> log2, i64::from(index & mask));
            if let Some(run) = runs.last_mut()
                && run.tile == tile
                && run.turn == turn
            {
                let step = inside - i64::from(run.inside);
                if run.length == 1 && step.abs() == 1 {
                    run.step = step;
                }
                if run.step * run.length as i64 == step {
                    run.length += 1;
                    continue;
                }
            }
            runs.push(Run { at, length: 1, tile, inside: inside as u32, step: 1, turn });
        }
        runs
    }
}

/// A row's true index, and half a turn if it lies beyond a pole.
fn true_row(size: [u32; 2], y: i64) -> (u32, i64) {
    let [turn, row] = true_texel(size, 0, y);
    (row, i64::from(turn))
}

/// Halves a square of `side` x `side` texels, by means of 2 x 2 texels, and writes the result at `[left, top]` of a
/// picture that is `wide` texels wide.
pub(super) fn mean_square(finer: &[u8], side: usize, out: &mut [u8], wide: usize, [left, top]: [usize; 2]) {
    let table = srgb::table();
    let finer = finer.as_chunks::<4>().0;
    let out = out.as_chunks_mut::<4>().0;
    for y in 0..side / 2 {
        for x in 0..side / 2 {
            let at = 2 * y * side + 2 * x;
            let four = [at, at + 1, at + side, at + side + 1].map(|texel| finer[texel]);
            out[(top + y) * wide + left + x] = table.mean_of_four_texels(four);
        }
    }
}

impl TileSource for Scratch {
    fn describe(&self) -> String {
        self.path.display().to_string()
    }

    fn pyramid(&self) -> Pyramid {
        self.pyramid
    }

    fn format(&self) -> TileFormat {
        TileFormat::Rgba8
    }

    fn read_tile(&self, tile: TileId, bytes: &mut [u8]) -> Result<(), TileError> {
        let [fine, coarse] = self.pyramid.stored_sides().map(|side| side as usize);
        let origin = [tile.column, tile.row].map(|index| {
            i64::from(index) * i64::from(self.pyramid.tile_size()) - i64::from(self.pyramid.border_texels())
        });
        let (own, coarser) = bytes.split_at_mut(fine * fine * 4);
        let mut tile_rows = Vec::new();
        let read = self.region(tile.level, origin, [fine; 2], &mut tile_rows, own).and_then(|()| {
            self.region(tile.level + 1, origin.map(|at| at >> 1), [coarse; 2], &mut tile_rows, coarser)
        });
        read.map_err(|(tile, error)| match error {
            BakeError::ReadBack { path, offset, source } => {
                TileError::Read { path: path.display().to_string(), tile, offset, source }
            }
            other => TileError::Read {
                path: self.path.display().to_string(),
                tile,
                offset: self.offset(tile),
                source: io::Error::other(other.to_string()),
            },
        })
    }

    fn read_resident_level(&self, level: u32) -> Result<Vec<u8>, TileError> {
        assert_eq!(level, self.pyramid.first_resident_level(), "only the finest resident level is available");
        Ok(self.first_resident.clone())
    }
}
