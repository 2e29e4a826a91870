//! Tracers of view rays through a relief in f32 on the CPU, with the GPU's operations in the GPU's order.

use super::maps::DistanceMap;
use super::{Ray, Relief};

/// The least step of the tracers that read a map, in texels.
pub const MIN_STEP: f32 = 0.5;

/// Bisection steps after a crossing is found; [`Tracer::RelaxedCones`] takes [`RELAXED_HALVINGS`].
pub const HALVINGS: u32 = 6;
pub const RELAXED_HALVINGS: u32 = 12;

/// The most steps of a ray.
pub const MAX_STEPS: u32 = 1024;

/// Steps of the linear search.
pub const LINEAR_STEPS: u32 = 64;

/// How rays are traced.
#[derive(Clone, Copy, Debug)]
pub enum Tracer<'a> {
    /// [`LINEAR_STEPS`] equal steps to the floor, then [`HALVINGS`] bisections.
    Linear,
    /// Steps by the distances of a distance map with this many bits per cell.
    Distances(&'a DistanceMap, u32),
    /// Steps by the cones of a cone map; a cell uses the smallest cone of its corners. Between texels the surface may
    /// reach into a cone.
    Cones(&'a [f32]),
    /// As `Cones`; a step may end below the surface and is then bisected back.
    RelaxedCones(&'a [f32]),
}

/// A [`Tracer`] without its map: `TRACER` of relief_ray.glsl.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TracerKind {
    Linear,
    Distances,
    Cones,
    RelaxedCones,
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

impl Tracer<'_> {
    pub fn kind(&self) -> TracerKind {
        match self {
            Tracer::Linear => TracerKind::Linear,
            Tracer::Distances(..) => TracerKind::Distances,
            Tracer::Cones(_) => TracerKind::Cones,
            Tracer::RelaxedCones(_) => TracerKind::RelaxedCones,
        }
    }

    /// The longest step that the tracer takes from a point.
    fn allowed(&self, relief: &Relief, ray: &Ray, at: [f32; 3]) -> f32 {
        let side = relief.side as i64;
        let [i, j] = [at[0], at[1]].map(|c| c.floor() as i64);
        let place = |i: i64, j: i64| (j.rem_euclid(side) * side + i.rem_euclid(side)) as usize;
        let [x, y, z] = ray.direction;
        match self {
            Tracer::Linear => -relief.depth / z / LINEAR_STEPS as f32,
            Tracer::Distances(map, _) => {
                let layer = ((at[2] * (map.layers as f32 / relief.depth)) as usize).min(map.layers - 1);
                map.distances[layer * relief.side * relief.side + place(i, j)]
            }
            Tracer::Cones(cones) | Tracer::RelaxedCones(cones) => {
                let corners = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[a, b]| cones[place(i + a, j + b)]);
                let cone = corners.into_iter().fold(f32::INFINITY, f32::min);
                cone * above(relief, at).max(0.0) / ((x * x + y * y).sqrt() - cone * z)
            }
        }
    }
}

/// Traces a ray. The distances of a [`DistanceMap`] are used as stored; the number of bits per cell has no effect here.
/// `step` receives each step's start, its end, and true if the map guarantees that the step hits nothing (the map
/// allows a step of at least [`MIN_STEP`]).
pub fn traced(
    relief: &Relief,
    tracer: &Tracer<'_>,
    ray: &Ray,
    mut step: impl FnMut(f32, f32, bool),
) -> Traced {
    let by_map = matches!(tracer, Tracer::Distances(..));
    let halvings = if matches!(tracer, Tracer::RelaxedCones(_)) { RELAXED_HALVINGS } else { HALVINGS };
    let (mut t, mut steps) = (0.0, 0);
    while steps < MAX_STEPS {
        let length = tracer.allowed(relief, ray, point(relief, ray, t));
        let guaranteed = by_map && length >= MIN_STEP;
        let next = t + if matches!(tracer, Tracer::Linear) { length } else { length.max(MIN_STEP) };
        steps += 1;
        step(t, next, guaranteed);
        if !guaranteed && above(relief, point(relief, ray, next)) <= 0.0 {
            return Traced { distance: halve(relief, ray, [t, next], halvings), steps };
        }
        t = next;
    }
    Traced { distance: t, steps }
}

/// Bisects to the crossing between a point above the surface and one below.
fn halve(relief: &Relief, ray: &Ray, [mut above_at, mut below_at]: [f32; 2], halvings: u32) -> f32 {
    for _ in 0..halvings {
        let middle = 0.5 * (above_at + below_at);
        match above(relief, point(relief, ray, middle)) > 0.0 {
            true => above_at = middle,
            false => below_at = middle,
        }
    }
    below_at
}
