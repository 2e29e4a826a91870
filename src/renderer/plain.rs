//! Surfaces with a plain texture or without a texture. Each surface is one draw, filtered by the sampler, by a filter
//! of paper 3, or by its relief.

use crate::frame::{Allocations, DrawList, Onto, Shape, Target};
use crate::math::light::LightColours;
use crate::paper::texture_mapping::config::ReliefFilter;
use crate::paper::texture_mapping::relief::surface::ReliefSurface;
use crate::paper::virtual_texture::config::Filter;
use crate::texture::plain::PlainTexture;
use crate::vk::shader::Shader;
use crate::vk::shader::common::{lit_mesh_vert, mesh_vert, plain_frag};
use crate::vk::shader::texture_mapping::relief_surface_frag;
use crate::vk::{
    Cmd, ColorTarget, Depth, DepthTarget, Format, Gpu, GraphicsInfo, GraphicsPipeline, Image, ImageInfo,
    Resource, Result, Sampler, SamplerFilter, SamplerInfo,
};
use std::sync::Arc;

/// Albedo (linear light) of a surface without a texture, for example a progressive mesh.
pub const ALBEDO: f64 = 0.6;

/// All surfaces of a scene with a plain texture or none.
pub struct PlainSurfaces {
    pub surfaces: Vec<PlainSurface>,
    /// For each filter, the unlit and the lit pipeline.
    pipelines: Vec<(PlainFilter, [GraphicsPipeline; 2])>,
    sampler: Sampler,
}

/// How the texture of a surface is filtered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlainFilter {
    /// The sampler's trilinear filter.
    Trilinear,
    /// A filter of paper 3.
    Texels(Filter),
    Relief(ReliefFilter),
}

/// One surface with a plain texture or none.
pub struct PlainSurface {
    pub name: String,
    pub filter: PlainFilter,
    /// `None`: a progressive mesh, whose shape changes from frame to frame.
    pub shape: Option<Shape>,
    /// Surfaces that share a texture share its image.
    pub texture: Arc<Image>,
    /// Present for [`PlainFilter::Relief`].
    pub relief: Option<ReliefSurface>,
}

/// Uploads a texture to video memory.
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
        let pipeline = |filter, vertex, lit: usize, specialization: &[_]| {
            let shaders: &'static [Shader] = match filter {
                PlainFilter::Relief(_) => &relief_surface_frag::SHADERS,
                _ => &plain_frag::SHADERS,
            };
            gpu.graphics_pipeline(&GraphicsInfo {
                specialization,
                depth: Some(Depth::Write),
                colors: &[target.color.info().format],
                ..GraphicsInfo::triangles(vertex, &shaders[lit])
            })
        };
        let mut pipelines: Vec<(PlainFilter, [GraphicsPipeline; 2])> = Vec::new();
        for surface in &surfaces {
            if pipelines.iter().all(|(filter, _)| *filter != surface.filter) {
                let filter = surface.filter;
                let own = match filter {
                    PlainFilter::Trilinear => Vec::new(),
                    PlainFilter::Texels(filter) => filter.constants(),
                    PlainFilter::Relief(filter) => ReliefSurface::constants(filter),
                };
                let unlit = pipeline(filter, &mesh_vert::SHADER, 0, &own)?;
                let both = [&own[..], &light.constants()].concat();
                let lit = pipeline(filter, &lit_mesh_vert::SHADER, 1, &both)?;
                pipelines.push((surface.filter, [unlit, lit]));
            }
        }
        Ok(PlainSurfaces {
            surfaces,
            pipelines,
            sampler: gpu
                .sampler("plain sampler", SamplerInfo { filter: SamplerFilter::Linear, wraps_in_s: true })?,
        })
    }

    /// Texture and relief of a surface.
    pub(super) fn resources<'s>(&'s self, surface: &'s PlainSurface) -> Vec<(u32, Resource<'s>)> {
        let plain = (plain_frag::PLAIN, Resource::Sampled(&surface.texture, &self.sampler));
        surface.relief.iter().flat_map(ReliefSurface::resources).chain([plain]).collect()
    }

    /// Draws the surfaces; `seen` returns the draw list of a shape for this frame.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw<'a>(
        &self,
        cmd: &mut Cmd<'_>,
        target: &Target,
        onto: Onto,
        shapes: &'a [(usize, Shape)],
        seen: impl Fn(&'a Shape) -> DrawList<'a>,
    ) -> Result<()> {
        let color = ColorTarget { image: &target.color, clear: onto.clear() };
        let depth = DepthTarget { image: &target.depth, clear: onto != Onto::Drawn };
        cmd.render(target.size(), &[color], Some(depth), |render| {
            for (surface, shape) in shapes {
                let surface = &self.surfaces[*surface];
                let resources = self.resources(surface);
                let of_filter = self.pipelines.iter().find(|(filter, _)| *filter == surface.filter);
                let pipeline =
                    &of_filter.expect("each filter has pipelines").1[usize::from(shape.normals.is_some())];
                seen(shape).draw(render, &resources, |_| pipeline)?;
            }
            Ok(())
        })
    }

    /// A shared image is counted under the first surface that uses it.
    pub fn memory(&self) -> Allocations {
        let mut memory = Allocations::new();
        for (n, surface) in self.surfaces.iter().enumerate() {
            if !self.surfaces[..n].iter().any(|other| Arc::ptr_eq(&other.texture, &surface.texture)) {
                memory.push((format!("{}: texture", surface.name), surface.texture.bytes()));
            }
            memory.extend(
                surface.relief.as_ref().map(|relief| (format!("{}: relief", surface.name), relief.bytes())),
            );
            memory.extend(
                surface.shape.as_ref().map(|shape| (format!("{}: mesh", surface.name), shape.bytes())),
            );
        }
        memory
    }
}
