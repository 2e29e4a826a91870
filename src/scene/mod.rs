//! What is to be seen: scene files, cameras and paths, meshes, and where a texture's tiles come from.

pub mod bake;
pub mod source;
pub mod tiles;
