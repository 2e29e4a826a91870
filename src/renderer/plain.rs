//! Surfaces with a plain texture, or none: one draw each, filtered by the sampler.

use crate::frame::{Memory, Onto, Seen, Shape, Target};
use crate::math::light::LightColours;
use crate::texture::plain::PlainTexture;
use crate::vk::shader::common::{lit_mesh_vert, mesh_vert, plain_frag};
use crate::vk::{
    Blend, Cmd, ColorTarget, Depth, DepthTarget, Filter, Format, Gpu, GraphicsInfo, GraphicsPipeline, Image,
    ImageInfo, Resource, Result, Sampler, SamplerInfo,
};
use std::sync::Arc;

/// Albedo of a surface without a texture, linear light: that of progressive meshes.
pub const ALBEDO: f64 = 0.6;

/// All surfaces of a scene that are drawn so.
pub struct PlainSurfaces {
    pub surfaces: Vec<PlainSurface>,
    lit: GraphicsPipeline,
    unlit: GraphicsPipeline,
    sampler: Sampler,
}

/// One of them.
pub struct PlainSurface {
    pub name: String,
    /// `None`: a progressive mesh, whose shape changes from frame to frame.
    pub shape: Option<Shape>,
    /// Surfaces that share a texture share its image.
    pub texture: Arc<Image>,
}

/// A texture in video memory.
///
/// # Errors
/// Out of memory, device lost.
pub fn upload(gpu: &Gpu, name: &str, texture: &PlainTexture) -> Result<Arc<Image>> {
    let info = ImageInfo::texture(texture.size, Format::Rgba8Srgb, texture.levels.len() as u32);
    let image = gpu.image(&format!("{name}: texture"), info)?;
    gpu.fill_levels(&image, &texture.levels)?;
    Ok(Arc::new(image))
}

impl PlainSurfaces {
    /// # Errors
    /// Out of memory.
    pub fn new(
        gpu: &Gpu,
        surfaces: Vec<PlainSurface>,
        target: &Target,
        light: LightColours,
    ) -> Result<PlainSurfaces> {
        let pipeline = |vertex, lit: usize, specialization: &[_]| {
            gpu.graphics_pipeline(&GraphicsInfo {
                name: plain_frag::SHADERS[lit].name,
                vertex,
                geometry: None,
                fragment: Some(&plain_frag::SHADERS[lit]),
                specialization,
                points: false,
                depth: Some(Depth::Write),
                colors: &[target.color.info().format],
                blend: Blend::Replace,
            })
        };
        Ok(PlainSurfaces {
            surfaces,
            lit: pipeline(&lit_mesh_vert::SHADER, 1, &light.constants())?,
            unlit: pipeline(&mesh_vert::SHADER, 0, &[])?,
            sampler: gpu
                .sampler("plain sampler", SamplerInfo { filter: Filter::Linear, wraps_in_s: true })?,
        })
    }

    /// Draws them; `seen` makes one shape what a frame sees of it.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw<'a>(
        &self,
        cmd: &mut Cmd<'_>,
        target: &Target,
        onto: Onto,
        shapes: &'a [(usize, Shape)],
        seen: impl Fn(&'a Shape) -> Seen<'a>,
    ) -> Result<()> {
        let color = ColorTarget { image: &target.color, clear: onto.clear() };
        let depth = DepthTarget { image: &target.depth, clear: onto != Onto::Drawn };
        cmd.render(target.size(), &[color], Some(depth), |render| {
            for (surface, shape) in shapes {
                let texture = &self.surfaces[*surface].texture;
                let resources = [(plain_frag::PLAIN, Resource::Sampled(texture, &self.sampler))];
                let pipeline = if shape.normals.is_some() { &self.lit } else { &self.unlit };
                seen(shape).draw(render, &resources, |_| pipeline)?;
            }
            Ok(())
        })
    }

    /// A shared image is counted under the first surface that has it.
    pub fn memory(&self) -> Memory {
        let mut memory = Memory::new();
        for (n, surface) in self.surfaces.iter().enumerate() {
            if !self.surfaces[..n].iter().any(|other| Arc::ptr_eq(&other.texture, &surface.texture)) {
                memory.push((format!("{}: texture", surface.name), surface.texture.bytes()));
            }
            memory.extend(
                surface.shape.as_ref().map(|shape| (format!("{}: mesh", surface.name), shape.bytes())),
            );
        }
        memory
    }
}
