//! Models, collapses and progressive meshes for tests: small, quick to make, and random, so that they include
//! orders that no simplifier or optimizer would choose.

use glam::DVec3;
use ortelius::math::ragged::Ragged;
pub use ortelius::math::splitmix::SplitMix64 as Random;
use ortelius::model::{Attributes, Model};
use ortelius::paper::progressive_mesh::mesh::{Level, NOWHERE, ProgressiveMesh, Splits, Swaps, Vertices};
use ortelius::paper::progressive_mesh::simplify::Collapses;
use std::collections::{BTreeMap, BTreeSet};

/// A torus of `around` x `along` squares. With `seams`, the torus has two seams. Each position on a seam has two
/// wedges, and the position where the seams cross has four. `tetrahedra` tetrahedra are separate components beside the
/// torus.
pub fn torus(around: usize, along: usize, seams: bool, tetrahedra: usize) -> Model {
    let mut model = Model::default();
    let mut wedges = BTreeMap::new();
    let mut wedge = |model: &mut Model, column: usize, row: usize| {
        let key = if seams { (column, row) } else { (column % around, row % along) };
        *wedges.entry(key).or_insert_with(|| {
            model.wedge_positions.push(((row % along) * around + column % around) as u32);
            model.wedge_positions.len() as u32 - 1
        })
    };
    for row in 0..along {
        for column in 0..around {
            let turn = std::f64::consts::TAU;
            let (u, v) = (turn * column as f64 / around as f64, turn * row as f64 / along as f64);
            let ring = 3.0 + u.cos();
            model.positions.push(DVec3::new(ring * v.cos(), ring * v.sin(), u.sin()));
            let [a, b, c, d] =
                [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| wedge(&mut model, column + x, row + y));
            model.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    for n in 0..tetrahedra {
        let first = model.positions.len() as u32;
        let at = DVec3::new(n as f64, 10.0, 0.0);
        model.positions.extend([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|corner| at + 0.5 * corner));
        let start = model.wedge_positions.len() as u32;
        model.wedge_positions.extend(first..first + 4);
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        model.faces.extend(faces.map(|face| face.map(|corner| start + corner)));
    }
    if seams {
        let coordinates = (0..model.wedge_positions.len()).map(|wedge| [wedge as f32, 0.0]);
        model.attributes = Attributes { coordinates: coordinates.collect(), ..Attributes::default() };
    }
    model
}

/// Random half-edge collapses, also of whole components, until none is possible or at most `min` faces remain.
pub fn collapse(model: &Model, min: usize, random: &mut Random) -> Collapses {
    let mut faces: Vec<Option<[u32; 3]>> = model.faces.iter().copied().map(Some).collect();
    let mut collapses = Collapses::default();
    let mut failures = 0;
    let mut live = faces.len();
    while live > min && failures < 50 {
        let shown: Vec<usize> = (0..faces.len()).filter(|&face| faces[face].is_some()).collect();
        let face = faces[shown[random.below(shown.len())]].unwrap();
        let corner = random.below(3);
        let positions = face.map(|wedge| model.wedge_positions[wedge as usize]);
        let step = match random.below(5) {
            0 => component(model, &faces, positions[0], live - min),
            _ => edge(model, &faces, positions[corner], positions[(corner + 1) % 3]),
        };
        let Some((wedges, gone)) = step else {
            failures += 1;
            continue;
        };
        failures = 0;
        gone.iter().for_each(|&face| faces[face as usize] = None);
        for corner in faces.iter_mut().flatten().flatten() {
            *corner = wedges.iter().find(|[old, _]| old == corner).map_or(*corner, |&[_, new]| new);
        }
        live -= gone.len();
        collapses.errors.push(collapses.errors.len() as f64 + 1.0);
        collapses.wedges.push(wedges);
        collapses.faces.push(gone);
    }
    collapses
}

type Step = (Vec<[u32; 2]>, Vec<u32>);

/// The connected component of a position: its faces and their wedges. `None` if the component has more than `max`
/// faces.
fn component(model: &Model, faces: &[Option<[u32; 3]>], position: u32, max: usize) -> Option<Step> {
    let positions = |face: [u32; 3]| face.map(|wedge| model.wedge_positions[wedge as usize]);
    let mut reached = BTreeSet::from([position]);
    loop {
        let before = reached.len();
        for face in faces.iter().flatten().map(|&face| positions(face)) {
            if face.iter().any(|position| reached.contains(position)) {
                reached.extend(face);
            }
        }
        if reached.len() == before {
            break;
        }
    }
    let inside = |face: &Option<[u32; 3]>| face.is_some_and(|face| reached.contains(&positions(face)[0]));
    let gone: Vec<u32> = (0..faces.len() as u32).filter(|&face| inside(&faces[face as usize])).collect();
    let wedges = reached.iter().flat_map(|&position| at(model, position));
    (gone.len() <= max && gone.len() < 20).then(|| (wedges.map(|wedge| [wedge, NOWHERE]).collect(), gone))
}

/// The wedges of a position.
fn at(model: &Model, position: u32) -> impl Iterator<Item = u32> {
    (0u32..).zip(&model.wedge_positions).filter(move |(_, at)| **at == position).map(|(wedge, _)| wedge)
}

/// Moves a position onto a neighbour. A position on a seam moves along the seam. `None` if a wedge would have no
/// target.
fn edge(model: &Model, faces: &[Option<[u32; 3]>], old: u32, new: u32) -> Option<Step> {
    let mut gone = Vec::new();
    let (mut targets, mut left) = (BTreeMap::new(), BTreeSet::new());
    for (index, face) in faces.iter().enumerate() {
        let Some(face) = face else { continue };
        let wedge = |position| face.iter().find(|&&w| model.wedge_positions[w as usize] == position).copied();
        match (wedge(old), wedge(new)) {
            (Some(from), Some(to)) => {
                gone.push(index as u32);
                if targets.insert(from, to).is_some_and(|other| other != to) {
                    return None;
                }
            }
            (Some(from), None) => {
                left.insert(from);
            }
            _ => {}
        }
    }
    let known = left.iter().all(|wedge| targets.contains_key(wedge));
    // A wedge without faces follows the other wedges of its position.
    let others = at(model, old).filter(|wedge| !targets.contains_key(wedge)).map(|wedge| [wedge, NOWHERE]);
    let others: Vec<[u32; 2]> = others.collect();
    known.then(|| (targets.into_iter().map(|(from, to)| [from, to]).chain(others).collect(), gone))
}

/// A progressive mesh, and the model's wedge for each of its vertices.
pub struct Made {
    pub mesh: ProgressiveMesh,
    pub wedges: Vec<u32>,
}

/// The classical order with random permutations, at one of every `swap_every` levels.
pub fn arrange(model: &Model, collapses: &Collapses, swap_every: usize, random: &mut Random) -> Made {
    let levels = collapses.errors.len();
    let births: Vec<usize> = (0..levels).rev().collect();
    let gone: BTreeSet<u32> = collapses.wedges.items().iter().map(|&[old, _]| old).collect();
    let mut wedges: Vec<u32> =
        (0..model.wedge_positions.len() as u32).filter(|w| !gone.contains(w)).collect();
    let base_vertices = wedges.len() as u32;
    wedges.extend(births.iter().flat_map(|&n| collapses.wedges.row(n).iter().map(|&[old, _]| old)));
    let mut vertex_of = vec![NOWHERE; wedges.len()];
    (0u32..).zip(&wedges).for_each(|(vertex, &wedge)| vertex_of[wedge as usize] = vertex);

    let gone: BTreeSet<u32> = collapses.faces.items().iter().copied().collect();
    let mut order: Vec<u32> = (0..model.faces.len() as u32).filter(|face| !gone.contains(face)).collect();
    let base_faces = order.len() as u32;
    order.extend(births.iter().flat_map(|&n| collapses.faces.row(n)));

    let taken = taken_over(model, collapses);
    let mut slot_of = vec![0u32; order.len()];
    (0u32..).zip(&order).for_each(|(slot, &face)| slot_of[face as usize] = slot);
    let mut face_in = order.clone();
    let mut mesh = ProgressiveMesh {
        faces: order.iter().map(|&f| taken.at_birth[f as usize].map(|w| vertex_of[w as usize])).collect(),
        levels: vec![Level { vertices: base_vertices, faces: base_faces, error: levels as f32 }],
        ..ProgressiveMesh::default()
    };
    let (mut splits, mut swaps) = (Splits::default(), Swaps::default());
    for (&n, level) in births.iter().zip(1u32..) {
        for (&[_, new], row) in collapses.wedges.row(n).iter().zip(&taken.faces[n]) {
            splits.split_vertices.push(if new == NOWHERE { NOWHERE } else { vertex_of[new as usize] });
            let mut slots: Vec<u32> = row.iter().map(|&face| slot_of[face as usize]).collect();
            slots.sort_unstable();
            splits.slots.push(slots);
        }
        let last = *mesh.levels.last().unwrap();
        let vertices = last.vertices + collapses.wedges.row(n).len() as u32;
        let faces = last.faces + collapses.faces.row(n).len() as u32;
        mesh.levels.push(Level { vertices, faces, error: n as f32 });
        if random.below(swap_every) == 0 && faces >= 2 {
            permute(&mut swaps, level, &mut face_in[..faces as usize], &mut slot_of, random);
        }
    }
    (mesh.splits, mesh.swaps) = (splits, swaps);
    mesh.vertices = vertices(model, &wedges);
    Made { mesh, wedges }
}

/// For each wedge of each collapse, the faces that still use the wedge, and for each face, the collapse that removes
/// the face.
struct Taken {
    faces: Vec<Vec<Vec<u32>>>,
    at_birth: Vec<[u32; 3]>,
}

fn taken_over(model: &Model, collapses: &Collapses) -> Taken {
    let mut at_birth = model.faces.clone();
    let mut gone = vec![false; at_birth.len()];
    let mut faces = Vec::new();
    for n in 0..collapses.errors.len() {
        collapses.faces.row(n).iter().for_each(|&face| gone[face as usize] = true);
        let take = |&[old, new]: &[u32; 2]| {
            let shows = |face: &usize| !gone[*face] && at_birth[*face].contains(&old);
            let shown: Vec<usize> = (0..at_birth.len()).filter(shows).collect();
            for &face in &shown {
                at_birth[face] = at_birth[face].map(|wedge| if wedge == old { new } else { wedge });
            }
            shown.into_iter().map(|face| face as u32).collect()
        };
        faces.push(collapses.wedges.row(n).iter().map(take).collect());
    }
    Taken { faces, at_birth }
}

/// Random disjoint cycles of two to five slots each.
fn permute(swaps: &mut Swaps, level: u32, face_in: &mut [u32], slot_of: &mut [u32], random: &mut Random) {
    let mut slots: Vec<u32> = (0..face_in.len() as u32).collect();
    random.shuffle(&mut slots);
    slots.truncate(2 + random.below(slots.len() - 1));
    let mut rest = &slots[..];
    let mut cycles = Vec::new();
    while rest.len() >= 2 {
        let (cycle, others) = rest.split_at((2 + random.below(4)).min(rest.len()));
        rest = others;
        let min = (0..cycle.len()).min_by_key(|&at| cycle[at]).unwrap();
        cycles.push([&cycle[min..], &cycle[..min]].concat());
    }
    cycles.sort_unstable();
    for cycle in &cycles {
        swaps.cycles.push(cycle.iter().copied());
        let moved: Vec<u32> =
            cycle.iter().cycle().skip(1).take(cycle.len()).map(|&s| face_in[s as usize]).collect();
        for (&slot, face) in cycle.iter().zip(moved) {
            face_in[slot as usize] = face;
            slot_of[face as usize] = slot;
        }
    }
    swaps.levels.push(level);
    swaps.cycle_ends.push(swaps.cycles.len() as u32);
}

fn vertices(model: &Model, wedges: &[u32]) -> Vertices {
    let position = |&wedge: &u32| model.wedge_positions[wedge as usize];
    let mut first = BTreeMap::new();
    let welded = wedges.iter().zip(0u32..).map(|(w, vertex)| *first.entry(position(w)).or_insert(vertex));
    let coordinates = &model.attributes.coordinates;
    let coordinates: Vec<[f32; 2]> =
        wedges.iter().filter_map(|&wedge| coordinates.get(wedge as usize).copied()).collect();
    Vertices {
        centre: DVec3::ZERO,
        welded: welded.collect(),
        positions: wedges
            .iter()
            .map(|w| model.positions[position(w) as usize].as_vec3().to_array())
            .collect(),
        attributes: Attributes { coordinates, ..Attributes::default() },
    }
}

/// A quad of two triangles, made from one triangle by one split and one swap: small enough to check by hand.
pub fn quad() -> ProgressiveMesh {
    let level = |vertices, faces, error| Level { vertices, faces, error };
    ProgressiveMesh {
        vertices: Vertices {
            positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            welded: vec![0, 1, 2, 3],
            ..Vertices::default()
        },
        faces: vec![[0, 1, 2], [0, 2, 3]],
        levels: vec![level(3, 1, 1.0), level(4, 2, 0.0)],
        splits: Splits { split_vertices: vec![1], slots: Ragged::from_iter([vec![0]]) },
        swaps: Swaps { levels: vec![1], cycle_ends: vec![1], cycles: Ragged::from_iter([vec![0, 1]]) },
        ..ProgressiveMesh::default()
    }
}
