//! Texture coordinates over a polygon and their derivatives: formulas (7) to (9).
//!
//! A plane maps pixel centres to texels by a homography, `u = (A x + B y + C)/(G x + H y + I)` and `v = (D x + E y +
//! F)/(G x + H y + I)` (P. Heckbert, "Fundamentals of Texture Mapping and Image Warping", UCB/CSD 89/516, 1989). The
//! paper's modified form computes numerators and denominator along a row by additions. Formula (7) adds A, D and G for
//! each pixel. By formula (8), each of k threads adds k times these numbers. Two threads may also walk from both ends
//! of the row.
//!
//! Along a row the derivatives have the constant numerator `n_ux = (A I - C G) + (A H - B G) y` and the linear
//! numerator `n_uy = (B I - C H) + (B G - A H) x`. With the denominator `w`, forward differences are `du/dx = n_ux / (w
//! (w + G))` and `du/dy = n_uy / (w (w + H))`; for `v`, D, E, F replace A, B, C.
//!
//! Erratum: the thesis prints the denominator of `du/dx` in all four derivatives, and all four numerators as increments
//! along the row. Here each derivative has its own numerator and denominator. Difference from the paper: the fragments
//! of a row have no order, so the paper's fragment shader cannot have added from pixel to pixel. [`Form`] lists the
//! forms that a GPU can run. A fragment shader takes constants of the row (computed in f64, rounded to f32) and
//! computes each value with one fused multiply-add, or the rasteriser interpolates the values. In compute shaders,
//! threads walk rows ([`RowWalk`]). Threads compute the values of their first pixel by multiplication. We add walks
//! that restart from the row's constants, walks in integers, and analytic derivatives, whose denominator is `w^2`. We
//! also add threads that read their row's constants once and compute each of their pixels from these constants.
//!
//! [`reference`](mod@reference) has the formulas in f64, [`twin`] the GPU's forms in f32; [`pass`] runs
//! them.

pub mod pass;
pub mod reference;
pub mod twin;

use super::plane::{Tilt, TiltedPlane};
use crate::math::splitmix::SplitMix64;

/// Consecutive rows of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Band {
    /// Pixels per row, and number of rows.
    pub size: [u32; 2],
    pub first_row: u32,
}

/// How coordinates are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// The rasteriser interpolates u and v with perspective division.
    Varyings,
    /// The rasteriser interpolates u w, v w and w over the screen; the fragment shader divides.
    NoPerspective,
    /// Heckbert's nine coefficients in f32 in the fragment shader.
    Textbook,
    /// The fragment shader reads the row's constants from a buffer and computes each numerator and the denominator
    /// with one `fma`.
    RowConstants,
    /// As `RowConstants` in a compute shader: a thread reads its row's constants once and computes each of its pixels
    /// from these constants.
    RowConstantsBy(RowWalk),
    /// As `Textbook` in a compute shader: a thread first evaluates the terms that all pixels of its row share, and
    /// then adds each pixel's own term with one `fma`.
    TextbookBy(RowWalk),
    /// The threads of a compute shader walk along rows by additions in f32.
    Walk(RowWalk),
    /// As `Walk`, with 64-bit integers.
    Integer(RowWalk),
}

/// How threads share the pixels of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowWalk {
    /// Formula (7): one thread.
    Sequential,
    /// Two threads, from both ends to the middle.
    TwoEnds,
    /// Formula (8): this many threads. With n threads, each takes every n-th pixel.
    Lanes(u32),
    /// Each thread takes this many pixels and starts from the row's constants.
    Restart(u32),
}

/// How derivatives are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DerivativeMethod {
    /// Differences to the coordinates of the right and the lower pixel. The coordinates of all three pixels are
    /// computed from the nine coefficients.
    Differences,
    /// Numerators and denominators of formula (9) from the row's constants.
    Incremental,
    /// As `Incremental`, with the denominator w^2: the derivative at the pixel's centre.
    Analytic,
}

/// The set-up in f64, rounded to f32 for the GPU: numerators and denominator at the first pixel's centre, and their
/// steps from pixel to pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowConstants {
    /// (u w, v w, w).
    pub start: [f64; 3],
    /// (A, D, G).
    pub step: [f64; 3],
    /// Numerators of du/dx and dv/dx.
    pub dx: [f64; 2],
    /// Numerators of du/dy and dv/dy at the first pixel's centre, and their steps.
    pub dy: [f64; 2],
    pub dy_step: [f64; 2],
    /// H, the step of w to the next row.
    pub step_y: f64,
}

impl Form {
    /// All forms that the figures measure.
    pub const ALL: [Form; 20] = [
        Form::Varyings,
        Form::NoPerspective,
        Form::Textbook,
        Form::TextbookBy(RowWalk::Lanes(32)),
        Form::TextbookBy(RowWalk::Restart(64)),
        Form::RowConstants,
        Form::RowConstantsBy(RowWalk::Lanes(32)),
        Form::RowConstantsBy(RowWalk::Restart(64)),
        Form::Walk(RowWalk::Sequential),
        Form::Walk(RowWalk::TwoEnds),
        Form::Walk(RowWalk::Lanes(8)),
        Form::Walk(RowWalk::Lanes(32)),
        Form::Walk(RowWalk::Lanes(128)),
        Form::Walk(RowWalk::Lanes(1024)),
        Form::Walk(RowWalk::Restart(1)),
        Form::Walk(RowWalk::Restart(8)),
        Form::Walk(RowWalk::Restart(16)),
        Form::Walk(RowWalk::Restart(64)),
        Form::Walk(RowWalk::Restart(256)),
        Form::Integer(RowWalk::Lanes(32)),
    ];

    /// The name in figures and on the command line.
    pub fn name(self) -> String {
        match self {
            Form::Varyings => "hardware varyings".into(),
            Form::NoPerspective => "noperspective".into(),
            Form::Textbook => "textbook".into(),
            Form::RowConstants => "row constants".into(),
            Form::RowConstantsBy(walk) => format!("row constants, {}", walk.share()),
            Form::TextbookBy(walk) => format!("textbook, {}", walk.share()),
            Form::Walk(walk) => walk.name(),
            Form::Integer(walk) => format!("integers, {}", walk.name()),
        }
    }

    /// Counts for a picture of `size` pixels, equal on every device: the invocations that have pixels, and the bytes of
    /// the rows' constants that these invocations read for coordinates.
    pub fn invocations_and_bytes(self, size: [u32; 2]) -> [u64; 2] {
        // Bytes that a thread reads: the numerators and the denominator at the row's first pixel in f32. An integer
        // form reads these terms and their steps as 64-bit integers.
        const START: u64 = 3 * 4;
        const INTEGERS: u64 = 2 * 3 * 8;
        let [width, height] = size;
        let threads = |walk: RowWalk| {
            let has_pixels = |lane: &u32| walk.columns(*lane, width).2 > 0;
            (0..walk.lanes(width)).filter(has_pixels).count() as u64 * u64::from(height)
        };
        let (invocations, bytes) = match self {
            Form::Varyings | Form::NoPerspective | Form::Textbook => (threads(RowWalk::Restart(1)), 0),
            Form::TextbookBy(walk) => (threads(walk), 0),
            Form::RowConstants => (threads(RowWalk::Restart(1)), START),
            Form::RowConstantsBy(walk) | Form::Walk(walk) => (threads(walk), START),
            Form::Integer(walk) => (threads(walk), INTEGERS),
        };
        [invocations, invocations * bytes]
    }
}

impl RowWalk {
    fn name(self) -> String {
        match self {
            RowWalk::Sequential => "sequential".into(),
            RowWalk::TwoEnds => "two ends".into(),
            RowWalk::Lanes(lanes) => format!("{lanes} lanes"),
            RowWalk::Restart(1) => "compute, row constants".into(),
            RowWalk::Restart(pixels) => format!("restart {pixels}"),
        }
    }

    /// The name of a thread's share of a row, for threads that do not add from pixel to pixel.
    fn share(self) -> String {
        match self {
            RowWalk::Restart(pixels) => format!("runs of {pixels}"),
            other => other.name(),
        }
    }

    /// Threads per row.
    pub fn lanes(self, width: u32) -> u32 {
        match self {
            RowWalk::Sequential => 1,
            RowWalk::TwoEnds => 2,
            RowWalk::Lanes(lanes) => lanes,
            RowWalk::Restart(pixels) => width.div_ceil(pixels),
        }
    }

    /// A thread's columns in walking order: first column, stride and count.
    pub fn columns(self, lane: u32, width: u32) -> (u32, i32, u32) {
        let lanes = self.lanes(width);
        let share = (width + lanes - 1).saturating_sub(lane) / lanes;
        match self {
            RowWalk::Sequential | RowWalk::Lanes(_) => (lane, lanes as i32, share),
            RowWalk::TwoEnds => (lane * (width - 1), 1 - 2 * lane as i32, share),
            RowWalk::Restart(pixels) => (lane * pixels, 1, pixels.min(width - lane * pixels)),
        }
    }
}

impl DerivativeMethod {
    pub const ALL: [DerivativeMethod; 3] =
        [DerivativeMethod::Differences, DerivativeMethod::Incremental, DerivativeMethod::Analytic];

    /// The name in figures.
    pub fn name(self) -> &'static str {
        match self {
            DerivativeMethod::Differences => "differences",
            DerivativeMethod::Incremental => "incremental",
            DerivativeMethod::Analytic => "analytic",
        }
    }
}

/// Planes whose pixel coordinates start at the picture's upper left corner.
impl TiltedPlane {
    /// A tilted and rolled plane with a vertical field of view of 10 degrees, scaled and moved so that the
    /// picture shows at most `0..=texels`.
    pub fn tilted(size: [u32; 2], tilt_degrees: f64, roll_degrees: f64, texels: f64) -> TiltedPlane {
        let tilt = Tilt { roll_degrees, half_view_degrees: 5.0, ..Tilt::of(tilt_degrees) };
        let [x, y] = size.map(|side| 0.5 * f64::from(side));
        let moved = tilt.plane(size[1]).shifted([-x, -y]);
        moved.fitted(size, |low, high| (texels / (high - low), low))
    }

    /// A random plane whose coordinates stay within `-texels..=texels` and whose w is in 0.1 ..= 1.9. At the
    /// picture's centre, w is 1.
    pub fn random(seed: u64, size: [u32; 2], texels: f64) -> TiltedPlane {
        let mut random = SplitMix64(seed);
        let mut unit = || 2.0 * random.unit() - 1.0;
        let mut row = |constant: Option<f64>, steepest: f64| {
            let [x, y] = [(); 2].map(|()| steepest * unit());
            let centre = constant.unwrap_or_else(&mut unit);
            let [width, height] = size.map(f64::from);
            [x / width, y / height, centre - 0.5 * (x + y)]
        };
        let plane = TiltedPlane([row(None, 2.0), row(None, 2.0), row(Some(1.0), 0.9)]);
        plane.fitted(size, |low, high| (texels / low.abs().max(high.abs()), 0.0))
    }

    /// A random plane and a row near its horizon, where w is 1/400 to 1/100 of its value at the
    /// picture's centre, and the larger coordinate reaches `texels`.
    pub fn near_horizon(seed: u64, size: [u32; 2], texels: f64) -> (TiltedPlane, u32) {
        let unit = |n| (SplitMix64::nth(seed, n) >> 11) as f64 / (1u64 << 53) as f64;
        let tilt =
            Tilt { yaw_degrees: 360.0 * unit(0), half_view_degrees: 30.0, ..Tilt::of(80.0 + 9.0 * unit(1)) };
        let [x, y] = size.map(|side| 0.5 * f64::from(side));
        let plane = tilt.plane(size[1]);
        let [_, h, i] = plane.0[2];
        let row = (y - i / h).ceil();
        // Turns the camera by less than a pixel, so that w is 1/200 at the row's middle, and varies by +-25 % along the
        // row.
        let centre = row + 0.5 - y;
        let rolled = TiltedPlane([plane.0[0], plane.0[1], [0.25 / 200.0 / x, h, 1.0 / 200.0 - h * centre]]);
        let ends = [-x, x].map(|x| reference::coordinates(&rolled, x, centre));
        let factor = texels / ends.iter().flatten().fold(0.0, |max: f64, value| max.max(value.abs()));
        let [u, v, w] = rolled.shifted([-x, -y]).0;
        (TiltedPlane([u.map(|c| c * factor), v.map(|c| c * factor), w]), row as u32)
    }

    /// Scales u and v by the same factor and moves them. For each of u and v, `place` computes
    /// (factor, origin) from the least and the greatest value in the picture; the smaller of the two factors is used.
    fn fitted(self, size: [u32; 2], place: impl Fn(f64, f64) -> (f64, f64)) -> TiltedPlane {
        let [width, height] = size.map(f64::from);
        let corners = [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]];
        let placed = [0, 1].map(|axis| {
            // A ratio of linear functions has its extremes at the corners.
            let values = corners.map(|[x, y]| reference::coordinates(&self, x, y)[axis]);
            place(
                values.iter().copied().fold(f64::INFINITY, f64::min),
                values.iter().copied().fold(-f64::INFINITY, f64::max),
            )
        });
        let factor = placed[0].0.min(placed[1].0);
        let w = self.0[2];
        let row = |axis: usize| {
            let moved = |c: usize| factor * (self.0[axis][c] - placed[axis].1 * w[c]);
            [moved(0), moved(1), moved(2)]
        };
        TiltedPlane([row(0), row(1), w])
    }

    /// The constants of a row of pixels, in f64.
    pub fn row_constants(&self, row: u32) -> RowConstants {
        let [[a, b, c], [d, e, f], [g, h, i]] = self.0;
        let (x, y) = (0.5, f64::from(row) + 0.5);
        RowConstants {
            start: self.0.map(|[by_x, by_y, constant]| by_x * x + by_y * y + constant),
            step: [a, d, g],
            dx: [(a * i - c * g) + (a * h - b * g) * y, (d * i - f * g) + (d * h - e * g) * y],
            dy: [(b * i - c * h) + (b * g - a * h) * x, (e * i - f * h) + (e * g - d * h) * x],
            dy_step: [b * g - a * h, e * g - d * h],
            step_y: h,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_share_a_row_without_gap_or_overlap() {
        let walks = [
            RowWalk::Sequential,
            RowWalk::TwoEnds,
            RowWalk::Lanes(8),
            RowWalk::Lanes(64),
            RowWalk::Restart(16),
        ];
        for (walk, width) in walks.into_iter().flat_map(|walk| [1, 7, 64, 1001].map(|width| (walk, width))) {
            let mut seen = vec![0; width as usize];
            for lane in 0..walk.lanes(width) {
                let (first, stride, count) = walk.columns(lane, width);
                (0..count as i32).for_each(|n| seen[(first as i32 + n * stride) as usize] += 1);
            }
            assert!(seen.iter().all(|&times| times == 1), "{walk:?}, {width}: {seen:?}");
        }
    }

    #[test]
    fn planes_have_their_documented_ranges() {
        let size = [1920, 1080];
        let at = |plane: &TiltedPlane, x, y| reference::coordinates(plane, x, y);
        for seed in 0..50 {
            let plane = TiltedPlane::random(seed, size, 8192.0);
            for corner in 0..4 {
                let [x, y] = [f64::from(corner & 1) * 1920.0, f64::from(corner >> 1) * 1080.0];
                assert!(at(&plane, x, y).iter().all(|texels| texels.abs() <= 8192.0001), "{seed}");
            }
        }
        for tilt in [0.0, 45.0, 84.0] {
            let plane = TiltedPlane::tilted(size, tilt, 20.0, 2048.0);
            let (low, high) = (at(&plane, 0.0, 0.0), at(&plane, 1920.0, 1080.0));
            assert!([low, high].iter().flatten().all(|texels| (-0.001..2048.001).contains(texels)), "{tilt}");
        }
        for seed in 0..50 {
            let (plane, row) = TiltedPlane::near_horizon(seed, size, 5e5);
            let ends = [0.5, 1919.5].map(|x| (at(&plane, x, f64::from(row) + 0.5), x));
            let largest = ends.iter().flat_map(|(ends, _)| ends).fold(0.0, |max: f64, t| max.max(t.abs()));
            assert!((largest / 5e5 - 1.0).abs() < 0.01, "{seed}: {largest}");
            let w = |x: f64, y: f64| plane.0[2][0] * x + plane.0[2][1] * y + plane.0[2][2];
            for (_, x) in ends {
                let share = w(x, f64::from(row) + 0.5) / w(960.0, 540.0);
                assert!((1.0 / 400.0..1.0 / 100.0).contains(&share), "{seed}: {share}");
            }
        }
        // Without tilt a pixel is a square.
        let [a, d] = TiltedPlane::tilted(size, 0.0, 20.0, 2048.0).jacobian(3.0, 4.0).map(|[x, _]| x);
        let [b, e] = TiltedPlane::tilted(size, 0.0, 20.0, 2048.0).jacobian(3.0, 4.0).map(|[_, y]| y);
        let (right_angle, sides) = (a * b + d * e, [a.hypot(d), b.hypot(e)]);
        assert!(right_angle.abs() < 1e-12 && (sides[0] - sides[1]).abs() < 1e-12, "{a} {b} {d} {e}");
    }
}
