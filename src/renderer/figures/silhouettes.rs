//! Pixels at silhouettes: their kernel contains a jump of depth. One sample per pixel shows one side of the jump; no
//! filter of a texture can show both.

use crate::reference::ReferenceView;
use rayon::prelude::*;

/// A relative difference of depth that is a jump if it remains at a distance of 2^-12 pixels. A continuous surface would
/// have to be seen at 0.2 degrees or less.
const LEAST_JUMP: f64 = 1e-3;

/// Depths are compared along the lines of a grid with this many cells across the kernel, which is two pixels wide.
const CELLS: u32 = 8;
const HALVINGS: u32 = 10;

/// Row by row, true for the pixels whose neighbourhood of one pixel contains a jump of depth, or a position beyond the
/// surface.
pub fn silhouettes(view: &ReferenceView) -> Vec<bool> {
    let [width, height] = view.size();
    let depth = |[x, y]: [f64; 2]| view.distance(x, y);
    let at = |n: u32| 2.0 * f64::from(n) / f64::from(CELLS) - 1.0;
    let of = |n: u32| {
        let [x, y] = [n % width, n / width].map(|at| f64::from(at) + 0.5);
        let lines = (0..=CELLS).flat_map(|line| (0..CELLS).map(move |n| [line, n]));
        lines.into_iter().any(|[line, n]| {
            let (across, from, to) = (at(line), at(n), at(n + 1));
            jumps(&depth, [x + from, y + across], [x + to, y + across], HALVINGS)
                || jumps(&depth, [x + across, y + from], [x + across, y + to], HALVINGS)
        })
    };
    (0..width * height).into_par_iter().map(of).collect()
}

/// True if depth jumps between two positions.
fn jumps(depth: &impl Fn([f64; 2]) -> Option<f64>, a: [f64; 2], b: [f64; 2], halvings: u32) -> bool {
    let (Some(near), Some(far)) = (depth(a), depth(b)) else { return true };
    if (near - far).abs() <= LEAST_JUMP * near.min(far) {
        return false;
    }
    let middle = [0, 1].map(|axis| (a[axis] + b[axis]) / 2.0);
    halvings == 0 || jumps(depth, a, middle, halvings - 1) || jumps(depth, middle, b, halvings - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_a_jump_and_a_steep_ramp_is_not() {
        let found =
            |depth: &dyn Fn(f64) -> Option<f64>| jumps(&|[x, _]| depth(x), [0.0, 0.0], [0.25, 0.0], HALVINGS);
        assert!(found(&|x| Some(if x < 0.1 { 1.0 } else { 1.002 })));
        assert!(!found(&|x| Some(if x < 0.1 { 1.0 } else { 1.0005 })), "less than the least jump");
        assert!(!found(&|x| Some(1.0 + 3.0 * x)));
        assert!(found(&|x| (x < 0.2).then_some(1.0)), "beyond the surface");
    }
}
