//! Builds maps, traces rays and filters pixels on the GPU.

use super::Relief;
use super::maps::{self, DistanceMap, Fan, Holds};
use super::parallax;
use super::trace::{Traced, Tracer};
use crate::vk::shader::texture_mapping::{
    relief_cones_comp, relief_distances_comp, relief_parallax_comp, relief_trace_comp,
};
use crate::vk::shader::{Parallax, ReliefPush};
use crate::vk::{Buffer, BufferUse, Cmd, ComputePipeline, Gpu, Resource, Result};
use std::ops::Range;

fn push(relief: &Relief) -> ReliefPush {
    ReliefPush {
        side: relief.side as u32,
        layers: 1,
        depth: relief.depth,
        map_unit: 1.0,
        direction: [0.0, 0.0, -1.0],
        columns: 0,
        radius: 0,
        first_row: 0,
    }
}

/// A relief's heights on the device.
pub fn heights(gpu: &Gpu, relief: &Relief) -> Result<Buffer> {
    let side = relief.side as i64;
    let texels: Vec<f32> = (0..side * side).map(|at| relief.texel(at % side, at / side)).collect();
    gpu.buffer_with("heights", &texels, BufferUse::Storage)
}

/// The construction of a distance map.
pub struct DistanceBuild {
    pipeline: ComputePipeline,
    /// Inputs with their bindings.
    inputs: [(u32, Buffer); 6],
    distances: Buffer,
    push: ReliefPush,
}

impl DistanceBuild {
    /// # Errors
    /// Out of memory.
    pub fn new(gpu: &Gpu, relief: &Relief, layers: usize, fan: &Fan, refined: bool) -> Result<DistanceBuild> {
        let constants =
            [("REFINED", u32::from(refined)), ("EVERYWHERE", u32::from(fan.holds == Holds::Everywhere))];
        let storage = BufferUse::Storage;
        let inverses: Vec<f32> = (1..=maps::REACH).map(maps::inverse).collect();
        let bounds = maps::bounds(relief, fan.holds);
        let lows = fan.lows(&bounds, relief.side);
        let texels = 4 * (relief.side * relief.side * layers) as u64;
        Ok(DistanceBuild {
            pipeline: gpu.compute_pipeline("distance map", &relief_distances_comp::SHADER, &constants)?,
            inputs: [
                (relief_distances_comp::BOUNDS, gpu.buffer_with("bounds of cells", &bounds, storage)?),
                (relief_distances_comp::LOWS, gpu.buffer_with("lows of squares", &lows, storage)?),
                (relief_distances_comp::STARTS, gpu.buffer_with("fan starts", &fan.starts, storage)?),
                (relief_distances_comp::SQUARES, gpu.buffer_with("fan squares", &fan.squares, storage)?),
                (relief_distances_comp::NEAR, gpu.buffer_with("near cells", &fan.near, storage)?),
                (relief_distances_comp::INVERSES, gpu.buffer_with("inverse distances", &inverses, storage)?),
            ],
            distances: gpu.buffer("distances", texels, storage)?,
            push: ReliefPush { layers: layers as u32, radius: fan.radius, ..push(relief) },
        })
    }

    /// Records the whole construction.
    ///
    /// # Errors
    /// Out of memory.
    pub fn run(&self, cmd: &mut Cmd<'_>) -> Result<()> {
        self.run_rows(cmd, 0..self.push.side)
    }

    /// Records the construction of these rows.
    ///
    /// # Errors
    /// Out of memory.
    pub fn run_rows(&self, cmd: &mut Cmd<'_>, rows: Range<u32>) -> Result<()> {
        let inputs = self.inputs.iter().map(|(binding, buffer)| (*binding, Resource::Buffer(buffer)));
        let distances = (relief_distances_comp::DISTANCES, Resource::Buffer(&self.distances));
        let resources: Vec<_> = inputs.chain([distances]).collect();
        let push = ReliefPush { first_row: rows.start, ..self.push };
        let groups = [self.push.side, rows.end - rows.start, 1];
        cmd.dispatch(&self.pipeline, &resources, bytemuck::bytes_of(&push), groups)
    }

    /// One f32 word per cell, layer by layer from below.
    pub fn into_distances(self) -> Buffer {
        self.distances
    }

    /// # Errors
    /// Device lost, out of memory.
    pub fn read(&self, gpu: &Gpu) -> Result<DistanceMap> {
        Ok(DistanceMap { layers: self.push.layers as usize, distances: gpu.read_buffer(&self.distances)? })
    }
}

/// The construction of a cone map.
pub struct ConeBuild {
    pipeline: ComputePipeline,
    heights: Buffer,
    cones: Buffer,
    push: ReliefPush,
}

impl ConeBuild {
    /// # Errors
    /// Out of memory.
    pub fn new(gpu: &Gpu, relief: &Relief, relaxed: bool) -> Result<ConeBuild> {
        let constants = [("RELAXED", u32::from(relaxed))];
        Ok(ConeBuild {
            pipeline: gpu.compute_pipeline("cone map", &relief_cones_comp::SHADER, &constants)?,
            heights: heights(gpu, relief)?,
            cones: gpu.buffer("cones", 4 * (relief.side * relief.side) as u64, BufferUse::Storage)?,
            push: push(relief),
        })
    }

    /// Records the whole construction.
    ///
    /// # Errors
    /// Out of memory.
    pub fn run(&self, cmd: &mut Cmd<'_>) -> Result<()> {
        self.run_rows(cmd, 0..self.push.side)
    }

    /// Records the construction of these rows.
    ///
    /// # Errors
    /// Out of memory.
    pub fn run_rows(&self, cmd: &mut Cmd<'_>, rows: Range<u32>) -> Result<()> {
        let resources = [
            (relief_cones_comp::HEIGHTS, Resource::Buffer(&self.heights)),
            (relief_cones_comp::CONES, Resource::Buffer(&self.cones)),
        ];
        let groups = self.push.side.div_ceil(relief_cones_comp::SHADER.group[0]);
        let push = ReliefPush { first_row: rows.start, ..self.push };
        cmd.dispatch(
            &self.pipeline,
            &resources,
            bytemuck::bytes_of(&push),
            [groups, rows.end - rows.start, 1],
        )
    }

    /// One f32 word per texel.
    pub fn into_cones(self) -> Buffer {
        self.cones
    }

    /// # Errors
    /// Device lost, out of memory.
    pub fn read(&self, gpu: &Gpu) -> Result<Vec<f32>> {
        gpu.read_buffer(&self.cones)
    }
}

/// Traces parallel rays from a square grid on the top plane with one tracer.
pub struct Trace {
    pipeline: ComputePipeline,
    heights: Buffer,
    map: Buffer,
    hits: Buffer,
    push: ReliefPush,
}

impl Trace {
    /// `columns` x `columns` rays over one period of the relief.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(
        gpu: &Gpu,
        relief: &Relief,
        tracer: &Tracer<'_>,
        direction: [f32; 3],
        columns: u32,
    ) -> Result<Trace> {
        let (bits, words, layers, map_unit) = match tracer {
            Tracer::Linear => (32, vec![0], 1, 1.0),
            Tracer::Distances(map, bits) => {
                let (words, unit) = map.packed(*bits);
                (*bits, words, map.layers as u32, unit)
            }
            Tracer::Cones(cones) | Tracer::RelaxedCones(cones) => {
                (32, bytemuck::cast_slice(cones).to_vec(), 1, 1.0)
            }
        };
        let constants = [("TRACER", tracer.kind() as u32), ("MAP_BITS", bits)];
        let rays = u64::from(columns) * u64::from(columns);
        Ok(Trace {
            pipeline: gpu.compute_pipeline("relief tracing", &relief_trace_comp::SHADER, &constants)?,
            heights: heights(gpu, relief)?,
            map: gpu.buffer_with("relief map", &words, BufferUse::Storage)?,
            hits: gpu.buffer("hits", 8 * rays, BufferUse::Storage)?,
            push: ReliefPush { layers, map_unit, direction, columns, ..push(relief) },
        })
    }

    /// # Errors
    /// Out of memory.
    pub fn run(&self, cmd: &mut Cmd<'_>) -> Result<()> {
        let buffers = [
            (relief_trace_comp::HEIGHTS, &self.heights),
            (relief_trace_comp::MAP, &self.map),
            (relief_trace_comp::HITS, &self.hits),
        ];
        let resources = buffers.map(|(binding, buffer)| (binding, Resource::Buffer(buffer)));
        let groups = self.push.columns.div_ceil(relief_trace_comp::SHADER.group[0]);
        cmd.dispatch(&self.pipeline, &resources, bytemuck::bytes_of(&self.push), [groups, groups, 1])
    }

    /// Each ray's distance to its hit in texels, and its number of steps.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn read(&self, gpu: &Gpu) -> Result<Vec<Traced>> {
        let traced = |[distance, steps]: [u32; 2]| Traced { distance: f32::from_bits(distance), steps };
        Ok(gpu.read_buffer(&self.hits)?.into_iter().map(traced).collect())
    }
}

/// Start of ray (x, y) in a grid of `columns` x `columns`.
pub fn origin(relief: &Relief, columns: u32, [x, y]: [u32; 2]) -> [f32; 2] {
    [x, y].map(|at| (at as f32 + 0.5) * (relief.side as f32 / columns as f32))
}

/// A picture of a relief filtered by one method.
pub struct FilteredRelief {
    pipeline: ComputePipeline,
    texels: Buffer,
    pixels: Buffer,
    push: Parallax,
}

impl FilteredRelief {
    /// # Errors
    /// Out of memory.
    pub fn new(
        gpu: &Gpu,
        relief: &Relief,
        colours: &[f32],
        view: &parallax::ParallaxView,
        method: parallax::ParallaxFilter,
    ) -> Result<FilteredRelief> {
        let side = relief.side as i64;
        assert_eq!(colours.len(), relief.heights.len(), "a colour for each texel");
        let heights = (0..side * side).map(|at| relief.texel(at % side, at / side));
        let texels: Vec<[f32; 2]> = heights.zip(colours).map(|(height, &colour)| [height, colour]).collect();
        let bytes = 12 * u64::from(view.columns) * u64::from(view.columns);
        let constants = [("PARALLAX_FILTER", method as u32)];
        Ok(FilteredRelief {
            pipeline: gpu.compute_pipeline(method.name(), &relief_parallax_comp::SHADER, &constants)?,
            texels: gpu.buffer_with("heights and colours", &texels, BufferUse::Storage)?,
            pixels: gpu.buffer("filtered pixels", bytes, BufferUse::Storage)?,
            push: Parallax {
                side: relief.side as u32,
                depth: relief.depth,
                cotangent: view.cotangent() as f32,
                columns: view.columns,
                pixel: view.pixel as f32,
            },
        })
    }

    /// # Errors
    /// Out of memory.
    pub fn run(&self, cmd: &mut Cmd<'_>) -> Result<()> {
        let resources = [
            (relief_parallax_comp::SURFACE, Resource::Buffer(&self.texels)),
            (relief_parallax_comp::PIXELS, Resource::Buffer(&self.pixels)),
        ];
        let groups = self.push.columns.div_ceil(relief_parallax_comp::SHADER.group[0]);
        cmd.dispatch(&self.pipeline, &resources, bytemuck::bytes_of(&self.push), [groups, groups, 1])
    }

    /// Each pixel's colour and the number of texels visited.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn read(&self, gpu: &Gpu) -> Result<Vec<[f32; 2]>> {
        let pixel = |[sum, weight, fetched]: [f32; 3]| [sum / weight, fetched];
        Ok(gpu.read_buffer(&self.pixels)?.into_iter().map(pixel).collect())
    }
}
