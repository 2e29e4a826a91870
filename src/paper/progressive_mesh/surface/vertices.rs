//! The vertex buffer of a mesh, shared by all its levels and instances.

use crate::model::mesh::MeshVertex;
use crate::paper::progressive_mesh::mesh::{NOWHERE, ProgressiveMesh, Vertices};
use crate::vk::shader::{VertexFormat, progressive_mesh::surface_vert};
use crate::vk::{Buffer, BufferUse, Gpu, Result};
use glam::DVec3;
use std::mem::offset_of;
use std::sync::Arc;

/// Vertex input of surface.vert.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct SurfaceVertex {
    pub position: [f32; 3],
    pub normal: [f32; 3],
}

/// Vertex input of geomorph.vert: a vertex with the split that created it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MorphVertex {
    pub position: [f32; 3],
    /// log2 of the error of the last level without the vertex, in object units. The vertex is live for smaller chosen
    /// errors (`ErrorPace::chosen`).
    pub birth_log2: f32,
    pub normal: [f32; 3],
    /// The vertex from whose position this vertex starts. A vertex that replaces no vertex has its own index here.
    pub split_vertex: u32,
}

/// A new vertex reaches its position when the chosen error has fallen by an octave since its birth. On the approaches
/// of pm.pop, half an octave makes 1.6 times as many pixels change visibly. Two octaves halve the number of these
/// pixels, but need twice the faces.
pub const MORPH_BAND_LOG2: f32 = 1.0;

/// A `birth_log2` above all errors, for vertices of level 0 and vertices that replace no vertex.
pub const ALWAYS_LOG2: f32 = 1000.0;
/// log2 of a chosen error so small that every vertex has reached its position.
pub const EXACT_LOG2: f32 = -1000.0;

/// One unit normal per vertex: the model's own, or else [`face_normals`] of the full mesh. Normals do not change with
/// the level.
pub fn normals(mesh: &ProgressiveMesh, full: &[[u32; 3]]) -> Vec<[f32; 3]> {
    match &mesh.vertices.attributes.normals[..] {
        [] => face_normals(mesh, full, &mesh.vertices.welded),
        own => own.to_vec(),
    }
}

/// One unit normal per vertex: the area-weighted mean over `faces`. `shared` has, for each vertex, the vertex whose
/// normal it shares.
pub fn face_normals(mesh: &ProgressiveMesh, faces: &[[u32; 3]], shared: &[u32]) -> Vec<[f32; 3]> {
    let positions = &mesh.vertices.positions;
    let at = |vertex: u32| DVec3::from(positions[vertex as usize].map(f64::from));
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for face in faces {
        let [a, b, c] = face.map(at);
        let twice_area = (b - a).cross(c - a);
        face.iter().for_each(|&vertex| sums[shared[vertex as usize] as usize] += twice_area);
    }
    // If the faces cancel out or are degenerate, any direction will do.
    let unit = |&first: &u32| sums[first as usize].normalize_or(DVec3::Z).as_vec3().to_array();
    shared.iter().map(unit).collect()
}

/// Each vertex with the error at which it appears, and with its split vertex.
pub fn morph_vertices(mesh: &ProgressiveMesh, normals: &[[f32; 3]]) -> Vec<MorphVertex> {
    let first = mesh.levels[0].vertices;
    let mut births: Vec<(f32, u32)> = (0..first).map(|vertex| (ALWAYS_LOG2, vertex)).collect();
    for pair in mesh.levels.windows(2) {
        for vertex in pair[0].vertices..pair[1].vertices {
            births.push(match mesh.splits.split_vertices[(vertex - first) as usize] {
                NOWHERE => (ALWAYS_LOG2, vertex),
                // An error of 0 has no finite logarithm. Vertices that are born at an error of 0 reach their position
                // only at EXACT_LOG2.
                split => (pair[0].error.log2().max(EXACT_LOG2 + MORPH_BAND_LOG2), split),
            });
        }
    }
    let morph = |(vertex, (birth_log2, split_vertex)): (usize, (f32, u32))| MorphVertex {
        position: mesh.vertices.positions[vertex],
        birth_log2,
        normal: normals[vertex],
        split_vertex,
    };
    births.into_iter().enumerate().map(morph).collect()
}

/// The vertices in video memory, in the format of the vertex shader that draws them.
pub enum VertexBuffer {
    Plain(Buffer),
    Morph(Buffer),
    /// Another technique's vertices: [`MeshVertex`], and normals if the surface is lit.
    Textured {
        vertices: Arc<Buffer>,
        normals: Option<Arc<Buffer>>,
    },
}

impl VertexBuffer {
    /// # Errors
    /// Out of memory, device lost.
    pub fn new(
        gpu: &Gpu,
        name: &str,
        mesh: &ProgressiveMesh,
        normals: &[[f32; 3]],
        geomorph: bool,
    ) -> Result<Self> {
        // Tightly packed in the order of the shader's locations; the struct must match.
        let layout = [
            (VertexFormat::Float3, offset_of!(SurfaceVertex, position)),
            (VertexFormat::Float3, offset_of!(SurfaceVertex, normal)),
        ];
        let read: Vec<_> = surface_vert::SHADER.inputs.iter().map(|(_, format)| *format).collect();
        assert_eq!(read, layout.map(|(format, _)| format), "surface.vert's inputs");
        assert_eq!(layout.map(|(_, offset)| offset), [0, 12], "SurfaceVertex's members");
        gpu.require_indices(name, normals.len())?;
        if geomorph {
            let vertices = morph_vertices(mesh, normals);
            return Ok(Self::Morph(gpu.buffer_with(name, &vertices, BufferUse::Storage)?));
        }
        let both = mesh.vertices.positions.iter().zip(normals);
        let vertices: Vec<_> = both.map(|(&position, &normal)| SurfaceVertex { position, normal }).collect();
        Ok(Self::Plain(gpu.buffer_with(name, &vertices, BufferUse::Vertices)?))
    }

    /// Vertices with one texture coordinate each, in 0 ..= 1. The f32 step is at most 2^-24, which is 1/64 texel of a
    /// texture with 2^18 texels a side.
    ///
    /// # Errors
    /// Out of memory, device lost.
    ///
    /// # Panics
    /// If the mesh has no texture coordinates.
    pub fn textured(
        gpu: &Gpu,
        name: &str,
        mesh: &ProgressiveMesh,
        normals: Option<&Vec<[f32; 3]>>,
    ) -> Result<Self> {
        let Vertices { positions, attributes, .. } = &mesh.vertices;
        assert_eq!(
            positions.len(),
            attributes.coordinates.len(),
            "{name}: positions and texture coordinates"
        );
        gpu.require_indices(name, positions.len())?;
        // The corners of a face must share one origin, and any three vertices may become a face.
        let vertex = |(&position_high, &offset)| MeshVertex {
            position_high,
            position_low: [0.0; 3],
            origin: [0; 2],
            offset,
        };
        let vertices: Vec<_> = positions.iter().zip(&attributes.coordinates).map(vertex).collect();
        let normals = normals.map(|normals| {
            gpu.buffer_with(&format!("{name}: normals"), normals, BufferUse::Storage).map(Arc::new)
        });
        Ok(Self::Textured {
            vertices: Arc::new(gpu.buffer_with(name, &vertices, BufferUse::Vertices)?),
            normals: normals.transpose()?,
        })
    }

    pub fn bytes(&self) -> u64 {
        match self {
            Self::Plain(buffer) | Self::Morph(buffer) => buffer.bytes(),
            Self::Textured { vertices, normals } => {
                vertices.bytes() + normals.as_ref().map_or(0, |normals| normals.bytes())
            }
        }
    }
}
