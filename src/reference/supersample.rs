//! The truth of texture filtering: each pixel's kernel over the textured surface, by stratified samples in
//! f64.
//!
//! The surface is a function from picture position to texture position. There is no Jacobian and no level, so
//! perspective, horizons and curvature are exact. The number of strata follows from the pixel's footprint.
//! Everything is computed twice from independent samples; half the difference estimates the truth's own
//! error.

use crate::math::splitmix::SplitMix64;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// The kernel around a pixel's centre in the picture plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PixelKernel {
    /// The pixel's own square.
    Box,
    /// `exp(-d^2 / (2 sigma^2))` of the distance d, 0 beyond `radius`; both in pixels.
    Gaussian { sigma: f64, radius: f64 },
}

/// A texture that repeats in both directions, bilinear between the texels of level 0.
pub struct Tiled {
    side: usize,
    values: Vec<f64>,
}

/// Sampling density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Density {
    /// Strata per texel, in each direction.
    pub per_texel: f64,
    /// Limits of the strata along one axis of a pixel's support.
    pub min: u32,
    pub max: u32,
}

/// A one-channel picture and its accuracy.
#[derive(Clone, Debug)]
pub struct Truth {
    pub size: [u32; 2],
    /// Row by row; 0 if the kernel covers none of the surface.
    pub values: Vec<f64>,
    /// The values of one of the two independent halves of the samples.
    pub of_one_half: Vec<f64>,
    /// True if the kernel lies wholly on the surface.
    pub whole: Vec<bool>,
    /// Squared error of each value, estimated from the independent halves.
    pub squared_errors: Vec<f64>,
    /// Largest number of samples of a pixel, and the mean.
    pub max_samples: u64,
    pub mean_samples: f64,
}

/// Standard deviation of [`PixelKernel::GAUSSIAN`] in pixels.
pub const SIGMA_PX: f64 = 0.5;
/// Radius of [`PixelKernel::GAUSSIAN`] in pixels.
pub const RADIUS_PX: f64 = 1.0;

impl PixelKernel {
    /// The kernel of paper 3's filter, the ellipse.
    pub const GAUSSIAN: PixelKernel = PixelKernel::Gaussian { sigma: SIGMA_PX, radius: RADIUS_PX };

    /// Maps a point of the square [-1, 1]^2 to an offset from the pixel's centre, so that equal areas have equal kernel
    /// weights. For the Gaussian, the concentric map (Shirley and Chiu, "A low distortion map between disk and square",
    /// 1997) maps the square to the unit disc and preserves areas up to a factor. The length of the offset is the
    /// radius of the disc that has the fraction rho^2 of the Gaussian's weight.
    fn place(self, a: f64, b: f64) -> [f64; 2] {
        let PixelKernel::Gaussian { sigma, radius } = self else { return [a / 2.0, b / 2.0] };
        let (rho, angle) = match (a, b) {
            (0.0, 0.0) => return [0.0; 2],
            _ if a.abs() > b.abs() => (a, FRAC_PI_4 * b / a),
            _ => (b, FRAC_PI_2 - FRAC_PI_4 * a / b),
        };
        let within = 1.0 - (-radius * radius / (2.0 * sigma * sigma)).exp();
        let distance = sigma * (-2.0 * (1.0 - rho * rho * within).ln()).sqrt() * rho.signum();
        [distance * angle.cos(), distance * angle.sin()]
    }

    /// Half the side of the square that contains the support.
    pub fn reach(self) -> f64 {
        match self {
            PixelKernel::Box => 0.5,
            PixelKernel::Gaussian { radius, .. } => radius,
        }
    }
}

impl Truth {
    /// The truth's own NMSE over the pixels for which `counts` is true.
    pub fn own_nmse_where(&self, counts: &[bool]) -> f64 {
        let sum = |of: &dyn Fn(usize) -> f64| (0..counts.len()).filter(|&n| counts[n]).map(of).sum::<f64>();
        let error = sum(&|n| self.squared_errors[n]);
        if error == 0.0 { 0.0 } else { error / sum(&|n| self.values[n].powi(2)) }
    }

    /// The truth's own NMSE over the pixels whose kernel lies wholly on the surface.
    pub fn own_nmse(&self) -> f64 {
        self.own_nmse_where(&self.whole)
    }
}

impl Tiled {
    /// `side` texels in each direction, row by row.
    pub fn new(side: u32, texels: &[u8]) -> Tiled {
        assert!(side.is_power_of_two() && texels.len() == (side * side) as usize, "{side} texels a side");
        Tiled { side: side as usize, values: texels.iter().map(|&byte| f64::from(byte) / 255.0).collect() }
    }

    /// The value at a position in texels; texel (0, 0) has its centre at (0.5, 0.5).
    pub fn at(&self, [u, v]: [f64; 2]) -> f64 {
        let (x, y) = (u - 0.5, v - 0.5);
        let (right, down) = (x - x.floor(), y - y.floor());
        let wrap = |n: f64| n.rem_euclid(self.side as f64) as usize % self.side;
        let (left, top) = (wrap(x.floor()), wrap(y.floor()));
        let (next, below) = ((left + 1) % self.side, (top + 1) % self.side);
        let texel = |column: usize, row: usize| self.values[row * self.side + column];
        let upper = texel(left, top) * (1.0 - right) + texel(next, top) * right;
        let lower = texel(left, below) * (1.0 - right) + texel(next, below) * right;
        upper * (1.0 - down) + lower * down
    }
}

impl Density {
    /// At least 2 x 32 x 32 samples per pixel. The truth's own NMSE is then about 1e-6; figures report it.
    pub const FINE: Density = Density { per_texel: 2.0, min: 32, max: 1024 };

    /// Strata along a side of the support that spans this many texels.
    fn strata(&self, texels: f64) -> u32 {
        let wanted = (self.per_texel * texels).ceil();
        // Off the surface, for instance beyond the horizon, the extent is infinite.
        if wanted.is_finite() { (wanted as u32).clamp(self.min, self.max) } else { self.max }
    }
}

/// Samples `surface` under `kernel` around each pixel's centre. `surface` maps a picture position (pixels
/// from the upper left corner) to a position of `texture`, or `None` off the surface.
pub fn supersample(
    size: [u32; 2],
    surface: impl Fn(f64, f64) -> Option<[f64; 2]> + Sync,
    texture: impl Fn([f64; 2]) -> f64 + Sync,
    kernel: PixelKernel,
    density: Density,
) -> Truth {
    let count = u64::from(size[0]) * u64::from(size[1]);
    let pixel = |n: u64| {
        let centre = [(n % u64::from(size[0])) as f64 + 0.5, (n / u64::from(size[0])) as f64 + 0.5];
        let strata = strata(&surface, kernel, density, centre);
        let half = |seed: u64| sampled(&surface, &texture, kernel, strata, centre, SplitMix64(seed ^ n << 1));
        (half(0), half(1 << 63), strata)
    };
    let halves: Vec<_> = (0..count).into_par_iter().map(pixel).collect();
    let samples = |[columns, rows]: [u32; 2]| 2 * u64::from(columns) * u64::from(rows);
    Truth {
        size,
        values: halves.iter().map(|(a, b, _)| (a.value + b.value) / 2.0).collect(),
        of_one_half: halves.iter().map(|(a, ..)| a.value).collect(),
        whole: halves.iter().map(|(a, b, _)| a.whole && b.whole).collect(),
        squared_errors: halves.iter().map(|(a, b, _)| ((a.value - b.value) / 2.0).powi(2)).collect(),
        max_samples: halves.iter().map(|(.., strata)| samples(*strata)).max().unwrap_or(0),
        mean_samples: halves.iter().map(|(.., strata)| samples(*strata) as f64).sum::<f64>() / count as f64,
    }
}

/// Columns and rows of strata: along each axis, they follow from the longest of the support's two edges and its middle
/// line, in texels.
fn strata(
    surface: &impl Fn(f64, f64) -> Option<[f64; 2]>,
    kernel: PixelKernel,
    density: Density,
    [x, y]: [f64; 2],
) -> [u32; 2] {
    let reach = kernel.reach();
    let length = |from: [f64; 2], to: [f64; 2]| {
        let (Some(a), Some(b)) = (surface(from[0], from[1]), surface(to[0], to[1])) else {
            return f64::INFINITY;
        };
        (a[0] - b[0]).hypot(a[1] - b[1])
    };
    let lines = [-reach, 0.0, reach];
    let across = lines.map(|d| length([x - reach, y + d], [x + reach, y + d]));
    let down = lines.map(|d| length([x + d, y - reach], [x + d, y + reach]));
    [across, down].map(|lengths| density.strata(lengths.into_iter().fold(0.0, f64::max)))
}

struct Sampled {
    value: f64,
    whole: bool,
}

fn sampled(
    surface: &impl Fn(f64, f64) -> Option<[f64; 2]>,
    texture: &impl Fn([f64; 2]) -> f64,
    kernel: PixelKernel,
    [columns, rows]: [u32; 2],
    [x, y]: [f64; 2],
    mut random: SplitMix64,
) -> Sampled {
    let mut unit = || random.unit();
    let (mut sum, mut seen) = (0.0, 0u32);
    for row in 0..rows {
        for column in 0..columns {
            let a = 2.0 * (f64::from(column) + unit()) / f64::from(columns) - 1.0;
            let b = 2.0 * (f64::from(row) + unit()) / f64::from(rows) - 1.0;
            let [dx, dy] = kernel.place(a, b);
            if let Some(place) = surface(x + dx, y + dy) {
                sum += texture(place);
                seen += 1;
            }
        }
    }
    let value = if seen > 0 { sum / f64::from(seen) } else { 0.0 };
    Sampled { value, whole: seen == rows * columns }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    /// Skewed, rotated and stretched.
    const J: [[f64; 2]; 2] = [[0.31, -0.12], [0.22, 0.45]];

    fn affine(x: f64, y: f64) -> Option<[f64; 2]> {
        Some([J[0][0] * x + J[0][1] * y, J[1][0] * x + J[1][1] * y])
    }

    const GAUSSIAN: PixelKernel = PixelKernel::Gaussian { sigma: 0.5, radius: 3.0 };

    #[test]
    fn a_constant_texture_is_that_constant_under_every_kernel() {
        for kernel in [PixelKernel::Box, GAUSSIAN] {
            let texture = Tiled::new(4, &[77; 16]);
            let truth = supersample([3, 2], affine, |at| texture.at(at), kernel, Density::FINE);
            assert!(truth.values.iter().all(|value| (value - 77.0 / 255.0).abs() < 1e-10), "{truth:?}");
        }
    }

    #[test]
    fn a_sinusoid_under_an_affine_map_is_attenuated_as_the_gaussian_predicts() {
        // exp(-2 pi^2 sigma^2 |J^T f|^2), f in cycles per texel.
        let f = [0.6, 0.9];
        let seen = [J[0][0] * f[0] + J[1][0] * f[1], J[0][1] * f[0] + J[1][1] * f[1]];
        let amplitude = (-2.0 * PI * PI * 0.25 * (seen[0] * seen[0] + seen[1] * seen[1])).exp();
        assert!((0.1..0.9).contains(&amplitude), "{amplitude}");
        let wave = |[u, v]: [f64; 2]| 0.5 + 0.5 * (TAU * (f[0] * u + f[1] * v)).cos();
        let density = Density { per_texel: 1.0, min: 128, max: 128 };
        let truth = supersample([4, 3], affine, wave, GAUSSIAN, density);
        for (n, value) in truth.values.iter().enumerate() {
            let [u, v] = affine((n % 4) as f64 + 0.5, (n / 4) as f64 + 0.5).unwrap();
            let expected = 0.5 + 0.5 * amplitude * (TAU * (f[0] * u + f[1] * v)).cos();
            assert!((value - expected).abs() < 2e-4, "{value}, not {expected}");
        }
    }

    #[test]
    fn an_impulse_spreads_by_the_covariance_of_kernel_and_texel() {
        // The covariance has two terms: sigma^2 J J^T of the kernel, and 1/6 on each axis of a bilinear texel.
        let sigma = 1.0;
        let kernel = PixelKernel::Gaussian { sigma, radius: 5.0 };
        let texture = Tiled::new(64, &Impulse::texels(64));
        let size = [48, 48];
        // The impulse is at the picture's middle.
        let around = |x: f64, y: f64| affine(x - 24.3, y - 23.8).map(|[u, v]| [u + 32.5, v + 32.5]);
        let density = Density { per_texel: 1.0, min: 48, max: 48 };
        let truth = supersample(size, around, |at| texture.at(at), kernel, density);
        let mut moments = [0.0; 3];
        let mut total = 0.0;
        for (n, value) in truth.values.iter().enumerate() {
            let [u, v] = around((n % 48) as f64 + 0.5, (n / 48) as f64 + 0.5).unwrap();
            let [du, dv] = [u - 32.5, v - 32.5];
            total += value;
            for (moment, product) in moments.iter_mut().zip([du * du, du * dv, dv * dv]) {
                *moment += value * product;
            }
        }
        let of_rows = |a: usize, b: usize| sigma * sigma * (J[a][0] * J[b][0] + J[a][1] * J[b][1]);
        let expected = [of_rows(0, 0) + 1.0 / 6.0, of_rows(0, 1), of_rows(1, 1) + 1.0 / 6.0];
        for (moment, expected) in moments.into_iter().zip(expected) {
            assert!((moment / total - expected).abs() < 0.01 * expected.abs().max(0.1), "{moments:?}");
        }
    }

    struct Impulse;
    impl Impulse {
        fn texels(side: usize) -> Vec<u8> {
            let mut texels = vec![0; side * side];
            texels[32 * side + 32] = 255;
            texels
        }
    }

    #[test]
    fn more_samples_lower_the_truths_own_error_which_matches_the_true_error() {
        let texels: Vec<u8> = (0..64 * 64).map(|n| (SplitMix64::nth(9, n) >> 56) as u8).collect();
        let texture = Tiled::new(64, &texels);
        let steep = |x: f64, y: f64| Some([3.0 * x, 11.0 * y]);
        let of = |per_axis: u32| {
            let density = Density { per_texel: 0.0, min: per_axis, max: per_axis };
            supersample([16, 16], steep, |at| texture.at(at), GAUSSIAN, density)
        };
        let (coarse, fine) = (of(12), of(96));
        let [own, of_fine] = [&coarse, &fine].map(Truth::own_nmse);
        assert!(of_fine < own / 30.0, "{of_fine} and {own}");
        let squares = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let true_nmse =
            squares(&coarse.values, &fine.values) / fine.values.iter().map(|v| v * v).sum::<f64>();
        assert!((0.5..2.0).contains(&(true_nmse / own)), "{true_nmse} and {own}");
    }

    #[test]
    fn pixels_partly_off_the_surface_are_marked_and_keep_the_visible_part() {
        let texture = Tiled::new(4, &[51; 16]);
        let half = |x: f64, y: f64| (x < 2.0).then_some([x, y]);
        let truth = supersample([4, 1], half, |at| texture.at(at), PixelKernel::Box, Density::FINE);
        assert_eq!(truth.whole, [true, true, false, false]);
        assert!((truth.values[1] - 0.2).abs() < 1e-10 && truth.values[3] == 0.0, "{:?}", truth.values);
    }

    #[test]
    fn the_truths_own_error_counts_only_pixels_wholly_on_the_surface() {
        let texels: Vec<u8> = (0..64 * 64).map(|n| (SplitMix64::nth(9, n) >> 56) as u8).collect();
        let texture = Tiled::new(64, &texels);
        // The second pixel is half beyond the surface, and its footprint is a hundred times as long.
        let edge = |x: f64, y: f64| (x < 1.5).then_some([if x < 1.0 { x } else { 100.0 * x }, y]);
        let density = Density { per_texel: 0.0, min: 8, max: 8 };
        let truth = supersample([2, 1], edge, |at| texture.at(at), PixelKernel::Box, density);
        let all = truth.own_nmse_where(&[true; 2]);
        assert!(truth.own_nmse() > 0.0 && all > 10.0 * truth.own_nmse(), "{all} {}", truth.own_nmse());
    }
}
