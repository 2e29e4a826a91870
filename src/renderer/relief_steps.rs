//! The work of each pixel of a relief, for the window's overlay: steps of the ray, or texels that the projected-width
//! method visits.

use super::plain::{PlainFilter, PlainSurfaces};
use super::technique::Surfaces;
use crate::frame::{DrawList, Target, View};
use crate::paper::texture_mapping::relief::surface::ReliefSurface;
use crate::vk::shader::common::mesh_vert;
use crate::vk::shader::texture_mapping::relief_surface_frag;
use crate::vk::{
    self, Clear, ColorTarget, Depth, DepthTarget, Format, Frame, Gpu, GraphicsInfo, GraphicsPipeline, Image,
    ImageInfo, Result,
};
use std::sync::Arc;

/// The value of FORM in relief_surface.frag that writes the work.
const WORK: usize = 2;

/// An image of each pixel's work, and the pass that draws it.
pub struct ReliefSteps {
    /// Steps in the first word; all ones where there is no relief.
    pub image: Image,
    /// The depth of the finished picture.
    depth: Arc<Image>,
    /// One pipeline for each filter of the surfaces with a relief.
    pipelines: Vec<(PlainFilter, GraphicsPipeline)>,
}

impl ReliefSteps {
    /// # Errors
    /// Out of memory; the driver cannot compile a pipeline.
    pub fn new(gpu: &Gpu, plain: &PlainSurfaces, target: &Target) -> Result<ReliefSteps> {
        let mut pipelines: Vec<(PlainFilter, GraphicsPipeline)> = Vec::new();
        for surface in plain.surfaces.iter().filter(|surface| surface.relief.is_some()) {
            let PlainFilter::Relief(filter) = surface.filter else { continue };
            if pipelines.iter().any(|(filter, _)| *filter == surface.filter) {
                continue;
            }
            let shader = &relief_surface_frag::SHADERS[WORK];
            let pipeline = gpu.graphics_pipeline(&GraphicsInfo {
                specialization: &ReliefSurface::constants(filter),
                depth: Some(Depth::Equal),
                colors: &[Format::Rgba32Uint],
                ..GraphicsInfo::triangles(&mesh_vert::SHADER, shader)
            })?;
            pipelines.push((surface.filter, pipeline));
        }
        Ok(ReliefSteps {
            image: gpu.image("relief steps", ImageInfo::target(target.size(), Format::Rgba32Uint))?,
            depth: target.depth.clone(),
            pipelines,
        })
    }

    /// True if the image was made for this target.
    pub fn fits(&self, target: &Target) -> bool {
        Arc::ptr_eq(&self.depth, &target.depth)
    }

    /// Draws the work after the passes of the picture.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(&self, frame: &mut Frame<'_>, surfaces: &Surfaces, view: &View) -> vk::Result<()> {
        let Some(plain) = &surfaces.plain else { return Ok(()) };
        let shapes = surfaces.plain_shapes();
        frame.pass("relief steps", |cmd| {
            let color = ColorTarget { image: &self.image, clear: Clear::Uint([u32::MAX; 4]) };
            let depth = DepthTarget { image: &self.depth, clear: false };
            cmd.render(view.size, &[color], Some(depth), |render| {
                for (surface, shape) in &shapes {
                    let surface = &plain.surfaces[*surface];
                    let pipeline = self.pipelines.iter().find(|(filter, _)| *filter == surface.filter);
                    let Some((_, pipeline)) = pipeline else { continue };
                    let seen = DrawList::lit([shape], *view, 0, surfaces.sun);
                    seen.draw(render, &plain.resources(surface), |_| pipeline)?;
                }
                Ok(())
            })
        })
    }
}
