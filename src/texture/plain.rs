//! A picture as one image with its whole mip chain, for surfaces whose texture fits video memory.

use super::bake::{self, SourceError};
use super::coarser::coarser;
use super::source::earth::{self, EarthError};
use crate::picture::srgb;
use std::path::Path;
use thiserror::Error;

/// Maximum texels of level 0: 1 GiB as RGBA8, a third more with all levels.
const MAX_TEXELS: u64 = 1 << 28;

/// A picture that cannot be used as a plain texture.
#[derive(Debug, Error)]
pub enum PlainError {
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(transparent)]
    Earth(#[from] EarthError),
    #[error(
        "{path}: {width} x {height} texels are more than a plain texture holds (2^28); bake it and use it as a virtual \
         texture"
    )]
    Size { path: String, width: u32, height: u32 },
}

/// sRGB texels, RGBA8, rows from the north.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlainTexture {
    /// Texels of level 0.
    pub size: [u32; 2],
    /// Finest first; the last is one texel.
    pub levels: Vec<Vec<u8>>,
}

impl PlainTexture {
    /// Opens a PNG, JPEG or TIFF.
    ///
    /// # Errors
    /// The file is not such a picture, or is too large.
    pub fn open(path: &Path) -> Result<PlainTexture, PlainError> {
        let mut rows = bake::open_picture(path)?;
        let [width, height] = rows.size();
        if u64::from(width) * u64::from(height) > MAX_TEXELS {
            return Err(PlainError::Size { path: path.display().to_string(), width, height });
        }
        let row_bytes = 4 * width as usize;
        let mut texels = vec![0; row_bytes * height as usize];
        texels.chunks_exact_mut(row_bytes).try_for_each(|row| rows.next_row(row))?;
        Ok(PlainTexture::new([width, height], texels))
    }

    /// The shipped picture of the earth.
    ///
    /// # Errors
    /// If the shipped picture does not decode.
    pub fn earth() -> Result<PlainTexture, PlainError> {
        let (size, texels) = earth::finest_imagery()?;
        Ok(PlainTexture::new(size, texels.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect()))
    }

    /// One texel of grey albedo, in linear light.
    pub fn grey(albedo: f64) -> PlainTexture {
        let byte = srgb::from_linear_f64(albedo);
        PlainTexture::new([1, 1], vec![byte, byte, byte, 255])
    }

    /// Builds all coarser levels of sRGB texels (RGBA8).
    pub fn new(size: [u32; 2], texels: Vec<u8>) -> PlainTexture {
        assert_eq!(texels.len(), 4 * size[0] as usize * size[1] as usize, "bytes of {size:?}");
        let (mut levels, mut last) = (vec![texels], size);
        while last != [1, 1] {
            let finer = levels.last().expect("there is level 0").as_chunks::<4>().0;
            levels.push(coarser(finer, last).into_flattened());
            last = last.map(|side| (side / 2).max(1));
        }
        PlainTexture { size, levels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_halve_down_to_one_texel_and_keep_one_colour() {
        let texture = PlainTexture::new([5, 2], [9, 100, 200, 255].repeat(10));
        let texels: Vec<usize> = texture.levels.iter().map(|level| level.len() / 4).collect();
        assert_eq!(texels, [10, 2, 1]);
        assert!(texture.levels.iter().all(|level| level.chunks(4).all(|texel| texel == [9, 100, 200, 255])));
    }

    #[test]
    fn a_texel_is_the_mean_of_four_in_linear_light() {
        let texture =
            PlainTexture::new([2, 2], [[0, 0, 0, 255], [255; 4], [255; 4], [0, 0, 0, 255]].concat());
        let [r, ..] = texture.levels[1][..] else { panic!("one texel") };
        assert_eq!(r, srgb::from_linear_f64(0.5));
        assert_ne!(r, 128, "the mean of the bytes");
    }

    #[test]
    fn the_shipped_earth_decodes() {
        let earth = PlainTexture::earth().unwrap();
        assert_eq!(earth.size[0], 2 * earth.size[1]);
        assert_eq!(earth.levels.len() as u32, earth.size[0].ilog2() + 1);
    }
}
