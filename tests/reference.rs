//! The reference rasteriser against things known in closed form, and against rays.

use glam::{DMat4, DVec2, DVec3};
use ortelius::math::camera::Pose;
use ortelius::math::geodesy;
use ortelius::reference::{Candidates, Sample, View, rasterise};
use ortelius::scene::camera::{Camera, Place};
use ortelius::scene::mesh::{self, SourceMesh};
use proptest::prelude::*;

fn camera(place: Place, altitude_m: f64, tilt_deg: f64) -> Camera {
    Camera { place, altitude_m, heading_deg: 0.0, tilt_deg, vertical_fov_deg: 60.0, magnification: 1.0 }
}

fn over_plane(east_m: f64, north_m: f64, altitude_m: f64, tilt_deg: f64) -> Pose {
    camera(Place::Plane { east_m, north_m }, altitude_m, tilt_deg).pose()
}

fn over_earth(latitude_deg: f64, longitude_deg: f64, altitude_m: f64, tilt_deg: f64) -> Pose {
    camera(Place::Planet { latitude_deg, longitude_deg }, altitude_m, tilt_deg).pose()
}

fn view(mesh: &SourceMesh, pose: &Pose, size: [u32; 2]) -> View {
    View::new(mesh, &pose.world_to_clip(size[0], size[1]), pose.eye, size)
}

/// The direction of the ray through a point of the picture (in pixels), from the pinhole's geometry.
fn ray(pose: &Pose, size: [u32; 2], x_px: f64, y_px: f64) -> DVec3 {
    let [width, height] = size.map(f64::from);
    let pixel = 2.0 * (0.5 * pose.vertical_fov_rad).tan() / height;
    pose.forward + pose.right * ((x_px - width / 2.0) * pixel) - pose.up * ((y_px - height / 2.0) * pixel)
}

/// (s, t) of a plane of the given sides where the ray meets it, covered or not.
fn on_plane(pose: &Pose, size: [u32; 2], sides_m: [f64; 2], x_px: f64, y_px: f64) -> DVec2 {
    let direction = ray(pose, size, x_px, y_px);
    let point = pose.eye - direction * (pose.eye.z / direction.z);
    DVec2::new(point.x / sides_m[0] + 0.5, 0.5 - point.y / sides_m[1])
}

/// Nearest triangle along a ray and (s, t) there (Moeller and Trumbore 1997): another method than the
/// rasteriser's. The last value is the smallest barycentric coordinate: near 0 an edge decides.
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
        let least = u.min(v).min(1.0 - u - v);
        if least >= 0.0 && distance > 0.0 && nearest.is_none_or(|(before, ..)| distance < before) {
            let [sa, sb, sc] = triangle.map(|vertex| mesh.coordinates[vertex as usize]);
            nearest = Some((distance, index as u32, sa + (sb - sa) * u + (sc - sa) * v, least));
        }
    }
    nearest.map(|(_, index, coordinate, least)| (index, coordinate, least))
}

#[test]
fn a_plane_seen_straight_on_has_exact_derivatives() {
    let (size, sides_m) = ([64, 36], [4000.0, 2000.0]);
    let plane = mesh::plane(sides_m[0], sides_m[1], 7, 5).unwrap();
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
    let plane = mesh::plane(sides_m[0], sides_m[1], 16, 8).unwrap();
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
            // Central difference over 2^-10 pixel: wrong by the third derivative, 1e-6 of the first.
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
    let plane = mesh::plane(80_000.0, 40_000.0, 1, 1).unwrap();
    let view = view(&plane, &over_plane(0.0, -15_000.0, 700.0, 60.0), [64, 36]);
    let fine = |x, y| view.sample(x, y).unwrap().fine;
    assert_eq!(fine(30, 30).dsdx, fine(31, 30).dsdx);
    assert_eq!(fine(30, 30).dtdy, fine(30, 31).dtdy);
    assert_ne!(fine(30, 30).dsdx, fine(30, 31).dsdx, "coarse derivatives would be equal");
    assert_ne!(fine(30, 31).dtdy, fine(30, 32).dtdy);
}

#[test]
fn the_earths_disc_ends_at_its_horizon() {
    // From above the pole the ellipsoid's silhouette is a circle: tangent from (0, z) to the ellipse.
    let (earth, size) = (mesh::earth(360, 180).unwrap(), [256, 256]);
    let pose = over_earth(90.0, 0.0, 1e7, 0.0);
    let (a, b, z) = (geodesy::EQUATOR_RADIUS_M, geodesy::POLE_RADIUS_M, pose.eye.z);
    let touch_radius_m = a * (1.0 - (b / z).powi(2)).sqrt();
    let tangent = touch_radius_m / (z - b * b / z);
    let radius_px = tangent / 30f64.to_radians().tan() * 128.0;
    let samples = view(&earth, &pose, size).samples();
    // A chord of 360 lies up to 1 - cos(pi / 360) = 4e-5 below the surface: 0.003 pixel.
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
    let earth = mesh::earth(36, 18).unwrap();
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

/// A jittered grid of triangles that fills the picture, in a plane straight ahead.
fn jittered(shifts: &[(i32, i32)], quads: usize, steps: f64) -> SourceMesh {
    let mut mesh = mesh::plane(32.0, 32.0, quads as u32, quads as u32).unwrap();
    let columns = quads + 1;
    for row in 1..quads {
        for column in 1..quads {
            let (x, y) = shifts[row * columns + column];
            mesh.positions[row * columns + column] += DVec3::new(f64::from(x), f64::from(y), 0.0) / steps;
        }
    }
    mesh
}

/// One metre is one pixel, the plane's metre 0 the picture's middle.
fn straight_on(size: [u32; 2]) -> (DMat4, DVec3) {
    let pose = Pose {
        eye: DVec3::new(0.0, 0.0, f64::from(size[1])),
        right: DVec3::X,
        up: DVec3::Y,
        forward: -DVec3::Z,
        vertical_fov_rad: 2.0 * 0.5f64.atan(),
        near_m: 1.0,
    };
    (pose.world_to_clip(size[0], size[1]), pose.eye)
}

fn alone(mesh: &SourceMesh, triangle: usize) -> SourceMesh {
    SourceMesh { triangles: vec![mesh.triangles[triangle]], ..mesh.clone() }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Corners on quarters of a pixel: many centres lie exactly on an edge or a corner.
    #[test]
    fn triangles_that_meet_leave_no_hole_and_no_double(
        shifts in proptest::collection::vec((-3..=3i32, -3..=3i32), 81),
        // Up to 0.75 pixel each way: at 1 pixel a triangle of 4 x 4 pixels could fold over.
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

    /// Another method finds the same triangle and coordinate, whatever the eye and the tilt.
    #[test]
    fn the_rasteriser_sees_what_rays_meet(
        latitude_deg in -90.0..90.0f64, longitude_deg in -180.0..180.0f64,
        altitude_log10 in 4.0..8.0f64, heading_deg in 0.0..360.0f64, tilt_deg in 0.0..100.0f64,
    ) {
        let earth = mesh::earth(24, 12).unwrap();
        // With chords of 15 degrees the mesh lies up to 110 km below the ellipsoid.
        let place = Place::Planet { latitude_deg, longitude_deg };
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
                    (Some(sample), Some((triangle, coordinate, least))) if least > 1e-9 => {
                        prop_assert_eq!(sample.triangle, triangle);
                        let error = (DVec2::new(sample.s, sample.t) - coordinate).length();
                        prop_assert!(error < 1e-9, "{:?} {}", sample, coordinate);
                    }
                    // On an edge rounding decides.
                    (_, Some((_, _, least))) if least <= 1e-9 => {}
                    other => prop_assert!(false, "({}, {}): {:?}", x, y, other),
                }
            }
        }
    }

}

proptest! {
    // Slow: every pixel's candidates, seven pictures a case.
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// What a moved centre sees is among the candidates, and so is the background.
    #[test]
    fn candidates_hold_whatever_a_moved_centre_sees(
        latitude_deg in -90.0..90.0f64, longitude_deg in -180.0..180.0f64,
        altitude_log10 in 5.0..7.3f64, tilt_deg in 0.0..95.0f64,
        moves in proptest::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 6),
        radius_px in 0.01..2.0f64,
    ) {
        let earth = mesh::earth(40, 20).unwrap();
        let (pose, size) = (over_earth(latitude_deg, longitude_deg, 10f64.powf(altitude_log10), tilt_deg), [24, 14]);
        let to_clip = pose.world_to_clip(size[0], size[1]);
        let here = View::new(&earth, &to_clip, pose.eye, size);
        let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
        let candidates: Vec<Candidates> = pixels.map(|(x, y)| here.candidates(x, y, radius_px)).collect();
        for (x_part, y_part) in moves {
            // Moving the picture by -d shows at a pixel's centre what lies at +d.
            let shift = DVec2::new(-x_part, -y_part) * radius_px * 2.0 / DVec2::new(24.0, 14.0);
            let shear = DMat4::from_cols_array(&[
                1.0, 0.0, 0.0, 0.0,  0.0, 1.0, 0.0, 0.0,  0.0, 0.0, 1.0, 0.0,  shift.x, shift.y, 0.0, 1.0,
            ]);
            let moved = View::new(&earth, &(shear * to_clip), pose.eye, size);
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
fn a_hole_would_be_noticed() {
    let shifts = vec![(1, -2); 81];
    let mut mesh = jittered(&shifts, 8, 4.0);
    let (to_clip, eye) = straight_on([32, 32]);
    let count = |mesh: &SourceMesh| rasterise(mesh, &to_clip, eye, [32, 32]).iter().flatten().count();
    assert_eq!(count(&mesh), 1024);
    mesh.triangles.remove(40);
    assert!(count(&mesh) < 1024 && count(&mesh) > 1000);
}

#[test]
fn a_triangle_behind_and_before_the_eye_is_seen_where_it_is() {
    // Two triangles of 2000 km; the eye stands 2 m above their middle and looks at the horizon.
    let (size, sides_m) = ([32, 32], [2e6, 2e6]);
    let (two, many) = (mesh::plane(2e6, 2e6, 1, 1).unwrap(), mesh::plane(2e6, 2e6, 50, 50).unwrap());
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
    let plane = mesh::plane(100.0, 100.0, 3, 3).unwrap();
    let up = over_plane(0.0, 0.0, 10.0, 180.0);
    assert!(view(&plane, &up, [8, 8]).samples().iter().all(Option::is_none));
    let down = over_plane(0.0, 0.0, 10.0, 0.0);
    assert!(view(&plane, &down, [8, 8]).samples().iter().all(Option::is_some));
}

#[test]
fn triangles_without_area_are_never_seen() {
    let mut plane = mesh::plane(100.0, 100.0, 2, 2).unwrap();
    let clean = view(&plane, &over_plane(0.0, 0.0, 10.0, 40.0), [16, 16]).samples();
    plane.triangles.extend([[0, 0, 1], [3, 3, 3], [0, 1, 2], [3, 4, 5]]);
    assert_eq!(view(&plane, &over_plane(0.0, 0.0, 10.0, 40.0), [16, 16]).samples(), clean);
}

#[test]
fn the_nearer_of_two_planes_is_seen_and_the_farther_is_no_candidate() {
    let mut both = mesh::plane(1000.0, 1000.0, 1, 1).unwrap();
    let upper = mesh::plane(1000.0, 1000.0, 1, 1).unwrap();
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
    let plane = mesh::plane(32.0, 32.0, 1, 1).unwrap();
    let (to_clip, eye) = straight_on([32, 32]);
    let flat = View::new(&plane, &to_clip, eye, [32, 32]);
    assert_eq!(flat.candidates(4, 4, 0.5).samples.len(), 1);
    // The diagonal runs through (15.5, 16.5) and its like.
    assert_eq!(flat.candidates(15, 16, 0.01).samples.len(), 2);
    assert_eq!(flat.candidates(15, 18, 0.01).samples.len(), 1);
    assert!(!flat.candidates(0, 9, 0.49).background && flat.candidates(0, 9, 0.51).background);

    let earth = mesh::earth(120, 60).unwrap();
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
                // The horizon is sqrt(d^2 - R^2) away; a triangle there is 330 km long.
                let horizon_m = (pose.eye.length().powi(2) - 6.37e6f64.powi(2)).sqrt();
                assert!(nearest < horizon_m + 4e5, "({x}, {y}) sees through the earth: {sample:?}");
            }
        }
    }
    assert!(limb > 20, "{limb} pixels at the limb");
}
