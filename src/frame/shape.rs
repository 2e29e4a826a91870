//! Triangles that several passes draw, of whichever technique: what a geometry hands to a texture.
//!
//! A vertex carries its position and its texture coordinate in two parts each ([`MeshVertex`]), because one f32 holds
//! neither on the earth. A mesh in the world is drawn once; instances of an object share buffers and have a placement
//! each, whose push constants make the same vertex shader do.

use super::View;
use crate::math::camera::Pose;
use crate::model::mesh::{Cluster, Mesh, MeshPosition, MeshVertex};
use crate::vk::shader::common::{depth_vert, lit_mesh_vert, mesh_vert};
use crate::vk::shader::{VertexFormat, View as ViewConstants};
use crate::vk::{Buffer, BufferUse, Clear, Geometry, Gpu, GraphicsPipeline, Render, Resource, Result, Slice};
use glam::{DMat3, DMat4, DVec3};
use std::mem::offset_of;
use std::sync::Arc;

/// Buffers, and what of them is drawn where.
#[derive(Clone)]
pub struct Shape {
    /// [`MeshVertex`]
    pub vertices: Arc<Buffer>,
    pub indices: Arc<Buffer>,
    /// A unit vector for each vertex, along the object's axes: the shape is lit.
    pub normals: Option<Arc<Buffer>>,
    /// Where a pass draws depth alone, and the shape stands in the world.
    pub depth_alone: Option<Arc<DepthAlone>>,
    pub draws: Vec<Draw>,
}

/// A mesh in the world as positions alone, its triangles in the same order.
pub struct DepthAlone {
    pub vertices: Buffer,
    pub indices: Buffer,
    pub clusters: Vec<Cluster>,
}

/// A part of the index buffer, and where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Draw {
    /// Positions are world metres; all indices.
    World { indices: u32 },
    /// Positions are relative to `centre` (world metres), along `axes` (world metres for each object unit).
    Object { centre: DVec3, axes: DMat3, first_index: u32, indices: u32 },
}

/// What is in the target and in its depth before a pass draws there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Onto {
    /// Nothing that counts: both are cleared first, the colour to this linear light.
    Cleared([f32; 3]),
    /// What earlier passes of the frame drew: it may hide what comes.
    Drawn,
}

impl Onto {
    /// What happens to a colour target first.
    pub fn clear(self) -> Clear {
        match self {
            Onto::Cleared([r, g, b]) => Clear::Float([r, g, b, 1.0]),
            Onto::Drawn => Clear::Keep,
        }
    }
}

/// Shapes as a frame sees them: with the push constants of each draw.
pub struct Seen<'a> {
    pub view: View,
    /// Levels by which textures are taken coarser.
    pub level_bias: u32,
    pub onto: Onto,
    shapes: Vec<(&'a Shape, Vec<Slice<ViewConstants>>)>,
}

impl Shape {
    /// # Errors
    /// Out of memory, device lost.
    pub fn new(gpu: &Gpu, mesh: &Mesh) -> Result<Shape> {
        // Tightly packed in the order of the shader's locations: the struct must lie so too.
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
            indices: Arc::new(gpu.buffer_with("mesh indices", &mesh.indices, BufferUse::Indices)?),
            normals: None,
            depth_alone: None,
            draws: vec![Draw::World { indices }],
        })
    }

    /// As [`Shape::new`], and what it takes to draw depth alone.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn with_depth_alone(gpu: &Gpu, mesh: &Mesh) -> Result<Shape> {
        let read: Vec<_> = depth_vert::SHADER.inputs.iter().map(|(_, format)| *format).collect();
        assert_eq!(read, [VertexFormat::Float3; 2], "depth.vert's inputs");
        assert_eq!([offset_of!(MeshPosition, high), offset_of!(MeshPosition, low)], [0, 12]);
        let (positions, indices) = mesh.positions();
        let depth_alone = DepthAlone {
            vertices: gpu.buffer_with("mesh positions", &positions, BufferUse::Vertices)?,
            indices: gpu.buffer_with("mesh position indices", &indices, BufferUse::Indices)?,
            clusters: mesh.clusters(),
        };
        Ok(Shape { depth_alone: Some(Arc::new(depth_alone)), ..Shape::new(gpu, mesh)? })
    }

    /// The same, lit by the sun.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn lit(self, gpu: &Gpu, mesh: &Mesh) -> Result<Shape> {
        let normals = gpu.buffer_with("mesh normals", &mesh.normals(), BufferUse::Storage)?;
        Ok(Shape { normals: Some(Arc::new(normals)), ..self })
    }

    /// Bytes in video memory.
    pub fn bytes(&self) -> u64 {
        let depth_alone = self.depth_alone.iter().flat_map(|alone| [&alone.vertices, &alone.indices]);
        let own = [&*self.vertices, &*self.indices].into_iter().chain(self.normals.as_deref());
        own.chain(depth_alone).map(Buffer::bytes).sum()
    }
}

/// The push constants of positions in world metres.
pub fn world_view(pose: &Pose, size: [u32; 2], level_bias: u32) -> ViewConstants {
    let eye_high = pose.eye.as_vec3();
    ViewConstants {
        eye_to_clip: pose.world_to_clip(size[0], size[1]).as_mat4().to_cols_array_2d(),
        eye_high: eye_high.to_array(),
        eye_low: (pose.eye - eye_high.as_dvec3()).as_vec3().to_array(),
        level_bias,
        frame: 0,
        sun: [0.0; 3],
    }
}

impl Draw {
    fn slice(&self, view: &View, level_bias: u32, sun: DVec3) -> Slice<ViewConstants> {
        let View { pose, size, frame } = *view;
        let world = ViewConstants { frame: frame as u32, ..world_view(&pose, size, level_bias) };
        match *self {
            Draw::World { indices } => {
                let push = ViewConstants { sun: sun.as_vec3().to_array(), ..world };
                Slice { push, first_index: 0, count: indices }
            }
            Draw::Object { centre, axes, first_index, indices } => {
                // The eye is subtracted here, in f64: what is left is small where it matters, and fits f32.
                let to_eye = DMat4::from_translation(centre - pose.eye) * DMat4::from_mat3(axes);
                let to_clip = (pose.world_to_clip(size[0], size[1]) * to_eye).as_mat4();
                let push = ViewConstants {
                    eye_to_clip: to_clip.to_cols_array_2d(),
                    eye_high: [0.0; 3],
                    eye_low: [0.0; 3],
                    // The axes are orthogonal, all of one length.
                    sun: (axes.transpose() * sun).normalize_or_zero().as_vec3().to_array(),
                    ..world
                };
                Slice { push, first_index, count: indices }
            }
        }
    }
}

impl<'a> Seen<'a> {
    /// `shapes` in an otherwise empty frame, unlit, before black.
    pub fn new(shapes: impl IntoIterator<Item = &'a Shape>, view: View, level_bias: u32) -> Seen<'a> {
        Seen::lit(shapes, view, level_bias, DVec3::ZERO)
    }

    /// As [`Seen::new`]; `sun` is the unit vector towards it, along the world's axes.
    pub fn lit(
        shapes: impl IntoIterator<Item = &'a Shape>,
        view: View,
        level_bias: u32,
        sun: DVec3,
    ) -> Seen<'a> {
        let slices = |shape: &'a Shape| {
            (shape, shape.draws.iter().map(|draw| draw.slice(&view, level_bias, sun)).collect())
        };
        let shapes = shapes.into_iter().map(slices).collect();
        Seen { view, level_bias, onto: Onto::Cleared([0.0; 3]), shapes }
    }

    /// The same, over something else.
    pub fn onto(self, onto: Onto) -> Seen<'a> {
        Seen { onto, ..self }
    }

    /// Draws every shape; `pipeline` says how.
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
            self.draw_shape(render, resources, pipeline(shape), shape, slices)?;
        }
        Ok(())
    }

    fn draw_shape(
        &self,
        render: &mut Render<'_, '_>,
        resources: &[(u32, Resource<'_>)],
        pipeline: &GraphicsPipeline,
        shape: &Shape,
        slices: &[Slice<ViewConstants>],
    ) -> Result<()> {
        let normals = shape.normals.iter().map(|normals| (lit_mesh_vert::NORMALS, Resource::Buffer(normals)));
        let resources: Vec<_> = resources.iter().copied().chain(normals).collect();
        let geometry = Geometry { vertices: Some(&shape.vertices), indices: &shape.indices };
        render.draw_slices(pipeline, &resources, geometry, slices)
    }

    /// Each shape with its draws.
    pub fn shapes(&self) -> impl Iterator<Item = (&'a Shape, &[Slice<ViewConstants>])> {
        self.shapes.iter().map(|(shape, slices)| (*shape, &**slices))
    }
}
