//! The papers, one folder each; none names another.

pub mod progressive_mesh;
pub mod texture_mapping;
pub mod virtual_texture;
