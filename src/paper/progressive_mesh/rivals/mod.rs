//! What else draws a mesh at every level of detail: the orders that the paper's must be compared with.
//!
//! Each takes a progressive mesh in [classical](super::order::classical) order, whose slots name the faces once and
//! for all, and says which faces it draws at a level ([`Prepared`]), how many faces it copies when levels change, and
//! what memory its lists take ([`rival_costs`], on positions: [`Vertices::welded`](super::mesh::Vertices::welded)). A
//! scene's surface may be drawn so (`order`): see `session/rival.rs`, and [`compaction`] for the
//! one that the device executes.

pub mod compaction;
mod lists;
mod skip;

use super::cache::{Cache, Counter, LevelCosts, live_faces};
use super::mesh::ProgressiveMesh;
use crate::paper::progressive_mesh::choices::FaceOrder;
use rayon::prelude::*;

pub use lists::Prepared;
pub use skip::SkipList;

/// Another way to draw a mesh at a level of detail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rival {
    /// The live faces in a random order: no reuse but by chance.
    Random,
    /// The live faces, ordered anew at every level by meshoptimizer's general optimizer.
    Reoptimised,
    /// The same by its optimizer for a FIFO of 16.
    ReoptimisedFifo,
    /// The live faces in the order that is best at the full mesh; a pass over the list skips the others (Lin and Yu
    /// 2006, Bogomjakov and Gotsman 2002).
    Compacted,
    /// Lists of a row of levels, each with `ratio` times the faces of the finer one, ordered by meshoptimizer; between
    /// two of them the finer one is drawn, with faces that have no area left ("skip strips", Forsyth 2001).
    SkipLists { ratio: f64 },
    /// A chain of meshes by meshoptimizer's simplifier, each with `ratio` times the faces of the finer one; drawn is
    /// the coarsest that has as many faces as the level.
    Discrete { ratio: f64 },
}

/// The rivals that figures show.
pub const RIVALS: [Rival; 6] = [
    Rival::Random,
    Rival::Reoptimised,
    Rival::ReoptimisedFifo,
    Rival::Compacted,
    Rival::SkipLists { ratio: 0.707 },
    Rival::Discrete { ratio: 0.5 },
];

impl Rival {
    /// The rival that an order names; none for those that splits and tswaps make.
    pub fn of(order: FaceOrder) -> Option<Rival> {
        RIVALS.into_iter().find(|rival| rival.order() == order)
    }

    /// As scenes and figures call it.
    pub const fn order(self) -> FaceOrder {
        match self {
            Rival::Random => FaceOrder::Random,
            Rival::Reoptimised => FaceOrder::ReOptimised,
            Rival::ReoptimisedFifo => FaceOrder::ReOptimisedFifo,
            Rival::Compacted => FaceOrder::Compacted,
            Rival::SkipLists { .. } => FaceOrder::SkipLists,
            Rival::Discrete { .. } => FaceOrder::Discrete,
        }
    }

    pub const fn name(self) -> &'static str {
        self.order().name()
    }
}

/// What a rival costs on one mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct RivalCosts {
    /// Transforms per vertex that is drawn, for each of the caches.
    pub costs: Vec<LevelCosts>,
    /// Faces copied for each split on the way through all levels.
    pub copied_per_split: f64,
    /// Bytes of all its lists of faces, at 12 a face.
    pub list_bytes: u64,
    /// Faces in the drawn list over live faces, mean over the levels.
    pub traffic: f64,
}

/// The costs of `rival` on a mesh in classical order at each of `levels` (ascending), counted by each of `caches`.
///
/// # Panics
/// If the mesh has tswaps, or a level is beyond its last.
pub fn rival_costs(mesh: &ProgressiveMesh, rival: Rival, caches: &[Cache], levels: &[u32]) -> RivalCosts {
    let prepared = Prepared::new(mesh, rival, mesh.vertices.welded.clone());
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
    let full = mesh.faces.len() as u64;
    let (copied, listed) = match rival {
        // Written anew at every level.
        Rival::Random | Rival::Reoptimised | Rival::ReoptimisedFifo => (faces_of_all_levels, full),
        // The same, beside the list that it goes through.
        Rival::Compacted => (faces_of_all_levels, 2 * full),
        // Once for each list, at the level that comes to it: on the way up from nothing. On the way down the full one,
        // the first, is there already.
        Rival::SkipLists { .. } => (prepared.listed_faces(), prepared.listed_faces()),
        Rival::Discrete { .. } => (0, prepared.listed_faces()),
    };
    let traffic = drawn.iter().map(|(_, traffic)| traffic).sum::<f64>() / drawn.len() as f64;
    RivalCosts { costs, copied_per_split: copied as f64 / last, list_bytes: 12 * listed, traffic }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::progressive_mesh::order::{classical, scratch};

    #[test]
    fn rivals_draw_what_is_live_and_cost_what_they_should() {
        let model = scratch::torus(32);
        let mesh = classical(&model, &scratch::collapses(&model, 64));
        let levels: Vec<u32> = (0..=8).map(|n| n * mesh.last_level() / 8).collect();
        let mut costs = Vec::new();
        for rival in RIVALS {
            assert_eq!(Rival::of(rival.order()), Some(rival));
            let prepared = Prepared::new(&mesh, rival, mesh.vertices.welded.clone());
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
                if !matches!(rival, Rival::Discrete { .. }) {
                    assert_eq!(found, wanted, "{} at level {level}", rival.name());
                }
                assert!(found.len() >= live, "{} at level {level}", rival.name());
            }
            costs.push(rival_costs(&mesh, rival, &[Cache::Fifo(16)], &levels));
        }
        let mean = |n: usize| costs[n].costs[0].mean();
        assert!(mean(0) > 5.0, "random: {}", mean(0));
        assert!((1..6).all(|n| mean(n) < 2.0), "{:?}", [1, 2, 3, 4, 5].map(mean));
        let [skip, discrete] = [&costs[4], &costs[5]];
        assert!(skip.traffic > 1.0 && skip.copied_per_split < 8.0 && discrete.traffic > skip.traffic);
        assert_eq!((costs[1].traffic, discrete.copied_per_split), (1.0, 0.0));
    }
}
