//! Planes and the earth, whose coordinates and derivatives are known in closed form.

use crate::{on_plane, over_earth, over_plane, ray, view};
use glam::{DMat4, DVec2, DVec3};
use ortelius::math::geodesy;
use ortelius::model::mesh::{self, SourceMesh};
use ortelius::paper::virtual_texture::reference::stage1::snapping;
use ortelius::reference::{ReferenceView, Sample};

#[test]
fn a_plane_seen_straight_on_has_exact_derivatives() {
    let (size, sides_m) = ([64, 36], [4000.0, 2000.0]);
    let plane = mesh::plane(sides_m[0], sides_m[1], 7, 5);
    let pose = over_plane(100.0, -50.0, 500.0, 0.0);
    let pixel_m = 2.0 * 500.0 * 30f64.to_radians().tan() / 36.0;
    for sample in view(&plane, &pose, size).samples() {
        let sample = sample.expect("the plane fills the picture");
        for derivatives in [sample.fine, sample.analytic] {
            // A rounding of 1e-16 in s over a difference of 4e-3.
            assert!((derivatives.dsdx / (pixel_m / 4000.0) - 1.0).abs() < 1e-11, "{sample:?}");
            assert!((derivatives.dtdy / (pixel_m / 2000.0) - 1.0).abs() < 1e-11, "{sample:?}");
            assert!(derivatives.dtdx.abs() < 1e-15 && derivatives.dsdy.abs() < 1e-15, "{sample:?}");
        }
        assert!((sample.w_m - 500.0).abs() < 1e-9);
    }
}

#[test]
fn a_tilted_plane_follows_the_hyperbola_of_perspective() {
    let (size, sides_m) = ([65, 37], [80_000.0, 40_000.0]);
    let plane = mesh::plane(sides_m[0], sides_m[1], 16, 8);
    let pose = over_plane(3000.0, -15_000.0, 700.0, 70.0);
    let view = view(&plane, &pose, size);
    let at = |x_px: f64, y_px: f64| on_plane(&pose, size, sides_m, x_px, y_px);
    let (mut seen, mut sky) = (0, 0);
    for y in 0..size[1] {
        for x in 0..size[0] {
            let (x_px, y_px) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
            let truth = at(x_px, y_px);
            let below_horizon = ray(&pose, size, x_px, y_px).z < 0.0;
            let inside = below_horizon && truth.clamp(DVec2::ZERO, DVec2::ONE) == truth;
            let Some(sample) = view.sample(x, y) else {
                assert!(!inside, "({x}, {y}) is not covered");
                sky += 1;
                continue;
            };
            assert!(inside, "({x}, {y}) is covered");
            seen += 1;
            assert!((DVec2::new(sample.s, sample.t) - truth).length() < 1e-11, "{sample:?} {truth}");
            let (left, top) = (f64::from(x & !1) + 0.5, f64::from(y & !1) + 0.5);
            let by_x = at(left + 1.0, y_px) - at(left, y_px);
            let by_y = at(x_px, top + 1.0) - at(x_px, top);
            let fine = [sample.fine.dsdx, sample.fine.dtdx, sample.fine.dsdy, sample.fine.dtdy];
            for (value, true_value) in fine.into_iter().zip([by_x.x, by_x.y, by_y.x, by_y.y]) {
                assert!((value - true_value).abs() < 1e-10 * by_y.length(), "({x}, {y}): {sample:?}");
            }
            // The error of a central difference over 2^-10 pixel follows from the third derivative: 1e-6 of the first
            // derivative.
            let half = 1.0 / 2048.0;
            let slope = (at(x_px, y_px + half) - at(x_px, y_px - half)) / (2.0 * half);
            let error = (DVec2::new(sample.analytic.dsdy, sample.analytic.dtdy) - slope).length();
            assert!(error < 1e-5 * slope.length(), "({x}, {y}): {sample:?}, slope {slope}");
        }
    }
    assert!(seen > 500 && sky > 500, "{seen} pixels of plane, {sky} of sky");
}

#[test]
fn a_quad_shares_its_differences_along_its_own_row_only() {
    let plane = mesh::plane(80_000.0, 40_000.0, 1, 1);
    let view = view(&plane, &over_plane(0.0, -15_000.0, 700.0, 60.0), [64, 36]);
    let fine = |x, y| view.sample(x, y).unwrap().fine;
    assert_eq!(fine(30, 30).dsdx, fine(31, 30).dsdx);
    assert_eq!(fine(30, 30).dtdy, fine(30, 31).dtdy);
    assert_ne!(fine(30, 30).dsdx, fine(30, 31).dsdx, "coarse derivatives would be equal");
    assert_ne!(fine(30, 31).dtdy, fine(30, 32).dtdy);
}

#[test]
fn the_earths_disc_ends_at_its_horizon() {
    // Seen from above the pole, the ellipsoid's silhouette is a circle, at which tangents from (0, z) touch the
    // ellipse.
    let (earth, size) = (mesh::earth(360, 180), [256, 256]);
    let pose = over_earth(90.0, 0.0, 1e7, 0.0);
    let (a, b, z) = (geodesy::EQUATOR_RADIUS_M, geodesy::POLE_RADIUS_M, pose.eye.z);
    let touch_radius_m = a * (1.0 - (b / z).powi(2)).sqrt();
    let tangent = touch_radius_m / (z - b * b / z);
    let radius_px = tangent / 30f64.to_radians().tan() * 128.0;
    let samples = view(&earth, &pose, size).samples();
    // With 360 chords to a circle, a chord lies up to 1 - cos(pi / 360) = 4e-5 of the radius below the surface: 0.003
    // pixel.
    let slack_px = 0.01;
    let mut at_the_limb = 0;
    for (index, sample) in samples.iter().enumerate() {
        let place = DVec2::new((index % 256) as f64 - 127.5, (index / 256) as f64 - 127.5);
        if (place.length() - radius_px).abs() < slack_px {
            at_the_limb += 1;
        } else {
            assert_eq!(sample.is_some(), place.length() < radius_px, "{place}, radius {radius_px}");
        }
    }
    assert!(radius_px > 60.0 && at_the_limb < 50, "{radius_px} {at_the_limb}");
    // The nearest surface won: the pole's side, not Antarctica.
    assert!(samples.iter().flatten().all(|sample| sample.t < 0.5));
}

#[test]
fn the_pixel_above_a_pole_and_the_seam_belong_to_the_right_columns() {
    let earth = mesh::earth(36, 18);
    let samples = view(&earth, &over_earth(0.0, 180.0, 1e6, 0.0), [16, 16]).samples();
    for (index, sample) in samples.iter().enumerate() {
        let sample = sample.expect("the earth fills the picture");
        let east_of_the_seam = index % 16 >= 8;
        assert!(if east_of_the_seam { sample.s < 0.1 } else { sample.s > 0.9 }, "{index}: {sample:?}");
        assert!(sample.fine.dsdx > 0.0 && sample.fine.dsdx < 0.05, "no jump at the seam: {sample:?}");
    }
    let samples = view(&earth, &over_earth(-90.0, 0.0, 1e6, 0.0), [15, 15]).samples();
    let columns: std::collections::BTreeSet<u32> =
        samples.iter().map(|sample| (sample.unwrap().s * 36.0) as u32).collect();
    assert!(columns.len() > 30, "the pole sees {} columns", columns.len());
}

#[test]
fn a_triangle_behind_and_before_the_eye_is_seen_where_it_is() {
    // Two triangles of 2000 km; the eye is 2 m above their middle and looks at the horizon.
    let (size, sides_m) = ([32, 32], [2e6, 2e6]);
    let (two, many) = (mesh::plane(2e6, 2e6, 1, 1), mesh::plane(2e6, 2e6, 50, 50));
    let pose = over_plane(10.0, 20.0, 2.0, 90.0);
    let (few, fine) = (view(&two, &pose, size), view(&many, &pose, size));
    for y in 0..32 {
        for x in 0..32 {
            let (coarse, divided): (Option<Sample>, Option<Sample>) = (few.sample(x, y), fine.sample(x, y));
            if y < 16 {
                assert_eq!((coarse, divided), (None, None), "({x}, {y}) is sky");
                continue;
            }
            let truth = on_plane(&pose, size, sides_m, f64::from(x) + 0.5, f64::from(y) + 0.5);
            for sample in [coarse.unwrap(), divided.unwrap()] {
                assert!((DVec2::new(sample.s, sample.t) - truth).length() < 1e-12, "{sample:?} {truth}");
            }
        }
    }
}

#[test]
fn a_mesh_wholly_behind_the_eye_is_not_seen() {
    let plane = mesh::plane(100.0, 100.0, 3, 3);
    let up = over_plane(0.0, 0.0, 10.0, 180.0);
    assert!(view(&plane, &up, [8, 8]).samples().iter().all(Option::is_none));
    let down = over_plane(0.0, 0.0, 10.0, 0.0);
    assert!(view(&plane, &down, [8, 8]).samples().iter().all(Option::is_some));
}

#[test]
fn triangles_without_area_are_never_seen() {
    let mut plane = mesh::plane(100.0, 100.0, 2, 2);
    let clean = view(&plane, &over_plane(0.0, 0.0, 10.0, 40.0), [16, 16]).samples();
    plane.triangles.extend([[0, 0, 1], [3, 3, 3], [0, 1, 2], [3, 4, 5]]);
    assert_eq!(view(&plane, &over_plane(0.0, 0.0, 10.0, 40.0), [16, 16]).samples(), clean);
}

/// With legs of 50 pixels the altitude is 50 / sqrt(2), and snapping the vertices changes gradients by 1.1e-4. At a
/// hundredth of the size it changes them by 1.1 %.
#[test]
fn the_altitude_is_that_on_the_longest_side() {
    for (side, altitude_px) in [(1.0, 35.355), (0.01, 0.353_55)] {
        let positions = [[0.0, 0.0], [side, 0.0], [0.0, side]].map(|[x, y]| DVec3::new(x, y, 0.5));
        let coordinates = vec![DVec2::ZERO, DVec2::X, DVec2::Y];
        let mesh = SourceMesh {
            positions: positions.to_vec(),
            coordinates,
            triangles: vec![[0, 1, 2]],
            curvature: 0.0,
        };
        // Both triangles cover the centre of pixel (50, 50), (0.01, 0.01) in device coordinates.
        let eye = DVec3::new(0.25 * side - 0.01, 0.25 * side - 0.01, 0.0);
        let view = ReferenceView::new(&mesh, &DMat4::IDENTITY, eye, [100, 100]);
        let sample = view.sample(50, 50).unwrap();
        assert!((sample.altitude_px / altitude_px - 1.0).abs() < 1e-4, "{}", sample.altitude_px);
        let change = snapping(&sample);
        assert!((change * 256.0 * altitude_px - 1.0).abs() < 1e-4, "{change}");
    }
}
