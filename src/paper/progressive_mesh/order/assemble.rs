//! Builds a progressive mesh from an arrangement of faces: the vertex order, the faces' slots, the splits and
//! the cycles (paper 2, sections 3 to 5).

use super::descent::Descent;
use crate::math::ragged::Ragged;
use crate::model::{Attributes, Model};
use crate::paper::progressive_mesh::mesh::{
    Births, Level, NOWHERE, ProgressiveMesh, Splits, Swaps, Vertices,
};
use crate::paper::progressive_mesh::simplify::Collapses;
use glam::DVec3;

/// The slot of every face at every level. Faces have the model's numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Arrangement {
    /// The faces in the order of their first slots: the faces of level 0, then the faces that each split appends.
    pub births: Vec<u32>,
    /// Permutations, coarsest level first: the level and its moves.
    pub moves: Vec<(u32, Vec<Move>)>,
}

/// `slot` receives `face`, which was in another slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Move {
    pub slot: u32,
    pub face: u32,
}

/// `model` at all levels, with its faces arranged by `arrangement`.
///
/// # Panics
/// If `arrangement` does not list the faces of level 0 before the faces of the splits, or if moves are not a
/// permutation.
pub(super) fn assemble(model: &Model, collapses: &Collapses, arrangement: &Arrangement) -> ProgressiveMesh {
    let order = VertexOrder::new(model, collapses, &arrangement.births);
    let levels = levels(collapses, &order, model.faces.len());
    // The descent comes first: it finds each face's corners at its first level, and the faces that each
    // collapse changes.
    let down = Descent::new(model, collapses);
    let faces = arrangement.births.iter();
    let faces =
        faces.map(|&face| down.faces[face as usize].map(|wedge| order.vertex[wedge as usize])).collect();
    let (splits, swaps) = slots(collapses, arrangement, &order, &down.changed, &levels);
    let vertices = vertices(model, &order.wedges);
    ProgressiveMesh { vertices, faces, levels, splits, swaps, births: Births::Tail, metric: collapses.metric }
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
    fn new(model: &Model, collapses: &Collapses, births: &[u32]) -> Self {
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
        let used = births.iter().flat_map(|&face| model.faces[face as usize]);
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

fn levels(collapses: &Collapses, order: &VertexOrder, faces: usize) -> Vec<Level> {
    let mut level = Level { vertices: order.wedges.len() as u32, faces: faces as u32, error: 0.0 };
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

/// Walks up from level 0: finds the slots that each split writes, and converts the moves to cycles.
fn slots(
    collapses: &Collapses,
    arrangement: &Arrangement,
    order: &VertexOrder,
    changed: &Ragged<u32>,
    levels: &[Level],
) -> (Splits, Swaps) {
    let mut slot_of: Vec<u32> = vec![NOWHERE; arrangement.births.len()];
    for (slot, &face) in arrangement.births.iter().enumerate() {
        let twice = std::mem::replace(&mut slot_of[face as usize], slot as u32);
        assert_eq!(twice, NOWHERE, "face {face} has slots {twice} and {slot}");
    }
    let (mut splits, mut swaps) = (Splits::default(), Swaps::default());
    let mut source = vec![NOWHERE; slot_of.len()];
    let mut moves = arrangement.moves.iter().peekable();
    let mut row = changed.len();
    for level in 0..levels.len() as u32 {
        if level > 0 {
            let collapse = levels.len() - 1 - level as usize;
            let wedges = collapses.wedges.row(collapse);
            row -= wedges.len();
            let births = levels[level as usize - 1].faces..levels[level as usize].faces;
            for &face in collapses.faces.row(collapse) {
                assert!(births.contains(&slot_of[face as usize]), "face {face} is not born at level {level}");
            }
            for (n, &[_, target]) in wedges.iter().enumerate() {
                let vertex = if target == NOWHERE { NOWHERE } else { order.vertex[target as usize] };
                splits.split_vertices.push(vertex);
                let mut slots: Vec<u32> =
                    changed.row(row + n).iter().map(|&face| slot_of[face as usize]).collect();
                slots.sort_unstable();
                splits.slots.push(slots);
            }
        }
        while let Some((_, moved)) = moves.next_if(|(at, _)| *at == level) {
            swap(&mut swaps, level, moved, &mut slot_of, &mut source);
        }
    }
    assert_eq!(moves.next(), None, "moves at a missing level, or levels not in order");
    (splits, swaps)
}

/// Converts moves to cycles: each slot of a cycle gets the face of the next slot, and the last slot gets the face of
/// the first slot. `source` (by slot) holds only [`NOWHERE`] on entry and on return. `source` is a vector, because a
/// hash map takes seconds for the 10 million moves of a dragon.
fn swap(swaps: &mut Swaps, level: u32, moved: &[Move], slot_of: &mut [u32], source: &mut [u32]) {
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
    swaps.levels.push(level);
    swaps.cycle_ends.push(swaps.cycles.len() as u32);
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
