//! The first intersection of a ray with a relief, in f64. Visits cell by cell (J. Amanatides, A. Woo, "A Fast Voxel
//! Traversal Algorithm for Ray Tracing", Eurographics 1987) and solves a quadratic in each cell.

use super::{Ray, Relief};

/// The distance along the ray to the first point at or below the surface.
pub fn first_hit(relief: &Relief, ray: &Ray) -> f64 {
    let [ox, oy] = ray.origin.map(f64::from);
    let [dx, dy, dz] = ray.direction.map(f64::from);
    let top = f64::from(relief.depth);
    assert!(dz < 0.0, "{ray:?} does not descend");
    // The floor ends every ray.
    let last = -top / dz;
    let mut entry = 0.0;
    loop {
        // The cell just after the entry. On a border between cells, the ray's direction decides.
        let inside = entry + 1e-9;
        let cell = [ox + inside * dx, oy + inside * dy].map(|c| c.floor());
        let leave = |o: f64, d: f64, c: f64| match d {
            d if d > 0.0 => (c + 1.0 - o) / d,
            d if d < 0.0 => (c - o) / d,
            _ => f64::INFINITY,
        };
        let exit = leave(ox, dx, cell[0]).min(leave(oy, dy, cell[1])).min(last).max(inside);
        let corners = relief.corners(cell[0] as i64, cell[1] as i64).map(f64::from);
        // Height above the surface at t, a quadratic.
        let above = |t: f64| {
            let [fx, fy] = [ox + t * dx - cell[0], oy + t * dy - cell[1]];
            let [a, b, c, d] = corners;
            top + t * dz - ((a * (1.0 - fx) + b * fx) * (1.0 - fy) + (c * (1.0 - fx) + d * fx) * fy)
        };
        if let Some(t) = first_below(above, entry, exit) {
            return t;
        }
        if exit >= last {
            return last;
        }
        entry = exit;
    }
}

/// The first t of `from ..= to` at which a quadratic is at most 0.
fn first_below(above: impl Fn(f64) -> f64, from: f64, to: f64) -> Option<f64> {
    let (start, middle, end) = (above(from), above(0.5 * (from + to)), above(to));
    if start <= 0.0 {
        return Some(from);
    }
    // start + b s + c s^2 for s from 0 to 1.
    let c = 2.0 * (start + end - 2.0 * middle);
    let b = end - start - c;
    let root = if c.abs() < 1e-12 * (b.abs() + start) {
        -start / b
    } else {
        let discriminant = b * b - 4.0 * c * start;
        if discriminant < 0.0 {
            return None;
        }
        // This form of both roots avoids cancellation. The smallest root that is not negative is taken.
        let q = -0.5 * (b + discriminant.sqrt().copysign(b));
        let roots = [q / c, start / q];
        roots.into_iter().filter(|s| *s >= 0.0).fold(f64::INFINITY, f64::min)
    };
    ((0.0..=1.0).contains(&root)).then_some(from + root * (to - from))
}

#[cfg(test)]
mod tests {
    use super::super::{Ray, Relief, ReliefKind};
    use super::*;

    #[test]
    fn a_flat_floor_is_met_at_its_depth() {
        let relief = Relief { side: 16, depth: 4.0, heights: vec![0; 256] };
        let found = first_hit(&relief, &Ray::towards([3.25, 7.5], 30.0, 77.0));
        assert!((found - 8.0).abs() < 1e-6, "{found}");
    }

    /// Checks against small steps along the ray: the first step at or below the surface comes at the hit or shortly
    /// after it, never before it.
    #[test]
    fn small_steps_find_the_same_hit() {
        for kind in ReliefKind::ALL {
            let relief = kind.relief(32);
            for n in 0..200 {
                let origin = [(n * 37 % 32) as f32 + 0.3, (n * 11 % 32) as f32 + 0.7];
                let ray = Ray::towards(origin, 15.0 + f64::from(n % 70), f64::from(n) * 7.7);
                let above = |t: f64| {
                    let at = |c: usize| f64::from(ray.origin[c]) + t * f64::from(ray.direction[c]);
                    let (x, y) = (at(0), at(1));
                    let ([i, j], [fx, fy]) = ([x.floor(), y.floor()], [x - x.floor(), y - y.floor()]);
                    let [a, b, c, d] = relief.corners(i as i64, j as i64).map(f64::from);
                    let height = (a * (1.0 - fx) + b * fx) * (1.0 - fy) + (c * (1.0 - fx) + d * fx) * fy;
                    f64::from(relief.depth) + t * f64::from(ray.direction[2]) - height
                };
                let hit = first_hit(&relief, &ray);
                let first = (0..).map(|n| f64::from(n) * 1e-3).find(|&t| above(t) <= 1e-9).unwrap();
                assert!(above(hit).abs() < 1e-6, "{}: {hit} is not on the surface", kind.name());
                assert!(hit <= first + 1e-6 && hit > first - 0.05, "{}: {hit} {first}", kind.name());
            }
        }
    }
}
