//! The lists that baselines prepare, and the orders by meshoptimizer.

use super::OrderBaseline;
use super::skip::SkipList;
use crate::math::splitmix::SplitMix64;
use crate::paper::progressive_mesh::cache::live_faces;
use crate::paper::progressive_mesh::mesh::{Level, NOWHERE, ProgressiveMesh};
use crate::paper::progressive_mesh::order::ring_order;
use crate::paper::progressive_mesh::run::IgnoreWrites;
use crate::vk::IndexType;
use std::collections::HashMap;

/// A baseline with the data prepared for a mesh in
/// [classical](crate::paper::progressive_mesh::order::classical) order, in which a face keeps its slot.
pub struct PreparedBaseline {
    baseline: OrderBaseline,
    /// Meshes of a discrete chain, coarsest first.
    chain: Vec<Vec<[u32; 3]>>,
    /// Skip lists, coarsest first.
    skip: Vec<SkipList>,
    /// For each slot of the classical order, the rank of its face in meshoptimizer's order of the full mesh.
    ranks: Vec<u32>,
    /// For each vertex, the index that represents it: the vertex's own index, or the index of the first vertex at its
    /// position.
    space: Vec<u32>,
    levels: Vec<Level>,
}

impl PreparedBaseline {
    /// `space` has the index that represents each vertex: the vertex's own index, or (for [`Vertices::welded`]) the
    /// index of the first vertex at its position.
    ///
    /// [`Vertices::welded`]: crate::paper::progressive_mesh::mesh::Vertices::welded
    ///
    /// # Panics
    /// If the mesh has tswaps, or `space` does not have an entry for each vertex.
    pub fn new(mesh: &ProgressiveMesh, baseline: OrderBaseline, space: Vec<u32>) -> PreparedBaseline {
        assert!(mesh.swaps.levels.is_empty(), "a mesh in classical order has no tswaps");
        assert_eq!(space.len(), mesh.vertices.positions.len(), "an index for each vertex");
        let (mut chain, mut skip, mut ranks) = (Vec::new(), Vec::new(), Vec::new());
        match baseline {
            OrderBaseline::Random
            | OrderBaseline::Reoptimised
            | OrderBaseline::ReoptimisedFifo
            | OrderBaseline::ReoptimisedRings => {}
            OrderBaseline::Compacted => ranks = full_ranks(mesh, &space),
            OrderBaseline::SkipLists { ratio } => skip = skip_lists(mesh, &space, ratio),
            OrderBaseline::Discrete { ratio } => chain = simplified(mesh, &space, ratio),
        }
        PreparedBaseline { baseline, chain, skip, ranks, space, levels: mesh.levels.clone() }
    }

    pub fn baseline(&self) -> OrderBaseline {
        self.baseline
    }

    /// The faces drawn at a level. `live` are the live faces in classical order.
    pub fn drawn(&self, level: u32, live: &[[u32; 3]]) -> Vec<[u32; 3]> {
        let vertices = self.space.len();
        let live = || in_space(live, &self.space);
        match self.baseline {
            OrderBaseline::Random => {
                let mut live = live();
                SplitMix64(u64::from(level)).shuffle(&mut live);
                live
            }
            OrderBaseline::Reoptimised => lru_order(&live(), vertices),
            OrderBaseline::ReoptimisedFifo => fifo_order(&live(), vertices, 16),
            OrderBaseline::ReoptimisedRings => ring_order(&live(), vertices, 16),
            OrderBaseline::Compacted => self.ranked(&live()),
            OrderBaseline::SkipLists { .. } => self.skip_list_at(level),
            OrderBaseline::Discrete { .. } => self.chain[self.simplified(live().len())].clone(),
        }
    }

    /// The prepared lists, coarsest first; empty for baselines that have no lists.
    pub fn lists(&self) -> impl ExactSizeIterator<Item = &[[u32; 3]]> {
        let skip = self.skip.iter().map(|list| &*list.faces);
        let lists: Vec<_> = self.chain.iter().map(|faces| &**faces).chain(skip).collect();
        lists.into_iter()
    }

    /// The skip list that serves a level, and its index in [`PreparedBaseline::lists`].
    ///
    /// # Panics
    /// If the baseline has no skip lists.
    pub fn skip_list(&self, level: u32) -> (usize, &SkipList) {
        let found = self.skip.iter().enumerate().find(|(_, list)| list.serves(level));
        found.expect("the full mesh has a list")
    }

    /// The number of faces of all lists.
    pub fn listed_faces(&self) -> u64 {
        self.lists().map(|faces| faces.len() as u64).sum()
    }

    /// Bytes of all lists with indices of the type `index`, and of the commands of level changes.
    pub fn list_bytes(&self, index: IndexType) -> u64 {
        let commands: usize = self.skip.iter().map(SkipList::command_bytes).sum();
        3 * index.bytes() * self.listed_faces() + commands as u64
    }

    /// For each slot of the classical order, the rank of its face in meshoptimizer's order of the full mesh.
    /// Empty for baselines without ranks.
    pub fn ranks(&self) -> &[u32] {
        &self.ranks
    }

    /// The index of the coarsest mesh of a discrete chain with at least `wanted` faces.
    pub fn simplified(&self, wanted: usize) -> usize {
        let enough = self.chain.iter().position(|faces| faces.len() >= wanted);
        enough.expect("the full mesh has all faces")
    }

    /// The live faces, sorted by rank.
    fn ranked(&self, live: &[[u32; 3]]) -> Vec<[u32; 3]> {
        let mut slots: Vec<u32> = (0..live.len() as u32).collect();
        slots.sort_unstable_by_key(|&slot| self.ranks[slot as usize]);
        slots.into_iter().map(|slot| live[slot as usize]).collect()
    }

    /// The list that serves a level, with the corners of that level.
    fn skip_list_at(&self, level: u32) -> Vec<[u32; 3]> {
        let (_, list) = self.skip_list(level);
        let mut faces = list.faces.clone();
        list.run(&self.levels, &mut faces, [list.levels[1], level], &mut IgnoreWrites);
        faces
    }
}

fn in_space(faces: &[[u32; 3]], space: &[u32]) -> Vec<[u32; 3]> {
    faces.iter().map(|face| face.map(|vertex| space[vertex as usize])).collect()
}

fn of_level(mesh: &ProgressiveMesh, space: &[u32], level: u32) -> Vec<[u32; 3]> {
    in_space(&live_faces(mesh, level), space)
}

fn faces(indices: &[u32]) -> Vec<[u32; 3]> {
    indices.as_chunks().0.to_vec()
}

/// The order by meshoptimizer's general optimizer (`meshopt_optimizeVertexCache`).
fn lru_order(list: &[[u32; 3]], vertices: usize) -> Vec<[u32; 3]> {
    faces(&meshopt::optimize_vertex_cache(list.as_flattened(), vertices))
}

/// The order by meshoptimizer's optimizer for a FIFO (`meshopt_optimizeVertexCacheFifo`).
fn fifo_order(list: &[[u32; 3]], vertices: usize, entries: u32) -> Vec<[u32; 3]> {
    faces(&meshopt::optimize_vertex_cache_fifo(list.as_flattened(), vertices, entries))
}

fn full_ranks(mesh: &ProgressiveMesh, space: &[u32]) -> Vec<u32> {
    let full = of_level(mesh, space, mesh.last_level());
    // Two faces with different wedges may have equal positions. Each of these faces keeps its own slot.
    let mut slots: HashMap<[u32; 3], Vec<u32>> = HashMap::new();
    full.iter().enumerate().for_each(|(slot, face)| slots.entry(*face).or_default().push(slot as u32));
    let mut ranks = vec![NOWHERE; full.len()];
    for (rank, face) in lru_order(&full, space.len()).iter().enumerate() {
        let slot = slots.get_mut(face).and_then(Vec::pop).expect("an order permutes its input faces");
        ranks[slot as usize] = rank as u32;
    }
    ranks
}

/// The last level, and the levels with `ratio`, `ratio`^2 … times its faces, while these are more than level 0 has.
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

fn skip_lists(mesh: &ProgressiveMesh, space: &[u32], ratio: f64) -> Vec<SkipList> {
    let mut finest = falling(mesh, ratio);
    finest.reverse();
    let coarsest = [0].into_iter().chain(finest.iter().map(|level| level + 1));
    let list = |(coarsest, &finest): (u32, &u32)| {
        let faces = lru_order(&of_level(mesh, space, finest), space.len());
        SkipList::new(mesh, space, [coarsest, finest], faces)
    };
    coarsest.zip(&finest).map(list).collect()
}

/// The full mesh and simplified meshes, each simplified from the full mesh.
fn simplified(mesh: &ProgressiveMesh, space: &[u32], ratio: f64) -> Vec<Vec<[u32; 3]>> {
    let full = of_level(mesh, space, mesh.last_level());
    let bytes: &[u8] = bytemuck::cast_slice(&mesh.vertices.positions);
    let adapter = meshopt::VertexDataAdapter::new(bytes, 12, 0).expect("12 bytes a position");
    let mut chain = Vec::new();
    for level in falling(mesh, ratio) {
        let target = 3 * mesh.levels[level as usize].faces as usize;
        let simplified = if level == mesh.last_level() {
            full.clone()
        } else {
            // The error is not bounded: only the number of faces matters.
            let options = meshopt::SimplifyOptions::None;
            faces(&meshopt::simplify(full.as_flattened(), &adapter, target, f32::MAX, options, None))
        };
        chain.push(lru_order(&simplified, space.len()));
    }
    chain.reverse();
    chain
}
