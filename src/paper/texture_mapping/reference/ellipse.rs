//! Steps A to D: visits, row by row, the texels of a slightly larger ellipse. The inverse of the ellipse's matrix V
//! gives the distances of the texels.

use super::FilteredTexel;
use crate::math::weight_map::{MapShape, WeightMap};
use crate::paper::texture_mapping::footprint::{Axes, MAX_MAJOR_TEXELS, MAX_VISITED, Scan};
use crate::paper::texture_mapping::method::{EllipseFilter, PixelCentre};
use crate::paper::texture_mapping::weights::{Edge, MIN_WEIGHTS};

/// A symmetric 2 x 2 matrix: 11, 12, 22.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Symmetric(pub [f64; 3]);

impl Symmetric {
    /// The larger and the smaller eigenvalue.
    fn eigenvalues(self, det: f64) -> [f64; 2] {
        let [a, b, c] = self.0;
        let larger = (a + c) / 2.0 + ((a - c) / 2.0).hypot(b);
        [larger, if larger > 0.0 { det / larger } else { 0.0 }]
    }
}

/// The ellipse of a pixel at a level, and a square root of the inverse of its matrix.
struct Shaped {
    v: Symmetric,
    det: f64,
    /// Rows of the matrix that maps the ellipse to the unit disc, for the weights.
    to_disc: [[f64; 2]; 2],
}

/// `radius^2 J J^T` in texels of level 0, and its determinant. If the axis ratio exceeds the limit, the minor axis is
/// lengthened to the limit.
fn widened(ellipse: &EllipseFilter, pixel: &PixelCentre) -> (Symmetric, f64) {
    let square = f64::from(ellipse.kernel.radius_px).powi(2);
    let [[ux, uy], [vx, vy]] = pixel.jacobian;
    let v = [ux * ux + uy * uy, ux * vx + uy * vy, vx * vx + vy * vy].map(|entry| entry * square);
    let det = (pixel.determinant * square).powi(2);
    let [larger, smaller] = Symmetric(v).eigenvalues(det);
    let min = larger / f64::from(ellipse.footprint.max_ratio).powi(2);
    if smaller >= min {
        return (Symmetric(v), det);
    }
    // Stretches only the minor axis: V + (min - smaller) e e^T, e e^T = (larger I - V) / (larger -
    // smaller).
    let part = (min - smaller) / (larger - smaller);
    let [a, b, c] = v;
    (Symmetric([a + part * (larger - a), b - part * b, c + part * (larger - c)]), larger * min)
}

/// True if the footprint is longer than [`MAX_MAJOR_TEXELS`]. The pixel's value is then the texture's mean.
fn sees_all(v: Symmetric) -> bool {
    v.0[0] + v.0[2] >= MAX_MAJOR_TEXELS * MAX_MAJOR_TEXELS
}

/// Limits a pixel's footprint: the longest of J's axes is at most `max` texels, measured on a sphere with longitude
/// u and latitude v. `across` is the cosine of the latitude.
pub fn bounded(pixel: &PixelCentre, max: f64, across: f64) -> PixelCentre {
    let [u, v] = pixel.jacobian;
    let j = [u.map(|d| d * across), v];
    let [a, b, c] = [(0, 0), (0, 1), (1, 1)].map(|(m, n)| j[m][0] * j[n][0] + j[m][1] * j[n][1]);
    let (sin, cos) = (0.5 * (2.0 * b).atan2(a - c)).sin_cos();
    // The gradient of the axis along x and y: J^T e.
    let along = [0, 1].map(|n| cos * j[0][n] + sin * j[1][n]);
    let length = along[0].hypot(along[1]);
    if length <= max {
        return *pixel;
    }
    let less = 1.0 - max / length;
    let jacobian = [
        [0, 1].map(|n| (j[0][n] - less * cos * along[n]) / across),
        [0, 1].map(|n| j[1][n] - less * sin * along[n]),
    ];
    PixelCentre { jacobian, determinant: pixel.determinant * max / length, ..*pixel }
}

/// The level that the method chooses. The two entries differ if rounding decides between two levels.
pub fn levels(ellipse: &EllipseFilter, pixel: &PixelCentre, coarsest: u32) -> [u32; 2] {
    let (v, det) = widened(ellipse, pixel);
    if sees_all(v) {
        return [coarsest; 2];
    }
    let [_, smaller] = v.eigenvalues(det);
    let minor_texels = f64::from(ellipse.footprint.minor_texels);
    // With `minor_texels` = 0 the minor axis does not affect the level, not even by rounding.
    let by_minor =
        if minor_texels > 0.0 { (smaller.sqrt() / minor_texels).log2() } else { f64::NEG_INFINITY };
    // At level l the scan visits `visited` / 4^l texels; the factor 4 covers k and the margins.
    let [a, _, c] = v.0;
    let visited = match ellipse.footprint.scan {
        Scan::BoundingBox => 4.0 * (a * c).sqrt(),
        Scan::RowSpan => 4.0 * det.sqrt(),
    };
    let by_count = (4.0 * visited / f64::from(MAX_VISITED)).log2() / 2.0;
    let by_rows = (a.max(c).sqrt() / f64::from(ellipse.footprint.max_reach)).log2();
    let wanted = by_minor.floor().max(by_count.ceil()).max(by_rows.ceil());
    // The error of log2 in f32: the argument has a relative error of 2^-21, and the result, up to 2^5, is rounded.
    let undecided = 2f64.powi(-16);
    let near =
        [by_minor, by_count, by_rows].into_iter().any(|level| (level - level.round()).abs() < undecided);
    let level = |wanted: f64| wanted.clamp(0.0, f64::from(coarsest)) as u32;
    match near {
        true => [level(wanted - 1.0), level(wanted + 1.0)],
        false => [level(wanted); 2],
    }
}

fn shaped(ellipse: &EllipseFilter, pixel: &PixelCentre, level: u32) -> Shaped {
    let (v, det) = widened(ellipse, pixel);
    let scale = 0.25f64.powi(level as i32);
    let k = ellipse.footprint.k_at(level, v.eigenvalues(det)[1] * scale);
    let [a, b, c] = v.0.map(|entry| entry * scale);
    let with_k = Symmetric([a + k, b, c + k]);
    let det = det * scale * scale + k * (a + c) + k * k;
    // Lengths and direction of the axes of the weights.
    let [[ux, uy], [vx, vy]] = pixel.jacobian.map(|row| row.map(|d| d * f64::from(ellipse.kernel.radius_px)));
    let (length, depth, cos, sin) = match ellipse.footprint.axes {
        Axes::Corrected => {
            let [a, b, c] = with_k.0;
            let [larger, smaller] = with_k.eigenvalues(det);
            let angle = 0.5 * (2.0 * b).atan2(a - c);
            (larger.sqrt(), smaller.sqrt(), angle.cos(), angle.sin())
        }
        Axes::Round => {
            let [larger, _] = with_k.eigenvalues(det);
            (larger.sqrt(), larger.sqrt(), 1.0, 0.0)
        }
        Axes::Rows => literal(ux, uy, vx.hypot(vy), scale, k),
        Axes::Columns => literal(ux, vx, uy.hypot(vy), scale, k),
    };
    let to_disc = [[cos / length, sin / length], [-sin / depth, cos / depth]];
    Shaped { v: with_k, det, to_disc }
}

/// Formula (4) as printed: length and angle of the axis (x, y). `other` is the length of the other axis.
fn literal(x: f64, y: f64, other: f64, scale: f64, k: f64) -> (f64, f64, f64, f64) {
    let length = x.hypot(y);
    let (cos, sin) = if length > 0.0 { (x / length, y / length) } else { (1.0, 0.0) };
    ((length * length * scale + k).sqrt(), (other * other * scale + k).sqrt(), cos, sin)
}

/// How much of a texel counts if the ellipse's edge cuts the texel (step C). `distance` is in texels, positive inside.
pub fn kept(edge: Edge, distance: f64) -> f64 {
    if edge == Edge::None {
        return if distance >= 0.0 { 1.0 } else { 0.0 };
    }
    if distance <= -0.5 {
        return 0.0;
    }
    let d = distance.abs();
    let inside = match edge {
        Edge::Exact => 0.5 + 0.5 * libm::erf(d / (0.2 * std::f64::consts::SQRT_2)),
        _ if d >= 0.5 => 1.0,
        Edge::Quadratic => 0.5 + 2.151 * d - 2.358 * d * d,
        Edge::Cubic => 0.496 + 2.288 * d - 3.074 * d * d + 0.956 * d * d * d,
        Edge::PiecewiseLinear if d < 0.165 => 0.506 + 1.79 * d,
        Edge::PiecewiseLinear if d < 0.305 => 0.636 + 1.008 * d,
        Edge::PiecewiseLinear => 0.853 + 0.295 * d,
        Edge::AreaRamp | Edge::None => 0.5 + d,
    };
    if distance >= 0.0 { inside } else { 1.0 - inside }
}

/// The weight map's value (step D): the nearest entry, or the interpolation of the two nearest entries.
fn mapped(map: &WeightMap, alpha: f64, reach: f64, place: [f64; 2]) -> f64 {
    let [x, y] = place.map(|c| c / reach);
    let entries = f64::from(map.entries);
    let nearest = |part: f64| ((part * entries).floor().clamp(0.0, entries - 1.0) + 0.5) / entries;
    let max = f64::from((1u32 << map.bits) - 1);
    let entry = |square: f64| ((-alpha * reach * reach * square).exp() * max).round() / max;
    if map.linear {
        let radial = map.shape == MapShape::Radial;
        let square = x * x + y * y;
        let part = if radial { square.sqrt() } else { square };
        let at = (part * entries - 0.5).clamp(0.0, entries - 1.0);
        let of = |n: f64| {
            let middle = (n.min(entries - 1.0) + 0.5) / entries;
            entry(if radial { middle * middle } else { middle })
        };
        let share = at - at.floor();
        return of(at.floor()) * (1.0 - share) + of(at.floor() + 1.0) * share;
    }
    let square = match map.shape {
        MapShape::Square => {
            let middle = |c: f64| 2.0 * nearest((c + 1.0) / 2.0) - 1.0;
            middle(x).powi(2) + middle(y).powi(2)
        }
        MapShape::Quadrant => nearest(x.abs()).powi(2) + nearest(y.abs()).powi(2),
        MapShape::Radial => nearest((x * x + y * y).sqrt()).powi(2),
        MapShape::SquaredRadius => nearest(x * x + y * y),
    };
    entry(square)
}

/// The weight by formula (4), or by the weight map if there is one.
fn weight(ellipse: &EllipseFilter, place: [f64; 2]) -> f64 {
    let alpha = f64::from(ellipse.kernel.alpha);
    match &ellipse.map {
        Some(map) => mapped(map, alpha, ellipse.map_reach(), place),
        None => (-alpha * (place[0] * place[0] + place[1] * place[1])).exp(),
    }
}

/// The texels with a weight: offsets from the centre in texels of the level, and weights.
pub fn weights(
    ellipse: &EllipseFilter,
    pixel: &PixelCentre,
    coarsest: u32,
    level: u32,
) -> Vec<([f64; 2], f64)> {
    let mut found = Vec::new();
    if level < coarsest {
        each_texel(ellipse, pixel, level, |texel| {
            if texel.kept > 0.0 {
                found.push((texel.offset, texel.weight * texel.kept));
            }
        });
    }
    found
}

/// The value of a pixel at a level of [`levels`]. `value` returns a texel, 0 to 1, by column and row. Column and row
/// may be outside the level.
pub fn filtered(
    ellipse: &EllipseFilter,
    pixel: &PixelCentre,
    [level, coarsest]: [u32; 2],
    value: impl Fn(i64, i64) -> f64,
) -> FilteredTexel {
    // The coarsest level has one texel.
    if level >= coarsest {
        return FilteredTexel {
            value: value(0, 0),
            slack: 2f64.powi(-22),
            fetched: 1,
            ..FilteredTexel::default()
        };
    }
    let [column, row] = pixel.centre.map(|place| (place / f64::from(1u32 << level)).floor());
    let nearest = value(column as i64, row as i64);
    let (mut sum, mut weights, mut whole, mut slack) = (0.0, 0.0, 0.0, 0.0);
    let (mut fetched, mut undecided) = (0, 0);
    let mut range = [nearest; 2];
    each_texel(ellipse, pixel, level, |texel| {
        let Texel { place: [column, row], weight, kept, min, max, falls, .. } = texel;
        undecided += u32::from((max > 0.0) != (min > 0.0));
        fetched += u32::from(kept > 0.0);
        slack += weight * (max - min) + weight * kept * falls;
        let value = value(column, row);
        range = [range[0].min(value), range[1].max(value)];
        sum += weight * kept * value;
        weights += weight * kept;
        whole += weight;
    });
    // The GPU's error function has an error of 1.5e-7 of each texel, and rounding.
    slack += if ellipse.edge == Edge::Exact { (1.5e-7 + 2f64.powi(-23)) * whole } else { 0.0 };
    // Each sum in f32 has an error of half an ulp. For each texel, f32 may also lose the weight, its part and its
    // product with the texel, each below 2^-126. The sum is at least 2^-100, so the losses are below 2^-24 of it.
    let rounding = f64::from(2 * fetched + 32) * 2f64.powi(-24);
    let empty = weights < MIN_WEIGHTS;
    let mean = if empty { nearest } else { sum / weights };
    // If rounding decides whether the footprint is empty, the GPU shows the nearest texel or a mean.
    if (weights - MIN_WEIGHTS).abs() <= slack + rounding * weights {
        undecided += fetched.max(1);
        slack = (mean - range[0]).max(range[1] - mean);
    } else {
        // A texel differs from the mean by at most 1.
        slack = if empty { 0.0 } else { (slack / weights).min(1.0) };
    }
    FilteredTexel {
        value: mean,
        slack: slack + rounding,
        fetched: if empty { 0 } else { fetched },
        undecided,
        empty,
    }
}

/// An ellipse that contains every point within half a texel of the footprint. For every t > 0, the ellipse (1 + 1/t)
/// V + (1 + t) / 4 I contains the Minkowski sum of the ellipse V and a disc of radius 1/2. It touches this sum at the
/// ends of the minor axis if t is twice the minor semi-axis.
fn outer(ellipse: &EllipseFilter, shaped: &Shaped) -> Symmetric {
    let [a, b, c] = shaped.v.0;
    if ellipse.edge == Edge::None {
        return Symmetric([1.0001 * a, 1.0001 * b, 1.0001 * c]);
    }
    let t = 2.0 * shaped.v.eigenvalues(shaped.det)[1].sqrt();
    let (scale, add) = (1.0 + 1.0 / t, (1.0 + t) / 4.0);
    Symmetric([scale * a + add, scale * b, scale * c + add])
}

/// Distances from the pixel's centre to the sides of the box around all texels that may have a weight, in texels of
/// the level.
pub fn half_sides(ellipse: &EllipseFilter, pixel: &PixelCentre, level: u32) -> [f64; 2] {
    let [a, _, c] = outer(ellipse, &shaped(ellipse, pixel, level)).0;
    [a.sqrt(), c.sqrt()]
}

/// A texel near the ellipse.
struct Texel {
    place: [i64; 2],
    /// Offset from the pixel's centre, in texels of the level.
    offset: [f64; 2],
    weight: f64,
    kept: f64,
    /// Least and greatest kept part within the rounding error of r, the texel's distance from the centre in units of
    /// the ellipse.
    min: f64,
    max: f64,
    /// Relative error of the weight.
    falls: f64,
}

/// Visits every texel that has a weight, or may have one after rounding.
fn each_texel(ellipse: &EllipseFilter, pixel: &PixelCentre, level: u32, mut visit: impl FnMut(Texel)) {
    let shaped = shaped(ellipse, pixel, level);
    let outer = outer(ellipse, &shaped);
    // A line has no area and therefore no texels.
    if shaped.det <= 0.0 {
        return;
    }
    let [u, v] = pixel.centre.map(|place| place / f64::from(1u32 << level));
    let (column, row) = (u.floor(), v.floor());
    let [a, b, c] = shaped.v.0;
    let [oa, ob, oc] = outer.0;
    let half_height = (oc.sqrt() + 1.0).ceil() as i64;
    for j in -half_height..=half_height {
        let dv = j as f64 + 0.5 - (v - row);
        // The outer ellipse's part of the row, widened by two texels.
        let half_width = ((oa - ob * ob / oc) * (1.0 - dv * dv / oc)).max(0.0).sqrt() + 2.0;
        let middle = ob / oc * dv + (u - column) - 0.5;
        for i in (middle - half_width).floor() as i64..=(middle + half_width).ceil() as i64 {
            let du = i as f64 + 0.5 - (u - column);
            let r = ((c * du * du - 2.0 * b * du * dv + a * dv * dv) / shaped.det).max(0.0).sqrt();
            let rounding = rounding(&shaped, [du, dv], r);
            // Where the edge curves away, `distance` is less than the true distance. Texels outside the outer ellipse
            // are more than half a texel beyond the edge and do not contribute.
            let from_outer = (oc * du * du - 2.0 * ob * du * dv + oa * dv * dv) / (oa * oc - ob * ob) - 1.0;
            if from_outer > 4.0 * rounding {
                continue;
            }
            // V^-1 q = r grad r.
            let [x, y] = [(c * du - b * dv) / shaped.det, (a * dv - b * du) / shaped.det];
            let texels_a_radius = if r > 0.0 { r / (x * x + y * y).sqrt() } else { f64::INFINITY };
            let distance = |r: f64| (1.0 - r) * texels_a_radius;
            // If the terms of the slope cancel, the slope has the same rounding error as r.
            let of_slope = rounding * (1.0 + (b / c).abs()) * (c / shaped.det).sqrt() * texels_a_radius;
            let off = if r > 0.0 { (1.0 - r).abs() * texels_a_radius * of_slope } else { 0.0 };
            if distance(r - rounding) + off < -0.5 {
                continue;
            }
            let cut = from_outer.abs() <= 4.0 * rounding;
            let of = |r: f64, off: f64| kept(ellipse.edge, distance(r) + off);
            // Approximations of V1 have steps down towards the inside, so either may be the smaller one.
            let [outside, inside] = [of(r + rounding, -off), of(r - rounding, off)];
            let at = shaped.to_disc.map(|[x, y]| x * du + y * dv);
            visit(Texel {
                place: [column as i64 + i, row as i64 + j],
                offset: [du, dv],
                weight: weight(ellipse, at),
                kept: if from_outer > 0.0 { 0.0 } else { of(r, 0.0) },
                min: if cut { 0.0 } else { outside.min(inside) },
                max: outside.max(inside),
                falls: falls(ellipse, at, r, rounding),
            });
        }
    }
}

/// Relative error of the weight of a texel at `at` in the unit disc. The slope of the weight's exponent is 2 alpha r. A
/// weight map without interpolation changes in steps from entry to entry. Vulkan's exp(-x) has an error of 3 + 2 x ulp.
/// If x > 88, f32 may lose the weight.
fn falls(ellipse: &EllipseFilter, at: [f64; 2], r: f64, rounding: f64) -> f64 {
    let alpha = f64::from(ellipse.kernel.alpha);
    let slope = 2.0 * alpha * r.max(rounding);
    let exponent = (alpha * (at[0] * at[0] + at[1] * at[1])).min(88.0);
    slope * rounding + step(ellipse, r, rounding) + (3.0 + 2.0 * exponent) * 2f64.powi(-23)
}

/// Rounding error of a texel's r in f32: 4 ulp of r itself, and 4 ulp of the position along the row. The position is
/// the difference of two numbers up to `sqrt(a)`, and is measured in the ellipse's width along the row. The
/// reconstruction term may be a difference, too, but its error is small relative to the eigenvalue that contains it.
fn rounding(shaped: &Shaped, [_, dv]: [f64; 2], r: f64) -> f64 {
    let [a, b, c] = shaped.v.0;
    let width = (shaped.det / c).sqrt();
    let along = ((b / c * dv).abs() + (b / c).abs().min(a.sqrt()) + 1.0) / width;
    2f64.powi(-22) * (r + along)
}

/// Largest relative difference between neighbouring entries of a map, if rounding may choose either.
fn step(ellipse: &EllipseFilter, r: f64, rounding: f64) -> f64 {
    let Some(map) = ellipse.map.filter(|map| !map.linear) else { return 0.0 };
    let entries = f64::from(map.entries) / ellipse.map_reach();
    let steps = match map.shape {
        MapShape::Square | MapShape::Quadrant => return 4.0 * f64::from(ellipse.kernel.alpha) * r / entries,
        MapShape::Radial => r * entries,
        MapShape::SquaredRadius => r * r * entries / ellipse.map_reach(),
    };
    let near = (steps - steps.round()).abs() < 4.0 * rounding * entries;
    if near { 2.0 * f64::from(ellipse.kernel.alpha) / entries } else { 0.0 }
}
