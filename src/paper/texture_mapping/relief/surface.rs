//! A relief below a plane of a scene: the inputs of the relief's shader.
//!
//! The plane is the relief's top and rays descend from it, so the plane's outline stays straight. The relief repeats
//! beyond the outline. Projected widths treat the view as parallel within each pixel. Long descents are searched in
//! strides of several steps where the relief is hidden. For descents of up to 1024 texels a stride is at most a texel
//! long. A longer stride can miss a peak that is narrower than the stride.

use super::Relief;
use super::maps::{Fan, Holds};
use super::pass::{DistanceBuild, heights};
use crate::paper::texture_mapping::config::ReliefMethod;
use crate::vk::shader::texture_mapping::relief_surface_frag;
use crate::vk::{self, Buffer, BufferUse, Gpu, Resource};
use std::time::{Duration, Instant};

/// A relief in video memory.
pub struct ReliefSurface {
    pub method: ReliefMethod,
    header: Buffer,
    heights: Buffer,
    /// The distance map, or one unused word if the method does not trace.
    map: Buffer,
}

/// Limit of [`work`]. On a software device, this much work takes one core one or two minutes.
pub const MOST_WORK: u64 = 1 << 31;

/// Time between two reports of a build's progress.
const REPORT: Duration = Duration::from_secs(1);

/// Layers of a relief's distance map; a layer is about as thick as a texel is wide.
fn layers(relief: &Relief) -> usize {
    (relief.depth.ceil() as usize).clamp(1, 64)
}

/// The work of building a distance map, in visits: for each texel, the squares of its horizon, and the cells of the
/// neighbourhood in each layer.
pub fn work(relief: &Relief) -> u64 {
    let side = 2 * (relief.depth.ceil() as u64 + 1) + 1;
    let cells = side.saturating_mul(side).saturating_mul(layers(relief) as u64);
    cells.saturating_add(HORIZON_SQUARES).saturating_mul((relief.side * relief.side) as u64)
}

/// Number of squares in a [`Fan`].
const HORIZON_SQUARES: u64 = 7296;

/// Rows of cells per submission. Drivers end a submission that takes seconds.
const ROWS: u32 = 8;

/// Builds the refined map. A build of more than a second reports its progress. If `go_on` returns an error, the build
/// ends with this error.
fn distance_map<E: From<vk::Error>>(
    gpu: &Gpu,
    relief: &Relief,
    go_on: impl Fn() -> Result<(), E>,
) -> Result<Buffer, E> {
    let fan = Fan::new(relief.depth, Holds::Everywhere);
    let build = DistanceBuild::new(gpu, relief, layers(relief), &fan, true)?;
    let (side, mut reported) = (relief.side as u32, Instant::now());
    for first in (0..side).step_by(ROWS as usize) {
        go_on()?;
        let end = side.min(first + ROWS);
        gpu.run_pass("distance map", |cmd| build.run_rows(cmd, first..end))?;
        if reported.elapsed() >= REPORT {
            tracing::info!("distance map: {end} of {side} rows");
            reported = Instant::now();
        }
    }
    Ok(build.into_distances())
}

impl ReliefSurface {
    /// Creates the relief of a square plane of this side, and builds the map that tracing needs. The build calls `go_on`
    /// before each submission, which takes at most some seconds.
    ///
    /// # Errors
    /// Out of memory, device lost; the error of `go_on`.
    pub fn new<E: From<vk::Error>>(
        gpu: &Gpu,
        relief: &Relief,
        method: ReliefMethod,
        size_m: f64,
        go_on: impl Fn() -> Result<(), E>,
    ) -> Result<ReliefSurface, E> {
        let map = match method {
            ReliefMethod::ProjectedWidth => gpu.buffer("no distances", 4, BufferUse::Storage)?,
            ReliefMethod::Trace => distance_map(gpu, relief, go_on)?,
        };
        let header = [
            relief.side as u32,
            layers(relief) as u32,
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
        // TRACER 1 traces by the distance map.
        [("RELIEF_METHOD", u32::from(method == ReliefMethod::Trace)), ("TRACER", 1)]
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_work_counts_the_squares_and_cells_of_a_fan() {
        let relief = Relief { side: 16, depth: 2.5, heights: vec![0; 256] };
        let fan = Fan::new(relief.depth, Holds::Everywhere);
        assert_eq!(work(&relief), 256 * (fan.squares.len() + layers(&relief) * fan.near.len()) as u64);
    }
}
