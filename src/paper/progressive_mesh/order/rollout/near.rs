//! The undrawn faces around the cached vertices.

/// A set of faces, listed in no particular order.
pub(super) struct Near {
    faces: Vec<u32>,
    /// For each face, its index in `faces`, or [`NOWHERE`].
    places: Vec<u32>,
}

const NOWHERE: u32 = u32::MAX;

impl Near {
    /// An empty set of faces below `faces`.
    pub fn new(faces: usize) -> Self {
        Self { faces: Vec::new(), places: vec![NOWHERE; faces] }
    }

    pub fn faces(&self) -> &[u32] {
        &self.faces
    }

    pub fn add(&mut self, face: u32) {
        let place = &mut self.places[face as usize];
        if *place == NOWHERE {
            *place = self.faces.len() as u32;
            self.faces.push(face);
        }
    }

    pub fn remove(&mut self, face: u32) {
        let place = std::mem::replace(&mut self.places[face as usize], NOWHERE);
        if place != NOWHERE {
            self.faces.swap_remove(place as usize);
            if let Some(&moved) = self.faces.get(place as usize) {
                self.places[moved as usize] = place;
            }
        }
    }

    /// Replaces all faces by these.
    pub fn set(&mut self, faces: &[u32]) {
        self.faces.drain(..).for_each(|face| self.places[face as usize] = NOWHERE);
        faces.iter().for_each(|&face| self.add(face));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_face_is_listed_once_and_leaves_the_others() {
        let mut near = Near::new(6);
        [4, 1, 4, 5, 0].into_iter().for_each(|face| near.add(face));
        assert_eq!(near.faces(), [4, 1, 5, 0]);
        [1, 0, 2, 1].into_iter().for_each(|face| near.remove(face));
        assert_eq!(near.faces(), [4, 5]);
        near.set(&[3, 5]);
        [4, 3].into_iter().for_each(|face| near.remove(face));
        assert_eq!(near.faces(), [5]);
    }
}
