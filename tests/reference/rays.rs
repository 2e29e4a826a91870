//! The rasteriser against ray tracing; and adjacent triangles leave no hole and no overlap.

use crate::{camera, ray, straight_on, view};
use glam::{DVec2, DVec3};
use ortelius::model::mesh::{self, SourceMesh};
use ortelius::reference::rasterise;
use ortelius::scene::camera::{Camera, GroundPoint};
use proptest::prelude::*;

/// The nearest triangle along a ray, with (s, t) (Moeller and Trumbore 1997): a method independent of the rasteriser.
/// The last value is the smallest barycentric coordinate; near 0 the point is on an edge.
fn trace(mesh: &SourceMesh, eye: DVec3, direction: DVec3) -> Option<(u32, DVec2, f64)> {
    let mut nearest: Option<(f64, u32, DVec2, f64)> = None;
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
        let (ab, ac, to_eye) = (b - a, c - a, eye - a);
        let normal = direction.cross(ac);
        let determinant = ab.dot(normal);
        if determinant == 0.0 {
            continue;
        }
        let u = to_eye.dot(normal) / determinant;
        let v = direction.dot(to_eye.cross(ab)) / determinant;
        let distance = ac.dot(to_eye.cross(ab)) / determinant;
        let min = u.min(v).min(1.0 - u - v);
        if min >= 0.0 && distance > 0.0 && nearest.is_none_or(|(before, ..)| distance < before) {
            let [sa, sb, sc] = triangle.map(|vertex| mesh.coordinates[vertex as usize]);
            nearest = Some((distance, index as u32, sa + (sb - sa) * u + (sc - sa) * v, min));
        }
    }
    nearest.map(|(_, index, coordinate, min)| (index, coordinate, min))
}

/// A jittered grid of triangles that fills the picture, in a plane straight ahead.
fn jittered(shifts: &[(i32, i32)], quads: usize, steps: f64) -> SourceMesh {
    let mut mesh = mesh::plane(32.0, 32.0, quads as u32, quads as u32);
    let columns = quads + 1;
    for row in 1..quads {
        for column in 1..quads {
            let (x, y) = shifts[row * columns + column];
            mesh.positions[row * columns + column] += DVec3::new(f64::from(x), f64::from(y), 0.0) / steps;
        }
    }
    mesh
}

fn alone(mesh: &SourceMesh, triangle: usize) -> SourceMesh {
    SourceMesh { triangles: vec![mesh.triangles[triangle]], ..mesh.clone() }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Corners on quarters of a pixel: many centres lie exactly on an edge or a corner.
    #[test]
    fn adjacent_triangles_leave_no_hole_and_no_overlap(
        shifts in proptest::collection::vec((-3..=3i32, -3..=3i32), 81),
        // Up to 0.75 pixel each way: with 1 pixel a triangle of 4 x 4 pixels could fold over.
        steps in prop_oneof![Just(4.0), Just(8.0), Just(7.3)],
    ) {
        let mesh = jittered(&shifts, 8, steps);
        let (to_clip, eye) = straight_on([32, 32]);
        let mut covered = vec![0; 32 * 32];
        for triangle in 0..mesh.triangles.len() {
            for (count, sample) in covered.iter_mut().zip(rasterise(&alone(&mesh, triangle), &to_clip, eye, [32, 32])) {
                *count += u32::from(sample.is_some());
            }
        }
        prop_assert!(covered.iter().all(|&count| count == 1), "{:?}", covered);
    }

    /// An independent method finds the same triangle and coordinate for every eye and tilt.
    #[test]
    fn the_rasteriser_agrees_with_ray_tracing(
        latitude_deg in -90.0..90.0f64, longitude_deg in -180.0..180.0f64,
        altitude_log10 in 4.0..8.0f64, heading_deg in 0.0..360.0f64, tilt_deg in 0.0..100.0f64,
    ) {
        let earth = mesh::earth(24, 12);
        // With chords of 15 degrees the mesh is up to 110 km below the ellipsoid.
        let place = GroundPoint::Planet { latitude_deg, longitude_deg };
        let pose = Camera { heading_deg, ..camera(place, 10f64.powf(altitude_log10), tilt_deg) }.pose();
        let size = [20, 12];
        let view = view(&earth, &pose, size);
        for y in 0..size[1] {
            for x in 0..size[0] {
                let direction = ray(&pose, size, f64::from(x) + 0.5, f64::from(y) + 0.5);
                let traced = trace(&earth, pose.eye, direction);
                let sample = view.sample(x, y);
                match (sample, traced) {
                    (None, None) => {}
                    (Some(sample), Some((triangle, coordinate, min))) if min > 1e-9 => {
                        prop_assert_eq!(sample.triangle, triangle);
                        let error = (DVec2::new(sample.s, sample.t) - coordinate).length();
                        prop_assert!(error < 1e-9, "{:?} {}", sample, coordinate);
                    }
                    // On an edge either result is correct.
                    (_, Some((_, _, min))) if min <= 1e-9 => {}
                    other => prop_assert!(false, "({}, {}): {:?}", x, y, other),
                }
            }
        }
    }

}

#[test]
fn a_hole_is_detected() {
    let shifts = vec![(1, -2); 81];
    let mut mesh = jittered(&shifts, 8, 4.0);
    let (to_clip, eye) = straight_on([32, 32]);
    let count = |mesh: &SourceMesh| rasterise(mesh, &to_clip, eye, [32, 32]).iter().flatten().count();
    assert_eq!(count(&mesh), 1024);
    mesh.triangles.remove(40);
    assert!(count(&mesh) < 1024 && count(&mesh) > 1000);
}
