//! Real models through the simplifier, the order and the execution. The faces equal the faces of meshes built from
//! scratch: at every level of small models, and on walks through large models.

use super::made::Random;
use ortelius::model::{Attributes, Model, named};
use ortelius::paper::progressive_mesh::mesh::{Births, ProgressiveMesh};
use ortelius::paper::progressive_mesh::order::{OrderOptions, classical, order};
use ortelius::paper::progressive_mesh::reference::{face_set, faces_at};
use ortelius::paper::progressive_mesh::run::{IgnoreWrites, Instances, Program};
use ortelius::paper::progressive_mesh::simplify::{Collapses, SimplifyOptions, simplify};
use std::sync::Arc;

/// A vertex by its content (the bits of position and attributes), independent of the order of vertices.
type Content = Vec<u32>;

fn content(position: [f32; 3], attributes: &Attributes, at: usize) -> Content {
    let bits = |numbers: &[f32]| numbers.iter().map(|x| x.to_bits()).collect::<Content>();
    let normal = attributes.normals.get(at).map_or(vec![], |normal| bits(normal));
    let coordinates = attributes.coordinates.get(at).map_or(vec![], |st| bits(st));
    let color = attributes.colors.get(at).map_or(vec![], |&color| vec![u32::from_le_bytes(color)]);
    [bits(&position), normal, coordinates, color].concat()
}

/// The first of some levels at which a mesh differs from a mesh built from scratch.
pub fn level_that_differs(mesh: &ProgressiveMesh, model: &Model, collapses: &Collapses) -> Option<u32> {
    let last = mesh.last_level();
    visit_that_differs(mesh, model, collapses, (0..=12).map(|n| last * n / 12))
}

/// The first of the visited levels, in the order of visits, at which a mesh differs from a mesh built from
/// scratch.
fn visit_that_differs(
    mesh: &ProgressiveMesh,
    model: &Model,
    collapses: &Collapses,
    visits: impl IntoIterator<Item = u32>,
) -> Option<u32> {
    let vertices = &mesh.vertices;
    let vertex = |at: u32| content(vertices.positions[at as usize], &vertices.attributes, at as usize);
    let wedge = |at: u32| {
        let position = model.positions[model.wedge_positions[at as usize] as usize] - vertices.centre;
        content(position.as_vec3().to_array(), &model.attributes, at as usize)
    };
    let mut instance = Instances::new(Arc::new(Program::new(mesh).unwrap()), 1).unwrap();
    visits.into_iter().find(|&level| {
        instance.go_to(0, level).unwrap();
        // Unborn faces are degenerate.
        let welded = |vertex: u32| mesh.vertices.welded[vertex as usize];
        let has_area = |face: &&[u32; 3]| {
            let [a, b, c] = face.map(welded);
            mesh.births == Births::Tail || (a != b && b != c && c != a)
        };
        let shown = face_set(instance.faces(0).iter().filter(has_area).map(|face| face.map(vertex)));
        shown != face_set(faces_at(model, collapses, level).into_iter().map(|face| face.map(wedge)))
    })
}

fn built(name: &str, target_faces: usize) -> (Model, Collapses) {
    let model = named(name).unwrap();
    let collapses =
        simplify(&model, &SimplifyOptions { target_faces, ..SimplifyOptions::default() }, &mut |_, _| ())
            .collapses;
    (model, collapses)
}

/// A model in every order.
fn orders(model: &Model, collapses: &Collapses) -> [(&'static str, ProgressiveMesh); 6] {
    let with = |options: OrderOptions| order(model, collapses, &options, &mut |_, _| ());
    [
        ("classical", classical(model, collapses)),
        ("paper's", with(OrderOptions::PAPER)),
        ("tail, 23", with(OrderOptions::TAIL_23)),
        ("tail, 10", with(OrderOptions::TAIL_10)),
        ("in place, 23", with(OrderOptions::IN_PLACE_23)),
        ("in place, 10", with(OrderOptions::IN_PLACE_10)),
    ]
}

/// Returns true if an instance has the faces of the step-by-step buffer after each of 200 jumps. Also returns the
/// number of jumps that constructed their level.
fn jumps_equal_steps(mesh: &ProgressiveMesh, stepped: &ProgressiveMesh) -> (bool, usize) {
    let (program, last) = (Arc::new(Program::new(mesh).unwrap()), mesh.last_level());
    let mut instance = Instances::new(program.clone(), 1).unwrap();
    let mut random = Random(u64::from(last));
    let (steps, mut constructed) = (Program::new(stepped).unwrap(), 0);
    let equal = (0..200).all(|n| {
        // The first jumps go between both ends. The later jumps go to random levels.
        let (from, to) = match n {
            0 => (0, last),
            1 => (last, 0),
            _ => (instance.level(0), random.below(last as usize + 1) as u32),
        };
        constructed += usize::from(program.constructs(from, to));
        instance.go_to(0, from).unwrap();
        instance.go_to(0, to).unwrap();
        let (mut faces, drawn) = (steps.faces().to_vec(), steps.drawn(to) as usize);
        steps.run(&mut faces, 0, to, &mut Vec::new(), &mut IgnoreWrites);
        instance.faces(0) == &faces[..drawn]
    });
    (equal, constructed)
}

#[test]
fn a_jump_over_many_levels_gives_the_bits_of_its_steps_in_every_order() {
    for (name, target_faces) in [("sphere:8", 20), ("grid:16", 20)] {
        let (model, collapses) = built(name, target_faces);
        let orders = orders(&model, &collapses);
        for (order, mesh) in &orders {
            let (equal, constructed) = jumps_equal_steps(mesh, mesh);
            assert!(equal, "{name}, {order}");
            assert!(
                *order == "classical" || constructed >= 20,
                "{name}, {order}: {constructed} of 200 constructed"
            );
        }
        // The comparison detects another order of the faces.
        assert!(!jumps_equal_steps(&orders[2].1, &orders[3].1).0, "{name}");
    }
}

#[test]
fn every_level_of_small_models_is_a_fresh_build_in_every_order() {
    // A closed model, a model with a boundary, and a model with seams. The last model is simplified only from 4096 to
    // 3900 faces, because the time to build every level from scratch is proportional to splits x faces.
    for (name, target_faces) in [("sphere:4", 20), ("grid:12", 20), ("solid:4", 3900)] {
        let (model, collapses) = built(name, target_faces);
        for (order, mesh) in orders(&model, &collapses) {
            let last = mesh.last_level();
            assert!(last > 60, "{name}: {last} splits");
            let random = &mut Random(u64::from(last));
            let walk: Vec<u32> = (0..40).map(|_| random.below(last as usize + 1) as u32).collect();
            let visits = (0..=last).chain((0..last).rev().step_by(7)).chain(walk);
            assert_eq!(visit_that_differs(&mesh, &model, &collapses, visits), None, "{name}, {order}");
        }
    }
}

#[test]
fn walks_through_real_models_have_the_faces_of_fresh_builds() {
    // A scan, a model with seams, and a model with a boundary.
    for name in ["bunny", "solid:8", "grid:24"] {
        let (model, collapses) = built(name, 64);
        for (order, mesh) in orders(&model, &collapses) {
            let last = mesh.last_level();
            let random = &mut Random(u64::from(last));
            let walk: Vec<u32> = (0..20).map(|_| random.below(last as usize + 1) as u32).collect();
            let visits = walk.into_iter().chain((0..=12).map(|n| last * n / 12));
            assert_eq!(visit_that_differs(&mesh, &model, &collapses, visits), None, "{name}, {order}");
            assert_eq!(mesh.swaps.levels.is_empty(), order == "classical", "{name}, {order}");
        }
    }
}

#[test]
fn another_permutation_of_vertices_is_another_mesh() {
    let (model, collapses) = built("grid:12", 64);
    let mut mesh = classical(&model, &collapses);
    assert_eq!(level_that_differs(&mesh, &model, &collapses), None);
    mesh.vertices.positions.swap(0, 1);
    assert_eq!(level_that_differs(&mesh, &model, &collapses), Some(0));
}

#[test]
fn one_level_that_is_wrong_is_found() {
    let (model, collapses) = built("grid:12", 64);
    let mut mesh = classical(&model, &collapses);
    let last = mesh.last_level();
    // Reverses the winding of the face that appears last.
    mesh.faces.last_mut().unwrap().swap(0, 1);
    assert_eq!(visit_that_differs(&mesh, &model, &collapses, 0..=last), Some(last));
}
