//! Vanished positions and the faces that represent them: the deviation of the simplified mesh.
//!
//! Each vanished position is assigned to one face: the nearest among the faces that replaced its previous
//! face. A position on a border is also assigned to the border edge that replaced its own. The distance to
//! the assigned face is never less than the distance to the whole mesh.

use glam::DVec3;

/// The end of a list.
const END: u32 = u32::MAX;

/// Maximum length of a face's list for a model of this many positions. Positions beyond it share one bound, which grows
/// by a distance with each collapse. The average of 64 faces has such a list.
fn max_at_face(positions: usize) -> u32 {
    (positions / 64).max(1024) as u32
}

/// As [`max_at_face`], for border edges. On a straight border one edge may receive all other positions; the limit keeps
/// the work linear.
pub const MAX_AT_BORDER: u32 = 1024;

/// Lists of vanished positions: one for each face, or one for each border edge (indexed by the edge's start
/// in the direction of its face).
pub struct LostPositions {
    first: Vec<u32>,
    next: Vec<u32>,
    count: Vec<u32>,
    /// An upper bound of the distances of all positions that are assigned here but not in the list; negative
    /// if there are none.
    dropped: Vec<f64>,
    /// Maximum length of a list.
    max: u32,
}

impl LostPositions {
    /// Empty lists of at most `max` positions each, for `positions` positions.
    pub fn new(positions: usize, lists: usize, max: u32) -> LostPositions {
        LostPositions {
            first: vec![END; lists],
            next: vec![END; positions],
            count: vec![0; lists],
            dropped: vec![-1.0; lists],
            max,
        }
    }

    /// One list for each of `faces` faces. They begin with the points that are numbered from `positions` on, each with
    /// its face.
    pub fn at_faces(positions: usize, faces: usize, points: &[(u32, DVec3)]) -> LostPositions {
        let mut lost = LostPositions::new(positions + points.len(), faces, max_at_face(positions));
        (positions as u32..).zip(points).for_each(|(point, (face, _))| lost.give(point, *face, 0.0));
        lost
    }

    /// The positions of a list.
    pub fn of(&self, list: u32) -> impl Iterator<Item = u32> + '_ {
        let mut at = self.first[list as usize];
        std::iter::from_fn(move || {
            let found = (at != END).then_some(at)?;
            at = self.next[at as usize];
            Some(found)
        })
    }

    /// An upper bound of the distances of the positions that are assigned here but not in the list.
    pub fn dropped(&self, list: u32) -> Option<f64> {
        Some(self.dropped[list as usize]).filter(|bound| *bound >= 0.0)
    }

    /// Reads a list's start.
    pub fn touch(&self, list: u32) -> u32 {
        self.first[list as usize]
    }

    /// Empties a list; its positions can be assigned again.
    pub fn clear(&mut self, list: u32) {
        let list = list as usize;
        (self.first[list], self.count[list], self.dropped[list]) = (END, 0, -1.0);
    }

    /// Assigns a position at this distance to a list. A full list keeps only the distance.
    pub fn give(&mut self, position: u32, list: u32, distance: f64) {
        if self.count[list as usize] == self.max {
            return self.inherit(list, distance);
        }
        self.count[list as usize] += 1;
        self.next[position as usize] = std::mem::replace(&mut self.first[list as usize], position);
    }

    /// Takes over the bound of another list's dropped positions.
    pub fn inherit(&mut self, list: u32, bound: f64) {
        let dropped = &mut self.dropped[list as usize];
        *dropped = dropped.max(bound);
    }
}

/// The squared distance from a point to a segment, which may be a point.
pub fn squared_to_segment(p: DVec3, [a, b]: [DVec3; 2]) -> f64 {
    let (ab, ap) = (b - a, p - a);
    let length_squared = ab.length_squared();
    let along = if length_squared > 0.0 { (ab.dot(ap) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    (ap - ab * along).length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_list_keeps_the_largest_distance_of_the_rest() {
        let mut lists = LostPositions::new(2000, 2, 1024);
        (0..1024).for_each(|position| lists.give(position, 1, 9.0));
        assert_eq!((lists.of(1).count(), lists.dropped(1)), (1024, None));
        [3.0, 5.0, 4.0]
            .into_iter()
            .zip(1500..)
            .for_each(|(distance, position)| lists.give(position, 1, distance));
        assert_eq!((lists.of(1).count(), lists.dropped(1), lists.dropped(0)), (1024, Some(5.0), None));
        lists.clear(1);
        assert_eq!((lists.of(1).count(), lists.dropped(1)), (0, None));
    }
}
