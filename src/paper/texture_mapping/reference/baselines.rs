//! Published filters, each written from its publication.

use super::FilteredTexel;
use crate::paper::texture_mapping::baselines::FilterBaseline;
use crate::paper::texture_mapping::method::PixelCentre;
use std::f64::consts::TAU;

/// A texture, and how a surface reads it.
pub struct Texture<'a> {
    /// The number of the level that has one texel.
    pub coarsest: u32,
    /// The value of a texel, 0 to 1, by level, column and row. Column and row may lie outside the level.
    pub texel: &'a dyn Fn(u32, i64, i64) -> f64,
    /// Maximum distance along an axis from the pixel's centre to a sample, in texels of the level. Samples farther away
    /// raise the level. For an ellipse: the maximum sum of its semi-axes.
    pub max_reach: f64,
    /// Error of the pixel's centre along each axis, in texels of level 0.
    pub place_error: f64,
    /// Error of a trilinear sample.
    pub sample_error: f64,
}

impl Texture<'_> {
    /// The level, raised for a footprint that reaches this many texels of level 0.
    fn raised(&self, level: f64, reach: f64) -> f64 {
        level.max((reach / self.max_reach).log2().ceil())
    }
}

/// The value of a pixel; `None` if only the device can compute it.
pub fn filtered(
    baseline: FilterBaseline,
    pixel: &PixelCentre,
    texture: &Texture<'_>,
    level: u32,
    frame: u32,
) -> Option<FilteredTexel> {
    let [[ux, uy], [vx, vy]] = pixel.jacobian;
    let (right, down) = ([ux, vx], [uy, vy]);
    let length = |[a, b]: [f64; 2]| a.hypot(b);
    let (longer, shorter) = if length(right) > length(down) { (right, down) } else { (down, right) };
    Some(match baseline {
        FilterBaseline::Hardware(_) => return None,
        FilterBaseline::Trilinear => {
            probes(pixel, texture, &[Probe { part: 0.0, weight: 1.0 }], [0.0; 2], length(longer).log2())
        }
        FilterBaseline::Anisotropic(max) => {
            let half = longer.map(|d| d / 2.0);
            around(length(longer) / length(shorter), |ratio| {
                let count = ratio.ceil().clamp(1.0, f64::from(max));
                let probe = |n: u32| Probe { part: 2.0 * (f64::from(n) + 0.5) / count - 1.0, weight: 1.0 };
                let all: Vec<Probe> = (0..count as u32).map(probe).collect();
                probes(pixel, texture, &all, half, (length(longer) / count).log2())
            })
        }
        FilterBaseline::Feline(max) => feline(pixel, texture, max),
        FilterBaseline::Mavridis(taps) => mavridis(pixel, texture, taps),
        FilterBaseline::Pbrt => pbrt(pixel, texture, longer, shorter),
        FilterBaseline::Stochastic(samples) => stochastic(pixel, texture, samples, level, frame),
        FilterBaseline::SummedArea => summed_area(pixel, texture),
    })
}

/// A trilinear sample at a position along a line, -1 to 1.
struct Probe {
    part: f64,
    weight: f64,
}

/// The bilinear value of a level at a position in texels of this level.
fn bilinear(texture: &Texture<'_>, level: u32, [u, v]: [f64; 2]) -> f64 {
    let (x, y) = (u - 0.5, v - 0.5);
    let (right, down) = (x - x.floor(), y - y.floor());
    let at = |i: i64, j: i64| (texture.texel)(level, x.floor() as i64 + i, y.floor() as i64 + j);
    let row = |j: i64| at(0, j) * (1.0 - right) + at(1, j) * right;
    row(0) * (1.0 - down) + row(1) * down
}

/// Weighted trilinear samples along the line of `reach` through the pixel's centre. A line that
/// reaches beyond [`Texture::max_reach`] raises the level.
fn probes(
    pixel: &PixelCentre,
    texture: &Texture<'_>,
    probes: &[Probe],
    reach: [f64; 2],
    level: f64,
) -> FilteredTexel {
    let coarsest = f64::from(texture.coarsest);
    let raised = texture.raised(level, reach[0].hypot(reach[1]));
    // Rounding decides on which side of 0 a level near 0 lies, unless the level was raised: a raised level is an exact
    // integer.
    let near_0 = raised == level && level.abs() < 2f64.powi(-16);
    let undecided = if near_0 { 4 * probes.len() as u32 } else { 0 };
    let level = raised.clamp(0.0, coarsest);
    let trilinear = |at: [f64; 2]| {
        let of = |level: f64| bilinear(texture, level as u32, at.map(|place| place / level.exp2()));
        let part = level - level.floor();
        of(level.floor()) * (1.0 - part) + of((level.floor() + 1.0).min(coarsest)) * part
    };
    let place = |probe: &Probe| [0, 1].map(|n| pixel.centre[n] + probe.part * reach[n]);
    let sum: f64 = probes.iter().map(|probe| probe.weight * trilinear(place(probe))).sum();
    let weights: f64 = probes.iter().map(|probe| probe.weight).sum();
    let texels_a_probe = if level > 0.0 && level < coarsest { 8 } else { 4 };
    let fetched = texels_a_probe * probes.len() as u32;
    FilteredTexel { value: sum / weights, slack: texture.sample_error, fetched, undecided, empty: false }
}

/// Semi-axes of the ellipse r <= 1 and the direction of the major one, by diagonalising `J J^T`.
fn axes(pixel: &PixelCentre) -> (f64, f64, [f64; 2]) {
    let [[ux, uy], [vx, vy]] = pixel.jacobian;
    let (a, b, c) = (ux * ux + uy * uy, ux * vx + uy * vy, vx * vx + vy * vy);
    let angle = 0.5 * (2.0 * b).atan2(a - c);
    let major = ((a + c) / 2.0 + ((a - c) / 2.0).hypot(b)).sqrt();
    (major, pixel.determinant.abs() / major, [angle.cos(), angle.sin()])
}

fn feline(pixel: &PixelCentre, texture: &Texture<'_>, max: u32) -> FilteredTexel {
    let (major, minor, direction) = axes(pixel);
    around(2.0 * major / minor - 1.0 + 0.5, |wanted| {
        let count = wanted.floor().clamp(1.0, f64::from(max));
        // If there are too few probes, each probe is widened to fill the gaps.
        let minor = minor.max(2.0 * major / (count + 1.0));
        let reach = (major - minor).max(0.0);
        let probe = |n: u32| {
            let part = if count > 1.0 { 2.0 * f64::from(n) / (count - 1.0) - 1.0 } else { 0.0 };
            Probe { part, weight: (-2.0 * (part * reach / major).powi(2)).exp() }
        };
        let all: Vec<Probe> = (0..count as u32).map(probe).collect();
        probes(pixel, texture, &all, direction.map(|d| d * reach), minor.log2())
    })
}

fn mavridis(pixel: &PixelCentre, texture: &Texture<'_>, taps: u32) -> FilteredTexel {
    let (major, minor, direction) = axes(pixel);
    let tap_length = 2.0 * major / f64::from(taps);
    let middle = |n: f64, count: f64| 2.0 * (n + 0.5) / count - 1.0;
    around(tap_length / minor, |wanted| {
        let samples = wanted.ceil().clamp(1.0, 16.0);
        let all: Vec<Probe> = (0..taps)
            .flat_map(|tap| (0..samples as u32).map(move |sample| (tap, sample)))
            .map(|(tap, sample)| Probe {
                part: middle(f64::from(tap) * samples + f64::from(sample), f64::from(taps) * samples),
                weight: (-2.0 * middle(f64::from(tap), f64::from(taps)).powi(2)).exp(),
            })
            .collect();
        let level = minor.max(tap_length / samples).log2();
        probes(pixel, texture, &all, direction.map(|d| d * major), level)
    })
}

/// The result of `of` at a ratio that the device knows only up to its rounding. Where this rounding decides between two
/// numbers of samples, both results are within the bounds.
fn around(ratio: f64, of: impl Fn(f64) -> FilteredTexel) -> FilteredTexel {
    let found = of(ratio);
    let near = (ratio - ratio.round()).abs() < 2f64.powi(-16) * ratio;
    if !near {
        return found;
    }
    // The two ratios lie on both sides of the integer, and `of` depends on the ratio only by the number of samples.
    let [less, more] = [-1.0, 1.0].map(|side| of(ratio * (1.0 + side * 2f64.powi(-16))));
    FilteredTexel {
        slack: found.slack + (more.value - less.value).abs(),
        undecided: less.undecided.max(more.undecided) + more.fetched.abs_diff(less.fetched),
        ..found
    }
}

fn pbrt(pixel: &PixelCentre, texture: &Texture<'_>, longer: [f64; 2], shorter: [f64; 2]) -> FilteredTexel {
    const MAX_RATIO: f64 = 8.0;
    let (major, minor) = (longer[0].hypot(longer[1]), shorter[0].hypot(shorter[1]));
    let widening = if minor * MAX_RATIO < major && minor > 0.0 { major / (minor * MAX_RATIO) } else { 1.0 };
    let shorter = shorter.map(|d| d * widening);
    let lod = (minor * widening).max(1e-30).log2();
    let lod = texture.raised(lod, major + minor * widening).clamp(0.0, f64::from(texture.coarsest));
    let finer = pbrt_level(pixel, texture, longer, shorter, lod as u32);
    let coarser = pbrt_level(pixel, texture, longer, shorter, lod as u32 + 1);
    let part = lod - lod.floor();
    FilteredTexel {
        value: finer.value * (1.0 - part) + coarser.value * part,
        // Error of the level's fraction in f32, in addition to the error of each level's value.
        slack: finer.slack + coarser.slack + 2f64.powi(-18),
        fetched: finer.fetched + coarser.fetched,
        undecided: finer.undecided + coarser.undecided,
        empty: false,
    }
}

fn pbrt_level(
    pixel: &PixelCentre,
    texture: &Texture<'_>,
    longer: [f64; 2],
    shorter: [f64; 2],
    level: u32,
) -> FilteredTexel {
    if level >= texture.coarsest {
        let value = (texture.texel)(texture.coarsest, 0, 0);
        return FilteredTexel { value, slack: 2f64.powi(-22), fetched: 1, ..FilteredTexel::default() };
    }
    let scale = f64::from(1u32 << level);
    let [u, v] = pixel.centre.map(|place| place / scale);
    let [[lx, ly], [sx, sy]] = [longer, shorter].map(|axis| axis.map(|d| d / scale));
    let (a, b, c) = (ly * ly + sy * sy + 1.0, -2.0 * (lx * ly + sx * sy), lx * lx + sx * sx + 1.0);
    let f = a * c - b * b / 4.0;
    let (width, height) = (c.sqrt() + 1.0, a.sqrt() + 1.0);
    let (mut sum, mut weights, mut slack) = (0.0, 0.0, 0.0);
    let (mut fetched, mut undecided) = (0, 0);
    // The quadratic form r2 cancels terms of up to a c / f, which multiplies the rounding error of r2 by a c / f. Two
    // neighbouring entries of the weight table differ by 2/127 in the exponent.
    let rounding = 2f64.powi(-21) * (a * c / f);
    // Both semi-axes are at least one texel, so that r2 has a slope of at most 2 per texel.
    let rounding = rounding + 3.0 * texture.place_error / scale;
    for row in (v - height).floor() as i64..=(v + height).floor() as i64 {
        for column in (u - width).floor() as i64..=(u + width).floor() as i64 {
            let (du, dv) = (column as f64 + 0.5 - u, row as f64 + 0.5 - v);
            let r2 = (a * du * du + b * du * dv + c * dv * dv) / f;
            let weight = |r2: f64| {
                if r2 >= 1.0 {
                    return 0.0;
                }
                let entry = (r2.max(0.0) * 128.0).floor().min(127.0);
                (-2.0 * entry / 127.0).exp() - (-2f64).exp()
            };
            let of = weight(r2);
            undecided += u32::from((r2 - 1.0).abs() < rounding);
            fetched += u32::from(r2 < 1.0);
            slack += (weight(r2 - rounding) - weight(r2 + rounding)).abs();
            sum += of * (texture.texel)(level, column, row);
            weights += of;
        }
    }
    let slack = slack / weights + f64::from(fetched + 8) * 2f64.powi(-22);
    FilteredTexel { value: sum / weights, slack, fetched, undecided, empty: false }
}

/// pcg4d (Jarzynski and Olano, "Hash functions for GPU rendering", JCGT 2020).
fn random([mut x, mut y, mut z, mut w]: [u32; 4]) -> [u32; 4] {
    for n in [&mut x, &mut y, &mut z, &mut w] {
        *n = n.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    }
    for round in 0..2 {
        x = x.wrapping_add(y.wrapping_mul(w));
        y = y.wrapping_add(z.wrapping_mul(x));
        z = z.wrapping_add(x.wrapping_mul(y));
        w = w.wrapping_add(y.wrapping_mul(z));
        if round == 0 {
            for n in [&mut x, &mut y, &mut z, &mut w] {
                *n ^= *n >> 16;
            }
        }
    }
    [x, y, z, w]
}

/// The level that the minor axis selects. The two entries differ if rounding decides between two levels.
pub fn stochastic_levels(pixel: &PixelCentre, texture: &Texture<'_>) -> [u32; 2] {
    let (_, minor, _) = axes(pixel);
    let level = minor.max(1e-30).log2();
    let [u, v] = pixel.jacobian.map(|[across, down]| across.hypot(down));
    [-1.0, 1.0].map(|side| {
        let error = 2f64.powf(side * 2f64.powi(-16));
        let level = texture.raised((level + error.log2()).floor(), u.max(v) * error);
        level.clamp(0.0, f64::from(texture.coarsest)) as u32
    })
}

fn stochastic(
    pixel: &PixelCentre,
    texture: &Texture<'_>,
    samples: u32,
    level: u32,
    frame: u32,
) -> FilteredTexel {
    let scale = f64::from(1u32 << level);
    let [[ux, uy], [vx, vy]] = pixel.jacobian;
    // A position in f32 has an error of the centre's ulp and of a few ulp of the offset.
    let extent = ux.abs() + uy.abs() + vx.abs() + vy.abs();
    let (mut sum, mut undecided) = (0.0, 0);
    for n in 0..samples {
        let [x, y] = pixel.place;
        let unit = random([x, y, n, frame]).map(|bits| f64::from(bits >> 8) / f64::from(1u32 << 24));
        let radius = (-(1.0 - unit[0] * (1.0 - (-2f64).exp())).ln() / 2.0).sqrt();
        let (sin, cos) = (TAU * unit[1]).sin_cos();
        let moved = [(ux, uy), (vx, vy)].map(|(across, down)| radius * (across * cos + down * sin));
        let at = [0, 1].map(|n| (pixel.centre[n] + moved[n]) / scale - 0.5 + unit[n + 2]);
        let error = texture.place_error / scale;
        let ulps = |place: f64| 2f64.powi(-21) * (place.abs() + extent / scale + 1.0) + error;
        undecided += u32::from(at.iter().any(|&place| (place - place.round()).abs() < ulps(place)));
        sum += (texture.texel)(level, at[0].floor() as i64, at[1].floor() as i64);
    }
    let count = f64::from(samples);
    let slack = f64::from(undecided) / count + (count + 4.0) * 2f64.powi(-24);
    FilteredTexel { value: sum / count, slack, fetched: samples, undecided: 0, empty: false }
}

fn summed_area(pixel: &PixelCentre, texture: &Texture<'_>) -> FilteredTexel {
    let side = 1i64 << texture.coarsest;
    let [[ux, uy], [vx, vy]] = pixel.jacobian;
    let reach = [(ux.abs() + uy.abs()) / 2.0, (vx.abs() + vy.abs()) / 2.0];
    let edge = |n: usize, sign: f64| pixel.centre[n] + sign * reach[n] + 0.5;
    let range = |n: usize| {
        let from = edge(n, -1.0).floor();
        (from as i64, (edge(n, 1.0).floor() - from).clamp(1.0, side as f64) as i64)
    };
    let [(left, width), (top, height)] = [range(0), range(1)];
    let mut sum = 0.0;
    for row in top..top + height {
        for column in left..left + width {
            sum += (texture.texel)(0, column, row);
        }
    }
    // Rounding may move an edge near a texel's middle to either side.
    let near = |n: usize, sign: f64| {
        let at = edge(n, sign);
        u32::from((at - at.round()).abs() < 2f64.powi(-21) * (at.abs() + 1.0))
    };
    let slack = (0..2).map(|n| {
        let texels = [width, height][n] as f64;
        f64::from(near(n, -1.0) + near(n, 1.0)) / texels
    });
    let slack = slack.sum::<f64>() + 2f64.powi(-20);
    let value = sum / (width * height) as f64;
    FilteredTexel { value, slack, fetched: 4, ..FilteredTexel::default() }
}
