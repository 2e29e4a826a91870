//! Instances that a rival draws: which faces each shows, and how they come to the device.
//!
//! - An order made anew for each level: the host makes the faces of a level once for all instances that show it, and
//!   copies them to the instance's slice whenever its level changes, all of them.
//! - Skip lists: each instance has a copy of its list. Where the level goes to another list all of that is copied; else
//!   the blocks that the change has written.
//! - Compacted: the device fills the slices, in a pass of its own.
//! - A discrete chain: its meshes stand in the index buffer once, and an instance shows one of them. Wanted is a level
//!   of the progressive mesh, as ever; shown is the coarsest mesh that has at least as many faces: a level of the
//!   chain's own.

use crate::paper::progressive_mesh::mesh::ProgressiveMesh;
use crate::paper::progressive_mesh::rivals::compaction::{Compact, Compaction};
use crate::paper::progressive_mesh::rivals::{Prepared, Rival};
use crate::paper::progressive_mesh::run::{Program, Slices, TooMany, Touched, Untold};
use crate::vk::{Buffer, BufferUse, Cmd, Gpu, Result};
use std::collections::HashMap;
use std::sync::{Arc, Weak};

type Faces = Arc<[[u32; 3]]>;

/// Instances of one mesh.
pub struct Rivals {
    program: Arc<Program>,
    prepared: Prepared,
    compaction: Option<Box<Compaction>>,
    /// Where each mesh of a discrete chain begins in the index buffer, in faces.
    meshes: Vec<u32>,
    members: Vec<Member>,
    slices: Slices,
    /// What levels draw that some instance shows.
    made: HashMap<u32, Weak<[[u32; 3]]>>,
    walker: Walker,
}

struct Member {
    level: u32,
    /// In the index buffer, in faces.
    first: u32,
    drawn: u32,
    shown: Shown,
    /// The slice is to be filled.
    stale: bool,
}

/// Who knows the faces of an instance.
enum Shown {
    /// The device alone, or the chain.
    Elsewhere,
    /// Instances at the same level.
    Level(Faces),
    /// It itself.
    Skip(Box<Skip>),
}

/// An instance's copy of a skip list.
struct Skip {
    /// Its place among the lists.
    list: usize,
    faces: Vec<[u32; 3]>,
    touched: Touched,
}

impl Skip {
    /// Of a list as it is at a level: all of it is new.
    fn new(list: usize, faces: Vec<[u32; 3]>) -> Skip {
        let mut touched = Touched::new(faces.len());
        touched.faces(0..faces.len());
        Skip { list, faces, touched }
    }
}

/// The mesh's faces in classical order at the level asked for last.
struct Walker {
    faces: Vec<[u32; 3]>,
    level: u32,
}

impl Walker {
    fn live(&mut self, program: &Program, level: u32) -> &[[u32; 3]] {
        program.run(&mut self.faces, self.level, level, &mut Vec::new(), &mut Untold);
        self.level = level;
        &self.faces[..program.levels()[level as usize].faces as usize]
    }
}

impl Rivals {
    /// So many instances of a mesh in classical order, all at level 0.
    ///
    /// # Errors
    /// Out of memory; [`TooMany`] as what the device lacks.
    pub fn new(gpu: &Gpu, mesh: &ProgressiveMesh, program: Arc<Program>, rival: Rival) -> Result<Rivals> {
        let every_vertex = (0..mesh.vertices.positions.len() as u32).collect();
        let prepared = Prepared::new(mesh, rival, every_vertex);
        let compaction = match rival {
            Rival::Compacted => Some(Box::new(Compaction::new(gpu, mesh, &prepared)?)),
            _ => None,
        };
        let (mut end, mut meshes) = (0, Vec::new());
        if matches!(rival, Rival::Discrete { .. }) {
            for faces in prepared.lists() {
                meshes.push(end);
                end += faces.len() as u32;
            }
        }
        let slices = Slices::new(program.faces().len() as u32);
        let walker = Walker { faces: program.faces().to_vec(), level: 0 };
        let (members, made) = (Vec::new(), HashMap::new());
        Ok(Rivals { program, prepared, compaction, meshes, members, slices, made, walker })
    }

    /// One more instance, at level 0.
    ///
    /// # Errors
    /// [`TooMany`].
    pub fn push(&mut self) -> std::result::Result<(), TooMany> {
        let mut member = self.member(0);
        if member.stale {
            self.slices.push(member.drawn)?;
            member.first = self.slices.first(self.members.len());
        }
        self.members.push(member);
        Ok(())
    }

    /// An instance at a level; of a slice of its own it has no place yet.
    fn member(&mut self, level: u32) -> Member {
        let live = self.program.levels()[level as usize].faces;
        if !self.meshes.is_empty() {
            let mesh = self.prepared.simplified(live as usize);
            let faces = self.prepared.lists().nth(mesh).map_or(0, <[_]>::len);
            return Member {
                level,
                first: self.meshes[mesh],
                drawn: faces as u32,
                shown: Shown::Elsewhere,
                stale: false,
            };
        }
        if self.compaction.is_some() {
            return Member { level, first: 0, drawn: live, shown: Shown::Elsewhere, stale: true };
        }
        if let Rival::SkipLists { .. } = self.prepared.rival() {
            let (list, _) = self.prepared.skip_list(level);
            let faces = self.prepared.drawn(level, &[]);
            let drawn = faces.len() as u32;
            return Member {
                level,
                first: 0,
                drawn,
                shown: Shown::Skip(Skip::new(list, faces).into()),
                stale: true,
            };
        }
        let made = self.made.get(&level).and_then(Weak::upgrade);
        let made: Faces =
            made.unwrap_or_else(|| self.prepared.drawn(level, self.walker.live(&self.program, level)).into());
        self.made.insert(level, Arc::downgrade(&made));
        Member { level, first: 0, drawn: made.len() as u32, shown: Shown::Level(made), stale: true }
    }

    /// Brings an instance to a level in the next frame, at most once in it.
    ///
    /// # Errors
    /// [`TooMany`]; the instance stays at its level.
    pub fn go_to(&mut self, instance: usize, level: u32) -> std::result::Result<(), TooMany> {
        let Member { level: before, shown, stale, .. } = &mut self.members[instance];
        if *before == level {
            return Ok(());
        }
        if let Shown::Skip(skip) = shown {
            let (at, list) = self.prepared.skip_list(level);
            if at == skip.list {
                list.run(self.program.levels(), &mut skip.faces, [*before, level], &mut skip.touched);
                (*before, *stale) = (level, true);
                return Ok(());
            }
        }
        let mut member = self.member(level);
        if member.stale {
            self.slices.fit(instance, member.drawn)?;
            member.first = self.slices.first(instance);
        }
        self.members[instance] = member;
        Ok(())
    }

    pub fn level(&self, instance: usize) -> u32 {
        self.members[instance].level
    }

    /// Where an instance's faces begin in the index buffer, in faces.
    pub fn first(&self, instance: usize) -> u32 {
        self.members[instance].first
    }

    /// Faces that an instance draws, those without area too.
    pub fn drawn(&self, instance: usize) -> u32 {
        self.members[instance].drawn
    }

    /// What they are, as far as the host knows.
    pub fn faces(&self, instance: usize) -> Option<&[[u32; 3]]> {
        let member = &self.members[instance];
        match self.meshes.iter().position(|&first| first == member.first) {
            Some(mesh) => self.prepared.lists().nth(mesh),
            None => match &member.shown {
                Shown::Elsewhere => None,
                Shown::Level(faces) => Some(faces),
                Shown::Skip(skip) => Some(&skip.faces),
            },
        }
    }

    /// Faces of the index buffer.
    pub fn end(&self) -> u32 {
        match self.meshes.is_empty() {
            true => self.slices.end(),
            false => self.prepared.listed_faces() as u32,
        }
    }

    /// The first index buffer: a discrete chain's is whole; the others are filled by the first frame.
    pub fn buffer(&self, gpu: &Gpu, name: &str) -> Result<Buffer> {
        match self.meshes.is_empty() {
            true => gpu.buffer(name, 12 * u64::from(self.end()), self.buffer_use()),
            false => {
                let chain: Vec<[u32; 3]> = self.prepared.lists().flatten().copied().collect();
                gpu.buffer_with(name, &chain, self.buffer_use())
            }
        }
    }

    pub fn buffer_use(&self) -> BufferUse {
        match self.compaction {
            Some(_) => BufferUse::WritableIndices,
            None => BufferUse::Indices,
        }
    }

    /// Gives `upload` the words that the host has for slices, and where they go, in words; returns their bytes.
    pub fn upload(&mut self, upload: &mut impl FnMut(&[u32], usize)) -> u64 {
        let mut bytes = 0;
        for member in self.members.iter_mut().filter(|member| member.stale) {
            let first = 3 * member.first as usize;
            let mut send = |words: &[u32], at: usize| {
                upload(words, first + at);
                bytes += size_of_val(words) as u64;
            };
            match &mut member.shown {
                Shown::Elsewhere => {}
                Shown::Level(faces) => send(faces.as_flattened(), 0),
                Shown::Skip(skip) => {
                    let words = skip.faces.as_flattened();
                    skip.touched
                        .take()
                        .into_iter()
                        .for_each(|range| send(&words[range.clone()], range.start));
                }
            }
        }
        bytes
    }

    /// Whether a frame has a pass in which the device fills slices.
    pub fn compacts(&self) -> bool {
        self.compaction.is_some()
    }

    /// That pass.
    ///
    /// # Errors
    /// Out of memory.
    pub fn compact(&self, cmd: &mut Cmd<'_>, indices: &Buffer) -> Result<()> {
        let Some(compaction) = &self.compaction else { return Ok(()) };
        let compact = |member: &Member| Compact {
            first_slot: member.first,
            level: self.program.levels()[member.level as usize],
        };
        let slices: Vec<Compact> = self.members.iter().filter(|member| member.stale).map(compact).collect();
        compaction.run(cmd, indices, &slices)
    }

    /// Forgets what the last frame has done.
    pub fn done(&mut self) {
        self.members.iter_mut().for_each(|member| member.stale = false);
        self.slices.release();
        self.made.retain(|_, faces| faces.strong_count() > 0);
    }

    /// Bytes of main memory of the instances' own, but for faces.
    pub fn state_bytes(&self) -> usize {
        let touched = self.skips().map(|skip| size_of_val(skip) + skip.touched.bytes());
        size_of_val(&*self.members) + self.slices.bytes() + touched.sum::<usize>()
    }

    fn skips(&self) -> impl Iterator<Item = &Skip> {
        self.members.iter().filter_map(|member| match &member.shown {
            Shown::Skip(skip) => Some(&**skip),
            _ => None,
        })
    }

    /// Bytes of main memory of faces: lists and ranks, which they share, what the levels draw that are shown, and the
    /// instances' own copies of lists.
    pub fn host_bytes(&self) -> usize {
        let shown = self.made.values().filter_map(Weak::upgrade).map(|faces| size_of_val(&*faces));
        let copies = self.skips().map(|skip| size_of_val(&*skip.faces));
        self.prepared.list_bytes() as usize
            + size_of_val(self.prepared.ranks())
            + size_of_val(&*self.walker.faces)
            + shown.sum::<usize>()
            + copies.sum::<usize>()
    }

    /// Bytes of video memory that they share beside vertices.
    pub fn shared_bytes(&self) -> Option<u64> {
        self.compaction.as_ref().map(|compaction| compaction.bytes())
    }

    /// What the rival adds, in words.
    pub fn adds(&self) -> String {
        let name = self.prepared.rival().name();
        let (lists, bytes) = (self.prepared.lists().len(), self.prepared.list_bytes());
        match self.prepared.rival() {
            Rival::Compacted => {
                format!("{name}: a pass, and a slot and three corners of each face on the device")
            }
            Rival::Discrete { .. } => {
                format!(
                    "{name}: {lists} meshes of {bytes} bytes in the index buffer, shared; levels are theirs"
                )
            }
            Rival::SkipLists { .. } => {
                format!(
                    "{name}: {lists} lists of {bytes} bytes on the host, and each instance's copy of one; levels of another \
                     list copy it"
                )
            }
            _ => format!("{name}: a level change orders and copies all faces"),
        }
    }
}
