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
use super::list::List;
use super::texturing::{SKY, constants};
use super::{
    Config, Keying, U1Format, marks::Marks, prepass::Culling, pyramid_constants, resident::Resident,
    surface::Surface,
};
use crate::math::pyramid::Pyramid;
use crate::vk::shader::View as ViewConstants;
use crate::vk::shader::virtual_texture::{depth_vert, fused_frag, mesh_vert};
use crate::vk::{
    Cmd, ColorTarget, Depth, DepthTarget, Format, Geometry, Gpu, GraphicsInfo, GraphicsPipeline, Image,
    ImageInfo, Resource, Result, Slice,
};

pub struct Fused {
    depth: Image,
    /// Where the variant is exact.
    depth_alone: Option<GraphicsPipeline>,
    shade: GraphicsPipeline,
    lists: Lists,
}

/// What the draw leaves of its tiles, in the order of LISTS in fused.frag.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Lists {
    Nothing,
    Marks,
    MarksAndU3,
}

impl Fused {
    /// # Errors
    /// The device stores nothing from fragment shaders; out of memory.
    pub fn new(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        resident: &Resident,
        target: &Image,
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
        target: &Image,
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
        target: &Image,
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
            name: fused_frag::SHADER.name,
            vertex: &mesh_vert::SHADER,
            geometry: None,
            fragment: Some(&fused_frag::SHADER),
            specialization: &specialization,
            points: false,
            depth: Some(if exact { Depth::Equal } else { Depth::Write }),
            colors: &[target.info().format],
            logic_or: false,
        };
        let depth_alone = GraphicsInfo {
            name: "depth alone",
            vertex: &depth_vert::SHADER,
            fragment: None,
            specialization: &[],
            depth: Some(Depth::Write),
            ..shade
        };
        Ok(Fused {
            depth: gpu.image("depth", ImageInfo::target(target.info().size, Format::Depth32Float))?,
            depth_alone: if exact { Some(gpu.graphics_pipeline(&depth_alone)?) } else { None },
            shade: gpu.graphics_pipeline(&shade)?,
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
        surface: &Surface,
        (marks, list): (&Marks, &List),
        view: &ViewConstants,
        target: &Image,
    ) -> Result<()> {
        if self.lists != Lists::Nothing {
            marks.begin(cmd);
        }
        if self.lists == Lists::MarksAndU3 {
            list.begin(cmd);
        }
        let color = ColorTarget { image: target, clear: SKY };
        let depth = DepthTarget { image: &self.depth, clear: true };
        let resources = [
            (fused_frag::H1, Resource::Buffer(&resident.h1)),
            (fused_frag::J1, Resource::Sampled(&resident.j1, &resident.sampler)),
            (fused_frag::MARKS, marks.resource()),
            (fused_frag::SEEN, marks.resource()),
            (fused_frag::U3, Resource::Buffer(&list.u3)),
        ];
        cmd.render(target.info().size, &[color], Some(depth), |render| {
            let push = bytemuck::bytes_of(view);
            // Both draws stand in one rendering, whose order of primitives is barrier enough for depth.
            if let Some(depth_alone) = &self.depth_alone {
                let positions = surface.positions.as_ref().expect("made for drawing depth alone");
                let runs = Culling::new(view, target.info().size).runs(&positions.clusters);
                let slices: Vec<_> = runs
                    .into_iter()
                    .map(|run| Slice { push: *view, first_index: run.start, count: run.end - run.start })
                    .collect();
                let geometry = Geometry { vertices: Some(&positions.vertices), indices: &positions.indices };
                render.draw_slices(depth_alone, &[], geometry, &slices)?;
            }
            render.draw_mesh(&self.shade, &resources, push, &surface.vertices, &surface.indices)
        })
    }

    /// What the last frame's fragments that are seen left.
    pub fn depth(&self) -> &Image {
        &self.depth
    }

    /// Bytes of the depth that it needs for itself.
    pub fn bytes(&self) -> u64 {
        self.depth.bytes()
    }
}
