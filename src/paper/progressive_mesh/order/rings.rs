//! An order of faces in rings: a strip of faces winds around one vertex after the other, and turns back beside its own
//! start before the vertices there leave the cache. H. Hoppe, "Optimization of Mesh Locality for Transparent Vertex
//! Caching", SIGGRAPH 1999, decides where to turn back by simulating the cache for each possible length. The last
//! method of his program MeshReorder (`meshify10` of his Mesh-processing-library) turns back after a fixed number of
//! misses, and needs fewer transforms; this file follows it, and tries several such numbers.
//!
//! The order is a baseline (`re-optimised-rings`), and a candidate for births in place (`candidates.rs`).

use std::collections::VecDeque;

/// No corner: the edge is a border, more than two faces share it, or its two faces have opposite windings.
const NONE: u32 = u32::MAX;

/// Entries that are left for the vertices of the ring on which the strip turns back. MeshReorder has 9. On regular
/// meshes, 6 or 7 are better: `torus:24` then needs 1.18 transforms per vertex instead of 1.21.
const SPARE: std::ops::RangeInclusive<u32> = 6..=10;

/// With this number, rings need at most 2.5 % more transforms than with the best number, for a FIFO of 15 entries:
/// measured in 35 groups of more than 1,000 faces (of `torus:96`, and of the dragon with 47,794 and 202,520 faces).
const TYPICAL_SPARE: u32 = 8;

/// The faces in rings, for a FIFO of `entries` entries: the best order of all numbers of spare entries (`SPARE`).
/// `vertices` is one more than the largest index.
pub fn ring_order(faces: &[[u32; 3]], vertices: usize, entries: u32) -> Vec<[u32; 3]> {
    let rings = Rings::new(faces, vertices, entries);
    let best =
        rings.orders().min_by_key(|(_, transforms)| *transforms).map_or(Vec::new(), |(order, _)| order);
    best.into_iter().map(|face| faces[face as usize]).collect()
}

/// Faces, with what every walk over them needs.
pub(super) struct Rings<'a> {
    faces: &'a [[u32; 3]],
    entries: u32,
    corners_of: Vec<Vec<u32>>,
    twins: Vec<u32>,
}

impl<'a> Rings<'a> {
    /// See [`ring_order`].
    pub fn new(faces: &'a [[u32; 3]], vertices: usize, entries: u32) -> Self {
        let corners_of = corners_of(faces, vertices);
        let twins = twins(faces, &corners_of);
        Self { faces, entries, corners_of, twins }
    }

    /// The order for each of [`SPARE`], as indices into the faces, with its transforms.
    pub fn orders(&self) -> impl Iterator<Item = (Vec<u32>, u32)> {
        SPARE.map(|spare| self.order(spare))
    }

    /// The transforms of a typical order.
    pub fn typical_transforms(&self) -> u32 {
        self.order(TYPICAL_SPARE).1
    }

    fn order(&self, spare: u32) -> (Vec<u32>, u32) {
        let mut walk = Walk {
            faces: self.faces,
            twins: &self.twins,
            corners_of: &self.corners_of,
            is_done: vec![false; self.faces.len()],
            order: Vec::with_capacity(self.faces.len()),
            loads: vec![0; self.corners_of.len()],
            recent: VecDeque::new(),
            count: 0,
            entries: self.entries,
            max_misses: self.entries.saturating_sub(spare),
            first_open: 0,
        };
        while let Some(start) = walk.start() {
            walk.strip(start);
        }
        (walk.order, walk.count)
    }
}

/// A corner `3 f + k` stands for corner k of face f, and for the edge from this corner to the next.
struct Walk<'a> {
    faces: &'a [[u32; 3]],
    /// For each edge, the same edge in the other direction.
    twins: &'a [u32],
    /// The corners at each vertex.
    corners_of: &'a [Vec<u32>],
    is_done: Vec<bool>,
    order: Vec<u32>,
    /// For each vertex, the number of its last load; 0: never loaded.
    loads: Vec<u32>,
    /// The vertices in the cache; a vertex may have been loaded again since.
    recent: VecDeque<u32>,
    /// Loads so far.
    count: u32,
    entries: u32,
    /// Misses after which the strip turns back.
    max_misses: u32,
    /// All faces before this one are done.
    first_open: usize,
}

impl Walk<'_> {
    /// The corner, if its face is not done.
    fn open(&self, corner: u32) -> Option<u32> {
        (corner != NONE && !self.is_done[corner as usize / 3]).then_some(corner)
    }

    /// The corner at the same vertex in the next face counter-clockwise.
    fn turned(&self, corner: u32) -> Option<u32> {
        self.open(self.twins[previous(corner) as usize])
    }

    /// The corner at the same vertex in the next face clockwise.
    fn turned_back(&self, corner: u32) -> Option<u32> {
        self.open(self.twins[corner as usize]).map(next)
    }

    /// The face beyond the edge opposite to the corner: there the strip continues around another vertex.
    fn beyond(&self, corner: u32) -> Option<u32> {
        self.open(self.twins[next(corner) as usize])
    }

    /// The open face with the most vertices in the cache, and among these the fewest open neighbours. If no open face
    /// has a vertex in the cache: the first open face.
    fn start(&mut self) -> Option<u32> {
        let near = self.recent.iter().flat_map(|&vertex| &self.corners_of[vertex as usize]);
        let score = |corner: u32| {
            let face = corner / 3;
            let cached = self.faces[face as usize].iter().filter(|&&vertex| self.is_cached(vertex)).count();
            let neighbours =
                (0..3).filter(|k| self.open(self.twins[(3 * face + k) as usize]).is_some()).count();
            (cached, 3 - neighbours, std::cmp::Reverse(corner))
        };
        let best = near.filter_map(|&corner| self.open(corner)).max_by_key(|&corner| score(corner));
        best.or_else(|| {
            while self.is_done.get(self.first_open) == Some(&true) {
                self.first_open += 1;
            }
            (self.first_open < self.faces.len()).then_some(3 * self.first_open as u32)
        })
    }

    /// Walks until no face is open at either end of the strip.
    fn strip(&mut self, start: u32) {
        // Where to turn back, and other places beside the strip.
        let (mut back, mut later) = (None, VecDeque::new());
        let (mut corner, mut misses) = (start, 0);
        loop {
            // The ring's faces after the first one load a vertex each.
            let is_full = back.is_some() && misses + self.ring(corner) - 1 > self.max_misses;
            if is_full && let Some(place) = self.place(&mut back, &mut later) {
                corner = place;
            }
            loop {
                misses += self.emit(corner as usize / 3);
                let outer = self.beyond(corner);
                match (self.turned(corner), outer) {
                    (Some(inner), outer) => {
                        if let Some(outer) = outer {
                            if back.is_none() {
                                (back, misses) = (Some(outer), 0);
                                later.clear();
                            } else {
                                later.push_back(outer);
                            }
                        }
                        corner = inner;
                    }
                    (None, Some(outer)) => {
                        corner = outer;
                        break;
                    }
                    (None, None) => match self.place(&mut back, &mut later) {
                        Some(place) => corner = place,
                        None => return,
                    },
                }
            }
        }
    }

    /// The first place that is still open, moved clockwise to the start of its ring.
    fn place(&self, back: &mut Option<u32>, later: &mut VecDeque<u32>) -> Option<u32> {
        let mut places = back.take().into_iter().chain(std::iter::from_fn(|| later.pop_front()));
        let place = places.find(|&corner| self.open(corner).is_some())?;
        if self.turned(place).is_none() {
            return Some(place);
        }
        let mut corner = next(place);
        while let Some(earlier) = self.turned_back(corner) {
            if earlier / 3 == place / 3 {
                break;
            }
            corner = earlier;
        }
        Some(corner)
    }

    /// Number of open faces from this corner on, counter-clockwise around its vertex.
    fn ring(&self, corner: u32) -> u32 {
        let rest = std::iter::successors(self.turned(corner), |&at| self.turned(at));
        1 + rest.take_while(|&at| at != corner).count() as u32
    }

    /// Appends a face and returns its misses.
    fn emit(&mut self, face: usize) -> u32 {
        self.is_done[face] = true;
        self.order.push(face as u32);
        let before = self.count;
        for vertex in self.faces[face] {
            if !self.is_cached(vertex) {
                self.count += 1;
                self.loads[vertex as usize] = self.count;
                self.recent.push_back(vertex);
                if self.recent.len() > self.entries as usize {
                    self.recent.pop_front();
                }
            }
        }
        self.count - before
    }

    fn is_cached(&self, vertex: u32) -> bool {
        let load = self.loads[vertex as usize];
        load > 0 && self.count - load < self.entries
    }
}

fn next(corner: u32) -> u32 {
    if corner % 3 == 2 { corner - 2 } else { corner + 1 }
}

fn previous(corner: u32) -> u32 {
    if corner.is_multiple_of(3) { corner + 2 } else { corner - 1 }
}

fn corners_of(faces: &[[u32; 3]], vertices: usize) -> Vec<Vec<u32>> {
    let mut corners = vec![Vec::new(); vertices];
    for (corner, &vertex) in (0..).zip(faces.as_flattened()) {
        corners[vertex as usize].push(corner);
    }
    corners
}

/// For each edge, the same edge in the other direction, or [`NONE`].
fn twins(faces: &[[u32; 3]], corners_of: &[Vec<u32>]) -> Vec<u32> {
    let vertex = |corner: u32| faces[corner as usize / 3][corner as usize % 3];
    let edges = |from: u32, to: u32| {
        corners_of[from as usize].iter().copied().filter(move |&corner| vertex(next(corner)) == to)
    };
    let twin = |corner| {
        let (from, to) = (vertex(corner), vertex(next(corner)));
        let mut others = edges(to, from);
        match (edges(from, to).count(), others.next(), others.next()) {
            (1, Some(twin), None) => twin,
            _ => NONE,
        }
    };
    (0..3 * faces.len() as u32).map(twin).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::named;
    use crate::paper::progressive_mesh::cache::{Cache, Counter};

    fn cost(faces: &[[u32; 3]], vertices: usize, entries: u32) -> f64 {
        Counter::new(Cache::Fifo(entries), vertices).count(faces.iter().copied()).per_vertex()
    }

    #[test]
    fn every_face_occurs_once_also_where_edges_have_three_faces_or_one_direction() {
        let (fan, flipped) = (vec![[0, 1, 2], [1, 0, 3], [0, 1, 4], [5, 6, 7]], vec![[0, 1, 2], [0, 1, 3]]);
        for faces in [fan, flipped, vec![], vec![[2, 1, 0]], vec![[0, 1, 2]; 3]] {
            let mut order = ring_order(&faces, 8, 16);
            let mut expected = faces.clone();
            order.sort_unstable();
            expected.sort_unstable();
            assert_eq!(order, expected);
        }
    }

    #[test]
    fn rings_need_fewer_transforms_than_meshoptimizers_order() {
        for name in ["bunny", "sphere:12", "torus:24", "knot:8"] {
            let model = named(name).unwrap();
            let faces: Vec<[u32; 3]> =
                (0..model.faces.len()).map(|face| model.face_positions(face)).collect();
            let vertices = model.positions.len();
            let flat = meshopt::optimize_vertex_cache_fifo(faces.as_flattened(), vertices, 16);
            let other = cost(flat.as_chunks().0, vertices, 16);
            let rings = cost(&ring_order(&faces, vertices, 16), vertices, 16);
            assert!(rings < 0.96 * other && rings > 1.0, "{name}: {rings}, {other}");
        }
    }
}
