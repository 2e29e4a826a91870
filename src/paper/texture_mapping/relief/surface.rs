//! A relief below a plane of a scene: the inputs of its shader.
//!
//! The plane is the relief's top and rays descend from it, so the plane's outline stays straight. The relief repeats
//! beyond the outline. Projected widths treat the view as parallel within each pixel.

use super::Relief;
use super::maps::{Fan, Holds};
use super::pass::{DistanceBuild, heights};
use crate::paper::texture_mapping::config::ReliefMethod;
use crate::vk::shader::texture_mapping::relief_surface_frag;
use crate::vk::{Buffer, BufferUse, Gpu, Resource, Result};

/// A relief in video memory.
pub struct ReliefSurface {
    pub method: ReliefMethod,
    header: Buffer,
    heights: Buffer,
    /// The distance map, or one unused word if the method does not trace.
    map: Buffer,
}

/// Limit of the work of building a distance map, counted in pairs of a cell and a cell of its neighbourhood. This much
/// work takes 8 s on a software device with 2 cores.
pub const MOST_PAIRS: u64 = 1 << 27;

/// Layers of a relief's distance map; a layer is about as thick as a texel is wide.
fn layers(relief: &Relief) -> usize {
    (relief.depth.ceil() as usize).clamp(1, 64)
}

/// The work of building a distance map, in the unit of [`MOST_PAIRS`].
pub fn pairs(relief: &Relief) -> u64 {
    let square = 2 * (relief.depth.ceil() as u64 + 1) + 1;
    (relief.side * relief.side * layers(relief)) as u64 * square * square
}

impl ReliefSurface {
    /// Creates the relief of a square plane of this side, and builds the map that tracing needs.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn new(gpu: &Gpu, relief: &Relief, method: ReliefMethod, size_m: f64) -> Result<ReliefSurface> {
        let layers = layers(relief);
        let map = match method {
            ReliefMethod::ProjectedWidth => gpu.buffer("no distances", 4, BufferUse::Storage)?,
            ReliefMethod::Trace => {
                let fan = Fan::new(relief.depth, Holds::Everywhere);
                let build = DistanceBuild::new(gpu, relief, layers, &fan, true)?;
                let mut frame = gpu.frame()?;
                frame.pass("distance map", |cmd| build.run(cmd))?;
                frame.submit()?.wait()?;
                build.into_distances()
            }
        };
        let header = [
            relief.side as u32,
            layers as u32,
            relief.depth.to_bits(),
            1f32.to_bits(),
            (size_m as f32).to_bits(),
        ];
        Ok(ReliefSurface {
            method,
            header: gpu.buffer_with("relief", &header, BufferUse::Storage)?,
            heights: heights(gpu, relief)?,
            map,
        })
    }

    /// Specialization constants of the pipeline.
    pub fn constants(method: ReliefMethod) -> [(&'static str, u32); 2] {
        // Tracing uses the distance map.
        [("METHOD", u32::from(method == ReliefMethod::Trace)), ("TRACER", 1)]
    }

    pub fn resources(&self) -> [(u32, Resource<'_>); 3] {
        [
            (relief_surface_frag::RELIEF, Resource::Buffer(&self.header)),
            (relief_surface_frag::HEIGHTS, Resource::Buffer(&self.heights)),
            (relief_surface_frag::MAP, Resource::Buffer(&self.map)),
        ]
    }

    /// Bytes in video memory.
    pub fn bytes(&self) -> u64 {
        [&self.header, &self.heights, &self.map].into_iter().map(Buffer::bytes).sum()
    }
}
