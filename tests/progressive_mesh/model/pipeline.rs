//! Every readable model passes the whole pipeline: collapses, orders, a file, and every level of the buffer.
//! This includes triangle soups.

use super::super::built::level_that_differs;
use super::super::made::Random;
use super::*;
use glam::DVec3;
use ortelius::model::{Raw, clean};
use ortelius::paper::progressive_mesh::mesh::ProgressiveMesh;
use ortelius::paper::progressive_mesh::order::{OrderOptions, classical, order};
use ortelius::paper::progressive_mesh::run::State;
use ortelius::paper::progressive_mesh::simplify::{Simplified, SimplifyOptions, simplify};

/// Runs a clean model through each order; no step may fail. Returns the number of its levels.
pub fn goes_all_the_way(model: &Model, name: &dyn Fn() -> String) -> usize {
    let Simplified { collapses, report } =
        simplify(model, &SimplifyOptions { target_faces: 2, ..SimplifyOptions::default() }, &mut |_, _| ());
    assert!(report.faces <= 2 || report.shortfall.is_some(), "{}: {report:?}", name());
    let errors = &collapses.errors;
    assert!(
        errors.is_sorted() && errors.iter().all(|e| e.is_finite() && *e >= 0.0),
        "{}: {errors:?}",
        name()
    );
    let with = |options: OrderOptions| order(model, &collapses, &options, &mut |_, _| ());
    let extended = [OrderOptions::PAPER, OrderOptions::TAIL_23, OrderOptions::IN_PLACE_10].map(with);
    for mesh in [classical(model, &collapses)].into_iter().chain(extended) {
        mesh.check().unwrap_or_else(|flaw| panic!("{}: {flaw}", name()));
        let (bytes, contents) = mesh.to_bytes();
        let read = ProgressiveMesh::from_bytes(&bytes).unwrap_or_else(|flaw| panic!("{}: {flaw}", name()));
        assert!(read.mesh == mesh && read.contents == contents, "{}: the file is another mesh", name());
        assert_eq!(level_that_differs(&mesh, model, &collapses), None, "{}", name());
        let mut state = State::new(&mesh);
        for level in [mesh.last_level(), mesh.last_level() / 2, mesh.last_level(), 0] {
            state.go_to(&mesh, level);
        }
        assert!(state.faces() == mesh.faces, "{}: after up and down the buffer differs", name());
    }
    errors.len() + 1
}

/// Coordinates of soups: few and close positions, so that faces meet, and occasionally a position that is not finite.
fn place(random: &mut Random, scale: f64, offset: f64) -> DVec3 {
    let coordinate = |random: &mut Random| match random.below(200) {
        0 => f64::NAN,
        1 => f64::NEG_INFINITY,
        2 => 1e300,
        3 => f64::MIN_POSITIVE / 8.0,
        4..20 => -0.0,
        n => (n % 4) as f64 * scale + offset,
    };
    DVec3::new(coordinate(random), coordinate(random), coordinate(random))
}

/// Random faces, some duplicate, reversed or degenerate; some vertices have unusual attributes.
fn soup(random: &mut Random) -> Raw {
    const SCALES: [f64; 8] = [1.0, 0.1, 1e-300, 1e-42, 1e-20, 1e15, 1e30, 3e35];
    let (scale, offset) = (SCALES[random.below(8)], [0.0, 0.0, 0.0, 1e7, -1e16][random.below(5)]);
    let mut soup = Raw::default();
    let vertices = 3 + random.below(60);
    soup.positions = (0..vertices).map(|_| place(random, scale, offset)).collect();
    let float =
        |random: &mut Random| [0.0, -0.0, 1.0, -2.5, 1e-40, 1e38, f32::NAN, f32::INFINITY][random.below(8)];
    if random.below(3) == 0 {
        soup.attributes.normals = (0..vertices).map(|_| [0; 3].map(|_| float(random))).collect();
    }
    if random.below(3) == 0 {
        soup.attributes.coordinates = (0..vertices).map(|_| [0; 2].map(|_| float(random))).collect();
    }
    if random.below(3) == 0 {
        soup.attributes.colors = (0..vertices).map(|_| [0; 4].map(|_| 255 * random.below(2) as u8)).collect();
    }
    for _ in 0..random.below(120) {
        let face = [0; 3].map(|_| random.below(vertices) as u32);
        soup.faces.push(face);
        match random.below(12) {
            0 => soup.faces.push(face),
            1 => soup.faces.push([face[0], face[2], face[1]]),
            2 => soup.faces.push([face[0], face[0], face[1]]),
            _ => {}
        }
    }
    soup
}

/// The same faces as the text of a file, without attributes.
fn text(raw: &Raw) -> String {
    let mut text = String::new();
    raw.positions.iter().for_each(|p| text += &format!("v {} {} {}\n", p.x, p.y, p.z));
    raw.faces.iter().for_each(|face| text += &format!("f {} {} {}\n", face[0] + 1, face[1] + 1, face[2] + 1));
    text
}

#[test]
fn any_soup_runs_at_all_levels_or_is_an_error() {
    let mut random = Random(36);
    let (mut meshes, mut empty, mut levels) = (0, 0, 0);
    for round in 0..1500 {
        let mut raw = soup(&mut random);
        let (model, report) = clean(&raw);
        model.check().unwrap_or_else(|broken| panic!("soup {round}: {broken}"));
        assert_eq!((report.faces, report.file_faces), (model.faces.len(), raw.faces.len()));
        if model.faces.is_empty() {
            empty += 1;
        } else {
            meshes += 1;
            levels += goes_all_the_way(&model, &|| format!("soup {round}"));
        }
        // Through a file: an error of one line if no face is left, otherwise the same faces.
        raw.attributes = Default::default();
        let bare = clean(&raw).0;
        match Model::from_bytes(Path::new("soup.obj"), text(&raw).as_bytes()) {
            Ok((read, _)) => assert!(read == bare, "soup {round} as a file"),
            Err(error) => {
                let error = error.to_string();
                assert!(bare.faces.is_empty() && error.lines().count() == 1, "soup {round}: {error}");
            }
        }
    }
    assert!(
        meshes > 1000 && empty > 30 && levels > 10 * meshes,
        "{meshes} meshes of {levels} levels, {empty} empty"
    );
}
