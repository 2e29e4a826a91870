//! Surfaces with a plain texture or without a texture. Each surface is one draw, filtered by the sampler, by a filter
//! of paper 3, or by its relief.

use crate::frame::{Allocations, DrawList, Onto, Shape, Target};
use crate::math::light::LightColours;
use crate::paper::texture_mapping::config::ReliefFilter;
use crate::paper::texture_mapping::relief::surface::ReliefSurface;
use crate::paper::virtual_texture::config::Filter;
use crate::paper::virtual_texture::texturing::WeightTable;
use crate::texture::plain::PlainTexture;
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
    filters: Vec<FilterPipelines>,
    sampler: Sampler,
}

/// What all surfaces with the same filter share.
struct FilterPipelines {
    filter: PlainFilter,
    /// Unlit and lit.
    pipelines: [GraphicsPipeline; 2],
    weight_table: WeightTable,
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
        let pipeline = |vertex, fragment, specialization: &[_]| {
            gpu.graphics_pipeline(&GraphicsInfo {
                specialization,
                depth: Some(Depth::Write),
                colors: &[target.color.info().format],
                ..GraphicsInfo::triangles(vertex, fragment)
            })
        };
        let mut filters: Vec<FilterPipelines> = Vec::new();
        for surface in &surfaces {
            let filter = surface.filter;
            if filters.iter().all(|other| other.filter != filter) {
                let texels = if let PlainFilter::Texels(own) = filter { own } else { Filter::DEFAULT };
                let ([unlit, lit], own) = match filter {
                    PlainFilter::Trilinear => (texels.forms(&plain_frag::SHADERS), Vec::new()),
                    PlainFilter::Texels(own) => (own.forms(&plain_frag::SHADERS), own.constants()),
                    PlainFilter::Relief(own) => {
                        let [unlit, lit, _] = &relief_surface_frag::SHADERS;
                        ([unlit, lit], ReliefSurface::constants(own))
                    }
                };
                let both = [&own[..], &light.constants()].concat();
                let pipelines = [
                    pipeline(&mesh_vert::SHADER, unlit, &own)?,
                    pipeline(&lit_mesh_vert::SHADER, lit, &both)?,
                ];
                filters.push(FilterPipelines {
                    filter,
                    pipelines,
                    weight_table: WeightTable::new(gpu, &texels)?,
                });
            }
        }
        Ok(PlainSurfaces {
            surfaces,
            filters,
            sampler: gpu
                .sampler("plain sampler", SamplerInfo { filter: SamplerFilter::Linear, wraps_in_s: true })?,
        })
    }

    fn filter_of(&self, surface: &PlainSurface) -> &FilterPipelines {
        let filter = self.filters.iter().find(|other| other.filter == surface.filter);
        filter.expect("each filter has pipelines")
    }

    /// Texture, weight map and relief of a surface.
    pub(super) fn resources<'s>(&'s self, surface: &'s PlainSurface) -> Vec<(u32, Resource<'s>)> {
        let plain = (plain_frag::PLAIN, Resource::Sampled(&surface.texture, &self.sampler));
        let map = self.filter_of(surface).weight_table.resource();
        surface.relief.iter().flat_map(ReliefSurface::resources).chain(map).chain([plain]).collect()
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
                let pipeline = &self.filter_of(surface).pipelines[usize::from(shape.normals.is_some())];
                seen(shape).draw(render, &resources, |_| pipeline)?;
            }
            Ok(())
        })
    }

    /// A shared image or weight map is counted under the first surface that uses it.
    pub fn memory(&self) -> Allocations {
        let mut memory = Allocations::new();
        for (n, surface) in self.surfaces.iter().enumerate() {
            if !self.surfaces[..n].iter().any(|other| Arc::ptr_eq(&other.texture, &surface.texture)) {
                memory.push((format!("{}: texture", surface.name), surface.texture.bytes()));
            }
            if !self.surfaces[..n].iter().any(|other| other.filter == surface.filter) {
                let map = self.filter_of(surface).weight_table.memory();
                memory.extend(map.map(|(name, bytes)| (format!("{}: {name}", surface.name), bytes)));
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
