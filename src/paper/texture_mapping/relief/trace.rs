//! Tracers of view rays through a relief in f32 on the CPU, with the GPU's operations in the GPU's order.

use super::maps::DistanceMap;
use super::{Ray, Relief};

/// The least step of the distance-map tracer, in texels.
pub const LEAST_STEP: f32 = 0.5;

/// Bisection steps after a crossing is found.
pub const HALVINGS: u32 = 6;

/// The most steps of a ray.
pub const MOST_STEPS: u32 = 1024;

/// Steps of the linear search.
pub const LINEAR_STEPS: u32 = 64;

/// How rays are traced.
#[derive(Clone, Copy, Debug)]
pub enum Tracer<'a> {
    /// [`LINEAR_STEPS`] equal steps to the floor, then [`HALVINGS`] bisections.
    Linear,
    /// By a distance map with this many bits per cell.
    Distances(&'a DistanceMap, u32),
    /// By a cone map; a cell uses the smallest cone of its corners.
    Cones(&'a [f32]),
    /// As `Cones`; a step may end below the surface and is then bisected back.
    RelaxedCones(&'a [f32]),
}

/// What a tracer found.
#[derive(Clone, Debug, PartialEq)]
pub struct Traced {
    /// Along the ray, in texels.
    pub distance: f32,
    /// Lookups of the map, without bisections.
    pub steps: u32,
}

/// The ray's point at a distance.
pub fn point(relief: &Relief, ray: &Ray, t: f32) -> [f32; 3] {
    let [dx, dy, dz] = ray.direction;
    [ray.origin[0] + t * dx, ray.origin[1] + t * dy, relief.depth + t * dz]
}

/// Height of a point above the surface.
pub fn above(relief: &Relief, [x, y, z]: [f32; 3]) -> f32 {
    let ([i, j], [fx, fy]) = ([x.floor(), y.floor()], [x - x.floor(), y - y.floor()]);
    let [a, b, c, d] = relief.corners(i as i64, j as i64);
    let (near, far) = (a + (b - a) * fx, c + (d - c) * fx);
    z - (near + (far - near) * fy)
}

/// Steps by the map. `step` receives each step's start, its end, and true if the map guarantees that the step hits
/// nothing (the map's distance is at least [`LEAST_STEP`]).
pub fn by_distances(
    relief: &Relief,
    map: &DistanceMap,
    ray: &Ray,
    mut step: impl FnMut(f32, f32, bool),
) -> Traced {
    let layer_inverse = map.layers as f32 / relief.depth;
    let side = relief.side as i64;
    let (mut t, mut steps) = (0.0, 0);
    while steps < MOST_STEPS {
        let at = point(relief, ray, t);
        let layer = ((at[2] * layer_inverse) as usize).min(map.layers - 1);
        let wrap = |c: f32| (c.floor() as i64).rem_euclid(side) as usize;
        let length = map.distances[(layer * relief.side + wrap(at[1])) * relief.side + wrap(at[0])];
        steps += 1;
        let next = t + length.max(LEAST_STEP);
        step(t, next, length >= LEAST_STEP);
        if length < LEAST_STEP && above(relief, point(relief, ray, next)) <= 0.0 {
            return Traced { distance: halve(relief, ray, t, next), steps };
        }
        t = next;
    }
    Traced { distance: t, steps }
}

/// Bisects to the crossing between a point above the surface and one below.
fn halve(relief: &Relief, ray: &Ray, mut above_at: f32, mut below_at: f32) -> f32 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (above_at + below_at);
        match above(relief, point(relief, ray, middle)) > 0.0 {
            true => above_at = middle,
            false => below_at = middle,
        }
    }
    below_at
}
