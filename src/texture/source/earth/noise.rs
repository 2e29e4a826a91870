//! Smooth noise on the unit sphere. The value depends only on the position on the sphere, so there is neither
//! a seam at the antimeridian nor a pinch at the poles.
//!
//! The noise lies on a 3D lattice with a spacing of 1.25 equator texels, rotated against the Earth's axes. A 32-bit
//! hash at each lattice point is blended by smoothstep on the three axes. Positions come from `libm` in f64, one row
//! or column at a time, and are quantised to 1/1024 of the lattice (1/819 texel); everything after that is integer.

use super::base::level_size;
use crate::math::mix::mix;

/// Fraction bits of a position in units of the lattice.
const FRACTION_LOG2: u32 = 10;
const FRACTION_ONE: i32 = 1 << FRACTION_LOG2;
/// Lattice spacing in equator texels. With a spacing of 2, the residual noise after subtracting block means lines up
/// with rows and columns, like woven cloth. With 1 it looks like sand.
const LATTICE_TEXELS: f64 = 1.25;
/// Fraction bits of a column's direction.
const UNIT_LOG2: u32 = 30;

/// The lattice's axes in the Earth's axes, in thirds: a rotation that aligns no axis or plane of the lattice
/// with rows or columns.
const AXES_THIRDS: [[f64; 3]; 3] = [[2.0, -1.0, 2.0], [2.0, 2.0, -1.0], [-1.0, 2.0, 2.0]];

/// Direction of a column's meridian at the equator, in lattice axes, in units of 2^-30.
#[derive(Clone, Copy)]
pub struct Column([i64; 3]);

/// Position of a row's texel centres in 1/1024 of the lattice: the distance from the Earth's axis, and the
/// nearest point on that axis, in lattice axes.
#[derive(Clone, Copy)]
pub struct NoiseRow {
    radius: i64,
    foot: [i32; 3],
}

/// The columns with these indices (already wrapped at the antimeridian) in a level `2^width_log2` texels wide.
pub fn columns(width_log2: u32, indices: impl Iterator<Item = u32>) -> Vec<Column> {
    let radians_per_column = std::f64::consts::TAU / f64::from(1u32 << width_log2);
    let unit = f64::from(1u32 << UNIT_LOG2);
    indices
        .map(|index| {
            let (sine, cosine) = libm::sincos((f64::from(index) + 0.5) * radians_per_column);
            Column(AXES_THIRDS.map(|[x, y, _]| libm::round((x * cosine + y * sine) / 3.0 * unit) as i64))
        })
        .collect()
}

/// The row with this index (already mirrored at the poles) in a level `2^width_log2` texels wide.
pub fn row(width_log2: u32, index: u32) -> NoiseRow {
    let [width, height] = level_size(width_log2).map(f64::from);
    let from_pole = (f64::from(index) + 0.5) * (std::f64::consts::PI / height);
    let (sine, cosine) = libm::sincos(from_pole);
    // An equator texel is TAU/width, so a sphere of radius width/(k TAU) has k texels per unit.
    let radius = width / (LATTICE_TEXELS * std::f64::consts::TAU) * f64::from(FRACTION_ONE);
    let foot = AXES_THIRDS.map(|[_, _, z]| libm::round(z / 3.0 * cosine * radius) as i32);
    NoiseRow { radius: libm::round(sine * radius) as i64, foot }
}

/// Steps between lattice points in the hash's input: odd, with no short integer relation modulo 2^32.
const STEP: [u32; 3] = [0x9E37_79B1, 0x85EB_CA6B, 0xC2B2_AE3D];

/// Hash of one lattice point, -32768 ..= 32767.
#[inline(always)]
fn lattice(point: u32) -> i32 {
    (mix(point) as i32) >> 16
}

/// 3t^2 - 2t^3, with t and the result in units of 1/1024; at most 2^30 before the shift.
#[inline(always)]
fn smoothstep(t: i32) -> i32 {
    t.wrapping_mul(t).wrapping_mul(3 * FRACTION_ONE - 2 * t) >> (2 * FRACTION_LOG2)
}

/// Differences have 17 bits, weights 10: products fit i32.
#[inline(always)]
fn blend(from: i32, to: i32, weight: i32) -> i32 {
    from.wrapping_add(to.wrapping_sub(from).wrapping_mul(weight) >> FRACTION_LOG2)
}

/// The noise at a texel's centre, within -32768 ..= 32767.
///
/// The code is unrolled and its arithmetic wraps, because most of a tile's time is spent here. With the ranges above,
/// only the hash overflows.
#[inline(always)]
pub fn noise(width_log2: u32, row: NoiseRow, column: Column) -> i32 {
    let [step_x, step_y, step_z] = STEP;
    let at = |axis: usize| {
        ((row.radius.wrapping_mul(column.0[axis]) >> UNIT_LOG2) as i32).wrapping_add(row.foot[axis])
    };
    let [at_x, at_y, at_z] = [at(0), at(1), at(2)];
    let near = ((at_x >> FRACTION_LOG2) as u32)
        .wrapping_mul(step_x)
        .wrapping_add(((at_y >> FRACTION_LOG2) as u32).wrapping_mul(step_y))
        .wrapping_add(((at_z >> FRACTION_LOG2) as u32).wrapping_mul(step_z))
        // Each level has its own lattice.
        .wrapping_add(width_log2.wrapping_mul(0x27D4_EB2F));
    let far = near.wrapping_add(step_z);
    let x = smoothstep(at_x & (FRACTION_ONE - 1));
    let y = smoothstep(at_y & (FRACTION_ONE - 1));
    let z = smoothstep(at_z & (FRACTION_ONE - 1));
    let edge = |corner: u32| blend(lattice(corner), lattice(corner.wrapping_add(step_x)), x);
    let face = |corner: u32| blend(edge(corner), edge(corner.wrapping_add(step_y)), y);
    blend(face(near), face(far), z)
}
