//! The real part of the Earth: Blue Marble imagery, 4096 x 2048 and coarser, and the strength of its finest
//! band, from which the synthetic detail takes its own.
//!
//! The shipped picture has 5400 x 2700 texels. 4096 x 2048 is the largest power of two that it can fill:
//! 8192 x 4096 would interpolate 5400 columns to 8192 and call the result imagery.

use super::super::border::true_texel;
use super::EarthError;
use crate::picture::srgb;
use rayon::prelude::*;
use std::sync::OnceLock;
use xxhash_rust::xxh3::xxh3_64;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// The widest level that is real imagery is 2^12 texels wide.
pub const BASE_WIDTH_LOG2: u32 = 12;

const SOURCE_SIZE: [usize; 2] = [5400, 2700];
/// xxh3 of the decoded picture, RGB rows from the north: the decoder's exact output is part of the source.
const SOURCE_HASH: u64 = 0x6daa_1a04_dcb8_db5f;
/// 5400/4096 = 2700/2048 = 675/512: a base texel covers 675 units of 1/512 source texel on each axis.
const COVER_UNITS: usize = 675;
const TEXEL_UNITS: usize = 512;

/// Strength cells: 1024 x 512, each 2 x 2 blocks of 2 x 2 base texels.
pub const CELLS_LOG2: u32 = 10;

/// A strength of 1: as much detail as light.
pub const STRENGTH_ONE: i64 = 1 << 20;

/// Linear light of one texel, in units of 2^-24.
pub type Linear = [i32; 3];

/// All real levels and the strength of the finest band.
pub struct Base {
    /// Entry 0 is 4096 x 2048, the last 1 x 1: sRGB bytes, rows from the north.
    levels: Vec<Vec<[u8; 3]>>,
    /// For each cell and channel, the root mean square of the Haar coefficients of 4096 x 2048 over that of the
    /// light itself; units of 1/[`STRENGTH_ONE`]. Relative, so that detail follows the light: beside snow a
    /// dark wood keeps dark detail.
    pub strength: Vec<[u32; 3]>,
}

/// The base, decoded on first use (about half a second on one core) and kept: 34 MB and 6 MB.
///
/// # Errors
/// [`EarthError::Picture`] if the built-in picture does not decode to the pinned bytes.
pub fn base() -> Result<&'static Base, EarthError> {
    static BASE: OnceLock<Result<Base, EarthError>> = OnceLock::new();
    BASE.get_or_init(Base::build).as_ref().map_err(Clone::clone)
}

impl Base {
    fn build() -> Result<Self, EarthError> {
        let finest = downsample(&decode()?);
        let strength = strength(&finest);
        let mut levels = vec![finest];
        for width_log2 in (0..BASE_WIDTH_LOG2).rev() {
            levels.push(mean_level(&levels[levels.len() - 1], width_log2));
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

/// Scalar code only: the same bytes on every machine.
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

/// The source texels under base texel `index` of one axis, and the share of each in units of 1/512 texel.
fn cover(index: usize) -> impl Iterator<Item = (usize, i64)> + Clone {
    let (start, end) = (index * COVER_UNITS, (index + 1) * COVER_UNITS);
    (start / TEXEL_UNITS..end.div_ceil(TEXEL_UNITS)).map(move |texel| {
        let overlap = end.min((texel + 1) * TEXEL_UNITS) - start.max(texel * TEXEL_UNITS);
        (texel, overlap as i64)
    })
}

/// Exact area weights in linear light: integer sums, one rounding.
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

/// The level of width `2^width_log2`: means of four stored texels in linear light. A level one texel high
/// meets its only row twice.
fn mean_level(finer: &[[u8; 3]], width_log2: u32) -> Vec<[u8; 3]> {
    let table = srgb::table();
    let [width, height] = level_size(width_log2).map(|side| side as usize);
    let [finer_width, finer_height] = level_size(width_log2 + 1).map(|side| side as usize);
    let texel = |index: usize| {
        let (x, y) = (index % width * 2, index / width * 2);
        let rows = [y, (y + 1).min(finer_height - 1)];
        let four =
            [0, 1, 2, 3].map(|corner: usize| finer[rows[corner >> 1] * finer_width + x + (corner & 1)]);
        std::array::from_fn(|channel| table.mean_of_four(four.map(|texel| texel[channel])))
    };
    (0..width * height).into_par_iter().map(texel).collect()
}

/// What the children of a texel with these eight neighbours differ by if the light is smooth: the Haar
/// coefficients (east-west, south-north, diagonal) of the quadratic whose means are the given texels
/// (average interpolation; Donoho, "Smooth wavelet decompositions with blocky coefficient kernels", 1993,
/// degree 2). Rounds towards zero, so that a picture mirrored or turned gives the mirrored result.
#[inline]
pub fn predicted(north: [i32; 3], [west, east]: [i32; 2], south: [i32; 3]) -> [i32; 3] {
    [(east - west) / 8, (south[1] - north[1]) / 8, ((south[2] - south[0]) - (north[2] - north[0])) / 64]
}

/// [`Base::strength`]: the energies of detail and of light, gathered in cells, smoothed twice by
/// 1-2-1 on both axes, then the root of their ratio.
fn strength(finest: &[[u8; 3]]) -> Vec<[u32; 3]> {
    let cells = level_size(CELLS_LOG2).map(|side| side as usize);
    let energies: Vec<Energies> = (0..cells[0] * cells[1])
        .into_par_iter()
        .map(|cell| {
            let mut sum = [[0; 3]; 2];
            for part in 0..4 {
                let (x, y) = (cell % cells[0] * 2 + part % 2, cell / cells[0] * 2 + part / 2);
                let block = block_energies(finest, y * 2 * cells[0] + x);
                for (sum, energy) in sum.as_flattened_mut().iter_mut().zip(block.as_flattened()) {
                    *sum += energy;
                }
            }
            sum
        })
        .collect();
    let ratio = |detail: u64, light: u64| {
        // 3 coefficients to a mean. 2^50 * 4 * 256 (two smoothings by 16) << 40 needs u128.
        let square = (u128::from(detail) << 40).checked_div(3 * u128::from(light)).unwrap_or(0);
        square.isqrt().min(STRENGTH_ONE as u128) as u32
    };
    smooth(&smooth(&energies, cells), cells)
        .iter()
        .map(|[detail, light]| std::array::from_fn(|channel| ratio(detail[channel], light[channel])))
        .collect()
}

/// Of detail and of light, for each channel.
type Energies = [[u64; 3]; 2];

/// The four base texels (north-west, north-east, south-west, south-east) of a block, in linear light.
fn children(finest: &[[u8; 3]], block: usize, channel: usize) -> [i32; 4] {
    let width = 1usize << BASE_WIDTH_LOG2;
    let at = block / (width / 2) * 2 * width + block % (width / 2) * 2;
    [at, at + 1, at + width, at + width + 1].map(|child| srgb::table().linear(finest[child][channel]))
}

fn block_energies(finest: &[[u8; 3]], block: usize) -> Energies {
    let square = |sum: i32| u64::from((sum / 4).unsigned_abs()).pow(2);
    let four = [0, 1, 2].map(|channel| children(finest, block, channel));
    let detail = four.map(|[nw, ne, sw, se]| {
        square(ne + se - nw - sw) + square(sw + se - nw - ne) + square(nw + se - ne - sw)
    });
    [detail, four.map(|four| square(four.iter().sum()))]
}

/// The weights 1-2-1 on both axes, not divided by their sum, 16.
fn smooth(energies: &[Energies], cells: [usize; 2]) -> Vec<Energies> {
    let size = cells.map(|side| side as u32);
    let weighted = |index: usize| {
        let mut sum = [[0; 3]; 2];
        for (dy, rows) in [(-1, 1), (0, 2), (1, 1)] {
            for (dx, columns) in [(-1, 1), (0, 2), (1, 1)] {
                let [x, y] = true_texel(size, (index % cells[0]) as i64 + dx, (index / cells[0]) as i64 + dy);
                let neighbour = energies[y as usize * cells[0] + x as usize];
                for (sum, energy) in sum.as_flattened_mut().iter_mut().zip(neighbour.as_flattened()) {
                    *sum += energy * rows * columns;
                }
            }
        }
        sum
    };
    (0..energies.len()).into_par_iter().map(weighted).collect()
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
        let strength: Vec<u8> =
            base.strength.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        assert_eq!(xxh3_64(&strength), 0x7822_1f3c_5484_b5f1);
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
        assert!(andes[1] > 3 * pacific[1], "{andes:?} {pacific:?}");
    }

    #[test]
    fn the_prediction_is_exact_for_light_that_rises_linearly() {
        // Means 8 x + 16 y: children lie a quarter texel off, at 2 and 4.
        let row = |y: i32| [-1, 0, 1].map(|x| 8 * x + 16 * y);
        let [west, _, east] = row(0);
        assert_eq!(predicted(row(-1), [west, east], row(1)), [2, 4, 0]);
    }
}
