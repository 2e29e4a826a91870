//! An index buffer in memory that the device reads where the host writes it.

use super::unfit::Unfit;
use crate::paper::progressive_mesh::run::{Index, Memory};
use crate::vk::{Buffer, BufferUse, Gpu, Result};
use std::marker::PhantomData;
use std::sync::Arc;

/// Faces of one frame in flight.
pub struct Mapped<I> {
    gpu: Gpu,
    buffer: Arc<Buffer>,
    index: PhantomData<I>,
}

impl<I: Index> Mapped<I> {
    /// # Errors
    /// Out of memory.
    pub fn new(gpu: &Gpu, name: &str) -> Result<Mapped<I>> {
        let buffer = Arc::new(gpu.buffer(name, 0, BufferUse::MappedIndices(I::TYPE))?);
        Ok(Mapped { gpu: gpu.clone(), buffer, index: PhantomData })
    }

    pub fn buffer(&self) -> &Arc<Buffer> {
        &self.buffer
    }

    /// Makes the buffer safe to write. Call it after the last frame that read the buffer has ended. If another owner
    /// still holds the buffer, a copy replaces it.
    ///
    /// # Errors
    /// Out of memory.
    pub fn own(&mut self) -> Result<()> {
        if Arc::get_mut(&mut self.buffer).is_none() {
            self.replace(self.buffer.bytes())?;
        }
        Ok(())
    }

    fn replace(&mut self, bytes: u64) -> Result<()> {
        let mut buffer = self.gpu.buffer(self.buffer.name(), bytes, BufferUse::MappedIndices(I::TYPE))?;
        buffer.mapped_mut()[..self.buffer.bytes() as usize].copy_from_slice(self.buffer.mapped());
        self.buffer = Arc::new(buffer);
        Ok(())
    }
}

impl<I: Index> Memory for Mapped<I> {
    type Index = I;
    type Error = Unfit;

    fn faces(&self) -> &[[I; 3]] {
        let bytes = self.buffer.mapped();
        bytemuck::cast_slice(&bytes[..bytes.len() / size_of::<[I; 3]>() * size_of::<[I; 3]>()])
    }

    /// # Panics
    /// If the buffer is shared: [`Mapped::own`] comes first.
    fn faces_mut(&mut self) -> &mut [[I; 3]] {
        let bytes = Arc::get_mut(&mut self.buffer).expect("its own buffer").mapped_mut();
        let whole = bytes.len() / size_of::<[I; 3]>() * size_of::<[I; 3]>();
        bytemuck::cast_slice_mut(&mut bytes[..whole])
    }

    /// Grows the buffer by at least half, so that it seldom has to grow.
    fn grow(&mut self, faces: usize) -> std::result::Result<(), Unfit> {
        let bytes = I::TYPE.bytes_of_faces(faces as u64);
        if bytes > self.buffer.bytes() {
            self.replace(bytes.max(self.buffer.bytes() / 8 * 12))?;
        }
        Ok(())
    }
}
