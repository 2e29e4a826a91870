//! The Earth, 2^m x 2^(m-1) texels, m up to 20. It is a pure function of level, column and row: the same bytes on
//! every machine, in any order, on any number of threads.
//!
//! Levels up to 4096 x 2048 texels are real imagery (Blue Marble; `base`). Finer levels are labelled synthetic. Each
//! texel is split into four with the same mean (`refine`): smooth interpolation (`predict`) plus noise on the sphere
//! (`noise`). The noise is as strong as the variation between texels of the finest imagery.
//!
//! # Strength
//! The strength is the relative texel-to-texel variation of luminance at 4096 x 2048, by a robust measure
//! (`base::EarthBase::strength`). It is 1.3 % in the Sahara, 1.9 % in India, 3.1 % in Australia and 4.0 % in the Andes.
//! By the same measure the next two coarser levels vary 1.2-1.5 and 1.5-2.0 times as much. All synthetic octaves use
//! the strength at 4096 x 2048, but at most 9 %. All three channels share one noise, so that it adds no colour. The
//! synthetic levels vary 1.0-1.15 times as much as 4096 x 2048, because the interpolation adds its part.
//!
//! # Means
//! Before rounding to bytes, the mean of four children equals the parent exactly, in linear light. After rounding, the
//! mean of four stored texels, stored again, is within **1 code** of the stored parent. Proof: rounding moves each
//! child by at most half a code. Let s(x) be the step in linear light from one code to the next at brightness x. In
//! codes at the parent's brightness, the mean then moves by at most half a code times mean(s(child))/s(parent). The
//! function s grows as x^(1-1/2.4). This is concave, so by Jensen's inequality the ratio is at most 1. On the curve's
//! linear segment s is constant, which raises the bound to 1.32. The parent's own rounding adds half a code. The sum,
//! 0.66 + 0.5, is below 1.5, so the two stored codes differ by at most 1. In the real levels every texel is exactly the
//! mean of the four stored finer ones.
//!
//! # Cost
//! A synthetic tile of 512 x 512 texels with a border of 4 texels takes 13 ms with its copy of half the size, in a
//! texture of 2^18 columns and in one of 2^20 columns; in the coarsest synthetic level, it takes 11 ms. A tile of
//! imagery takes 1.3 ms. Measured on one core of a Xeon of 2023, median of 9, 2026-11-21. The finest octave's noise
//! dominates; the coarser octaves add a fifth.

mod base;
mod noise;
mod predict;
mod refine;
#[cfg(test)]
mod tests;

use super::border::Square;
use super::{TileError, TileSource};
use crate::math::pyramid::{Pyramid, TileId};
use crate::picture::srgb;
use base::{BASE_WIDTH_LOG2, EarthBase, level_size};
use refine::EarthRegion;
use thiserror::Error;

/// Errors of the source `earth`.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum EarthError {
    #[error("the Earth's map must be twice as wide as high; 2^{0} x 2^{1} texels are not")]
    Shape(u32, u32),
    #[error("the built-in Blue Marble picture: {0}; the program was built from damaged or different files")]
    Picture(String),
}

/// The source `earth`. RGBA8, alpha 255.
pub struct Earth {
    pyramid: Pyramid,
    base: &'static EarthBase,
}

/// The finest level of real imagery: width and height, and sRGB texels from the north.
///
/// # Errors
/// [`EarthError::Picture`] if the built-in picture does not decode to the pinned bytes.
pub fn finest_imagery() -> Result<([u32; 2], &'static [[u8; 3]]), EarthError> {
    Ok((level_size(BASE_WIDTH_LOG2), base::base()?.level(BASE_WIDTH_LOG2)))
}

impl Earth {
    /// An Earth of this size. The first in a process decodes the imagery (about half a second).
    ///
    /// # Errors
    /// [`EarthError::Shape`] unless the height is half the width; otherwise the errors of [`finest_imagery`].
    pub fn new(pyramid: Pyramid) -> Result<Self, EarthError> {
        let [m, n] = [pyramid.width_log2(), pyramid.height_log2()];
        if m != n + 1 {
            return Err(EarthError::Shape(m, n));
        }
        Ok(Self { pyramid, base: base::base()? })
    }

    /// The finest level of real imagery; levels with a smaller number are synthetic detail.
    pub fn finest_real_level(&self) -> u32 {
        self.pyramid.width_log2().saturating_sub(BASE_WIDTH_LOG2)
    }

    fn write_imagery(&self, width_log2: u32, square: Square<'_>) {
        square.copy(self.base.level(width_log2), level_size(width_log2));
    }
}

fn write_region(region: &EarthRegion, square: Square<'_>) {
    let table = srgb::table();
    let ([left, top], side) = (square.origin, square.side);
    for (y, line) in square.bytes.chunks_exact_mut(side * 4).enumerate() {
        let row = &region.row(left, top + y as i64)[..side];
        for (texel, linear) in line.chunks_exact_mut(4).zip(row) {
            let [r, g, b] = linear.map(|channel| table.encode(channel));
            texel.copy_from_slice(&[r, g, b, 255]);
        }
    }
}

impl TileSource for Earth {
    fn describe(&self) -> String {
        format!(
            "earth, 2^{} x 2^{}: Blue Marble imagery from level {}, synthetic detail below",
            self.pyramid.width_log2(),
            self.pyramid.height_log2(),
            self.finest_real_level()
        )
    }

    fn pyramid(&self) -> Pyramid {
        self.pyramid
    }

    fn read_tile(&self, tile: TileId, bytes: &mut [u8]) -> Result<(), TileError> {
        let [fine, coarse] = Square::both(&self.pyramid, tile, bytes);
        let width_log2 = self.pyramid.width_log2() - tile.level;
        if width_log2 <= BASE_WIDTH_LOG2 {
            self.write_imagery(width_log2, fine);
            self.write_imagery(width_log2 - 1, coarse);
            return Ok(());
        }
        let ([left, top], side) = (fine.origin, fine.side);
        let (children, parents) = refine::region(self.base, width_log2, (left, top, side, side));
        write_region(&children, fine);
        match parents {
            Some(parents) => write_region(&parents, coarse),
            None => unreachable!("a level of width 2^{width_log2} must be refined from a coarser one"),
        }
        Ok(())
    }

    fn read_resident_level(&self, level: u32) -> Result<Vec<u8>, TileError> {
        assert!(level >= self.pyramid.first_resident_level(), "level {level} of {:?}", self.pyramid);
        let width_log2 = self.pyramid.width_log2() - level;
        if width_log2 <= BASE_WIDTH_LOG2 {
            let texels = self.base.level(width_log2);
            return Ok(texels.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect());
        }
        let [width, height] = level_size(width_log2).map(|side| side as usize);
        let mut bytes = vec![0; width * height * 4];
        // Computed in squares of 512, to bound memory: a level in linear light needs three times the bytes.
        let side = 512.min(height);
        let mut square = vec![0; side * side * 4];
        for top in (0..height).step_by(side) {
            for left in (0..width).step_by(side) {
                let origin = [left as i64, top as i64];
                let (region, _) = refine::region(self.base, width_log2, (origin[0], origin[1], side, side));
                write_region(&region, Square { origin, side, bytes: &mut square });
                for (row, line) in square.chunks_exact(side * 4).enumerate() {
                    bytes[((top + row) * width + left) * 4..][..side * 4].copy_from_slice(line);
                }
            }
        }
        Ok(bytes)
    }
}
