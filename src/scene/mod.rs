//! What is to be seen: scene files, cameras and paths, meshes, and where a texture's tiles come from.

pub mod camera;
pub mod mesh;
pub mod path;
pub mod source;
pub mod tiles;
