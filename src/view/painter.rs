//! Draws egui's triangles into a layer, and the layer over the picture. The layer stays until the panels are laid out
//! again: on a software device, their triangles cost more than their pixels.
//!
//! egui-ash-renderer 0.13 is not used for three reasons. It waits for an idle queue at each new glyph. It
//! updates parts of a texture from the layout UNDEFINED, which may discard the rest. It frees textures that a
//! frame in flight still reads.

use egui::epaint::{ImageDelta, Primitive};
use egui::{ClippedPrimitive, ImageData, Pos2, TextureId, TexturesDelta};
use ortelius::vk::shader::Panels;
use ortelius::vk::shader::view::{panels_frag, panels_vert};
use ortelius::vk::{
    Blend, Buffer, BufferUse, Clear, ClippedSlice, Cmd, ColorTarget, Format, Gpu, GraphicsInfo,
    GraphicsPipeline, Image, ImageInfo, IndexType, IndexedGeometry, Resource, Result, Sampler, SamplerFilter,
    SamplerInfo, TexelCopy,
};
use std::collections::HashMap;
use std::sync::Arc;

/// The pipelines, and what outlives a frame.
pub struct Painter {
    gpu: Gpu,
    /// The first draws triangles into the layer, the second draws the layer into the window.
    pipelines: [GraphicsPipeline; 2],
    /// The first samples egui's textures. The second reads the layer, one texel for each pixel.
    samplers: [Sampler; 2],
    textures: HashMap<TextureId, Image>,
    painting: Option<Painting>,
}

/// The triangles of one layout, and the layer that shows them.
struct Painting {
    layer: Arc<Image>,
    /// False once a frame has drawn the layer.
    is_new: bool,
    points: [f32; 2],
    buffers: Option<(Buffer, Buffer)>,
    /// Draws in order; consecutive ones with the same texture share an entry.
    draws: Vec<(TextureId, Vec<ClippedSlice>)>,
    /// Disjoint rectangles that hold all of them.
    covered: Vec<ClippedSlice>,
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
        let sampler = |filter| gpu.sampler("panels", SamplerInfo { filter, wraps_in_s: false });
        Ok(Painter {
            gpu: gpu.clone(),
            pipelines: pipelines(gpu, format)?,
            samplers: [sampler(SamplerFilter::Linear)?, sampler(SamplerFilter::Nearest)?],
            textures: HashMap::new(),
            painting: None,
        })
    }

    /// Compiles the pipelines again, for example for new shaders.
    ///
    /// # Errors
    /// The driver cannot compile a pipeline.
    pub fn rebuild(&mut self, format: Format) -> Result<()> {
        self.pipelines = pipelines(&self.gpu, format)?;
        Ok(())
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
    ) -> Result<()> {
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
            let pixels = |corner: Pos2| [corner.x, corner.y].map(|points| points * pixels_per_point);
            let clip = [clip_rect.min, clip_rect.max].map(|corner| pixels(corner).map(f32::round));
            // egui's own clip is often the whole window.
            let bounds = mesh.calc_bounds();
            let (least, most) = (pixels(bounds.min).map(f32::floor), pixels(bounds.max).map(f32::ceil));
            let at = [0, 1].map(|axis| (clip[0][axis].max(least[axis]).max(0.0) as u32).min(size[axis]));
            let end = [0, 1].map(|axis| (clip[1][axis].min(most[axis]).max(0.0) as u32).min(size[axis]));
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
        let covered = covered(&draws, indices.len() as u32);
        indices.extend([0, 1, 2, 2, 1, 3].map(|corner| vertices.len() as u32 + corner));
        vertices.extend([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|place| {
            let position = [0, 1].map(|axis| place[axis] * points[axis]);
            Vertex { position, place, colour: [255; 4] }
        }));
        let buffers = if draws.is_empty() { None } else { Some(self.buffers(&vertices, &indices)?) };
        let layer = match self.painting.take() {
            Some(last) if last.layer.info().size == size => last.layer,
            _ => Arc::new(self.gpu.image("panels", ImageInfo::target(size, Format::Rgba8))?),
        };
        self.painting = Some(Painting { layer, is_new: true, points, buffers, draws, covered, uploads });
        Ok(())
    }

    /// True if the panels were laid out for a window of this size.
    pub fn fits(&self, size: [u32; 2]) -> bool {
        self.painting.as_ref().is_some_and(|painting| painting.layer.info().size == size)
    }

    fn buffers(&self, vertices: &[Vertex], indices: &[u32]) -> Result<(Buffer, Buffer)> {
        let (vertices, indices) = (bytemuck::cast_slice(vertices), bytemuck::cast_slice(indices));
        let filled = |name, bytes: &[u8], usage| -> Result<Buffer> {
            let mut buffer = self.gpu.buffer(name, bytes.len() as u64, usage)?;
            buffer.mapped_mut().copy_from_slice(bytes);
            Ok(buffer)
        };
        Ok((
            filled("panel vertices", vertices, BufferUse::MappedVertices)?,
            filled("panel indices", indices, BufferUse::MappedIndices(IndexType::U32))?,
        ))
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

    /// Draws the panels over the content of `target`, if they were laid out for its size.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw(&self, cmd: &mut Cmd<'_>, target: &Image) -> Result<()> {
        let size = target.info().size;
        let Some(painting) = self.painting.as_ref().filter(|_| self.fits(size)) else { return Ok(()) };
        for (n, (id, staging, copy)) in painting.uploads.iter().enumerate() {
            // Updates of one texture may overlap, so their order matters.
            if n > 0 {
                cmd.sync();
            }
            cmd.copy_to_image(staging, &self.textures[id], &[*copy]);
        }
        let Some((vertices, indices)) = &painting.buffers else { return Ok(()) };
        let ([into_layer, over], [linear, nearest]) = (&self.pipelines, &self.samplers);
        let geometry = IndexedGeometry { vertices: Some(vertices), indices };
        let push = Panels { points: painting.points };
        let push = bytemuck::bytes_of(&push);
        if painting.is_new {
            cmd.sync();
            let color = ColorTarget { image: &painting.layer, clear: Clear::Float([0.0; 4]) };
            cmd.render(size, &[color], None, |render| {
                for (texture, slices) in &painting.draws {
                    let Some(texture) = self.textures.get(texture) else { continue };
                    let resources = [(panels_frag::IMAGE, Resource::Sampled(texture, linear))];
                    render.draw_clipped(into_layer, &resources, push, geometry, slices)?;
                }
                Ok(())
            })?;
            cmd.sync();
        }
        let color = ColorTarget { image: target, clear: Clear::Keep };
        let resources = [(panels_frag::IMAGE, Resource::Sampled(&painting.layer, nearest))];
        cmd.render(size, &[color], None, |render| {
            render.draw_clipped(over, &resources, push, geometry, &painting.covered)
        })
    }

    /// Call after recording a frame that draws the layer. Drops the textures that egui no longer uses after that frame.
    pub fn drawn(&mut self, textures: &TexturesDelta) {
        if let Some(painting) = &mut self.painting {
            painting.is_new = false;
            painting.uploads.clear();
        }
        textures.free.iter().for_each(|id| drop(self.textures.remove(id)));
    }
}

fn pipelines(gpu: &Gpu, format: Format) -> Result<[GraphicsPipeline; 2]> {
    let pipeline = |format| {
        gpu.graphics_pipeline(&GraphicsInfo {
            colors: &[format],
            blend: Blend::Over,
            ..GraphicsInfo::triangles(&panels_vert::SHADER, &panels_frag::SHADER)
        })
    };
    Ok([pipeline(Format::Rgba8)?, pipeline(format)?])
}

/// Disjoint rectangles that hold all draws, so that no pixel is blended twice. Two triangles from `first_index` on draw
/// each of them.
fn covered(draws: &[(TextureId, Vec<ClippedSlice>)], first_index: u32) -> Vec<ClippedSlice> {
    let mut found: Vec<Rectangle> = Vec::new();
    for slice in draws.iter().flat_map(|(_, slices)| slices) {
        let mut next = Rectangle { at: slice.at, end: [0, 1].map(|axis| slice.at[axis] + slice.size[axis]) };
        // The union with one rectangle may overlap another.
        while let Some(n) = found.iter().position(|other| other.overlaps(&next)) {
            next = next.with(&found.swap_remove(n));
        }
        found.push(next);
    }
    let slice = |Rectangle { at, end }: Rectangle| {
        let size = [0, 1].map(|axis| end[axis] - at[axis]);
        ClippedSlice { at, size, first_index, count: 6 }
    };
    found.into_iter().map(slice).collect()
}

/// Pixels from `at` to before `end`.
struct Rectangle {
    at: [u32; 2],
    end: [u32; 2],
}

impl Rectangle {
    fn overlaps(&self, other: &Rectangle) -> bool {
        (0..2).all(|axis| self.at[axis] < other.end[axis] && other.at[axis] < self.end[axis])
    }

    /// The rectangle that holds both.
    fn with(&self, other: &Rectangle) -> Rectangle {
        Rectangle {
            at: [0, 1].map(|axis| self.at[axis].min(other.at[axis])),
            end: [0, 1].map(|axis| self.end[axis].max(other.end[axis])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_drawn_pixel_is_covered_once_and_distant_rectangles_stay_apart() {
        let slice = |at, size| ClippedSlice { at, size, first_index: 0, count: 3 };
        // The second chain of overlaps joins the first only by its last link.
        let slices = [
            slice([60, 0], [20, 50]),
            slice([0, 40], [9, 5]),
            slice([0, 0], [10, 4]),
            slice([4, 2], [10, 4]),
            slice([20, 0], [8, 8]),
            slice([12, 5], [9, 2]),
            slice([80, 0], [3, 3]),
        ];
        let draws =
            [(TextureId::default(), slices[..3].to_vec()), (TextureId::User(1), slices[3..].to_vec())];
        let found = covered(&draws, 30);
        let holds = |slice: &ClippedSlice, [x, y]: [u32; 2]| {
            (slice.at[0]..slice.at[0] + slice.size[0]).contains(&x)
                && (slice.at[1]..slice.at[1] + slice.size[1]).contains(&y)
        };
        for at in (0..50).flat_map(|y| (0..90).map(move |x| [x, y])) {
            let count = found.iter().filter(|slice| holds(slice, at)).count();
            assert!(count <= 1, "{at:?} is blended {count} times");
            assert!(count == 1 || !slices.iter().any(|slice| holds(slice, at)), "{at:?} is missing");
        }
        let mut pixels: Vec<u32> = found.iter().map(|slice| slice.size[0] * slice.size[1]).collect();
        pixels.sort_unstable();
        assert_eq!(pixels, [9, 45, 28 * 8, 20 * 50]);
        assert!(found.iter().all(|slice| (slice.first_index, slice.count) == (30, 6)));
    }
}
