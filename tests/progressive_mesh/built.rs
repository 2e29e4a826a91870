//! Real models through simplifier, order and execution: at every level looked at the faces of a fresh build.

use ortelius::paper::progressive_mesh::mesh::ProgressiveMesh;
use ortelius::paper::progressive_mesh::order::{OrderOptions, classical, order};
use ortelius::paper::progressive_mesh::reference::{face_set, faces_at};
use ortelius::paper::progressive_mesh::run::{Instances, Program};
use ortelius::paper::progressive_mesh::simplify::{Collapses, SimplifyOptions, simplify};
use ortelius::scene::model::{Attributes, Model, named};
use std::sync::Arc;

/// A vertex by its content, bits of position and attributes: no order of vertices is assumed.
type Content = Vec<u32>;

fn content(position: [f32; 3], attributes: &Attributes, at: usize) -> Content {
    let bits = |numbers: &[f32]| numbers.iter().map(|x| x.to_bits()).collect::<Content>();
    let normal = attributes.normals.get(at).map_or(vec![], |normal| bits(normal));
    let coordinates = attributes.coordinates.get(at).map_or(vec![], |st| bits(st));
    let color = attributes.colors.get(at).map_or(vec![], |&color| vec![u32::from_le_bytes(color)]);
    [bits(&position), normal, coordinates, color].concat()
}

/// The first of some levels at which a mesh is not a fresh build of its model.
pub fn level_that_differs(mesh: &ProgressiveMesh, model: &Model, collapses: &Collapses) -> Option<u32> {
    let vertices = &mesh.vertices;
    let vertex = |at: u32| content(vertices.positions[at as usize], &vertices.attributes, at as usize);
    let wedge = |at: u32| {
        let position = model.positions[model.wedge_positions[at as usize] as usize] - vertices.centre;
        content(position.as_vec3().to_array(), &model.attributes, at as usize)
    };
    let mut instance = Instances::new(Arc::new(Program::new(mesh).unwrap()), 1).unwrap();
    let last = mesh.last_level();
    (0..=12).map(|n| last * n / 12).find(|&level| {
        instance.go_to(0, level).unwrap();
        let shown = face_set(instance.faces(0).iter().map(|face| face.map(vertex)));
        shown != face_set(faces_at(model, collapses, level).into_iter().map(|face| face.map(wedge)))
    })
}

fn built(name: &str) -> (Model, Collapses) {
    let model = named(name).unwrap();
    let collapses = simplify(&model, &SimplifyOptions::default(), &mut |_, _| ()).collapses;
    (model, collapses)
}

#[test]
fn every_order_of_real_models_holds_the_faces_of_fresh_builds() {
    // A scan, seams, a boundary.
    for name in ["bunny", "solid:8", "grid:24"] {
        let (model, collapses) = built(name);
        let with = |options: OrderOptions| order(&model, &collapses, &options, &mut |_, _| ());
        let meshes = [
            ("classical", classical(&model, &collapses)),
            ("paper's", with(OrderOptions::PAPER)),
            ("best", with(OrderOptions::BEST)),
            ("few moves", with(OrderOptions::FEW_MOVES)),
        ];
        for (order, mesh) in meshes {
            assert_eq!(level_that_differs(&mesh, &model, &collapses), None, "{name}, {order} order");
            assert_eq!(mesh.swaps.levels.is_empty(), order == "classical", "{name}, {order} order");
        }
    }
}

#[test]
fn another_permutation_of_vertices_is_another_mesh() {
    let (model, collapses) = built("grid:12");
    let mut mesh = classical(&model, &collapses);
    assert_eq!(level_that_differs(&mesh, &model, &collapses), None);
    mesh.vertices.positions.swap(0, 1);
    assert_eq!(level_that_differs(&mesh, &model, &collapses), Some(0));
}
