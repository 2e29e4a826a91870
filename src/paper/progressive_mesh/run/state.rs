//! The paper's pseudocode, executed on the paper's arrays.

use crate::paper::progressive_mesh::mesh::ProgressiveMesh;

/// The paper's F, the index buffer, of one mesh at one level: all slots, live or not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct State {
    level: u32,
    faces: Vec<[u32; 3]>,
}

impl State {
    /// The mesh at level 0 (the paper's M0).
    pub fn new(mesh: &ProgressiveMesh) -> State {
        State { level: 0, faces: mesh.faces.clone() }
    }

    pub fn level(&self) -> u32 {
        self.level
    }

    /// All of F, including slots that are not live.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// The live prefix of F.
    pub fn live<'a>(&'a self, mesh: &ProgressiveMesh) -> &'a [[u32; 3]] {
        &self.faces[..mesh.levels[self.level as usize].faces as usize]
    }

    /// Executes all steps between this level and `level`.
    ///
    /// # Panics
    /// If `mesh` has no such level, or fails [`ProgressiveMesh::check`].
    pub fn go_to(&mut self, mesh: &ProgressiveMesh, level: u32) {
        assert!(level <= mesh.last_level(), "level {level} of {}", mesh.last_level());
        while self.level < level {
            self.vsplit(mesh);
            if let Ok(index) = mesh.swaps.levels.binary_search(&self.level) {
                mesh.swaps.cycles_of(index).for_each(|n| tswap(&mut self.faces, mesh.swaps.cycles.row(n)));
            }
        }
        while self.level > level {
            if let Ok(index) = mesh.swaps.levels.binary_search(&self.level) {
                let cycles = mesh.swaps.cycles_of(index).rev();
                cycles.for_each(|n| tswap_back(&mut self.faces, mesh.swaps.cycles.row(n)));
            }
            self.ecol(mesh);
        }
    }

    fn vsplit(&mut self, mesh: &ProgressiveMesh) {
        let [old, new] = [0, 1].map(|n| mesh.levels[self.level as usize + n].vertices);
        for vertex in old..new {
            let index = (vertex - mesh.levels[0].vertices) as usize;
            for &slot in mesh.splits.slots.row(index) {
                replace(&mut self.faces[slot as usize], mesh.splits.split_vertices[index], vertex);
            }
        }
        self.level += 1;
    }

    fn ecol(&mut self, mesh: &ProgressiveMesh) {
        let [old, new] = [1, 0].map(|n| mesh.levels[self.level as usize - n].vertices);
        for vertex in (old..new).rev() {
            let index = (vertex - mesh.levels[0].vertices) as usize;
            for &slot in mesh.splits.slots.row(index) {
                replace(&mut self.faces[slot as usize], vertex, mesh.splits.split_vertices[index]);
            }
        }
        self.level -= 1;
    }
}

fn replace(face: &mut [u32; 3], old: u32, new: u32) {
    for corner in face {
        if *corner == old {
            *corner = new;
        }
    }
}

/// The paper's `tswap(numF, f1 … f_numF)`: each slot takes the face of the next slot, and the last slot
/// takes the face of the first.
pub fn tswap(faces: &mut [[u32; 3]], slots: &[u32]) {
    let [first, .., last] = slots else { return };
    let kept = faces[*first as usize];
    for pair in slots.windows(2) {
        faces[pair[0] as usize] = faces[pair[1] as usize];
    }
    faces[*last as usize] = kept;
}

/// The inverse of [`tswap`]: the same cycle, run backwards.
pub fn tswap_back(faces: &mut [[u32; 3]], slots: &[u32]) {
    let [first, .., last] = slots else { return };
    let kept = faces[*last as usize];
    for pair in slots.windows(2).rev() {
        faces[pair[1] as usize] = faces[pair[0] as usize];
    }
    faces[*first as usize] = kept;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tswap_moves_each_face_to_the_previous_slot_and_tswap_back_undoes_it() {
        let faces: Vec<[u32; 3]> = (0..5).map(|n| [n; 3]).collect();
        let mut swapped = faces.clone();
        tswap(&mut swapped, &[4, 1, 2]);
        assert_eq!(swapped, [0, 2, 4, 3, 1].map(|n| [n; 3]));
        tswap_back(&mut swapped, &[4, 1, 2]);
        assert_eq!(swapped, faces);
    }
}
