//! The mesh in video memory, and the camera as its vertex shader wants it.

use crate::math::camera::Pose;
use crate::scene::mesh::{Mesh, MeshVertex};
use crate::vk::shader::{VertexFormat, View, virtual_texture::mesh_vert};
use crate::vk::{Buffer, BufferUse, Gpu, Result};
use std::mem::offset_of;

pub struct Surface {
    pub(super) vertices: Buffer,
    pub(super) indices: Buffer,
}

impl Surface {
    /// # Errors
    /// Out of memory, device lost.
    pub fn new(gpu: &Gpu, mesh: &Mesh) -> Result<Surface> {
        // Tightly packed in the order of the shader's locations: the struct must lie so too.
        let layout = [
            (VertexFormat::Float3, offset_of!(MeshVertex, position_high)),
            (VertexFormat::Float3, offset_of!(MeshVertex, position_low)),
            (VertexFormat::Uint2, offset_of!(MeshVertex, origin)),
            (VertexFormat::Float2, offset_of!(MeshVertex, offset)),
        ];
        let read: Vec<_> = mesh_vert::SHADER.inputs.iter().map(|(_, format)| *format).collect();
        assert_eq!(read, layout.map(|(format, _)| format), "mesh.vert's inputs");
        assert_eq!(layout.map(|(_, offset)| offset), [0, 12, 24, 32], "MeshVertex's members");
        gpu.require_indices("mesh vertices", mesh.vertices.len())?;
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

/// The push constants of every pass that draws the mesh; the frame's number, which only noise needs, is 0.
pub fn view(pose: &Pose, size: [u32; 2], level_bias: u32) -> View {
    let eye_high = pose.eye.as_vec3();
    View {
        eye_to_clip: pose.world_to_clip(size[0], size[1]).as_mat4().to_cols_array_2d(),
        eye_high: eye_high.to_array(),
        eye_low: (pose.eye - eye_high.as_dvec3()).as_vec3().to_array(),
        level_bias,
        frame: 0,
    }
}
