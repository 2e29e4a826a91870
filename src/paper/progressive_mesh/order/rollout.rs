//! Rollouts: an optimizer with lookahead. From the current state of the cache, several greedies draw some
//! faces each. The first half of the best attempt is kept, and the next rollouts begin where it ends.
//!
//! The paper tried a lookahead of several steps and found it much slower and hardly better (section 5).
//! Rollouts take 16 greedy steps per face and save 0.06 transforms per vertex.

use super::patch::MOST_FACES;

/// Faces that an attempt draws, and how many of them are kept.
const DRAWN: usize = 64;
const KEPT: usize = 32;

/// Scores are integers in units of 1 / [`TRANSFORM`] transforms, so the order is the same on every machine.
const TRANSFORM: i32 = 1 << 16;

/// Valence weights of the greedies, in percent (see [`super::Weights::valence`]). Each is tried without and
/// with noise.
const VALENCES_PERCENT: [i32; 4] = [60, 45, 80, 100];
/// The noise is at most a tenth of a transform.
const NOISE: i32 = TRANSFORM / 10;

/// Cost of a vertex that left the cache with undrawn faces: a quarter of a transform. The vertex will be transformed
/// again, but other orders may transform it twice as well.
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

type Worth = [i32; MOST_LEFT + 1];

struct Search {
    /// Each face's distinct corners; a repeated corner is replaced by the dummy vertex `none`.
    faces: Vec<[u32; 3]>,
    none: u32,
    entries: usize,
    worths: [Worth; VALENCES_PERCENT.len()],
    /// Vertex v's faces are `around[starts[v] .. starts[v + 1]]`.
    starts: Vec<u32>,
    around: Vec<u32>,
    /// For each vertex, all faces of its row before this one are drawn and kept.
    begins: Vec<u32>,
    /// For each vertex the number of undrawn faces, and whether it is cached.
    left: Vec<u32>,
    cached: Vec<bool>,
    is_drawn: Vec<bool>,
    /// The faces drawn so far, in order.
    drawn: Vec<u32>,
    /// All faces before this one are drawn.
    first: usize,
    /// All vertices that entered the cache, oldest first; those from `oldest` on are cached.
    entered: Vec<u32>,
    oldest: usize,
    transforms: i64,
    /// Uncached vertices with some faces drawn and some not.
    half_finished: i64,
    /// For each face the last search that examined it.
    seen: Vec<u32>,
    searches: u32,
    /// Number of faces examined so far: a measure of the work.
    looks: u64,
}

/// A state to which attempts return.
struct Mark {
    drawn: usize,
    first: usize,
    entered: usize,
    oldest: usize,
    transforms: i64,
    half_finished: i64,
}

impl Search {
    fn new(faces: &[[u32; 3]], vertices: usize, entries: usize) -> Self {
        let none = vertices as u32;
        let distinct = |&[a, b, c]: &[u32; 3]| {
            [a, if b == a { none } else { b }, if c == a || c == b { none } else { c }]
        };
        let faces: Vec<[u32; 3]> = faces.iter().map(distinct).collect();
        let mut starts = vec![0; vertices + 2];
        faces.iter().flatten().for_each(|&vertex| starts[vertex as usize + 1] += 1);
        starts[vertices + 1] = 0;
        (0..=vertices).for_each(|vertex| starts[vertex + 1] += starts[vertex]);
        let mut left = vec![0; vertices + 1];
        let mut around = vec![0; starts[vertices] as usize];
        for (face, corners) in faces.iter().enumerate() {
            for &vertex in corners.iter().filter(|&&vertex| vertex != none) {
                around[(starts[vertex as usize] + left[vertex as usize]) as usize] = face as u32;
                left[vertex as usize] += 1;
            }
        }
        let worths = VALENCES_PERCENT.map(|percent| {
            std::array::from_fn(|left| match left as i32 {
                0 => 0,
                left => TRANSFORM * percent / 100 / left,
            })
        });
        let mut cached = vec![false; vertices + 1];
        cached[vertices] = true;
        Self {
            none,
            entries,
            worths,
            begins: starts.clone(),
            starts,
            around,
            left,
            cached,
            is_drawn: vec![false; faces.len()],
            drawn: Vec::with_capacity(faces.len()),
            first: 0,
            entered: Vec::new(),
            oldest: 0,
            transforms: 0,
            half_finished: 0,
            seen: vec![0; faces.len()],
            searches: 0,
            looks: 0,
            faces,
        }
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
                let worth = &self.worths[attempt % VALENCES_PERCENT.len()].clone();
                while self.drawn.len() < end {
                    let face = self.best(worth, noise);
                    self.draw(face);
                }
                let cost = HALF_FINISHED_PER_TRANSFORM * self.transforms + self.half_finished;
                if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                    best = Some((cost, self.drawn[start.drawn..kept].to_vec()));
                }
                self.back(&start);
            }
            round += 2 * VALENCES_PERCENT.len() as u32;
            for face in best.expect("there are attempts").1 {
                self.draw(face);
                self.pass(face);
            }
        }
    }

    /// The best of the first undrawn face and all undrawn faces around cached vertices; on a tie, the one
    /// found first.
    fn best(&mut self, worth: &Worth, noise: Option<u32>) -> u32 {
        while self.is_drawn[self.first] {
            self.first += 1;
        }
        self.searches += 1;
        let first = self.first as u32;
        self.seen[self.first] = self.searches;
        let mut best = (self.worth(first, worth, noise), first);
        for at in self.oldest..self.entered.len() {
            let vertex = self.entered[at] as usize;
            if self.left[vertex] == 0 {
                continue;
            }
            let begin = self.begins[vertex];
            let end = self.starts[vertex + 1].min(begin + MOST_FACES);
            self.looks += u64::from(end - begin);
            for around in begin..end {
                let face = self.around[around as usize];
                let seen = std::mem::replace(&mut self.seen[face as usize], self.searches);
                if seen == self.searches || self.is_drawn[face as usize] {
                    continue;
                }
                let worth = self.worth(face, worth, noise);
                if worth > best.0 {
                    best = (worth, face);
                }
            }
        }
        best.1
    }

    /// Skips the drawn faces at the starts of the rows of the face's vertices.
    fn pass(&mut self, face: u32) {
        for vertex in self.faces[face as usize].map(|vertex| vertex as usize) {
            if vertex == self.none as usize {
                continue;
            }
            let (begin, end) = (&mut self.begins[vertex], self.starts[vertex + 1]);
            while *begin < end && self.is_drawn[self.around[*begin as usize] as usize] {
                *begin += 1;
            }
        }
    }

    fn worth(&self, face: u32, worth: &Worth, noise: Option<u32>) -> i32 {
        let corner = |vertex: u32| {
            let missed = if self.cached[vertex as usize] { 0 } else { TRANSFORM };
            worth[(self.left[vertex as usize] as usize).min(MOST_LEFT)] - missed
        };
        let [a, b, c] = self.faces[face as usize].map(corner);
        let noise = noise.map_or(0, |seed| (scattered(face, seed) as i32 * NOISE) >> 15);
        a + b + c + noise
    }

    fn draw(&mut self, face: u32) {
        self.is_drawn[face as usize] = true;
        self.drawn.push(face);
        for vertex in self.faces[face as usize] {
            let at = vertex as usize;
            if vertex == self.none {
                continue;
            }
            self.left[at] -= 1;
            if self.cached[at] {
                continue;
            }
            if self.left[at] + 1 < self.starts[at + 1] - self.starts[at] {
                self.half_finished -= 1;
            }
            self.transforms += 1;
            if self.entered.len() - self.oldest == self.entries {
                let leaves = self.entered[self.oldest] as usize;
                self.oldest += 1;
                self.cached[leaves] = false;
                self.half_finished += i64::from(self.left[leaves] > 0);
            }
            self.entered.push(vertex);
            self.cached[at] = true;
        }
    }

    fn mark(&self) -> Mark {
        Mark {
            drawn: self.drawn.len(),
            first: self.first,
            entered: self.entered.len(),
            oldest: self.oldest,
            transforms: self.transforms,
            half_finished: self.half_finished,
        }
    }

    fn back(&mut self, mark: &Mark) {
        for face in self.drawn.drain(mark.drawn..) {
            self.is_drawn[face as usize] = false;
            for vertex in self.faces[face as usize] {
                self.left[vertex as usize] += u32::from(vertex != self.none);
            }
        }
        self.entered[self.oldest..].iter().for_each(|&vertex| self.cached[vertex as usize] = false);
        self.entered.truncate(mark.entered);
        self.entered[mark.oldest..].iter().for_each(|&vertex| self.cached[vertex as usize] = true);
        (self.first, self.oldest) = (mark.first, mark.oldest);
        (self.transforms, self.half_finished) = (mark.transforms, mark.half_finished);
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
        // The greedy with a valence term needs 1.30.
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
        let worth = search.worths[0];
        let go = |search: &mut Search| {
            (0..100).for_each(|_| {
                let face = search.best(&worth, None);
                search.draw(face);
            });
            (search.drawn.clone(), search.transforms, search.half_finished)
        };
        go(&mut search);
        let start = search.mark();
        let first = go(&mut search);
        search.back(&start);
        assert_eq!(go(&mut search), first);
    }
}
