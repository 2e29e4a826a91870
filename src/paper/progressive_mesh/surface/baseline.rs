//! Instances drawn by a baseline: their faces and the upload.
//!
//! - An order made for each level: the host builds the faces of a level once for all instances at that level.
//!   When an instance's level changes, all its faces are copied to its slice.
//! - Skip lists: each instance has a copy of its list. If the level needs another list, the whole new list is copied.
//!   Otherwise only the blocks that were written are copied.
//! - Compacted: the device fills the slices in a separate pass.
//! - A discrete chain: its meshes are stored once in the index buffer, and an instance draws one of them. The request
//!   is a level of the progressive mesh, as for other orders. The coarsest mesh with at least as many faces is drawn.

use crate::paper::progressive_mesh::baselines::compaction::{Compact, FaceCompaction};
use crate::paper::progressive_mesh::baselines::{OrderBaseline, PreparedBaseline};
use crate::paper::progressive_mesh::mesh::ProgressiveMesh;
use crate::paper::progressive_mesh::run::{DirtyBlocks, IgnoreWrites, Program, Slices, TooMany};
use crate::vk::{Buffer, BufferUse, Cmd, Gpu, IndexType, Result};
use std::collections::HashMap;
use std::sync::{Arc, Weak};

type Faces = Arc<[[u32; 3]]>;

/// Instances of one mesh that a baseline draws.
pub struct Baselines {
    program: Arc<Program>,
    prepared: PreparedBaseline,
    compaction: Option<Box<FaceCompaction>>,
    /// The first face of each mesh of a discrete chain in the index buffer.
    meshes: Vec<u32>,
    members: Vec<BaselineInstance>,
    slices: Slices,
    /// The faces of the levels that instances show.
    made: HashMap<u32, Weak<[[u32; 3]]>>,
    walker: Walker,
}

struct BaselineInstance {
    level: u32,
    /// First face in the index buffer.
    first: u32,
    drawn: u32,
    shown: Shown,
    /// True if the slice must be filled.
    stale: bool,
}

/// Where an instance's faces are kept.
enum Shown {
    /// The faces are on the device only, or in the discrete chain.
    Elsewhere,
    /// The faces are shared by the instances at the same level.
    Level(Faces),
    /// The faces are in the instance's own list.
    Skip(Box<Skip>),
}

/// An instance's copy of a skip list.
struct Skip {
    /// The index of the list among the skip lists.
    list: usize,
    faces: Vec<[u32; 3]>,
    touched: DirtyBlocks,
}

impl Skip {
    /// A list at a level, all of it dirty.
    fn new(list: usize, faces: Vec<[u32; 3]>) -> Skip {
        let mut touched = DirtyBlocks::new(faces.len());
        touched.faces(0..faces.len());
        Skip { list, faces, touched }
    }
}

/// The mesh's faces in classical order at the last requested level.
struct Walker {
    faces: Vec<[u32; 3]>,
    level: u32,
}

impl Walker {
    fn live(&mut self, program: &Program, level: u32) -> &[[u32; 3]] {
        program.run(&mut self.faces, self.level, level, &mut Vec::new(), &mut IgnoreWrites);
        self.level = level;
        &self.faces[..program.drawn(level) as usize]
    }
}

impl Baselines {
    /// No instances yet, for a mesh in classical order.
    ///
    /// # Errors
    /// Out of memory, or a mesh larger than shaders can address.
    pub fn new(
        gpu: &Gpu,
        mesh: &ProgressiveMesh,
        program: Arc<Program>,
        baseline: OrderBaseline,
    ) -> Result<Baselines> {
        let every_vertex = (0..mesh.vertices.positions.len() as u32).collect();
        let prepared = PreparedBaseline::new(mesh, baseline, every_vertex);
        let compaction = match baseline {
            OrderBaseline::Compacted => {
                Some(Box::new(FaceCompaction::new(gpu, mesh, &prepared, program.index_type())?))
            }
            _ => None,
        };
        let (mut end, mut meshes) = (0, Vec::new());
        if matches!(baseline, OrderBaseline::Discrete { .. }) {
            for faces in prepared.lists() {
                meshes.push(end);
                end += faces.len() as u32;
            }
        }
        let slices = Slices::new(program.faces().len() as u32);
        let walker = Walker { faces: program.faces().to_vec(), level: 0 };
        let (members, made) = (Vec::new(), HashMap::new());
        Ok(Baselines { program, prepared, compaction, meshes, members, slices, made, walker })
    }

    /// Adds an instance at level 0.
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

    /// An instance at a level, without a slice yet.
    fn member(&mut self, level: u32) -> BaselineInstance {
        let live = self.program.drawn(level);
        if !self.meshes.is_empty() {
            let mesh = self.prepared.simplified(live as usize);
            let faces = self.prepared.lists().nth(mesh).map_or(0, <[_]>::len);
            return BaselineInstance {
                level,
                first: self.meshes[mesh],
                drawn: faces as u32,
                shown: Shown::Elsewhere,
                stale: false,
            };
        }
        if self.compaction.is_some() {
            return BaselineInstance { level, first: 0, drawn: live, shown: Shown::Elsewhere, stale: true };
        }
        if let OrderBaseline::SkipLists { .. } = self.prepared.baseline() {
            let (list, _) = self.prepared.skip_list(level);
            let faces = self.prepared.drawn(level, &[]);
            let drawn = faces.len() as u32;
            return BaselineInstance {
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
        BaselineInstance { level, first: 0, drawn: made.len() as u32, shown: Shown::Level(made), stale: true }
    }

    /// Brings an instance to a level in the next frame; at most once per frame.
    ///
    /// # Errors
    /// [`TooMany`]; the instance keeps its level.
    pub fn go_to(&mut self, instance: usize, level: u32) -> std::result::Result<(), TooMany> {
        let BaselineInstance { level: before, shown, stale, .. } = &mut self.members[instance];
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

    /// First face of an instance in the index buffer.
    pub fn first(&self, instance: usize) -> u32 {
        self.members[instance].first
    }

    /// Faces that an instance draws, including degenerate faces.
    pub fn drawn(&self, instance: usize) -> u32 {
        self.members[instance].drawn
    }

    /// An instance's faces; `None` if only the device has them.
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

    /// The initial index buffer: complete for a discrete chain, otherwise filled by the first frame.
    pub fn buffer(&self, gpu: &Gpu, name: &str, index: IndexType) -> Result<Buffer> {
        match self.meshes.is_empty() {
            true => gpu.buffer(name, index.bytes_of_faces(self.end().into()), self.buffer_use(index)),
            false => {
                let chain: Vec<[u32; 3]> = self.prepared.lists().flatten().copied().collect();
                gpu.buffer_with(name, &index.packed(chain.as_flattened()), self.buffer_use(index))
            }
        }
    }

    pub fn buffer_use(&self, index: IndexType) -> BufferUse {
        match self.compaction {
            Some(_) => BufferUse::WritableIndices(index),
            None => BufferUse::Indices(index),
        }
    }

    /// Passes the bytes of changed slices and their offsets in the index buffer to `upload`.
    pub fn upload(&mut self, index: IndexType, upload: &mut impl FnMut(&[u8], u64)) {
        for member in self.members.iter_mut().filter(|member| member.stale) {
            let first = 3 * member.first as usize;
            let mut send = |corners: &[u32], at: usize| {
                upload(&index.packed(corners), index.bytes() * (first + at) as u64)
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
    }

    /// True if a frame has a pass in which the device fills slices.
    pub fn compacts(&self) -> bool {
        self.compaction.is_some()
    }

    /// Records the pass in which the device fills slices.
    ///
    /// # Errors
    /// Out of memory.
    pub fn compact(&self, cmd: &mut Cmd<'_>, indices: &Buffer) -> Result<()> {
        let Some(compaction) = &self.compaction else { return Ok(()) };
        let compact = |member: &BaselineInstance| Compact {
            first_slot: member.first,
            level: self.program.levels()[member.level as usize],
        };
        let slices: Vec<Compact> = self.members.iter().filter(|member| member.stale).map(compact).collect();
        compaction.run(cmd, indices, &slices)
    }

    /// Clears the changes of the last frame.
    pub fn done(&mut self) {
        self.members.iter_mut().for_each(|member| member.stale = false);
        self.slices.release();
        self.made.retain(|_, faces| faces.strong_count() > 0);
    }

    /// Bytes of main memory of the instances' own state, without faces.
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

    /// Bytes of main memory for faces: the shared lists and ranks, the walker's faces, the faces of the levels shown,
    /// and the instances' copies of lists.
    pub fn host_bytes(&self) -> usize {
        let shown = self.made.values().filter_map(Weak::upgrade).map(|faces| size_of_val(&*faces));
        let copies = self.skips().map(|skip| size_of_val(&*skip.faces));
        self.prepared.list_bytes(IndexType::U32) as usize
            + size_of_val(self.prepared.ranks())
            + size_of_val(&*self.walker.faces)
            + shown.sum::<usize>()
            + copies.sum::<usize>()
    }

    /// Bytes of shared video memory beyond the vertices.
    pub fn shared_bytes(&self) -> Option<u64> {
        self.compaction.as_ref().map(|compaction| compaction.bytes())
    }

    /// Describes the memory and work that the baseline adds.
    pub fn adds(&self) -> String {
        let name = self.prepared.baseline().name();
        let index = match self.prepared.baseline() {
            OrderBaseline::Discrete { .. } => self.program.index_type(),
            // The host keeps its lists with 32 bits per index.
            _ => IndexType::U32,
        };
        let (lists, bytes) = (self.prepared.lists().len(), self.prepared.list_bytes(index));
        match self.prepared.baseline() {
            OrderBaseline::Compacted => {
                format!("{name}: a pass; the device stores a slot and three corners for each face")
            }
            OrderBaseline::Discrete { .. } => {
                format!(
                    "{name}: {lists} meshes of {bytes} bytes in total in the index buffer, shared by all instances"
                )
            }
            OrderBaseline::SkipLists { .. } => {
                format!(
                    "{name}: {lists} lists of {bytes} bytes in total on the host, and a copy of one list for each \
                     instance; a change to another list copies all of it"
                )
            }
            _ => format!("{name}: a level change reorders and copies all faces"),
        }
    }
}
