//! Stages 1 and 2 and section 4 in one draw, which the paper has not: the fragment shader that textures also marks the
//! tile that it wishes for. There is no `U1`, the mesh is textured where its triples are found, and stage 3 goes on as
//! with any other marks, or is done too: with [`Compaction::FusedAppend`] the fragment that sets a mark first appends
//! the mark's place to `U3`, one word for a triple.
//!
//! A fragment that is drawn before what hides it marks too, so [`Dedup::Fused`] lists a superset.
//! [`Dedup::FusedExact`] first draws depth alone and then shades for EQUAL only: what marks is what is seen. No shape of
//! mesh does without: even of a convex one, whose front faces hide nothing, vertices are snapped to 1/256 pixel, which
//! turns slivers at the limb around, and then their neighbours overlap. What depth alone can leave out of the mesh,
//! [`super::prepass`] says.

use super::choices::{Compaction, Dedup};
use super::lister::Room;
use super::texturing::{Shading, constants};
use super::{Config, Keying, U1Format, prepass::Culling, pyramid_constants, resident::Resident};
use crate::frame::{Onto, Seen};
use crate::math::light::LightColours;
use crate::math::pyramid::Pyramid;
use crate::vk::shader::common::{depth_vert, mesh_vert};
use crate::vk::shader::virtual_texture::fused_frag;
use crate::vk::{
    Blend, Cmd, ColorTarget, Depth, DepthTarget, Format, Geometry, Gpu, GraphicsInfo, GraphicsPipeline,
    Image, Render, Resource, Result, Slice,
};

pub struct Fused {
    /// Where the variant is exact.
    depth_alone: Option<DepthAlone>,
    shading: Shading,
    lists: Lists,
}

/// Draws that leave depth and nothing else.
struct DepthAlone {
    /// Of shapes that have positions for it.
    positions: GraphicsPipeline,
    /// Of the others.
    vertices: GraphicsPipeline,
}

/// What the draw leaves of its tiles, in the order of LISTS in fused.frag.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Lists {
    Nothing,
    Marks,
    MarksAndU3,
}

impl Fused {
    /// For a target of this format, on which some shapes are lit or none.
    ///
    /// # Errors
    /// The device stores nothing from fragment shaders; out of memory.
    pub fn new(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        resident: &Resident,
        target: (Format, Option<LightColours>),
    ) -> Result<Fused> {
        let lists = match config.compact {
            Compaction::FusedAppend => Lists::MarksAndU3,
            _ => Lists::Marks,
        };
        Fused::leaving(lists, gpu, pyramid, config, resident, target)
    }

    /// The same picture in one draw that lists nothing: what the list's price is measured against.
    ///
    /// # Errors
    /// As [`Fused::new`].
    pub fn unlisted(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        resident: &Resident,
        target: (Format, Option<LightColours>),
    ) -> Result<Fused> {
        let config = Config { dedup: Dedup::Fused, ..*config };
        Fused::leaving(Lists::Nothing, gpu, pyramid, &config, resident, target)
    }

    fn leaving(
        lists: Lists,
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        resident: &Resident,
        (target, lit): (Format, Option<LightColours>),
    ) -> Result<Fused> {
        assert_eq!(config.check(pyramid), Ok(()), "asked before");
        gpu.require(&config.dedup.needs())?;
        let exact = config.draws_depth_alone();
        // No triple is stored: the format says nothing.
        let mut specialization = constants(config, resident);
        specialization.extend(pyramid_constants(pyramid, U1Format::Rgb32));
        specialization.push(("NATIVE_KEYING", u32::from(config.keying == Keying::Native)));
        specialization.push(("LISTS", lists as u32));
        let shade = GraphicsInfo {
            name: fused_frag::SHADERS[0].name,
            vertex: &mesh_vert::SHADER,
            geometry: None,
            fragment: Some(&fused_frag::SHADERS[0]),
            specialization: &specialization,
            points: false,
            depth: Some(if exact { Depth::Equal } else { Depth::Write }),
            colors: &[target],
            blend: Blend::Replace,
        };
        Ok(Fused {
            depth_alone: if exact { Some(DepthAlone::new(gpu, &shade)?) } else { None },
            shading: Shading::new(gpu, &shade, &fused_frag::SHADERS, lit)?,
            lists,
        })
    }

    /// Unmarks all, draws the picture and marks its tiles; where the variant appends, `U3` is filled too.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw(
        &self,
        cmd: &mut Cmd<'_>,
        resident: &Resident,
        seen: &Seen<'_>,
        Room { marks, list }: &Room,
        (color, depth): (&Image, &Image),
    ) -> Result<()> {
        if self.lists != Lists::Nothing {
            marks.begin(cmd);
        }
        if self.lists == Lists::MarksAndU3 {
            list.begin(cmd);
        }
        let size = color.info().size;
        let color = ColorTarget { image: color, clear: seen.onto.clear() };
        let depth = DepthTarget { image: depth, clear: seen.onto != Onto::Drawn };
        let resources = [
            (fused_frag::H1, Resource::Buffer(&resident.h1)),
            (fused_frag::J1, Resource::Sampled(&resident.j1, &resident.sampler)),
            (fused_frag::MARKS, marks.resource()),
            (fused_frag::SEEN, marks.resource()),
            (fused_frag::U3, Resource::Buffer(&list.u3)),
        ];
        cmd.render(size, &[color], Some(depth), |render| {
            // Both draws are in one rendering, whose order of primitives is barrier enough for depth.
            if let Some(depth_alone) = &self.depth_alone {
                depth_alone.draw(render, seen)?;
            }
            seen.draw(render, &resources, |shape| self.shading.of(shape))
        })
    }
}

impl DepthAlone {
    /// For the draw that then shades.
    fn new(gpu: &Gpu, shade: &GraphicsInfo<'_>) -> Result<DepthAlone> {
        let pipeline = |vertex| {
            gpu.graphics_pipeline(&GraphicsInfo {
                name: "depth alone",
                vertex,
                fragment: None,
                specialization: &[],
                depth: Some(Depth::Write),
                ..*shade
            })
        };
        Ok(DepthAlone { positions: pipeline(&depth_vert::SHADER)?, vertices: pipeline(&mesh_vert::SHADER)? })
    }

    fn draw(&self, render: &mut Render<'_, '_>, seen: &Seen<'_>) -> Result<()> {
        for (shape, slices) in seen.shapes() {
            let Some(alone) = &shape.depth_alone else {
                let geometry = Geometry { vertices: Some(&shape.vertices), indices: &shape.indices };
                render.draw_slices(&self.vertices, &[], geometry, slices)?;
                continue;
            };
            let push = slices.first().expect("a mesh in the world is drawn once").push;
            let runs = Culling::new(&push, seen.view.size).runs(&alone.clusters);
            let runs: Vec<_> = runs
                .into_iter()
                .map(|run| Slice { push, first_index: run.start, count: run.end - run.start })
                .collect();
            let geometry = Geometry { vertices: Some(&alone.vertices), indices: &alone.indices };
            render.draw_slices(&self.positions, &[], geometry, &runs)?;
        }
        Ok(())
    }
}
