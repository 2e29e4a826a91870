//! The levels of a surface's instances, and their slices of the index buffer. The host or the device executes the
//! splits, or a baseline draws the levels by another method.

use super::baseline::Baselines;
use super::resident::Resident;
use crate::paper::progressive_mesh::baselines::OrderBaseline;
use crate::paper::progressive_mesh::choices::Apply;
use crate::paper::progressive_mesh::config::ProgressiveSurface;
use crate::paper::progressive_mesh::mesh::ProgressiveMesh;
use crate::paper::progressive_mesh::run::{Index, Instances, Program, TooMany};
use crate::vk::{Buffer, BufferUse, Error, Gpu, IndexType};
use std::ops::Range;
use std::sync::Arc;

/// The instances' levels and slices. The host or the device executes the splits; a baseline draws without them.
pub enum InstanceLevels {
    Host(Box<dyn Host>),
    Device(Box<Resident>),
    Baseline(Box<Baselines>),
}

/// Instances whose splits the host executes, with indices of 16 or 32 bits.
pub trait Host: Send {
    fn go_to(&mut self, instance: usize, level: u32) -> Result<(), TooMany>;
    fn level(&self, instance: usize) -> u32;
    /// First face of an instance in the index buffer.
    fn first(&self, instance: usize) -> u32;
    fn faces(&self, instance: usize) -> Vec<[u32; 3]>;
    /// The whole index buffer.
    fn bytes(&self) -> &[u8];
    /// Ranges of bytes that were written since the last call.
    fn take_touched(&mut self) -> Vec<Range<usize>>;
    fn state_bytes(&self) -> usize;
}

impl<I: Index> Host for Instances<I> {
    fn go_to(&mut self, instance: usize, level: u32) -> Result<(), TooMany> {
        Instances::go_to(self, instance, level)
    }

    fn level(&self, instance: usize) -> u32 {
        Instances::level(self, instance)
    }

    fn first(&self, instance: usize) -> u32 {
        self.slots(instance).start as u32
    }

    fn faces(&self, instance: usize) -> Vec<[u32; 3]> {
        Instances::faces(self, instance).iter().map(|face| face.map(I::vertex)).collect()
    }

    fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(self.buffer())
    }

    fn take_touched(&mut self) -> Vec<Range<usize>> {
        let bytes = |indices: Range<usize>| size_of::<I>() * indices.start..size_of::<I>() * indices.end;
        Instances::take_touched(self).into_iter().map(bytes).collect()
    }

    fn state_bytes(&self) -> usize {
        Instances::state_bytes(self)
    }
}

impl InstanceLevels {
    pub fn new(
        gpu: &Gpu,
        mesh: &ProgressiveMesh,
        program: Arc<Program>,
        surface: &ProgressiveSurface,
        count: usize,
        indices: &str,
    ) -> Result<InstanceLevels, Error> {
        let limit = |error| limit(indices, error);
        if let Some(baseline) = OrderBaseline::of(surface.order) {
            let mut baselines = Baselines::new(gpu, mesh, program, baseline)?;
            (0..count).try_for_each(|_| baselines.push()).map_err(limit)?;
            return Ok(InstanceLevels::Baseline(Box::new(baselines)));
        }
        Ok(match (surface.apply, program.index_type()) {
            (Apply::Cpu | Apply::Mapped, IndexType::U16) => {
                InstanceLevels::Host(Box::new(Instances::<u16>::of_width(program, count).map_err(limit)?))
            }
            (Apply::Cpu | Apply::Mapped, IndexType::U32) => {
                InstanceLevels::Host(Box::new(Instances::<u32>::of_width(program, count).map_err(limit)?))
            }
            (Apply::Gpu, _) => {
                let mut resident = Resident::new(gpu, program)?;
                (0..count).try_for_each(|_| resident.push()).map_err(limit)?;
                InstanceLevels::Device(Box::new(resident))
            }
        })
    }

    pub fn go_to(&mut self, instance: usize, level: u32) -> Result<(), TooMany> {
        match self {
            InstanceLevels::Host(instances) => instances.go_to(instance, level),
            InstanceLevels::Device(resident) => resident.go_to(instance, level),
            InstanceLevels::Baseline(baselines) => baselines.go_to(instance, level),
        }
    }

    pub fn level(&self, instance: usize) -> u32 {
        match self {
            InstanceLevels::Host(instances) => instances.level(instance),
            InstanceLevels::Device(resident) => resident.level(instance),
            InstanceLevels::Baseline(baselines) => baselines.level(instance),
        }
    }

    /// Faces that an instance draws.
    pub fn drawn(&self, instance: usize, program: &Program) -> u32 {
        match self {
            InstanceLevels::Baseline(baselines) => baselines.drawn(instance),
            _ => program.drawn(self.level(instance)),
        }
    }

    /// First face of an instance in the index buffer.
    pub fn first(&self, instance: usize) -> u32 {
        match self {
            InstanceLevels::Host(instances) => instances.first(instance),
            InstanceLevels::Device(resident) => resident.first(instance),
            InstanceLevels::Baseline(baselines) => baselines.first(instance),
        }
    }

    /// An instance's faces in the order in which they are drawn, if the host knows them.
    pub fn faces(&self, instance: usize) -> Option<Vec<[u32; 3]>> {
        match self {
            InstanceLevels::Host(instances) => Some(instances.faces(instance)),
            InstanceLevels::Device(_) => None,
            InstanceLevels::Baseline(baselines) => baselines.faces(instance).map(<[_]>::to_vec),
        }
    }

    /// Bytes of the index buffer.
    pub fn bytes(&self, index: IndexType) -> u64 {
        match self {
            InstanceLevels::Host(instances) => (instances.bytes().len() as u64).next_multiple_of(4),
            InstanceLevels::Device(resident) => index.bytes_of_faces(resident.end().into()),
            InstanceLevels::Baseline(baselines) => index.bytes_of_faces(baselines.end().into()),
        }
    }

    /// The initial index buffer. If the host executes the splits, the buffer's content is undefined until the first
    /// frame uploads all of it.
    pub fn buffer(&self, gpu: &Gpu, name: &str, index: IndexType) -> Result<Buffer, Error> {
        match self {
            InstanceLevels::Host(_) => gpu.buffer(name, self.bytes(index), self.buffer_use(index)),
            InstanceLevels::Device(resident) => {
                let content = index.packed(resident.content().as_flattened());
                gpu.buffer_with(name, &content, self.buffer_use(index))
            }
            InstanceLevels::Baseline(baselines) => baselines.buffer(gpu, name, index),
        }
    }

    pub fn buffer_use(&self, index: IndexType) -> BufferUse {
        match self {
            InstanceLevels::Host(_) => BufferUse::Indices(index),
            InstanceLevels::Device(_) => BufferUse::WritableIndices(index),
            InstanceLevels::Baseline(baselines) => baselines.buffer_use(index),
        }
    }

    /// Bytes of main memory of the instances' own state, and of their faces.
    pub fn host_bytes(&self) -> [usize; 2] {
        match self {
            InstanceLevels::Host(instances) => [instances.state_bytes(), instances.bytes().len()],
            InstanceLevels::Device(resident) => [resident.state_bytes(), 0],
            InstanceLevels::Baseline(baselines) => [baselines.state_bytes(), baselines.host_bytes()],
        }
    }
}

/// Reports the index buffer's limit as a device limit.
pub fn limit(indices: &str, error: TooMany) -> Error {
    Error::Limit { object: indices.to_owned(), what: error.to_string() }
}
