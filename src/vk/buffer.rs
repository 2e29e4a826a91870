//! Buffers.

use super::device::{Dead, Device};
use super::{Check, Gpu, Result};
use ash::vk::{self, Handle};
use bytemuck::AnyBitPattern;
use gpu_allocator::{MemoryLocation, vulkan::Allocation};
use std::ops::{Deref, DerefMut};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::SeqCst};

/// The purpose of a buffer. It determines the usage flags and the memory location.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BufferUse {
    Vertices,
    Indices(IndexType),
    /// Indices that shaders write and copies read.
    WritableIndices(IndexType),
    /// Mapped indices: written by the host, read by the GPU in place.
    MappedIndices(IndexType),
    /// Mapped vertices: written by the host, read by the GPU in place.
    MappedVertices,
    /// Transform-feedback output, or its counter; copies can read it.
    TransformFeedback,
    Storage,
    /// Words that shaders access as a storage buffer, and as texels with atomics.
    FetchedStorage,
    /// Read-only table of 32-bit words that shaders fetch as texels. Software drivers fetch the texels of a
    /// whole vector of pixels at once, but read a storage buffer pixel by pixel.
    Texels,
    /// Mapped, written by the host, read by copies.
    Upload,
    /// Mapped, written by copies, read by the host.
    Readback,
}

/// The width of the indices in an index buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IndexType {
    U16,
    U32,
}

impl IndexType {
    /// The type for meshes of this many vertices: 16 bits below 65,536.
    pub fn of_vertices(vertices: usize) -> IndexType {
        if vertices < 1 << 16 { IndexType::U16 } else { IndexType::U32 }
    }

    /// Bytes of an index.
    pub const fn bytes(self) -> u64 {
        match self {
            IndexType::U16 => 2,
            IndexType::U32 => 4,
        }
    }

    /// Bytes of a triangle's indices.
    pub const fn triangle_bytes(self) -> u64 {
        3 * self.bytes()
    }

    /// Bytes of `faces` faces, rounded up to whole words, because shaders read indices by words.
    pub fn bytes_of_faces(self, faces: u64) -> u64 {
        (self.triangle_bytes() * faces).next_multiple_of(4)
    }

    /// The bytes of an index buffer of this type.
    pub fn packed(self, indices: &[u32]) -> Vec<u8> {
        match self {
            IndexType::U16 => indices.iter().flat_map(|&index| (index as u16).to_ne_bytes()).collect(),
            IndexType::U32 => bytemuck::cast_slice(indices).to_vec(),
        }
    }

    /// The specialization constant of shaders that address indices.
    pub fn constant(self) -> (&'static str, u32) {
        ("INDICES_PER_WORD", 4 / self.bytes() as u32)
    }

    pub(crate) fn raw(self) -> vk::IndexType {
        match self {
            IndexType::U16 => vk::IndexType::UINT16,
            IndexType::U32 => vk::IndexType::UINT32,
        }
    }
}

impl BufferUse {
    fn index_type(self) -> Option<IndexType> {
        match self {
            BufferUse::Indices(of) | BufferUse::WritableIndices(of) | BufferUse::MappedIndices(of) => {
                Some(of)
            }
            _ => None,
        }
    }

    /// What the buffer is for, in words.
    pub(super) fn about(self) -> &'static str {
        match self {
            BufferUse::Vertices | BufferUse::MappedVertices => "vertices",
            BufferUse::Indices(of) | BufferUse::WritableIndices(of) | BufferUse::MappedIndices(of) => {
                match of {
                    IndexType::U16 => "u16 indices",
                    IndexType::U32 => "u32 indices",
                }
            }
            BufferUse::TransformFeedback => "transform feedback",
            BufferUse::Storage => "storage",
            BufferUse::FetchedStorage | BufferUse::Texels => "u32",
            BufferUse::Upload => "upload",
            BufferUse::Readback => "read-back",
        }
    }

    /// Usage flags and memory location.
    fn flags(self) -> (vk::BufferUsageFlags, MemoryLocation) {
        use vk::BufferUsageFlags as U;
        match self {
            BufferUse::Vertices => {
                (U::VERTEX_BUFFER | U::STORAGE_BUFFER | U::TRANSFER_DST, MemoryLocation::GpuOnly)
            }
            // Shaders also read index buffers as storage, even those that are written only by copy commands.
            BufferUse::Indices(_) | BufferUse::WritableIndices(_) => (
                U::INDEX_BUFFER | U::STORAGE_BUFFER | U::TRANSFER_SRC | U::TRANSFER_DST,
                MemoryLocation::GpuOnly,
            ),
            BufferUse::MappedIndices(_) => (U::INDEX_BUFFER | U::STORAGE_BUFFER, MemoryLocation::CpuToGpu),
            BufferUse::MappedVertices => (U::VERTEX_BUFFER, MemoryLocation::CpuToGpu),
            BufferUse::TransformFeedback => (
                U::TRANSFORM_FEEDBACK_BUFFER_EXT
                    | U::TRANSFORM_FEEDBACK_COUNTER_BUFFER_EXT
                    | U::TRANSFER_SRC
                    | U::TRANSFER_DST,
                MemoryLocation::GpuOnly,
            ),
            BufferUse::Storage => {
                (U::STORAGE_BUFFER | U::TRANSFER_SRC | U::TRANSFER_DST, MemoryLocation::GpuOnly)
            }
            BufferUse::FetchedStorage => (
                U::STORAGE_BUFFER | U::STORAGE_TEXEL_BUFFER | U::TRANSFER_SRC | U::TRANSFER_DST,
                MemoryLocation::GpuOnly,
            ),
            BufferUse::Texels => {
                (U::UNIFORM_TEXEL_BUFFER | U::TRANSFER_SRC | U::TRANSFER_DST, MemoryLocation::GpuOnly)
            }
            // In the host's memory. `CpuToGpu` may be the part of video memory that the host can write.
            BufferUse::Upload => (U::TRANSFER_SRC, MemoryLocation::GpuToCpu),
            BufferUse::Readback => (U::TRANSFER_DST, MemoryLocation::GpuToCpu),
        }
    }
}

/// A buffer with its memory. After a drop it is destroyed once the GPU no longer uses it.
pub struct Buffer {
    handle: vk::Buffer,
    /// Null except for [`BufferUse::Texels`] and [`BufferUse::FetchedStorage`].
    pub(crate) texels: vk::BufferView,
    device: Arc<Device>,
    memory: Option<Allocation>,
    bytes: u64,
    usage: BufferUse,
    name: String,
    /// `None` unless the buffer is mapped.
    uses: Option<Arc<Uses>>,
}

/// Uses of a mapped buffer's memory by the host and by the device. They never overlap.
#[derive(Default)]
pub(super) struct Uses {
    name: String,
    /// Number of views that the host has open.
    views: AtomicUsize,
    /// The timeline's value once the device has finished; [`SUBMITTING`] just before a submission.
    device: AtomicU64,
    /// The value before that submission.
    before: AtomicU64,
}

const SUBMITTING: u64 = u64::MAX;

/// The memory of a mapped buffer as values that the host reads.
pub struct MappedValues<'a, T> {
    values: &'a [T],
    uses: &'a Uses,
}

/// The memory of a mapped buffer that the host writes.
pub struct MappedMut<'a> {
    bytes: &'a mut [u8],
    uses: &'a Uses,
}

/// A rectangle of one level and layer of an image, tightly packed in a buffer from `offset`.
#[derive(Clone, Copy, Debug)]
pub struct TexelCopy {
    pub offset: u64,
    pub mip: u32,
    pub layer: u32,
    /// First column and row.
    pub at: [u32; 2],
    pub size: [u32; 2],
}

impl Gpu {
    /// # Errors
    /// [`super::Error::OutOfMemory`] and [`super::Error::Limit`] name the buffer and its bytes.
    pub fn buffer(&self, name: &str, bytes: u64, usage: BufferUse) -> Result<Buffer> {
        let (flags, location) = usage.flags();
        self.require_buffer(name, bytes, usage)?;
        let device = &self.device;
        // Vulkan has no empty buffers.
        let info = vk::BufferCreateInfo::default().size(bytes.max(4)).usage(flags);
        // SAFETY: the device lives; memory is bound before the wrapper is returned.
        let handle = unsafe { device.handle.create_buffer(&info, None) }.check("vkCreateBuffer", name)?;
        let texels = vk::BufferView::null();
        let mut buffer = Buffer {
            handle,
            texels,
            device: device.clone(),
            memory: None,
            bytes,
            usage,
            name: name.into(),
            uses: (location != MemoryLocation::GpuOnly)
                .then(|| Arc::new(Uses { name: name.into(), ..Uses::default() })),
        };
        // SAFETY: as above.
        let requirements = unsafe { device.handle.get_buffer_memory_requirements(handle) };
        let memory = buffer.memory.insert(device.allocate(name, requirements, location, true)?);
        // SAFETY: the allocation fits the requirements and is bound once.
        unsafe { device.handle.bind_buffer_memory(handle, memory.memory(), memory.offset()) }
            .check("vkBindBufferMemory", name)?;
        if matches!(usage, BufferUse::Texels | BufferUse::FetchedStorage) {
            let view = vk::BufferViewCreateInfo::default()
                .buffer(handle)
                .format(vk::Format::R32_UINT)
                .range(vk::WHOLE_SIZE);
            // SAFETY: the buffer has its memory.
            buffer.texels =
                unsafe { device.handle.create_buffer_view(&view, None) }.check("vkCreateBufferView", name)?;
            device.name(buffer.texels, name);
        }
        device.name(handle, name);
        Ok(buffer)
    }

    /// A device-local buffer that already holds `data`. Waits for the copy.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn buffer_with<T: bytemuck::Pod>(&self, name: &str, data: &[T], usage: BufferUse) -> Result<Buffer> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        // Shaders read indices by words.
        let unit = if usage.index_type().is_some() { 4 } else { 1 };
        let buffer = self.buffer(name, (bytes.len() as u64).next_multiple_of(unit), usage)?;
        if bytes.is_empty() {
            return Ok(buffer);
        }
        let mut staging = self.buffer("staging", bytes.len() as u64, BufferUse::Upload)?;
        staging.mapped_mut()[..bytes.len()].copy_from_slice(bytes);
        self.run_pass("upload", |cmd| cmd.copy_buffer(&staging, 0, &buffer, 0, bytes.len() as u64))?;
        Ok(buffer)
    }

    /// The values of a buffer. Waits for all earlier frames.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn read_buffer<T: AnyBitPattern>(&self, buffer: &Buffer) -> Result<Vec<T>> {
        let host = self.buffer("read-back", buffer.bytes, BufferUse::Readback)?;
        self.run_pass("read-back", |cmd| cmd.copy_buffer(buffer, 0, &host, 0, buffer.bytes))?;
        Ok(host.mapped().to_vec())
    }
}

impl Buffer {
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn usage(&self) -> BufferUse {
        self.usage
    }

    pub(super) fn raw(&self) -> u64 {
        self.handle.as_raw()
    }

    /// # Panics
    /// If it is not an index buffer.
    pub fn index_type(&self) -> IndexType {
        self.usage.index_type().unwrap_or_else(|| panic!("{} holds no indices", self.name))
    }

    /// The memory of a mapped buffer.
    ///
    /// # Panics
    /// If a submitted frame uses the buffer and nobody has waited for it (see [`super::Ticket::wait`]). A frame that
    /// uses the buffer cannot be submitted before the view is dropped.
    pub fn mapped<T: AnyBitPattern>(&self) -> MappedValues<'_, T> {
        let uses = self.host_uses();
        let bytes = self.memory.as_ref().and_then(Allocation::mapped_slice).expect("host memory is mapped");
        MappedValues { values: bytemuck::cast_slice(&bytes[..self.bytes as usize]), uses }
    }

    /// Like [`Buffer::mapped`], for writing.
    pub fn mapped_mut(&mut self) -> MappedMut<'_> {
        self.host_uses();
        let bytes =
            self.memory.as_mut().and_then(Allocation::mapped_slice_mut).expect("host memory is mapped");
        let uses = self.uses.as_ref().expect("checked above");
        MappedMut { bytes: &mut bytes[..self.bytes as usize], uses }
    }

    /// Counts a new view by the host. Panics if a submitted frame may still use the buffer.
    fn host_uses(&self) -> &Uses {
        let uses = self.uses.as_ref().unwrap_or_else(|| panic!("{} is not mapped", self.name));
        uses.views.fetch_add(1, SeqCst);
        let (device, waited) = (uses.device.load(SeqCst), self.device.waited.load(SeqCst));
        assert!(device <= waited, "{}: a submitted frame uses it; wait for the frame's ticket", self.name);
        uses
    }

    /// The handle, for a command of a frame. A mapped buffer is added to `mapped`, the frame's list of such buffers.
    pub(super) fn for_frame(&self, mapped: &mut Vec<Arc<Uses>>) -> vk::Buffer {
        mapped.extend(self.uses.clone());
        self.handle
    }
}

impl Uses {
    /// Called before each submission of a frame that uses the buffer.
    pub(super) fn require_no_view(&self) {
        let before = self.device.swap(SUBMITTING, SeqCst);
        // A frame lists a buffer once for each of its commands.
        if before != SUBMITTING {
            self.before.store(before, SeqCst);
        }
        let views = self.views.load(SeqCst);
        assert!(views == 0, "{}: the host still views it when a frame that uses it is submitted", self.name);
    }

    /// Called for a frame that was not submitted; `submitted` is the timeline's value for the last submitted frame. If
    /// the submission failed, the device does not use the buffer.
    pub(super) fn withdraw(&self, submitted: u64) {
        if self.device.load(SeqCst) > submitted {
            self.device.store(self.before.load(SeqCst), SeqCst);
        }
    }

    /// The submission that signals `value` uses the buffer.
    pub(super) fn submit(&self, value: u64) {
        self.device.store(value, SeqCst);
    }
}

impl<T> Deref for MappedValues<'_, T> {
    type Target = [T];
    fn deref(&self) -> &[T] {
        self.values
    }
}

impl<T> Drop for MappedValues<'_, T> {
    fn drop(&mut self) {
        self.uses.views.fetch_sub(1, SeqCst);
    }
}

impl Deref for MappedMut<'_> {
    type Target = [u8];
    fn deref(&self) -> &[u8] {
        self.bytes
    }
}

impl DerefMut for MappedMut<'_> {
    fn deref_mut(&mut self) -> &mut [u8] {
        self.bytes
    }
}

impl Drop for MappedMut<'_> {
    fn drop(&mut self) {
        self.uses.views.fetch_sub(1, SeqCst);
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        self.device.bury(Dead::Buffer(self.handle, self.texels, self.memory.take()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vk::GpuOptions;

    #[test]
    fn the_host_can_view_a_buffer_after_a_failed_submission() {
        let gpu = Gpu::new(&GpuOptions::default()).unwrap();
        let mut from = gpu.buffer("from", 4, BufferUse::Upload).unwrap();
        let to = gpu.buffer("to", 4, BufferUse::Readback).unwrap();
        from.mapped_mut().copy_from_slice(&[1, 2, 3, 4]);
        let mut frame = gpu.frame().unwrap();
        let copy = |cmd: &mut crate::vk::Cmd<'_>| {
            cmd.copy_buffer(&from, 0, &to, 0, 2);
            cmd.copy_buffer(&from, 2, &to, 2, 2);
            Ok(())
        };
        frame.pass("copy", copy).unwrap();
        // What a submission does before the driver refuses it.
        let uses = to.uses.as_ref().unwrap();
        [(); 2].iter().for_each(|()| uses.require_no_view());
        drop(frame);
        assert_eq!(to.mapped::<u8>().len(), 4);
        gpu.run_pass("copy", copy).unwrap();
        assert_eq!(to.mapped::<u8>()[..], [1, 2, 3, 4]);
    }
}
