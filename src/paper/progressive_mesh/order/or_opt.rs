//! Or-opt: short runs of faces move to other places in an order if this saves transforms. I. Or, "Traveling
//! Salesman-Type Combinatorial Problems and Their Relation to the Logistics of Regional Blood Banking", thesis,
//! Northwestern University, 1976, moves short runs of a tour in this way.
//!
//! Only faces that transform a vertex again are examined. Either a run from this face on moves back to the vertex's
//! earlier faces, or a run of these moves forward to this face. A move is made if the FIFO then needs fewer transforms
//! at the first level, and at both levels together, and if [`FIFO_WEIGHT`] times this saving exceeds what batches need
//! more. Without the condition on batches, in-place-10 needs 0.0004 fewer transforms per vertex in a FIFO, but 0.003
//! more in batches.

use super::candidates::{FIFO_WEIGHT, Levels};
use super::patch::{MAX_FACES, Patch};
use crate::paper::progressive_mesh::cache::{Cache, Counter};

/// The longest run that moves. With 2, in-place-10 needs 0.002 transforms per vertex more; with 8, as many.
const RUN: usize = 4;
/// The largest distance that a run moves. With 250, in-place-10 needs 0.0008 less, and or-opt takes twice the time.
const REACH: usize = 96;
/// A move is given up if the FIFO has not returned to its earlier contents this many faces after it.
const WAKE: usize = 96;
/// A move is also given up when it has cost this many transforms more than it has saved. Without this limit, orders need
/// as many transforms, and or-opt takes an eighth more time.
const MAX_CHANGE: i64 = 8;
/// Faces of a batch. A move leaves the number of faces before and after it unchanged, so most batches begin at the same
/// places.
const BATCH: usize = 32;

/// The order with the moves that save transforms. `order` has indices into the faces of `levels`.
pub(super) fn or_opt(levels: &Levels, order: Vec<u32>) -> Vec<u32> {
    let mut search = Search::new(levels, order);
    search.run();
    search.order
}

/// The faces at the places from `from` to `to` rotate left by `by`: the first `by` of them move to the end.
#[derive(Clone, Copy)]
struct Turn {
    from: usize,
    by: usize,
    to: usize,
}

impl Turn {
    /// The place from which the face at `place` comes.
    fn source(self, place: usize) -> usize {
        match place {
            _ if place < self.from || place >= self.to => place,
            _ if place + self.by < self.to => place + self.by,
            _ => place + self.by - (self.to - self.from),
        }
    }
}

struct Search<'a> {
    levels: Vec<Level<'a>>,
    /// The faces around each vertex at the second level.
    patch: Patch,
    order: Vec<u32>,
    /// The place of each face in `order`.
    places: Vec<u32>,
    batches: Counter,
    /// Faces around vertices and moves examined so far: a measure of the work.
    tries: u64,
}

impl<'a> Search<'a> {
    fn new(levels: &'a Levels, order: Vec<u32>) -> Self {
        let Levels { corners, vertices, entries } = levels;
        let mut places = vec![0; order.len()];
        (0..).zip(&order).for_each(|(place, &face)| places[face as usize] = place);
        Self {
            levels: corners.iter().map(|corners| Level::new(corners, *vertices, *entries, &order)).collect(),
            patch: Patch::new(corners[corners.len() - 1].clone(), *vertices),
            order,
            places,
            batches: Counter::new(Cache::Batches, *vertices),
            tries: 0,
        }
    }

    fn run(&mut self) {
        for place in 0..self.order.len() {
            self.improve(place);
        }
    }

    /// Makes the first move that saves a transform of the face at `place`.
    fn improve(&mut self, place: usize) {
        let Some(level) = self.levels.iter().find(|level| level.misses[place] != 0) else { return };
        let (missed, corners) = (level.misses[place], level.corners[self.order[place] as usize]);
        for corner in (0..3).filter(|corner| missed >> corner & 1 == 1) {
            let vertex = corners[corner] as usize;
            let row = self.patch.starts[vertex] as usize..self.patch.starts[vertex + 1] as usize;
            if row.len() > MAX_FACES as usize {
                continue;
            }
            for at in row {
                self.tries += 1;
                let earlier = self.places[self.patch.around[at] as usize] as usize;
                // Between neighbours there is no place to move to.
                let is_near = earlier + 1 < place && place - earlier <= REACH;
                if is_near && self.join(earlier, place) {
                    return;
                }
            }
        }
    }

    /// Moves a run of faces that starts at `later` to `earlier`, or one that ends at `earlier` to `later`, if this
    /// saves transforms.
    fn join(&mut self, earlier: usize, later: usize) -> bool {
        (1..=RUN).any(|run| {
            let back = Turn { from: earlier + 1, by: later - earlier - 1, to: later + run };
            let forward = Turn { from: (earlier + 1).wrapping_sub(run), by: run, to: later };
            back.to <= self.order.len() && self.attempt(back) || run <= earlier + 1 && self.attempt(forward)
        })
    }

    /// Makes a move if it saves transforms.
    fn attempt(&mut self, turn: Turn) -> bool {
        self.tries += 1;
        let mut change = 0;
        for level in &mut self.levels {
            change += level.change(&self.order, turn);
            // Most moves cost transforms at the first level already.
            if change >= 0 {
                return false;
            }
        }
        let before = self.batched(turn);
        self.order[turn.from..turn.to].rotate_left(turn.by);
        if FIFO_WEIGHT * change + self.batched(turn) - before >= 0 {
            self.order[turn.from..turn.to].rotate_right(turn.by);
            return false;
        }
        for place in turn.from..turn.to {
            self.places[self.order[place] as usize] = place as u32;
        }
        self.levels.iter_mut().for_each(|level| level.simulate(&self.order, turn.from, turn.to));
        true
    }

    /// Transforms around a move, in batches that begin at multiples of [`BATCH`] faces.
    fn batched(&mut self, turn: Turn) -> i64 {
        let last = self.order.len().min(turn.to + 2 * BATCH);
        let drawn = &self.order[turn.from / BATCH * BATCH..last];
        let faces = |level: &Level<'a>| drawn.iter().map(|&face| level.corners[face as usize]);
        let of_level = |level| self.batches.count(faces(level)).transforms as i64;
        self.levels.iter().map(of_level).sum()
    }
}

/// The FIFO's work at one level.
struct Level<'a> {
    corners: &'a [[u32; 3]],
    fifo: Fifo,
    /// For each place, a bit for each corner whose vertex is transformed.
    misses: Vec<u8>,
    /// What the FIFO holds before every `step`-th place.
    held: Vec<Vec<u32>>,
    step: usize,
}

impl<'a> Level<'a> {
    fn new(corners: &'a [[u32; 3]], vertices: usize, entries: u32, order: &[u32]) -> Self {
        let step = entries.max(16) as usize;
        let held = vec![Vec::new(); order.len().div_ceil(step)];
        let fifo = Fifo::new(vertices, entries as usize);
        let mut level = Self { corners, fifo, misses: vec![0; order.len()], held, step };
        level.simulate(order, 0, order.len());
        level
    }

    /// Sets the FIFO to its contents before `place`.
    fn start(&mut self, order: &[u32], place: usize) {
        self.fifo.hold(&self.held[place / self.step]);
        for &face in &order[place / self.step * self.step..place] {
            self.fifo.draw(self.corners[face as usize]);
        }
    }

    /// True if the FIFO holds at `place` what it held there before.
    fn is_as_before(&self, place: usize) -> bool {
        place.is_multiple_of(self.step) && self.held[place / self.step] == self.fifo.held()
    }

    /// The change in transforms by a move; [`i64::MAX`] / 2 if the move is given up: see [`WAKE`] and [`MAX_CHANGE`].
    fn change(&mut self, order: &[u32], turn: Turn) -> i64 {
        self.start(order, turn.from);
        let mut change = 0;
        for place in turn.from..order.len() {
            if place >= turn.to && self.is_as_before(place) {
                break;
            }
            if place >= turn.to + WAKE {
                return i64::MAX / 2;
            }
            let missed = self.fifo.draw(self.corners[order[turn.source(place)] as usize]);
            change += i64::from(missed.count_ones()) - i64::from(self.misses[place].count_ones());
            if change > MAX_CHANGE {
                return i64::MAX / 2;
            }
        }
        change
    }

    /// Notes the transforms of the faces from `from` to `to`, which have changed, and of all faces after them whose
    /// transforms change too.
    fn simulate(&mut self, order: &[u32], from: usize, to: usize) {
        self.start(order, from);
        for (place, &face) in order.iter().enumerate().skip(from) {
            if place >= to && self.is_as_before(place) {
                break;
            }
            if place.is_multiple_of(self.step) {
                let held = &mut self.held[place / self.step];
                held.clear();
                held.extend_from_slice(self.fifo.held());
            }
            self.misses[place] = self.fifo.draw(self.corners[face as usize]);
        }
    }
}

/// A FIFO whose contents can be set.
struct Fifo {
    entries: usize,
    /// The time at which each vertex last entered. A vertex leaves when `entries` others have entered after it.
    entered: Vec<u64>,
    clock: u64,
    /// The vertices that entered since the contents were set, oldest first.
    recent: Vec<u32>,
}

impl Fifo {
    fn new(vertices: usize, entries: usize) -> Self {
        Self { entries, entered: vec![0; vertices], clock: entries as u64, recent: Vec::new() }
    }

    /// Empties the FIFO and adds these vertices.
    fn hold(&mut self, vertices: &[u32]) {
        self.clock += self.entries as u64;
        self.recent.clear();
        vertices.iter().for_each(|&vertex| {
            self.is_missed(vertex);
        });
    }

    /// The vertices in the FIFO, oldest first.
    fn held(&self) -> &[u32] {
        &self.recent[self.recent.len().saturating_sub(self.entries)..]
    }

    /// A bit for each corner that is transformed.
    fn draw(&mut self, face: [u32; 3]) -> u8 {
        (0..3).map(|corner| u8::from(self.is_missed(face[corner])) << corner).sum()
    }

    /// Adds a vertex, unless the FIFO holds it.
    fn is_missed(&mut self, vertex: u32) -> bool {
        let entered = &mut self.entered[vertex as usize];
        let is_missed = self.clock - *entered >= self.entries as u64;
        if is_missed {
            self.clock += 1;
            *entered = self.clock;
            self.recent.push(vertex);
        }
        is_missed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::progressive_mesh::cache::transforms;
    use crate::paper::progressive_mesh::order::rollout::{Simulated, rollouts};
    use crate::paper::progressive_mesh::order::scratch::{fan, torus};

    /// A torus at two levels; at the first, every seventh vertex has not appeared.
    fn levels(side: u32) -> Levels {
        let fine = torus(side).faces;
        let parent = |vertex: u32| if vertex % 7 == 3 { vertex - 1 } else { vertex };
        let coarse = fine.iter().map(|face| face.map(parent)).collect();
        Levels { corners: [coarse, fine], vertices: (side * side) as usize, entries: 16 }
    }

    /// An order by rollouts for the second level.
    fn order(levels: &Levels) -> Vec<u32> {
        let fifo = Simulated { entries: 15, triangles: None, look_back: None };
        rollouts(&levels.corners[1], levels.vertices, fifo)
    }

    /// Transforms at both levels together.
    fn cost(levels: &Levels, order: &[u32], cache: Cache) -> i64 {
        let of_level = |corners: &Vec<[u32; 3]>| {
            let drawn: Vec<[u32; 3]> = order.iter().map(|&face| corners[face as usize]).collect();
            transforms(cache, &drawn).transforms as i64
        };
        levels.corners.iter().map(of_level).sum()
    }

    #[test]
    fn moves_save_transforms_in_a_fifo_and_cost_hardly_any_in_batches() {
        let levels = levels(40);
        let before = order(&levels);
        let after = or_opt(&levels, before.clone());
        let mut each = after.clone();
        each.sort_unstable();
        assert_eq!(each, (0..before.len() as u32).collect::<Vec<_>>(), "each face is drawn once");
        let [fifo, batches] = [Cache::Fifo(16), Cache::Batches]
            .map(|cache| [&before, &after].map(|order| cost(&levels, order, cache)));
        assert!(500 * fifo[1] < 499 * fifo[0], "{fifo:?} in a FIFO");
        assert!(1000 * batches[1] < 1003 * batches[0], "{batches:?} in batches");
    }

    #[test]
    fn a_face_far_from_its_neighbours_returns_to_them() {
        let levels = levels(24);
        let good = or_opt(&levels, order(&levels));
        let mut late = good.clone();
        late[400..460].rotate_left(1);
        let [before, after, found] =
            [&good, &late, &or_opt(&levels, late.clone())].map(|order| cost(&levels, order, Cache::Fifo(16)));
        // A face can return to a slightly worse place.
        let (more, left) = (after - before, found - before);
        assert!(
            more > 5 && 4 * left <= more,
            "{before}, {more} more with a late face, {left} more after or-opt"
        );
    }

    #[test]
    fn the_change_of_a_move_is_that_of_a_whole_simulation() {
        let levels = levels(24);
        let mut search = Search::new(&levels, order(&levels));
        let n = search.order.len();
        let mut known = 0;
        for step in 0..400 {
            let from = step * 37 % (n - 40);
            let (by, to) = (1 + step % 5, from + 6 + step % 30);
            let turn = Turn { from, by, to };
            let before = cost(&levels, &search.order, Cache::Fifo(16));
            let changes: Vec<i64> =
                search.levels.iter_mut().map(|level| level.change(&search.order, turn)).collect();
            search.order[from..to].rotate_left(by);
            search.levels.iter_mut().for_each(|level| level.simulate(&search.order, from, to));
            let after = cost(&levels, &search.order, Cache::Fifo(16));
            if changes.iter().all(|&change| change < 1000) {
                assert_eq!(changes.iter().sum::<i64>(), after - before, "{step}");
                known += 1;
            }
            let missed = |level: &Level| level.misses.iter().map(|missed| missed.count_ones()).sum::<u32>();
            assert_eq!(i64::from(search.levels.iter().map(missed).sum::<u32>()), after, "{step}");
        }
        assert!(known > 300, "{known} of 400 changes are known");
    }

    #[test]
    fn a_fan_takes_work_in_proportion_to_its_faces() {
        let tries = [2_000, 20_000].map(|n| {
            let corners = [fan(n), fan(n)];
            let levels = Levels { corners, vertices: n as usize + 1, entries: 16 };
            // Neighbours are far apart, so that every face transforms vertices again.
            let order = (0..40).flat_map(|first| (first..n).step_by(40)).collect();
            let mut search = Search::new(&levels, order);
            search.run();
            search.tries
        });
        assert!(tries[0] > 0 && tries[1] <= 15 * tries[0], "{tries:?}");
    }
}
