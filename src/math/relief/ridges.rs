//! Ridges and valleys from 11 km down to 1.1 km wide, where the samples have none. The half of the grid in Nepal comes
//! from maps with few contour lines, and is as smooth as a dune.
//!
//! Ridged noise of several octaves (F. K. Musgrave in Ebert et al., "Texturing and Modeling: A Procedural Approach",
//! 2nd edition, AP Professional 1998): 1 - |n| of smooth noise n has crests where n crosses 0. A finer octave is
//! weighted by the height of the coarser ones, so that valleys stay smooth.

use super::Slope;

const WIDEST_M: f64 = 11_000.0;
const OCTAVES: u32 = 4;
/// The flat valley floor begins where |noise| reaches 1 / STEEP.
const STEEP: f64 = 2.6;
/// The crest value (0 ..= 1) that leaves the samples' height unchanged. Valleys are cut deeper below the samples than
/// ridges rise above them.
const MEAN: f64 = 0.62;

/// Noise in -0.45 ..= 0.26, and its slope per metre.
pub fn ridges(east_m: f64, north_m: f64) -> Slope {
    let (mut sum, mut wide_m, mut share, mut weight) = (Slope::default(), WIDEST_M, 0.62, 1.0);
    for octave in 0..OCTAVES {
        // Every second octave is rotated by atan(3/4), so that no direction dominates.
        let turned = match octave % 2 {
            0 => [east_m, north_m],
            _ => [0.8 * east_m - 0.6 * north_m, 0.6 * east_m + 0.8 * north_m],
        };
        let noise = smooth([turned[0] / wide_m, turned[1] / wide_m], octave);
        // Crests where n is 0, rounded off. Floors are flat, as in glacial valleys.
        let away = (noise.height * noise.height + 0.0008).sqrt();
        let across = (STEEP * away).min(1.0);
        let crest = 1.0 - across * (2.0 - across);
        let by = -2.0 * (1.0 - across) * STEEP * noise.height / away * weight * share / wide_m;
        let (east, north) = match octave % 2 {
            0 => (noise.east, noise.north),
            _ => (0.8 * noise.east + 0.6 * noise.north, 0.8 * noise.north - 0.6 * noise.east),
        };
        sum.height += weight * share * (crest - MEAN);
        sum.east += by * east;
        sum.north += by * north;
        weight = (weight * (0.3 + 1.2 * crest)).clamp(0.1, 1.0);
        wide_m *= 0.47;
        share *= 0.44;
    }
    sum
}

/// Gradient noise, about -0.7 ..= 0.7, with its slopes, at a point in lattice units (K. Perlin,
/// "Improving Noise", SIGGRAPH 2002).
fn smooth([x, y]: [f64; 2], octave: u32) -> Slope {
    let (column, row) = (x.floor(), y.floor());
    let (s, t) = (x - column, y - row);
    let fade = |t: f64| (t * t * t * (t * (6.0 * t - 15.0) + 10.0), 30.0 * t * t * (t - 1.0) * (t - 1.0));
    let ((u, du), (v, dv)) = (fade(s), fade(t));
    let corner = |i: i32, j: i32| {
        let bits = super::hash(column as i32 + i, row as i32 + j, octave + 64);
        let part = |bits: u32| f64::from(bits & 0xFFFF) / 32_767.5 - 1.0;
        let [a, b] = [part(bits), part(bits >> 16)];
        Slope { height: a * (s - f64::from(i)) + b * (t - f64::from(j)), east: a, north: b }
    };
    let [sw, se, nw, ne] = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
    let mix = |of: fn(&Slope) -> f64| {
        let (south, north) = (of(&sw) + (of(&se) - of(&sw)) * u, of(&nw) + (of(&ne) - of(&nw)) * u);
        south + (north - south) * v
    };
    let [h00, h10, h01, h11] = [sw, se, nw, ne].map(|corner| corner.height);
    let twist = h00 - h10 - h01 + h11;
    Slope {
        height: mix(|corner| corner.height),
        east: mix(|corner| corner.east) + du * (h10 - h00 + twist * v),
        north: mix(|corner| corner.north) + dv * (h01 - h00 + twist * u),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_the_heights() {
        for n in 0..400 {
            let [east, north] = [f64::from(n) * 317.0 - 50_000.0, f64::from(n * n % 977) * 91.0 - 40_000.0];
            let (slope, at) = (ridges(east, north), |e, n| ridges(east + e, north + n).height);
            let found = [at(0.5, 0.0) - at(-0.5, 0.0), at(0.0, 0.5) - at(0.0, -0.5)];
            // Weights of finer octaves depend on the height of coarser ones; the slope ignores this.
            for (found, stated) in found.into_iter().zip([slope.east, slope.north]) {
                assert!((found - stated).abs() < 2e-4, "{n}: {found} {stated}");
            }
            assert!((-1.2..1.2).contains(&slope.height), "{slope:?}");
        }
    }
}
