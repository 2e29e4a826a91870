//! The commands of a pass: bindings and dispatches. Draws are in `render`, copies in `copy`. [`Cmd::sync`] is the
//! barrier inside a pass.

use super::buffer::Uses;
use super::descriptors::Descriptors;
use super::device::Device;
use super::limits::require_groups;
use super::shader::{Access, DescriptorKind};
use super::used::Listing;
use super::{Buffer, ComputePipeline, Error, Image, ReadAs, Result, Sampler, StreamQuery, Work};
use ash::vk;
use std::sync::Arc;

/// The recorder of one pass.
pub struct Cmd<'a> {
    pub(crate) device: &'a Device,
    pub(crate) handle: vk::CommandBuffer,
    pub(super) descriptors: &'a mut Descriptors,
    /// The mapped buffers that the frame uses.
    pub(super) mapped: &'a mut Vec<Arc<Uses>>,
    /// Work recorded so far.
    pub(crate) work: Work,
    /// `None` unless [`super::Gpu::list_resources`] asked for lists.
    pub(super) listing: Option<Listing>,
}

/// The object that a draw or dispatch binds to a shader's binding number.
#[derive(Clone, Copy)]
pub enum Resource<'a> {
    Texture(&'a Image, ReadAs),
    Sampled(&'a Image, &'a Sampler),
    Buffer(&'a Buffer),
}

impl Cmd<'_> {
    /// One global memory barrier: later commands see all writes of earlier ones.
    pub fn sync(&self) {
        let all = vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE;
        let barriers = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(all)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(all)];
        let dependency = vk::DependencyInfo::default().memory_barriers(&barriers);
        // SAFETY: recording into the frame's own buffer, outside rendering. ALL_COMMANDS includes the
        // transform-feedback stage, and MEMORY_* its accesses. Older validation layers do not check these, so
        // the barrier must cover them.
        unsafe { self.device.handle.cmd_pipeline_barrier2(self.handle, &dependency) };
    }

    /// Runs `read` with `depth` in its shader-read layout, then restores the layout.
    ///
    /// # Errors
    /// The error of `read`.
    pub fn read_depth(&mut self, depth: &Image, read: impl FnOnce(&mut Self) -> Result<()>) -> Result<()> {
        self.transition(depth, depth.layout(), depth.layout_for_shaders());
        let result = read(self);
        self.transition(depth, depth.layout_for_shaders(), depth.layout());
        result
    }

    pub(super) fn transition(&self, image: &Image, from: vk::ImageLayout, to: vk::ImageLayout) {
        if from != to {
            let barriers = [image.barrier(from, to)];
            let dependency = vk::DependencyInfo::default().image_memory_barriers(&barriers);
            // SAFETY: as `sync`.
            unsafe { self.device.handle.cmd_pipeline_barrier2(self.handle, &dependency) };
        }
    }

    /// # Errors
    /// [`Error::Limit`] if the device cannot dispatch this number of groups; out of memory.
    pub fn dispatch(
        &mut self,
        pipeline: &ComputePipeline,
        resources: &[(u32, Resource<'_>)],
        push: &[u8],
        groups: [u32; 3],
    ) -> Result<()> {
        let base = &pipeline.0;
        require_groups(&self.device.physical.limits, &base.name, groups)?;
        self.bind(base, vk::PipelineBindPoint::COMPUTE, resources, push)?;
        self.work.dispatches += 1;
        // SAFETY: pipeline, descriptors and push constants are bound.
        unsafe { self.device.handle.cmd_dispatch(self.handle, groups[0], groups[1], groups[2]) };
        Ok(())
    }

    /// Dispatches one pipeline in rounds. All dispatches share the resources; each has its own push constants
    /// and groups. The dispatches of a round are independent, and each round sees what earlier rounds wrote.
    ///
    /// # Errors
    /// As [`Cmd::dispatch`].
    pub fn dispatch_rounds<P: bytemuck::Pod>(
        &mut self,
        pipeline: &ComputePipeline,
        resources: &[(u32, Resource<'_>)],
        rounds: &[Vec<(P, [u32; 3])>],
    ) -> Result<()> {
        let base = &pipeline.0;
        let Some((first, _)) = rounds.iter().flatten().next() else { return Ok(()) };
        let limits = &self.device.physical.limits;
        rounds.iter().flatten().try_for_each(|(_, groups)| require_groups(limits, &base.name, *groups))?;
        self.bind(base, vk::PipelineBindPoint::COMPUTE, resources, bytemuck::bytes_of(first))?;
        for (n, round) in rounds.iter().enumerate() {
            if n > 0 {
                self.sync();
            }
            self.work.dispatches += round.len() as u64;
            for (push, [x, y, z]) in round {
                let (push, device) = (bytemuck::bytes_of(push), &self.device.handle);
                // SAFETY: pipeline and descriptors are bound, and barriers keep them bound. `bind` checked
                // that the push constants have the size of P.
                unsafe {
                    device.cmd_push_constants(self.handle, base.layout, base.push_stages, 0, push);
                    device.cmd_dispatch(self.handle, *x, *y, *z);
                }
            }
        }
        Ok(())
    }

    pub(crate) fn bind(
        &mut self,
        pipeline: &super::pipeline::PipelineHandles,
        point: vk::PipelineBindPoint,
        resources: &[(u32, Resource<'_>)],
        push: &[u8],
    ) -> Result<()> {
        assert_eq!(push.len(), pipeline.push_bytes as usize, "{}: bytes of push constants", pipeline.name);
        let set = self.descriptor_set(pipeline, resources)?;
        if pipeline.writes_depth
            && let Some(listing) = &mut self.listing
        {
            listing.writes_depth();
        }
        // SAFETY: layouts are those that the pipeline was created with.
        unsafe {
            self.device.handle.cmd_bind_pipeline(self.handle, point, pipeline.handle);
            if let Some(set) = set {
                self.device.handle.cmd_bind_descriptor_sets(
                    self.handle,
                    point,
                    pipeline.layout,
                    0,
                    &[set],
                    &[],
                );
            }
            if !push.is_empty() {
                self.device.handle.cmd_push_constants(
                    self.handle,
                    pipeline.layout,
                    pipeline.push_stages,
                    0,
                    push,
                );
            }
        }
        Ok(())
    }

    pub(super) fn list_buffer(&mut self, buffer: &Buffer, access: Access, elements: &str) {
        if let Some(listing) = &mut self.listing {
            listing.buffer(buffer, access, elements);
        }
    }

    pub(super) fn list_image(&mut self, image: &Image, access: Access) {
        if let Some(listing) = &mut self.listing {
            listing.image(image, access);
        }
    }

    /// Every binding that the shaders declare must be given: lavapipe 22.3 crashes if a binding of a descriptor
    /// set is not written.
    fn descriptor_set(
        &mut self,
        pipeline: &super::pipeline::PipelineHandles,
        resources: &[(u32, Resource<'_>)],
    ) -> Result<Option<vk::DescriptorSet>> {
        if pipeline.descriptors.is_empty() {
            return Ok(None);
        }
        let set = self.descriptors.allocate(
            self.device,
            pipeline.set_layout,
            &pipeline.descriptors,
            &pipeline.name,
        )?;
        for &(binding, kind) in &pipeline.descriptors {
            let resource = resources.iter().find(|(b, _)| *b == binding);
            let (_, resource) = resource
                .unwrap_or_else(|| panic!("{}: binding {binding} ({kind:?}) is not given", pipeline.name));
            self.check_range(kind, resource, &pipeline.name)?;
            self.write_descriptor(set, binding, kind, resource, &pipeline.name);
            let (access, elements) = pipeline.declared(binding);
            match resource {
                Resource::Buffer(buffer) => self.list_buffer(buffer, access, elements),
                Resource::Texture(image, _) | Resource::Sampled(image, _) => self.list_image(image, access),
            }
        }
        Ok(Some(set))
    }

    /// Checks that shaders can address all of a storage buffer. Vertex and index buffers may be larger, as long as no
    /// shader reads them.
    fn check_range(&self, kind: DescriptorKind, resource: &Resource<'_>, pipeline: &str) -> Result<()> {
        let max = u64::from(self.device.physical.limits.max_storage_buffer_range);
        match resource {
            Resource::Buffer(buffer) if kind == DescriptorKind::StorageBuffer && buffer.bytes() > max => {
                let bytes = buffer.bytes();
                let what = format!(
                    "has {bytes} bytes; {pipeline} can address {max} on this device; take a smaller mesh"
                );
                Err(Error::limit(buffer.name(), what))
            }
            _ => Ok(()),
        }
    }

    fn write_descriptor(
        &mut self,
        set: vk::DescriptorSet,
        binding: u32,
        kind: DescriptorKind,
        resource: &Resource<'_>,
        pipeline: &str,
    ) {
        let image = |texture: &Image, image_view, sampler| {
            [vk::DescriptorImageInfo { sampler, image_view, image_layout: texture.layout_for_shaders() }]
        };
        let none = vk::Sampler::null();
        let write =
            vk::WriteDescriptorSet::default().dst_set(set).dst_binding(binding).descriptor_type(kind.vk());
        let (images, buffers, texels);
        let write = match (kind, resource) {
            (DescriptorKind::SampledImage, Resource::Texture(texture, view)) => {
                let view = if *view == ReadAs::Raw { texture.raw_view } else { texture.view };
                images = image(texture, view, none);
                write.image_info(&images)
            }
            (DescriptorKind::StorageImage, Resource::Texture(texture, ReadAs::Whole)) => {
                assert!(texture.info().storage, "{pipeline}: {} was not made for stores", texture.name());
                images = image(texture, texture.view, none);
                write.image_info(&images)
            }
            (DescriptorKind::CombinedImageSampler, Resource::Sampled(texture, sampler)) => {
                images = image(texture, texture.view, sampler.handle);
                write.image_info(&images)
            }
            (DescriptorKind::TexelBuffer | DescriptorKind::StorageTexelBuffer, Resource::Buffer(buffer)) => {
                assert!(
                    buffer.texels != vk::BufferView::null(),
                    "{pipeline}: the buffer {} was made without a texel view",
                    buffer.name()
                );
                texels = [buffer.texels];
                write.texel_buffer_view(&texels)
            }
            (DescriptorKind::StorageBuffer, Resource::Buffer(buffer)) => {
                let buffer = buffer.for_frame(self.mapped);
                buffers = [vk::DescriptorBufferInfo { buffer, offset: 0, range: vk::WHOLE_SIZE }];
                write.buffer_info(&buffers)
            }
            (kind, _) => panic!("{pipeline}: binding {binding} needs a {kind:?}"),
        };
        // SAFETY: the set is fresh, the objects live until the frame has ended.
        unsafe { self.device.handle.update_descriptor_sets(&[write], &[]) };
    }

    /// Resets a query before its use. Not allowed while rendering.
    pub fn reset(&mut self, query: &StreamQuery, index: u32) {
        // SAFETY: the frame that used this index last has ended.
        unsafe { self.device.handle.cmd_reset_query_pool(self.handle, query.pool, index, 1) };
    }

    pub(crate) fn begin_statistics(&self, queries: vk::QueryPool, index: u32) {
        let none = vk::QueryControlFlags::empty();
        // SAFETY: the pool was reset at the frame's begin; begin and end are both outside rendering.
        unsafe { self.device.handle.cmd_begin_query(self.handle, queries, index, none) };
    }

    pub(crate) fn end_statistics(&self, queries: vk::QueryPool, index: u32) {
        // SAFETY: begun by `begin_statistics`.
        unsafe { self.device.handle.cmd_end_query(self.handle, queries, index) };
    }

    pub(crate) fn timestamp(&self, queries: vk::QueryPool, index: u32) {
        if self.device.timestamp_bits > 0 {
            // SAFETY: the pool was reset at the frame's begin.
            unsafe {
                self.device.handle.cmd_write_timestamp2(
                    self.handle,
                    vk::PipelineStageFlags2::ALL_COMMANDS,
                    queries,
                    index,
                );
            }
        }
    }

    pub(crate) fn begin_label(&self, label: &str) {
        if let Some(debug) = &self.device.debug {
            let label = std::ffi::CString::new(label).expect("labels hold no null");
            // SAFETY: the string lives for the call.
            unsafe {
                debug.cmd_begin_debug_utils_label(
                    self.handle,
                    &vk::DebugUtilsLabelEXT::default().label_name(&label),
                );
            }
        }
    }

    pub(crate) fn end_label(&self) {
        if let Some(debug) = &self.device.debug {
            // SAFETY: `pass` began it.
            unsafe { debug.cmd_end_debug_utils_label(self.handle) };
        }
    }
}
