//! One instance of a mesh: its level, and its live faces.

use super::program::Program;
use super::touched::Touch;

/// The live prefix of F at one level: 12 bytes a live face, and 32 for the rest; all else is the [`Program`]'s.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Instance {
    level: u32,
    faces: Vec<[u32; 3]>,
}

impl Instance {
    /// At level 0.
    pub fn new(program: &Program) -> Instance {
        Instance { level: 0, faces: program.faces()[..program.levels()[0].faces as usize].to_vec() }
    }

    pub fn level(&self) -> u32 {
        self.level
    }

    /// The index buffer: live faces only.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Executes what lies between this level and `level`. `kept` is memory for permutations, `touch` hears what was
    /// written; faces that come to life are not told to it.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn go_to(&mut self, program: &Program, level: u32, kept: &mut Vec<[u32; 3]>, touch: &mut impl Touch) {
        let live = program.levels()[level as usize].faces as usize;
        if live > self.faces.len() {
            self.faces.extend_from_slice(&program.faces()[self.faces.len()..live]);
        }
        program.run(&mut self.faces, self.level, level, kept, touch);
        self.faces.truncate(live);
        self.level = level;
    }
}
