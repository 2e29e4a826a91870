//! The two widths of indices.

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
