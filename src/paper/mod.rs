//! The papers, one folder each. The code in a folder uses no other folder's code.

pub mod progressive_mesh;
pub mod texture_mapping;
pub mod virtual_texture;
