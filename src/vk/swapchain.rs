//! A window's surface and the images that are presented to it.
//!
//! An image that no longer fits the window is a value ([`Acquired::Stale`]), not an error: resizing,
//! minimising and losing the surface are normal events.

use super::features::cannot_present;
use super::instance::Instance;
use super::ring::Ring;
use super::{Check, Error, FRAMES_IN_FLIGHT, Format, Gpu, Image, Result, Semaphore};
use ash::{khr, vk};
use raw_window_handle::{HasDisplayHandle, HasWindowHandle, RawDisplayHandle, RawWindowHandle};
use std::any::Any;
use std::sync::{Arc, MutexGuard};
use std::time::Duration;

/// When a finished picture replaces the displayed one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PresentMode {
    /// First in, first out, at the display's rate. Every device supports it.
    Fifo,
    /// The newest picture, at the display's rate.
    Mailbox,
    /// Immediately; may tear.
    Immediate,
}

/// Longest wait of an acquisition. A hidden window may never return an image.
const PATIENCE_NS: u64 = 100_000_000;

/// Number of attempts, 0.1 ms apart, to find a moment at which no frame is being recorded. Recording takes
/// milliseconds; a frame that is never submitted is a bug. Attempts are counted instead of time, because time also
/// passes while the process is stopped.
const MAX_ATTEMPTS: u32 = 600_000;

/// A window surface that a device can present to. Keeps the window alive.
pub struct WindowSurface {
    handle: vk::SurfaceKHR,
    calls: khr::surface::Instance,
    display: RawDisplayHandle,
    window: RawWindowHandle,
    _instance: Arc<Instance>,
    /// Dropped last, because the handles above belong to the window.
    _keeps: Arc<dyn Any>,
}

/// Result of [`Swapchain::acquire`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Acquired {
    /// The image with this number can be drawn into.
    Image(usize),
    /// The images no longer fit the window; call [`Swapchain::resize`].
    Stale,
    /// No image was available within 0.1 s. Skip the frame and try again.
    Busy,
}

/// The images of a window.
pub struct Swapchain {
    gpu: Gpu,
    calls: khr::swapchain::Device,
    handle: vk::SwapchainKHR,
    images: Vec<Image>,
    /// One for each image, signalled when rendering into it ends.
    drawn: Vec<Semaphore>,
    /// Used in rotation. There is one more than frames in flight, so that the last frame that waited for a
    /// semaphore has ended before the semaphore is used again.
    acquired: Vec<Semaphore>,
    next: usize,
    /// Requested present modes; the first one that the window supports is used.
    modes: Vec<PresentMode>,
    format: Format,
    /// True if the images can be copied from.
    read: bool,
    /// True if the images can be copied into.
    takes_copies: bool,
    surface: WindowSurface,
}

impl WindowSurface {
    fn create(gpu: &Gpu, display: RawDisplayHandle, window: RawWindowHandle) -> Result<vk::SurfaceKHR> {
        let instance = &gpu.device.instance;
        // SAFETY: both handles are those of a window that the surface keeps alive.
        let handle =
            unsafe { ash_window::create_surface(&instance.entry, &instance.handle, display, window, None) };
        handle.check("vkCreateSurfaceKHR", "window")
    }
}

impl Gpu {
    /// The surface of a window; the device must have been opened for its display.
    ///
    /// # Errors
    /// [`Error::Limit`] if the device cannot present to it.
    pub fn surface<W>(&self, window: &Arc<W>) -> Result<WindowSurface>
    where
        W: HasWindowHandle + HasDisplayHandle + 'static,
    {
        let limit = |what: String| Error::limit("window", what);
        let display = window.display_handle().map_err(|error| limit(error.to_string()))?.as_raw();
        let raw = window.window_handle().map_err(|error| limit(error.to_string()))?.as_raw();
        let instance = &self.device.instance;
        let surface = WindowSurface {
            handle: WindowSurface::create(self, display, raw)?,
            calls: khr::surface::Instance::new(&instance.entry, &instance.handle),
            display,
            window: raw,
            _instance: instance.clone(),
            _keeps: window.clone(),
        };
        let (physical, family) = (self.device.physical.handle, self.device.queue_family);
        // SAFETY: plain query on live handles.
        let presents =
            unsafe { surface.calls.get_physical_device_surface_support(physical, family, surface.handle) };
        match presents.check("vkGetPhysicalDeviceSurfaceSupportKHR", "window")? {
            true => Ok(surface),
            false => Err(cannot_present(&self.device.physical.name)),
        }
    }
}

impl PresentMode {
    fn vk(self) -> vk::PresentModeKHR {
        match self {
            PresentMode::Fifo => vk::PresentModeKHR::FIFO,
            PresentMode::Mailbox => vk::PresentModeKHR::MAILBOX,
            PresentMode::Immediate => vk::PresentModeKHR::IMMEDIATE,
        }
    }
}

impl Swapchain {
    /// Creates images for a window of about `size` pixels; `read`: they can also be copied from.
    ///
    /// # Errors
    /// [`Error::Limit`] if the window has none of these present modes, no 8-bit format, or no readable images.
    pub fn new(
        gpu: &Gpu,
        surface: WindowSurface,
        size: [u32; 2],
        modes: Vec<PresentMode>,
        read: bool,
    ) -> Result<Swapchain> {
        let acquired = (0..=FRAMES_IN_FLIGHT).map(|_| gpu.semaphore("acquired")).collect::<Result<_>>()?;
        let mut swapchain = Swapchain {
            gpu: gpu.clone(),
            calls: khr::swapchain::Device::new(&gpu.device.instance.handle, &gpu.device.handle),
            handle: vk::SwapchainKHR::null(),
            images: Vec::new(),
            drawn: Vec::new(),
            acquired,
            next: 0,
            modes,
            format: Format::Bgra8,
            read,
            takes_copies: false,
            surface,
        };
        swapchain.format = swapchain.choose_format()?;
        let capabilities =
            swapchain.capabilities().check("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", "window")?;
        swapchain.takes_copies =
            capabilities.supported_usage_flags.contains(vk::ImageUsageFlags::TRANSFER_DST);
        swapchain.resize(size)?;
        Ok(swapchain)
    }

    /// Size of the images in pixels; 0 x 0 while there are no images.
    pub fn size(&self) -> [u32; 2] {
        self.images.first().map_or([0; 2], |image| image.info().size)
    }

    /// Format of the images.
    pub fn format(&self) -> Format {
        self.format
    }

    /// True if the images can be copied into. Vulkan does not guarantee it.
    pub fn takes_copies(&self) -> bool {
        self.takes_copies
    }

    pub fn image(&self, number: usize) -> &Image {
        &self.images[number]
    }

    /// The semaphores of a submission that draws into image `number`: the one it waits for, then the one it
    /// signals.
    pub fn semaphores(&self, number: usize) -> [&Semaphore; 2] {
        [&self.acquired[self.next], &self.drawn[number]]
    }

    /// Creates new images, for a resized window or after [`Acquired::Stale`]. If the system knows the
    /// window's size, `size` is ignored. A window of no pixels gets no images.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<()> {
        let capabilities = match self.capabilities() {
            Err(vk::Result::ERROR_SURFACE_LOST_KHR) => {
                self.replace_surface()?;
                self.capabilities()
            }
            found => found,
        };
        let capabilities = capabilities.check("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", "window")?;
        let extent = extent(&capabilities, size);
        self.clear_images()?;
        if extent.width == 0 || extent.height == 0 {
            self.destroy();
            return Ok(());
        }
        self.create(&capabilities, extent)
    }

    fn create(&mut self, capabilities: &vk::SurfaceCapabilitiesKHR, extent: vk::Extent2D) -> Result<()> {
        let (format, mode, usage) = (self.format, self.check_mode()?, self.usage(capabilities)?);
        let max = if capabilities.max_image_count == 0 { u32::MAX } else { capabilities.max_image_count };
        let old = self.handle;
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(self.surface.handle)
            .min_image_count((capabilities.min_image_count + 1).min(max))
            .image_format(format.vk())
            .image_color_space(vk::ColorSpaceKHR::SRGB_NONLINEAR)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(usage)
            .pre_transform(capabilities.current_transform)
            .composite_alpha(opaque(capabilities))
            .present_mode(mode)
            .clipped(true)
            .old_swapchain(old);
        // SAFETY: the surface lives; the device has passed every use of the old images.
        let created = unsafe { self.calls.create_swapchain(&info, None) };
        self.destroy();
        self.handle = created.check("vkCreateSwapchainKHR", "window")?;
        self.gpu.device.name(self.handle, "window");
        // SAFETY: just created.
        let handles = unsafe { self.calls.get_swapchain_images(self.handle) };
        let handles = handles.check("vkGetSwapchainImagesKHR", "window")?;
        let size = [extent.width, extent.height];
        let image = |handle| Image::of_swapchain(&self.gpu, handle, size, format);
        self.images = handles.into_iter().map(image).collect::<Result<_>>()?;
        self.drawn = self.images.iter().map(|_| self.gpu.semaphore("drawn")).collect::<Result<_>>()?;
        Ok(())
    }

    /// True if the images have the size of the window. `size` is as in [`Swapchain::resize`].
    ///
    /// # Errors
    /// Device lost.
    pub fn fits(&self, size: [u32; 2]) -> Result<bool> {
        match self.capabilities() {
            Err(vk::Result::ERROR_SURFACE_LOST_KHR) => Ok(false),
            found => {
                let found = found.check("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", "window")?;
                let extent = extent(&found, size);
                Ok([extent.width, extent.height] == self.size())
            }
        }
    }

    /// Acquires the next image to draw into.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn acquire(&mut self) -> Result<Acquired> {
        if self.images.is_empty() {
            return Ok(Acquired::Stale);
        }
        let next = (self.next + 1) % self.acquired.len();
        let (semaphore, fence) = (self.acquired[next].handle, vk::Fence::null());
        // SAFETY: the frame that waited for the semaphore has ended: there is one semaphore more than frames in flight.
        match unsafe { self.calls.acquire_next_image(self.handle, PATIENCE_NS, semaphore, fence) } {
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => Ok(Acquired::Busy),
            Err(stale) if is_stale(stale) => Ok(Acquired::Stale),
            acquired => {
                // Suboptimal images can still be drawn into; presenting reports the state again.
                let (number, _) = acquired.check("vkAcquireNextImageKHR", "window")?;
                self.next = next;
                Ok(Acquired::Image(number as usize))
            }
        }
    }

    /// Presents image `number` once the submission that drew it has ended. Returns whether the images can
    /// still be used. Suboptimal images of the right size stay, because new ones would be suboptimal too.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn present(&mut self, number: usize, size: [u32; 2]) -> Result<bool> {
        let waits = [self.drawn[number].handle];
        let (swapchains, numbers) = ([self.handle], [number as u32]);
        let info = vk::PresentInfoKHR::default()
            .wait_semaphores(&waits)
            .swapchains(&swapchains)
            .image_indices(&numbers);
        // The queue is only used under the ring's lock.
        let ring = self.gpu.lock_ring();
        // SAFETY: the image was acquired, and a submission signals the semaphore.
        let presented = unsafe { self.calls.queue_present(self.gpu.device.queue, &info) };
        drop(ring);
        match presented {
            Err(stale) if is_stale(stale) => Ok(false),
            presented => match presented.check("vkQueuePresentKHR", "window")? {
                true => self.fits(size),
                false => Ok(true),
            },
        }
    }

    fn capabilities(&self) -> std::result::Result<vk::SurfaceCapabilitiesKHR, vk::Result> {
        let physical = self.gpu.device.physical.handle;
        // SAFETY: plain query on live handles.
        unsafe { self.surface.calls.get_physical_device_surface_capabilities(physical, self.surface.handle) }
    }

    /// UNORM, without sRGB encoding: the present pass encodes, and the panel library blends in sRGB.
    fn choose_format(&self) -> Result<Format> {
        let physical = self.gpu.device.physical.handle;
        // SAFETY: plain query on live handles.
        let formats =
            unsafe { self.surface.calls.get_physical_device_surface_formats(physical, self.surface.handle) };
        let formats = formats.check("vkGetPhysicalDeviceSurfaceFormatsKHR", "window")?;
        let has = |format: &Format| {
            formats.iter().any(|found| {
                found.format == format.vk() && found.color_space == vk::ColorSpaceKHR::SRGB_NONLINEAR
            })
        };
        let what = "supports neither 8-bit BGRA nor 8-bit RGBA; choose another --device";
        [Format::Bgra8, Format::Rgba8].into_iter().find(has).ok_or_else(|| Error::limit("window", what))
    }

    fn usage(&self, capabilities: &vk::SurfaceCapabilitiesKHR) -> Result<vk::ImageUsageFlags> {
        use vk::ImageUsageFlags as U;
        let supported = capabilities.supported_usage_flags;
        if self.read && !supported.contains(U::TRANSFER_SRC) {
            let what = "its images cannot be read, so changes of the picture cannot be counted";
            return Err(Error::limit("window", what));
        }
        let read = if self.read { U::TRANSFER_SRC } else { U::empty() };
        let written = if self.takes_copies { U::TRANSFER_DST } else { U::empty() };
        Ok(U::COLOR_ATTACHMENT | read | written)
    }

    fn check_mode(&self) -> Result<vk::PresentModeKHR> {
        let physical = self.gpu.device.physical.handle;
        let surface = &self.surface;
        // SAFETY: plain query on live handles.
        let modes =
            unsafe { surface.calls.get_physical_device_surface_present_modes(physical, surface.handle) };
        let modes = modes.check("vkGetPhysicalDeviceSurfacePresentModesKHR", "window")?;
        let found = self.modes.iter().map(|mode| mode.vk()).find(|mode| modes.contains(mode));
        found.ok_or_else(|| {
            let what = format!("--present {:?} is not supported here; available: {modes:?}", self.modes[0]);
            Error::limit("window", what.to_lowercase())
        })
    }

    /// Recreates a lost surface from the same window.
    fn replace_surface(&mut self) -> Result<()> {
        self.clear_images()?;
        self.destroy();
        // SAFETY: its swapchain was destroyed.
        unsafe { self.surface.calls.destroy_surface(self.surface.handle, None) };
        self.surface.handle = vk::SurfaceKHR::null();
        self.surface.handle = WindowSurface::create(&self.gpu, self.surface.display, self.surface.window)?;
        Ok(())
    }

    /// Waits until the GPU and the presentation engine no longer use the images.
    fn clear_images(&mut self) -> Result<()> {
        let ring = lock_between_frames(&self.gpu);
        // Presentation signals no fence or semaphore. Its semaphores are free only when the queue is idle.
        // SAFETY: the queue is used only under the ring's lock.
        let idle = unsafe { self.gpu.device.handle.queue_wait_idle(self.gpu.device.queue) };
        idle.check("vkQueueWaitIdle", "window")?;
        self.images.clear();
        self.drawn.clear();
        // Views must be destroyed before their images.
        self.gpu.device.collect(ring.submitted);
        Ok(())
    }

    fn destroy(&mut self) {
        // SAFETY: nothing names its images any more; null is ignored.
        unsafe { self.calls.destroy_swapchain(self.handle, None) };
        self.handle = vk::SwapchainKHR::null();
    }
}

/// The ring's lock, taken when no thread records a frame. A frame being recorded keeps dropped objects alive.
fn lock_between_frames(gpu: &Gpu) -> MutexGuard<'_, Ring> {
    for _ in 0..MAX_ATTEMPTS {
        let ring = gpu.lock_ring();
        if gpu.device.objects().recording == 0 {
            return ring;
        }
        drop(ring);
        std::thread::sleep(Duration::from_micros(100));
    }
    panic!("the window's images are replaced while frames are recorded");
}

fn is_stale(result: vk::Result) -> bool {
    matches!(result, vk::Result::ERROR_OUT_OF_DATE_KHR | vk::Result::ERROR_SURFACE_LOST_KHR)
}

fn extent(capabilities: &vk::SurfaceCapabilitiesKHR, [width, height]: [u32; 2]) -> vk::Extent2D {
    let (min, max) = (capabilities.min_image_extent, capabilities.max_image_extent);
    match capabilities.current_extent {
        // This value means that the images determine the window's size.
        vk::Extent2D { width: u32::MAX, .. } => vk::Extent2D {
            width: width.clamp(min.width, max.width),
            height: height.clamp(min.height, max.height),
        },
        extent => extent,
    }
}

fn opaque(capabilities: &vk::SurfaceCapabilitiesKHR) -> vk::CompositeAlphaFlagsKHR {
    let opaque = vk::CompositeAlphaFlagsKHR::OPAQUE;
    match capabilities.supported_composite_alpha.contains(opaque) {
        true => opaque,
        false => vk::CompositeAlphaFlagsKHR::INHERIT,
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        if let Err(error) = self.clear_images() {
            tracing::warn!("while the window closed: {error}");
        }
        self.destroy();
    }
}

impl Drop for WindowSurface {
    fn drop(&mut self) {
        // SAFETY: the swapchain owns the surface and was destroyed before it.
        unsafe { self.calls.destroy_surface(self.handle, None) };
    }
}
