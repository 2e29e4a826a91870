//! The heights of the scene `valley`: Mount Everest and 50 km around it.
//!
//! The heights are real down to a 30" grid (scenes/everest.NOTICE), about 900 m between samples, interpolated by
//! Catmull-Rom cubics. Everything finer is **synthetic, for appearance only**. Ridges are raised and valleys deepened
//! by a fraction of the difference from a blurred surface, because a mean over 900 m is smoother than a mountain.
//! `gullies`, with wavelengths from 2.4 km down to 75 m, follow the slopes and are higher on steep ground. Where the
//! samples are too smooth, mostly in Nepal, whose source maps have few contour lines, `ridges` are added. One area is
//! level ([`PLAIN_M`]). Of the figures, scene.filters and pm.texture use this surface. The model `everest`
//! has only the samples.
//!
//! The model `valley` is a mesh of this surface; the texture `terrain` colours the ground by its heights and slopes.
//! The computation uses only +, -, x, / and square roots, so the bits are the same on every machine.

mod gullies;
mod ridges;

use crate::math::mix::mix;
use std::sync::LazyLock;

const PICTURE: &[u8] = include_bytes!("../../../scenes/everest.png");
/// Samples per side; the middle one is the summit.
pub const SIDE: u32 = 129;
/// 30" on a sphere of 6371 km: along the meridian, and along the parallel at 27.9875 degrees.
pub const NORTH_M: f64 = 926.6;
pub const EAST_M: f64 = 818.2;

/// Side of the square around the summit that a texture covers. The square ends about 1.4 samples inside the grid's east
/// and west edges.
pub const AREA_M: f64 = 102_400.0;

/// Unsharp masking: the fraction of the difference from a blurred surface that is added to the heights.
const SHARPEN: f64 = 0.55;

/// Approximate roughness of the samples north of the divide: the mean absolute difference between a sample and the mean
/// around it.
const ROUGH_M: f64 = 90.0;
/// Height of the synthetic ridges where the samples are too smooth.
const RIDGE_M: f64 = 2400.0;

/// The bed of a dry lake, synthetic as well: level ground for objects of a scene. Its middle in metres east and north
/// of the summit, and its height above the sea. The ground is level within the first radius and unchanged beyond the
/// second.
pub const PLAIN_M: [f64; 3] = [-16_800.0, -4600.0, 4150.0];
const PLAIN_RADII_M: [f64; 2] = [1900.0, 3900.0];

/// The real samples, and each one's height above its surroundings.
pub struct TerrainRelief {
    /// Metres, rows from the north.
    pub samples: Vec<f64>,
    /// A sample minus the 3 x 3 mean with weights 1-2-1.
    above: Vec<f64>,
    /// 0 where the samples are as rough as mountains, 1 where they are smooth.
    lacking: Vec<f64>,
}

/// A height with its slopes towards east and north.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slope {
    pub height: f64,
    pub east: f64,
    pub north: f64,
}

static RELIEF: LazyLock<TerrainRelief> = LazyLock::new(|| {
    let samples = decode().expect("a test checks that the shipped picture decodes");
    let above = above(&samples);
    let lacking = lacking(&above);
    TerrainRelief { samples, above, lacking }
});

/// The shipped heights, decoded on first use.
pub fn relief() -> &'static TerrainRelief {
    &RELIEF
}

/// Metres, rows from the north.
fn decode() -> Result<Vec<f64>, png::DecodingError> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(PICTURE)).read_info()?;
    let mut samples = vec![0; 2 * (SIDE * SIDE) as usize];
    reader.next_frame(&mut samples)?;
    Ok(samples.chunks_exact(2).map(|pair| f64::from(u16::from_be_bytes([pair[0], pair[1]]))).collect())
}

fn above(samples: &[f64]) -> Vec<f64> {
    let side = i64::from(SIDE);
    let at = |x: i64, y: i64| samples[(y.clamp(0, side - 1) * side + x.clamp(0, side - 1)) as usize];
    let row = |x: i64, y: i64| (at(x - 1, y) + 2.0 * at(x, y) + at(x + 1, y)) / 4.0;
    let mean = |x: i64, y: i64| (row(x, y - 1) + 2.0 * row(x, y) + row(x, y + 1)) / 4.0;
    (0..side * side).map(|index| at(index % side, index / side) - mean(index % side, index / side)).collect()
}

/// 0 for rough ground, 1 for smooth: 1.25 minus the 9 x 9 mean of |[`TerrainRelief::above`]| in units of [`ROUGH_M`],
/// clamped to 0 ..= 1.
fn lacking(above: &[f64]) -> Vec<f64> {
    let side = i64::from(SIDE);
    let at = |x: i64, y: i64| above[(y.clamp(0, side - 1) * side + x.clamp(0, side - 1)) as usize];
    let value = |index: i64| {
        let around = (-4..=4).flat_map(|j| (-4..=4).map(move |i| (index % side + i, index / side + j)));
        // A single summit on a smooth slope does not count as rough ground.
        let mean = around.map(|(x, y)| at(x, y).abs().min(2.0 * ROUGH_M)).sum::<f64>() / 81.0;
        (1.25 - mean / ROUGH_M).clamp(0.0, 1.0)
    };
    (0..side * side).map(value).collect()
}

/// Weights of four samples for the interpolated value, and for its derivative, at `t` between the middle two (E.
/// Catmull and R. Rom, "A Class of Local Interpolating Splines", Computer Aided Geometric Design, 1974).
fn cubic(t: f64) -> ([f64; 4], [f64; 4]) {
    let (t2, t3) = (t * t, t * t * t);
    let value = [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ];
    let slope = [
        0.5 * (-3.0 * t2 + 4.0 * t - 1.0),
        0.5 * (9.0 * t2 - 10.0 * t),
        0.5 * (-9.0 * t2 + 8.0 * t + 1.0),
        0.5 * (3.0 * t2 - 2.0 * t),
    ];
    (value, slope)
}

impl TerrainRelief {
    /// The smooth surface through one of the grids, in metres east and north of the summit; constant beyond
    /// the last sample.
    fn through(samples: &[f64], east_m: f64, north_m: f64) -> Slope {
        let last = i64::from(SIDE) - 1;
        let middle = f64::from(SIDE / 2);
        let column = (middle + east_m / EAST_M).clamp(0.0, last as f64);
        let row = (middle - north_m / NORTH_M).clamp(0.0, last as f64);
        let ((x, dx), (y, dy)) = (cubic(column - column.floor()), cubic(row - row.floor()));
        let (left, top) = (column.floor() as i64 - 1, row.floor() as i64 - 1);
        let (mut height, mut by_column, mut by_row) = (0.0, 0.0, 0.0);
        for j in 0..4 {
            let line = (top + j as i64).clamp(0, last) * i64::from(SIDE);
            let (mut value, mut slope) = (0.0, 0.0);
            for i in 0..4 {
                let sample = samples[(line + (left + i as i64).clamp(0, last)) as usize];
                value += sample * x[i];
                slope += sample * dx[i];
            }
            height += value * y[j];
            by_column += slope * y[j];
            by_row += value * dy[j];
        }
        Slope { height, east: by_column / EAST_M, north: -by_row / NORTH_M }
    }

    /// The real heights, interpolated.
    pub fn real(&self, east_m: f64, north_m: f64) -> Slope {
        TerrainRelief::through(&self.samples, east_m, north_m)
    }

    /// The displayed surface, in metres above the sea. Gullies narrower than two `finest_m` (the spacing of the
    /// caller's grid) are omitted.
    pub fn height_m(&self, east_m: f64, north_m: f64, finest_m: f64) -> f64 {
        let real = self.real(east_m, north_m);
        let ridge = TerrainRelief::through(&self.above, east_m, north_m);
        let lacking = TerrainRelief::through(&self.lacking, east_m, north_m).height.clamp(0.0, 1.0);
        // The added ridges are lower in the foothills.
        let high_m = RIDGE_M * lacking * ((real.height + 1200.0) / 5500.0).clamp(0.0, 1.0);
        let more = ridges::ridges(east_m, north_m);
        let smooth = Slope {
            height: real.height + SHARPEN * ridge.height + high_m * more.height,
            east: real.east + SHARPEN * ridge.east + high_m * more.east,
            north: real.north + SHARPEN * ridge.north + high_m * more.north,
        };
        let height = smooth.height + gullies::height_m([east_m, north_m], &smooth, ridge.height, finest_m);
        height + (PLAIN_M[2] - height) * level(east_m, north_m)
    }
}

/// 1 on the plain, 0 far from it.
fn level(east_m: f64, north_m: f64) -> f64 {
    let [east, north] = [east_m - PLAIN_M[0], north_m - PLAIN_M[1]];
    let [level, far] = PLAIN_RADII_M;
    let t = ((far - (east * east + north * north).sqrt()) / (far - level)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// 32 pseudorandom bits of a cell.
fn hash(x: i32, y: i32, octave: u32) -> u32 {
    let cell = (x as u32)
        .wrapping_mul(0x9E37_79B1)
        .wrapping_add((y as u32).wrapping_mul(0x85EB_CA6B))
        .wrapping_add(octave.wrapping_mul(0x27D4_EB2F));
    mix(cell)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_real_surface_goes_through_every_sample_and_has_the_slopes_it_states() {
        let relief = relief();
        assert_eq!(relief.real(0.0, 0.0).height, 8752.0);
        for (column, row) in [(5, 9), (64, 63), (120, 20), (0, 128)] {
            let [east, north] = [(f64::from(column) - 64.0) * EAST_M, (64.0 - f64::from(row)) * NORTH_M];
            let sample = relief.samples[(row * SIDE + column) as usize];
            assert!((relief.real(east, north).height - sample).abs() < 1e-6, "{column} {row}");
        }
        for (east, north) in [(1234.5, -777.0), (-30_000.0, 12_345.0), (40_000.0, 41.0)] {
            let at = |e: f64, n: f64| relief.real(east + e, north + n).height;
            let slope = relief.real(east, north);
            assert!(((at(0.5, 0.0) - at(-0.5, 0.0)) - slope.east).abs() < 1e-5, "{slope:?}");
            assert!(((at(0.0, 0.5) - at(0.0, -0.5)) - slope.north).abs() < 1e-5, "{slope:?}");
        }
    }

    #[test]
    fn the_synthetic_part_is_bounded_and_has_no_spike() {
        let relief = relief();
        let (mut max, mut steepest, mut squares) = (0.0f64, 0.0f64, 0.0);
        for n in 0..40_000 {
            let [east, north] = [f64::from(n % 200), f64::from(n / 200)].map(|at| (at - 99.5) * 500.0);
            let height = relief.height_m(east, north, 200.0);
            let synthetic = height - relief.real(east, north).height;
            max = max.max(synthetic.abs());
            squares += synthetic * synthetic;
            steepest = steepest.max((relief.height_m(east + 50.0, north, 200.0) - height).abs() / 50.0);
        }
        let rms = f64::sqrt(squares / 40_000.0);
        println!("synthetic: at most {max} m, rms {rms} m; steepest {steepest}");
        // The synthetic part changes heights by more than a kilometre where the samples are smooth. The steepest of the
        // 40 000 points lie on cliffs of 79 degrees.
        assert!(max < 1600.0 && (200.0..550.0).contains(&rms), "{max} {rms}");
        assert!(steepest < 6.0, "{steepest}");
    }

    #[test]
    fn the_plain_is_level() {
        let [east, north, height] = PLAIN_M;
        for n in 0..400 {
            let [x, y] = [f64::from(n % 20), f64::from(n / 20)].map(|at| (at - 9.5) * 140.0);
            assert_eq!(relief().height_m(east + x, north + y, 100.0), height, "{x} {y}");
        }
    }

    /// Models and textures depend on these heights: a change must be noticed.
    #[test]
    fn heights_are_pinned() {
        let places = [(0.0, 0.0), (-12_345.0, 6_789.0), (30_000.0, -45_000.0)];
        let found = places.map(|(east, north)| relief().height_m(east, north, 100.0).to_bits());
        let pinned = [0x40c1_8040_ef2f_350e, 0x40b6_5ab5_0864_5fa7, 0x4093_0f20_eaf6_6cbe];
        assert_eq!(found, pinned, "{found:#x?}");
    }
}
