//! Section 4 in f64: the picture that a settled frame must show. Every texel is read from the source, without borders
//! or caches.

use super::{PixelDerivatives, triple};
use crate::math::pyramid::{Pyramid, TileId};
use crate::picture::Picture;
use crate::reference::filter::{
    Edges, MipPyramid, Parallelogram, sample_count, srgb_to_linear, srgb8_to_linear,
};
use crate::reference::supersample::{RADIUS_PX, SIGMA_PX};
use crate::reference::{ReferenceView, Sample};
use crate::texture::source::{TileError, TileFormat, TileSource};
use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

/// How a pixel's colour is computed from its footprint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReferenceFilter {
    /// The paper's filter: at most this many trilinear samples along the footprint (NA).
    Samples(u32),
    /// Bilinear in the nearest level.
    NearerLevel,
    /// The mean over the pixel's footprint.
    Area,
    /// The mean weighted by [`PixelKernel::GAUSSIAN`](crate::reference::supersample::PixelKernel::GAUSSIAN).
    Gaussian,
}

/// Texels of all levels of a source, read tile by tile on demand. Tiles may be BC1; resident levels are RGBA8.
pub struct SourceTexels<'a> {
    source: &'a dyn TileSource,
    /// Tiles, and resident levels as tile (0, 0) of their level.
    tiles: RefCell<HashMap<TileId, Rc<[u8]>>>,
    /// The tile of the last texel. Most texels are in the tile of the texel before.
    last: RefCell<(Option<TileId>, Rc<[u8]>)>,
    /// The first tile that could not be read.
    failed: RefCell<Option<TileError>>,
    linear: [f64; 256],
}

impl<'a> SourceTexels<'a> {
    pub fn new(source: &'a dyn TileSource) -> SourceTexels<'a> {
        let linear = std::array::from_fn(|code| srgb8_to_linear(code as u8));
        SourceTexels {
            source,
            tiles: RefCell::default(),
            last: RefCell::default(),
            failed: RefCell::default(),
            linear,
        }
    }

    /// The source as a function of level and texel. A texel that cannot be read is black, and [`SourceTexels::picture`]
    /// then fails.
    pub fn texture(&self) -> MipPyramid<impl Fn(u32, u32, u32) -> [f64; 4] + '_> {
        let pyramid = self.source.pyramid();
        MipPyramid {
            width_log2: pyramid.width_log2(),
            height_log2: pyramid.height_log2(),
            edges: Edges::Planet,
            texel: move |level, x, y| self.texel(&pyramid, level, x, y),
        }
    }

    fn texel(&self, pyramid: &Pyramid, level: u32, x: u32, y: u32) -> [f64; 4] {
        let (texels, at) = if level >= pyramid.first_resident_level() {
            let whole = TileId { level, row: 0, column: 0 };
            let texels = self.stored(whole, || self.source.read_resident_level(level));
            (texels, y * pyramid.level_size(level)[0] + x)
        } else {
            let size = pyramid.tile_size();
            let tile = TileId { level, row: y / size, column: x / size };
            let format = self.source.format();
            let texels = self.stored(tile, || {
                let mut bytes = vec![0; format.tile_bytes(pyramid)];
                self.source.read_tile(tile, &mut bytes).map(|()| bytes)
            });
            let (stored, border) = (pyramid.stored_sides()[0], pyramid.border_texels());
            let at = [y % size + border, x % size + border];
            if format == TileFormat::Bc1 {
                let [r, g, b] = bc1_texel(&texels, stored, at).unwrap_or_default().map(srgb_to_linear);
                return [r, g, b, 1.0];
            }
            (texels, at[0] * stored + at[1])
        };
        match texels.get(4 * at as usize..4 * at as usize + 3) {
            Some(rgb) => [
                self.linear[rgb[0] as usize],
                self.linear[rgb[1] as usize],
                self.linear[rgb[2] as usize],
                1.0,
            ],
            None => [0.0, 0.0, 0.0, 1.0],
        }
    }

    /// The bytes of a tile, read if they have not been read before; empty if they cannot be read.
    fn stored(&self, tile: TileId, read: impl FnOnce() -> Result<Vec<u8>, TileError>) -> Rc<[u8]> {
        let mut last = self.last.borrow_mut();
        if last.0 != Some(tile) {
            let read = || match read() {
                Ok(bytes) => bytes.into(),
                Err(error) => {
                    self.failed.borrow_mut().get_or_insert(error);
                    Rc::default()
                }
            };
            *last = (Some(tile), self.tiles.borrow_mut().entry(tile).or_insert_with(read).clone());
        }
        last.1.clone()
    }

    /// The whole picture in linear light; the sky is black.
    ///
    /// # Errors
    /// The first tile that could not be read.
    pub fn picture(&self, view: &ReferenceView, filter: ReferenceFilter) -> Result<Picture, TileError> {
        let sky = [0.0, 0.0, 0.0, 1.0];
        let colour = |sample: Sample| self.pixel(&sample, filter).map(|channel| channel as f32);
        let pixels = view.samples().into_iter().map(|sample| sample.map_or(sky, colour)).collect();
        let [width, height] = view.size();
        self.check()?;
        Ok(Picture::new(width, height, pixels))
    }

    /// Checks that all texels so far could be read.
    ///
    /// # Errors
    /// The first tile that could not be read.
    pub fn check(&self) -> Result<(), TileError> {
        self.failed.take().map_or(Ok(()), Err)
    }

    /// The linear colour of one pixel.
    pub fn pixel(&self, sample: &Sample, filter: ReferenceFilter) -> [f64; 4] {
        let (texture, pyramid) = (self.texture(), self.source.pyramid());
        let footprint = footprint(sample);
        let sides = sides(sample, &pyramid);
        let [longest, shortest] = sides.lengths();
        let found = triple(&footprint, &pyramid, 1);
        let (s, t) = (sample.s, sample.t);
        match filter {
            // If the footprint is not finite, stage 1 stores the finest resident level.
            _ if found.e.is_nan() => texture.trilinear(f64::from(found.q), s, t),
            ReferenceFilter::Samples(max) => {
                texture.along(&sides, sample_count(longest, shortest, max), s, t)
            }
            ReferenceFilter::NearerLevel => {
                let level = (found.e + 0.5).floor().clamp(0.0, f64::from(texture.coarsest_level()));
                texture.bilinear(level as u32, s, t)
            }
            ReferenceFilter::Area => texture.area(&sides, s, t),
            ReferenceFilter::Gaussian => texture.gaussian(&sides, s, t, SIGMA_PX, RADIUS_PX),
        }
    }
}

/// The encoded sRGB colour (0.0 ..= 1.0) of one texel in a square of BC1 blocks, as the format is defined (Direct3D 11
/// functional specification, 19.5.10): two colours of 5, 6 and 5 bits, and 2 bits for each texel. In a block with three
/// colours, the fourth is black. `None` if the square is incomplete.
fn bc1_texel(blocks: &[u8], side: u32, [row, column]: [u32; 2]) -> Option<[f64; 3]> {
    let block = blocks.chunks_exact(8).nth((row / 4 * (side / 4) + column / 4) as usize)?;
    let ends = [0, 2].map(|at| u16::from_le_bytes([block[at], block[at + 1]]));
    let [from, to] = ends.map(|end| {
        let (r, g, b) = (end >> 11, end >> 5 & 63, end & 31);
        [f64::from(r) / 31.0, f64::from(g) / 63.0, f64::from(b) / 31.0]
    });
    let indices = u32::from_le_bytes([block[4], block[5], block[6], block[7]]);
    let index = indices >> (2 * (row % 4 * 4 + column % 4)) & 3;
    let share = match (ends[0] > ends[1], index) {
        (_, 0) => 0.0,
        (_, 1) => 1.0,
        (true, 2) => 1.0 / 3.0,
        (true, _) => 2.0 / 3.0,
        (false, 2) => 0.5,
        (false, _) => return Some([0.0; 3]),
    };
    Some([0, 1, 2].map(|channel| from[channel] * (1.0 - share) + to[channel] * share))
}

/// A sample's (s, t) and fine derivatives, the input of stage 1.
pub fn footprint(sample: &Sample) -> PixelDerivatives {
    let d = &sample.fine;
    PixelDerivatives { s: sample.s, t: sample.t, dsdx: d.dsdx, dtdx: d.dtdx, dsdy: d.dsdy, dtdy: d.dtdy }
}

/// A sample's footprint in texels of level 0.
pub fn sides(sample: &Sample, pyramid: &Pyramid) -> Parallelogram {
    sides_of(sample, pyramid.level_size(0))
}

/// A sample's footprint in texels of a texture with `size` texels.
pub fn sides_of(sample: &Sample, size: [u32; 2]) -> Parallelogram {
    let [w, h] = size.map(f64::from);
    let d = &sample.fine;
    Parallelogram { r1: [w * d.dsdx, h * d.dtdx], r2: [w * d.dsdy, h * d.dtdy] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bc1_block_has_four_colours_or_three_and_black() {
        // Red 31 and blue 31; the texels of the first row have the indices 0, 1, 2, 3.
        let (red, blue) = (31u16 << 11, 31u16);
        let row = |[a, b]: [u16; 2]| {
            let block = [&a.to_le_bytes()[..], &b.to_le_bytes(), &[0b1110_0100, 0, 0, 0]].concat();
            // The second of the four blocks of a square of 8 texels.
            let square = [[0; 8].to_vec(), block, [0; 16].to_vec()].concat();
            [4, 5, 6, 7].map(|column| bc1_texel(&square, 8, [0, column]).unwrap())
        };
        let third = 1.0 / 3.0;
        let four = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [2.0 * third, 0.0, third], [third, 0.0, 2.0 * third]];
        for (found, expected) in row([red, blue]).iter().zip(four) {
            assert!((0..3).all(|n| (found[n] - expected[n]).abs() < 1e-15), "{found:?} {expected:?}");
        }
        assert_eq!(row([blue, red]), [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.5, 0.0, 0.5], [0.0; 3]]);
        assert_eq!(bc1_texel(&[0; 24], 8, [4, 4]), None);
    }
}
