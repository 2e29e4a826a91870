//! Reads out the faces of a finished frame, for the window's overlays. Each pixel has its instance, its face, the level
//! at which the face appears, and the number of the face's vertices that miss in a FIFO of 16.

use super::misses::MissCounter;
use super::surface::MeshOnDevice;
use super::surface::vertices::{MorphVertex, SurfaceVertex, VertexBuffer};
use super::technique::ProgressiveMeshes;
use crate::frame::{Target, View};
use crate::model::mesh::MeshVertex;
use crate::vk::shader::FaceView;
use crate::vk::shader::progressive_mesh::{faces_frag, faces_vert};
use crate::vk::{
    self, Buffer, BufferUse, Clear, Cmd, ColorTarget, Depth, DepthTarget, Format, Frame, Gpu, GraphicsInfo,
    GraphicsPipeline, Image, ImageInfo, Resource, Result,
};
use std::sync::Arc;

/// The picture of faces, and its passes.
pub struct Faces {
    /// Four words per pixel. The first three are the instance (counted over the visible instances of all surfaces), the
    /// face, and the level at which the face appears. The fourth has that level scaled to 0 ..= 255, the edge bit and
    /// the cache misses (faces.vert, faces.frag). All bits are 1 where there is no mesh.
    pub image: Image,
    /// If true, cache misses are counted again where levels or visible instances have changed. If false, the counts may
    /// be out of date or 0.
    pub counts_misses: bool,
    depth: Image,
    /// The depth of the finished picture, with which hidden faces are discarded.
    seen: Arc<Image>,
    surfaces: Vec<OfSurface>,
}

struct OfSurface {
    draw: GraphicsPipeline,
    counter: MissCounter,
    /// Live vertices of each level.
    levels: Buffer,
    level_count: u32,
    /// Cache misses by face; grows with the index buffer.
    misses: Buffer,
    /// The state for which `misses` was counted: the levels of all instances, and the faces of the visible instances.
    /// `None` before the first count and after `misses` has grown.
    counted: Option<(Vec<u32>, Vec<[u32; 2]>)>,
}

/// Bytes of the cache misses: a word for each face of the index buffer.
fn miss_bytes(surface: &MeshOnDevice) -> u64 {
    4 * surface.indices.bytes() / surface.indices.index_type().triangle_bytes()
}

impl Faces {
    /// # Errors
    /// Out of memory.
    pub fn new(gpu: &Gpu, meshes: &ProgressiveMeshes, target: &Target) -> Result<Faces> {
        let surfaces = meshes.surfaces.iter().map(|surface| {
            let counts: Vec<u32> = surface.program.levels().iter().map(|level| level.vertices).collect();
            let constants = [surface.indices.index_type().constant()];
            Ok(OfSurface {
                draw: gpu.graphics_pipeline(&GraphicsInfo {
                    specialization: &constants,
                    depth: Some(Depth::Write),
                    colors: &[Format::Rgba32Uint],
                    ..GraphicsInfo::triangles(&faces_vert::SHADER, &faces_frag::SHADER)
                })?,
                counter: MissCounter::new(gpu, surface.indices.index_type())?,
                levels: gpu.buffer_with("faces: levels", &counts, BufferUse::Storage)?,
                level_count: counts.len() as u32,
                misses: gpu.buffer("faces: misses", miss_bytes(surface), BufferUse::Storage)?,
                counted: None,
            })
        });
        Ok(Faces {
            image: gpu.image("faces", ImageInfo::target(target.size(), Format::Rgba32Uint))?,
            counts_misses: false,
            depth: gpu.image("faces: depth", ImageInfo::target(target.size(), Format::Depth32Float))?,
            seen: target.depth.clone(),
            surfaces: surfaces.collect::<Result<_>>()?,
        })
    }

    /// True if `target` still has the depth image for which these passes were made.
    pub fn fits(&self, target: &Target) -> bool {
        Arc::ptr_eq(&self.seen, &target.depth)
    }

    /// Records both passes. The passes of the frame's own picture must come before them.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(
        &mut self,
        gpu: &Gpu,
        frame: &mut Frame<'_>,
        meshes: &ProgressiveMeshes,
        view: &View,
    ) -> vk::Result<()> {
        for (of, surface) in self.surfaces.iter_mut().zip(&meshes.surfaces) {
            if of.misses.bytes() < miss_bytes(surface) {
                of.misses = gpu.buffer("faces: misses", miss_bytes(surface), BufferUse::Storage)?;
                of.counted = None;
            }
        }
        if self.counts_misses {
            frame.pass("cache misses", |cmd| self.count(gpu, cmd, meshes, view))?;
        }
        frame.pass("faces", |cmd| cmd.read_depth(&self.seen, |cmd| self.draw(cmd, meshes, view)))
    }

    fn count(&mut self, gpu: &Gpu, cmd: &mut Cmd<'_>, meshes: &ProgressiveMeshes, view: &View) -> Result<()> {
        for (of, surface) in self.surfaces.iter_mut().zip(&meshes.surfaces) {
            let slices = surface.slices(&view.pose, view.size, meshes.settings.sun);
            let ranges: Vec<_> =
                slices.iter().map(|slice| [slice.first_index / 3, slice.count / 3]).collect();
            let levels = surface.instances().map(|(_, level)| level).collect();
            let shown = (levels, ranges);
            if of.counted.as_ref() != Some(&shown) {
                of.counter.run(gpu, cmd, (&surface.indices, &of.misses), &shown.1)?;
                of.counted = Some(shown);
            }
        }
        Ok(())
    }

    fn draw(&self, cmd: &mut Cmd<'_>, meshes: &ProgressiveMeshes, view: &View) -> Result<()> {
        let color = ColorTarget { image: &self.image, clear: Clear::Uint([u32::MAX; 4]) };
        let depth = DepthTarget { image: &self.depth, clear: true };
        cmd.render(view.size, &[color], Some(depth), |render| {
            let mut instance = 0;
            for (of, surface) in self.surfaces.iter().zip(&meshes.surfaces) {
                let (vertices, bytes) = match &surface.vertices {
                    VertexBuffer::Plain(buffer) => (buffer, size_of::<SurfaceVertex>()),
                    VertexBuffer::Morph(buffer) => (buffer, size_of::<MorphVertex>()),
                    VertexBuffer::Textured { vertices, .. } => (&**vertices, size_of::<MeshVertex>()),
                };
                let resources = [
                    (faces_vert::INDICES, Resource::Buffer(&surface.indices)),
                    (faces_vert::MISSES, Resource::Buffer(&of.misses)),
                    (faces_vert::VERTICES, Resource::Buffer(vertices)),
                    (faces_vert::LEVELS, Resource::Buffer(&of.levels)),
                    (faces_frag::DEPTH, Resource::Texture(&self.seen, vk::ReadAs::Whole)),
                ];
                let slices = surface.slices(&view.pose, view.size, meshes.settings.sun);
                let views = slices.iter().zip(instance..).map(|(slice, instance)| {
                    let push = FaceView {
                        object_to_clip: slice.push.object_to_clip,
                        first_face: slice.first_index / 3,
                        stride: bytes as u32 / 4,
                        instance,
                        levels: of.level_count,
                    };
                    (push, slice.count)
                });
                render.draw_each(&of.draw, &resources, &views.collect::<Vec<_>>())?;
                instance += slices.len() as u32;
            }
            Ok(())
        })
    }
}
