//! Paper 1: super-large textures; the visible tiles are found wholly on the GPU.

pub mod streaming;
