//! The mesh in video memory, and the camera as its vertex shader wants it.

use crate::math::camera::Pose;
use crate::scene::mesh::{Mesh, MeshVertex};
use crate::vk::shader::{View, virtual_texture::mesh_vert};
use crate::vk::{Buffer, BufferUse, Gpu, Result};

pub struct Surface {
    pub(super) vertices: Buffer,
    pub(super) indices: Buffer,
}

impl Surface {
    /// # Errors
    /// Out of memory, device lost.
    pub fn new(gpu: &Gpu, mesh: &Mesh) -> Result<Surface> {
        let floats = mesh_vert::SHADER.inputs.len();
        assert_eq!((floats, size_of::<MeshVertex>()), (4, 40), "MeshVertex is what mesh.vert reads");
        Ok(Surface {
            vertices: gpu.buffer_with("mesh vertices", &mesh.vertices, BufferUse::Vertices)?,
            indices: gpu.buffer_with("mesh indices", &mesh.indices, BufferUse::Indices)?,
        })
    }

    /// Bytes in video memory.
    pub fn bytes(&self) -> u64 {
        self.vertices.bytes() + self.indices.bytes()
    }
}

/// The push constants of every pass that draws the mesh.
pub fn view(pose: &Pose, size: [u32; 2], level_bias: u32) -> View {
    let eye_high = pose.eye.as_vec3();
    View {
        eye_to_clip: pose.world_to_clip(size[0], size[1]).as_mat4().to_cols_array_2d(),
        eye_high: eye_high.to_array(),
        eye_low: (pose.eye - eye_high.as_dvec3()).as_vec3().to_array(),
        level_bias,
    }
}
