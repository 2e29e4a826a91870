//! The instances' levels and slices of the index buffer, for each way of execution.

use super::baseline::Baselines;
use super::resident::Resident;
use crate::paper::progressive_mesh::baselines::Baseline;
use crate::paper::progressive_mesh::choices::Apply;
use crate::paper::progressive_mesh::config::ProgressiveSurface;
use crate::paper::progressive_mesh::mesh::ProgressiveMesh;
use crate::paper::progressive_mesh::run::{Instances, Program, TooMany};
use crate::vk::{Buffer, BufferUse, Error, Gpu};
use std::sync::Arc;

/// The instances' levels and slices: executed by the host, by the device, or drawn by a baseline.
pub enum Levels {
    Host(Instances),
    Device(Box<Resident>),
    Baseline(Box<Baselines>),
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
        if let Some(baseline) = Baseline::of(surface.order) {
            let mut baselines = Baselines::new(gpu, mesh, program, baseline)?;
            (0..count).try_for_each(|_| baselines.push()).map_err(limit)?;
            return Ok(Levels::Baseline(Box::new(baselines)));
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
            Levels::Baseline(baselines) => baselines.go_to(instance, level),
        }
    }

    pub fn level(&self, instance: usize) -> u32 {
        match self {
            Levels::Host(instances) => instances.level(instance),
            Levels::Device(resident) => resident.level(instance),
            Levels::Baseline(baselines) => baselines.level(instance),
        }
    }

    /// Faces that an instance draws.
    pub fn drawn(&self, instance: usize, program: &Program) -> u32 {
        match self {
            Levels::Baseline(baselines) => baselines.drawn(instance),
            _ => program.drawn(self.level(instance)),
        }
    }

    /// First face of an instance in the index buffer.
    pub fn first(&self, instance: usize) -> u32 {
        match self {
            Levels::Host(instances) => instances.slots(instance).start as u32,
            Levels::Device(resident) => resident.first(instance),
            Levels::Baseline(baselines) => baselines.first(instance),
        }
    }

    /// Faces of the index buffer.
    pub fn faces(&self) -> u32 {
        match self {
            Levels::Host(instances) => instances.buffer().len() as u32,
            Levels::Device(resident) => resident.end(),
            Levels::Baseline(baselines) => baselines.end(),
        }
    }

    /// The initial index buffer. If the host executes, it is empty and the first frame uploads all of it.
    pub fn buffer(&self, gpu: &Gpu, name: &str) -> Result<Buffer, Error> {
        match self {
            Levels::Host(_) => gpu.buffer(name, 12 * u64::from(self.faces()), self.buffer_use()),
            Levels::Device(resident) => gpu.buffer_with(name, &resident.content(), self.buffer_use()),
            Levels::Baseline(baselines) => baselines.buffer(gpu, name),
        }
    }

    pub fn buffer_use(&self) -> BufferUse {
        match self {
            Levels::Host(_) => BufferUse::Indices,
            Levels::Device(_) => BufferUse::WritableIndices,
            Levels::Baseline(baselines) => baselines.buffer_use(),
        }
    }
}

/// Reports the index buffer's limit as a device limit.
pub fn limit(indices: &str, error: TooMany) -> Error {
    Error::Limit { object: indices.to_owned(), what: error.to_string() }
}
