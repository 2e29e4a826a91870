//! Gullies and spurs that run downhill, as if cut by ice and water: noise whose crests follow the direction
//! of descent (after the erosion filters of R. Johansen and of clayjohn, 2018 and later, which are cellular
//! Gabor noise).
//!
//! A point in each cell carries a wave across the slope; nearby waves are blended. Steeper ground has a higher
//! frequency; level ground has no waves. Each octave is half as wide and follows the slope that the wider octaves have
//! produced.

use super::Slope;

/// Width of the widest gullies.
const WIDEST_M: f64 = 2400.0;
const OCTAVES: u32 = 6;
/// Ratio of crest height to gully width on steep ground.
const STEEPNESS: f64 = 0.11;
/// Ratio of an octave's height to that of the octave before.
const FALL: f64 = 0.45;

/// Metres to add at a point with this smooth slope. `ridge_m`: height of the point above its surroundings. `finest_m`:
/// spacing of the caller's grid; gullies narrower than twice this are omitted.
pub fn height_m([east_m, north_m]: [f64; 2], smooth: &Slope, ridge_m: f64, finest_m: f64) -> f64 {
    let (mut east, mut north) = (smooth.east, smooth.north);
    // Crests and floors have no slope; their height above or below the surroundings replaces it.
    let rough = east * east + north * north + ridge_m * ridge_m * 4e-6;
    let strength = rough / (rough + 0.14);
    let (mut height, mut wide_m, mut high_m) = (0.0, WIDEST_M, STEEPNESS * WIDEST_M * strength);
    for octave in 0..OCTAVES {
        let seen = ((wide_m / finest_m - 2.0) / 2.0).clamp(0.0, 1.0);
        if seen == 0.0 {
            break;
        }
        // Direction across the slope; its length is the number of waves in a cell.
        let steep = (east * east + north * north).sqrt();
        let waves = 1.1 * steep / (steep + 0.12) / steep.max(1e-9);
        let across = [-north * waves, east * waves];
        let (value, slope) = wave([east_m / wide_m, north_m / wide_m], across, octave);
        height += seen * high_m * value;
        let share = seen * high_m / wide_m;
        east += share * slope[0];
        north += share * slope[1];
        wide_m /= 2.0;
        high_m *= FALL;
    }
    height
}

/// The wave's value, -1 ..= 1, and its approximate slope (the change of the weights is ignored), at a point in units
/// of cells.
fn wave([x, y]: [f64; 2], across: [f64; 2], octave: u32) -> (f64, [f64; 2]) {
    let (column, row) = (x.floor(), y.floor());
    let (mut value, mut rise, mut weights) = (0.0, 0.0, 0.0);
    for j in -1..=1 {
        for i in -1..=1 {
            let bits = super::hash(column as i32 + i, row as i32 + j, octave);
            let inside = |bits: u32| 0.25 + f64::from(bits & 0xFFFF) / 131_072.0;
            let from =
                [x - (column + f64::from(i) + inside(bits)), y - (row + f64::from(j) + inside(bits >> 16))];
            // Points in cells beyond the neighbours are at least 1.25 away.
            let near = 1.0 - (from[0] * from[0] + from[1] * from[1]) / (1.25 * 1.25);
            if near > 0.0 {
                let weight = near * near * near;
                let (crest, slope) = turn(from[0] * across[0] + from[1] * across[1]);
                value += weight * crest;
                rise -= weight * slope;
                weights += weight;
            }
        }
    }
    let rise = 8.0 * rise / weights;
    (value / weights, [rise * across[0], rise * across[1]])
}

/// A wave after `t` full turns, and -1/8 of its slope. The wave has a sharp crest of 1 at whole numbers and a round
/// floor of -1 halfway.
fn turn(t: f64) -> (f64, f64) {
    let t = t - (t + 0.5).floor();
    let away = 2.0 * t.abs();
    (1.0 - 2.0 * away * (2.0 - away), (1.0 - away) * t.signum())
}
