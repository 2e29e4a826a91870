//! Triangles that several passes draw: the interface between geometry and texture techniques.
//!
//! A vertex stores its position and its texture coordinate in two parts each ([`MeshVertex`]), because a
//! single f32 is too coarse at the scale of the earth. A world-space mesh is drawn once. Instances of an
//! object share buffers; each has its own placement, passed to the same vertex shader as push constants.

use super::View;
use crate::math::camera::Pose;
use crate::model::mesh::{Cluster, Mesh, MeshPosition, MeshVertex};
use crate::vk::shader::common::{depth_vert, lit_mesh_vert, mesh_vert};
use crate::vk::shader::{VertexFormat, View as ViewConstants};
use crate::vk::{
    Buffer, BufferUse, Clear, Gpu, GraphicsPipeline, IndexRange, IndexType, IndexedGeometry, Render,
    Resource, Result,
};
use glam::{DMat3, DMat4, DVec3};
use std::mem::offset_of;
use std::sync::Arc;

/// Vertex and index buffers, and the draws that use them.
#[derive(Clone)]
pub struct Shape {
    /// [`MeshVertex`]
    pub vertices: Arc<Buffer>,
    pub indices: Arc<Buffer>,
    /// One unit vector for each vertex, in object space. With normals, the shape is lit.
    pub normals: Option<Arc<Buffer>>,
    /// Buffers for depth-only passes; only for shapes in world space.
    pub depth_alone: Option<Arc<DepthOnlyMesh>>,
    pub draws: Vec<Draw>,
    /// As [`Mesh::curvature`].
    pub curvature: f64,
}

/// A world-space mesh with positions only; triangles in the same order.
pub struct DepthOnlyMesh {
    pub vertices: Buffer,
    pub indices: Buffer,
    pub clusters: Vec<Cluster>,
}

/// A range of the index buffer and its placement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Draw {
    /// Positions are in world metres; draws all indices.
    World { indices: u32 },
    /// Positions are in object units, relative to `centre` (world metres). The columns of `axes` are the object's axes
    /// in world metres per object unit.
    Object { centre: DVec3, axes: DMat3, first_index: u32, indices: u32 },
}

/// What a pass does with the target's previous colour and depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Onto {
    /// Clears both first; the colour to this linear light.
    Cleared([f32; 3]),
    /// Keeps what earlier passes of the frame drew, including its depth.
    Drawn,
}

impl Onto {
    /// The clear operation of the colour target.
    pub fn clear(self) -> Clear {
        match self {
            Onto::Cleared([r, g, b]) => Clear::Float([r, g, b, 1.0]),
            Onto::Drawn => Clear::Keep,
        }
    }
}

/// Shapes with the push constants of each draw for one frame.
pub struct DrawList<'a> {
    pub view: View,
    /// Levels added to the texture level of detail.
    pub level_bias: u32,
    pub onto: Onto,
    shapes: Vec<(&'a Shape, Vec<IndexRange<ViewConstants>>)>,
}

impl Shape {
    /// # Errors
    /// Out of memory, device lost.
    pub fn new(gpu: &Gpu, mesh: &Mesh) -> Result<Shape> {
        // Tightly packed in the order of the shader's locations; the struct must have the same layout.
        let layout = [
            (VertexFormat::Float3, offset_of!(MeshVertex, position_high)),
            (VertexFormat::Float3, offset_of!(MeshVertex, position_low)),
            (VertexFormat::Uint2, offset_of!(MeshVertex, origin)),
            (VertexFormat::Float2, offset_of!(MeshVertex, offset)),
        ];
        for shader in [&mesh_vert::SHADER, &lit_mesh_vert::SHADER] {
            let read: Vec<_> = shader.inputs.iter().map(|(_, format)| *format).collect();
            assert_eq!(read, layout.map(|(format, _)| format), "{}: inputs", shader.name);
        }
        assert_eq!(layout.map(|(_, offset)| offset), [0, 12, 24, 32], "MeshVertex's members");
        gpu.require_indices("mesh vertices", mesh.vertices.len())?;
        let indices = u32::try_from(mesh.indices.len()).expect("a mesh has fewer than 2^32 indices");
        Ok(Shape {
            vertices: Arc::new(gpu.buffer_with("mesh vertices", &mesh.vertices, BufferUse::Vertices)?),
            indices: Arc::new(gpu.buffer_with(
                "mesh indices",
                &mesh.indices,
                BufferUse::Indices(IndexType::U32),
            )?),
            normals: None,
            depth_alone: None,
            draws: vec![Draw::World { indices }],
            curvature: mesh.curvature,
        })
    }

    /// Like [`Shape::new`], with buffers for depth-only passes.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn with_depth_alone(gpu: &Gpu, mesh: &Mesh) -> Result<Shape> {
        let read: Vec<_> = depth_vert::SHADER.inputs.iter().map(|(_, format)| *format).collect();
        assert_eq!(read, [VertexFormat::Float3; 2], "depth.vert's inputs");
        assert_eq!([offset_of!(MeshPosition, high), offset_of!(MeshPosition, low)], [0, 12]);
        let (positions, indices) = mesh.positions();
        let depth_alone = DepthOnlyMesh {
            vertices: gpu.buffer_with("mesh positions", &positions, BufferUse::Vertices)?,
            indices: gpu.buffer_with(
                "mesh position indices",
                &indices,
                BufferUse::Indices(IndexType::U32),
            )?,
            clusters: mesh.clusters(),
        };
        Ok(Shape { depth_alone: Some(Arc::new(depth_alone)), ..Shape::new(gpu, mesh)? })
    }

    /// The same shape, lit by the sun.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn lit(self, gpu: &Gpu, mesh: &Mesh) -> Result<Shape> {
        let normals = gpu.buffer_with("mesh normals", &mesh.normals(), BufferUse::Storage)?;
        Ok(Shape { normals: Some(Arc::new(normals)), ..self })
    }

    /// Bytes of video memory.
    pub fn bytes(&self) -> u64 {
        let depth_alone = self.depth_alone.iter().flat_map(|alone| [&alone.vertices, &alone.indices]);
        let own = [&*self.vertices, &*self.indices].into_iter().chain(self.normals.as_deref());
        own.chain(depth_alone).map(Buffer::bytes).sum()
    }
}

/// Push constants for positions in world metres.
pub fn world_view(pose: &Pose, size: [u32; 2], level_bias: u32) -> ViewConstants {
    let eye_high = pose.eye.as_vec3();
    ViewConstants {
        eye_to_clip: pose.world_to_clip(size[0], size[1]).as_mat4().to_cols_array_2d(),
        eye_high: eye_high.to_array(),
        eye_low: (pose.eye - eye_high.as_dvec3()).as_vec3().to_array(),
        level_bias,
        noise: 0,
        sun: [0.0; 3],
        limb: 0.0,
    }
}

impl Draw {
    fn slice(&self, view: &View, level_bias: u32, sun: DVec3, curvature: f64) -> IndexRange<ViewConstants> {
        let View { pose, size, noise, .. } = *view;
        let world = ViewConstants { noise: noise as u32, ..world_view(&pose, size, level_bias) };
        match *self {
            Draw::World { indices } => {
                let limb = (pose.pixel_tangent(size[1]) * curvature) as f32;
                let push = ViewConstants { sun: sun.as_vec3().to_array(), limb, ..world };
                IndexRange { push, first_index: 0, count: indices }
            }
            Draw::Object { centre, axes, first_index, indices } => {
                // Subtract the eye here, in f64. The difference is small near the eye and fits f32.
                let to_eye = DMat4::from_translation(centre - pose.eye) * DMat4::from_mat3(axes);
                let to_clip = (pose.world_to_clip(size[0], size[1]) * to_eye).as_mat4();
                let push = ViewConstants {
                    eye_to_clip: to_clip.to_cols_array_2d(),
                    eye_high: [0.0; 3],
                    eye_low: [0.0; 3],
                    // The axes are orthogonal and of equal length.
                    sun: (axes.transpose() * sun).normalize_or_zero().as_vec3().to_array(),
                    ..world
                };
                IndexRange { push, first_index, count: indices }
            }
        }
    }
}

impl<'a> DrawList<'a> {
    /// `shapes` in an otherwise empty frame, unlit, on black.
    pub fn new(shapes: impl IntoIterator<Item = &'a Shape>, view: View, level_bias: u32) -> DrawList<'a> {
        DrawList::lit(shapes, view, level_bias, DVec3::ZERO)
    }

    /// Like [`DrawList::new`]; `sun` is the unit vector towards the sun in world space, and lights shapes with normals.
    pub fn lit(
        shapes: impl IntoIterator<Item = &'a Shape>,
        view: View,
        level_bias: u32,
        sun: DVec3,
    ) -> DrawList<'a> {
        let slices = |shape: &'a Shape| {
            (
                shape,
                shape.draws.iter().map(|draw| draw.slice(&view, level_bias, sun, shape.curvature)).collect(),
            )
        };
        let shapes = shapes.into_iter().map(slices).collect();
        DrawList { view, level_bias, onto: Onto::Cleared([0.0; 3]), shapes }
    }

    /// The same list, with another treatment of the target's previous content.
    pub fn onto(self, onto: Onto) -> DrawList<'a> {
        DrawList { onto, ..self }
    }

    /// Draws every shape with the pipeline that `pipeline` returns for it.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw<'p>(
        &self,
        render: &mut Render<'_, '_>,
        resources: &[(u32, Resource<'_>)],
        pipeline: impl Fn(&Shape) -> &'p GraphicsPipeline,
    ) -> Result<()> {
        for (shape, slices) in &self.shapes {
            let normals = shape.normals.iter();
            let normals = normals.map(|normals| (lit_mesh_vert::NORMALS, Resource::Buffer(normals)));
            let resources: Vec<_> = resources.iter().copied().chain(normals).collect();
            let geometry = IndexedGeometry { vertices: Some(&shape.vertices), indices: &shape.indices };
            render.draw_slices(pipeline(shape), &resources, geometry, slices)?;
        }
        Ok(())
    }

    /// Each shape with its draws.
    pub fn shapes(&self) -> impl Iterator<Item = (&'a Shape, &[IndexRange<ViewConstants>])> {
        self.shapes.iter().map(|(shape, slices)| (*shape, &**slices))
    }
}
