//! The mesh in video memory, and the camera as its vertex shader wants it.

use crate::math::camera::Pose;
use crate::model::mesh::{Cluster, Mesh, MeshPosition, MeshVertex};
use crate::vk::shader::virtual_texture::{depth_vert, mesh_vert};
use crate::vk::shader::{VertexFormat, View};
use crate::vk::{Buffer, BufferUse, Gpu, Result};
use std::mem::offset_of;

pub struct Surface {
    pub(super) vertices: Buffer,
    pub(super) indices: Buffer,
    /// Where a pass draws depth alone.
    pub(super) positions: Option<Positions>,
}

/// The mesh as positions alone, its triangles in the same order.
pub(super) struct Positions {
    pub(super) vertices: Buffer,
    pub(super) indices: Buffer,
    pub(super) clusters: Vec<Cluster>,
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
            positions: None,
        })
    }

    /// As [`Surface::new`], and what it takes to draw depth alone.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn with_positions(gpu: &Gpu, mesh: &Mesh) -> Result<Surface> {
        let read: Vec<_> = depth_vert::SHADER.inputs.iter().map(|(_, format)| *format).collect();
        assert_eq!(read, [VertexFormat::Float3; 2], "depth.vert's inputs");
        assert_eq!([offset_of!(MeshPosition, high), offset_of!(MeshPosition, low)], [0, 12]);
        let (positions, indices) = mesh.positions();
        let positions = Positions {
            vertices: gpu.buffer_with("mesh positions", &positions, BufferUse::Vertices)?,
            indices: gpu.buffer_with("mesh position indices", &indices, BufferUse::Indices)?,
            clusters: mesh.clusters(),
        };
        Ok(Surface { positions: Some(positions), ..Surface::new(gpu, mesh)? })
    }

    /// Bytes in video memory.
    pub fn bytes(&self) -> u64 {
        let positions = self.positions.iter().flat_map(|positions| [&positions.vertices, &positions.indices]);
        [&self.vertices, &self.indices].into_iter().chain(positions).map(Buffer::bytes).sum()
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
