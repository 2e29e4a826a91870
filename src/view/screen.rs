//! The window's side of a frame: an image of the swapchain, the picture in it, the panels over it.

use super::painter::{Painter, Painting};
use ortelius::vk::shader::Present;
use ortelius::vk::shader::view::{present_frag, present_vert};
use ortelius::vk::{
    Acquired, Blend, Clear, ColorTarget, Frame, Gpu, GraphicsInfo, GraphicsPipeline, Image, PresentMode,
    Resource, Result, Surface, Swapchain, View,
};

/// What the present pass shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrangement {
    /// First column of the second picture; as wide as the window where there is none.
    pub split: u32,
    /// Factor on the difference of both pictures; 0 shows the pictures.
    pub gain: f32,
    /// The pixel under the magnifier.
    pub magnified: Option<[i32; 2]>,
}

/// Swapchain, present pass and panels of one window.
pub struct Screen {
    pub swapchain: Swapchain,
    pub painter: Painter,
    pipeline: GraphicsPipeline,
}

/// Side of the magnifier, and how many pixels of the window it makes of one.
const LENS: u32 = 176;
const ZOOM: u32 = 8;

impl Screen {
    /// # Errors
    /// A window that the device cannot present to as asked; out of memory.
    pub fn new(gpu: &Gpu, surface: Surface, size: [u32; 2], mode: PresentMode) -> Result<Screen> {
        let swapchain = Swapchain::new(gpu, surface, size, mode)?;
        let format = swapchain.format();
        let pipeline = gpu.graphics_pipeline(&GraphicsInfo {
            name: present_frag::SHADER.name,
            vertex: &present_vert::SHADER,
            geometry: None,
            fragment: Some(&present_frag::SHADER),
            specialization: &[],
            points: false,
            depth: None,
            colors: &[format],
            blend: Blend::Replace,
        })?;
        Ok(Screen { painter: Painter::new(gpu, format)?, swapchain, pipeline })
    }

    /// An image to draw into; `None` where the window shows nothing now, or has just been given new images.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn acquire(&mut self, size: [u32; 2]) -> Result<Option<usize>> {
        match self.swapchain.acquire()? {
            Acquired::Image(number) => Ok(Some(number)),
            Acquired::Busy => Ok(None),
            Acquired::Stale => {
                self.swapchain.resize(size)?;
                Ok(None)
            }
        }
    }

    /// Records the passes of the window behind those of the picture.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        number: usize,
        [left, right]: [&Image; 2],
        arrangement: &Arrangement,
        painting: &Painting,
    ) -> Result<()> {
        let image = self.swapchain.image(number);
        frame.begin_present(image);
        frame.pass("present", |cmd| {
            let color = ColorTarget { image, clear: Clear::Float([0.0; 4]) };
            let resources = [
                (present_frag::LEFT, Resource::Texture(left, View::Raw)),
                (present_frag::RIGHT, Resource::Texture(right, View::Raw)),
            ];
            let push = arrangement.push(image.info().size);
            cmd.render(image.info().size, &[color], None, |render| {
                render.draw(&self.pipeline, &resources, bytemuck::bytes_of(&push), 3)
            })
        })?;
        frame.pass("panels", |cmd| self.painter.draw(cmd, image, painting))?;
        frame.end_present(image);
        Ok(())
    }
}

impl Arrangement {
    fn push(&self, size: [u32; 2]) -> Present {
        // Beside the pointer, on the side where there is room.
        let beside = |axis: usize, at: i32| match at as u32 > size[axis] / 2 {
            true => at - (LENS + 2 * ZOOM) as i32,
            false => at + 2 * ZOOM as i32,
        };
        let magnified = self.magnified.unwrap_or_default();
        Present {
            split: self.split,
            gain: self.gain,
            magnified,
            lens_at: [beside(0, magnified[0]), beside(1, magnified[1])],
            lens_side: if self.magnified.is_some() { LENS } else { 0 },
            zoom: ZOOM,
        }
    }
}
