//! The instances' levels and slices of the index buffer, whoever fills them.

use super::resident::Resident;
use super::rival::Rivals;
use crate::paper::progressive_mesh::choices::Apply;
use crate::paper::progressive_mesh::config::ProgressiveSurface;
use crate::paper::progressive_mesh::mesh::ProgressiveMesh;
use crate::paper::progressive_mesh::rivals::Rival;
use crate::paper::progressive_mesh::run::{Instances, Program, TooMany};
use crate::vk::{Buffer, BufferUse, Error, Gpu};
use std::sync::Arc;

/// The instances' levels and slices, and who executes.
pub enum Levels {
    Host(Instances),
    Device(Box<Resident>),
    Rival(Box<Rivals>),
}

impl Levels {
    pub fn new(
        gpu: &Gpu,
        mesh: &ProgressiveMesh,
        program: Arc<Program>,
        surface: &ProgressiveSurface,
        count: usize,
        indices: &str,
    ) -> Result<Levels, Error> {
        let limit = |error| limit(indices, error);
        if let Some(rival) = Rival::of(surface.order) {
            let mut rivals = Rivals::new(gpu, mesh, program, rival)?;
            (0..count).try_for_each(|_| rivals.push()).map_err(limit)?;
            return Ok(Levels::Rival(Box::new(rivals)));
        }
        Ok(match surface.apply {
            Apply::Cpu => Levels::Host(Instances::new(program, count).map_err(limit)?),
            Apply::Gpu => {
                let mut resident = Resident::new(gpu, program)?;
                (0..count).try_for_each(|_| resident.push()).map_err(limit)?;
                Levels::Device(Box::new(resident))
            }
        })
    }

    pub fn go_to(&mut self, instance: usize, level: u32) -> Result<(), TooMany> {
        match self {
            Levels::Host(instances) => instances.go_to(instance, level),
            Levels::Device(resident) => resident.go_to(instance, level),
            Levels::Rival(rivals) => rivals.go_to(instance, level),
        }
    }

    pub fn level(&self, instance: usize) -> u32 {
        match self {
            Levels::Host(instances) => instances.level(instance),
            Levels::Device(resident) => resident.level(instance),
            Levels::Rival(rivals) => rivals.level(instance),
        }
    }

    /// Faces that an instance draws.
    pub fn drawn(&self, instance: usize, program: &Program) -> u32 {
        match self {
            Levels::Rival(rivals) => rivals.drawn(instance),
            _ => program.levels()[self.level(instance) as usize].faces,
        }
    }

    /// Where an instance's faces begin in the index buffer, in faces.
    pub fn first(&self, instance: usize) -> u32 {
        match self {
            Levels::Host(instances) => instances.slots(instance).start as u32,
            Levels::Device(resident) => resident.first(instance),
            Levels::Rival(rivals) => rivals.first(instance),
        }
    }

    /// Of the index buffer.
    pub fn faces(&self) -> u32 {
        match self {
            Levels::Host(instances) => instances.buffer().len() as u32,
            Levels::Device(resident) => resident.end(),
            Levels::Rival(rivals) => rivals.end(),
        }
    }

    /// The first index buffer. The host uploads to it what is touched, which at first is all.
    pub fn buffer(&self, gpu: &Gpu, name: &str) -> Result<Buffer, Error> {
        match self {
            Levels::Host(_) => gpu.buffer(name, 12 * u64::from(self.faces()), self.buffer_use()),
            Levels::Device(resident) => gpu.buffer_with(name, &resident.content(), self.buffer_use()),
            Levels::Rival(rivals) => rivals.buffer(gpu, name),
        }
    }

    pub fn buffer_use(&self) -> BufferUse {
        match self {
            Levels::Host(_) => BufferUse::Indices,
            Levels::Device(_) => BufferUse::WritableIndices,
            Levels::Rival(rivals) => rivals.buffer_use(),
        }
    }
}

/// The index buffer's limit as one of the device.
pub fn limit(indices: &str, error: TooMany) -> Error {
    Error::Limit { object: indices.to_owned(), what: error.to_string() }
}
