//! One surface with its instances: which level each has, and its part of the index buffer.
//!
//! All instances share the vertex buffer and the program of splits and permutations. Of its own an instance has its
//! place, its level and a slice of one index buffer on the device, as large as its live faces need ([`Slices`]): 500
//! instances of the bunny that mostly are far take a tenth of 500 full meshes. Where the host executes, it has the same
//! faces once more, and what was touched is copied; where the device does, the host knows no face.
//!
//! [`Slices`]: crate::paper::progressive_mesh::run::Slices

use super::levels::{Levels, limit};
use super::vertices::{ALWAYS_LOG2, EXACT_LOG2, VertexBuffer, normals};
use crate::math::camera::Pose;
use crate::paper::progressive_mesh::cache::live_faces;
use crate::paper::progressive_mesh::check::Flaw;
use crate::paper::progressive_mesh::config::ProgressiveSurface;
use crate::paper::progressive_mesh::file::Extent;
use crate::paper::progressive_mesh::mesh::ProgressiveMesh;
use crate::paper::progressive_mesh::place::{Bounds, Place};
use crate::paper::progressive_mesh::run::{Program, level_for_error};
use crate::paper::progressive_mesh::stand::Stand;
use crate::vk::shader::SurfaceView;
use crate::vk::{Buffer, Cmd, Error, Gpu, Slice};
use std::sync::Arc;
use thiserror::Error;

/// A progressive mesh that cannot be shown.
#[derive(Debug, Error)]
pub enum SurfaceError {
    #[error("surface.{name}.geometry: {flaw}")]
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
    /// What its file holds when whole, where the file's end is missing.
    pub cut_from: Option<Extent>,
    /// One for each instance.
    pub stands: Vec<Stand>,
}

/// A surface on the device.
pub struct Surface {
    pub name: String,
    /// As the scene has it; what may be changed between frames are `error_pixels` alone.
    pub settings: ProgressiveSurface,
    pub program: Arc<Program>,
    /// As [`Model::cut_from`].
    pub cut_from: Option<Extent>,
    pub(super) vertices: VertexBuffer,
    pub(super) indices: Buffer,
    /// The index buffer that was too small, until the frame that copies it is recorded.
    outgrown: Option<Buffer>,
    members: Vec<Member>,
    levels: Levels,
}

/// One instance, its level apart.
struct Member {
    place: Place,
    /// It is drawn in this frame, at this wanted error.
    seen: Option<f64>,
}

/// What one frame changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Change {
    pub instances_seen: usize,
    /// Faces that are drawn; of a rival also those that have no area.
    pub faces: u64,
    /// Of the instances' levels.
    pub live_faces: u64,
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
        let Model { name, surface, mesh, cut_from, stands } = model;
        let program = Program::new(mesh).map_err(|flaw| SurfaceError::Flaw { name: name.clone(), flaw })?;
        let program = Arc::new(program);
        let normals = normals(mesh, &live_faces(mesh, mesh.last_level()));
        let bounds = Bounds::of(&mesh.vertices.positions);
        let member = |stand: &Stand| Member { place: Place::new(surface, &bounds, stand), seen: None };
        let (vertices, indices) = (format!("{name}: vertices"), format!("{name}: indices"));
        let levels = Levels::new(gpu, mesh, program.clone(), surface, stands.len(), &indices)?;
        Ok(Surface {
            name: name.clone(),
            settings: surface.clone(),
            cut_from: *cut_from,
            vertices: VertexBuffer::new(gpu, &vertices, mesh, &normals, surface.geomorph)?,
            indices: levels.buffer(gpu, &indices)?,
            outgrown: None,
            members: stands.iter().map(member).collect(),
            levels,
            program,
        })
    }

    /// The error that each instance may have that the eye sees, object units.
    pub(super) fn wanted_errors(&self, pose: &Pose, size: [u32; 2]) -> Vec<f64> {
        let seen = self.members.iter().filter(|member| member.place.is_seen(pose, size));
        seen.map(|member| member.place.wanted_error(pose, size[1], self.settings.error_pixels)).collect()
    }

    /// Live faces of instances that may have `factor` times these errors.
    pub(super) fn live_faces(&self, wanted_errors: &[f64], factor: f64) -> u64 {
        let levels = self.program.levels();
        let live = |wanted: &f64| {
            u64::from(levels[level_for_error(levels, (wanted * factor) as f32) as usize].faces)
        };
        wanted_errors.iter().map(live).sum()
    }

    /// Brings every instance that the eye sees to its level: the coarsest whose error is at most `pixels` in the
    /// picture. `upload` is given words and where they belong in [`Surface::indices`], in words.
    pub(super) fn go(
        &mut self,
        gpu: &Gpu,
        pose: &Pose,
        size: [u32; 2],
        pixels: f64,
        upload: &mut impl FnMut(&[u32], usize),
    ) -> Result<Change, Error> {
        let mut change = Change::default();
        let Surface { program, members, levels, .. } = self;
        for (n, member) in members.iter_mut().enumerate() {
            member.seen = None;
            if !member.place.is_seen(pose, size) {
                continue;
            }
            let wanted = member.place.wanted_error(pose, size[1], pixels);
            member.seen = Some(wanted);
            let (from, to) = (levels.level(n), level_for_error(program.levels(), wanted as f32));
            levels.go_to(n, to).map_err(|error| limit(self.indices.name(), error))?;
            change.splits += u64::from(to.saturating_sub(from));
            change.collapses += u64::from(from.saturating_sub(to));
            change.instances_seen += 1;
            let live = &program.levels()[to as usize];
            change.faces += u64::from(levels.drawn(n, program));
            change.live_faces += u64::from(live.faces);
            change.vertices += u64::from(live.vertices);
        }
        change.upload_bytes = self.collect(gpu, upload)?;
        Ok(change)
    }

    /// Brings one instance to a level, whoever sees it; else as [`Surface::go`].
    pub(super) fn go_to(
        &mut self,
        gpu: &Gpu,
        (instance, level): (usize, u32),
        upload: &mut impl FnMut(&[u32], usize),
    ) -> Result<Change, Error> {
        let from = self.levels.level(instance);
        self.levels.go_to(instance, level).map_err(|error| limit(self.indices.name(), error))?;
        Ok(Change {
            splits: u64::from(level.saturating_sub(from)),
            collapses: u64::from(from.saturating_sub(level)),
            upload_bytes: self.collect(gpu, upload)?,
            ..Change::default()
        })
    }

    /// Uploads what the levels have written, and sees to room for it; returns its bytes.
    fn collect(&mut self, gpu: &Gpu, upload: &mut impl FnMut(&[u32], usize)) -> Result<u64, Error> {
        let mut bytes = 0;
        match &mut self.levels {
            Levels::Host(instances) => {
                for range in instances.take_touched() {
                    bytes += 4 * range.len() as u64;
                    upload(&instances.buffer().as_flattened()[range.clone()], range.start);
                }
            }
            Levels::Rival(rivals) => bytes += rivals.upload(upload),
            Levels::Device(_) => {}
        }
        self.grow(gpu)?;
        Ok(bytes)
    }

    /// An index buffer for all slices: half as large again as the one before, so that few frames wait for one.
    fn grow(&mut self, gpu: &Gpu) -> Result<(), Error> {
        let bytes = 12 * u64::from(self.levels.faces());
        if bytes <= self.indices.bytes() {
            return Ok(());
        }
        let (name, usage) = (self.indices.name().to_owned(), self.levels.buffer_use());
        let roomy = bytes.max(self.indices.bytes() / 2 * 3);
        let grown = gpu.buffer(&name, roomy, usage).or_else(|_| gpu.buffer(&name, bytes, usage))?;
        self.outgrown = Some(std::mem::replace(&mut self.indices, grown));
        Ok(())
    }

    /// Records what [`Surface::go`] has found: `uploads` are (place in `staging`, place in the index buffer, bytes).
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
            Levels::Host(_) | Levels::Rival(_) => cmd.copy_ranges(staging, &self.indices, uploads),
            Levels::Device(resident) => resident.run(cmd, &self.indices)?,
        }
        Ok(())
    }

    /// What [`Surface::record`] recorded is on its way to the device.
    pub(super) fn submitted(&mut self) {
        self.outgrown = None;
        match &mut self.levels {
            Levels::Host(_) => {}
            Levels::Device(resident) => resident.done(),
            Levels::Rival(rivals) => rivals.done(),
        }
    }

    /// Whether a rival asks for a pass of its own.
    pub(super) fn compacts(&self) -> bool {
        matches!(&self.levels, Levels::Rival(rivals) if rivals.compacts())
    }

    /// That pass, behind [`Surface::record`].
    pub(super) fn compact(&self, cmd: &mut Cmd<'_>) -> Result<(), Error> {
        match &self.levels {
            Levels::Rival(rivals) => rivals.compact(cmd, &self.indices),
            _ => Ok(()),
        }
    }

    /// A draw for each instance that [`Surface::go`] found seen.
    pub(super) fn slices(&self, pose: &Pose, size: [u32; 2], sun: glam::DVec3) -> Vec<Slice<SurfaceView>> {
        let slice = |(n, member): (usize, &Member)| {
            let wanted = member.seen?;
            let wanted_log2 = if wanted > 0.0 { wanted.log2() as f32 } else { EXACT_LOG2 };
            let push = SurfaceView {
                object_to_clip: member.place.object_to_clip(pose, size).as_mat4().to_cols_array_2d(),
                sun: (member.place.rotation.transpose() * sun).as_vec3().to_array(),
                wanted_log2: wanted_log2.clamp(EXACT_LOG2, ALWAYS_LOG2),
                band_log2: super::MORPH_BAND_LOG2,
            };
            Some(Slice { push, first_index: 3 * self.levels.first(n), count: 3 * self.drawn(n) })
        };
        self.members.iter().enumerate().filter_map(slice).collect()
    }

    /// Live faces of an instance.
    fn live(&self, instance: usize) -> u32 {
        self.program.levels()[self.levels.level(instance) as usize].faces
    }

    /// Faces that it draws.
    fn drawn(&self, instance: usize) -> u32 {
        self.levels.drawn(instance, &self.program)
    }

    /// Where the instances stand, and their levels.
    pub fn instances(&self) -> impl Iterator<Item = (&Place, u32)> {
        self.members.iter().enumerate().map(|(n, member)| (&member.place, self.levels.level(n)))
    }

    /// The faces of one instance, in the order in which they are drawn; `None` where the device executes.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn faces(&self, instance: usize) -> Option<&[[u32; 3]]> {
        match &self.levels {
            Levels::Host(instances) => Some(instances.faces(instance)),
            Levels::Device(_) => None,
            Levels::Rival(rivals) => rivals.faces(instance),
        }
    }

    /// What the device executes takes in video memory, with its name.
    pub(super) fn program_bytes(&self) -> Option<(&'static str, u64)> {
        match &self.levels {
            Levels::Host(_) => None,
            Levels::Device(resident) => Some(("splits and permutations", resident.shared_bytes())),
            Levels::Rival(rivals) => rivals.shared_bytes().map(|bytes| ("faces by rank", bytes)),
        }
    }

    /// In words: how many there are, and what one takes. The index buffer grows with the levels.
    pub fn of_an_instance(&self) -> String {
        let memory = self.memory();
        let [least, most] =
            [0, self.program.last_level()].map(|level| self.program.levels()[level as usize].faces);
        let state = memory.state.div_ceil(memory.instances);
        let (places, faces, rival) = match &self.levels {
            Levels::Host(_) => ("in main and in video memory", "live", None),
            Levels::Device(_) => ("in video memory", "live", None),
            Levels::Rival(rivals) => ("in video memory", "drawn", Some(rivals.adds())),
        };
        let own = format!(
            "{}: {} of {least} to {most} faces at {} levels; each {state} bytes of state, and {places} 12 bytes for \
             each {faces} face",
            self.name,
            memory.instances,
            self.program.levels().len()
        );
        rival.map_or(own.clone(), |adds| format!("{own}; {adds}"))
    }

    /// What the instances share, and have of their own.
    pub fn memory(&self) -> SurfaceMemory {
        let (state, host_indices) = match &self.levels {
            Levels::Host(instances) => (instances.state_bytes(), size_of_val(instances.buffer())),
            Levels::Device(resident) => (resident.state_bytes(), 0),
            Levels::Rival(rivals) => (rivals.state_bytes(), rivals.host_bytes()),
        };
        SurfaceMemory {
            instances: self.members.len(),
            live_faces: (0..self.members.len()).map(|n| u64::from(self.live(n))).sum(),
            shared_host: self.program.bytes(),
            shared_device: self.vertices.bytes() + self.program_bytes().map_or(0, |(_, bytes)| bytes),
            state: size_of_val(&*self.members) + state,
            host_indices,
            device_indices: self.indices.bytes(),
        }
    }
}

/// Bytes of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfaceMemory {
    pub instances: usize,
    /// Of all instances at their levels: not bytes.
    pub live_faces: u64,
    /// Main memory that the instances share: the program, level 0.
    pub shared_host: usize,
    /// Video memory that they share: vertices, and the program where the device executes.
    pub shared_device: u64,
    /// Main memory of their own but for faces: place, level, slice, marks of what was touched.
    pub state: usize,
    /// Their slices in main memory, where the host executes; of a rival its lists, which they share.
    pub host_indices: usize,
    /// Their slices in video memory.
    pub device_indices: u64,
}
