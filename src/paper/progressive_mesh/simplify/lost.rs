//! Vanished positions and the faces that represent them: the deviation of the simplified mesh.
//!
//! Each vanished position belongs to the face nearest to it, among those that took the place of its faces when it last
//! changed hands; on a border also to the edge of the border that took the place of its own. The distance to that
//! face is never less than the distance to the whole mesh.

use glam::DVec3;

/// The end of a list.
const END: u32 = u32::MAX;

/// Lists of vanished positions: for each face, and for each edge of the border (by the position at which it starts,
/// in the direction of its face).
pub struct Lost {
    of_face: Vec<u32>,
    next_of_face: Vec<u32>,
    of_border: Vec<u32>,
    next_of_border: Vec<u32>,
}

impl Lost {
    pub fn new(positions: usize, faces: usize) -> Lost {
        Lost {
            of_face: vec![END; faces],
            next_of_face: vec![END; positions],
            of_border: vec![END; positions],
            next_of_border: vec![END; positions],
        }
    }

    fn list(first: u32, next: &[u32]) -> impl Iterator<Item = u32> + '_ {
        let mut at = first;
        std::iter::from_fn(move || {
            let found = (at != END).then_some(at)?;
            at = next[at as usize];
            Some(found)
        })
    }

    /// The positions that belong to a face.
    pub fn of_face(&self, face: u32) -> impl Iterator<Item = u32> + '_ {
        Lost::list(self.of_face[face as usize], &self.next_of_face)
    }

    /// The positions that belong to the border's edge that starts at `start`.
    pub fn of_border(&self, start: u32) -> impl Iterator<Item = u32> + '_ {
        Lost::list(self.of_border[start as usize], &self.next_of_border)
    }

    /// Releases the positions of a face.
    pub fn clear_face(&mut self, face: u32) {
        self.of_face[face as usize] = END;
    }

    /// Releases the positions of a border edge.
    pub fn clear_border(&mut self, start: u32) {
        self.of_border[start as usize] = END;
    }

    /// Assigns a released position to a face.
    pub fn give_to_face(&mut self, position: u32, face: u32) {
        self.next_of_face[position as usize] = std::mem::replace(&mut self.of_face[face as usize], position);
    }

    /// Assigns a released position to a border edge.
    pub fn give_to_border(&mut self, position: u32, start: u32) {
        self.next_of_border[position as usize] =
            std::mem::replace(&mut self.of_border[start as usize], position);
    }
}

/// The squared distance from a point to a segment, which may be a point.
pub fn squared_to_segment(p: DVec3, [a, b]: [DVec3; 2]) -> f64 {
    let (ab, ap) = (b - a, p - a);
    let length_squared = ab.length_squared();
    let along = if length_squared > 0.0 { (ab.dot(ap) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    (ap - ab * along).length_squared()
}
