//! Rollouts: an optimizer with lookahead. From the current state of the cache, a greedy optimizer draws some faces in
//! several attempts; all but the first add noise to its scores. The first faces of the best attempt are kept, and the
//! next rollouts begin where these end.
//!
//! The paper tried a lookahead of several steps and found it much slower and hardly better (section 5).
//! Rollouts take 16 greedy steps per face and save 0.08 transforms per vertex.
//!
//! The optimizer simulates a FIFO, or batches that share no vertex. A batch ends when no adjacent face fits, and
//! the next batch begins beside it. Within a batch, the look-back for a vertex can be limited.

use super::patch::MAX_FACES;

/// Attempts of a rollout, the faces that each draws, and how many faces of the best attempt are kept.
///
/// Mean over 128 levels of bunny, sphere and torus in the order `in-place-23` (one pass of the simplifier, FIFO of 16
/// entries): 1.243 transforms per vertex. With as much work, 8 attempts of 64 faces with four valence weights, 32 of
/// the faces kept, need 1.267 (all without rings and or-opt). More work pays slowly: 1.237 with 16 attempts, 40 and 24
/// (1.7 times the work), 1.232 with 20, 32 and 20 (2 times).
const ATTEMPTS: u32 = 12;
const DRAWN: usize = 32;
const KEPT: usize = 24;

/// Scores are integers in units of 1 / [`TRANSFORM`] transforms, so the order is the same on every machine.
const TRANSFORM: i32 = 1 << 16;

/// The valence weight of this optimizer in percent: see [`super::Weights::valence`]. With 70, in-place-23 needs 1.248.
const VALENCE_PERCENT: i32 = 50;
/// All attempts but the first add noise to the scores: at most 0.15 transforms. With 0.05, orders need about 0.01 more.
const NOISE: i32 = TRANSFORM * 15 / 100;

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
/// corners of a degenerate face count once. If no cached vertex has an undrawn face, the first undrawn face is drawn.
pub(super) fn rollouts(faces: &[[u32; 3]], vertices: usize, cache: Simulated) -> Vec<u32> {
    let mut search = Search::new(faces, vertices, cache);
    search.run();
    search.drawn
}

#[derive(Clone)]
struct Face {
    /// The distinct corners; a repeated corner is replaced by the dummy vertex `none`.
    corners: [u32; 3],
    /// The last search that examined the face; [`IS_DRAWN`] once the face is drawn.
    seen: u32,
}

/// Everything that a search reads of a vertex.
#[derive(Clone, Default)]
struct Vertex {
    /// What the vertex now adds to the score of its faces.
    score: i32,
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
    cache: Simulated,
    /// For each number of undrawn faces: what a cached vertex with this number adds to the score of its faces.
    worths: [i32; MAX_LEFT + 1],
    /// For each vertex, true if the vertex is in the cache.
    cached: Vec<bool>,
    searches: u32,
    /// The faces drawn so far, in order.
    drawn: Vec<u32>,
    undrawn: Undrawn,
    /// All vertices that entered the cache, oldest first. Those from index `oldest` on are in the FIFO or the current
    /// batch. With a look-back, some of these are forgotten, and a vertex that was transformed again is listed twice.
    /// With batches, those from `previous` to `oldest` are the batch before the current one. A FIFO does not use
    /// `previous`.
    entered: Vec<u32>,
    oldest: usize,
    previous: usize,
    /// Triangles in the current batch.
    triangles: usize,
    /// With a look-back: the corners of the drawn faces in order, each with the place of the vertex's use before it.
    /// Repeated corners are the dummy vertex, so the last use of a vertex can count up to 2 indices too early.
    uses: Vec<[u32; 2]>,
    /// With a look-back: for each vertex, the place of its last use in `uses`.
    last_use: Vec<u32>,
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
    previous: usize,
    triangles: usize,
    transforms: i64,
    half_finished: i64,
}

/// The undrawn faces in the order of their indices, as a doubly linked list in a ring. A face that is taken out keeps
/// its neighbours, so faces are put back in O(1), in the reverse order (D. Knuth, "Dancing links", 2000).
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
    fn new(faces: &[[u32; 3]], vertices: usize, cache: Simulated) -> Self {
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
        let worths = std::array::from_fn(|left| match left as i32 {
            0 => 0,
            left => TRANSFORM * VALENCE_PERCENT / 100 / left,
        });
        let mut search = Self {
            drawn: Vec::with_capacity(faces.len()),
            undrawn: Undrawn::all(faces.len()),
            faces,
            vertices: list,
            none,
            around,
            cache,
            worths,
            cached: vec![false; vertices],
            searches: 0,
            entered: Vec::new(),
            oldest: 0,
            previous: 0,
            triangles: 0,
            uses: Vec::new(),
            last_use: vec![0; vertices + 1],
            transforms: 0,
            half_finished: 0,
            looks: 0,
        };
        (0..vertices).for_each(|vertex| search.score(vertex));
        search
    }

    fn run(&mut self) {
        let mut round = 0;
        while self.drawn.len() < self.faces.len() {
            let start = self.mark();
            let end = self.faces.len().min(self.drawn.len() + DRAWN);
            let kept = self.faces.len().min(self.drawn.len() + KEPT);
            let mut best: Option<(i64, Vec<u32>)> = None;
            for attempt in 0..ATTEMPTS {
                let noise = (attempt > 0).then_some(round + attempt);
                while self.drawn.len() < end {
                    self.step(noise);
                }
                let cost = HALF_FINISHED_PER_TRANSFORM * self.transforms + self.half_finished;
                if best.as_ref().is_none_or(|(min, _)| cost < *min) {
                    best = Some((cost, self.drawn[start.drawn..kept].to_vec()));
                }
                self.back(&start);
            }
            round += ATTEMPTS;
            for face in best.expect("there are attempts").1 {
                self.draw(face);
                self.pass(face);
            }
        }
    }

    /// Draws the best face. If the current batch has no room for any face nearby, a new batch begins.
    fn step(&mut self, noise: Option<u32>) {
        let face = self.best(noise).or_else(|| {
            self.end_batch();
            self.best(noise)
        });
        self.draw(face.expect("a face fits into an empty batch"));
    }

    /// The best of the first undrawn face and all undrawn faces around vertices of the FIFO or the batch; on a tie, the
    /// face found first.
    /// An empty batch takes the faces around the batch before it. `None` if the current batch has room for none.
    fn best(&mut self, noise: Option<u32>) -> Option<u32> {
        self.searches += 1;
        let first = self.undrawn.first();
        self.faces[first as usize].seen = self.searches;
        let mut best = self.fits(first).then(|| (self.worth(first, noise), first));
        let near = match self.triangles {
            0 if self.cache.triangles.is_some() => self.previous,
            _ => self.oldest,
        };
        for at in near..self.entered.len() {
            let Vertex { begin, end, left, .. } = self.vertices[self.entered[at] as usize];
            if left == 0 {
                continue;
            }
            let end = end.min(begin + MAX_FACES);
            self.looks += u64::from(end - begin);
            for &face in &self.around[begin as usize..end as usize] {
                let seen = &mut self.faces[face as usize].seen;
                if *seen >= self.searches {
                    continue;
                }
                *seen = self.searches;
                let worth = self.worth(face, noise);
                if best.is_none_or(|(max, _)| worth > max) && self.fits(face) {
                    best = Some((worth, face));
                }
            }
        }
        best.map(|(_, face)| face)
    }

    /// True if the current batch has room for the face; a FIFO always has.
    fn fits(&self, face: u32) -> bool {
        self.cache.triangles.is_none_or(|max| {
            let corners = self.faces[face as usize].corners.into_iter().enumerate();
            let new =
                corners.filter(|&(at, vertex)| vertex != self.none && !self.is_found(at, vertex)).count();
            self.triangles < max && self.entered.len() - self.oldest + new <= self.cache.entries
        })
    }

    /// The corners of a face, without the dummy vertex.
    fn corners(&self, face: u32) -> impl Iterator<Item = usize> + use<> {
        let none = self.none;
        let corners = self.faces[face as usize].corners.into_iter();
        corners.filter(move |&vertex| vertex != none).map(|vertex| vertex as usize)
    }

    /// True if the next face finds a vertex in the cache, as its corner `at`.
    fn is_found(&self, at: usize, vertex: u32) -> bool {
        self.cached[vertex as usize] && self.is_near(at, vertex)
    }

    /// True if the look-back from corner `at` of the next face reaches the last use of a vertex.
    fn is_near(&self, at: usize, vertex: u32) -> bool {
        let distance = || self.uses.len() + at - self.last_use[vertex as usize] as usize;
        self.cache.look_back.is_none_or(|reach| distance() <= reach)
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

    fn worth(&self, face: u32, noise: Option<u32>) -> i32 {
        let corners = self.faces[face as usize].corners;
        let noise = noise.map_or(0, |seed| (scattered(face, seed) as i32 * NOISE) >> 15);
        corners.map(|vertex| self.vertices[vertex as usize].score).into_iter().sum::<i32>() + noise
    }

    /// Updates what a vertex adds to the score of its faces.
    fn score(&mut self, vertex: usize) {
        let missed = if self.cached[vertex] { 0 } else { TRANSFORM };
        let Vertex { score, left, .. } = &mut self.vertices[vertex];
        *score = self.worths[(*left as usize).min(MAX_LEFT)] - missed;
    }

    /// Draws a face, in a new batch if the current one has no room for it.
    fn draw(&mut self, face: u32) {
        if !self.fits(face) {
            self.end_batch();
        }
        self.triangles += 1;
        self.faces[face as usize].seen = IS_DRAWN;
        self.undrawn.take(face);
        self.drawn.push(face);
        if self.cache.look_back.is_some() {
            self.forget_before(face);
        }
        for vertex in self.corners(face) {
            self.vertices[vertex].left -= 1;
            if !self.cached[vertex] {
                let Vertex { left, valence, .. } = self.vertices[vertex];
                self.half_finished -= i64::from(left + 1 < valence);
                self.transforms += 1;
                if self.entered.len() - self.oldest == self.cache.entries {
                    self.evict();
                }
                self.entered.push(vertex as u32);
                self.cached[vertex] = true;
            }
            self.score(vertex);
        }
        if let Some(reach) = self.cache.look_back {
            self.note_uses(face, reach);
        }
    }

    /// Forgets the vertices of the next face whose last use is beyond the look-back.
    fn forget_before(&mut self, face: u32) {
        for (at, vertex) in self.faces[face as usize].corners.into_iter().enumerate() {
            if vertex != self.none && self.cached[vertex as usize] && !self.is_near(at, vertex) {
                self.forget(vertex as usize);
            }
        }
    }

    /// Notes the uses of the face's vertices. Then forgets earlier vertices whose last use is too far back for the
    /// first corner of the next face.
    fn note_uses(&mut self, face: u32, reach: usize) {
        for vertex in self.faces[face as usize].corners {
            let place = self.uses.len() as u32;
            self.uses.push([vertex, std::mem::replace(&mut self.last_use[vertex as usize], place)]);
        }
        let beyond = self.uses.len().saturating_sub(reach);
        for place in beyond.saturating_sub(3)..beyond {
            let vertex = self.uses[place][0] as usize;
            if self.last_use[vertex] as usize == place && vertex != self.none as usize && self.cached[vertex]
            {
                self.forget(vertex);
            }
        }
    }

    /// Takes the oldest vertex out of the cache.
    fn evict(&mut self) {
        let leaves = self.entered[self.oldest] as usize;
        self.oldest += 1;
        if self.cached[leaves] {
            self.forget(leaves);
        }
    }

    /// Marks a vertex as not cached. In a batch it keeps its place.
    fn forget(&mut self, vertex: usize) {
        self.cached[vertex] = false;
        self.half_finished += i64::from(self.vertices[vertex].left > 0);
        self.score(vertex);
    }

    fn end_batch(&mut self) {
        (self.previous, self.triangles) = (self.oldest, 0);
        while self.oldest < self.entered.len() {
            self.evict();
        }
    }

    fn mark(&self) -> Mark {
        Mark {
            drawn: self.drawn.len(),
            entered: self.entered.len(),
            oldest: self.oldest,
            previous: self.previous,
            triangles: self.triangles,
            transforms: self.transforms,
            half_finished: self.half_finished,
        }
    }

    /// Takes back all draws since `mark`.
    fn back(&mut self, mark: &Mark) {
        let drawn = self.drawn.split_off(mark.drawn);
        for &face in drawn.iter().rev() {
            self.undrawn.put_back(face);
            self.faces[face as usize].seen = 0;
            self.corners(face).for_each(|vertex| self.vertices[vertex].left += 1);
        }
        if self.cache.look_back.is_some() {
            for [vertex, before] in self.uses.split_off(3 * mark.drawn).into_iter().rev() {
                self.last_use[vertex as usize] = before;
            }
        }
        let entered = self.entered.split_off(mark.entered);
        entered.iter().for_each(|&vertex| self.cached[vertex as usize] = false);
        for at in mark.oldest..mark.entered {
            let vertex = self.entered[at];
            // At a mark, exactly the vertices beyond the look-back are forgotten.
            self.cached[vertex as usize] = self.is_near(0, vertex);
            self.score(vertex as usize);
        }
        (self.oldest, self.previous, self.triangles) = (mark.oldest, mark.previous, mark.triangles);
        (self.transforms, self.half_finished) = (mark.transforms, mark.half_finished);
        for face in drawn {
            self.corners(face).for_each(|vertex| self.score(vertex));
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
                search.step(None);
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
