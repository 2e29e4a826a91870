//! Relief: a height field below a polygon, and the tracing of view rays through it (step I of paper 3). [`parallax`]
//! filters it (step H).
//!
//! A relief has a height for each texel, repeats, and is bilinear between texels. A ray enters at the top plane and
//! descends. W. Donnelly ("Per-Pixel Displacement Mapping with Distance Functions", GPU Gems 2, chapter 8, 2005) stores
//! the distance from each cell to the nearest surface point in a 3-D map. A ray steps by this distance. The paper
//! refines the map: it counts only points that a view ray through the cell can hit. A ray that reaches a point `p`
//! unobstructed descends at least as steeply as the horizon behind `p`. So the refined distance is the least distance
//! from `p` to a surface point whose direction from `p` is at least that steep. The tracer does not change.
//!
//! Difference: the paper searches the unobstructed rays one by one; the horizon gives the same set without tracing.
//! Donnelly and the paper store the distance of a cell's centre, which may be too long elsewhere in the cell. [`maps`]
//! divides directions into sectors. It stores a lower bound for every point of the cell and every direction of a
//! sector, so a step by the map never passes the surface. If the bound is below the least step, [`trace`] takes the
//! least step and tests for a crossing.
//!
//! With exact distances, the refined ray is never behind Donnelly's. Let `d(t)` be Donnelly's distance at `t` along the
//! ray, `r(t) >= d(t)` the refined one, and `s` the least step. Donnelly's distance changes by at most the way that the
//! ray moves, so `t + max(d(t), s)` grows with t. If the refined ray is at `T >= t`, its next point is
//! `T + max(r(T), s) >= T + max(d(T), s) >= t + max(d(t), s)`, which is Donnelly's next point. A map with one distance
//! for each cell breaks the second inequality: at a cell's border the distance drops, above a flat floor by a layer's
//! thickness. A refined ray that is ahead by less than this drop, but already in the next cell, takes a step that ends
//! behind. No such map avoids this, because a safe distance of a cell cannot exceed the distance of the cell's nearest
//! point. So a single ray may take more steps; a test has an example.
//!
//! Also built: linear and binary search (F. Policarpo, M. Oliveira, J. Comba, "Real-Time Relief Mapping on Arbitrary
//! Polygonal Surfaces", I3D 2005); cone maps (J. Dummer, "Cone Step Mapping", 2006) and relaxed cone maps (F.
//! Policarpo, M. Oliveira, "Relaxed Cone Stepping for Relief Mapping", GPU Gems 3, chapter 18, 2007).
//! [`reference`](mod@reference) has the exact intersection, [`parallax_reference`] the filtering in f64.

pub mod maps;
pub mod parallax;
pub mod parallax_reference;
pub mod pass;
pub mod reference;
pub mod shipped;
pub mod surface;
pub mod trace;

use crate::math::splitmix::SplitMix64;

/// A height field of `side` x `side` texels that repeats. Lengths are in texels; texel (i, j) is at the position (i,
/// j).
#[derive(Clone, Debug, PartialEq)]
pub struct Relief {
    pub side: usize,
    /// Height of the top plane above the lowest height, which is 0.
    pub depth: f32,
    /// Row by row; 255 is the top plane.
    pub heights: Vec<u8>,
}

/// The reliefs of the figures, all generated. [`shipped`] has reliefs from pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReliefKind {
    /// Narrow deep joints between flat bricks.
    Bricks,
    /// Narrow pillars on a deep floor.
    Pillars,
    /// A stair with single high spikes.
    Spikes,
    /// Noise of four octaves.
    Rock,
}

impl ReliefKind {
    pub const ALL: [ReliefKind; 4] =
        [ReliefKind::Bricks, ReliefKind::Pillars, ReliefKind::Spikes, ReliefKind::Rock];

    pub fn name(self) -> &'static str {
        match self {
            ReliefKind::Bricks => "bricks",
            ReliefKind::Pillars => "pillars",
            ReliefKind::Spikes => "spikes",
            ReliefKind::Rock => "rock",
        }
    }

    /// The relief with this many texels a side, a power of two of at least 16. Its depth is a quarter of the side.
    pub fn relief(self, side: usize) -> Relief {
        assert!(side.is_power_of_two() && side >= 16, "a relief of {side} texels a side");
        let unit = side / 16;
        let height = |x: usize, y: usize| match self {
            ReliefKind::Bricks => {
                let row = y / (4 * unit);
                let shifted = (x + row % 2 * 4 * unit) % (8 * unit);
                let joint = shifted < unit || y % (4 * unit) < unit;
                if joint { 0 } else { 255 - (lattice(1, x, y, side) / 32) as u8 }
            }
            ReliefKind::Pillars => {
                let inside = |at: usize| at % (4 * unit) < 2 * unit;
                if inside(x) && inside(y) { 255 } else { 0 }
            }
            ReliefKind::Spikes => {
                let spike = x % (4 * unit) == unit && y % (4 * unit) == 2 * unit;
                if spike { 255 } else { (x / (4 * unit) * 51) as u8 }
            }
            ReliefKind::Rock => rock(x, y, side),
        };
        let heights = (0..side * side).map(|at| height(at % side, at / side)).collect();
        Relief { side, depth: side as f32 / 4.0, heights }
    }
}

/// A random number of 0 ..= 255 for each position; repeats with `period`.
fn lattice(seed: u64, x: usize, y: usize, period: usize) -> u32 {
    (SplitMix64::nth(seed, (y % period * period + x % period) as u64) >> 56) as u32
}

/// Value noise. The first octave has cells of an eighth of the side; each further octave halves cells and height.
fn rock(x: usize, y: usize, side: usize) -> u8 {
    let octave = |n: usize| {
        let cell = ((side / 8) >> n).max(1);
        let ([i, fx], [j, fy]) = ([x / cell, x % cell], [y / cell, y % cell]);
        let at = |a, b| f64::from(lattice(n as u64 + 7, i + a, j + b, side / cell));
        let smooth = |f: usize| {
            let t = f as f64 / cell as f64;
            t * t * (3.0 - 2.0 * t)
        };
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        mix(mix(at(0, 0), at(1, 0), smooth(fx)), mix(at(0, 1), at(1, 1), smooth(fx)), smooth(fy))
    };
    let sum: f64 = (0..4).map(|n| octave(n) * 0.5f64.powi(n as i32)).sum();
    (sum / 1.875) as u8
}

impl ReliefKind {
    /// sRGB colours that match the heights: fired clay and mortar, or stone that is darker in its hollows.
    pub fn picture(self, side: usize) -> Vec<[u8; 3]> {
        let relief = self.relief(side);
        let unit = side / 16;
        let texel = |at: usize| {
            let (x, y, height) = (at % side, at / side, f64::from(relief.heights[at]) / 255.0);
            let grain = f64::from(lattice(21, x, y, side)) / 255.0 - 0.5;
            let (colour, grains) = match self {
                ReliefKind::Bricks if relief.heights[at] == 0 => ([150.0, 143.0, 132.0], 26.0),
                ReliefKind::Bricks => {
                    let row = y / (4 * unit);
                    let brick = (x + row % 2 * 4 * unit) % side / (8 * unit);
                    let tone = f64::from(lattice(22, brick, row, 16)) / 255.0;
                    ([150.0 + 45.0 * tone, 68.0 + 26.0 * tone, 48.0 + 16.0 * tone], 22.0)
                }
                _ => ([62.0 + 128.0 * height, 58.0 + 118.0 * height, 54.0 + 98.0 * height], 18.0),
            };
            colour.map(|channel: f64| (channel + grains * grain).round() as u8)
        };
        (0..side * side).map(texel).collect()
    }
}

impl Relief {
    /// A texel's height in texels; coordinates wrap.
    pub fn texel(&self, i: i64, j: i64) -> f32 {
        let wrap = |at: i64| at.rem_euclid(self.side as i64) as usize;
        f32::from(self.heights[wrap(j) * self.side + wrap(i)]) * (self.depth / 255.0)
    }

    /// A random colour for each texel, from 0 to 1, independent of the heights.
    pub fn colours(&self) -> Vec<f32> {
        let texel = |at: u64| (SplitMix64::nth(41, at) >> 40) as f32 / (1 << 24) as f32;
        (0..self.heights.len() as u64).map(texel).collect()
    }

    /// Heights at the corners of the cell between texels (i, j) and (i + 1, j + 1).
    pub fn corners(&self, i: i64, j: i64) -> [f32; 4] {
        [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[a, b]| self.texel(i + a, j + b))
    }
}

/// A ray that starts at the top plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// x and y of the start.
    pub origin: [f32; 2],
    /// A unit vector with a negative z.
    pub direction: [f32; 3],
}

impl Ray {
    /// A ray that descends at `elevation` below the horizontal towards `azimuth`, both in degrees.
    pub fn towards(origin: [f32; 2], elevation: f64, azimuth: f64) -> Ray {
        let ((up, along), (y, x)) = (elevation.to_radians().sin_cos(), azimuth.to_radians().sin_cos());
        Ray { origin, direction: [along * x, along * y, -up].map(|c| c as f32) }
    }
}
