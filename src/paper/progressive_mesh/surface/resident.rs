//! Instances whose levels the device applies: the host knows their levels and their slices, and no face.

use crate::paper::progressive_mesh::apply::{Apply, Change};
use crate::paper::progressive_mesh::run::{Program, Slices, TooMany};
use crate::vk::{Buffer, BufferUse, Cmd, Gpu, Result};
use std::sync::Arc;

/// Instances of one mesh in an index buffer that only the device writes.
pub struct Resident {
    program: Arc<Program>,
    apply: Apply,
    /// F at level 0, all slots: where faces that come to life are copied from.
    faces: Buffer,
    levels: Vec<u32>,
    slices: Slices,
    /// What the next frame does, in this order: bytes that go to another slice, bytes that come to life, levels.
    moved: Vec<[u64; 3]>,
    born: Vec<[u64; 3]>,
    changes: Vec<Change>,
}

impl Resident {
    /// None yet.
    ///
    /// # Errors
    /// Out of memory, a program beyond what shaders reach.
    pub fn new(gpu: &Gpu, program: Arc<Program>) -> Result<Resident> {
        Ok(Resident {
            apply: Apply::new(gpu, &program)?,
            faces: gpu.buffer_with("faces of level 0", program.faces(), BufferUse::Storage)?,
            levels: Vec::new(),
            slices: Slices::new(program.faces().len() as u32),
            moved: Vec::new(),
            born: Vec::new(),
            changes: Vec::new(),
            program,
        })
    }

    /// One more instance, at level 0.
    ///
    /// # Errors
    /// [`TooMany`].
    pub fn push(&mut self) -> std::result::Result<(), TooMany> {
        self.slices.push(self.live(0))?;
        self.levels.push(0);
        Ok(())
    }

    /// The index buffer of instances of which none has left level 0.
    pub fn content(&self) -> Vec<[u32; 3]> {
        let live = self.live(0) as usize;
        let mut content = vec![[0; 3]; self.slices.end() as usize];
        for instance in 0..self.levels.len() {
            let first = self.slices.first(instance) as usize;
            content[first..first + live].copy_from_slice(&self.program.faces()[..live]);
        }
        content
    }

    /// Forgets what the last frame has done.
    pub fn done(&mut self) {
        self.moved.clear();
        self.born.clear();
        self.changes.clear();
        self.slices.release();
    }

    /// Brings an instance to a level in the next frame, at most once in it.
    ///
    /// # Errors
    /// [`TooMany`]; the instance stays at its level.
    pub fn go_to(&mut self, instance: usize, to: u32) -> std::result::Result<(), TooMany> {
        let from = self.levels[instance];
        if from == to {
            return Ok(());
        }
        let (old, new) = (self.live(from), self.live(to));
        // Faces of both levels are there while levels are applied; a slice that is then too large goes next time.
        if let Some(places) = self.slices.fit(instance, old.max(new))? {
            self.moved.push(bytes(places, old));
        }
        let first_slot = self.slices.first(instance);
        if new > old {
            self.born.push(bytes([old, first_slot + old], new - old));
        }
        self.levels[instance] = to;
        self.changes.push(Change { first_slot, from, to });
        Ok(())
    }

    pub fn level(&self, instance: usize) -> u32 {
        self.levels[instance]
    }

    /// Where an instance's faces begin in the index buffer, in faces.
    pub fn first(&self, instance: usize) -> u32 {
        self.slices.first(instance)
    }

    /// Faces of the index buffer.
    pub fn end(&self) -> u32 {
        self.slices.end()
    }

    /// Executes what is to be done.
    ///
    /// # Errors
    /// Out of memory.
    pub fn run(&self, cmd: &mut Cmd<'_>, indices: &Buffer) -> Result<()> {
        cmd.copy_ranges(indices, indices, &self.moved);
        cmd.copy_ranges(&self.faces, indices, &self.born);
        if !self.moved.is_empty() || !self.born.is_empty() {
            cmd.sync();
        }
        self.apply.run(cmd, &self.program, indices, &self.changes)
    }

    /// Bytes of main memory of the instances' own.
    pub fn state_bytes(&self) -> usize {
        size_of_val(&*self.levels) + self.slices.bytes()
    }

    /// Bytes of video memory that all instances share: program and level 0.
    pub fn shared_bytes(&self) -> u64 {
        self.apply.bytes() + self.faces.bytes()
    }

    fn live(&self, level: u32) -> u32 {
        self.program.levels()[level as usize].faces
    }
}

/// Faces that are copied, as places and length in bytes.
fn bytes([from, to]: [u32; 2], faces: u32) -> [u64; 3] {
    [from, to, faces].map(|faces| 12 * u64::from(faces))
}
