//! The greedy optimizer (paper 2, section 5): one face after the other, no lookahead, with the vertex cache simulated.
//!
//! The paper appends at each place a face that uses what is in the cache, swaps it with the face in place, and
//! prefers (a) the face that is in place already and (b) faces in lines of the CPU's cache that are touched anyway.
//! That leaves single faces behind, which later cost three transforms each. Ours adds what Forsyth's and Sander's
//! orders know: a vertex of which few faces are left should be finished now.

use super::patch::Patch;
use std::collections::VecDeque;

/// What a face is worth at a place, in transforms: one transform costs 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// For each corner, divided by the number of faces that are left at it. The paper has no such term (0).
    pub valence: f64,
    /// For the face that is in place already.
    pub in_place: f64,
    /// For a face in lines of the CPU's cache that are touched already.
    pub line: f64,
}

/// Lines of the CPU's cache over the face buffer.
pub(super) struct Lines {
    touched: Vec<bool>,
}

/// Bytes of a face in the buffer, and of a line: 5.33 faces.
const FACE_BYTES: usize = 12;
const LINE_BYTES: usize = 64;

impl Lines {
    pub fn new(slots: usize) -> Self {
        Self { touched: vec![false; (slots * FACE_BYTES).div_ceil(LINE_BYTES)] }
    }

    fn of(slot: usize) -> std::ops::RangeInclusive<usize> {
        slot * FACE_BYTES / LINE_BYTES..=(slot * FACE_BYTES + FACE_BYTES - 1) / LINE_BYTES
    }

    pub fn touch(&mut self, slot: usize) {
        self.touched[Lines::of(slot)].fill(true);
    }

    fn known(&self, slot: usize) -> bool {
        self.touched[Lines::of(slot)].iter().all(|&touched| touched)
    }
}

/// A stretch of a patch's places that follows on something: from which place on, and the vertices that the cache
/// holds there, the oldest first.
pub(super) struct Stretch {
    pub first: usize,
    pub warm: Vec<u32>,
}

/// The order of `patch`'s faces, whose places are in the order of its list, for a cache of `entries`. `lines` are
/// those of the places.
pub(super) fn greedy(
    patch: &Patch,
    entries: u32,
    weights: &Weights,
    stretches: &[Stretch],
    lines: &mut Lines,
) -> Vec<u32> {
    let mut greedy = Greedy::new(patch, entries, weights);
    let mut stretches = stretches.iter().peekable();
    for place in 0..patch.faces.len() {
        if let Some(stretch) = stretches.next_if(|stretch| stretch.first == place) {
            greedy.restart(&stretch.warm);
        }
        let face = greedy.best(place, lines);
        greedy.put(place, face, lines);
        greedy.draw(face);
    }
    greedy.at
}

struct Greedy<'a> {
    patch: &'a Patch,
    entries: u32,
    weights: Weights,
    /// The face at each place, and the place of each face: final before the current place.
    at: Vec<u32>,
    place_of: Vec<u32>,
    done: Vec<bool>,
    /// For each vertex how many of its faces are not drawn yet.
    left: Vec<u32>,
    /// When each vertex entered the cache, by the count of all that did; those in it, the oldest first.
    entered: Vec<u32>,
    clock: u32,
    cache: VecDeque<u32>,
}

impl<'a> Greedy<'a> {
    fn new(patch: &'a Patch, entries: u32, weights: &Weights) -> Self {
        let faces: Vec<u32> = (0..patch.faces.len() as u32).collect();
        Self {
            patch,
            entries,
            weights: *weights,
            place_of: faces.clone(),
            done: vec![false; faces.len()],
            at: faces,
            left: (0..patch.vertices as u32).map(|vertex| patch.around(vertex).len() as u32).collect(),
            entered: vec![0; patch.vertices],
            clock: entries,
            cache: VecDeque::new(),
        }
    }

    fn restart(&mut self, warm: &[u32]) {
        self.clock += self.entries;
        self.cache.clear();
        warm.iter().for_each(|&vertex| self.enter(vertex));
    }

    fn enter(&mut self, vertex: u32) {
        if self.clock - self.entered[vertex as usize] >= self.entries {
            self.clock += 1;
            self.entered[vertex as usize] = self.clock;
            self.cache.push_back(vertex);
            if self.cache.len() > self.entries as usize {
                self.cache.pop_front();
            }
        }
    }

    /// The best of the face in place and all faces at vertices in the cache; of equal ones the first found. (To
    /// go back, where the cache has nothing left, to the last vertex with faces left saves no more than 0.001: the
    /// face in place is near, since the order that it comes from was good.)
    fn best(&self, place: usize, lines: &Lines) -> u32 {
        let in_place = self.at[place];
        let mut best = (self.worth(in_place) + self.weights.in_place, in_place);
        for &vertex in &self.cache {
            if self.left[vertex as usize] == 0 {
                continue;
            }
            for &face in self.patch.around(vertex) {
                if self.done[face as usize] || face == in_place {
                    continue;
                }
                let mut worth = self.worth(face);
                if self.weights.line != 0.0 && lines.known(self.place_of[face as usize] as usize) {
                    worth += self.weights.line;
                }
                if worth > best.0 {
                    best = (worth, face);
                }
            }
        }
        best.1
    }

    fn worth(&self, face: u32) -> f64 {
        let corner = |&vertex: &u32| {
            let missed = self.clock - self.entered[vertex as usize] >= self.entries;
            self.weights.valence / f64::from(self.left[vertex as usize]) - f64::from(u8::from(missed))
        };
        self.patch.faces[face as usize].iter().map(corner).sum()
    }

    /// Swaps the face with that in place.
    fn put(&mut self, place: usize, face: u32, lines: &mut Lines) {
        let from = self.place_of[face as usize] as usize;
        if from != place {
            let displaced = self.at[place];
            (self.at[from], self.at[place]) = (displaced, face);
            (self.place_of[displaced as usize], self.place_of[face as usize]) = (from as u32, place as u32);
            lines.touch(from);
            lines.touch(place);
        }
    }

    fn draw(&mut self, face: u32) {
        self.done[face as usize] = true;
        for vertex in self.patch.faces[face as usize] {
            self.left[vertex as usize] -= 1;
            self.enter(vertex);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::progressive_mesh::cache::{Cache, transforms};
    use crate::paper::progressive_mesh::order::scratch::torus;

    const OURS: Weights = Weights { valence: 0.6, in_place: 0.0, line: 0.0 };

    fn ordered(weights: &Weights) -> Vec<[u32; 3]> {
        let model = torus(40);
        // Dealt like cards: no neighbours stand together.
        let dealt: Vec<[u32; 3]> =
            (0..61).flat_map(|first| model.faces.iter().skip(first).step_by(61).copied()).collect();
        let patch = Patch::new(dealt.clone(), 1600);
        let order = greedy(&patch, 16, weights, &[], &mut Lines::new(dealt.len()));
        let mut faces: Vec<[u32; 3]> = order.iter().map(|&face| dealt[face as usize]).collect();
        let found = faces.clone();
        faces.sort_unstable();
        let mut wanted = model.faces;
        wanted.sort_unstable();
        assert_eq!(faces, wanted, "each face once");
        found
    }

    #[test]
    fn finishing_vertices_saves_transforms() {
        let cost = |weights: &Weights| transforms(Cache::Fifo(16), &ordered(weights)).per_vertex();
        let (paper, ours) = (cost(&Weights { valence: 0.0, ..OURS }), cost(&OURS));
        assert!(ours < 1.8 && paper > ours + 0.25, "{paper} as the paper has it, {ours} with valence");
    }

    #[test]
    fn a_face_in_place_stays_where_its_weight_says_so() {
        let patch = Patch::new(torus(12).faces, 144);
        let stay = Weights { in_place: 9.0, ..OURS };
        let mut lines = Lines::new(288);
        let order = greedy(&patch, 16, &stay, &[], &mut lines);
        assert_eq!(order, (0..288).collect::<Vec<u32>>());
        assert!((0..288).all(|slot| !lines.known(slot)));
    }

    #[test]
    fn a_line_holds_five_faces_and_a_third() {
        let mut lines = Lines::new(16);
        lines.touch(0);
        assert_eq!([4, 5].map(|slot| lines.known(slot)), [true, false]);
        lines.touch(5);
        assert_eq!([5, 9, 10].map(|slot| lines.known(slot)), [true, true, false]);
    }
}
