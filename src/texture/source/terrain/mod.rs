//! The ground of the scene `valley`: albedo for [`crate::math::relief`], 2^m x 2^m texels, m up to 20; a pure function of
//! level, column and row, the same bytes on every machine, in any order, on any number of threads.
//!
//! Labelled synthetic, all of it: what grows or lies at a place follows from its height, its slope, the direction it
//! faces and how far it is from the divide (`ground`). The level of 1024 x 1024 texels is computed from the heights, and
//! each coarser one is the mean of the finer, exactly (`base`). Finer levels colour the same ground, interpolated, with
//! one more octave of noise each (`refine`).
//!
//! # Means
//! Beyond the base the mean of four stored texels differs from the stored parent by what the octave adds: a root mean
//! square of 1 to 7 codes where texels differ by 10 to 60, 13 in the octave after the base (on the summit), and by at most
//! 1.2 codes in the mean of a tile (tested).
//!
//! # Borders
//! The map is no globe, but borders follow the one rule of all sources ([`super::border`]), which shaders and references
//! share: beyond an edge is the opposite side. The model `valley` ends 1/64 of the area before the edges, so that nothing
//! of it is seen.
//!
//! # Cost
//! The first terrain of a process computes the base: 0.9 s of one core, in parallel. A tile of 512 with 4 texels of border,
//! both pictures: 13 to 19 ms on a busy machine, 1.4 ms of the base and coarser (2026-11-22; `earth` 13 ms on a quiet
//! core).

mod base;
mod ground;
mod noise;
mod refine;
#[cfg(test)]
mod tests;

use super::border::true_texel;
use super::{TileError, TileFormat, TileSource};
use crate::math::pyramid::{Pyramid, TileId};
use base::{BASE_LOG2, Base};
use refine::Region;
use thiserror::Error;

/// What is wrong with a terrain.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("the terrain's map is a square of at least 2^4 texels; 2^{0} x 2^{1} are none")]
pub struct TerrainError(u32, u32);

/// The source `terrain`. RGBA8, alpha 255.
pub struct Terrain {
    pyramid: Pyramid,
    base: &'static Base,
}

impl Terrain {
    /// A terrain of this size. The first in a process computes the base (see `base`).
    ///
    /// # Errors
    /// [`TerrainError`] unless the map is square.
    pub fn new(pyramid: Pyramid) -> Result<Terrain, TerrainError> {
        let [m, n] = [pyramid.width_log2(), pyramid.height_log2()];
        if m != n || m < 4 {
            return Err(TerrainError(m, n));
        }
        Ok(Terrain { pyramid, base: base::base() })
    }

    /// Writes `side x side` texels of the level `2^width_log2` wide from `origin` on, which may lie outside of it.
    fn write(&self, width_log2: u32, [left, top]: [i64; 2], side: usize, bytes: &mut [u8]) {
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
        // Beyond the first and last row each row has its own turn.
        for y in (top..inside.start).chain(inside.end..top + side as i64) {
            let turned = true_texel([width as u32; 2], left, y).map(i64::from);
            piece(turned, 1, (y - top) as usize);
        }
    }

    /// As [`Terrain::write`], for levels that are stored.
    fn write_base(&self, width_log2: u32, [left, top]: [i64; 2], side: usize, bytes: &mut [u8]) {
        let level = self.base.level(width_log2);
        for (index, texel) in bytes.chunks_exact_mut(4).enumerate() {
            let [x, y] =
                true_texel([1 << width_log2; 2], left + (index % side) as i64, top + (index / side) as i64);
            let [r, g, b] = level[((y as usize) << width_log2) + x as usize];
            texel.copy_from_slice(&[r, g, b, 255]);
        }
    }
}

/// `length` columns from `start` on, which wrap: how many come before, the true first one, how many.
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

/// Colours `size` texels from `from` on of the level `2^width_log2` wide, into rows of `side` texels.
fn write_region(
    region: &Region,
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
            "terrain, 2^{m} x 2^{n}: synthetic colours of the ground about Mount Everest, from real heights"
        )
    }

    fn pyramid(&self) -> Pyramid {
        self.pyramid
    }

    fn format(&self) -> TileFormat {
        TileFormat::Rgba8
    }

    fn read_tile(&self, tile: TileId, bytes: &mut [u8]) -> Result<(), TileError> {
        assert_eq!(bytes.len(), self.pyramid.tile_bytes_rgba8(), "{tile:?} of {:?}", self.pyramid);
        assert!(self.pyramid.contains(tile), "{tile:?} of {:?}", self.pyramid);
        let [fine_side, coarse_side] = self.pyramid.stored_sides().map(|side| side as usize);
        let (fine, coarse) = bytes.split_at_mut(fine_side * fine_side * 4);
        let fine_origin = [tile.column, tile.row].map(|index| {
            i64::from(index) * i64::from(self.pyramid.tile_size()) - i64::from(self.pyramid.border_texels())
        });
        let coarse_origin = fine_origin.map(|at| at >> 1);
        let width_log2 = self.pyramid.width_log2() - tile.level;
        if width_log2 <= BASE_LOG2 {
            self.write_base(width_log2, fine_origin, fine_side, fine);
            self.write_base(width_log2 - 1, coarse_origin, coarse_side, coarse);
            return Ok(());
        }
        let inside = fine_origin.iter().all(|&at| at >= 0 && at + fine_side as i64 <= 1 << width_log2);
        if !inside {
            self.write(width_log2, fine_origin, fine_side, fine);
            match width_log2 - 1 {
                BASE_LOG2 => self.write_base(BASE_LOG2, coarse_origin, coarse_side, coarse),
                coarser => self.write(coarser, coarse_origin, coarse_side, coarse),
            }
            return Ok(());
        }
        let [columns, rows] = fine_origin.map(|at| at as usize..at as usize + fine_side);
        let (children, parents) = refine::region(self.base, width_log2, columns, rows);
        write_region(
            &children,
            width_log2,
            fine_origin.map(|at| at as usize),
            [fine_side; 2],
            fine_side,
            fine,
        );
        let parents = parents.expect("a level beyond the base is refined from another");
        write_region(
            &parents,
            width_log2 - 1,
            coarse_origin.map(|at| at as usize),
            [coarse_side; 2],
            coarse_side,
            coarse,
        );
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
        // By 64 rows, to bound the work in hand.
        for (band, bytes) in bytes.chunks_mut(64 * width * 4).enumerate() {
            let region = refine::region(self.base, width_log2, 0..width, 64 * band..64 * band + 64).0;
            write_region(&region, width_log2, [0, 64 * band], [width, 64], width, bytes);
        }
        Ok(bytes)
    }
}
