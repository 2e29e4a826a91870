//! Builds a progressive mesh from an arrangement of faces: the vertex order, the faces' slots, the splits and
//! the cycles (paper 2, sections 3 to 5).

use super::descent::Descent;
use crate::math::ragged::Ragged;
use crate::model::{Attributes, Model};
use crate::paper::progressive_mesh::mesh::{Births, Level, NOWHERE, ProgressiveMesh, Vertices};
use crate::paper::progressive_mesh::simplify::Collapses;
use glam::DVec3;

/// A part of an arrangement of faces. The steps run from level 0 to the full mesh; the first step is [`Step::Base`].
/// Faces have the model's numbers.
pub(super) enum Step {
    /// The faces of level 0, in the order of their slots. Each split appends its faces.
    Base(Vec<u32>),
    /// All splits that lead to this level. No permutation of a lower level follows.
    Splits(u32),
    /// A permutation at the level that the splits have reached. Each level has at most one.
    Moves(Vec<Move>),
}

/// `slot` receives `face`, which was in another slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Move {
    pub slot: u32,
    pub face: u32,
}

/// `model` at all levels, with its faces arranged by `steps`. `grown` is called with the unfinished mesh and the number
/// of its levels that are final: the splits and permutations of the other levels are missing. The last call has all
/// levels.
///
/// # Panics
/// If the steps do not begin with the faces of level 0, or if moves are not a permutation.
pub(super) fn assemble(
    model: &Model,
    collapses: &Collapses,
    births: Births,
    steps: impl IntoIterator<Item = Step>,
    grown: &mut dyn FnMut(&ProgressiveMesh, usize),
) -> ProgressiveMesh {
    // The descent finds each face's corners at its first level, and the faces that each collapse changes.
    let Descent { faces: corners, changed, .. } = Descent::new(model, collapses);
    let mut steps = steps.into_iter();
    let mut faces = match steps.next() {
        Some(Step::Base(faces)) => faces,
        Some(_) => panic!("an arrangement begins with the faces of level 0"),
        // The planner has panicked, and nobody receives the mesh.
        None => return ProgressiveMesh::default(),
    };
    faces.extend(collapses.faces.rows().rev().flatten());
    let VertexOrder { wedges, vertex } = VertexOrder::new(model, collapses, &faces);
    let mut slot_of: Vec<u32> = vec![NOWHERE; faces.len()];
    for (slot, &face) in faces.iter().enumerate() {
        let twice = std::mem::replace(&mut slot_of[face as usize], slot as u32);
        assert_eq!(twice, NOWHERE, "face {face} has slots {twice} and {slot}");
    }
    let first = faces.iter().map(|&face| corners[face as usize].map(|wedge| vertex[wedge as usize]));
    let mesh = ProgressiveMesh {
        vertices: vertices(model, &wedges),
        faces: first.collect(),
        levels: levels(collapses, wedges.len(), faces.len()),
        births,
        metric: collapses.metric,
        ..ProgressiveMesh::default()
    };
    drop((corners, faces));
    let last = mesh.last_level();
    let source = vec![NOWHERE; slot_of.len()];
    let row = changed.len();
    let mut assembly = Assembly { collapses, changed, vertex, mesh, level: 0, row, slot_of, source };
    for step in steps {
        match step {
            Step::Base(_) => panic!("an arrangement has the faces of level 0 twice"),
            Step::Splits(level) => {
                assembly.split_to(level);
                grown(&assembly.mesh, level as usize);
            }
            Step::Moves(moves) => assembly.swap(&moves),
        }
    }
    assembly.split_to(last);
    grown(&assembly.mesh, last as usize + 1);
    assembly.mesh
}

/// Wedges in the order of appearance.
struct VertexOrder {
    wedges: Vec<u32>,
    /// The vertex of each wedge.
    vertex: Vec<u32>,
}

impl VertexOrder {
    /// Wedges of level 0 come first, in the order in which the faces of level 0 use them, so that drawing level 0
    /// fetches the vertices in sequence.
    fn new(model: &Model, collapses: &Collapses, faces: &[u32]) -> Self {
        let mut place: Vec<u32> = vec![NOWHERE; model.wedge_positions.len()];
        let removed: Vec<u32> = (0..collapses.wedges.len())
            .rev()
            .flat_map(|n| collapses.wedges.row(n))
            .map(|pair| pair[0])
            .collect();
        let mut stays = vec![true; place.len()];
        for &wedge in &removed {
            assert!(std::mem::take(&mut stays[wedge as usize]), "wedge {wedge} is removed twice");
        }
        let mut wedges = Vec::with_capacity(place.len());
        let used = faces.iter().flat_map(|&face| model.faces[face as usize]);
        // Wedges of level 0 that no face of level 0 uses come after the used wedges of level 0.
        for wedge in used.chain(0..place.len() as u32) {
            if stays[wedge as usize] && place[wedge as usize] == NOWHERE {
                place[wedge as usize] = wedges.len() as u32;
                wedges.push(wedge);
            }
        }
        for wedge in removed {
            place[wedge as usize] = wedges.len() as u32;
            wedges.push(wedge);
        }
        Self { wedges, vertex: place }
    }
}

fn levels(collapses: &Collapses, vertices: usize, faces: usize) -> Vec<Level> {
    let mut level = Level { vertices: vertices as u32, faces: faces as u32, error: 0.0 };
    let mut levels = vec![level];
    for collapse in 0..collapses.wedges.len() {
        level.vertices -= collapses.wedges.row(collapse).len() as u32;
        level.faces -= collapses.faces.row(collapse).len() as u32;
        // Rounded up, so that the f32 error is not below the f64 error.
        let error = collapses.errors[collapse];
        let rounded = error as f32;
        level.error = level.error.max(if f64::from(rounded) < error { rounded.next_up() } else { rounded });
        levels.push(level);
    }
    levels.reverse();
    levels
}

/// A mesh on the way up from level 0.
struct Assembly<'a> {
    collapses: &'a Collapses,
    /// See [`Descent::changed`].
    changed: Ragged<u32>,
    /// The vertex of each wedge.
    vertex: Vec<u32>,
    /// Complete except for the splits and permutations above `level`.
    mesh: ProgressiveMesh,
    level: u32,
    /// The number of rows of `changed` that belong to the splits above `level`.
    row: usize,
    slot_of: Vec<u32>,
    /// Scratch memory of [`Assembly::swap`], by slot. Between calls it holds only [`NOWHERE`]. It is a vector, because
    /// a hash map takes seconds for the 10 million moves of a dragon.
    source: Vec<u32>,
}

impl Assembly<'_> {
    /// Finds the slots that the splits up to `to` write.
    fn split_to(&mut self, to: u32) {
        while self.level < to {
            self.level += 1;
            let [before, level] = [self.level - 1, self.level].map(|level| self.mesh.levels[level as usize]);
            let collapse = self.mesh.levels.len() - 1 - self.level as usize;
            let wedges = self.collapses.wedges.row(collapse);
            self.row -= wedges.len();
            for &face in self.collapses.faces.row(collapse) {
                let slot = self.slot_of[face as usize];
                assert!(
                    (before.faces..level.faces).contains(&slot),
                    "face {face} is not born at level {}",
                    self.level
                );
            }
            for (n, &[_, target]) in wedges.iter().enumerate() {
                let vertex = if target == NOWHERE { NOWHERE } else { self.vertex[target as usize] };
                self.mesh.splits.split_vertices.push(vertex);
                let changed = self.changed.row(self.row + n).iter();
                let mut slots: Vec<u32> = changed.map(|&face| self.slot_of[face as usize]).collect();
                slots.sort_unstable();
                self.mesh.splits.slots.push(slots);
            }
        }
    }

    /// Converts moves to cycles: each slot of a cycle gets the face of the next slot, and the last slot gets the face
    /// of the first slot.
    fn swap(&mut self, moved: &[Move]) {
        let Assembly { level, slot_of, source, mesh: ProgressiveMesh { swaps, .. }, .. } = self;
        assert!(swaps.levels.last() != Some(level), "two permutations at level {level}");
        let mut slots = Vec::with_capacity(moved.len());
        for &Move { slot, face } in moved {
            let from = slot_of[face as usize];
            if from != slot {
                source[slot as usize] = from;
                slots.push(slot);
            }
        }
        slots.sort_unstable();
        let mut cycle = Vec::new();
        for first in slots {
            let mut slot = first;
            while source[slot as usize] != NOWHERE {
                cycle.push(slot);
                slot = std::mem::replace(&mut source[slot as usize], NOWHERE);
            }
            assert!(cycle.is_empty() || slot == first, "the moves at level {level} are not a permutation");
            if !cycle.is_empty() {
                swaps.cycles.push(cycle.drain(..));
            }
        }
        moved.iter().for_each(|m| slot_of[m.face as usize] = m.slot);
        swaps.levels.push(*level);
        swaps.cycle_ends.push(swaps.cycles.len() as u32);
    }
}

fn vertices(model: &Model, wedges: &[u32]) -> Vertices {
    let bounds = model.positions.iter().fold(None, |bounds: Option<(DVec3, DVec3)>, &p| {
        Some(bounds.map_or((p, p), |(low, high)| (low.min(p), high.max(p))))
    });
    // Halved before adding: the sum of two huge coordinates would overflow.
    let centre = bounds.map_or(DVec3::ZERO, |(low, high)| 0.5 * low + 0.5 * high);
    let mut first: Vec<u32> = vec![NOWHERE; model.positions.len()];
    let (mut positions, mut welded) = (Vec::new(), Vec::new());
    for (vertex, &wedge) in wedges.iter().enumerate() {
        let position = model.wedge_positions[wedge as usize] as usize;
        if first[position] == NOWHERE {
            first[position] = vertex as u32;
        }
        welded.push(first[position]);
        positions.push((model.positions[position] - centre).as_vec3().to_array());
    }
    Vertices { centre, positions, welded, attributes: gathered(&model.attributes, wedges) }
}

fn gathered(attributes: &Attributes, wedges: &[u32]) -> Attributes {
    fn pick<T: Copy>(list: &[T], wedges: &[u32]) -> Vec<T> {
        if list.is_empty() { Vec::new() } else { wedges.iter().map(|&wedge| list[wedge as usize]).collect() }
    }
    Attributes {
        normals: pick(&attributes.normals, wedges),
        coordinates: pick(&attributes.coordinates, wedges),
        colors: pick(&attributes.colors, wedges),
    }
}
