//! Execution of births in place. The levels from one permutation's level up to the level before the next permutation
//! draw the same list of faces. These are the faces that are live at the next permutation's level, in the order after
//! that permutation.
//!
//! A vertex that is not yet live is replaced by its predecessor ([`ProgressiveMesh::predecessors`]). A split
//! therefore writes its vertex into every slot whose chain of predecessors contains it. The same writes give
//! the new faces their area.

use super::program::Program;
use super::state::{State, tswap_back};
use crate::paper::progressive_mesh::mesh::ProgressiveMesh;

impl Program {
    /// Packs a checked mesh with births in place.
    pub(super) fn in_place(mesh: &ProgressiveMesh) -> Program {
        let mut program = Program { levels: mesh.levels.clone(), corner_ends: vec![0], ..Program::default() };
        let predecessors = mesh.predecessors();
        let last = mesh.last_level();
        let behind = (mesh.swaps.levels.last() != Some(&last)).then_some(last);
        let mut state = State::new(mesh);
        let mut start = 0;
        for (index, end) in mesh.swaps.levels.iter().copied().chain(behind).enumerate() {
            state.go_to(mesh, end);
            let mut faces = state.live(mesh).to_vec();
            program.write_group(mesh, &predecessors, [start, end], &mut faces);
            // All levels of a group are drawn in the order of the group's end, so the permutation is executed at the
            // group's first level.
            let mut cycles = 0..0;
            if index < mesh.swaps.levels.len() && index > 0 {
                cycles = mesh.swaps.cycles_of(index);
                program.push_moves(start, cycles.clone().map(|row| mesh.swaps.cycles.row(row)));
            }
            cycles.rev().for_each(|row| tswap_back(&mut faces, mesh.swaps.cycles.row(row)));
            program.faces.extend(&faces[program.faces.len()..]);
            program.drawn.resize(end as usize, faces.len() as u32);
            start = end;
        }
        program.drawn.push(mesh.faces.len() as u32);
        if last == 0 {
            program.faces.clone_from(&mesh.faces);
        }
        program
    }

    /// Appends the writes of the splits between two levels. `faces` are the faces of the second level on
    /// entry, and the drawn faces of the first level on return.
    fn write_group(
        &mut self,
        mesh: &ProgressiveMesh,
        predecessors: &[u32],
        [start, end]: [u32; 2],
        faces: &mut [[u32; 3]],
    ) {
        let live = mesh.levels[start as usize].vertices;
        let mut writes: Vec<[u32; 3]> = Vec::new();
        for (word, corner) in (0..).zip(faces.as_flattened_mut()) {
            // If level 0 has no vertices, vertex 0 is not live there and is its own predecessor.
            while *corner >= live && predecessors[*corner as usize] != *corner {
                let vertex = std::mem::replace(corner, predecessors[*corner as usize]);
                writes.push([vertex, word, *corner]);
            }
        }
        writes.sort_unstable();
        let before = self.corners.words.len();
        for level in &mesh.levels[start as usize + 1..=end as usize] {
            let written = writes.partition_point(|&[vertex, ..]| vertex < level.vertices);
            self.corner_ends.push((before + written) as u32);
        }
        for [vertex, word, predecessor] in writes {
            self.corners.words.push(word);
            self.corners.up.push(vertex);
            self.corners.down.push(predecessor);
        }
    }
}
