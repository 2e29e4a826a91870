//! Images and their views.

use super::device::{Dead, Device};
use super::{BufferUse, Check, Error, Format, Gpu, Result, TexelCopy};
use ash::vk;
use gpu_allocator::{MemoryLocation, vulkan::Allocation};
use std::sync::Arc;

/// Description of an image to create.
#[derive(Clone, Copy, Debug)]
pub struct ImageInfo {
    pub size: [u32; 2],
    pub format: Format,
    pub mip_levels: u32,
    /// More than one layer requires `array`.
    pub layers: u32,
    /// Shaders see an array of layers.
    pub array: bool,
    pub attachment: bool,
    /// Shaders write it with image stores and atomics.
    pub storage: bool,
}

impl ImageInfo {
    /// A render target with a single level, which passes also read.
    pub fn target(size: [u32; 2], format: Format) -> Self {
        ImageInfo { size, format, mip_levels: 1, layers: 1, array: false, attachment: true, storage: false }
    }

    /// A sampled texture with `mip_levels` levels.
    pub fn texture(size: [u32; 2], format: Format, mip_levels: u32) -> Self {
        ImageInfo { size, format, mip_levels, layers: 1, array: false, attachment: false, storage: false }
    }

    /// Size of one mip level in texels.
    pub fn mip_size(&self, mip: u32) -> [u32; 2] {
        self.size.map(|side| side.checked_shr(mip).unwrap_or(0).max(1))
    }

    /// Bytes of all levels and layers, without the driver's padding.
    pub fn bytes(&self) -> u64 {
        let levels = (0..self.mip_levels).map(|mip| self.format.bytes(self.mip_size(mip)));
        levels.sum::<u64>() * u64::from(self.layers)
    }
}

/// An image, its memory, and a view of all of it. Rgba8Srgb has a second view without sRGB decoding.
pub struct Image {
    pub(crate) handle: vk::Image,
    pub(crate) view: vk::ImageView,
    pub(crate) raw_view: vk::ImageView,
    device: Arc<Device>,
    memory: Option<Allocation>,
    /// True for swapchain images: the swapchain destroys the handle.
    borrowed: bool,
    info: ImageInfo,
    name: String,
}

/// A part of a target: first column and row, and the size, in pixels.
pub type TargetPart = ([u32; 2], [u32; 2]);

/// Which view of an image a shader reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadAs {
    /// All of it, in the image's own format.
    Whole,
    /// Rgba8Srgb without the decoding.
    Raw,
}

impl Gpu {
    /// # Errors
    /// [`Error::Limit`] if the device does not support this format or size; [`Error::OutOfMemory`].
    pub fn image(&self, name: &str, info: ImageInfo) -> Result<Image> {
        let device = &self.device;
        let raw = info.format == Format::Rgba8Srgb;
        let views = [Format::Rgba8Srgb.vk(), Format::Rgba8.vk()];
        let mut list = vk::ImageFormatListCreateInfo::default().view_formats(&views);
        let mut create = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(info.format.vk())
            .extent(vk::Extent3D { width: info.size[0], height: info.size[1], depth: 1 })
            .mip_levels(info.mip_levels)
            .array_layers(info.layers)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(usage(&info))
            .flags(if raw { vk::ImageCreateFlags::MUTABLE_FORMAT } else { vk::ImageCreateFlags::empty() });
        if raw {
            // Without the list, some drivers do not compress an image that has views of another format.
            create = create.push_next(&mut list);
        }
        self.check_limits(name, &info, &create)?;
        // SAFETY: the device lives; memory is bound before any use.
        let handle = unsafe { device.handle.create_image(&create, None) }.check("vkCreateImage", name)?;
        let mut image = Image {
            handle,
            view: vk::ImageView::null(),
            raw_view: vk::ImageView::null(),
            device: device.clone(),
            memory: None,
            borrowed: false,
            info,
            name: name.to_string(),
        };
        // SAFETY: as above.
        let requirements = unsafe { device.handle.get_image_memory_requirements(handle) };
        let memory =
            image.memory.insert(device.allocate(name, requirements, MemoryLocation::GpuOnly, false)?);
        // SAFETY: the allocation fits the requirements and is bound once.
        unsafe { device.handle.bind_image_memory(handle, memory.memory(), memory.offset()) }
            .check("vkBindImageMemory", name)?;
        image.view = image.create_view(info.format)?;
        if raw {
            image.raw_view = image.create_view(Format::Rgba8)?;
        }
        device.name(handle, name);
        device.name(image.view, name);
        if raw {
            device.name(image.raw_view, &format!("{name}, raw"));
        }
        // The next submission starts with this transition.
        let barrier = image.barrier(vk::ImageLayout::UNDEFINED, image.layout());
        device.objects().new_images.push(barrier);
        Ok(image)
    }

    /// Fills the mip levels of an image, finest first. Waits for the copy.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn fill_levels(&self, image: &Image, levels: &[Vec<u8>]) -> Result<()> {
        let mut staging =
            self.buffer("level staging", levels.iter().map(|l| l.len() as u64).sum(), BufferUse::Upload)?;
        let mut copies = Vec::new();
        let mut offset = 0;
        for (mip, level) in levels.iter().enumerate() {
            let size = image.mip_size(mip as u32);
            assert_eq!(
                level.len() as u64,
                image.info().format.bytes(size),
                "{}: byte count of mip {mip}",
                image.name()
            );
            staging.mapped_mut()[offset..offset + level.len()].copy_from_slice(level);
            copies.push(TexelCopy { offset: offset as u64, mip: mip as u32, layer: 0, at: [0; 2], size });
            offset += level.len();
        }
        self.run_pass("fill levels", |cmd| cmd.copy_to_image(&staging, image, &copies))?;
        Ok(())
    }

    /// All texels of an image's first level, tightly packed. Waits for all earlier frames.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn read_image(&self, image: &Image) -> Result<Vec<u8>> {
        self.read_image_with(image, <[u8]>::to_vec)
    }

    /// As [`Gpu::read_image`], but `read` receives the texels in mapped memory: no `Vec` is made.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn read_image_with<T>(&self, image: &Image, read: impl FnOnce(&[u8]) -> T) -> Result<T> {
        let size = image.info.size;
        let bytes = image.info.format.bytes(size);
        let host = self.buffer("image read-back", bytes, BufferUse::Readback)?;
        let whole = TexelCopy { offset: 0, mip: 0, layer: 0, at: [0; 2], size };
        self.run_pass("image read-back", |cmd| cmd.copy_from_image(image, &host, &[whole]))?;
        Ok(read(&host.mapped()))
    }

    /// True if passes can render into the format.
    pub fn renders_to(&self, format: Format) -> bool {
        let wanted = vk::FormatFeatureFlags::COLOR_ATTACHMENT | vk::FormatFeatureFlags::SAMPLED_IMAGE;
        self.optimal_features(format).contains(wanted)
    }

    fn optimal_features(&self, format: Format) -> vk::FormatFeatureFlags {
        // SAFETY: plain query of a live device.
        let properties = unsafe {
            self.device
                .instance
                .handle
                .get_physical_device_format_properties(self.device.physical.handle, format.vk())
        };
        properties.optimal_tiling_features
    }

    /// Checks the device's limits for exactly this format and use. Beyond them `vkCreateImage` is undefined
    /// behaviour.
    fn check_limits(&self, name: &str, info: &ImageInfo, create: &vk::ImageCreateInfo<'_>) -> Result<()> {
        let limit = |what: String| Err(Error::limit(name, what));
        // SAFETY: plain query of a live device.
        let max = unsafe {
            self.device.instance.handle.get_physical_device_image_format_properties(
                self.device.physical.handle,
                create.format,
                create.image_type,
                create.tiling,
                create.usage,
                create.flags,
            )
        };
        let max = match max {
            Err(vk::Result::ERROR_FORMAT_NOT_SUPPORTED) => {
                return limit(format!("this device does not support {:?} images for this use", info.format));
            }
            max => max.check("vkGetPhysicalDeviceImageFormatProperties", name)?,
        };
        let [width, height] = info.size;
        if width > max.max_extent.width || height > max.max_extent.height {
            let (max_width, max_height) = (max.max_extent.width, max.max_extent.height);
            return limit(format!(
                "needs {width} x {height} texels; this device supports {max_width} x {max_height} of {:?}",
                info.format
            ));
        }
        let atomics = vk::FormatFeatureFlags::STORAGE_IMAGE_ATOMIC;
        if info.storage && !self.optimal_features(info.format).contains(atomics) {
            return limit(format!(
                "this device has no atomics on {:?} texels; choose another variant.dedup",
                info.format
            ));
        }
        if info.layers > max.max_array_layers || info.mip_levels > max.max_mip_levels {
            return limit(format!(
                "needs {} layers of {} levels; this device supports {} of {}",
                info.layers, info.mip_levels, max.max_array_layers, max.max_mip_levels
            ));
        }
        // The driver's padding comes on top, so allocation may still fail.
        let bytes = info.bytes();
        if bytes > max.max_resource_size {
            return limit(format!(
                "needs {bytes} bytes in one image; this device supports {}; choose smaller caches, tiles or pictures",
                max.max_resource_size
            ));
        }
        Ok(())
    }
}

fn usage(info: &ImageInfo) -> vk::ImageUsageFlags {
    use vk::ImageUsageFlags as U;
    let attachment = match (info.attachment, info.format) {
        (false, _) => U::empty(),
        (true, Format::Depth32Float) => U::DEPTH_STENCIL_ATTACHMENT,
        (true, _) => U::COLOR_ATTACHMENT,
    };
    let storage = if info.storage { U::STORAGE } else { U::empty() };
    attachment | storage | U::SAMPLED | U::TRANSFER_SRC | U::TRANSFER_DST
}

impl Image {
    /// A swapchain image to render into. It is in GENERAL only between [`super::Frame::begin_present`] and
    /// [`super::Frame::end_present`].
    #[cfg(feature = "window")]
    pub(crate) fn of_swapchain(
        gpu: &Gpu,
        handle: vk::Image,
        size: [u32; 2],
        format: Format,
    ) -> Result<Image> {
        let mut image = Image {
            handle,
            view: vk::ImageView::null(),
            raw_view: vk::ImageView::null(),
            device: gpu.device.clone(),
            memory: None,
            borrowed: true,
            info: ImageInfo::target(size, format),
            name: "window".to_owned(),
        };
        image.view = image.create_view(format)?;
        image.device.name(handle, &image.name);
        image.device.name(image.view, &image.name);
        Ok(image)
    }

    pub fn info(&self) -> &ImageInfo {
        &self.info
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    /// Size of one mip level in texels.
    pub fn mip_size(&self, mip: u32) -> [u32; 2] {
        self.info.mip_size(mip)
    }

    /// Bytes of all levels and layers, without the driver's padding.
    pub fn bytes(&self) -> u64 {
        self.info.bytes()
    }

    /// The layout in which the image stays. Some drivers compress depth in a layout of its own, but not in GENERAL.
    pub(crate) fn layout(&self) -> vk::ImageLayout {
        match self.info.format {
            Format::Depth32Float => vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
            _ => vk::ImageLayout::GENERAL,
        }
    }

    /// The layout in which shaders read the image; see [`super::Cmd::read_depth`].
    pub(crate) fn layout_for_shaders(&self) -> vk::ImageLayout {
        match self.info.format {
            Format::Depth32Float => vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
            _ => vk::ImageLayout::GENERAL,
        }
    }

    /// A change of layout between all earlier commands and all later ones.
    pub(crate) fn barrier(
        &self,
        from: vk::ImageLayout,
        to: vk::ImageLayout,
    ) -> vk::ImageMemoryBarrier2<'static> {
        let all = vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE;
        vk::ImageMemoryBarrier2::default()
            .image(self.handle)
            .old_layout(from)
            .new_layout(to)
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(all)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(all)
            .subresource_range(self.whole())
    }

    pub(crate) fn whole(&self) -> vk::ImageSubresourceRange {
        vk::ImageSubresourceRange {
            aspect_mask: self.info.format.aspect(),
            base_mip_level: 0,
            level_count: self.info.mip_levels,
            base_array_layer: 0,
            layer_count: self.info.layers,
        }
    }

    fn create_view(&self, format: Format) -> Result<vk::ImageView> {
        let info = vk::ImageViewCreateInfo::default()
            .image(self.handle)
            .view_type(match self.info.array {
                true => vk::ImageViewType::TYPE_2D_ARRAY,
                false => vk::ImageViewType::TYPE_2D,
            })
            .format(format.vk())
            .subresource_range(self.whole());
        // SAFETY: image and device live.
        unsafe { self.device.handle.create_image_view(&info, None) }.check("vkCreateImageView", &self.name)
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        let views = [self.view, self.raw_view].into_iter().filter(|v| *v != vk::ImageView::null()).collect();
        let handle = if self.borrowed { vk::Image::null() } else { self.handle };
        self.device.bury(Dead::Image(handle, views, self.memory.take()));
    }
}
