//! Instances whose levels the device executes: the host knows their levels and slices, but not their faces.

use crate::paper::progressive_mesh::apply::{DeviceProgram, LevelChange};
use crate::paper::progressive_mesh::run::{Program, Slices, TooMany};
use crate::vk::{Buffer, BufferUse, Cmd, Gpu, Result};
use std::sync::Arc;

/// Instances of one mesh in an index buffer that only the device writes.
pub struct Resident {
    program: Arc<Program>,
    apply: DeviceProgram,
    /// The index buffer of level 0, with the slots of all levels: the source of faces that become live.
    faces: Buffer,
    levels: Vec<u32>,
    slices: Slices,
    /// Work of the next frame, in this order: copies to another slice (bytes), copies of new faces (bytes),
    /// changes of level.
    moved: Vec<[u64; 3]>,
    born: Vec<[u64; 3]>,
    changes: Vec<LevelChange>,
}

impl Resident {
    /// A mesh without instances.
    ///
    /// # Errors
    /// Out of memory, or a program larger than shaders can address.
    pub fn new(gpu: &Gpu, program: Arc<Program>) -> Result<Resident> {
        Ok(Resident {
            apply: DeviceProgram::new(gpu, &program, program.index_type())?,
            faces: gpu.buffer_with(
                "faces of level 0",
                &program.index_type().packed(program.faces().as_flattened()),
                BufferUse::Storage,
            )?,
            levels: Vec::new(),
            slices: Slices::new(program.faces().len() as u32),
            moved: Vec::new(),
            born: Vec::new(),
            changes: Vec::new(),
            program,
        })
    }

    /// Adds an instance at level 0.
    ///
    /// # Errors
    /// [`TooMany`].
    pub fn push(&mut self) -> std::result::Result<(), TooMany> {
        self.slices.push(self.live(0))?;
        self.levels.push(0);
        Ok(())
    }

    /// The index buffer while all instances are at level 0.
    pub fn content(&self) -> Vec<[u32; 3]> {
        let live = self.live(0) as usize;
        let mut content = vec![[0; 3]; self.slices.end() as usize];
        for instance in 0..self.levels.len() {
            let first = self.slices.first(instance) as usize;
            content[first..first + live].copy_from_slice(&self.program.faces()[..live]);
        }
        content
    }

    /// Clears the work of the last frame.
    pub fn done(&mut self) {
        self.moved.clear();
        self.born.clear();
        self.changes.clear();
        self.slices.release();
    }

    /// Brings an instance to a level in the next frame; at most once per frame.
    ///
    /// # Errors
    /// [`TooMany`]; the instance keeps its level.
    pub fn go_to(&mut self, instance: usize, to: u32) -> std::result::Result<(), TooMany> {
        let from = self.levels[instance];
        if from == to {
            return Ok(());
        }
        let (old, new) = (self.live(from), self.live(to));
        // A construction needs no faces. Otherwise the slice must hold the faces of both levels during the change. If
        // the slice is too large after the change, it shrinks at the next change.
        let constructs = self.program.constructs(from, to);
        let places = self.slices.fit(instance, if constructs { new } else { old.max(new) })?;
        self.moved.extend(places.filter(|_| !constructs).map(|places| self.bytes(places, old)));
        let first_slot = self.slices.first(instance);
        if new > old && !constructs {
            self.born.push(self.bytes([old, first_slot + old], new - old));
        }
        self.levels[instance] = to;
        self.changes.push(LevelChange { first_slot, from, to });
        Ok(())
    }

    pub fn level(&self, instance: usize) -> u32 {
        self.levels[instance]
    }

    /// First face of an instance in the index buffer.
    pub fn first(&self, instance: usize) -> u32 {
        self.slices.first(instance)
    }

    /// Faces of the index buffer.
    pub fn end(&self) -> u32 {
        self.slices.end()
    }

    /// Executes the pending work.
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

    /// Bytes of main memory of the instances' own state.
    pub fn state_bytes(&self) -> usize {
        size_of_val(&*self.levels) + self.slices.bytes()
    }

    /// Bytes of video memory that all instances share: the program and level 0.
    pub fn shared_bytes(&self) -> u64 {
        self.apply.bytes() + self.faces.bytes()
    }

    fn live(&self, level: u32) -> u32 {
        self.program.drawn(level)
    }

    /// A copy of faces: source, destination and length in bytes.
    fn bytes(&self, [from, to]: [u32; 2], faces: u32) -> [u64; 3] {
        [from, to, faces].map(|faces| self.program.index_type().triangle_bytes() * u64::from(faces))
    }
}
