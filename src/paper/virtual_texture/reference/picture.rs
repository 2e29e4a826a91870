//! Section 4 in f64: the picture that a settled frame must show. Every texel is read from the source, without borders
//! or caches.

use super::{Footprint, triple};
use crate::math::pyramid::{Pyramid, TileId};
use crate::picture::Picture;
use crate::reference::filter::{Edges, Parallelogram, Texture, sample_count, srgb8_to_linear};
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
    /// The mean weighted by [`Kernel::GAUSSIAN`](crate::reference::supersample::Kernel::GAUSSIAN).
    Gaussian,
}

/// Texels of all levels of an RGBA8 source, read tile by tile on demand.
pub struct Texels<'a> {
    source: &'a dyn TileSource,
    tiles: RefCell<HashMap<TileId, Rc<[u8]>>>,
    levels: RefCell<HashMap<u32, Rc<[u8]>>>,
    /// The first tile that could not be read.
    failed: RefCell<Option<TileError>>,
    linear: [f64; 256],
}

impl<'a> Texels<'a> {
    pub fn new(source: &'a dyn TileSource) -> Texels<'a> {
        assert_eq!(
            source.format(),
            TileFormat::Rgba8,
            "{}: the reference reads RGBA8 only",
            source.describe()
        );
        let linear = std::array::from_fn(|code| srgb8_to_linear(code as u8));
        Texels {
            source,
            tiles: RefCell::default(),
            levels: RefCell::default(),
            failed: RefCell::default(),
            linear,
        }
    }

    /// The source as a function of level and texel. A texel that cannot be read is black, and [`Texels::picture`] then
    /// fails.
    pub fn texture(&self) -> Texture<impl Fn(u32, u32, u32) -> [f64; 4] + '_> {
        let pyramid = self.source.pyramid();
        Texture {
            width_log2: pyramid.width_log2(),
            height_log2: pyramid.height_log2(),
            edges: Edges::Planet,
            texel: move |level, x, y| self.texel(&pyramid, level, x, y),
        }
    }

    fn texel(&self, pyramid: &Pyramid, level: u32, x: u32, y: u32) -> [f64; 4] {
        let (texels, at) = if level >= pyramid.first_resident_level() {
            let mut levels = self.levels.borrow_mut();
            let read = || self.or_nothing(self.source.read_resident_level(level));
            (levels.entry(level).or_insert_with(read).clone(), y * pyramid.level_size(level)[0] + x)
        } else {
            let size = pyramid.tile_size();
            let tile = TileId { level, row: y / size, column: x / size };
            let mut tiles = self.tiles.borrow_mut();
            let read = || {
                let mut bytes = vec![0; pyramid.tile_bytes_rgba8()];
                self.or_nothing(self.source.read_tile(tile, &mut bytes).map(|()| bytes))
            };
            let (stored, border) = (pyramid.stored_sides()[0], pyramid.border_texels());
            let at = (y % size + border) * stored + x % size + border;
            (tiles.entry(tile).or_insert_with(read).clone(), at)
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

    fn or_nothing(&self, read: Result<Vec<u8>, TileError>) -> Rc<[u8]> {
        match read {
            Ok(bytes) => bytes.into(),
            Err(error) => {
                self.failed.borrow_mut().get_or_insert(error);
                Rc::default()
            }
        }
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
            // Not finite: stage 1 stores the finest resident level.
            _ if found.e.is_nan() => texture.trilinear(f64::from(found.q), s, t),
            ReferenceFilter::Samples(most) => {
                texture.along(&sides, sample_count(longest, shortest, most), s, t)
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

/// A sample's (s, t) and fine derivatives, the input of stage 1.
pub fn footprint(sample: &Sample) -> Footprint {
    let d = &sample.fine;
    Footprint { s: sample.s, t: sample.t, dsdx: d.dsdx, dtdx: d.dtdx, dsdy: d.dsdy, dtdy: d.dtdy }
}

/// A sample's footprint in texels of level 0.
pub fn sides(sample: &Sample, pyramid: &Pyramid) -> Parallelogram {
    sides_of(sample, pyramid.level_size(0))
}

/// The same in a texture of `size` texels.
pub fn sides_of(sample: &Sample, size: [u32; 2]) -> Parallelogram {
    let [w, h] = size.map(f64::from);
    let d = &sample.fine;
    Parallelogram { r1: [w * d.dsdx, h * d.dtdx], r2: [w * d.dsdy, h * d.dtdy] }
}
