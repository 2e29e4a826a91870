//! The greedy optimizer (paper 2, section 5): it appends one face at a time, without lookahead, and simulates
//! the vertex cache.
//!
//! For each place, the paper's optimizer picks a face that uses cached vertices, and swaps it with the face in that
//! place. The optimizer prefers (a) the face that is already in place and (b) faces in CPU cache lines that are touched
//! already. The paper's rule leaves isolated faces behind, which later cost three transforms each. We add a valence
//! term as in the optimizers of T. Forsyth ("Linear-Speed Vertex Cache Optimisation", 2006) and of P. Sander, D. Nehab
//! and J. Barczak ("Fast Triangle Reordering for Vertex Locality and Reduced Overdraw", SIGGRAPH 2007): vertices with
//! few faces left are finished first.

use super::patch::{MAX_FACES, Patch};

/// Terms of a face's score at a place, in transforms: a cache miss costs 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// Added for each corner, divided by the number of the corner's faces that are not drawn yet. The paper has no such
    /// term (0).
    pub valence: f64,
    /// The term of the face that is already in place.
    pub in_place: f64,
    /// The term of a face in CPU cache lines that are touched already.
    pub line: f64,
}

/// CPU cache lines of the face buffer.
pub(super) struct Lines {
    touched: Vec<bool>,
}

/// Bytes of a face in the buffer and of a cache line: a line holds 5.33 faces.
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

/// A contiguous run of slots in a patch: its first place, and the vertices that the cache holds there, oldest
/// first.
pub(super) struct Stretch {
    pub first: usize,
    pub warm: Vec<u32>,
}

/// The order of `patch`'s faces for a FIFO of `entries`. The faces' places are their indices in the patch,
/// and `lines` covers these places.
pub(super) fn greedy(
    patch: &Patch,
    entries: u32,
    weights: &Weights,
    stretches: &[Stretch],
    lines: &mut Lines,
) -> Vec<u32> {
    let mut greedy = Greedy::new(patch, entries, weights);
    greedy.run(stretches, lines);
    greedy.at
}

struct Greedy<'a> {
    patch: &'a Patch,
    entries: usize,
    weights: Weights,
    /// The face at each place, and the place of each face. Places before the current one are final.
    at: Vec<u32>,
    place_of: Vec<u32>,
    corners: Vec<Corner>,
    /// The faces around each vertex: all undrawn faces, and for a vertex with more than [`MAX_FACES`] faces also drawn
    /// faces.
    around: Vec<u32>,
    is_drawn: Vec<bool>,
    /// All vertices that entered the cache, oldest first. The last `entries` of them are cached, but none
    /// before `cold`.
    entered: Vec<u32>,
    cold: usize,
    /// Number of faces examined so far: a measure of the work.
    looks: u64,
}

/// A vertex. Its score is stored, because its faces are examined at a dozen places or more.
struct Corner {
    /// What the vertex adds to the score of each of its faces.
    worth: f64,
    /// The vertex's faces in `around`, and how many of these faces are not drawn yet.
    start: u32,
    end: u32,
    left: u32,
    is_cached: bool,
}

impl Corner {
    fn renew(&mut self, weights: &Weights) {
        self.worth = weights.valence / f64::from(self.left) - f64::from(u8::from(!self.is_cached));
    }
}

impl<'a> Greedy<'a> {
    fn new(patch: &'a Patch, entries: u32, weights: &Weights) -> Self {
        let faces: Vec<u32> = (0..patch.faces.len() as u32).collect();
        let corner = |vertex: usize| {
            let [start, end] = [patch.starts[vertex], patch.starts[vertex + 1]];
            let mut corner = Corner { worth: 0.0, start, end, left: end - start, is_cached: false };
            corner.renew(weights);
            corner
        };
        Self {
            patch,
            entries: entries as usize,
            weights: *weights,
            place_of: faces.clone(),
            at: faces,
            corners: (0..patch.vertices).map(corner).collect(),
            around: patch.around.clone(),
            is_drawn: vec![false; patch.faces.len()],
            entered: Vec::with_capacity(patch.vertices),
            cold: 0,
            looks: 0,
        }
    }

    fn run(&mut self, stretches: &[Stretch], lines: &mut Lines) {
        let mut stretches = stretches.iter().peekable();
        for place in 0..self.patch.faces.len() {
            if let Some(stretch) = stretches.next_if(|stretch| stretch.first == place) {
                self.restart(&stretch.warm);
            }
            let face = self.best(place, lines);
            self.put(place, face, lines);
            self.draw(face);
        }
    }

    /// The cached vertices, oldest first.
    fn cache(&self) -> &[u32] {
        &self.entered[self.cold.max(self.entered.len().saturating_sub(self.entries))..]
    }

    fn restart(&mut self, warm: &[u32]) {
        for vertex in self.cache().to_vec() {
            self.leave(vertex);
        }
        self.cold = self.entered.len();
        warm.iter().for_each(|&vertex| self.enter(vertex));
    }

    fn enter(&mut self, vertex: u32) {
        let corner = &mut self.corners[vertex as usize];
        let was_cached = std::mem::replace(&mut corner.is_cached, true);
        corner.renew(&self.weights);
        if !was_cached {
            if let [oldest, rest @ ..] = self.cache()
                && rest.len() + 1 == self.entries
            {
                self.leave(*oldest);
            }
            self.entered.push(vertex);
        }
    }

    fn leave(&mut self, vertex: u32) {
        let corner = &mut self.corners[vertex as usize];
        corner.is_cached = false;
        corner.renew(&self.weights);
    }

    /// The best of the face in place and all faces around cached vertices; on a tie, the face found first. If no cached
    /// vertex has faces left, this is the face in place. That face is usually near the last drawn face, because the
    /// faces were in a good order before. Returning to the last vertex that has faces left would save at most 0.001
    /// transforms per vertex.
    fn best(&mut self, place: usize, lines: &Lines) -> u32 {
        let mut looks = 0;
        let in_place = self.at[place];
        let mut best = (self.worth(in_place) + self.weights.in_place, in_place);
        for &vertex in self.cache() {
            let around = self.around(vertex);
            looks += around.len() as u64;
            for &face in around.iter().filter(|&&face| !self.is_drawn[face as usize]) {
                let mut worth = self.worth(face);
                if self.weights.line != 0.0 && lines.known(self.place_of[face as usize] as usize) {
                    worth += self.weights.line;
                }
                if worth > best.0 && face != in_place {
                    best = (worth, face);
                }
            }
        }
        self.looks += looks;
        best.1
    }

    fn worth(&self, face: u32) -> f64 {
        let [a, b, c] = self.patch.faces[face as usize].map(|vertex| self.corners[vertex as usize].worth);
        a + b + c
    }

    /// The faces of a vertex, at most [`MAX_FACES`]; some may be drawn.
    fn around(&self, vertex: u32) -> &[u32] {
        let Corner { start, end, .. } = self.corners[vertex as usize];
        &self.around[start as usize..end.min(start + MAX_FACES) as usize]
    }

    /// Swaps `face` with the face in `place`.
    fn put(&mut self, place: usize, face: u32, lines: &mut Lines) {
        let from = self.place_of[face as usize] as usize;
        if from != place {
            let displaced = self.at[place];
            (self.at[from], self.at[place]) = (displaced, face);
            (self.place_of[displaced as usize], self.place_of[face as usize]) = (from as u32, place as u32);
            if self.weights.line != 0.0 {
                lines.touch(from);
                lines.touch(place);
            }
        }
    }

    fn draw(&mut self, face: u32) {
        self.is_drawn[face as usize] = true;
        for vertex in self.patch.faces[face as usize] {
            let corner = &mut self.corners[vertex as usize];
            corner.left -= 1;
            let (start, end) = (corner.start as usize, corner.end as usize);
            let row = &self.around[start..end];
            if row.len() > MAX_FACES as usize {
                let drawn = row.iter().take_while(|&&face| self.is_drawn[face as usize]).count();
                corner.start += drawn as u32;
                self.looks += drawn as u64;
            } else if let Some(at) = row.iter().position(|&other| other == face) {
                // Keeps their order: on a tie, the face found first wins.
                self.around.copy_within(start + at + 1..end, start + at);
                corner.end -= 1;
            }
            self.enter(vertex);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::progressive_mesh::cache::{Cache, transforms};
    use crate::paper::progressive_mesh::order::scratch::{fan, torus};

    const OURS: Weights = Weights { valence: 0.6, in_place: 0.0, line: 0.0 };

    fn ordered(weights: &Weights) -> Vec<[u32; 3]> {
        let model = torus(40);
        // Takes every 61st face, once from each of the first 61 faces, so that no two neighbours are adjacent in the
        // list.
        let dealt: Vec<[u32; 3]> =
            (0..61).flat_map(|first| model.faces.iter().skip(first).step_by(61).copied()).collect();
        let patch = Patch::new(dealt.clone(), 1600);
        let order = greedy(&patch, 16, weights, &[], &mut Lines::new(dealt.len()));
        let mut faces: Vec<[u32; 3]> = order.iter().map(|&face| dealt[face as usize]).collect();
        let found = faces.clone();
        faces.sort_unstable();
        let mut wanted = model.faces;
        wanted.sort_unstable();
        assert_eq!(faces, wanted, "each face is drawn once");
        found
    }

    #[test]
    fn finishing_vertices_saves_transforms() {
        let cost = |weights: &Weights| transforms(Cache::Fifo(16), &ordered(weights)).per_vertex();
        let (paper, ours) = (cost(&Weights { valence: 0.0, ..OURS }), cost(&OURS));
        assert!(ours < 1.8 && paper > ours + 0.25, "{paper} without the valence term, {ours} with it");
    }

    #[test]
    fn a_large_weight_keeps_every_face_in_place() {
        let patch = Patch::new(torus(12).faces, 144);
        let stay = Weights { in_place: 9.0, ..OURS };
        let mut lines = Lines::new(288);
        let order = greedy(&patch, 16, &stay, &[], &mut lines);
        assert_eq!(order, (0..288).collect::<Vec<u32>>());
        assert!((0..288).all(|slot| !lines.known(slot)));
    }

    #[test]
    fn a_fan_takes_work_in_proportion_to_its_faces() {
        let looks = [4_000, 40_000].map(|n| {
            let patch = Patch::new(fan(n), n as usize + 1);
            let mut greedy = Greedy::new(&patch, 16, &OURS);
            greedy.run(&[], &mut Lines::new(n as usize));
            greedy.looks
        });
        // Without a bound, the hub's undrawn faces are examined for each face: 100 times the work.
        assert!(looks[1] <= 15 * looks[0], "{looks:?}");
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
