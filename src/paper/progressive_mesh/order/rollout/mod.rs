//! Rollouts: an optimizer with lookahead. From the current state of the cache, a greedy optimizer draws some faces in
//! several attempts; all but the first add noise to its scores. The first faces of the best attempt are kept, and the
//! next rollouts begin where these end.
//!
//! The paper tried a lookahead of several steps and found it much slower and hardly better (section 5).
//! Rollouts take up to 16 greedy steps per face and save 0.08 transforms per vertex.
//!
//! The optimizer simulates a FIFO, or batches that share no vertex. A batch ends when no adjacent face fits, and
//! the next batch begins beside it. Within a batch, the look-back for a vertex can be limited.

mod near;
mod state;
mod undrawn;

use super::patch::MAX_FACES;
use state::Search;

/// Attempts of a rollout, the faces that each draws, and how many faces of the best attempt are kept.
///
/// Mean over 128 levels of bunny, sphere and torus in the order `in-place-23` (one pass of the simplifier, FIFO of 16
/// entries): 1.243 transforms per vertex. With as much work, 8 attempts of 64 faces with four valence weights, 32 of
/// the faces kept, need 1.267 (all without rings and or-opt). More work pays slowly: 1.237 with 16 attempts, 40 and 24
/// (1.7 times the work), 1.232 with 20, 32 and 20 (2 times).
///
/// A beam search, in which the three best states share the attempts of a round, hardly pays. Mean over bunny, sphere,
/// torus, solid and knot with rings and or-opt: 1.226 instead of 1.229 with as much work, and 1.215 instead of 1.225
/// with 24 attempts (1.8 times the time of the orders). The limit of the dragon's build time leaves no room for this.
const ATTEMPTS: u32 = 12;
const DRAWN: usize = 32;
const KEPT: usize = 24;

/// Scores are integers in units of 1 / [`TRANSFORM`] transforms, so the order is the same on every machine.
const TRANSFORM: i32 = 1 << 16;

/// The valence weight of this optimizer in percent: see [`super::Weights::valence`]. With 70, in-place-23 needs 1.248.
const VALENCE_PERCENT: i32 = 50;
/// All attempts but the first add noise to the scores: at most 0.15 transforms. With 0.05, orders need about 0.01 more.
const MAX_NOISE: i32 = TRANSFORM * 15 / 100;

/// Cost of a vertex that left the cache with undrawn faces: a quarter of a transform. The vertex must be
/// transformed again, but other orders may transform it twice, too, so it costs less than a transform.
const HALF_FINISHED_PER_TRANSFORM: i64 = 4;

/// Larger valences are reduced to this.
const MAX_LEFT: usize = 63;

/// A cache that the optimizer simulates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Simulated {
    /// Vertices that a FIFO or a batch holds, at least 3.
    pub entries: usize,
    /// Triangles that a batch holds; `None` for a FIFO.
    pub triangles: Option<usize>,
    /// A vertex of a batch is found again only if its last use is at most this many indices back; `None`: always.
    pub look_back: Option<usize>,
}

/// The order in which to draw `faces` for a cache, as indices into `faces`. All vertices are below `vertices`. Equal
/// corners of a degenerate face count once. If no face is nearby (see [`Search::near`]), the first undrawn face is
/// drawn.
pub(super) fn rollouts(faces: &[[u32; 3]], vertices: usize, cache: Simulated) -> Vec<u32> {
    let mut search = Search::new(faces, vertices, cache);
    search.run();
    search.drawn
}

impl Search {
    fn run(&mut self) {
        let mut round = 0;
        while self.drawn.len() < self.faces.len() {
            let start = self.mark();
            let end = self.faces.len().min(self.drawn.len() + DRAWN);
            let kept = self.faces.len().min(self.drawn.len() + KEPT);
            let mut best: Option<(i64, Vec<u32>)> = None;
            for attempt in 0..ATTEMPTS {
                let noise = Noise::of(attempt, round);
                // No draw lowers the cost, so an attempt ends once its cost is not less than the best one.
                let is_best = |cost: i64| best.as_ref().is_none_or(|(min, _)| cost < *min);
                while self.drawn.len() < end && is_best(self.cost()) {
                    self.step(noise);
                }
                if is_best(self.cost()) {
                    best = Some((self.cost(), self.drawn[start.drawn..kept].to_vec()));
                }
                self.back(&start);
            }
            round += ATTEMPTS;
            best.expect("the first attempt is drawn whole").1.into_iter().for_each(|face| self.draw(face));
        }
    }

    /// What attempts are compared by.
    fn cost(&self) -> i64 {
        HALF_FINISHED_PER_TRANSFORM * self.transforms + self.half_finished
    }

    /// Draws the best face. If the current batch has no room for any face nearby, a new batch begins.
    fn step(&mut self, noise: Noise) {
        let face = self.best(noise).or_else(|| {
            self.end_batch();
            self.best(noise)
        });
        self.draw(face.expect("a face fits into an empty batch"));
    }

    /// The best of the first undrawn face and all faces nearby; on a tie, the first of them. `None` if the current
    /// batch has room for none.
    fn best(&mut self, noise: Noise) -> Option<u32> {
        let (first, near) = (self.undrawn.first(), self.near.faces());
        self.looks += 1 + near.len() as u64;
        let is_fifo = self.cache.triangles.is_none();
        let mut best = NO_RANK;
        for &face in near.iter().chain([&first]) {
            let [a, b, c] = self.faces[face as usize].map(|vertex| self.vertices[vertex as usize].score);
            let rank = rank_of(a + b + c + noise.of_face(face), face);
            if is_fifo {
                // All faces fit. A branch for each better face would be hard to predict.
                best = best.max(rank);
            } else if rank > best && self.fits(face) {
                best = rank;
            }
        }
        (best != NO_RANK).then(|| face_of(best))
    }
}

/// The worth of a face, with its index in the lower bits: of two equal faces the first has the higher rank.
fn rank_of(worth: i32, face: u32) -> i64 {
    i64::from(worth) << 32 | i64::from(!face)
}

/// Less than every rank.
const NO_RANK: i64 = i64::MIN;

/// The face with this rank.
fn face_of(rank: i64) -> u32 {
    !(rank as u32)
}

/// The noise that an attempt adds to the scores of faces.
#[derive(Clone, Copy)]
struct Noise {
    seed: u32,
    max: i32,
}

impl Noise {
    const NONE: Noise = Noise { seed: 0, max: 0 };

    /// The first attempt of each round has none.
    fn of(attempt: u32, round: u32) -> Noise {
        if attempt == 0 {
            return Noise::NONE;
        }
        Noise { seed: (round + attempt).wrapping_mul(0x85EB_CA77), max: MAX_NOISE }
    }

    /// A pseudo-random number from 0 to `max`.
    fn of_face(self, face: u32) -> i32 {
        let mut bits = face.wrapping_mul(0x9E37_79B1) ^ self.seed;
        bits = (bits ^ bits >> 15).wrapping_mul(0x85EB_CA6B);
        (((bits ^ bits >> 13) & 0x7FFF) as i32 * self.max) >> 15
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::progressive_mesh::cache::{Cache, transforms};
    use crate::paper::progressive_mesh::order::scratch::{fan, torus};

    const FIFO_15: Simulated = Simulated { entries: 15, triangles: None, look_back: None };

    fn drawn(faces: &[[u32; 3]], vertices: usize) -> Vec<[u32; 3]> {
        let order = rollouts(faces, vertices, FIFO_15);
        let mut each = order.clone();
        each.sort_unstable();
        assert_eq!(each, (0..faces.len() as u32).collect::<Vec<_>>(), "each face is drawn once");
        order.into_iter().map(|face| faces[face as usize]).collect()
    }

    #[test]
    fn rollouts_need_fewer_transforms_than_one_greedy() {
        // The greedy optimizer with a valence term needs 1.30.
        let found = transforms(Cache::Fifo(16), &drawn(&torus(40).faces, 1600)).per_vertex();
        assert!(found < 1.27, "{found}");
    }

    #[test]
    fn orders_for_batches_need_fewer_transforms_in_batches_and_more_in_a_fifo() {
        let faces = torus(40).faces;
        let order_for = |cache: Cache| {
            let triangles = cache.triangles().map(|max| max as usize);
            let simulated =
                Simulated { entries: cache.entries() as usize, triangles, look_back: cache.look_back() };
            let order = rollouts(&faces, 1600, simulated);
            order.into_iter().map(|face| faces[face as usize]).collect::<Vec<_>>()
        };
        let fifo = order_for(Cache::Fifo(16));
        for (cache, max) in [(Cache::Batches, 1.65), (Cache::H100, 1.65), (Cache::Meshlets, 1.37)] {
            let order = order_for(cache);
            let [batches, before] = [&order, &fifo].map(|order| transforms(cache, order).per_vertex());
            assert!(batches < max && batches < before, "{cache:?}: {batches} instead of {before}");
            let [worse, best] = [&order, &fifo].map(|order| transforms(Cache::Fifo(16), order).per_vertex());
            assert!(best < worse, "{cache:?}: {worse} in a FIFO instead of {best}");
        }
    }

    #[test]
    fn faces_without_area_are_drawn_beside_their_vertices() {
        let mut faces = torus(24).faces;
        let whole = transforms(Cache::Fifo(16), &drawn(&faces, 576)).transforms;
        faces.extend((0..576).step_by(3).map(|vertex| [vertex, (vertex + 1) % 576, vertex]));
        faces.extend((0..576).step_by(5).map(|vertex| [vertex; 3]));
        let found = transforms(Cache::Fifo(16), &drawn(&faces, 576)).transforms;
        assert!(found < whole + whole / 10, "{found} with degenerate faces, {whole} without");
    }

    #[test]
    fn a_fan_takes_work_in_proportion_to_its_faces() {
        let looks = [4_000, 40_000].map(|n| {
            let mut search = Search::new(&fan(n), n as usize + 1, FIFO_15);
            search.run();
            search.looks
        });
        // Without a bound, the hub's undrawn faces are examined for each face: 100 times the work.
        assert!(looks[1] <= 15 * looks[0], "{looks:?}");
    }

    #[test]
    fn an_attempt_leaves_no_trace() {
        let batches = Simulated { entries: 24, triangles: Some(32), look_back: None };
        for cache in [FIFO_15, batches, Simulated { look_back: Some(42), ..batches }] {
            leaves_no_trace(Search::new(&torus(12).faces, 144, cache));
        }
    }

    fn leaves_no_trace(mut search: Search) {
        let go = |search: &mut Search| {
            (0..100).for_each(|_| {
                search.step(Noise::NONE);
            });
            (search.drawn.clone(), search.transforms, search.half_finished)
        };
        go(&mut search);
        let start = search.mark();
        let first = go(&mut search);
        search.back(&start);
        assert_eq!(go(&mut search), first);
    }

    #[test]
    fn exactly_the_undrawn_faces_around_cached_vertices_without_hubs_are_nearby() {
        let batches = Simulated { entries: 24, triangles: Some(32), look_back: Some(42) };
        for cache in [FIFO_15, batches] {
            // Vertex 0 has more faces than `MAX_FACES`.
            let faces: Vec<[u32; 3]> =
                torus(16).faces.into_iter().flat_map(|[a, b, c]| [[a, b, c], [0, b, c]]).collect();
            let mut search = Search::new(&faces, 256, cache);
            let mut is_drawn = vec![false; faces.len()];
            for step in 0..900 {
                let start = search.mark();
                (0..step % 7).for_each(|_| search.step(Noise::NONE));
                search.back(&start);
                search.step(Noise::NONE);
                is_drawn[*search.drawn.last().unwrap() as usize] = true;
                let mut nearby = search.near.faces().to_vec();
                nearby.sort_unstable();
                let undrawn = (0..faces.len() as u32).filter(|&face| !is_drawn[face as usize]);
                let around: Vec<u32> = undrawn.filter(|&face| search.is_nearby(face)).collect();
                assert_eq!(nearby, around, "{cache:?}, step {step}");
            }
            // A new batch begins beside the batch before it.
            let before = search.near.faces().to_vec();
            search.end_batch();
            assert!(!before.is_empty() && search.near.faces() == before);
        }
    }
}
