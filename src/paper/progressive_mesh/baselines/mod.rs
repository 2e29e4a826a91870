//! Baselines: other methods to draw a mesh at every level of detail, for comparison with the paper's orders.
//!
//! Each baseline uses a progressive mesh in [classical](super::order::classical) order, in which a face keeps its slot.
//! [`PreparedBaseline`] has the faces that a baseline draws at a level. [`baseline_costs`] reports a baseline's
//! transforms, the faces copied when levels change, and the memory of the baseline's lists. This function counts all
//! wedges of a position as one vertex ([`Vertices::welded`](super::mesh::Vertices::welded)). In a scene, a surface
//! selects a baseline with `order`: see `surface/baseline.rs`, and [`compaction`] for the baseline that runs on the
//! device.

mod clusters;
pub mod compaction;
mod lists;
mod skip;

use super::cache::{Cache, Counter, LevelCosts, live_faces};
use super::mesh::ProgressiveMesh;
use crate::paper::progressive_mesh::choices::FaceOrder;
use crate::vk::IndexType;
use rayon::prelude::*;

pub use clusters::clustered_costs;
pub use lists::PreparedBaseline;
pub use skip::SkipList;

/// A method other than the paper's to draw a mesh at a level of detail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OrderBaseline {
    /// The live faces in random order: almost no reuse.
    Random,
    /// The live faces, reordered at every level by meshoptimizer's general optimizer.
    Reoptimised,
    /// The live faces, reordered at every level by meshoptimizer's optimizer for a FIFO of 16 entries: Tipsify (P.
    /// Sander, D. Nehab and J. Barczak, "Fast Triangle Reordering for Vertex Locality and Reduced Overdraw", SIGGRAPH
    /// 2007).
    ReoptimisedFifo,
    /// The live faces, reordered at every level in rings, for a FIFO of 16 entries (H. Hoppe: see `order/rings.rs`).
    ReoptimisedRings,
    /// The live faces in meshoptimizer's order of the full mesh, extracted by a pass over all faces (G. Lin
    /// and T. Yu, "An Improved Vertex Caching Scheme for 3D Mesh Rendering", IEEE TVCG 2006; A. Bogomjakov and C.
    /// Gotsman, "Universal Rendering Sequences for Transparent Vertex Caching of Progressive Meshes", Computer Graphics
    /// Forum 2002).
    Compacted,
    /// Lists for a series of levels, ordered by meshoptimizer, each with `ratio` times the faces of the next
    /// finer one. Between the levels of two lists the finer list is drawn, including faces that have become
    /// degenerate ("skip strips"; T. Forsyth, "Comparison of VIPM Methods", Game Programming Gems 2, 2001).
    SkipLists { ratio: f64 },
    /// A discrete chain of meshes by meshoptimizer's simplifier, each with `ratio` times the faces of the
    /// next finer one. The coarsest mesh with at least the level's number of faces is drawn.
    Discrete { ratio: f64 },
}

/// The baselines that figures show.
pub const BASELINES: [OrderBaseline; 7] = [
    OrderBaseline::Random,
    OrderBaseline::Reoptimised,
    OrderBaseline::ReoptimisedFifo,
    OrderBaseline::ReoptimisedRings,
    OrderBaseline::Compacted,
    OrderBaseline::SkipLists { ratio: 0.707 },
    OrderBaseline::Discrete { ratio: 0.5 },
];

impl OrderBaseline {
    /// The baseline of an order; `None` for orders made of splits and tswaps.
    pub fn of(order: FaceOrder) -> Option<OrderBaseline> {
        BASELINES.into_iter().find(|baseline| baseline.order() == order)
    }

    /// The order that selects this baseline in scenes, and its name in figures.
    pub const fn order(self) -> FaceOrder {
        match self {
            OrderBaseline::Random => FaceOrder::Random,
            OrderBaseline::Reoptimised => FaceOrder::ReOptimised,
            OrderBaseline::ReoptimisedFifo => FaceOrder::ReOptimisedFifo,
            OrderBaseline::ReoptimisedRings => FaceOrder::ReOptimisedRings,
            OrderBaseline::Compacted => FaceOrder::Compacted,
            OrderBaseline::SkipLists { .. } => FaceOrder::SkipLists,
            OrderBaseline::Discrete { .. } => FaceOrder::Discrete,
        }
    }

    pub const fn name(self) -> &'static str {
        self.order().name()
    }
}

/// The costs of a baseline on one mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct BaselineCosts {
    /// Transforms per drawn vertex, for each cache.
    pub costs: Vec<LevelCosts>,
    /// Faces copied per split, on the way through all levels.
    pub copied_per_split: f64,
    /// Bytes of all lists of the baseline and of the commands of level changes; indices have 16 bits below 65,536
    /// vertices.
    pub list_bytes: u64,
    /// Drawn faces per live face, mean over the levels.
    pub traffic: f64,
}

/// The costs of `baseline` on a mesh in classical order, at each of `levels` (ascending) and for each of
/// `caches`.
///
/// # Panics
/// If the mesh has tswaps, or a level is beyond the mesh's last level.
pub fn baseline_costs(
    mesh: &ProgressiveMesh,
    baseline: OrderBaseline,
    caches: &[Cache],
    levels: &[u32],
) -> BaselineCosts {
    let prepared = PreparedBaseline::new(mesh, baseline, mesh.vertices.welded.clone());
    let drawn: Vec<(Vec<f64>, f64)> = levels
        .par_iter()
        .map(|&level| {
            let live = live_faces(mesh, level);
            let faces = prepared.drawn(level, &live);
            let count = |&cache| Counter::new(cache, mesh.vertices.welded.len()).count(faces.iter().copied());
            let costs = caches.iter().map(|cache| count(cache).per_vertex()).collect();
            (costs, faces.len() as f64 / live.len() as f64)
        })
        .collect();
    let of = |cache: usize| drawn.iter().map(|(costs, _)| costs[cache]).collect();
    let costs =
        (0..caches.len()).map(|n| LevelCosts { levels: levels.to_vec(), per_vertex: of(n) }).collect();
    let last = f64::from(mesh.last_level());
    let faces_of_all_levels: u64 = mesh.levels[1..].iter().map(|level| u64::from(level.faces)).sum();
    let index = IndexType::of_vertices(mesh.vertices.positions.len());
    let full_bytes = 3 * index.bytes() * mesh.faces.len() as u64;
    let (copied, list_bytes) = match baseline {
        // All faces are rewritten at every level.
        OrderBaseline::Random
        | OrderBaseline::Reoptimised
        | OrderBaseline::ReoptimisedFifo
        | OrderBaseline::ReoptimisedRings => (faces_of_all_levels, full_bytes),
        // All faces are rewritten here, too. The memory includes the list that the pass reads.
        OrderBaseline::Compacted => (faces_of_all_levels, 2 * full_bytes),
        // On the way through all levels each list is copied once, when its first level is reached.
        OrderBaseline::SkipLists { .. } => (prepared.listed_faces(), prepared.list_bytes(index)),
        OrderBaseline::Discrete { .. } => (0, prepared.list_bytes(index)),
    };
    let traffic = drawn.iter().map(|(_, traffic)| traffic).sum::<f64>() / drawn.len() as f64;
    BaselineCosts { costs, copied_per_split: copied as f64 / last, list_bytes, traffic }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::progressive_mesh::order::{classical, scratch};

    #[test]
    fn baselines_draw_the_live_faces_at_the_expected_cost() {
        let model = scratch::torus(32);
        let mesh = classical(&model, &scratch::collapses(&model, 64));
        let levels: Vec<u32> = (0..=8).map(|n| n * mesh.last_level() / 8).collect();
        let mut costs = Vec::new();
        for baseline in BASELINES {
            assert_eq!(OrderBaseline::of(baseline.order()), Some(baseline));
            let prepared = PreparedBaseline::new(&mesh, baseline, mesh.vertices.welded.clone());
            for &level in &levels {
                let live = live_faces(&mesh, level);
                let (drawn, live) = (prepared.drawn(level, &live), live.len());
                let key = |face: &[u32; 3]| {
                    let mut key = *face;
                    key.sort_unstable();
                    key
                };
                let with_area =
                    |face: &&[u32; 3]| face[0] != face[1] && face[1] != face[2] && face[2] != face[0];
                let mut found: Vec<_> = drawn.iter().filter(with_area).map(key).collect();
                let mut wanted: Vec<_> = live_faces(&mesh, level).iter().map(key).collect();
                found.sort_unstable();
                wanted.sort_unstable();
                if !matches!(baseline, OrderBaseline::Discrete { .. }) {
                    assert_eq!(found, wanted, "{} at level {level}", baseline.name());
                }
                assert!(found.len() >= live, "{} at level {level}", baseline.name());
            }
            costs.push(baseline_costs(&mesh, baseline, &[Cache::Fifo(16)], &levels));
        }
        let mean = |n: usize| costs[n].costs[0].mean();
        assert!(mean(0) > 5.0, "random: {}", mean(0));
        assert!((1..7).all(|n| mean(n) < 2.0), "{:?}", [1, 2, 3, 4, 5, 6].map(mean));
        let [skip, discrete] = [&costs[5], &costs[6]];
        assert!(skip.traffic > 1.0 && skip.copied_per_split < 8.0 && discrete.traffic > skip.traffic);
        assert_eq!((costs[1].traffic, discrete.copied_per_split), (1.0, 0.0));
    }
}
