//! One surface with its instances: which level each has, and its part of the index buffer.
//!
//! All instances share the vertex buffer and the program of splits and permutations. Each has a slice of one index
//! buffer on the device that has room for the full mesh: an instance that comes near must not wait for memory. Where
//! the host executes, an instance has its live faces there too, 12 bytes a face, and what was touched is copied; where
//! the device does, the host knows no more of an instance than its level.

use super::place::{Bounds, Place};
use super::vertices::{ALWAYS_LOG2, EXACT_LOG2, VertexBuffer, normals};
use crate::math::camera::Pose;
use crate::paper::progressive_mesh::apply;
use crate::paper::progressive_mesh::check::Flaw;
use crate::paper::progressive_mesh::mesh::ProgressiveMesh;
use crate::paper::progressive_mesh::run::{Instance, Program, Touched, Untold, level_for_error};
use crate::scene::{Apply, ProgressiveSurface, Stand};
use crate::vk::shader::SurfaceView;
use crate::vk::{Buffer, BufferUse, Error, Gpu, Slice};
use thiserror::Error;

/// A progressive mesh that cannot be shown.
#[derive(Debug, Error)]
pub enum SurfaceError {
    #[error("progressive_mesh.{name}: {flaw}")]
    Flaw { name: String, flaw: Flaw },
    #[error(transparent)]
    Vulkan(#[from] Error),
}

/// A surface as it is to be shown.
#[derive(Clone, Debug)]
pub struct Model {
    /// In the scene.
    pub name: String,
    pub surface: ProgressiveSurface,
    pub mesh: ProgressiveMesh,
    /// One for each instance.
    pub stands: Vec<Stand>,
}

/// A surface on the device.
pub struct Surface {
    pub name: String,
    /// As the scene has it; what may be changed between frames are `error_pixels` alone.
    pub settings: ProgressiveSurface,
    pub program: Program,
    pub(super) vertices: VertexBuffer,
    pub(super) indices: Buffer,
    herd: Vec<Member>,
    /// Memory for permutations.
    kept: Vec<[u32; 3]>,
    /// The program on the device, where that executes it.
    pub(super) apply: Option<apply::Apply>,
    /// What the device is to execute next.
    pub(super) changes: Vec<apply::Change>,
}

/// One instance.
struct Member {
    place: Place,
    level: u32,
    /// Where the host executes.
    host: Option<Host>,
    /// It was drawn in the last frame, at this wanted error.
    seen: Option<f64>,
}

struct Host {
    instance: Instance,
    touched: Touched,
}

/// What one frame changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Change {
    pub instances_seen: usize,
    pub faces: u64,
    /// Vertices that the drawn faces can name, summed over the instances: shaded once each, this is the least work.
    pub vertices: u64,
    pub splits: u64,
    pub collapses: u64,
    pub upload_bytes: u64,
}

impl Surface {
    /// # Errors
    /// A mesh that is not one, out of memory.
    pub fn new(gpu: &Gpu, model: &Model) -> Result<Surface, SurfaceError> {
        let Model { name, surface, mesh, stands } = model;
        let program = Program::new(mesh).map_err(|flaw| SurfaceError::Flaw { name: name.clone(), flaw })?;
        let mut full = Instance::new(&program);
        full.go_to(&program, program.last_level(), &mut Vec::new(), &mut Untold);
        let normals = normals(mesh, full.faces());
        let bounds = Bounds::of(&mesh.vertices.positions);
        let member = |stand: &Stand| Member {
            place: Place::new(surface, &bounds, stand),
            level: 0,
            host: (surface.apply == Apply::Cpu).then(|| Host::new(&program)),
            seen: None,
        };
        let (vertices, indices) = (format!("{name}: vertices"), format!("{name}: indices"));
        let all = 3 * program.faces().len() as u64 * stands.len() as u64;
        if u32::try_from(all).is_err() {
            let what =
                format!("{all} indices, a draw reaches 2^32; show fewer instances, or a coarser model");
            return Err(Error::Limit { object: indices, what }.into());
        }
        Ok(Surface {
            name: name.clone(),
            settings: surface.clone(),
            vertices: VertexBuffer::new(gpu, &vertices, mesh, &normals, surface.geomorph)?,
            indices: match surface.apply {
                Apply::Cpu => gpu.buffer(&indices, 4 * all, BufferUse::Indices)?,
                Apply::Gpu => {
                    let all = program.faces().repeat(stands.len());
                    gpu.buffer_with(&indices, &all, BufferUse::WritableIndices)?
                }
            },
            herd: stands.iter().map(member).collect(),
            apply: match surface.apply {
                Apply::Cpu => None,
                Apply::Gpu => Some(apply::Apply::new(gpu, &program)?),
            },
            changes: Vec::new(),
            kept: Vec::new(),
            program,
        })
    }

    /// Words of an instance's slice of the index buffer.
    fn slice_words(&self) -> usize {
        3 * self.program.faces().len()
    }

    /// Brings every instance that the eye sees to its level: the coarsest whose error is at most `pixels` in the
    /// picture. `upload` is given words and where they belong in [`Surface::indices`], in words.
    pub(super) fn go(
        &mut self,
        pose: &Pose,
        size: [u32; 2],
        pixels: f64,
        upload: &mut impl FnMut(&[u32], usize),
    ) -> Change {
        let mut change = Change::default();
        let slice_words = self.slice_words();
        let Surface { program, herd, kept, changes, .. } = self;
        changes.clear();
        for (n, member) in herd.iter_mut().enumerate() {
            member.seen = None;
            if !member.place.is_seen(pose, size) {
                continue;
            }
            let wanted = member.place.wanted_error(pose, size[1], pixels);
            member.seen = Some(wanted);
            let (from, to) = (member.level, level_for_error(program.levels(), wanted as f32));
            member.level = to;
            change.splits += u64::from(to.saturating_sub(from));
            change.collapses += u64::from(from.saturating_sub(to));
            match &mut member.host {
                Some(host) => {
                    host.go_to(program, to, kept);
                    change.upload_bytes += host.take(&mut |words, at| upload(words, n * slice_words + at));
                }
                None if from != to => {
                    let first_slot = (n * slice_words / 3) as u32;
                    changes.push(apply::Change { first_slot, from, to });
                }
                None => (),
            }
            change.instances_seen += 1;
            let live = &program.levels()[to as usize];
            change.faces += u64::from(live.faces);
            change.vertices += u64::from(live.vertices);
        }
        change
    }

    /// A draw for each instance that [`Surface::go`] found seen.
    pub(super) fn slices(&self, pose: &Pose, size: [u32; 2], sun: glam::DVec3) -> Vec<Slice<SurfaceView>> {
        let slice_words = self.slice_words();
        let slice = |(n, member): (usize, &Member)| {
            let wanted = member.seen?;
            let wanted_log2 = if wanted > 0.0 { wanted.log2() as f32 } else { EXACT_LOG2 };
            let push = SurfaceView {
                object_to_clip: member.place.object_to_clip(pose, size).as_mat4().to_cols_array_2d(),
                sun: (member.place.rotation.transpose() * sun).as_vec3().to_array(),
                wanted_log2: wanted_log2.clamp(EXACT_LOG2, ALWAYS_LOG2),
                band_log2: super::MORPH_BAND_LOG2,
            };
            Some(Slice {
                push,
                first_index: (n * slice_words) as u32,
                count: 3 * self.program.levels()[member.level as usize].faces,
            })
        };
        self.herd.iter().enumerate().filter_map(slice).collect()
    }

    /// Where the instances stand, and their levels.
    pub fn instances(&self) -> impl Iterator<Item = (&Place, u32)> {
        self.herd.iter().map(|member| (&member.place, member.level))
    }

    /// The live faces of one instance, in the order in which they are drawn; `None` where the device executes.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn faces(&self, instance: usize) -> Option<&[[u32; 3]]> {
        self.herd[instance].host.as_ref().map(|host| host.instance.faces())
    }

    /// Bytes of main memory: what the instances share, and what they have of their own.
    pub fn host_bytes(&self) -> [usize; 2] {
        let faces = |host: &Host| size_of_val(host.instance.faces());
        let own = |member: &Member| size_of::<Member>() + member.host.as_ref().map_or(0, faces);
        [self.program.bytes(), self.herd.iter().map(own).sum()]
    }
}

impl Host {
    /// Of an instance of which the device has nothing.
    fn new(program: &Program) -> Host {
        let mut touched = Touched::new(program.faces().len());
        touched.faces(0..program.levels()[0].faces as usize);
        Host { instance: Instance::new(program), touched }
    }

    fn go_to(&mut self, program: &Program, level: u32, kept: &mut Vec<[u32; 3]>) {
        let before = self.instance.faces().len();
        self.instance.go_to(program, level, kept, &mut self.touched);
        let now = self.instance.faces().len();
        self.touched.faces(before.min(now)..now);
    }

    /// Gives away what was touched and is live, with its first word's place in the slice. Returns its bytes.
    fn take(&mut self, upload: &mut impl FnMut(&[u32], usize)) -> u64 {
        let words: &[u32] = bytemuck::cast_slice(self.instance.faces());
        let mut bytes = 0;
        for range in self.touched.take() {
            // What lies behind the live faces is written when it comes to life.
            let range = range.start..range.end.min(words.len());
            if !range.is_empty() {
                bytes += 4 * range.len() as u64;
                upload(&words[range.clone()], range.start);
            }
        }
        bytes
    }
}
