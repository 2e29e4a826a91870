//! Candidates: everything that a pixel could see if its centre moved a little, and no more.

use crate::{over_earth, over_plane, straight_on, view};
use glam::{DMat4, DVec2, DVec3};
use ortelius::model::mesh;
use ortelius::reference::{Candidates, ReferenceView};
use proptest::prelude::*;

proptest! {
    // Slow: all pixels' candidates for seven pictures a case.
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// A moved centre's triangle, or the background, is among the candidates.
    #[test]
    fn candidates_contain_what_a_moved_centre_sees(
        latitude_deg in -90.0..90.0f64, longitude_deg in -180.0..180.0f64,
        altitude_log10 in 5.0..7.3f64, tilt_deg in 0.0..95.0f64,
        moves in proptest::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 6),
        radius_px in 0.01..2.0f64,
    ) {
        let earth = mesh::earth(40, 20);
        let (pose, size) = (over_earth(latitude_deg, longitude_deg, 10f64.powf(altitude_log10), tilt_deg), [24, 14]);
        let to_clip = pose.world_to_clip(size[0], size[1]);
        let here = ReferenceView::new(&earth, &to_clip, pose.eye, size);
        let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
        let candidates: Vec<Candidates> = pixels.map(|(x, y)| here.candidates(x, y, radius_px)).collect();
        for (x_part, y_part) in moves {
            // If the picture moves by -d, the point that was at +d comes to the pixel's centre.
            let shift = DVec2::new(-x_part, -y_part) * radius_px * 2.0 / DVec2::new(24.0, 14.0);
            let shear = DMat4::from_cols_array(&[
                1.0, 0.0, 0.0, 0.0,  0.0, 1.0, 0.0, 0.0,  0.0, 0.0, 1.0, 0.0,  shift.x, shift.y, 0.0, 1.0,
            ]);
            let moved = ReferenceView::new(&earth, &(shear * to_clip), pose.eye, size);
            for y in 0..size[1] {
                for x in 0..size[0] {
                    let candidates = &candidates[(y * size[0] + x) as usize];
                    match moved.sample(x, y) {
                        None => prop_assert!(candidates.background, "({}, {})", x, y),
                        Some(seen) => prop_assert!(
                            candidates.samples.iter().any(|sample| sample.triangle == seen.triangle),
                            "({}, {}): {:?} not among {:?}", x, y, seen, candidates
                        ),
                    }
                }
            }
        }
    }
}

#[test]
fn the_nearer_of_two_planes_is_seen_and_the_farther_is_not_a_candidate() {
    let mut both = mesh::plane(1000.0, 1000.0, 1, 1);
    let upper = mesh::plane(1000.0, 1000.0, 1, 1);
    let first = both.positions.len() as u32;
    both.positions.extend(upper.positions.iter().map(|&position| position + DVec3::Z));
    both.coordinates.extend(upper.coordinates.iter().copied());
    both.triangles.extend(upper.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
    let view = view(&both, &over_plane(3.0, 0.0, 10.0, 0.0), [16, 16]);
    for y in 0..16 {
        for x in 0..16 {
            assert!(view.sample(x, y).unwrap().triangle >= 2);
            let candidates = view.candidates(x, y, 0.5);
            assert!(candidates.samples.iter().all(|sample| sample.triangle >= 2), "{candidates:?}");
            assert!(!candidates.background);
        }
    }
}

#[test]
fn candidates_are_one_inside_a_triangle_two_at_an_edge_and_never_the_earths_far_side() {
    let plane = mesh::plane(32.0, 32.0, 1, 1);
    let (to_clip, eye) = straight_on([32, 32]);
    let flat = ReferenceView::new(&plane, &to_clip, eye, [32, 32]);
    assert_eq!(flat.candidates(4, 4, 0.5).samples.len(), 1);
    // The diagonal runs through (15.5, 16.5) and equivalent points.
    assert_eq!(flat.candidates(15, 16, 0.01).samples.len(), 2);
    assert_eq!(flat.candidates(15, 18, 0.01).samples.len(), 1);
    assert!(!flat.candidates(0, 9, 0.49).background && flat.candidates(0, 9, 0.51).background);

    let earth = mesh::earth(120, 60);
    let pose = over_earth(0.0, 0.0, 2e7, 0.0);
    let view = view(&earth, &pose, [64, 64]);
    let mut limb = 0;
    for y in 0..64 {
        for x in 0..64 {
            let candidates = view.candidates(x, y, 0.25);
            limb += usize::from(candidates.background && !candidates.samples.is_empty());
            for sample in &candidates.samples {
                let corners = earth.triangles[sample.triangle as usize];
                let nearest = corners
                    .map(|vertex| earth.positions[vertex as usize].distance(pose.eye))
                    .into_iter()
                    .fold(f64::INFINITY, f64::min);
                // The horizon is at sqrt(d^2 - R^2); a triangle there is 330 km long.
                let horizon_m = (pose.eye.length().powi(2) - 6.37e6f64.powi(2)).sqrt();
                assert!(nearest < horizon_m + 4e5, "({x}, {y}) sees through the earth: {sample:?}");
            }
        }
    }
    assert!(limb > 20, "{limb} pixels at the limb");
}
