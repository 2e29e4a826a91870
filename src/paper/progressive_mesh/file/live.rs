//! The mesh between two levels, and the faces around each vertex, from which the format makes its
//! predictions.
//!
//! A face has a constant number: its slot at birth. Faces are born before the permutations that move them, so
//! this number is also the face's index in the file.

use crate::math::rows::Rows;

/// Marks an absent face or index.
pub(super) const NONE: u32 = u32::MAX;

#[derive(Default)]
pub(super) struct Live {
    /// Current corners of each face, by face number.
    pub corners: Vec<[u32; 3]>,
    pub slot_of: Vec<u32>,
    pub face_at: Vec<u32>,
    /// The faces around each vertex, ascending.
    pub around: Rows,
    /// Scratch memory of [`Live::ring`]: for each `first` and each `second` the lowest face that has it.
    firsts: Marks,
    seconds: Marks,
}

/// A face at vertex s, rotated to start at s: corners (s, first, second).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RingFace {
    pub face: u32,
    pub first: u32,
    pub second: u32,
}

impl Live {
    pub(super) fn add_vertex(&mut self) {
        self.around.grow(self.around.len() + 1);
    }

    /// Adds a face in the next slot.
    pub(super) fn add_face(&mut self, corners: [u32; 3]) {
        let face = self.corners.len() as u32;
        self.corners.push(corners);
        self.slot_of.push(face);
        self.face_at.push(face);
        corners.iter().for_each(|&vertex| self.around.push(vertex as usize, face));
    }

    /// Replaces `split` by the newest vertex in `faces`: some of the faces around `split`, ascending.
    pub(super) fn replace(&mut self, split: u32, faces: &[u32]) {
        let new = self.around.len() as u32 - 1;
        for &face in faces {
            self.around.push(new as usize, face);
            let corners = &mut self.corners[face as usize];
            *corners = corners.map(|vertex| if vertex == split { new } else { vertex });
        }
        self.around.retain(split as usize, |face| faces.binary_search(&face).is_err());
    }

    /// The faces around `vertex` in ring order: the `second` of each face is the `first` of the next. Open fans come
    /// first, ordered by their first faces; then closed rings, each from its lowest face. The time is linear in the
    /// number of faces around `vertex`. Each of these faces has a bit in the file, so a small file cannot cause much
    /// work.
    pub(super) fn ring(&mut self, vertex: u32) -> Vec<RingFace> {
        let seen_from_here = |&face: &u32| {
            let [a, b, c] = self.corners[face as usize];
            let (first, second) = match vertex {
                v if v == a => (b, c),
                v if v == b => (c, a),
                _ => (a, b),
            };
            RingFace { face, first, second }
        };
        let faces: Vec<RingFace> = self.around.row(vertex as usize).iter().map(seen_from_here).collect();
        let (firsts, seconds) = (&mut self.firsts, &mut self.seconds);
        firsts.clear(self.around.len());
        seconds.clear(self.around.len());
        // Of several faces with the same `first`, the face with the lowest number is kept.
        for (at, face) in faces.iter().enumerate().rev() {
            firsts.set(face.first, at as u32);
            seconds.set(face.second, at as u32);
        }
        let mut ring = Vec::with_capacity(faces.len());
        let mut seen = vec![false; faces.len()];
        let mut walk = |start: usize| {
            let mut at = Some(start);
            while let Some(here) = at.filter(|&here| !seen[here]) {
                seen[here] = true;
                ring.push(faces[here]);
                at = firsts.get(faces[here].second).map(|at| at as usize);
            }
        };
        (0..faces.len()).filter(|&at| seconds.get(faces[at].first).is_none()).for_each(&mut walk);
        (0..faces.len()).for_each(walk);
        ring
    }
}

/// Numbers of some vertices, all cleared at once.
#[derive(Default)]
pub(super) struct Marks {
    turn: u32,
    /// For each vertex, the value of `turn` at which the vertex got its number, and the number.
    numbers: Vec<(u32, u32)>,
}

impl Marks {
    /// Forgets all numbers; from now on vertices below `count` may get a number.
    pub(super) fn clear(&mut self, count: usize) {
        if self.turn == u32::MAX {
            (self.turn, self.numbers) = (0, Vec::new());
        }
        self.turn += 1;
        self.numbers.resize(count.max(self.numbers.len()), (0, 0));
    }

    pub(super) fn set(&mut self, vertex: u32, number: u32) {
        self.numbers[vertex as usize] = (self.turn, number);
    }

    pub(super) fn get(&self, vertex: u32) -> Option<u32> {
        let (turn, number) = self.numbers[vertex as usize];
        (turn == self.turn).then_some(number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn live(vertices: u32, faces: &[[u32; 3]]) -> Live {
        let mut live = Live::default();
        (0..vertices).for_each(|_| live.add_vertex());
        faces.iter().for_each(|&corners| live.add_face(corners));
        live
    }

    fn order(live: &mut Live, vertex: u32) -> Vec<u32> {
        live.ring(vertex).iter().map(|face| face.face).collect()
    }

    #[test]
    fn a_ring_follows_the_faces_around_a_vertex() {
        let mut closed = live(5, &[[0, 1, 2], [3, 4, 0], [2, 3, 0], [4, 1, 0]]);
        assert_eq!(order(&mut closed, 0), [0, 2, 1, 3]);
        assert_eq!(closed.ring(0)[1], RingFace { face: 2, first: 2, second: 3 });
        let mut open = live(5, &[[0, 2, 3], [0, 3, 4], [0, 1, 2]]);
        assert_eq!(order(&mut open, 0), [2, 0, 1], "an open fan begins at its boundary");
        let mut two = live(7, &[[0, 5, 6], [0, 2, 3], [0, 1, 2], [4, 0, 6]]);
        assert_eq!(order(&mut two, 0), [0, 3, 2, 1]);
        assert!(order(&mut live(1, &[]), 0).is_empty());
    }

    #[test]
    fn marks_are_forgotten_together_also_after_2_to_the_32_turns() {
        let mut marks = Marks::default();
        marks.clear(3);
        marks.set(2, 7);
        assert_eq!([marks.get(2), marks.get(1)], [Some(7), None]);
        marks.clear(3);
        assert_eq!(marks.get(2), None);
        marks.turn = u32::MAX;
        marks.set(0, 1);
        marks.clear(4);
        assert_eq!([marks.get(0), marks.get(3)], [None, None]);
    }

    #[test]
    fn a_replaced_vertex_gives_its_faces_away() {
        let mut mesh = live(5, &[[0, 1, 2], [3, 4, 0], [2, 3, 0], [4, 1, 0]]);
        mesh.add_vertex();
        mesh.replace(0, &[1, 2]);
        assert_eq!((mesh.around.row(0), mesh.around.row(5)), ([0, 3].as_slice(), [1, 2].as_slice()));
        assert_eq!(mesh.corners, [[0, 1, 2], [3, 4, 5], [2, 3, 5], [4, 1, 0]]);
    }
}
