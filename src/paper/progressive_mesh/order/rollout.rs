//! Rollouts: an optimizer with lookahead. From the current state of the cache, several greedy optimizers draw some
//! faces each. The first half of the best attempt is kept, and the next rollouts begin where this half ends.
//!
//! The paper tried a lookahead of several steps and found it much slower and hardly better (section 5).
//! Rollouts take 16 greedy steps per face and save 0.06 transforms per vertex.

use super::patch::MOST_FACES;

/// Faces that an attempt draws, and how many of them are kept.
///
/// More work hardly pays. With 64 and 32, the full meshes of the five closed models need 1.234 transforms per vertex
/// (mean, FIFO of 16 entries). 64 and 8 need 1.235 in 3.8 times the time; 96 and 32: 1.235 in 1.6; 128 and 64: 1.241 in
/// 1.0; 128 and 16: 1.231 in 4.1.
const DRAWN: usize = 64;
const KEPT: usize = 32;

/// Scores are integers in units of 1 / [`TRANSFORM`] transforms, so the order is the same on every machine.
const TRANSFORM: i32 = 1 << 16;

/// Valence weights of the greedy optimizers, in percent (see [`super::Weights::valence`]). Each weight is tried without
/// and with noise.
const VALENCES_PERCENT: [i32; 4] = [60, 45, 80, 100];
/// The noise is at most a tenth of a transform.
const NOISE: i32 = TRANSFORM / 10;

/// Cost of a vertex that left the cache with undrawn faces: a quarter of a transform. The vertex must be
/// transformed again, but other orders may transform it twice, too, so it costs less than a transform.
const HALF_FINISHED_PER_TRANSFORM: i64 = 4;

/// Larger valences are reduced to this.
const MOST_LEFT: usize = 63;

/// The order in which to draw `faces` for a FIFO of `entries`, as indices into `faces`. All vertices are
/// below `vertices`. Equal corners of a degenerate face count once. If no cached vertex has an undrawn face,
/// the first undrawn face is drawn.
pub(super) fn rollouts(faces: &[[u32; 3]], vertices: usize, entries: usize) -> Vec<u32> {
    let mut search = Search::new(faces, vertices, entries);
    search.run();
    search.drawn
}

/// A number for each of [`VALENCES_PERCENT`].
type PerValence = [i32; VALENCES_PERCENT.len()];

#[derive(Clone)]
struct Face {
    /// The distinct corners; a repeated corner is replaced by the dummy vertex `none`.
    corners: [u32; 3],
    /// The last search that examined the face; [`IS_DRAWN`] once the face is drawn.
    seen: u32,
}

/// Everything that a search reads of a vertex, in half of a CPU cache line.
#[derive(Clone, Default)]
struct Vertex {
    /// What the vertex now adds to the score of its faces, for each of [`VALENCES_PERCENT`]. During an attempt, only
    /// the score for the attempt's own weight is up to date.
    scores: PerValence,
    /// `around[begin .. end]` are the vertex's faces. Some faces that are already drawn and kept are missing.
    begin: u32,
    end: u32,
    /// The number of the vertex's faces, and the number of these faces that are not drawn.
    valence: u32,
    left: u32,
}

struct Search {
    faces: Vec<Face>,
    /// All vertices; the last one is the dummy vertex `none`.
    vertices: Vec<Vertex>,
    none: u32,
    around: Vec<u32>,
    entries: usize,
    /// For each number of undrawn faces: what a cached vertex with this number adds to the score of its faces.
    worths: [PerValence; MOST_LEFT + 1],
    /// For each vertex, true if the vertex is in the cache.
    cached: Vec<bool>,
    searches: u32,
    /// The faces drawn so far, in order.
    drawn: Vec<u32>,
    undrawn: Undrawn,
    /// All vertices that entered the cache, oldest first. The vertices from index `oldest` on are cached.
    entered: Vec<u32>,
    oldest: usize,
    transforms: i64,
    /// Uncached vertices with some faces drawn and some not.
    half_finished: i64,
    /// Number of faces examined so far: a measure of the work.
    looks: u64,
}

/// Larger than the number of any search.
const IS_DRAWN: u32 = u32::MAX;

/// A state to which attempts return.
struct Mark {
    drawn: usize,
    entered: usize,
    oldest: usize,
    transforms: i64,
    half_finished: i64,
}

/// The undrawn faces in the order of their indices, as a doubly linked list in a ring. A face that is taken out keeps its
/// neighbours, so faces are put back in O(1), in the reverse order (D. Knuth, "Dancing links", 2000).
struct Undrawn {
    /// The next and the previous undrawn face of each face. The last element is the ring's start.
    links: Vec<[u32; 2]>,
}

impl Undrawn {
    /// A list of `faces` faces.
    fn all(faces: usize) -> Self {
        let ring = faces as u32 + 1;
        Self { links: (0..ring).map(|face| [(face + 1) % ring, (face + ring - 1) % ring]).collect() }
    }

    /// The first undrawn face. There must be one.
    fn first(&self) -> u32 {
        self.links[self.links.len() - 1][0]
    }

    fn take(&mut self, face: u32) {
        let [next, previous] = self.links[face as usize];
        self.links[next as usize][1] = previous;
        self.links[previous as usize][0] = next;
    }

    /// Puts back the last face that was taken and not put back.
    fn put_back(&mut self, face: u32) {
        let [next, previous] = self.links[face as usize];
        self.links[next as usize][1] = face;
        self.links[previous as usize][0] = face;
    }
}

impl Search {
    fn new(faces: &[[u32; 3]], vertices: usize, entries: usize) -> Self {
        let none = vertices as u32;
        let distinct = |&[a, b, c]: &[u32; 3]| {
            [a, if b == a { none } else { b }, if c == a || c == b { none } else { c }]
        };
        let faces: Vec<Face> = faces.iter().map(|face| Face { corners: distinct(face), seen: 0 }).collect();
        let mut list = vec![Vertex::default(); vertices + 1];
        let corners = || {
            let all = faces.iter().enumerate().flat_map(|(n, face)| face.corners.map(|vertex| (n, vertex)));
            all.filter(|&(_, vertex)| vertex != none)
        };
        corners().for_each(|(_, vertex)| list[vertex as usize].valence += 1);
        let mut filled = 0;
        for vertex in &mut list {
            (vertex.begin, vertex.end) = (filled, filled);
            filled += vertex.valence;
        }
        let mut around = vec![0; filled as usize];
        for (face, vertex) in corners() {
            let vertex = &mut list[vertex as usize];
            around[vertex.end as usize] = face as u32;
            vertex.end += 1;
            vertex.left += 1;
        }
        let worths = std::array::from_fn(|left| {
            VALENCES_PERCENT.map(|percent| match left as i32 {
                0 => 0,
                left => TRANSFORM * percent / 100 / left,
            })
        });
        let mut search = Self {
            drawn: Vec::with_capacity(faces.len()),
            undrawn: Undrawn::all(faces.len()),
            faces,
            vertices: list,
            none,
            around,
            entries,
            worths,
            cached: vec![false; vertices],
            searches: 0,
            entered: Vec::new(),
            oldest: 0,
            transforms: 0,
            half_finished: 0,
            looks: 0,
        };
        (0..vertices).for_each(|vertex| search.score_all(vertex));
        search
    }

    fn run(&mut self) {
        let mut round = 0;
        while self.drawn.len() < self.faces.len() {
            let start = self.mark();
            let end = self.faces.len().min(self.drawn.len() + DRAWN);
            let kept = self.faces.len().min(self.drawn.len() + KEPT);
            let mut best: Option<(i64, Vec<u32>)> = None;
            for attempt in 0..2 * VALENCES_PERCENT.len() {
                let noise = (attempt >= VALENCES_PERCENT.len()).then_some(round + attempt as u32);
                let valence = attempt % VALENCES_PERCENT.len();
                while self.drawn.len() < end {
                    let face = self.best(valence, noise);
                    self.draw(face, |search, vertex| search.score(vertex, valence));
                }
                let cost = HALF_FINISHED_PER_TRANSFORM * self.transforms + self.half_finished;
                if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                    best = Some((cost, self.drawn[start.drawn..kept].to_vec()));
                }
                self.back(&start, valence);
            }
            round += 2 * VALENCES_PERCENT.len() as u32;
            for face in best.expect("there are attempts").1 {
                self.draw(face, Self::score_all);
                self.pass(face);
            }
        }
    }

    /// The best of the first undrawn face and all undrawn faces around cached vertices; on a tie, the face found first.
    fn best(&mut self, valence: usize, noise: Option<u32>) -> u32 {
        self.searches += 1;
        let first = self.undrawn.first();
        self.faces[first as usize].seen = self.searches;
        let mut best = (self.worth(first, valence, noise), first);
        for at in self.oldest..self.entered.len() {
            let Vertex { begin, end, left, .. } = self.vertices[self.entered[at] as usize];
            if left == 0 {
                continue;
            }
            let end = end.min(begin + MOST_FACES);
            self.looks += u64::from(end - begin);
            for &face in &self.around[begin as usize..end as usize] {
                let seen = &mut self.faces[face as usize].seen;
                if *seen >= self.searches {
                    continue;
                }
                *seen = self.searches;
                let worth = self.worth(face, valence, noise);
                if worth > best.0 {
                    best = (worth, face);
                }
            }
        }
        best.1
    }

    /// The corners of a face, without the dummy vertex.
    fn corners(&self, face: u32) -> impl Iterator<Item = usize> + use<> {
        let none = self.none;
        let corners = self.faces[face as usize].corners.into_iter();
        corners.filter(move |&vertex| vertex != none).map(|vertex| vertex as usize)
    }

    /// Skips the drawn faces at the starts of the rows of the face's vertices.
    fn pass(&mut self, face: u32) {
        for vertex in self.corners(face) {
            let Vertex { begin, end, .. } = &mut self.vertices[vertex];
            while *begin < *end && self.faces[self.around[*begin as usize] as usize].seen == IS_DRAWN {
                *begin += 1;
            }
        }
    }

    fn worth(&self, face: u32, valence: usize, noise: Option<u32>) -> i32 {
        let scores =
            self.faces[face as usize].corners.map(|vertex| self.vertices[vertex as usize].scores[valence]);
        let noise = noise.map_or(0, |seed| (scattered(face, seed) as i32 * NOISE) >> 15);
        scores.into_iter().sum::<i32>() + noise
    }

    /// Updates what a vertex adds to the score of its faces, for one valence.
    fn score(&mut self, vertex: usize, valence: usize) {
        let missed = if self.cached[vertex] { 0 } else { TRANSFORM };
        let Vertex { scores, left, .. } = &mut self.vertices[vertex];
        scores[valence] = self.worths[(*left as usize).min(MOST_LEFT)][valence] - missed;
    }

    /// As [`Search::score`], for all valences.
    fn score_all(&mut self, vertex: usize) {
        (0..VALENCES_PERCENT.len()).for_each(|valence| self.score(vertex, valence));
    }

    /// Draws a face. Calls `score` for each vertex whose score changes.
    fn draw(&mut self, face: u32, score: impl Fn(&mut Self, usize)) {
        self.faces[face as usize].seen = IS_DRAWN;
        self.undrawn.take(face);
        self.drawn.push(face);
        for vertex in self.corners(face) {
            self.vertices[vertex].left -= 1;
            if !self.cached[vertex] {
                let Vertex { left, valence, .. } = self.vertices[vertex];
                self.half_finished -= i64::from(left + 1 < valence);
                self.transforms += 1;
                if self.entered.len() - self.oldest == self.entries {
                    let leaves = self.entered[self.oldest] as usize;
                    self.oldest += 1;
                    self.cached[leaves] = false;
                    self.half_finished += i64::from(self.vertices[leaves].left > 0);
                    score(self, leaves);
                }
                self.entered.push(vertex as u32);
                self.cached[vertex] = true;
            }
            score(self, vertex);
        }
    }

    fn mark(&self) -> Mark {
        Mark {
            drawn: self.drawn.len(),
            entered: self.entered.len(),
            oldest: self.oldest,
            transforms: self.transforms,
            half_finished: self.half_finished,
        }
    }

    /// Takes back all draws since `mark`. These draws must have kept only the scores of `valence` up to date.
    fn back(&mut self, mark: &Mark, valence: usize) {
        let drawn = self.drawn.split_off(mark.drawn);
        for &face in drawn.iter().rev() {
            self.undrawn.put_back(face);
            self.faces[face as usize].seen = 0;
            self.corners(face).for_each(|vertex| self.vertices[vertex].left += 1);
        }
        let entered = self.entered.split_off(mark.entered);
        entered.iter().for_each(|&vertex| self.cached[vertex as usize] = false);
        for at in mark.oldest..mark.entered {
            let vertex = self.entered[at] as usize;
            self.cached[vertex] = true;
            self.score(vertex, valence);
        }
        self.oldest = mark.oldest;
        (self.transforms, self.half_finished) = (mark.transforms, mark.half_finished);
        for face in drawn {
            self.corners(face).for_each(|vertex| self.score(vertex, valence));
        }
    }
}

/// 15 pseudo-random bits from a face and a seed.
fn scattered(face: u32, seed: u32) -> u32 {
    let mut bits = face.wrapping_mul(0x9E37_79B1) ^ seed.wrapping_mul(0x85EB_CA77);
    bits = (bits ^ bits >> 15).wrapping_mul(0x85EB_CA6B);
    (bits ^ bits >> 13) & 0x7FFF
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::progressive_mesh::cache::{Cache, transforms};
    use crate::paper::progressive_mesh::order::scratch::{fan, torus};

    fn drawn(faces: &[[u32; 3]], vertices: usize) -> Vec<[u32; 3]> {
        let order = rollouts(faces, vertices, 15);
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
            let mut search = Search::new(&fan(n), n as usize + 1, 15);
            search.run();
            search.looks
        });
        // Without a bound, the hub's undrawn faces are examined for each face: 100 times the work.
        assert!(looks[1] <= 15 * looks[0], "{looks:?}");
    }

    #[test]
    fn an_attempt_leaves_no_trace() {
        let mut search = Search::new(&torus(12).faces, 144, 15);
        let go = |search: &mut Search| {
            (0..100).for_each(|_| {
                let face = search.best(0, None);
                search.draw(face, |search, vertex| search.score(vertex, 0));
            });
            (search.drawn.clone(), search.transforms, search.half_finished)
        };
        go(&mut search);
        let start = search.mark();
        let first = go(&mut search);
        search.back(&start, 0);
        assert_eq!(go(&mut search), first);
    }
}
