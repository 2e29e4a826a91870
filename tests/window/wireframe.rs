//! The overlay of collapse levels: edges and colours of a mesh, computed again on the CPU.

use crate::display::{Display, key};
use crate::open;
use glam::{DVec2, DVec3, Vec3};
use ortelius::model::mesh::SourceMesh;
use ortelius::paper::progressive_mesh::load;
use ortelius::paper::progressive_mesh::mesh::ProgressiveMesh;
use ortelius::paper::progressive_mesh::place::{Bounds, Placement};
use ortelius::paper::progressive_mesh::reference::drawn_in_place;
use ortelius::reference::raster::rasterise;
use ortelius::scene::Scene;

const SIZE: [u32; 2] = [240, 240];
/// The status line covers the rows below.
const ROWS: u32 = 180;

/// One ball of 500 faces, all of them drawn.
const BALL: [&str; 2] = [
    "surface.herd.geometry={kind='progressive-mesh',source='sphere:5',size_m=2.0,error_pixels=0.0}",
    "cameras.start={east_m=0.0,north_m=-2.6,altitude_m=1.0,tilt_deg=90.0,vertical_fov_deg=50.0}",
];

/// The colour of a face by the first level that has all its vertices: from blue for level 0 to red for the last, in
/// steps of a 255th. sRGB codes, 0 to 1.
fn hue(mesh: &ProgressiveMesh, face: [u32; 3]) -> DVec3 {
    let newest = face.into_iter().max().unwrap();
    let level = mesh.levels.iter().position(|level| level.vertices > newest).unwrap();
    let share = (255 * level / (mesh.levels.len() - 1)) as f64 / 255.0;
    DVec3::new(0.1, 0.3, 1.0).lerp(DVec3::new(1.0, 0.2, 0.0), share)
}

/// Distance of a pixel's centre from the nearest of three lines, in pixels.
fn distance(centre: DVec2, corners: [DVec2; 3]) -> f64 {
    let lines = [0, 1, 2].map(|n| (corners[n], corners[(n + 1) % 3]));
    let to = |(from, to): (DVec2, DVec2)| (to - from).perp_dot(centre - from).abs() / (to - from).length();
    lines.into_iter().map(to).fold(f64::INFINITY, f64::min)
}

#[test]
fn edges_and_levels_of_the_wireframe_are_those_computed_on_the_cpu() {
    let display = Display::start();
    let changes = BALL.into_iter().flat_map(|change| ["-D", change]);
    let arguments: Vec<&str> =
        ["herd", "--size", "240x240", "--no-panels"].into_iter().chain(changes).collect();
    let mut window = open(&display, &arguments);
    let plain = window.settled_picture();
    window.press(key::G);
    let shown = window.until_other("collapse levels", &plain);
    window.quit_in_silence();

    let scene = Scene::embedded("herd").unwrap().with(&BALL.map(str::to_owned)).unwrap();
    let model = &load(&scene).unwrap()[0];
    let positions = &model.mesh.vertices.positions;
    let place = Placement::new(&model.surface, &Bounds::of(positions), &model.stands[0]);
    let positions: Vec<DVec3> =
        positions.iter().map(|at| place.to_world(Vec3::from(*at).as_dvec3())).collect();
    let (pose, last) = (scene.pose(0).unwrap(), model.mesh.levels.len() as u32 - 1);
    let to_clip = pose.world_to_clip(SIZE[0], SIZE[1]);
    let on_picture = |vertex: u32| {
        let clip = to_clip * (positions[vertex as usize] - pose.eye).extend(1.0);
        (DVec2::new(clip.x, clip.y) / clip.w + 1.0) * 0.5 * DVec2::from(SIZE.map(f64::from))
    };
    let faces = drawn_in_place(&model.mesh, last);
    let coordinates = vec![DVec2::ZERO; positions.len()];
    let mesh =
        SourceMesh { positions: positions.clone(), coordinates, triangles: faces.clone(), curvature: 0.0 };
    let samples = rasterise(&mesh, &to_clip, pose.eye, SIZE);

    let (mut edges, mut inner, mut hues) = (0, 0, std::collections::BTreeSet::new());
    for (n, sample) in (0..SIZE[0] * ROWS).zip(&samples) {
        let Some(sample) = sample else { continue };
        let face = faces[sample.triangle as usize];
        let centre = DVec2::new(f64::from(n % SIZE[0]), f64::from(n / SIZE[0])) + 0.5;
        // A line is drawn where a weight is below its change over a pixel, |d/dx| + |d/dy|: 1 to 1.41 pixels wide.
        let (is_edge, hue) = match distance(centre, face.map(on_picture)) {
            apart if apart > 0.05 && apart < 0.9 => (true, 0.5 * hue(&model.mesh, face)),
            apart if apart > 1.6 => (false, hue(&model.mesh, face)),
            _ => continue,
        };
        let at = 4 * n as usize;
        let expected = [0, 1, 2].map(|c| 0.3 * f64::from(plain.0.rgba[at + c]) + 0.7 * 255.0 * hue[c]);
        let found = [0, 1, 2].map(|c| f64::from(shown.0.rgba[at + c]));
        let near = expected.iter().zip(found).all(|(expected, found)| (expected - found).abs() <= 1.0);
        assert!(near, "{centre}, edge {is_edge}: {found:?}, not {expected:.1?}");
        if is_edge {
            edges += 1
        } else {
            inner += 1
        }
        hues.insert(found.map(|code| code as u8));
    }
    assert!(edges > 1000 && inner > 5000 && hues.len() > 50, "{edges}, {inner}, {} colours", hues.len());
}
