//! Draws egui's triangles over the picture.
//!
//! egui-ash-renderer 0.13 is not used for three reasons. It waits for an idle queue at each new glyph. It
//! updates parts of a texture from the layout UNDEFINED, which may discard the rest. It frees textures that a
//! frame in flight still reads.

use egui::epaint::{ImageDelta, Primitive};
use egui::{ClippedPrimitive, ImageData, TextureId, TexturesDelta};
use ortelius::vk::shader::Panels;
use ortelius::vk::shader::view::{panels_frag, panels_vert};
use ortelius::vk::{
    Blend, Buffer, BufferUse, Clear, ClippedSlice, Cmd, ColorTarget, Filter, Format, Geometry, Gpu,
    GraphicsInfo, GraphicsPipeline, Image, ImageInfo, IndexType, Resource, Result, Sampler, SamplerInfo,
    TexelCopy,
};
use std::collections::HashMap;

/// The pipeline, and the textures that outlive a frame.
pub struct Painter {
    gpu: Gpu,
    pipeline: GraphicsPipeline,
    sampler: Sampler,
    textures: HashMap<TextureId, Image>,
}

/// The triangles of one frame. It may be dropped once the frame is recorded.
pub struct Painting {
    points: [f32; 2],
    buffers: Option<(Buffer, Buffer)>,
    /// Draws in order; consecutive ones with the same texture share an entry.
    draws: Vec<(TextureId, Vec<ClippedSlice>)>,
    uploads: Vec<(TextureId, Buffer, TexelCopy)>,
}

/// The vertex layout of `panels.vert`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Vertex {
    position: [f32; 2],
    place: [f32; 2],
    colour: [u8; 4],
}

impl Painter {
    /// # Errors
    /// Out of memory.
    pub fn new(gpu: &Gpu, format: Format) -> Result<Painter> {
        Ok(Painter {
            gpu: gpu.clone(),
            pipeline: gpu.graphics_pipeline(&GraphicsInfo {
                name: panels_frag::SHADER.name,
                vertex: &panels_vert::SHADER,
                geometry: None,
                fragment: Some(&panels_frag::SHADER),
                specialization: &[],
                points: false,
                depth: None,
                colors: &[format],
                blend: Blend::Over,
            })?,
            sampler: gpu.sampler("panels", SamplerInfo { filter: Filter::Linear, wraps_in_s: false })?,
            textures: HashMap::new(),
        })
    }

    /// Uploads new textures and triangles for a window of `size` pixels.
    ///
    /// # Errors
    /// Out of memory.
    pub fn prepare(
        &mut self,
        textures: &TexturesDelta,
        primitives: &[ClippedPrimitive],
        size: [u32; 2],
        pixels_per_point: f32,
    ) -> Result<Painting> {
        let mut uploads = Vec::new();
        for (id, deltas) in &textures.set {
            for delta in deltas {
                uploads.push(self.upload(*id, delta)?);
            }
        }
        let (mut vertices, mut indices) = (Vec::new(), Vec::new());
        let mut draws: Vec<(TextureId, Vec<ClippedSlice>)> = Vec::new();
        for ClippedPrimitive { clip_rect, primitive } in primitives {
            let Primitive::Mesh(mesh) = primitive else { continue };
            let (first_index, count) = (indices.len() as u32, mesh.indices.len() as u32);
            let clip = [clip_rect.min, clip_rect.max].map(|corner| {
                [corner.x, corner.y].map(|points| (points * pixels_per_point).round().max(0.0) as u32)
            });
            let at = [0, 1].map(|axis| clip[0][axis].min(size[axis]));
            let end = [0, 1].map(|axis| clip[1][axis].min(size[axis]));
            let clipped = [0, 1].map(|axis: usize| end[axis].saturating_sub(at[axis]));
            if count == 0 || clipped.contains(&0) {
                continue;
            }
            let base = vertices.len() as u32;
            indices.extend(mesh.indices.iter().map(|index| base + index));
            vertices.extend(mesh.vertices.iter().map(|vertex| Vertex {
                position: vertex.pos.into(),
                place: vertex.uv.into(),
                colour: vertex.color.to_array(),
            }));
            let slice = ClippedSlice { at, size: clipped, first_index, count };
            match draws.last_mut() {
                Some((texture, slices)) if *texture == mesh.texture_id => slices.push(slice),
                _ => draws.push((mesh.texture_id, vec![slice])),
            }
        }
        let points = size.map(|pixels| pixels as f32 / pixels_per_point);
        Ok(Painting { points, buffers: self.buffers(&vertices, &indices)?, draws, uploads })
    }

    fn buffers(&self, vertices: &[Vertex], indices: &[u32]) -> Result<Option<(Buffer, Buffer)>> {
        if indices.is_empty() {
            return Ok(None);
        }
        let (vertices, indices) = (bytemuck::cast_slice(vertices), bytemuck::cast_slice(indices));
        let filled = |name, bytes: &[u8], usage| -> Result<Buffer> {
            let mut buffer = self.gpu.buffer(name, bytes.len() as u64, usage)?;
            buffer.mapped_mut().copy_from_slice(bytes);
            Ok(buffer)
        };
        Ok(Some((
            filled("panel vertices", vertices, BufferUse::MappedVertices)?,
            filled("panel indices", indices, BufferUse::MappedIndices(IndexType::U32))?,
        )))
    }

    /// Uploads a new texture, or a part of one.
    fn upload(&mut self, id: TextureId, delta: &ImageDelta) -> Result<(TextureId, Buffer, TexelCopy)> {
        let ImageData::Color(image) = &delta.image;
        let size = [image.width() as u32, image.height() as u32];
        if delta.pos.is_none() {
            let info = ImageInfo::texture(size, Format::Rgba8, 1);
            self.textures.insert(id, self.gpu.image("panel texture", info)?);
        }
        let bytes: Vec<u8> = image.pixels.iter().flat_map(|pixel| pixel.to_array()).collect();
        let mut staging = self.gpu.buffer("panel staging", bytes.len() as u64, BufferUse::Upload)?;
        staging.mapped_mut().copy_from_slice(&bytes);
        let at = delta.pos.unwrap_or([0, 0]).map(|texels| texels as u32);
        Ok((id, staging, TexelCopy { offset: 0, mip: 0, layer: 0, at, size }))
    }

    /// Draws over the content of `target`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw(&self, cmd: &mut Cmd<'_>, target: &Image, painting: &Painting) -> Result<()> {
        for (n, (id, staging, copy)) in painting.uploads.iter().enumerate() {
            // Updates of one texture may overlap, so their order matters.
            if n > 0 {
                cmd.sync();
            }
            cmd.copy_to_image(staging, &self.textures[id], &[*copy]);
        }
        if !painting.uploads.is_empty() {
            cmd.sync();
        }
        let Some((vertices, indices)) = &painting.buffers else { return Ok(()) };
        let color = ColorTarget { image: target, clear: Clear::Keep };
        let push = Panels { points: painting.points };
        cmd.render(target.info().size, &[color], None, |render| {
            for (texture, slices) in &painting.draws {
                let Some(texture) = self.textures.get(texture) else { continue };
                let resources = [(panels_frag::IMAGE, Resource::Sampled(texture, &self.sampler))];
                let geometry = Geometry { vertices: Some(vertices), indices };
                let push = bytemuck::bytes_of(&push);
                render.draw_clipped(&self.pipeline, &resources, push, geometry, slices)?;
            }
            Ok(())
        })
    }

    /// Drops the textures that egui no longer uses after the frame just recorded.
    pub fn free(&mut self, textures: &TexturesDelta) {
        textures.free.iter().for_each(|id| drop(self.textures.remove(id)));
    }
}
