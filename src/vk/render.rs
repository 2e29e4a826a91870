//! Drawing into images, and transform feedback.

use super::command::{Cmd, Resource};
use super::shader::Access;
use super::{Buffer, GraphicsPipeline, Image, IndexType, Result, StreamQuery, TargetPart};
use ash::vk;

/// A target's content before the first draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clear {
    Uint([u32; 4]),
    Float([f32; 4]),
    /// The content that an earlier pass left.
    Keep,
    /// Undefined: the draws, or those of a later pass, replace every pixel that is read.
    Discard,
}

#[derive(Clone, Copy)]
pub struct ColorTarget<'a> {
    pub image: &'a Image,
    pub clear: Clear,
}

#[derive(Clone, Copy)]
pub struct DepthTarget<'a> {
    pub image: &'a Image,
    /// `true` clears to 0, which is infinitely far (depth is reversed). `false` keeps the depth of earlier passes.
    pub clear: bool,
}

/// Where the geometry shader's points go.
#[derive(Clone, Copy)]
pub struct TransformFeedback<'a> {
    pub buffer: &'a Buffer,
    /// Receives the number of bytes written, in 4 bytes at offset 0.
    pub counter: &'a Buffer,
    pub query: &'a StreamQuery,
    pub query_index: u32,
}

/// Indexed triangles that several draws share: indices, and vertices where the shader has inputs.
#[derive(Clone, Copy)]
pub struct IndexedGeometry<'a> {
    pub vertices: Option<&'a Buffer>,
    pub indices: &'a Buffer,
}

/// A draw of a part of an index buffer with its own push constants.
#[derive(Clone, Copy, Debug)]
pub struct IndexRange<P> {
    pub push: P,
    pub first_index: u32,
    pub count: u32,
}

/// A part of an index buffer, drawn only within a rectangle of the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClippedSlice {
    /// First column and row, and the size, in pixels.
    pub at: [u32; 2],
    pub size: [u32; 2],
    pub first_index: u32,
    pub count: u32,
}

/// Draws into a set of targets.
pub struct Render<'c, 'a> {
    cmd: &'c mut Cmd<'a>,
}

impl<'a> Cmd<'a> {
    /// Runs `draws` with the targets bound; viewport and scissor cover `size`.
    ///
    /// # Errors
    /// The error of `draws`.
    pub fn render(
        &mut self,
        size: [u32; 2],
        colors: &[ColorTarget<'_>],
        depth: Option<DepthTarget<'_>>,
        draws: impl FnOnce(&mut Render<'_, 'a>) -> Result<()>,
    ) -> Result<()> {
        for ColorTarget { image, clear } in colors {
            let access = if *clear == Clear::Keep { Access::ReadWrite } else { Access::Write };
            self.list_image(image, access);
        }
        if let (Some(listing), Some(target)) = (&mut self.listing, &depth) {
            listing.depth(target.image, target.clear);
        }
        let colors: Vec<_> = colors.iter().map(|target| color_attachment(size, target)).collect();
        let area = area(&([0; 2], size));
        let mut info =
            vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&colors);
        let depth = depth.map(|target| depth_attachment(size, &target));
        if let Some(depth) = &depth {
            info = info.depth_attachment(depth);
        }
        let viewport = vk::Viewport {
            x: 0.0,
            y: 0.0,
            width: size[0] as f32,
            height: size[1] as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        // SAFETY: the attachments live until the frame has ended, and are in these layouts.
        unsafe {
            self.device.handle.cmd_begin_rendering(self.handle, &info);
            self.device.handle.cmd_set_viewport(self.handle, 0, &[viewport]);
            self.device.handle.cmd_set_scissor(self.handle, 0, &[area]);
        }
        let result = draws(&mut Render { cmd: self });
        // SAFETY: begun above.
        unsafe { self.device.handle.cmd_end_rendering(self.handle) };
        result
    }
}

fn area((at, size): &TargetPart) -> vk::Rect2D {
    vk::Rect2D {
        offset: vk::Offset2D { x: at[0] as i32, y: at[1] as i32 },
        extent: vk::Extent2D { width: size[0], height: size[1] },
    }
}

fn color_attachment(size: [u32; 2], target: &ColorTarget<'_>) -> vk::RenderingAttachmentInfo<'static> {
    assert_eq!(target.image.info().size, size, "{}: size of a target", target.image.name());
    let color = match target.clear {
        Clear::Uint(uint32) => vk::ClearColorValue { uint32 },
        Clear::Float(float32) => vk::ClearColorValue { float32 },
        Clear::Keep | Clear::Discard => vk::ClearColorValue::default(),
    };
    let load = match target.clear {
        Clear::Keep => vk::AttachmentLoadOp::LOAD,
        Clear::Discard => vk::AttachmentLoadOp::DONT_CARE,
        Clear::Uint(_) | Clear::Float(_) => vk::AttachmentLoadOp::CLEAR,
    };
    vk::RenderingAttachmentInfo::default()
        .image_view(target.image.view)
        .image_layout(vk::ImageLayout::GENERAL)
        .load_op(load)
        .store_op(vk::AttachmentStoreOp::STORE)
        .clear_value(vk::ClearValue { color })
}

fn depth_attachment(size: [u32; 2], target: &DepthTarget<'_>) -> vk::RenderingAttachmentInfo<'static> {
    assert_eq!(target.image.info().size, size, "{}: size of a target", target.image.name());
    let depth_stencil = vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 };
    vk::RenderingAttachmentInfo::default()
        .image_view(target.image.view)
        .image_layout(target.image.layout())
        .load_op(if target.clear { vk::AttachmentLoadOp::CLEAR } else { vk::AttachmentLoadOp::LOAD })
        .store_op(vk::AttachmentStoreOp::STORE)
        .clear_value(vk::ClearValue { depth_stencil })
}

impl Render<'_, '_> {
    /// Draws `count` vertices without vertex inputs: the shader gets only the vertex index.
    pub fn draw(
        &mut self,
        pipeline: &GraphicsPipeline,
        resources: &[(u32, Resource<'_>)],
        push: &[u8],
        count: u32,
    ) -> Result<()> {
        self.cmd.bind(&pipeline.0, vk::PipelineBindPoint::GRAPHICS, resources, push)?;
        self.cmd.work.draws += 1;
        // SAFETY: pipeline and descriptors are bound.
        unsafe { self.cmd.device.handle.cmd_draw(self.cmd.handle, count, 1, 0, 0) };
        Ok(())
    }

    /// As [`Render::draw`], once for each part of the target and clipped to that part. Later draws of the same
    /// rendering stay clipped to the last part.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw_parts(
        &mut self,
        pipeline: &GraphicsPipeline,
        resources: &[(u32, Resource<'_>)],
        push: &[u8],
        (count, parts): (u32, &[TargetPart]),
    ) -> Result<()> {
        if parts.is_empty() {
            return Ok(());
        }
        self.cmd.bind(&pipeline.0, vk::PipelineBindPoint::GRAPHICS, resources, push)?;
        self.cmd.work.draws += parts.len() as u64;
        for part in parts {
            // SAFETY: pipeline and descriptors are bound.
            unsafe {
                self.cmd.device.handle.cmd_set_scissor(self.cmd.handle, 0, &[area(part)]);
                self.cmd.device.handle.cmd_draw(self.cmd.handle, count, 1, 0, 0);
            }
        }
        Ok(())
    }

    /// Clears parts of the first target to 0.
    pub fn clear_parts(&mut self, parts: &[TargetPart]) {
        let clear = vk::ClearAttachment::default().aspect_mask(vk::ImageAspectFlags::COLOR);
        let rects =
            parts.iter().map(|part| vk::ClearRect { rect: area(part), base_array_layer: 0, layer_count: 1 });
        let rects: Vec<_> = rects.collect();
        if !rects.is_empty() {
            // SAFETY: recorded within the rendering, whose first attachment is a colour.
            unsafe { self.cmd.device.handle.cmd_clear_attachments(self.cmd.handle, &[clear], &rects) };
        }
    }

    /// As [`Render::draw`], once for each (push constants, number of vertices), with the resources bound once.
    pub fn draw_each<P: bytemuck::Pod>(
        &mut self,
        pipeline: &GraphicsPipeline,
        resources: &[(u32, Resource<'_>)],
        draws: &[(P, u32)],
    ) -> Result<()> {
        let Some((first, _)) = draws.first() else { return Ok(()) };
        let base = &pipeline.0;
        self.cmd.bind(base, vk::PipelineBindPoint::GRAPHICS, resources, bytemuck::bytes_of(first))?;
        self.cmd.work.draws += draws.len() as u64;
        for (push, count) in draws {
            let (push, device) = (bytemuck::bytes_of(push), &self.cmd.device.handle);
            // SAFETY: pipeline and descriptors are bound; `bind` checked the size of the push constants.
            unsafe {
                device.cmd_push_constants(self.cmd.handle, base.layout, base.push_stages, 0, push);
                device.cmd_draw(self.cmd.handle, *count, 1, 0, 0);
            }
        }
        Ok(())
    }

    /// Binds vertices and indices. Returns the type of the indices.
    fn bind_geometry(&mut self, IndexedGeometry { vertices, indices }: IndexedGeometry<'_>) -> IndexType {
        for buffer in vertices.into_iter().chain([indices]) {
            self.cmd.list_buffer(buffer, Access::Read, "");
        }
        let vertices = vertices.map(|vertices| vertices.for_frame(self.cmd.mapped));
        let (of, indices) = (indices.index_type(), indices.for_frame(self.cmd.mapped));
        let (device, cmd) = (&self.cmd.device.handle, self.cmd.handle);
        // SAFETY: the buffers live until the frame has ended; build.rs generated the vertex layout.
        unsafe {
            if let Some(vertices) = vertices {
                device.cmd_bind_vertex_buffers(cmd, 0, &[vertices], &[0]);
            }
            device.cmd_bind_index_buffer(cmd, indices, 0, of.raw());
        }
        of
    }

    /// One draw for each slice, with the pipeline, its resources and the buffers bound once.
    pub fn draw_slices<P: bytemuck::Pod>(
        &mut self,
        pipeline: &GraphicsPipeline,
        resources: &[(u32, Resource<'_>)],
        geometry: IndexedGeometry<'_>,
        slices: &[IndexRange<P>],
    ) -> Result<()> {
        let Some(first) = slices.first() else { return Ok(()) };
        let (base, indices) = (&pipeline.0, geometry.indices);
        self.cmd.bind(base, vk::PipelineBindPoint::GRAPHICS, resources, bytemuck::bytes_of(&first.push))?;
        self.cmd.work.draws += slices.len() as u64;
        let of = self.bind_geometry(geometry);
        let (device, cmd) = (&self.cmd.device.handle, self.cmd.handle);
        // SAFETY: everything is bound; `bind` checked the size of the push constants; the indices of a slice lie within
        // the buffer.
        unsafe {
            for slice in slices {
                let end = of.bytes() * (u64::from(slice.first_index) + u64::from(slice.count));
                assert!(end <= indices.bytes(), "{}: a draw ends at {end}", indices.name());
                let push = bytemuck::bytes_of(&slice.push);
                device.cmd_push_constants(cmd, base.layout, base.push_stages, 0, push);
                device.cmd_draw_indexed(cmd, slice.count, 1, slice.first_index, 0, 0);
            }
        }
        Ok(())
    }

    /// Makes one draw for each slice, clipped to the slice's rectangle. Later draws of the same rendering stay clipped
    /// to the last rectangle.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw_clipped(
        &mut self,
        pipeline: &GraphicsPipeline,
        resources: &[(u32, Resource<'_>)],
        push: &[u8],
        geometry: IndexedGeometry<'_>,
        slices: &[ClippedSlice],
    ) -> Result<()> {
        if slices.is_empty() {
            return Ok(());
        }
        self.cmd.bind(&pipeline.0, vk::PipelineBindPoint::GRAPHICS, resources, push)?;
        self.cmd.work.draws += slices.len() as u64;
        let of = self.bind_geometry(geometry);
        let (device, cmd) = (&self.cmd.device.handle, self.cmd.handle);
        // SAFETY: everything is bound; the indices of a slice lie within the buffer.
        unsafe {
            for ClippedSlice { at, size, first_index, count } in slices {
                let end = of.bytes() * (u64::from(*first_index) + u64::from(*count));
                assert!(end <= geometry.indices.bytes(), "{}: a draw ends at {end}", geometry.indices.name());
                device.cmd_set_scissor(cmd, 0, &[area(&(*at, *size))]);
                device.cmd_draw_indexed(cmd, *count, 1, *first_index, 0, 0);
            }
        }
        Ok(())
    }

    /// As [`Render::draw`], with transform feedback: the geometry shader's output is written to a buffer from
    /// its start. The pass must reset the query ([`Cmd::reset`]) before it begins to render.
    pub fn draw_captured(
        &mut self,
        pipeline: &GraphicsPipeline,
        resources: &[(u32, Resource<'_>)],
        push: &[u8],
        count: u32,
        into: &TransformFeedback<'_>,
    ) -> Result<()> {
        self.cmd.bind(&pipeline.0, vk::PipelineBindPoint::GRAPHICS, resources, push)?;
        let feedback =
            self.cmd.device.feedback.as_ref().expect("the pass named TransformFeedback in its needs");
        let feedback = feedback.fp();
        self.cmd.work.draws += 1;
        for buffer in [into.buffer, into.counter] {
            self.cmd.list_buffer(buffer, Access::Write, "");
        }
        let [buffer, counter] = [into.buffer, into.counter].map(|buffer| buffer.for_frame(self.cmd.mapped));
        let cmd = self.cmd.handle;
        // SAFETY: ash 0.38 has no wrapper; every pointer lives on this stack frame. A Begin without counter
        // buffers starts at offset 0; End stores the bytes written. The pass and `Cmd::sync` provide the
        // barriers.
        unsafe {
            (feedback.cmd_bind_transform_feedback_buffers_ext)(cmd, 0, 1, &buffer, &0, &into.buffer.bytes());
            (feedback.cmd_begin_query_indexed_ext)(
                cmd,
                into.query.pool,
                into.query_index,
                vk::QueryControlFlags::empty(),
                0,
            );
            (feedback.cmd_begin_transform_feedback_ext)(cmd, 0, 0, std::ptr::null(), std::ptr::null());
            self.cmd.device.handle.cmd_draw(cmd, count, 1, 0, 0);
            (feedback.cmd_end_transform_feedback_ext)(cmd, 0, 1, &counter, &0);
            (feedback.cmd_end_query_indexed_ext)(cmd, into.query.pool, into.query_index, 0);
        }
        Ok(())
    }
}
