//! The ground of the scene `valley`: albedo for [`crate::math::relief`], 2^m x 2^m texels, m up to 20. A pure
//! function of level, column and row: the same bytes on every machine, in any order, on any number of
//! threads.
//!
//! The whole ground is labelled synthetic: the cover of a point follows from its height, slope, aspect and distance
//! from the divide (`ground`). The level of 1024 x 1024 texels is computed from the heights; each coarser level is
//! exactly the mean of the finer one (`base`). Each finer level interpolates the same ground, adds one octave of
//! noise, and colours it again (`refine`).
//!
//! # Means
//! Beyond the base, the mean of four stored texels differs from the stored parent by what the new octave
//! adds. The RMS difference is 1 to 7 codes where texels differ by 10 to 60, and 13 in the octave after the
//! base (on the summit). The mean of a tile differs by at most 1.2 codes (the test allows 2.5).
//!
//! # Borders
//! The map is not a globe, but its borders follow the rule of all sources ([`super::border`]): columns wrap, and rows
//! beyond an edge are mirrored, half a turn away. Shaders and references share this rule. The model `valley` ends 1/64
//! of the area before the edges, so this is never visible.
//!
//! # Cost
//! The first terrain of a process computes the base: 0.9 s of processor time, on all cores. On a busy machine, a tile
//! of 512 with 4 texels of border takes 13 to 19 ms for both of its pictures, and 1.4 ms in the base and coarser levels
//! (2026-11-22). `earth` takes 13 ms on an idle core.

mod base;
mod ground;
mod noise;
mod refine;
#[cfg(test)]
mod tests;

use super::border::{Square, true_texel};
use super::{TileError, TileSource};
use crate::math::pyramid::{Pyramid, TileId};
use base::{BASE_LOG2, TerrainBase};
use refine::TerrainRegion;
use thiserror::Error;

/// Error of the source `terrain`.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("the terrain's map must be square, with at least 2^4 texels per side; 2^{0} x 2^{1} is not")]
pub struct TerrainError(u32, u32);

/// The source `terrain`. RGBA8, alpha 255.
pub struct Terrain {
    pyramid: Pyramid,
    base: &'static TerrainBase,
}

impl Terrain {
    /// A terrain of this size. The first in a process computes the base (see `base`).
    ///
    /// # Errors
    /// [`TerrainError`] unless the map is square and at least 16 texels wide.
    pub fn new(pyramid: Pyramid) -> Result<Terrain, TerrainError> {
        let [m, n] = [pyramid.width_log2(), pyramid.height_log2()];
        if m != n || m < 4 {
            return Err(TerrainError(m, n));
        }
        Ok(Terrain { pyramid, base: base::base() })
    }

    /// Writes texels of the level `2^width_log2` wide.
    fn write(&self, width_log2: u32, square: Square<'_>) {
        let Square { origin: [left, top], side, bytes } = square;
        let width = 1i64 << width_log2;
        let mut piece = |from: [i64; 2], rows: usize, at: usize| {
            for (x, column, columns) in spans(from[0], side, width as usize) {
                let y = from[1] as usize;
                let region = refine::region(self.base, width_log2, column..column + columns, y..y + rows).0;
                write_region(
                    &region,
                    width_log2,
                    [column, y],
                    [columns, rows],
                    side,
                    &mut bytes[(at * side + x) * 4..],
                );
            }
        };
        let inside = top.max(0)..(top + side as i64).min(width);
        piece([left, inside.start], (inside.end - inside.start) as usize, (inside.start - top) as usize);
        // Rows beyond the north and the south edge are mirrored, half a turn away ([`true_texel`]), so each is a piece
        // of its own.
        for y in (top..inside.start).chain(inside.end..top + side as i64) {
            let turned = true_texel([width as u32; 2], left, y).map(i64::from);
            piece(turned, 1, (y - top) as usize);
        }
    }

    /// Like [`Terrain::write`], for stored levels.
    fn write_base(&self, width_log2: u32, square: Square<'_>) {
        square.copy(self.base.level(width_log2), [1 << width_log2; 2]);
    }
}

/// Splits `length` columns from `start`, which wrap, into runs: columns before the run, its true first
/// column, its length.
fn spans(start: i64, length: usize, width: usize) -> Vec<(usize, usize, usize)> {
    let (mut spans, mut done) = (Vec::new(), 0);
    while done < length {
        let column = (start + done as i64).rem_euclid(width as i64) as usize;
        let columns = (length - done).min(width - column);
        spans.push((done, column, columns));
        done += columns;
    }
    spans
}

/// Colours `size` texels from `from` of the level `2^width_log2` wide, into rows of `side` texels.
fn write_region(
    region: &TerrainRegion,
    width_log2: u32,
    from: [usize; 2],
    size: [usize; 2],
    side: usize,
    bytes: &mut [u8],
) {
    let (palette, texel_m) = (&base::base().palette, base::texel_m(width_log2));
    for (row, line) in bytes.chunks_mut(side * 4).take(size[1]).enumerate() {
        let ground = &region.row(from[0], from[1] + row)[..size[0]];
        for (bytes, ground) in line.chunks_exact_mut(4).zip(ground) {
            let [r, g, b] = base::texel(palette, ground, texel_m);
            bytes.copy_from_slice(&[r, g, b, 255]);
        }
    }
}

impl TileSource for Terrain {
    fn describe(&self) -> String {
        let [m, n] = [self.pyramid.width_log2(), self.pyramid.height_log2()];
        format!(
            "terrain, 2^{m} x 2^{n}: synthetic colours of the ground around Mount Everest, from real heights"
        )
    }

    fn pyramid(&self) -> Pyramid {
        self.pyramid
    }

    fn read_tile(&self, tile: TileId, bytes: &mut [u8]) -> Result<(), TileError> {
        let [fine, coarse] = Square::both(&self.pyramid, tile, bytes);
        let width_log2 = self.pyramid.width_log2() - tile.level;
        if width_log2 <= BASE_LOG2 {
            self.write_base(width_log2, fine);
            self.write_base(width_log2 - 1, coarse);
            return Ok(());
        }
        let inside = fine.origin.iter().all(|&at| at >= 0 && at + fine.side as i64 <= 1 << width_log2);
        if !inside {
            self.write(width_log2, fine);
            match width_log2 - 1 {
                BASE_LOG2 => self.write_base(BASE_LOG2, coarse),
                coarser => self.write(coarser, coarse),
            }
            return Ok(());
        }
        let [columns, rows] = fine.origin.map(|at| at as usize..at as usize + fine.side);
        let (children, parents) = refine::region(self.base, width_log2, columns, rows);
        let parents = parents.expect("a level beyond the base must be refined from a coarser one");
        for (region, width_log2, square) in
            [(&children, width_log2, fine), (&parents, width_log2 - 1, coarse)]
        {
            let from = square.origin.map(|at| at as usize);
            write_region(region, width_log2, from, [square.side; 2], square.side, square.bytes);
        }
        Ok(())
    }

    fn read_resident_level(&self, level: u32) -> Result<Vec<u8>, TileError> {
        assert!(level >= self.pyramid.first_resident_level(), "level {level} of {:?}", self.pyramid);
        let width_log2 = self.pyramid.width_log2() - level;
        if width_log2 <= BASE_LOG2 {
            return Ok(self.base.level(width_log2).iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect());
        }
        let width = 1usize << width_log2;
        let mut bytes = vec![0; width * width * 4];
        // Computed in bands of 64 rows, to bound memory.
        for (band, bytes) in bytes.chunks_mut(64 * width * 4).enumerate() {
            let region = refine::region(self.base, width_log2, 0..width, 64 * band..64 * band + 64).0;
            write_region(&region, width_log2, [0, 64 * band], [width, 64], width, bytes);
        }
        Ok(bytes)
    }
}
