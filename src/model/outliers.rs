//! Finds invalid vertices of a file (not finite, or outliers), and the precision of the valid ones.

use super::{MeshReport, Raw};
use glam::DVec3;
use std::collections::HashSet;

/// f32 ends at 3.4e38. Up to 1e36, products with the coefficients of a view's matrix are still finite.
const FARTHEST: f64 = 1e36;
/// Positions are stored as f32 relative to the centre of the box. If one vertex is 1000 times as far out as the others,
/// the others keep only about 15 of their 24 bits.
const OUTLYING: f64 = 1000.0;
/// A vertex 100 times as far out as nearly all others is a spike if none of its neighbours is as far out. A spike is
/// not part of the shape.
const SPIKE: f64 = 100.0;
/// With fewer vertices, outliers cannot be recognised.
const FEWEST_FOR_OUTLIERS: usize = 64;
/// Fewer f32 steps than this across a mesh are reported: half a step is then more than 1/8192 of the box.
const FEW_STEPS: f64 = 4096.0;

/// For each vertex, true if it may be part of a shape.
pub(super) fn usable(raw: &Raw, report: &mut MeshReport) -> Vec<bool> {
    let fits = |position: &DVec3| position.is_finite() && position.abs().max_element() <= FARTHEST;
    let mut usable: Vec<bool> = raw.positions.iter().map(fits).collect();
    report.non_finite_vertices = usable.iter().filter(|fits| !**fits).count();
    if let Some(far) = far_out(&raw.positions, &usable) {
        set_aside(raw, &far, &mut usable, report);
    }
    report.f32_steps = f32_steps(&raw.positions, &usable);
    usable
}

/// Distance of each vertex from the median, in multiples of the distance within which 999 of 1000 vertices lie; 0 for
/// unusable vertices. `None` if there are too few usable vertices, or if nearly all coincide.
fn far_out(positions: &[DVec3], usable: &[bool]) -> Option<Vec<f64>> {
    let fitting: Vec<DVec3> =
        positions.iter().zip(usable).filter(|(_, fits)| **fits).map(|(p, _)| *p).collect();
    if fitting.len() < FEWEST_FOR_OUTLIERS {
        return None;
    }
    // Medians, because outliers would shift a mean.
    let middle = |axis: usize| {
        let mut values: Vec<f64> = fitting.iter().map(|p| p[axis]).collect();
        let half = values.len() / 2;
        *values.select_nth_unstable_by(half, f64::total_cmp).1
    };
    let centre = DVec3::from_array(std::array::from_fn(middle));
    let distance = |position: &DVec3| (*position - centre).abs().max_element();
    let mut distances: Vec<f64> = fitting.iter().map(distance).collect();
    let rank = (distances.len() - 1) * 999 / 1000;
    let usual = *distances.select_nth_unstable_by(rank, f64::total_cmp).1;
    let far = |(position, &fits): (&DVec3, &bool)| if fits { distance(position) / usual } else { 0.0 };
    // If all others coincide, there is no shape to measure distances from.
    (usual > 0.0).then(|| positions.iter().zip(usable).map(far).collect())
}

/// Marks as unusable all vertices beyond [`OUTLYING`], and vertices beyond [`SPIKE`] that have no neighbour beyond it.
fn set_aside(raw: &Raw, far: &[f64], usable: &mut [bool], report: &mut MeshReport) {
    let place = |vertex: u32| (raw.positions[vertex as usize] + DVec3::ZERO).to_array().map(f64::to_bits);
    let is_far = |vertex: u32| far[vertex as usize] > SPIKE;
    if !far.iter().any(|&far| far > SPIKE) {
        return;
    }
    // Compared by position, because in a triangle soup several vertices lie at the same point.
    let mut accompanied: HashSet<[u64; 3]> = HashSet::new();
    for face in &raw.faces {
        for &vertex in face.iter().filter(|&&vertex| is_far(vertex)) {
            if face.iter().any(|&other| is_far(other) && place(other) != place(vertex)) {
                accompanied.insert(place(vertex));
            }
        }
    }
    for vertex in (0..raw.positions.len() as u32).filter(|&vertex| is_far(vertex)) {
        if far[vertex as usize] > OUTLYING || !accompanied.contains(&place(vertex)) {
            usable[vertex as usize] = false;
            report.outlying_vertices += 1;
        }
    }
}

/// The number of f32 steps across the box of a mesh, at its distance from the origin. `None` if there are at least
/// [`FEW_STEPS`] steps, or if the coordinates have more precision than f32.
fn f32_steps(positions: &[DVec3], usable: &[bool]) -> Option<usize> {
    let fitting = || positions.iter().zip(usable).filter(|(_, fits)| **fits).map(|(p, _)| *p);
    let (low, high) = fitting().fold((DVec3::MAX, DVec3::MIN), |(low, high), p| (low.min(p), high.max(p)));
    let max = low.abs().max(high.abs()).max_element();
    if fitting().next().is_none() || max == 0.0 {
        return None;
    }
    let step = 2.0_f64.powi((max.log2().floor() as i32 - 23).max(-149));
    let steps = (high - low).max_element() / step;
    let is_coarse = steps < FEW_STEPS && fitting().all(|p| p.as_vec3().as_dvec3() == p);
    is_coarse.then_some(steps as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Model, clean, generate};

    fn cleaned(raw: &Raw) -> (Model, MeshReport) {
        let (model, report) = clean(raw);
        model.check().unwrap_or_else(|broken| panic!("{broken} in {model:?}"));
        (model, report)
    }

    #[test]
    fn invalid_vertices_are_removed_with_their_faces() {
        let model = generate::grid(9, 0);
        for (value, finite) in [(f64::NAN, false), (f64::INFINITY, false), (1e300, false), (1e30, true)] {
            let mut raw =
                Raw { positions: model.positions.clone(), faces: model.faces.clone(), ..Raw::default() };
            raw.positions[40].x = value;
            let (left, report) = cleaned(&raw);
            assert_eq!(
                (report.non_finite_vertices, report.outlying_vertices),
                (usize::from(!finite), usize::from(finite))
            );
            // Vertex 40 is in the middle: removing its six faces leaves a hole.
            assert_eq!((report.faces_set_aside, left.faces.len()), (6, 122));
            assert_eq!(report.topology.boundary_edges, 32 + 6);
        }
    }

    #[test]
    fn a_spike_is_removed_and_a_distant_group_stays() {
        let model = generate::grid(33, 0);
        let mut raw =
            Raw { positions: model.positions.clone(), faces: model.faces.clone(), ..Raw::default() };
        raw.positions[500] *= 300.0;
        let (left, report) = cleaned(&raw);
        assert_eq!((report.outlying_vertices, report.faces_set_aside, left.faces.len()), (1, 6, 2042));
        // Its neighbour is as far out, so it may be part of the shape.
        raw.positions[501] *= 300.0;
        let (left, report) = cleaned(&raw);
        assert_eq!((report.outlying_vertices, left.faces.len()), (0, 2048));
    }

    #[test]
    fn few_f32_steps_are_reported() {
        let model = generate::grid(9, 0);
        let steps = |offset: f64, single: bool| {
            let place = |&p: &DVec3| if single { (p + offset).as_vec3().as_dvec3() } else { p + offset };
            let positions = model.positions.iter().map(place).collect();
            clean(&Raw { positions, faces: model.faces.clone(), ..Raw::default() }).1.f32_steps
        };
        let extent = model.positions.iter().fold(DVec3::ZERO, |max, p| max.max(p.abs())).max_element();
        assert!(extent > 0.1, "{extent}");
        // A grid around 0 has millions of steps.
        assert_eq!((steps(0.0, true), steps(1e6, false)), (None, None));
        assert!(steps(1e6, true).is_some_and(|steps| steps < 4096));
    }
}
