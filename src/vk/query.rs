//! Queries: how many points a transform feedback wrote and needed to write, and pipeline statistics.

use super::device::{Dead, Device};
use super::{Check, Gpu, Result};
use ash::vk;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Queries of a transform-feedback stream.
pub struct StreamQuery {
    pub(crate) pool: vk::QueryPool,
    device: Arc<Device>,
}

/// `needed > written` means that the buffer was too small. Only this query reports the overflow: the byte counter of
/// [`TransformFeedback`](super::TransformFeedback) stops at the buffer's size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamCount {
    pub written: u64,
    pub needed: u64,
}

impl Gpu {
    /// Creates `count` queries.
    ///
    /// # Errors
    /// Out of memory.
    pub fn stream_query(&self, name: &str, count: u32) -> Result<StreamQuery> {
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TRANSFORM_FEEDBACK_STREAM_EXT)
            .query_count(count);
        // SAFETY: the device lives.
        let pool =
            unsafe { self.device.handle.create_query_pool(&info, None) }.check("vkCreateQueryPool", name)?;
        self.device.name(pool, name);
        Ok(StreamQuery { pool, device: self.device.clone() })
    }
}

/// Work of a pass. Draws, dispatches and copied bytes are counted while recording, the rest by the device.
///
/// Input vertices, geometry-shader invocations and primitives, and compute invocations are the same on every
/// device. Vertex and fragment invocations depend on the device: it may reuse vertices, and may shade more
/// fragments than necessary (`VkQueryPipelineStatisticFlagBits`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Work {
    #[serde(skip_serializing_if = "is_zero")]
    pub draws: u64,
    #[serde(skip_serializing_if = "is_zero")]
    pub dispatches: u64,
    /// Written by copies and fills.
    #[serde(skip_serializing_if = "is_zero")]
    pub copied_bytes: u64,
    /// Indices drawn, or vertices of draws without indices.
    #[serde(skip_serializing_if = "is_zero")]
    pub input_vertices: u64,
    #[serde(skip_serializing_if = "is_zero")]
    pub vertex_invocations: u64,
    #[serde(skip_serializing_if = "is_zero")]
    pub geometry_invocations: u64,
    /// Emitted by the geometry shader.
    #[serde(skip_serializing_if = "is_zero")]
    pub geometry_primitives: u64,
    #[serde(skip_serializing_if = "is_zero")]
    pub fragment_invocations: u64,
    #[serde(skip_serializing_if = "is_zero")]
    pub compute_invocations: u64,
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// The statistics in the order of [`Work`]'s fields, which is the order of the flags' bits.
const STATISTICS: [vk::QueryPipelineStatisticFlags; 6] = [
    vk::QueryPipelineStatisticFlags::INPUT_ASSEMBLY_VERTICES,
    vk::QueryPipelineStatisticFlags::VERTEX_SHADER_INVOCATIONS,
    vk::QueryPipelineStatisticFlags::GEOMETRY_SHADER_INVOCATIONS,
    vk::QueryPipelineStatisticFlags::GEOMETRY_SHADER_PRIMITIVES,
    vk::QueryPipelineStatisticFlags::FRAGMENT_SHADER_INVOCATIONS,
    vk::QueryPipelineStatisticFlags::COMPUTE_SHADER_INVOCATIONS,
];

/// Describes a pool of `count` pipeline-statistics queries.
pub(super) fn statistics_info(count: u32) -> vk::QueryPoolCreateInfo<'static> {
    let flags = STATISTICS.into_iter().fold(vk::QueryPipelineStatisticFlags::empty(), |all, one| all | one);
    vk::QueryPoolCreateInfo::default()
        .query_type(vk::QueryType::PIPELINE_STATISTICS)
        .pipeline_statistics(flags)
        .query_count(count)
}

impl Work {
    /// Sets the counts that only the device knows, for each pass of a frame that has ended.
    pub(super) fn add_statistics(device: &Device, pool: vk::QueryPool, works: &mut [Work]) -> Result<()> {
        let mut counts = vec![[0u64; STATISTICS.len()]; works.len()];
        device.query_results(pool, 0, &mut counts, "pipeline statistics")?;
        for (work, count) in works.iter_mut().zip(counts) {
            [
                work.input_vertices,
                work.vertex_invocations,
                work.geometry_invocations,
                work.geometry_primitives,
                work.fragment_invocations,
                work.compute_invocations,
            ] = count;
        }
        Ok(())
    }

    /// Every count with its name, in order.
    pub fn named(&self) -> [(&'static str, u64); 9] {
        [
            ("draws", self.draws),
            ("dispatches", self.dispatches),
            ("bytes copied", self.copied_bytes),
            ("input vertices", self.input_vertices),
            ("vertex invocations", self.vertex_invocations),
            ("geometry shader invocations", self.geometry_invocations),
            ("primitives emitted", self.geometry_primitives),
            ("fragment invocations", self.fragment_invocations),
            ("compute invocations", self.compute_invocations),
        ]
    }
}

impl std::iter::Sum for Work {
    fn sum<I: Iterator<Item = Work>>(works: I) -> Work {
        works.fold(Work::default(), |a, b| Work {
            draws: a.draws + b.draws,
            dispatches: a.dispatches + b.dispatches,
            copied_bytes: a.copied_bytes + b.copied_bytes,
            input_vertices: a.input_vertices + b.input_vertices,
            vertex_invocations: a.vertex_invocations + b.vertex_invocations,
            geometry_invocations: a.geometry_invocations + b.geometry_invocations,
            geometry_primitives: a.geometry_primitives + b.geometry_primitives,
            fragment_invocations: a.fragment_invocations + b.fragment_invocations,
            compute_invocations: a.compute_invocations + b.compute_invocations,
        })
    }
}

impl StreamQuery {
    /// The result of a frame that has ended.
    ///
    /// # Errors
    /// Device lost.
    pub fn read(&self, index: u32) -> Result<StreamCount> {
        let mut counts = [[0u64; 2]];
        self.device.query_results(self.pool, index, &mut counts, "stream query")?;
        let [[written, needed]] = counts;
        Ok(StreamCount { written, needed })
    }
}

impl Drop for StreamQuery {
    fn drop(&mut self) {
        self.device.bury(Dead::Queries(self.pool));
    }
}
