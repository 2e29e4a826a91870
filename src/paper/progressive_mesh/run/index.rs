//! The two widths of indices, and where the faces of instances are kept.

use super::slices::TooMany;
use crate::vk::IndexType;

/// An index as the device reads it.
pub trait Index: bytemuck::Pod + Send + Sync {
    const TYPE: IndexType;

    /// `vertex` must be in range: [`IndexType::of_vertices`] chooses the width.
    fn of(vertex: u32) -> Self;
    fn vertex(self) -> u32;
}

impl Index for u16 {
    const TYPE: IndexType = IndexType::U16;

    fn of(vertex: u32) -> u16 {
        debug_assert!(vertex <= u32::from(u16::MAX), "vertex {vertex}");
        vertex as u16
    }

    fn vertex(self) -> u32 {
        self.into()
    }
}

impl Index for u32 {
    const TYPE: IndexType = IndexType::U32;

    fn of(vertex: u32) -> u32 {
        vertex
    }

    fn vertex(self) -> u32 {
        self
    }
}

/// Memory for the faces of instances.
pub trait Memory {
    type Index: Index;
    type Error: From<TooMany>;

    fn faces(&self) -> &[[Self::Index; 3]];
    fn faces_mut(&mut self) -> &mut [[Self::Index; 3]];

    /// Makes room for at least `faces` faces, and keeps the present ones.
    ///
    /// # Errors
    /// Out of memory.
    fn grow(&mut self, faces: usize) -> Result<(), Self::Error>;
}

impl<I: Index> Memory for Vec<[I; 3]> {
    type Index = I;
    type Error = TooMany;

    fn faces(&self) -> &[[I; 3]] {
        self
    }

    fn faces_mut(&mut self) -> &mut [[I; 3]] {
        self
    }

    fn grow(&mut self, faces: usize) -> Result<(), TooMany> {
        self.resize(faces.max(self.len()), [I::of(0); 3]);
        Ok(())
    }
}
