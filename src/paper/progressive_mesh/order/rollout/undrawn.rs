//! The list of undrawn faces.

/// The undrawn faces in the order of their indices, as a doubly linked list in a ring. A face that is taken out keeps
/// its neighbours, so faces are put back in O(1), in the reverse order (D. Knuth, "Dancing links", 2000).
pub(super) struct Undrawn {
    /// The next and the previous undrawn face of each face. The last element is the ring's start.
    links: Vec<[u32; 2]>,
}

impl Undrawn {
    /// A list of `faces` faces.
    pub fn all(faces: usize) -> Self {
        let ring = faces as u32 + 1;
        Self { links: (0..ring).map(|face| [(face + 1) % ring, (face + ring - 1) % ring]).collect() }
    }

    /// The first undrawn face. There must be one.
    pub fn first(&self) -> u32 {
        self.links[self.links.len() - 1][0]
    }

    pub fn take(&mut self, face: u32) {
        let [next, previous] = self.links[face as usize];
        self.links[next as usize][1] = previous;
        self.links[previous as usize][0] = next;
    }

    /// Puts back the last face that was taken and not put back.
    pub fn put_back(&mut self, face: u32) {
        let [next, previous] = self.links[face as usize];
        self.links[next as usize][1] = face;
        self.links[previous as usize][0] = face;
    }
}
