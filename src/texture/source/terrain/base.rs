//! The finest ground computed directly from the heights (1024 x 1024 points, 100 m apart), and every coarser
//! level.

use super::ground::{Fields, Palette, second_parent};
use super::noise::octave;
use crate::math::relief::{AREA_M, relief};
use crate::picture::srgb::{self, LINEAR_ONE};
use crate::texture::coarser::coarser;
use rayon::prelude::*;
use std::sync::LazyLock;

/// The base is 2^10 texels wide and high.
pub const BASE_LOG2: u32 = 10;
const SIDE: usize = 1 << BASE_LOG2;
/// The noise's coarsest octave: 64 x 64 texels.
const NOISE_LOG2: u32 = 6;
/// Amplitude of an octave of noise relative to the one before.
pub const NOISE_FALL: f32 = 0.89;

/// Ground and colours.
pub struct TerrainBase {
    /// Ground of the level 2^10 x 2^10.
    pub ground: Vec<Fields>,
    /// Entry 0 is 2^10 x 2^10, the last 1 x 1: sRGB bytes, rows from the north.
    levels: Vec<Vec<[u8; 3]>>,
    pub palette: Palette,
}

static BASE: LazyLock<TerrainBase> = LazyLock::new(TerrainBase::build);

/// The base, computed on first use and kept.
pub fn base() -> &'static TerrainBase {
    &BASE
}

/// Metres between texels of the level `2^width_log2` wide.
pub fn texel_m(width_log2: u32) -> f32 {
    (AREA_M / f64::from(1u32 << width_log2)) as f32
}

/// Amplitude of the octave that a level adds.
pub fn noise_share(width_log2: u32) -> f32 {
    (NOISE_LOG2..width_log2).fold(0.4, |share, _| share * NOISE_FALL)
}

impl TerrainBase {
    fn build() -> TerrainBase {
        let palette = Palette::new();
        let ground = ground();
        let color = |ground: &Fields| texel(&palette, ground, texel_m(BASE_LOG2));
        let mut levels: Vec<Vec<[u8; 3]>> = vec![ground.par_iter().map(color).collect()];
        for width_log2 in (0..BASE_LOG2).rev() {
            levels.push(coarser(&levels[levels.len() - 1], [2 << width_log2; 2]));
        }
        TerrainBase { ground, levels, palette }
    }

    /// The stored bytes of a level `2^width_log2` texels wide.
    pub fn level(&self, width_log2: u32) -> &[[u8; 3]] {
        assert!(width_log2 <= BASE_LOG2, "level of width 2^{width_log2} is finer than the base");
        &self.levels[(BASE_LOG2 - width_log2) as usize]
    }
}

/// The colour bytes of a point, in a level with texels of `texel_m`.
pub fn texel(palette: &Palette, ground: &Fields, texel_m: f32) -> [u8; 3] {
    let table = srgb::table();
    palette.color(ground, texel_m).map(|channel| table.encode((channel * LINEAR_ONE as f32) as i32))
}

/// A square of numbers, rows from the north.
struct Grid(Vec<f32>);

impl Grid {
    fn of(value: impl Fn(usize, usize) -> f32 + Sync) -> Grid {
        Grid((0..SIDE * SIDE).into_par_iter().map(|index| value(index % SIDE, index / SIDE)).collect())
    }

    /// Clamps at the edges.
    fn at(&self, x: i64, y: i64) -> f32 {
        let inside = |at: i64| at.clamp(0, SIDE as i64 - 1) as usize;
        self.0[inside(y) * SIDE + inside(x)]
    }

    /// Approximately a Gaussian blur of standard deviation `step`, from 5 x 5 points `step` apart.
    fn blurred(&self, step: i64) -> Grid {
        const WEIGHTS: [f32; 5] = [0.0625, 0.25, 0.375, 0.25, 0.0625];
        let sum = |at: &dyn Fn(i64) -> f32| (0..5).map(|n| WEIGHTS[n as usize] * at((n - 2) * step)).sum();
        let rows = Grid::of(|x, y| sum(&|by| self.at(x as i64 + by, y as i64)));
        Grid::of(|x, y| sum(&|by| rows.at(x as i64, y as i64 + by)))
    }
}

/// The fields of every point, computed from heights, slopes and noise.
fn ground() -> Vec<Fields> {
    let spacing = AREA_M / SIDE as f64;
    let middle = (SIDE as f64 - 1.0) / 2.0;
    let relief = relief();
    let heights = Grid::of(|x, y| {
        relief.height_m((x as f64 - middle) * spacing, (middle - y as f64) * spacing, spacing) as f32
    });
    let near = heights.blurred(1);
    let wide = near.blurred(3);
    let valley = wide.blurred(10);
    let noise = noise();
    let place = |index: usize| {
        let (x, y) = ((index % SIDE) as i64, (index / SIDE) as i64);
        let height = heights.at(x, y);
        let run = 2.0 * spacing as f32;
        let east = (heights.at(x + 1, y) - heights.at(x - 1, y)) / run;
        let north = (heights.at(x, y - 1) - heights.at(x, y + 1)) / run;
        let steep = (east * east + north * north).sqrt();
        let crest = (height - near.at(x, y)) / 22.0 + (height - wide.at(x, y)) / 150.0;
        // -0.5 at the north edge, 0.5 at the south edge; the divide runs through the middle.
        let south = (y as f32 - middle as f32) / SIDE as f32;
        let wet = (0.62 + 3.2 * south + 0.25 * noise[index][0]).clamp(0.0, 1.0);
        let line_m = 5680.0 - 330.0 * wet - 260.0 * north / (1.0 + steep);
        let cold = ((height - line_m) / 300.0).min(1.9) - 4.2 * (steep - 0.55).max(0.0);
        let floor = (valley.at(x, y) - wide.at(x, y)) / 110.0;
        let ice =
            (floor - 0.3).min(0.9) - 5.0 * (steep - 0.26).max(0.0) - ((4650.0 - height) / 150.0).max(0.0);
        let [a, b] = noise[index];
        let (crest, cold, ice) = (crest.clamp(-1.0, 1.0), cold.max(-2.5), ice.clamp(-2.5, 1.5));
        [height, steep, crest, cold, ice, wet, a, b]
    };
    (0..SIDE * SIDE).into_par_iter().map(place).collect()
}

/// The sum of the octaves that the base can represent. Each octave is added to the interpolated sum of the coarser
/// ones.
fn noise() -> Vec<[f32; 2]> {
    let mut sum = vec![[0.0; 2]];
    for width_log2 in 1..=BASE_LOG2 {
        let side = 1usize << width_log2;
        let share = if width_log2 < NOISE_LOG2 { 0.0 } else { noise_share(width_log2) };
        let coarser = |x: usize, y: usize| {
            let value = |x: usize, y: usize| sum[y * (side / 2) + x];
            let [far_x, far_y] = [x, y].map(|at| second_parent(at, side / 2 - 1));
            std::array::from_fn(|n| {
                let row = |y: usize| 0.75 * value(x / 2, y)[n] + 0.25 * value(far_x, y)[n];
                0.75 * row(y / 2) + 0.25 * row(far_y)
            })
        };
        let finer = |index: usize| -> [f32; 2] {
            let (x, y) = (index % side, index / side);
            let (smooth, own): ([f32; 2], _) = (coarser(x, y), octave(width_log2, x as i32, y as i32));
            std::array::from_fn(|n| smooth[n] + share * own[n])
        };
        sum = (0..side * side).into_par_iter().map(finer).collect();
    }
    sum
}
