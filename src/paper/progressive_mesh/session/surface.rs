//! One surface with its instances: which level each has, and its part of the index buffer.
//!
//! All instances share the vertex buffer and the program of splits and permutations. Each has its own live faces
//! on the host, 12 bytes a face, and a slice of one index buffer on the device that has room for the full mesh: an
//! instance that comes near must not wait for memory.

use super::place::{Bounds, Place};
use super::vertices::{ALWAYS_LOG2, EXACT_LOG2, VertexBuffer, normals};
use crate::math::camera::Pose;
use crate::paper::progressive_mesh::check::Flaw;
use crate::paper::progressive_mesh::mesh::ProgressiveMesh;
use crate::paper::progressive_mesh::run::{Instance, Program, Touched, level_for_error};
use crate::scene::{ProgressiveSurface, Stand};
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
}

/// One instance.
struct Member {
    place: Place,
    instance: Instance,
    touched: Touched,
    /// It was drawn in the last frame, at this wanted error.
    seen: Option<f64>,
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
        let (mut instance, mut kept) = (Instance::new(&program), Vec::new());
        instance.go_to(
            &program,
            program.last_level(),
            &mut kept,
            &mut crate::paper::progressive_mesh::run::Untold,
        );
        let normals = normals(mesh, instance.faces());
        let slot_bytes = 12 * program.faces().len() as u64;
        let bounds = Bounds::of(&mesh.vertices.positions);
        let member = |stand: &Stand| Member {
            place: Place::new(surface, &bounds, stand),
            instance: Instance::new(&program),
            touched: fresh(&program),
            seen: None,
        };
        Ok(Surface {
            name: name.clone(),
            settings: surface.clone(),
            vertices: VertexBuffer::new(gpu, &format!("{name}: vertices"), mesh, &normals, surface.geomorph)?,
            indices: gpu.buffer(
                &format!("{name}: indices"),
                slot_bytes * stands.len() as u64,
                BufferUse::Indices,
            )?,
            herd: stands.iter().map(member).collect(),
            program,
            kept,
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
        let Surface { program, herd, kept, .. } = self;
        for (n, member) in herd.iter_mut().enumerate() {
            member.seen = None;
            if !member.place.is_seen(pose, size) {
                continue;
            }
            let wanted = member.place.wanted_error(pose, size[1], pixels);
            member.seen = Some(wanted);
            let before = member.instance.level();
            let level = level_for_error(program.levels(), wanted as f32);
            member.go_to(program, level, kept);
            change.splits += u64::from(level.saturating_sub(before));
            change.collapses += u64::from(before.saturating_sub(level));
            let words: &[u32] = bytemuck::cast_slice(member.instance.faces());
            for range in member.touched.take() {
                // What lies behind the live faces is written when it comes to life.
                let range = range.start..range.end.min(words.len());
                if !range.is_empty() {
                    change.upload_bytes += 4 * range.len() as u64;
                    upload(&words[range.clone()], n * slice_words + range.start);
                }
            }
            change.instances_seen += 1;
            change.faces += member.instance.faces().len() as u64;
            change.vertices += u64::from(program.levels()[level as usize].vertices);
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
                count: 3 * member.instance.faces().len() as u32,
            })
        };
        self.herd.iter().enumerate().filter_map(slice).collect()
    }

    /// Where the instances stand, and their levels.
    pub fn instances(&self) -> impl Iterator<Item = (&Place, u32)> {
        self.herd.iter().map(|member| (&member.place, member.instance.level()))
    }

    /// The live faces of one instance, in the order in which they are drawn.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn faces(&self, instance: usize) -> &[[u32; 3]] {
        self.herd[instance].instance.faces()
    }

    /// Bytes of main memory: what the instances share, and what they have of their own.
    pub fn host_bytes(&self) -> [usize; 2] {
        let own = |member: &Member| size_of::<Member>() + size_of_val(member.instance.faces());
        [self.program.bytes(), self.herd.iter().map(own).sum()]
    }
}

impl Member {
    fn go_to(&mut self, program: &Program, level: u32, kept: &mut Vec<[u32; 3]>) {
        let before = self.instance.faces().len();
        self.instance.go_to(program, level, kept, &mut self.touched);
        let now = self.instance.faces().len();
        self.touched.faces(before.min(now)..now);
    }
}

/// Of an instance of which the device has nothing.
fn fresh(program: &Program) -> Touched {
    let mut touched = Touched::new(program.faces().len());
    touched.faces(0..program.levels()[0].faces as usize);
    touched
}
