//! The lists that rivals prepare, and the orders that they take from meshoptimizer.

use super::Rival;
use crate::paper::progressive_mesh::cache::live_faces;
use crate::paper::progressive_mesh::mesh::{NOWHERE, ProgressiveMesh};
use std::collections::HashMap;

/// What a rival prepares once for a mesh.
pub(super) struct Lists {
    /// Coarsest first.
    lists: Vec<List>,
    /// For each slot of the classical order its rank in the full mesh's best order.
    ranks: Vec<u32>,
}

struct List {
    /// The finest level that it serves.
    level: u32,
    /// Faces as positions, as they are at that level.
    faces: Vec<[u32; 3]>,
}

impl Lists {
    /// Of all lists.
    pub fn faces(&self) -> u64 {
        self.lists.iter().map(|list| list.faces.len() as u64).sum()
    }
}

pub(super) fn lists(mesh: &ProgressiveMesh, rival: Rival) -> Lists {
    let mut lists = Lists { lists: Vec::new(), ranks: Vec::new() };
    match rival {
        Rival::Random | Rival::Reoptimised | Rival::ReoptimisedFifo => {}
        Rival::Compacted => lists.ranks = ranks(mesh),
        Rival::SkipLists { ratio } => lists.lists = skip_lists(mesh, ratio),
        Rival::Discrete { ratio } => lists.lists = chain(mesh, ratio),
    }
    lists
}

fn welded(mesh: &ProgressiveMesh, level: u32) -> Vec<[u32; 3]> {
    let weld = |face: [u32; 3]| face.map(|vertex| mesh.vertices.welded[vertex as usize]);
    live_faces(mesh, level).into_iter().map(weld).collect()
}

fn faces(indices: &[u32]) -> Vec<[u32; 3]> {
    indices.chunks_exact(3).map(|face| [face[0], face[1], face[2]]).collect()
}

/// By meshoptimizer's general optimizer (`meshopt_optimizeVertexCache`).
pub(super) fn lru_order(list: &[[u32; 3]], vertices: usize) -> Vec<[u32; 3]> {
    faces(&meshopt::optimize_vertex_cache(list.as_flattened(), vertices))
}

/// By meshoptimizer's optimizer for a FIFO (`meshopt_optimizeVertexCacheFifo`).
pub(super) fn fifo_order(list: &[[u32; 3]], vertices: usize, entries: u32) -> Vec<[u32; 3]> {
    faces(&meshopt::optimize_vertex_cache_fifo(list.as_flattened(), vertices, entries))
}

/// In a random order that `seed` decides (Fisher and Yates, splitmix64).
pub(super) fn shuffled(mut list: Vec<[u32; 3]>, seed: u64) -> Vec<[u32; 3]> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = state;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        bits ^ (bits >> 31)
    };
    for last in (1..list.len()).rev() {
        list.swap(last, (next() % (last as u64 + 1)) as usize);
    }
    list
}

fn ranks(mesh: &ProgressiveMesh) -> Vec<u32> {
    let full = welded(mesh, mesh.last_level());
    // Two wedges' faces may be one face of positions: a slot for each.
    let mut slots: HashMap<[u32; 3], Vec<u32>> = HashMap::new();
    full.iter().enumerate().for_each(|(slot, face)| slots.entry(*face).or_default().push(slot as u32));
    let mut ranks = vec![NOWHERE; full.len()];
    for (rank, face) in lru_order(&full, mesh.vertices.welded.len()).iter().enumerate() {
        let slot = slots.get_mut(face).and_then(Vec::pop).expect("an order has the faces that it was given");
        ranks[slot as usize] = rank as u32;
    }
    ranks
}

/// The live faces by rank.
pub(super) fn ranked(live: &[[u32; 3]], lists: &Lists) -> Vec<[u32; 3]> {
    let mut slots: Vec<u32> = (0..live.len() as u32).collect();
    slots.sort_unstable_by_key(|&slot| lists.ranks[slot as usize]);
    slots.into_iter().map(|slot| live[slot as usize]).collect()
}

/// Levels whose faces fall by `ratio` from one to the next, down to M0's; the last first.
fn falling(mesh: &ProgressiveMesh, ratio: f64) -> Vec<u32> {
    let mut levels = vec![mesh.last_level()];
    let mut faces = mesh.faces.len() as f64 * ratio;
    while faces > f64::from(mesh.levels[0].faces) {
        let level = mesh.levels.partition_point(|level| f64::from(level.faces) < faces) as u32;
        if level > 0 && level < levels[levels.len() - 1] {
            levels.push(level);
        }
        faces *= ratio;
    }
    levels
}

fn skip_lists(mesh: &ProgressiveMesh, ratio: f64) -> Vec<List> {
    let vertices = mesh.vertices.welded.len();
    let list = |level| List { level, faces: lru_order(&welded(mesh, level), vertices) };
    falling(mesh, ratio).into_iter().rev().map(list).collect()
}

/// The faces of the coarsest list that serves the level, with the positions that they have at the level.
pub(super) fn degenerate_and_live(mesh: &ProgressiveMesh, lists: &Lists, level: u32) -> Vec<[u32; 3]> {
    let list = lists.lists.iter().find(|list| list.level >= level).expect("the full mesh has a list");
    let base = mesh.levels[0].vertices;
    let live = mesh.levels[level as usize].vertices;
    let now = |mut vertex: u32| {
        while vertex >= live && vertex != NOWHERE {
            vertex = mesh.splits.split_vertices[(vertex - base) as usize];
        }
        // A component that is not there yet stands at the first vertex, and has no area.
        if vertex == NOWHERE { 0 } else { mesh.vertices.welded[vertex as usize] }
    };
    list.faces.iter().map(|face| face.map(now)).collect()
}

/// Full mesh and simplified ones, each made from the full one.
fn chain(mesh: &ProgressiveMesh, ratio: f64) -> Vec<List> {
    let full = welded(mesh, mesh.last_level());
    let vertices = mesh.vertices.welded.len();
    let bytes: &[u8] = bytemuck::cast_slice(&mesh.vertices.positions);
    let adapter = meshopt::VertexDataAdapter::new(bytes, 12, 0).expect("12 bytes a position");
    let mut lists = Vec::new();
    for level in falling(mesh, ratio) {
        let target = 3 * mesh.levels[level as usize].faces as usize;
        let simplified = if level == mesh.last_level() {
            full.clone()
        } else {
            // No bound on the error: what counts is the number of faces.
            let options = meshopt::SimplifyOptions::None;
            faces(&meshopt::simplify(full.as_flattened(), &adapter, target, f32::MAX, options, None))
        };
        lists.push(List { level, faces: lru_order(&simplified, vertices) });
    }
    lists.reverse();
    lists
}

/// The coarsest mesh of a chain that has as many faces as are wanted.
pub(super) fn simplified(lists: &Lists, wanted: usize) -> Vec<[u32; 3]> {
    let enough = lists.lists.iter().find(|list| list.faces.len() >= wanted);
    enough.expect("the full mesh has all faces").faces.clone()
}
