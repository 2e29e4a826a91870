//! The state of a search: the faces drawn so far, and the vertices in the simulated cache.

use super::undrawn::Undrawn;
use super::{MAX_LEFT, Simulated, TRANSFORM, VALENCE_PERCENT};

#[derive(Clone)]
pub(super) struct Face {
    /// The distinct corners; a repeated corner is replaced by the dummy vertex `none`.
    pub corners: [u32; 3],
    /// The last search that examined the face; [`IS_DRAWN`] once the face is drawn.
    pub seen: u32,
}

/// Everything that a search reads of a vertex.
#[derive(Clone, Default)]
pub(super) struct Vertex {
    /// What the vertex now adds to the score of its faces.
    pub score: i32,
    /// `around[begin .. end]` are the vertex's faces. Some faces that are already drawn and kept are missing.
    pub begin: u32,
    pub end: u32,
    /// The number of the vertex's faces, and the number of these faces that are not drawn.
    valence: u32,
    pub left: u32,
}

pub(super) struct Search {
    pub faces: Vec<Face>,
    /// All vertices; the last one is the dummy vertex `none`.
    pub vertices: Vec<Vertex>,
    none: u32,
    pub around: Vec<u32>,
    pub cache: Simulated,
    /// For each number of undrawn faces: what a cached vertex with this number adds to the score of its faces.
    worths: [i32; MAX_LEFT + 1],
    /// For each vertex, true if the vertex is in the cache.
    cached: Vec<bool>,
    pub searches: u32,
    /// The faces drawn so far, in order.
    pub drawn: Vec<u32>,
    pub undrawn: Undrawn,
    /// All vertices that entered the cache, oldest first. Those from index `oldest` on are in the FIFO or the current
    /// batch. With a look-back, some of these are forgotten, and a vertex that was transformed again is listed twice.
    /// With batches, those from `previous` to `oldest` are the batch before the current one. A FIFO does not use
    /// `previous`.
    pub entered: Vec<u32>,
    pub oldest: usize,
    pub previous: usize,
    /// Triangles in the current batch.
    pub triangles: usize,
    /// With a look-back: the corners of the drawn faces in order, each with the place of the vertex's use before it.
    /// Repeated corners are the dummy vertex, so the last use of a vertex can count up to 2 indices too early.
    uses: Vec<[u32; 2]>,
    /// With a look-back: for each vertex, the place of its last use in `uses`.
    last_use: Vec<u32>,
    pub transforms: i64,
    /// Uncached vertices with some faces drawn and some not.
    pub half_finished: i64,
    /// Number of faces examined so far: a measure of the work.
    pub looks: u64,
}

/// Larger than the number of any search.
const IS_DRAWN: u32 = u32::MAX;

/// A state to which attempts return.
pub(super) struct Mark {
    pub drawn: usize,
    entered: usize,
    oldest: usize,
    previous: usize,
    triangles: usize,
    transforms: i64,
    half_finished: i64,
}

impl Search {
    pub fn new(faces: &[[u32; 3]], vertices: usize, cache: Simulated) -> Self {
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

    /// True if the current batch has room for the face; a FIFO always has.
    pub fn fits(&self, face: u32) -> bool {
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
    pub fn pass(&mut self, face: u32) {
        for vertex in self.corners(face) {
            let Vertex { begin, end, .. } = &mut self.vertices[vertex];
            while *begin < *end && self.faces[self.around[*begin as usize] as usize].seen == IS_DRAWN {
                *begin += 1;
            }
        }
    }

    /// Updates what a vertex adds to the score of its faces.
    fn score(&mut self, vertex: usize) {
        let missed = if self.cached[vertex] { 0 } else { TRANSFORM };
        let Vertex { score, left, .. } = &mut self.vertices[vertex];
        *score = self.worths[(*left as usize).min(MAX_LEFT)] - missed;
    }

    /// Draws a face, in a new batch if the current one has no room for it.
    pub fn draw(&mut self, face: u32) {
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

    pub fn end_batch(&mut self) {
        (self.previous, self.triangles) = (self.oldest, 0);
        while self.oldest < self.entered.len() {
            self.evict();
        }
    }

    pub fn mark(&self) -> Mark {
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
    pub fn back(&mut self, mark: &Mark) {
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
