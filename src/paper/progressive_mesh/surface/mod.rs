//! One surface with its instances: their levels, and their slices of the index buffer.
//!
//! All instances share the vertex buffer and the program of splits and permutations. Each instance has its own
//! placement, level, and slice of one index buffer on the device. A slice is sized for the faces that the instance
//! draws ([`Slices`]). So 500 instances of the bunny, most of them far away, need a tenth of the memory of 500 full
//! meshes. If the host changes the levels, it keeps a second copy of these faces. The host uploads the written parts,
//! or copies them into memory that the device reads directly, with a buffer for each frame in flight. If the device
//! changes the levels, the host has no faces. Indices have 16 bits if the mesh has fewer than 65,536 vertices.
//!
//! [`Slices`]: crate::paper::progressive_mesh::run::Slices

mod baseline;
mod levels;
mod mapped;
mod memory;
pub mod pace;
mod resident;
pub mod vertices;

pub use memory::SurfaceMemory;

use crate::frame::{Draw, FrameSlot, Shape, Stalled, View};
use crate::math::camera::Pose;
use crate::paper::progressive_mesh::cache::live_faces;
use crate::paper::progressive_mesh::check::MeshFlaw;
use crate::paper::progressive_mesh::choices::Apply;
use crate::paper::progressive_mesh::config::ProgressiveSurface;
use crate::paper::progressive_mesh::file::Extent;
use crate::paper::progressive_mesh::load::LoadedMesh;
use crate::paper::progressive_mesh::place::{Bounds, Placement};
use crate::paper::progressive_mesh::run::Program;
use crate::paper::progressive_mesh::stand::Stand;
use crate::vk::shader::SurfaceView;
use crate::vk::{Buffer, Cmd, Error, Gpu, IndexRange};
use glam::{DMat3, DVec3};
use levels::{InstanceLevels, limit};
use mapped::Mapped;
use pace::{ErrorPace, InstanceError};
use std::sync::Arc;
use thiserror::Error;
use vertices::{ALWAYS_LOG2, EXACT_LOG2, MORPH_BAND_LOG2, VertexBuffer, normals};

/// A progressive mesh that cannot be shown.
#[derive(Debug, Error)]
pub enum SurfaceError {
    #[error("surface.{name}.geometry: {flaw}")]
    Flaw { name: String, flaw: MeshFlaw },
    #[error(transparent)]
    Vulkan(#[from] Error),
    #[error(transparent)]
    Stalled(#[from] Stalled),
}

/// A surface on the device.
pub struct MeshOnDevice {
    pub name: String,
    /// Settings from the scene; only `error_pixels` may change between frames.
    pub settings: ProgressiveSurface,
    pub program: Arc<Program>,
    /// As [`LoadedMesh::cut_from`].
    pub cut_from: Option<Extent>,
    pub(super) vertices: VertexBuffer,
    pub(super) indices: Arc<Buffer>,
    /// The index buffers in memory that the device reads directly; `indices` is the current frame's buffer.
    mapped: Option<Mapped>,
    /// The previous index buffer, which became too small. Kept until the frame that copies it is recorded.
    outgrown: Option<Arc<Buffer>>,
    members: Vec<Member>,
    levels: InstanceLevels,
    pace: ErrorPace,
    /// The governor's factor on the errors of the last frame.
    factor: f64,
    /// True if an instance in view has not reached its wanted error.
    arriving: bool,
}

/// One instance, without its level.
struct Member {
    place: Placement,
    /// The error without the governor's factor, if the instance is drawn in this frame.
    seen: Option<InstanceError>,
}

/// What one frame changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameChanges {
    pub instances_seen: usize,
    /// Drawn faces; for a baseline, degenerate faces are included.
    pub faces: u64,
    /// Live faces at the instances' levels.
    pub live_faces: u64,
    /// Vertices that the drawn faces can use, summed over the instances: a lower bound of the vertex shader
    /// runs.
    pub vertices: u64,
    pub splits: u64,
    pub collapses: u64,
    pub upload_bytes: u64,
}

impl MeshOnDevice {
    /// # Errors
    /// An invalid mesh; out of memory.
    ///
    /// # Panics
    /// If a textured mesh has no texture coordinates, or geomorphs.
    pub fn new(gpu: &Gpu, model: &LoadedMesh) -> Result<MeshOnDevice, SurfaceError> {
        let LoadedMesh { name, surface, mesh, cut_from, stands, textured } = model;
        assert!(textured.is_none() || !surface.geomorph, "{name}: geomorph with a texture");
        let program = Program::new(mesh).map_err(|flaw| SurfaceError::Flaw { name: name.clone(), flaw })?;
        let program = Arc::new(program);
        let normals = normals(mesh, &live_faces(mesh, mesh.last_level()));
        let bounds = Bounds::of(&mesh.vertices.positions);
        let member = |stand: &Stand| Member { place: Placement::new(surface, &bounds, stand), seen: None };
        let (vertices, indices) = (format!("{name}: vertices"), format!("{name}: indices"));
        let levels = InstanceLevels::new(gpu, mesh, program.clone(), surface, stands.len(), &indices)?;
        Ok(MeshOnDevice {
            name: name.clone(),
            settings: surface.clone(),
            cut_from: *cut_from,
            vertices: match textured {
                Some(textured) => {
                    VertexBuffer::textured(gpu, &vertices, mesh, textured.lit.then_some(&normals))?
                }
                None => VertexBuffer::new(gpu, &vertices, mesh, &normals, surface.geomorph)?,
            },
            indices: Arc::new(levels.buffer(gpu, &indices, program.index_type())?),
            mapped: match surface.apply {
                Apply::Mapped => Some(Mapped::new(gpu, &indices, program.index_type())?),
                Apply::Cpu | Apply::Gpu => None,
            },
            outgrown: None,
            members: stands.iter().map(member).collect(),
            levels,
            pace: ErrorPace::new(surface, program.levels()),
            factor: 1.0,
            arriving: false,
            program,
        })
    }

    /// Changes the wanted error. The next frame draws it at once: only changes that the camera causes follow gradually.
    pub fn set_error_pixels(&mut self, error_pixels: f64) {
        if self.settings.error_pixels.to_bits() != error_pixels.to_bits() {
            self.settings.error_pixels = error_pixels;
            self.members.iter_mut().for_each(|member| member.seen = None);
        }
    }

    /// Brings the error of each visible instance to the wanted error, or as near to the wanted error as the
    /// [`ErrorPace`] allows.
    pub(super) fn follow(&mut self, view: &View) {
        let (pose, size) = (&view.pose, view.size);
        self.arriving = false;
        for member in &mut self.members {
            let before = member.seen.take();
            if member.place.is_seen(pose, size) {
                let [error, pixel] = [self.settings.error_pixels, 1.0]
                    .map(|pixels| member.place.wanted_error(pose, size[1], pixels));
                let shown = self.pace.next(before, InstanceError { error, pixel }, view.seconds);
                self.arriving |= shown.to_bits() != error.to_bits();
                member.seen = Some(InstanceError { error: shown, pixel });
            }
        }
    }

    /// Live faces of the visible instances if each error is multiplied by `factor`.
    pub(super) fn live_faces(&self, factor: f64) -> u64 {
        let levels = self.program.levels();
        let live = |shown: f64| u64::from(levels[self.pace.level(levels, shown * factor) as usize].faces);
        self.members.iter().filter_map(|member| member.seen).map(|seen| live(seen.error)).sum()
    }

    /// Brings every visible instance to its level: the coarsest level whose error is at most the instance's error times
    /// `factor`. `upload` receives bytes and their offset in [`MeshOnDevice::indices`].
    pub(super) fn go(
        &mut self,
        gpu: &Gpu,
        slot: FrameSlot,
        factor: f64,
        upload: &mut impl FnMut(&[u8], u64),
    ) -> Result<FrameChanges, Error> {
        let mut change = FrameChanges::default();
        self.factor = factor;
        let MeshOnDevice { program, members, levels, pace, .. } = self;
        for (n, member) in members.iter().enumerate() {
            let Some(InstanceError { error: shown, .. }) = member.seen else { continue };
            let (from, to) = (levels.level(n), pace.level(program.levels(), shown * factor));
            levels.go_to(n, to).map_err(|error| limit(self.indices.name(), error))?;
            change.splits += u64::from(to.saturating_sub(from));
            change.collapses += u64::from(from.saturating_sub(to));
            change.instances_seen += 1;
            let live = &program.levels()[to as usize];
            change.faces += u64::from(levels.drawn(n, program));
            change.live_faces += u64::from(live.faces);
            change.vertices += u64::from(live.vertices);
        }
        change.upload_bytes = self.collect(gpu, slot, upload)?;
        Ok(change)
    }

    /// Brings one instance to a level, visible or not. `upload` is as in [`MeshOnDevice::go`].
    pub(super) fn go_to(
        &mut self,
        gpu: &Gpu,
        slot: FrameSlot,
        (instance, level): (usize, u32),
        upload: &mut impl FnMut(&[u8], u64),
    ) -> Result<FrameChanges, Error> {
        let from = self.levels.level(instance);
        self.levels.go_to(instance, level).map_err(|error| limit(self.indices.name(), error))?;
        Ok(FrameChanges {
            splits: u64::from(level.saturating_sub(from)),
            collapses: u64::from(from.saturating_sub(level)),
            upload_bytes: self.collect(gpu, slot, upload)?,
            ..FrameChanges::default()
        })
    }

    /// Uploads the bytes that changes of level wrote, and grows the index buffer if needed; returns the bytes.
    fn collect(
        &mut self,
        gpu: &Gpu,
        slot: FrameSlot,
        upload: &mut impl FnMut(&[u8], u64),
    ) -> Result<u64, Error> {
        if let (InstanceLevels::Host(instances), Some(mapped)) = (&mut self.levels, &mut self.mapped) {
            let touched = instances.take_touched();
            let (indices, written) = mapped.update(gpu, slot, instances.bytes(), &touched)?;
            self.indices = indices;
            return Ok(written);
        }
        let mut sent = 0;
        let mut send = |bytes: &[u8], at: u64| {
            sent += bytes.len() as u64;
            upload(bytes, at);
        };
        match &mut self.levels {
            InstanceLevels::Host(instances) => {
                for range in instances.take_touched() {
                    send(&instances.bytes()[range.clone()], range.start as u64);
                }
            }
            InstanceLevels::Baseline(baselines) => baselines.upload(self.program.index_type(), &mut send),
            InstanceLevels::Device(_) => {}
        }
        self.grow(gpu)?;
        Ok(sent)
    }

    /// Allocates a larger index buffer if the slices need it: at least 1.5 times as large as the previous one if memory
    /// allows, so that few frames wait for growth.
    fn grow(&mut self, gpu: &Gpu) -> Result<(), Error> {
        let index = self.program.index_type();
        let bytes = self.levels.bytes(index);
        if bytes <= self.indices.bytes() {
            return Ok(());
        }
        let (name, usage) = (self.indices.name().to_owned(), self.levels.buffer_use(index));
        let roomy = bytes.max(self.indices.bytes() / 8 * 12);
        let grown = gpu.buffer(&name, roomy, usage).or_else(|_| gpu.buffer(&name, bytes, usage))?;
        self.outgrown = Some(std::mem::replace(&mut self.indices, Arc::new(grown)));
        Ok(())
    }

    /// Records the result of [`MeshOnDevice::go`]: `uploads` are (offset in `staging`, offset in the index buffer,
    /// bytes).
    pub(super) fn record(
        &self,
        cmd: &mut Cmd<'_>,
        staging: &Buffer,
        uploads: &[[u64; 3]],
    ) -> Result<(), Error> {
        if let Some(outgrown) = &self.outgrown {
            cmd.copy_buffer(outgrown, 0, &self.indices, 0, outgrown.bytes());
            cmd.sync();
        }
        match &self.levels {
            InstanceLevels::Host(_) | InstanceLevels::Baseline(_) => {
                cmd.copy_ranges(staging, &self.indices, uploads)
            }
            InstanceLevels::Device(resident) => resident.run(cmd, &self.indices)?,
        }
        Ok(())
    }

    /// Must be called after the commands of [`MeshOnDevice::record`] are recorded. If the commands are never submitted,
    /// the index buffer lacks their changes.
    pub(super) fn recorded(&mut self) {
        self.outgrown = None;
        match &mut self.levels {
            InstanceLevels::Host(_) => {}
            InstanceLevels::Device(resident) => resident.done(),
            InstanceLevels::Baseline(baselines) => baselines.done(),
        }
    }

    /// True if the last frame drew an instance at an error that is not yet the wanted error.
    pub(super) fn arriving(&self) -> bool {
        self.arriving
    }

    /// True if a baseline needs its own pass.
    pub(super) fn compacts(&self) -> bool {
        matches!(&self.levels, InstanceLevels::Baseline(baselines) if baselines.compacts())
    }

    /// Records the pass of a baseline, after [`MeshOnDevice::record`].
    pub(super) fn compact(&self, cmd: &mut Cmd<'_>) -> Result<(), Error> {
        match &self.levels {
            InstanceLevels::Baseline(baselines) => baselines.compact(cmd, &self.indices),
            _ => Ok(()),
        }
    }

    /// A draw for each instance that [`MeshOnDevice::go`] found visible.
    pub(super) fn slices(
        &self,
        pose: &Pose,
        size: [u32; 2],
        sun: glam::DVec3,
    ) -> Vec<IndexRange<SurfaceView>> {
        let slice = |(n, member): (usize, &Member)| {
            let chosen = self.pace.chosen(member.seen?.error * self.factor);
            let wanted_log2 = if chosen > 0.0 { chosen.log2() as f32 } else { EXACT_LOG2 };
            let push = SurfaceView {
                object_to_clip: member.place.object_to_clip(pose, size).as_mat4().to_cols_array_2d(),
                sun: (member.place.rotation.transpose() * sun).as_vec3().to_array(),
                wanted_log2: wanted_log2.clamp(EXACT_LOG2, ALWAYS_LOG2),
                band_log2: MORPH_BAND_LOG2,
            };
            Some(IndexRange { push, first_index: 3 * self.levels.first(n), count: 3 * self.drawn(n) })
        };
        self.members.iter().enumerate().filter_map(slice).collect()
    }

    /// The visible instances, for another technique to texture. `None` if this technique draws the surface
    /// itself.
    pub(super) fn shape(&self) -> Option<Shape> {
        let VertexBuffer::Textured { vertices, normals } = &self.vertices else { return None };
        let seen = self.members.iter().enumerate().filter(|(_, member)| member.seen.is_some());
        let draw = |(n, Member { place, .. }): (usize, &Member)| Draw::Object {
            centre: place.centre,
            axes: place.rotation * DMat3::from_diagonal(DVec3::splat(place.scale)),
            first_index: 3 * self.levels.first(n),
            indices: 3 * self.drawn(n),
        };
        Some(Shape {
            vertices: vertices.clone(),
            indices: self.indices.clone(),
            normals: normals.clone(),
            depth_alone: None,
            draws: seen.map(draw).collect(),
            curvature: 0.0,
        })
    }

    /// An instance's first face in the index buffer.
    pub(super) fn first_face(&self, instance: usize) -> u32 {
        self.levels.first(instance)
    }

    /// Live faces of an instance.
    fn live(&self, instance: usize) -> u32 {
        self.program.levels()[self.levels.level(instance) as usize].faces
    }

    /// Faces that an instance draws.
    fn drawn(&self, instance: usize) -> u32 {
        self.levels.drawn(instance, &self.program)
    }

    /// Placements and levels of the instances.
    pub fn instances(&self) -> impl Iterator<Item = (&Placement, u32)> {
        self.members.iter().enumerate().map(|(n, member)| (&member.place, self.levels.level(n)))
    }

    /// The faces of one instance in drawing order; `None` if the device executes.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn faces(&self, instance: usize) -> Option<Vec<[u32; 3]>> {
        self.levels.faces(instance)
    }
}

impl std::ops::AddAssign for FrameChanges {
    fn add_assign(&mut self, other: FrameChanges) {
        self.instances_seen += other.instances_seen;
        self.faces += other.faces;
        self.live_faces += other.live_faces;
        self.vertices += other.vertices;
        self.splits += other.splits;
        self.collapses += other.collapses;
        self.upload_bytes += other.upload_bytes;
    }
}
