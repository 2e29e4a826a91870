//! The truth of a virtual texture's filter: the mean of a level's luminance under a kernel around each pixel, in f64.

use crate::math::pyramid::Pyramid;
use crate::paper::virtual_texture::reference::picture::sides;
use crate::reference::Sample;
use crate::reference::filter::{Edges, MipPyramid, luminance, srgb8_to_linear};
use crate::reference::supersample::{Density, PixelKernel, Truth, supersample};
use crate::texture::source::TileSource;
use rayon::prelude::*;
use std::sync::OnceLock;

/// Texture coordinates at a position of the picture, in pixels from the upper left corner.
pub type CoordinateMap<'a> = dyn Fn(f64, f64) -> Option<[f64; 2]> + Sync + 'a;

/// A textured surface, seen in a picture.
pub struct TexturedView<'a> {
    pub source: &'a dyn TileSource,
    pub size: [u32; 2],
    /// The centre of each pixel.
    pub samples: &'a [Option<Sample>],
    pub surface: &'a CoordinateMap<'a>,
    /// Strata along each side of a pixel's kernel; each has two samples.
    pub strata: u32,
}

impl TexturedView<'_> {
    /// Each pixel has its own level: at the level of the foreground, the horizon would need thousands of tiles.
    pub fn truth(&self, kernel: PixelKernel) -> Truth {
        let (pyramid, [width, height]) = (self.source.pyramid(), self.size);
        let levels: Vec<Level<'_>> =
            (0..pyramid.first_resident_level()).map(|level| Level::new(self.source, level)).collect();
        let pixel = |n: u32| {
            let (x, y) = (n % width, n / width);
            // The kernels reach one pixel.
            let near = |at: u32, end: u32| at.saturating_sub(1)..(at + 2).min(end);
            let around = near(y, height).flat_map(|y| near(x, width).map(move |x| (y * width + x) as usize));
            let around = around.filter_map(|at| self.samples[at].as_ref());
            self.of_pixel(&levels[finest_needed(around, &pyramid) as usize], [x, y], kernel)
        };
        let pixels: Vec<Truth> = (0..width * height).into_par_iter().map(pixel).collect();
        Truth {
            size: self.size,
            values: pixels.iter().map(|pixel| pixel.values[0]).collect(),
            of_one_half: pixels.iter().map(|pixel| pixel.of_one_half[0]).collect(),
            whole: pixels.iter().map(|pixel| pixel.whole[0]).collect(),
            squared_errors: pixels.iter().map(|pixel| pixel.squared_errors[0]).collect(),
            max_samples: pixels.iter().map(|pixel| pixel.max_samples).max().unwrap_or(0),
            mean_samples: pixels.iter().map(|pixel| pixel.mean_samples).sum::<f64>() / pixels.len() as f64,
        }
    }

    fn of_pixel(&self, level: &Level<'_>, pixel: [u32; 2], kernel: PixelKernel) -> Truth {
        let (texture, [left, top]) = (level.texture(), pixel.map(f64::from));
        let [width, height] = self.source.pyramid().level_size(0).map(f64::from);
        let surface =
            |x: f64, y: f64| (self.surface)(x + left, y + top).map(|[s, t]| [s * width, t * height]);
        let texel = |[u, v]: [f64; 2]| texture.bilinear(level.level, u / width, v / height)[0];
        let density = Density { per_texel: 0.0, min: self.strata, max: self.strata };
        supersample([1, 1], surface, texel, kernel, density)
    }
}

/// The coarsest streamed level at which the shorter side of every footprint has at least 8 texels; 0 if there is none.
fn finest_needed<'a>(samples: impl Iterator<Item = &'a Sample>, pyramid: &Pyramid) -> u32 {
    let min = samples.map(|sample| sides(sample, pyramid).lengths()[1]).fold(f64::INFINITY, f64::min);
    ((min / 8.0).log2().floor().max(0.0) as u32).min(pyramid.first_resident_level() - 1)
}

/// A level of a tile source as luminance. Tiles are read on demand, from any thread.
struct Level<'a> {
    source: &'a dyn TileSource,
    level: u32,
    tiles: Vec<OnceLock<Vec<f32>>>,
    linear: [f64; 256],
}

impl<'a> Level<'a> {
    fn new(source: &'a dyn TileSource, level: u32) -> Level<'a> {
        let [columns, rows] = source.pyramid().tile_grid(level);
        let tiles = (0..columns * rows).map(|_| OnceLock::new()).collect();
        Level { source, level, tiles, linear: std::array::from_fn(|code| srgb8_to_linear(code as u8)) }
    }

    fn texture(&self) -> MipPyramid<impl Fn(u32, u32, u32) -> [f64; 4] + '_> {
        let pyramid = self.source.pyramid();
        let (size, [columns, _]) = (pyramid.tile_size(), pyramid.tile_grid(self.level));
        MipPyramid {
            width_log2: pyramid.width_log2(),
            height_log2: pyramid.height_log2(),
            edges: Edges::Planet,
            texel: move |_, x, y| {
                let (row, column) = (y / size, x / size);
                let tile =
                    self.tiles[(row * columns + column) as usize].get_or_init(|| self.tile(row, column));
                [f64::from(tile[((y % size) * size + x % size) as usize]), 0.0, 0.0, 1.0]
            },
        }
    }

    /// The texels of a tile without its border.
    fn tile(&self, row: u32, column: u32) -> Vec<f32> {
        let pyramid = self.source.pyramid();
        let mut bytes = vec![0; self.source.format().tile_bytes(&pyramid)];
        let tile = crate::math::pyramid::TileId { level: self.level, row, column };
        self.source.read_tile(tile, &mut bytes).expect("shipped scenes make their tiles");
        let (size, border) = (pyramid.tile_size(), pyramid.border_texels());
        let stored = pyramid.stored_sides()[0];
        let texel = |n: u32| {
            let at = 4 * ((n / size + border) * stored + n % size + border) as usize;
            luminance([0, 1, 2].map(|c| self.linear[usize::from(bytes[at + c])])) as f32
        };
        (0..size * size).map(texel).collect()
    }
}
