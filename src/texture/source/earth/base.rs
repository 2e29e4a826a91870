//! The real part of the Earth: Blue Marble imagery, 4096 x 2048 and coarser. The variation between texels of its
//! finest level sets the strength of the synthetic detail.
//!
//! The shipped picture has 5400 x 2700 texels. 4096 x 2048 is the largest power of two below it; 8192 x 4096
//! would present interpolated texels as imagery.

use super::super::border::true_texel;
use super::EarthError;
use crate::picture::srgb;
use crate::texture::coarser::coarser;
use rayon::prelude::*;
use std::sync::OnceLock;
use xxhash_rust::xxh3::xxh3_64;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// The finest level of real imagery is 2^12 texels wide.
pub const BASE_WIDTH_LOG2: u32 = 12;

const SOURCE_SIZE: [usize; 2] = [5400, 2700];
/// xxh3 of the decoded picture, RGB rows from the north: the decoder's exact output is part of the source.
const SOURCE_HASH: u64 = 0x6daa_1a04_dcb8_db5f;
/// 5400/4096 = 2700/2048 = 675/512: a base texel covers 675 units of 1/512 source texel on each axis.
const COVER_UNITS: usize = 675;
const TEXEL_UNITS: usize = 512;

/// Strength cells: 1024 x 512, each 2 x 2 blocks of 2 x 2 base texels.
pub const CELLS_LOG2: u32 = 10;

/// A strength of 1: detail as strong as the light itself.
pub const STRENGTH_ONE: i64 = 1 << 20;

/// At most 9 % per octave. Stronger variation (the Alps, islands) comes from edges, and noise of that
/// strength would show as black and white squares.
const MAX_STRENGTH: u64 = 94_372;

/// For a normal distribution of standard deviation 1, the square of the mean of sqrt |x| is 2^(1/2) Gamma(3/4)^2 / pi =
/// 0.6760. This constant is 1024/0.6760.
const ROOT_MEAN_TO_RMS_1024THS: u64 = 1515;

/// Linear light of one texel, in units of 2^-24.
pub type LinearLight = [i32; 3];

/// All real levels, and the variation between texels of the finest one.
pub struct EarthBase {
    /// Entry 0 is 4096 x 2048, the last 1 x 1: sRGB bytes, rows from the north.
    levels: Vec<Vec<[u8; 3]>>,
    /// For each cell, the texel-to-texel variation of the luminance at 4096 x 2048, relative to the luminance. It is
    /// measured as the mean of sqrt |Haar coefficient|, and stated as the RMS of a normal distribution with the same
    /// mean. Units of 1/[`STRENGTH_ONE`], at most [`MAX_STRENGTH`].
    ///
    /// Coasts and snow edges inflate a true RMS. The mean of roots is less sensitive: if one coefficient in five is
    /// 20 times the others, the RMS is 9 times as large, but this measure only 2.9 times.
    pub strength: Vec<u32>,
}

/// The base, decoded on first use (about half a second on one core) and kept: 34 MB of levels, 2 MB of strengths.
///
/// # Errors
/// [`EarthError::Picture`] if the built-in picture does not decode to the pinned bytes.
pub fn base() -> Result<&'static EarthBase, EarthError> {
    static BASE: OnceLock<Result<EarthBase, EarthError>> = OnceLock::new();
    BASE.get_or_init(EarthBase::build).as_ref().map_err(Clone::clone)
}

impl EarthBase {
    fn build() -> Result<Self, EarthError> {
        let finest = downsample(&decode()?);
        let strength = strength(&finest);
        let mut levels = vec![finest];
        for width_log2 in (0..BASE_WIDTH_LOG2).rev() {
            levels.push(coarser(&levels[levels.len() - 1], level_size(width_log2 + 1)));
        }
        Ok(Self { levels, strength })
    }

    /// The stored bytes of a real level, `2^width_log2` texels wide.
    pub fn level(&self, width_log2: u32) -> &[[u8; 3]] {
        assert!(width_log2 <= BASE_WIDTH_LOG2, "level of width 2^{width_log2} is not imagery");
        &self.levels[(BASE_WIDTH_LOG2 - width_log2) as usize]
    }
}

/// Width and height of the Earth's level of width `2^width_log2`.
pub fn level_size(width_log2: u32) -> [u32; 2] {
    [1 << width_log2, ((1u32 << width_log2) / 2).max(1)]
}

/// Decodes with scalar code only, so that the bytes are the same on every machine.
fn decode() -> Result<Vec<u8>, EarthError> {
    let options = DecoderOptions::new_safe()
        .set_use_unsafe(false)
        .set_strict_mode(true)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let file = include_bytes!("../../../../scenes/bmng.jpg");
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(file.as_slice()), options);
    let picture = decoder.decode().map_err(|error| EarthError::Picture(error.to_string()))?;
    let found = decoder.info().map(|info| [usize::from(info.width), usize::from(info.height)]);
    let hash = xxh3_64(&picture);
    if found != Some(SOURCE_SIZE) || hash != SOURCE_HASH {
        return Err(EarthError::Picture(format!(
            "{found:?} texels with hash {hash:#018x}, not {SOURCE_SIZE:?} with {SOURCE_HASH:#018x}"
        )));
    }
    Ok(picture)
}

/// The source texels under base texel `index` along one axis, each with its share in units of 1/512 texel.
fn cover(index: usize) -> impl Iterator<Item = (usize, i64)> + Clone {
    let (start, end) = (index * COVER_UNITS, (index + 1) * COVER_UNITS);
    (start / TEXEL_UNITS..end.div_ceil(TEXEL_UNITS)).map(move |texel| {
        let overlap = end.min((texel + 1) * TEXEL_UNITS) - start.max(texel * TEXEL_UNITS);
        (texel, overlap as i64)
    })
}

/// Exact area weights in linear light: integer sums, rounded once.
fn downsample(picture: &[u8]) -> Vec<[u8; 3]> {
    let table = srgb::table();
    let width = 1usize << BASE_WIDTH_LOG2;
    let area = (COVER_UNITS * COVER_UNITS) as i64;
    let mut texels = vec![[0; 3]; width * width / 2];
    texels.par_chunks_exact_mut(width).enumerate().for_each(|(row, line)| {
        for (column, texel) in line.iter_mut().enumerate() {
            // At most 2^24 * 675^2 < 2^43.
            let mut sum = [0i64; 3];
            for (y, rows) in cover(row) {
                for (x, columns) in cover(column) {
                    let at = (y * SOURCE_SIZE[0] + x) * 3;
                    for (sum, &byte) in sum.iter_mut().zip(&picture[at..at + 3]) {
                        *sum += i64::from(table.linear(byte)) * rows * columns;
                    }
                }
            }
            *texel = sum.map(|sum| table.encode(((sum + area / 2) / area) as i32));
        }
    });
    texels
}

/// Computes [`EarthBase::strength`]. The square roots of relative Haar coefficients are summed in cells and smoothed
/// twice with the weights 1-2-1 on both axes. The strength is the square of their mean.
fn strength(finest: &[[u8; 3]]) -> Vec<u32> {
    let cells = level_size(CELLS_LOG2).map(|side| side as usize);
    let roots: Vec<u64> = (0..cells[0] * cells[1])
        .into_par_iter()
        .map(|cell| {
            let block = |part: usize| {
                let (x, y) = (cell % cells[0] * 2 + part % 2, cell / cells[0] * 2 + part / 2);
                block_roots(finest, y * 2 * cells[0] + x)
            };
            (0..4).map(block).sum()
        })
        .collect();
    let squared = |&sum: &u64| {
        // The sum has 4 blocks of 3 coefficients, and each of the two smoothings multiplies it by 16. Values are at
        // most 2^20, so the square is at most 2^40.
        let mean = sum / (12 * 256);
        ((mean * mean / STRENGTH_ONE as u64) * ROOT_MEAN_TO_RMS_1024THS / 1024).min(MAX_STRENGTH) as u32
    };
    smooth(&smooth(&roots, cells), cells).iter().map(squared).collect()
}

/// Rec. 709 luminance of the four base texels of a block (north-west, north-east, south-west, south-east), in linear
/// light, in units of 2^-24.
fn luminances(finest: &[[u8; 3]], block: usize) -> [i64; 4] {
    let width = 1usize << BASE_WIDTH_LOG2;
    let at = block / (width / 2) * 2 * width + block % (width / 2) * 2;
    [at, at + 1, at + width, at + width + 1]
        .map(|child| luminance(finest[child].map(|byte| srgb::table().linear(byte))))
}

/// Rec. 709 luminance of linear light, in units of 2^-24. The weights are in units of 1/65536.
fn luminance(light: LinearLight) -> i64 {
    let [r, g, b] = light.map(i64::from);
    (13_933 * r + 46_871 * g + 4_732 * b) >> 16
}

/// Sum over a block's three Haar coefficients of the square root of |coefficient / mean|, in units of 2^-20.
fn block_roots(finest: &[[u8; 3]], block: usize) -> u64 {
    let [nw, ne, sw, se] = luminances(finest, block);
    let root = |difference: i64| {
        // Numerator and denominator are four times the coefficient and the mean. The ratio is at most 1 because light
        // is not negative. A black block gives 0.
        let square = (difference.unsigned_abs() << 36).checked_div((nw + ne + sw + se).unsigned_abs());
        (square.unwrap_or(0) << 4).isqrt()
    };
    root(ne + se - nw - sw) + root(sw + se - nw - ne) + root(nw + se - ne - sw)
}

/// The weights 1-2-1 on both axes, not divided by their sum of 16.
fn smooth(values: &[u64], cells: [usize; 2]) -> Vec<u64> {
    let size = cells.map(|side| side as u32);
    let weighted = |index: usize| {
        let mut sum = 0;
        for (dy, rows) in [(-1, 1), (0, 2), (1, 1)] {
            for (dx, columns) in [(-1, 1), (0, 2), (1, 1)] {
                let [x, y] = true_texel(size, (index % cells[0]) as i64 + dx, (index / cells[0]) as i64 + dy);
                sum += values[y as usize * cells[0] + x as usize] * rows * columns;
            }
        }
        sum
    };
    (0..values.len()).into_par_iter().map(weighted).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_picture_decodes_to_the_pinned_bytes() {
        let picture = decode().unwrap();
        assert_eq!(picture.len(), 5400 * 2700 * 3);
        assert_eq!(xxh3_64(&picture), SOURCE_HASH);
    }

    #[test]
    fn area_weights_cover_every_source_texel_exactly_once() {
        let mut covered = vec![0; 5400];
        for index in 0..4096 {
            assert_eq!(cover(index).map(|(_, units)| units).sum::<i64>(), 675, "base texel {index}");
            cover(index).for_each(|(texel, units)| covered[texel] += units);
        }
        assert!(covered.iter().all(|&units| units == 512));
    }

    #[test]
    fn the_base_is_pinned() {
        let base = base().unwrap();
        assert_eq!(xxh3_64(base.level(12).as_flattened()), 0x349d_fa16_447e_b8e7);
        assert_eq!(xxh3_64(base.level(5).as_flattened()), 0xaf87_afc4_c694_76d1);
        let strength: Vec<u8> = base.strength.iter().flat_map(|value| value.to_le_bytes()).collect();
        assert_eq!(xxh3_64(&strength), 0x61dc_20cd_3b72_f092);
        assert_eq!((base.level(1).len(), base.level(0).len()), (2, 1));
    }

    #[test]
    fn land_has_more_detail_than_the_open_sea() {
        let base = base().unwrap();
        let cell = |longitude: f64, latitude: f64| {
            let x = ((longitude + 180.0) / 360.0 * 1024.0) as usize;
            let y = ((90.0 - latitude) / 180.0 * 512.0) as usize;
            base.strength[y * 1024 + x]
        };
        let (andes, pacific) = (cell(-70.0, -16.0), cell(-140.0, -30.0));
        assert!(andes > 3 * pacific, "{andes} {pacific}");
    }
}
