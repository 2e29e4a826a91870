//! The fixed state of a graphics pipeline.

use super::Format;
use super::shader::{Shader, VertexFormat};
use ash::vk;

/// The depth test. Depth is reversed: 1 is near, 0 is infinitely far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// The nearest fragment wins and writes depth.
    Write,
    /// Only fragments with the depth that an earlier pass wrote are drawn.
    Equal,
}

/// Description of a graphics pipeline.
#[derive(Clone, Copy)]
pub struct GraphicsInfo<'a> {
    pub name: &'a str,
    pub vertex: &'static Shader,
    pub geometry: Option<&'static Shader>,
    /// `None`: the pass writes only depth. If `depth` is also `None`, rasterisation is off (transform
    /// feedback only).
    pub fragment: Option<&'static Shader>,
    /// (constant's name in GLSL, value). Every name must exist in one of the shaders.
    pub specialization: &'a [(&'a str, u32)],
    /// Draws points instead of triangles.
    pub points: bool,
    pub depth: Option<Depth>,
    pub colors: &'a [Format],
    pub blend: Blend,
}

impl<'a> GraphicsInfo<'a> {
    /// Opaque triangles without a depth test; the pipeline has the name of the fragment shader.
    pub fn triangles(vertex: &'static Shader, fragment: &'static Shader) -> GraphicsInfo<'a> {
        GraphicsInfo {
            name: fragment.name,
            vertex,
            geometry: None,
            fragment: Some(fragment),
            specialization: &[],
            points: false,
            depth: None,
            colors: &[],
            blend: Blend::Replace,
        }
    }
}

/// How a fragment is combined with the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    Replace,
    /// Bitwise OR into an integer target.
    LogicOr,
    /// "Over" with premultiplied alpha; draws both sides of a triangle.
    Over,
}

impl GraphicsInfo<'_> {
    pub(super) fn raster(&self) -> vk::PipelineRasterizationStateCreateInfo<'static> {
        vk::PipelineRasterizationStateCreateInfo::default()
            .rasterizer_discard_enable(self.fragment.is_none() && self.depth.is_none())
            // Meshes are counter-clockwise seen from outside. Back faces are on the far side (on a planet:
            // beyond the horizon).
            .cull_mode(match self.points || self.blend == Blend::Over {
                true => vk::CullModeFlags::NONE,
                false => vk::CullModeFlags::BACK,
            })
            .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
            .line_width(1.0)
    }

    pub(super) fn depth_test(&self) -> vk::PipelineDepthStencilStateCreateInfo<'static> {
        vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(self.depth.is_some())
            .depth_write_enable(self.depth == Some(Depth::Write))
            .depth_compare_op(match self.depth {
                Some(Depth::Equal) => vk::CompareOp::EQUAL,
                _ => vk::CompareOp::GREATER,
            })
    }

    pub(super) fn depth_format(&self) -> vk::Format {
        match self.depth {
            Some(_) => vk::Format::D32_SFLOAT,
            None => vk::Format::UNDEFINED,
        }
    }

    /// One blend state for each target.
    pub(super) fn attachments(&self) -> Vec<vk::PipelineColorBlendAttachmentState> {
        let writes = match self.fragment {
            Some(_) => vk::ColorComponentFlags::RGBA,
            None => vk::ColorComponentFlags::empty(),
        };
        let over = vk::BlendFactor::ONE_MINUS_SRC_ALPHA;
        let attachment = vk::PipelineColorBlendAttachmentState::default()
            .color_write_mask(writes)
            .blend_enable(self.blend == Blend::Over)
            .src_color_blend_factor(vk::BlendFactor::ONE)
            .dst_color_blend_factor(over)
            .src_alpha_blend_factor(vk::BlendFactor::ONE)
            .dst_alpha_blend_factor(over);
        vec![attachment; self.colors.len()]
    }
}

/// Vertex attributes, tightly packed in the order of their locations, and the stride.
pub(super) fn vertex_attributes(shader: &Shader) -> (Vec<vk::VertexInputAttributeDescription>, u32) {
    let mut offset = 0;
    let attributes = shader.inputs.iter().map(|&(location, format)| {
        let (format, bytes) = match format {
            VertexFormat::Float1 => (vk::Format::R32_SFLOAT, 4),
            VertexFormat::Float2 => (vk::Format::R32G32_SFLOAT, 8),
            VertexFormat::Float3 => (vk::Format::R32G32B32_SFLOAT, 12),
            VertexFormat::Float4 => (vk::Format::R32G32B32A32_SFLOAT, 16),
            VertexFormat::Uint1 => (vk::Format::R32_UINT, 4),
            VertexFormat::Uint2 => (vk::Format::R32G32_UINT, 8),
            VertexFormat::Uint3 => (vk::Format::R32G32B32_UINT, 12),
            VertexFormat::Uint4 => (vk::Format::R32G32B32A32_UINT, 16),
        };
        offset += bytes;
        vk::VertexInputAttributeDescription { location, binding: 0, format, offset: offset - bytes }
    });
    (attributes.collect(), offset)
}
