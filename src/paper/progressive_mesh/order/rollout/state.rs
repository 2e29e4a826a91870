//! The state of a search: the faces drawn so far, and the vertices in the simulated cache.

use super::near::Near;
use super::undrawn::Undrawn;
use super::{MAX_FACES, MAX_LEFT, Simulated, TRANSFORM, VALENCE_PERCENT};

/// Everything that a search reads of a vertex.
#[derive(Clone, Default)]
pub(super) struct Vertex {
    /// What the vertex now adds to the score of its faces.
    pub score: i32,
    /// If the vertex has at most [`MAX_FACES`] faces, `around[begin .. begin + left]` are its undrawn faces; the drawn
    /// ones follow, the last one first. Otherwise `around` is neither updated nor read.
    pub begin: u32,
    pub left: u32,
    /// The number of the vertex's faces.
    valence: u32,
}

pub(super) struct Search {
    /// The distinct corners of each face; a repeated corner is replaced by the dummy vertex `none`.
    pub faces: Vec<[u32; 3]>,
    /// All vertices; the last one is the dummy vertex `none`.
    pub vertices: Vec<Vertex>,
    none: u32,
    /// The faces around each vertex.
    around: Vec<u32>,
    /// The undrawn faces around cached vertices with at most [`MAX_FACES`] faces. In an empty batch, those that were
    /// nearby when the batch before it ended. To add all faces around a hub each time it enters the cache would take
    /// quadratic time.
    pub near: Near,
    pub cache: Simulated,
    /// For each number of undrawn faces: what a cached vertex with this number adds to the score of its faces.
    worths: [i32; MAX_LEFT + 1],
    /// For each vertex, true if the vertex is in the cache.
    cached: Vec<bool>,
    /// The faces drawn so far, in order.
    pub drawn: Vec<u32>,
    pub undrawn: Undrawn,
    /// All vertices that entered the cache, oldest first. Those from index `oldest` on are in the FIFO or the current
    /// batch. With a look-back, some of these are forgotten, and a vertex that was transformed again is listed twice.
    entered: Vec<u32>,
    oldest: usize,
    /// Triangles in the current batch.
    triangles: usize,
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

/// A state to which attempts return.
pub(super) struct Mark {
    pub drawn: usize,
    entered: usize,
    oldest: usize,
    triangles: usize,
    transforms: i64,
    half_finished: i64,
    near: Vec<u32>,
}

impl Search {
    pub fn new(faces: &[[u32; 3]], vertices: usize, cache: Simulated) -> Self {
        let none = vertices as u32;
        let distinct = |&[a, b, c]: &[u32; 3]| {
            [a, if b == a { none } else { b }, if c == a || c == b { none } else { c }]
        };
        let faces: Vec<[u32; 3]> = faces.iter().map(distinct).collect();
        let mut list = vec![Vertex::default(); vertices + 1];
        let corners = faces.iter().flatten().filter(|&&vertex| vertex != none);
        corners.for_each(|&vertex| list[vertex as usize].valence += 1);
        let mut filled = 0;
        for vertex in &mut list {
            vertex.begin = filled;
            filled += vertex.valence;
        }
        let mut around = vec![0; filled as usize];
        for (face, corners) in (0..).zip(&faces) {
            for &vertex in corners.iter().filter(|&&vertex| vertex != none) {
                let vertex = &mut list[vertex as usize];
                around[(vertex.begin + vertex.left) as usize] = face;
                vertex.left += 1;
            }
        }
        let worths = std::array::from_fn(|left| match left as i32 {
            0 => 0,
            left => TRANSFORM * VALENCE_PERCENT / 100 / left,
        });
        let mut search = Self {
            drawn: Vec::with_capacity(faces.len()),
            undrawn: Undrawn::all(faces.len()),
            near: Near::new(faces.len()),
            faces,
            vertices: list,
            none,
            around,
            cache,
            worths,
            cached: vec![false; vertices + 1],
            entered: Vec::new(),
            oldest: 0,
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
            let new = self.corners(face).filter(|&(corner, vertex)| !self.is_found(corner, vertex)).count();
            self.triangles < max && self.entered.len() - self.oldest + new <= self.cache.entries
        })
    }

    /// The corners of a face with their vertices, without the dummy vertex.
    fn corners(&self, face: u32) -> impl Iterator<Item = (usize, usize)> + use<> {
        let none = self.none as usize;
        let corners = self.faces[face as usize].map(|vertex| vertex as usize);
        corners.into_iter().enumerate().filter(move |&(_, vertex)| vertex != none)
    }

    /// True if the next face finds a vertex in the cache, as this corner.
    fn is_found(&self, corner: usize, vertex: usize) -> bool {
        self.cached[vertex] && self.is_in_reach(corner, vertex)
    }

    /// True if the look-back from this corner of the next face reaches the last use of a vertex.
    fn is_in_reach(&self, corner: usize, vertex: usize) -> bool {
        let distance = || self.uses.len() + corner - self.last_use[vertex] as usize;
        self.cache.look_back.is_none_or(|reach| distance() <= reach)
    }

    /// Takes a face out of the undrawn faces of a vertex: it changes places with the last one.
    fn take(&mut self, face: u32, vertex: usize) {
        let Vertex { begin, left, valence, .. } = &mut self.vertices[vertex];
        if *valence <= MAX_FACES {
            let undrawn = &mut self.around[*begin as usize..][..*left as usize];
            let place = undrawn.iter().position(|&other| other == face);
            undrawn.swap(place.expect("an undrawn face around the vertex"), *left as usize - 1);
        }
        *left -= 1;
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
        if self.triangles == 0 {
            self.near.set(&[]);
        }
        self.triangles += 1;
        self.near.remove(face);
        self.undrawn.take(face);
        self.drawn.push(face);
        if self.cache.look_back.is_some() {
            self.forget_before(face);
        }
        for (_, vertex) in self.corners(face) {
            self.take(face, vertex);
            if !self.cached[vertex] {
                let Vertex { left, valence, .. } = self.vertices[vertex];
                self.half_finished -= i64::from(left + 1 < valence);
                self.transforms += 1;
                if self.entered.len() - self.oldest == self.cache.entries {
                    self.evict();
                }
                self.entered.push(vertex as u32);
                self.cached[vertex] = true;
                self.bring_near(vertex);
            }
            self.score(vertex);
        }
        if let Some(reach) = self.cache.look_back {
            self.note_uses(face, reach);
        }
    }

    /// Forgets the vertices of the next face whose last use is beyond the look-back.
    fn forget_before(&mut self, face: u32) {
        for (corner, vertex) in self.corners(face) {
            if self.cached[vertex] && !self.is_in_reach(corner, vertex) {
                self.forget(vertex);
            }
        }
    }

    /// Notes the uses of the face's vertices. Then forgets earlier vertices whose last use is too far back for the
    /// first corner of the next face.
    fn note_uses(&mut self, face: u32, reach: usize) {
        for vertex in self.faces[face as usize] {
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

    /// Takes the oldest vertex out of the FIFO.
    fn evict(&mut self) {
        self.oldest += 1;
        self.forget(self.entered[self.oldest - 1] as usize);
    }

    /// Adds the undrawn faces of a vertex that is now cached to those nearby.
    fn bring_near(&mut self, vertex: usize) {
        let Vertex { begin, left, valence, .. } = self.vertices[vertex];
        if valence <= MAX_FACES {
            self.around[begin as usize..][..left as usize].iter().for_each(|&face| self.near.add(face));
        }
    }

    /// Marks a vertex as not cached. Its faces stay nearby only if another cached vertex brings them. In a batch the
    /// vertex keeps its place.
    fn forget(&mut self, vertex: usize) {
        self.uncache(vertex);
        let Vertex { begin, left, valence, .. } = self.vertices[vertex];
        if valence <= MAX_FACES {
            for &face in &self.around[begin as usize..][..left as usize] {
                if !self.is_nearby(face) {
                    self.near.remove(face);
                }
            }
        }
    }

    /// True if a cached vertex brings this face near.
    pub fn is_nearby(&self, face: u32) -> bool {
        let brings =
            |vertex: u32| self.cached[vertex as usize] && self.vertices[vertex as usize].valence <= MAX_FACES;
        self.faces[face as usize].into_iter().any(brings)
    }

    /// Marks a vertex as not cached.
    fn uncache(&mut self, vertex: usize) {
        self.cached[vertex] = false;
        self.half_finished += i64::from(self.vertices[vertex].left > 0);
        self.score(vertex);
    }

    /// Takes all vertices out of the cache. Their faces stay nearby until the new batch has a face.
    pub fn end_batch(&mut self) {
        self.triangles = 0;
        let oldest = std::mem::replace(&mut self.oldest, self.entered.len());
        for at in oldest..self.entered.len() {
            let vertex = self.entered[at] as usize;
            if self.cached[vertex] {
                self.uncache(vertex);
            }
        }
    }

    pub fn mark(&self) -> Mark {
        Mark {
            drawn: self.drawn.len(),
            entered: self.entered.len(),
            oldest: self.oldest,
            triangles: self.triangles,
            transforms: self.transforms,
            half_finished: self.half_finished,
            near: self.near.faces().to_vec(),
        }
    }

    /// Takes back all draws since `mark`.
    pub fn back(&mut self, mark: &Mark) {
        self.near.set(&mark.near);
        let drawn = self.drawn.split_off(mark.drawn);
        for &face in drawn.iter().rev() {
            self.undrawn.put_back(face);
            // In the reverse order of the draws, each face is the first of the drawn ones around its vertices.
            self.corners(face).for_each(|(_, vertex)| self.vertices[vertex].left += 1);
        }
        if self.cache.look_back.is_some() {
            for [vertex, before] in self.uses.split_off(3 * mark.drawn).into_iter().rev() {
                self.last_use[vertex as usize] = before;
            }
        }
        let entered = self.entered.split_off(mark.entered);
        entered.iter().for_each(|&vertex| self.cached[vertex as usize] = false);
        for at in mark.oldest..mark.entered {
            let vertex = self.entered[at] as usize;
            // At a mark, exactly the vertices beyond the look-back are forgotten.
            self.cached[vertex] = self.is_in_reach(0, vertex);
            self.score(vertex);
        }
        (self.oldest, self.triangles) = (mark.oldest, mark.triangles);
        (self.transforms, self.half_finished) = (mark.transforms, mark.half_finished);
        for face in drawn {
            self.corners(face).for_each(|(_, vertex)| self.score(vertex));
        }
    }
}
