//! The instances' levels and slices of the index buffer, for each way of execution.

use super::baseline::Baselines;
use super::mapped::Mapped;
use super::resident::Resident;
use super::unfit::Unfit;
use crate::frame::{PerFrame, Slot};
use crate::paper::progressive_mesh::baselines::Baseline;
use crate::paper::progressive_mesh::choices::Apply;
use crate::paper::progressive_mesh::config::ProgressiveSurface;
use crate::paper::progressive_mesh::mesh::ProgressiveMesh;
use crate::paper::progressive_mesh::run::{Index, Instances, Memory, Program};
use crate::vk::{Buffer, BufferUse, Error, Gpu, IndexType};
use std::ops::Range;
use std::sync::Arc;

/// The instances' levels and slices: executed by the host, by the device, or drawn by a baseline.
pub enum Levels {
    Host(Box<dyn Host>),
    /// One copy of all instances for each frame in flight, and the slot of the present frame.
    Mapped(PerFrame<Box<dyn MappedHost>>, Slot),
    Device(Box<Resident>),
    Baseline(Box<Baselines>),
}

/// Instances whose levels the host executes, with indices of either width.
pub trait Host {
    fn go_to(&mut self, instance: usize, level: u32) -> Result<(), Unfit>;
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

/// Instances whose levels the host executes in memory that the device reads.
pub trait MappedHost: Host {
    fn buffer(&mut self) -> &Arc<Buffer>;
    /// To be called before a frame changes levels.
    fn own(&mut self) -> Result<(), Error>;
}

impl<M: Memory> Host for Instances<M>
where
    Unfit: From<M::Error>,
{
    fn go_to(&mut self, instance: usize, level: u32) -> Result<(), Unfit> {
        Ok(Instances::go_to(self, instance, level)?)
    }

    fn level(&self, instance: usize) -> u32 {
        Instances::level(self, instance)
    }

    fn first(&self, instance: usize) -> u32 {
        self.slots(instance).start as u32
    }

    fn faces(&self, instance: usize) -> Vec<[u32; 3]> {
        Instances::faces(self, instance).iter().map(|face| face.map(Index::vertex)).collect()
    }

    fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(self.buffer())
    }

    fn take_touched(&mut self) -> Vec<Range<usize>> {
        let index = size_of::<M::Index>();
        let bytes = |indices: Range<usize>| index * indices.start..index * indices.end;
        Instances::take_touched(self).into_iter().map(bytes).collect()
    }

    fn state_bytes(&self) -> usize {
        Instances::state_bytes(self)
    }
}

impl<I: Index> MappedHost for Instances<Mapped<I>> {
    fn buffer(&mut self) -> &Arc<Buffer> {
        self.memory().buffer()
    }

    fn own(&mut self) -> Result<(), Error> {
        self.memory().own()
    }
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
        let made = || -> Result<Levels, Unfit> {
            if let Some(baseline) = Baseline::of(surface.order) {
                let mut baselines = Baselines::new(gpu, mesh, program, baseline)?;
                (0..count).try_for_each(|_| baselines.push())?;
                return Ok(Levels::Baseline(Box::new(baselines)));
            }
            match surface.apply {
                Apply::Cpu => Ok(Levels::Host(match program.index_type() {
                    IndexType::U16 => Box::new(Instances::within(Vec::<[u16; 3]>::new(), program, count)?),
                    IndexType::U32 => Box::new(Instances::within(Vec::<[u32; 3]>::new(), program, count)?),
                })),
                Apply::Mapped => {
                    let slots = PerFrame::new(|| mapped(gpu, program.clone(), count, indices))?;
                    Ok(Levels::Mapped(slots, Slot::FIRST))
                }
                Apply::Gpu => {
                    let mut resident = Resident::new(gpu, program)?;
                    (0..count).try_for_each(|_| resident.push())?;
                    Ok(Levels::Device(Box::new(resident)))
                }
            }
        };
        made().map_err(|error| error.of(indices))
    }

    /// To be called before a frame changes levels: from now on `slot` is the present one.
    pub fn begin(&mut self, slot: Slot) -> Result<(), Error> {
        let Levels::Mapped(slots, now) = self else { return Ok(()) };
        *now = slot;
        slots[slot].own()
    }

    /// The present slot's index buffer, where each slot has its own.
    pub fn own_buffer(&mut self) -> Option<Arc<Buffer>> {
        match self {
            Levels::Mapped(slots, now) => Some(slots[*now].buffer().clone()),
            _ => None,
        }
    }

    fn host(&self) -> Option<&dyn Host> {
        match self {
            Levels::Host(host) => Some(&**host),
            Levels::Mapped(slots, now) => Some(&*slots[*now]),
            Levels::Device(_) | Levels::Baseline(_) => None,
        }
    }

    pub fn go_to(&mut self, instance: usize, level: u32) -> Result<(), Unfit> {
        match self {
            Levels::Host(instances) => instances.go_to(instance, level),
            Levels::Mapped(slots, now) => slots[*now].go_to(instance, level),
            Levels::Device(resident) => Ok(resident.go_to(instance, level)?),
            Levels::Baseline(baselines) => Ok(baselines.go_to(instance, level)?),
        }
    }

    pub fn level(&self, instance: usize) -> u32 {
        match self {
            Levels::Host(instances) => instances.level(instance),
            Levels::Mapped(slots, now) => slots[*now].level(instance),
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
            Levels::Host(instances) => instances.first(instance),
            Levels::Mapped(slots, now) => slots[*now].first(instance),
            Levels::Device(resident) => resident.first(instance),
            Levels::Baseline(baselines) => baselines.first(instance),
        }
    }

    /// An instance's faces in the order in which they are drawn, if the host knows them.
    pub fn faces(&self, instance: usize) -> Option<Vec<[u32; 3]>> {
        match self {
            Levels::Baseline(baselines) => baselines.faces(instance).map(<[_]>::to_vec),
            _ => Some(self.host()?.faces(instance)),
        }
    }

    /// Bytes of the index buffer.
    pub fn bytes(&self, index: IndexType) -> u64 {
        match self {
            Levels::Host(instances) => (instances.bytes().len() as u64).next_multiple_of(4),
            Levels::Mapped(slots, now) => slots[*now].bytes().len() as u64,
            Levels::Device(resident) => index.bytes_of_faces(resident.end().into()),
            Levels::Baseline(baselines) => index.bytes_of_faces(baselines.end().into()),
        }
    }

    /// The initial index buffer. The host uploads all dirty parts, at first everything.
    pub fn buffer(&mut self, gpu: &Gpu, name: &str, index: IndexType) -> Result<Arc<Buffer>, Error> {
        if let Some(own) = self.own_buffer() {
            return Ok(own);
        }
        Ok(Arc::new(match self {
            Levels::Device(resident) => gpu.buffer_with(
                name,
                &index.packed(resident.content().as_flattened()),
                self.buffer_use(index),
            )?,
            Levels::Baseline(baselines) => baselines.buffer(gpu, name, index)?,
            _ => gpu.buffer(name, self.bytes(index), self.buffer_use(index))?,
        }))
    }

    pub fn buffer_use(&self, index: IndexType) -> BufferUse {
        match self {
            Levels::Host(_) => BufferUse::Indices(index),
            Levels::Mapped(..) => BufferUse::MappedIndices(index),
            Levels::Device(_) => BufferUse::WritableIndices(index),
            Levels::Baseline(baselines) => baselines.buffer_use(index),
        }
    }

    /// Bytes of main memory of the instances' own state, and of their faces.
    pub fn host_bytes(&self) -> [usize; 2] {
        match self {
            Levels::Host(instances) => [instances.state_bytes(), instances.bytes().len()],
            Levels::Mapped(slots, _) => [slots.iter().map(|slot| slot.state_bytes()).sum(), 0],
            Levels::Device(resident) => [resident.state_bytes(), 0],
            Levels::Baseline(baselines) => [baselines.state_bytes(), baselines.host_bytes()],
        }
    }
}

/// All instances at level 0, in their own buffer.
fn mapped(
    gpu: &Gpu,
    program: Arc<Program>,
    count: usize,
    indices: &str,
) -> Result<Box<dyn MappedHost>, Unfit> {
    Ok(match program.index_type() {
        IndexType::U16 => Box::new(Instances::within(Mapped::<u16>::new(gpu, indices)?, program, count)?),
        IndexType::U32 => Box::new(Instances::within(Mapped::<u32>::new(gpu, indices)?, program, count)?),
    })
}
