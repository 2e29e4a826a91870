//! A relief below a plane of a scene: the inputs of the relief's shader.
//!
//! The plane is the relief's top and rays descend from it, so the plane's outline stays straight. The relief repeats
//! beyond the outline. Projected widths treat the view as parallel within each pixel. Long descents are searched in
//! strides of several steps where the relief is hidden. For descents of up to 1024 texels a stride is at most a texel
//! long. A longer stride can miss a peak that is narrower than the stride.

use super::Relief;
use super::maps::{Fan, Holds};
use super::pass::{ConeBuild, DistanceBuild, heights};
use super::trace::TracerKind;
use crate::paper::texture_mapping::config::{ReliefFilter, ReliefMethod, ReliefStep};
use crate::vk::shader::texture_mapping::relief_surface_frag;
use crate::vk::{self, Buffer, BufferUse, Cmd, Gpu, Resource};
use std::ops::Range;
use std::time::{Duration, Instant};

/// A relief in video memory.
pub struct ReliefSurface {
    header: Buffer,
    heights: Buffer,
    /// The distance map or cone map, or one unused word if the method has no map.
    map: Buffer,
}

/// Limit of [`work`]. On a software device, this much work takes one core one or two minutes.
pub const MAX_WORK: u64 = 1 << 31;

/// Time between two reports of a build's progress.
const REPORT: Duration = Duration::from_secs(1);

/// Layers of a relief's distance map; a layer is about as thick as a texel is wide.
fn layers(relief: &Relief) -> usize {
    (relief.depth.ceil() as usize).clamp(1, 64)
}

/// The work of building the map of a method, in visits.
pub fn work(relief: &Relief, method: ReliefMethod) -> u64 {
    match method.step() {
        ReliefStep::Trace(TracerKind::Distances) => distance_work(relief),
        ReliefStep::Trace(TracerKind::Cones) => cone_work(relief),
        // Inside the solid, a relaxed cone's ray takes up to 33 steps.
        ReliefStep::Trace(TracerKind::RelaxedCones) => cone_work(relief).saturating_mul(33),
        ReliefStep::Filter(_) | ReliefStep::Trace(TracerKind::Linear) => 0,
    }
}

/// For each texel, the texels that may narrow its cone.
fn cone_work(relief: &Relief) -> u64 {
    let reach = (relief.side as u64 / 2).min(relief.depth.ceil() as u64);
    ((2 * reach + 1) * (2 * reach + 1)).saturating_mul((relief.side * relief.side) as u64)
}

/// For each texel, the squares of its horizon, and the cells of the neighbourhood in each layer.
fn distance_work(relief: &Relief) -> u64 {
    let side = 2 * (relief.depth.ceil() as u64 + 1) + 1;
    let cells = side.saturating_mul(side).saturating_mul(layers(relief) as u64);
    cells.saturating_add(HORIZON_SQUARES).saturating_mul((relief.side * relief.side) as u64)
}

/// Number of squares in a [`Fan`].
const HORIZON_SQUARES: u64 = 7296;

/// Rows of cells per submission. Drivers end a submission that takes seconds.
const ROWS: u32 = 8;

/// Builds a map by groups of rows. A build of more than a second reports its progress. If `go_on` returns an error, the
/// build ends with this error.
fn build_rows<E: From<vk::Error>>(
    gpu: &Gpu,
    (what, side): (&'static str, u32),
    go_on: impl Fn() -> Result<(), E>,
    run: impl Fn(&mut Cmd<'_>, Range<u32>) -> vk::Result<()>,
) -> Result<(), E> {
    let mut reported = Instant::now();
    for first in (0..side).step_by(ROWS as usize) {
        go_on()?;
        let end = side.min(first + ROWS);
        gpu.run_pass(what, |cmd| run(cmd, first..end))?;
        if reported.elapsed() >= REPORT {
            tracing::info!("{what}: {end} of {side} rows");
            reported = Instant::now();
        }
    }
    Ok(())
}

/// The map that a method needs, and the texels per step of a quantised map.
fn map_of<E: From<vk::Error>>(
    gpu: &Gpu,
    relief: &Relief,
    filter: ReliefFilter,
    go_on: impl Fn() -> Result<(), E>,
) -> Result<(Buffer, f32), E> {
    let side = relief.side as u32;
    Ok(match filter.method.step() {
        ReliefStep::Filter(_) | ReliefStep::Trace(TracerKind::Linear) => {
            (gpu.buffer("no map", 4, BufferUse::Storage)?, 1.0)
        }
        ReliefStep::Trace(TracerKind::Distances) => {
            let fan = Fan::new(relief.depth, Holds::Everywhere);
            let refined = filter.method == ReliefMethod::Trace;
            let build = DistanceBuild::new(gpu, relief, layers(relief), &fan, refined)?;
            build_rows(gpu, ("distance map", side), go_on, |cmd, rows| build.run_rows(cmd, rows))?;
            match filter.precision.bits() {
                32 => (build.into_distances(), 1.0),
                bits => {
                    let (words, unit) = build.read(gpu)?.packed(bits);
                    (gpu.buffer_with("quantised distances", &words, BufferUse::Storage)?, unit)
                }
            }
        }
        ReliefStep::Trace(kind @ (TracerKind::Cones | TracerKind::RelaxedCones)) => {
            let build = ConeBuild::new(gpu, relief, kind == TracerKind::RelaxedCones)?;
            build_rows(gpu, ("cone map", side), go_on, |cmd, rows| build.run_rows(cmd, rows))?;
            (build.into_cones(), 1.0)
        }
    })
}

impl ReliefSurface {
    /// Creates the relief of a square plane of this side, and builds the map that the method needs. The build calls
    /// `go_on` before each submission, which takes at most some seconds.
    ///
    /// # Errors
    /// Out of memory, device lost; the error of `go_on`.
    pub fn new<E: From<vk::Error>>(
        gpu: &Gpu,
        relief: &Relief,
        filter: ReliefFilter,
        size_m: f64,
        go_on: impl Fn() -> Result<(), E>,
    ) -> Result<ReliefSurface, E> {
        let (map, map_unit) = map_of(gpu, relief, filter, go_on)?;
        let header = [
            relief.side as u32,
            layers(relief) as u32,
            relief.depth.to_bits(),
            map_unit.to_bits(),
            (size_m as f32).to_bits(),
        ];
        Ok(ReliefSurface {
            header: gpu.buffer_with("relief", &header, BufferUse::Storage)?,
            heights: heights(gpu, relief)?,
            map,
        })
    }

    /// Specialization constants of the pipeline.
    pub fn constants(filter: ReliefFilter) -> Vec<(&'static str, u32)> {
        match filter.method.step() {
            ReliefStep::Filter(parallax) => vec![("TRACES", 0), ("PARALLAX_FILTER", parallax as u32)],
            ReliefStep::Trace(tracer) => {
                vec![("TRACES", 1), ("TRACER", tracer as u32), ("MAP_BITS", filter.precision.bits())]
            }
        }
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
        assert_eq!(
            work(&relief, ReliefMethod::Trace),
            256 * (fan.squares.len() + layers(&relief) * fan.near.len()) as u64
        );
    }
}
