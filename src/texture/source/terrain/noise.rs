//! Smooth noise of one octave on the plane, two values at once.
//!
//! The lattice is square, has a spacing of 1.6 texels, and is rotated by atan(3/4), so that its rows and columns do not
//! line up with the texels'. A 32-bit hash at each point gives 16 bits to each value; smoothstep interpolates.

use crate::math::mix::mix;

/// Subdivisions of a cell: texel centres lie at whole eighths of the lattice.
const PARTS: i32 = 8;

/// 3t^2 - 2t^3 at the eighths.
const SMOOTH: [f32; 8] = {
    let mut smooth = [0.0; 8];
    let mut part = 0;
    while part < 8 {
        let t = part as f32 / 8.0;
        smooth[part] = t * t * (3.0 - 2.0 * t);
        part += 1;
    }
    smooth
};

/// Steps between lattice points in the hash's input: odd, with no short integer relation modulo 2^32.
const STEP: [u32; 2] = [0x9E37_79B1, 0x85EB_CA6B];

#[inline(always)]
fn lattice(point: u32) -> [f32; 2] {
    let bits = mix(point);
    [(bits as i32 >> 16) as f32, (bits << 16) as i32 as f32 / 65_536.0]
}

#[inline(always)]
fn blend(from: [f32; 2], to: [f32; 2], weight: f32) -> [f32; 2] {
    [from[0] + (to[0] - from[0]) * weight, from[1] + (to[1] - from[1]) * weight]
}

/// Two values within -1 ..= 1 for texel `(x, y)` of the level `2^width_log2` texels wide. Each level has its
/// own lattice.
#[inline(always)]
pub fn octave(width_log2: u32, x: i32, y: i32) -> [f32; 2] {
    let (u, v) = (4 * x + 3 * y, 4 * y - 3 * x);
    let near = ((u >> 3) as u32)
        .wrapping_mul(STEP[0])
        .wrapping_add(((v >> 3) as u32).wrapping_mul(STEP[1]))
        .wrapping_add(width_log2.wrapping_mul(0x27D4_EB2F));
    let far = near.wrapping_add(STEP[1]);
    let across = SMOOTH[(u & (PARTS - 1)) as usize];
    let edge = |corner: u32| blend(lattice(corner), lattice(corner.wrapping_add(STEP[0])), across);
    let value = blend(edge(near), edge(far), SMOOTH[(v & (PARTS - 1)) as usize]);
    value.map(|value| value / 32_768.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stay_within_one_have_no_mean_and_are_independent() {
        let (mut sums, mut squares, mut product) = ([0.0; 2], [0.0; 2], 0.0);
        for (x, y) in (0..256).flat_map(|y| (0..256).map(move |x| (x, y))) {
            let value = octave(14, x, y).map(f64::from);
            assert!(value.iter().all(|value| value.abs() <= 1.0), "{value:?}");
            for n in 0..2 {
                sums[n] += value[n] / 65_536.0;
                squares[n] += value[n] * value[n] / 65_536.0;
            }
            product += value[0] * value[1] / 65_536.0;
        }
        println!("mean {sums:.4?}, mean square {squares:.4?}, product {product:.4}");
        // 25 600 lattice points with a mean square of 1/3: the mean has a standard deviation of 0.004. Blending lowers
        // the mean square.
        assert!(sums.iter().all(|sum| sum.abs() < 0.02) && product.abs() < 0.01);
        assert!(squares.iter().all(|square| (0.1..0.3).contains(square)));
    }
}
