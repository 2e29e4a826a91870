//! Stage 1, section 2.1: writes the triple (q, i, j) of each pixel. (i, j) is the level-0 tile at the pixel's texture
//! coordinate, and q is the level for the pixel's footprint.
//!
//! Differences from the paper: `floor(log2)` is the exponent of a float, so that q is exact. A footprint of length 0
//! gives level 0. A footprint that is not finite gives the resident mip tail (the paper's G1). Pixels that no surface
//! covers hold q = -1, [`BACKGROUND`].

use super::{Config, RequestFormat, pyramid_constants, with};
use crate::frame::{DrawList, Onto};
use crate::math::pyramid::Pyramid;
use crate::vk::shader::Shader;
use crate::vk::shader::common::mesh_vert;
use crate::vk::shader::virtual_texture::{footprint_dump_frag, footprint_frag};
use crate::vk::{
    Clear, Cmd, ColorTarget, Depth, DepthTarget, Format, Gpu, GraphicsInfo, GraphicsPipeline, Image,
    ImageInfo, Result,
};
use std::sync::Arc;

/// q of a pixel that the mesh does not cover.
pub const BACKGROUND: u32 = u32::MAX;

/// The request image, its depth image, and the pass that draws both.
pub struct FootprintPass {
    pub requests: Image,
    pub depth: Arc<Image>,
    pub format: RequestFormat,
    /// True if each triple is stored with its reach: the neighbouring tiles that the filter also reads
    /// ([`super::reach`]).
    pub reaches: bool,
    pipeline: GraphicsPipeline,
}

fn pipeline(
    gpu: &Gpu,
    fragment: &'static Shader,
    pyramid: &Pyramid,
    config: &Config,
    format: RequestFormat,
    (colors, depth): (&[Format], Depth),
    pixel_log2: u32,
) -> Result<GraphicsPipeline> {
    gpu.graphics_pipeline(&GraphicsInfo {
        specialization: &with(
            pyramid_constants(pyramid, format, &config.filter),
            &[config.filter.level_constants(), vec![("PIXEL_LOG2", pixel_log2)]].concat(),
        ),
        depth: Some(depth),
        colors,
        ..GraphicsInfo::triangles(&mesh_vert::SHADER, fragment)
    })
}

impl FootprintPass {
    /// # Errors
    /// The wanted format of the request image is not available; out of memory.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config, size: [u32; 2]) -> Result<FootprintPass> {
        FootprintPass::coarse(gpu, pyramid, config, size, 0)
    }

    /// A request image of `size` pixels. Each of its pixels represents `2^pixel_log2 x 2^pixel_log2` pixels of the
    /// picture and requests the level that these pixels need.
    ///
    /// # Errors
    /// As [`FootprintPass::new`].
    pub fn coarse(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        size: [u32; 2],
        pixel_log2: u32,
    ) -> Result<FootprintPass> {
        let depth = Arc::new(gpu.image("depth", ImageInfo::target(size, Format::Depth32Float))?);
        FootprintPass::on(gpu, pyramid, config, (depth, Depth::Write), pixel_log2)
    }

    /// A request image with a depth image that other passes also draw into. With [`Depth::Equal`] the depth image must
    /// already be complete.
    ///
    /// # Errors
    /// As [`FootprintPass::new`].
    pub fn on(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        (depth, test): (Arc<Image>, Depth),
        pixel_log2: u32,
    ) -> Result<FootprintPass> {
        let reaches = config.filter.reaches(pyramid.border_texels());
        let format = RequestFormat::choose(gpu, config.request_format, pyramid, reaches)?;
        Ok(FootprintPass {
            requests: gpu
                .image("request image", ImageInfo::target(depth.info().size, format.image_format()))?,
            depth,
            format,
            reaches,
            pipeline: pipeline(
                gpu,
                &footprint_frag::SHADER,
                pyramid,
                config,
                format,
                (&[format.image_format()], test),
                pixel_log2,
            )?,
        })
    }

    /// The request image as a colour attachment whose pixels start as the background.
    pub(super) fn target(&self) -> ColorTarget<'_> {
        ColorTarget { image: &self.requests, clear: Clear::Uint([BACKGROUND; 4]) }
    }

    /// Draws the shapes into the request image, with the depth test.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw(&self, cmd: &mut Cmd<'_>, seen: &DrawList<'_>) -> Result<()> {
        let depth = DepthTarget { image: &self.depth, clear: seen.onto != Onto::Drawn };
        cmd.render(self.requests.info().size, &[self.target()], Some(depth), |render| {
            seen.draw(render, &[], |_| &self.pipeline)
        })
    }
}

/// A stage 1 that also writes its inputs: for `--dump-footprint` and for comparison with the reference.
pub struct FootprintDump {
    /// s, t, 0, 0 for each pixel; NaN for the background.
    pub coordinates: Image,
    /// ds/dx, dt/dx, ds/dy, dt/dy for each pixel.
    pub derivatives: Image,
    pipeline: GraphicsPipeline,
}

impl FootprintDump {
    /// # Errors
    /// Out of memory.
    pub fn new(
        gpu: &Gpu,
        pyramid: &Pyramid,
        config: &Config,
        stage: &FootprintPass,
    ) -> Result<FootprintDump> {
        let size = stage.requests.info().size;
        let colors = [stage.format.image_format(), Format::Rgba32Float, Format::Rgba32Float];
        Ok(FootprintDump {
            coordinates: gpu.image("dump of (s, t)", ImageInfo::target(size, Format::Rgba32Float))?,
            derivatives: gpu.image("dump of derivatives", ImageInfo::target(size, Format::Rgba32Float))?,
            pipeline: pipeline(
                gpu,
                &footprint_dump_frag::SHADER,
                pyramid,
                config,
                stage.format,
                (&colors, Depth::Equal),
                0,
            )?,
        })
    }

    /// Draws the shapes into `stage`'s request image and into the two dumps. `stage` must have drawn the same view.
    ///
    /// # Errors
    /// Out of memory.
    pub fn draw(&self, cmd: &mut Cmd<'_>, stage: &FootprintPass, seen: &DrawList<'_>) -> Result<()> {
        let nothing = Clear::Float([f32::NAN; 4]);
        let targets = [
            stage.target(),
            ColorTarget { image: &self.coordinates, clear: nothing },
            ColorTarget { image: &self.derivatives, clear: nothing },
        ];
        let depth = DepthTarget { image: &stage.depth, clear: false };
        cmd.render(stage.requests.info().size, &targets, Some(depth), |render| {
            seen.draw(render, &[], |_| &self.pipeline)
        })
    }
}
