//! The window's part of a frame: acquires a swapchain image, then draws the picture and the panels into it.

use super::painter::Painter;
use ortelius::vk::shader::Present;
use ortelius::vk::shader::common::screen_vert;
use ortelius::vk::shader::view::present_frag;
use ortelius::vk::{
    Acquired, Buffer, BufferUse, Clear, ColorTarget, Format, Frame, Gpu, GraphicsInfo, GraphicsPipeline,
    Image, ImageInfo, PresentMode, ReadAs, Resource, Result, Swapchain, TexelCopy, WindowSurface,
};

/// Parameters of the present pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrangement {
    /// First column of the second picture; beyond the window's width if there is only one picture, so that no divider
    /// is drawn.
    pub split: u32,
    /// Factor of the difference between both pictures; 0 shows the pictures themselves.
    pub gain: f32,
    /// The magnified pixel; `None` without magnifier.
    pub magnified: Option<[i32; 2]>,
    /// The overlay's number in present.frag; 0 for none.
    pub overlay: u32,
}

/// Inputs of the present pass.
#[derive(Clone, Copy)]
pub struct Pictures<'a> {
    pub left: &'a Image,
    /// The same as `left` if there is only one picture.
    pub right: &'a Image,
    /// The data of the overlay on the left picture: four words per pixel.
    pub words: Option<&'a Image>,
}

/// The swapchain, the present pass and the panels of one window.
pub struct Screen {
    pub swapchain: Swapchain,
    pub painter: Painter,
    /// One pipeline for any arrangement, and one for a single picture without overlay and without magnifier.
    pipelines: [GraphicsPipeline; 2],
    /// Bound in place of the overlay's data if there is no overlay.
    no_words: Image,
    /// The copy of the last frame's image, if that image is read back.
    copy: Option<Buffer>,
    resized: bool,
}

/// The passes that draw the picture and the panels into the window.
pub const PASSES: [&str; 2] = ["present", "panels"];

/// Side of the magnifier in pixels, and its magnification.
pub const LENS: u32 = 176;
const ZOOM: u32 = 8;

impl Screen {
    /// `read`: true if images can be read back.
    ///
    /// # Errors
    /// The device cannot present to the window as requested; out of memory.
    pub fn new(
        gpu: &Gpu,
        surface: WindowSurface,
        size: [u32; 2],
        (modes, read): (Vec<PresentMode>, bool),
    ) -> Result<Screen> {
        let swapchain = Swapchain::new(gpu, surface, size, modes, read)?;
        let format = swapchain.format();
        let no_words = gpu.image("no overlay", ImageInfo::target([1, 1], Format::Rgba32Uint))?;
        Ok(Screen {
            painter: Painter::new(gpu, format, swapchain.takes_copies())?,
            swapchain,
            pipelines: pipelines(gpu, format)?,
            no_words,
            copy: None,
            resized: false,
        })
    }

    /// Rebuilds the present pass's pipelines from reloaded shaders.
    ///
    /// # Errors
    /// The driver cannot compile a pipeline.
    pub fn rebuild(&mut self, gpu: &Gpu) -> Result<()> {
        self.pipelines = pipelines(gpu, self.swapchain.format())?;
        self.painter.rebuild()
    }

    /// Also copies the next frame's image to the host.
    ///
    /// # Errors
    /// Out of memory.
    pub fn read_next(&mut self, gpu: &Gpu) -> Result<()> {
        let [width, height] = self.swapchain.size().map(u64::from);
        self.copy = Some(gpu.buffer("window", 4 * width * height, BufferUse::Readback)?);
        Ok(())
    }

    /// The buffer with the image that [`Screen::read_next`] requested; returned once. The buffer is complete when the
    /// frame that drew the image has ended.
    pub fn take_read(&mut self) -> Option<Buffer> {
        self.copy.take()
    }

    /// Call this if the window may have another size. Not every system reports a new size when an image is presented:
    /// under Wayland the images determine the window's size.
    pub fn note_resize(&mut self) {
        self.resized = true;
    }

    /// Acquires an image to draw into. `None` if no image is available, or if the swapchain was just
    /// recreated.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn acquire(&mut self, size: [u32; 2]) -> Result<Option<usize>> {
        if std::mem::take(&mut self.resized) && !self.swapchain.fits(size)? {
            self.swapchain.resize(size)?;
        }
        match self.swapchain.acquire()? {
            Acquired::Image(number) => Ok(Some(number)),
            Acquired::Busy => Ok(None),
            Acquired::Stale => {
                self.swapchain.resize(size)?;
                Ok(None)
            }
        }
    }

    /// Records the passes that draw into the window, after those of the picture.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        number: usize,
        Pictures { left, right, words }: Pictures<'_>,
        arrangement: &Arrangement,
    ) -> Result<()> {
        let image = self.swapchain.image(number);
        frame.begin_present(image);
        frame.pass(PASSES[0], |cmd| {
            // The draws of this pass and of the panels replace every pixel.
            let color = ColorTarget { image, clear: Clear::Discard };
            let resources = [
                (present_frag::LEFT, Resource::Texture(left, ReadAs::Raw)),
                (present_frag::RIGHT, Resource::Texture(right, ReadAs::Raw)),
                (present_frag::WORDS, Resource::Texture(words.unwrap_or(&self.no_words), ReadAs::Whole)),
            ];
            let overlay = if words.is_some() { arrangement.overlay } else { 0 };
            let push = Present { overlay, ..arrangement.push(image.info().size) };
            let pipeline = &self.pipelines[usize::from(arrangement.is_plain(image.info().size))];
            let parts = self.painter.uncovered(image.info().size);
            cmd.render(image.info().size, &[color], None, |render| {
                render.draw_parts(pipeline, &resources, bytemuck::bytes_of(&push), (3, &parts))
            })
        })?;
        frame.pass(PASSES[1], |cmd| self.painter.draw(cmd, image))?;
        if let Some(buffer) = &self.copy {
            let copy = TexelCopy { offset: 0, mip: 0, layer: 0, at: [0; 2], size: image.info().size };
            frame.pass("copy of the window", |cmd| cmd.copy_from_image(image, buffer, &[copy]))?;
        }
        frame.end_present(image);
        Ok(())
    }
}

fn pipelines(gpu: &Gpu, format: Format) -> Result<[GraphicsPipeline; 2]> {
    let pipeline = |plain| {
        gpu.graphics_pipeline(&GraphicsInfo {
            colors: &[format],
            specialization: &[("PLAIN", plain)],
            ..GraphicsInfo::triangles(&screen_vert::SHADER, &present_frag::SHADER)
        })
    };
    Ok([pipeline(0)?, pipeline(1)?])
}

/// First column and row of the magnifier, placed on the side of the pointer with more room.
pub fn lens_at(pointer: [i32; 2], size: [u32; 2]) -> [i32; 2] {
    [0, 1].map(|axis| match pointer[axis] as u32 > size[axis] / 2 {
        true => pointer[axis] - (LENS + 2 * ZOOM) as i32,
        false => pointer[axis] + 2 * ZOOM as i32,
    })
}

impl Arrangement {
    /// True for one picture without overlay and without magnifier.
    fn is_plain(&self, [width, _]: [u32; 2]) -> bool {
        self.split > width && self.gain == 0.0 && self.magnified.is_none() && self.overlay == 0
    }

    fn push(&self, size: [u32; 2]) -> Present {
        let magnified = self.magnified.unwrap_or_default();
        Present {
            split: self.split,
            gain: self.gain,
            magnified,
            lens_at: lens_at(magnified, size),
            lens_side: if self.magnified.is_some() { LENS } else { 0 },
            zoom: ZOOM,
            overlay: self.overlay,
        }
    }
}
