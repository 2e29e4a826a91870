//! What the device counts itself: points of a transform feedback, written and wanted, and invocations of shaders.

use super::device::{Dead, Device};
use super::{Check, Feature, Gpu, Result};
use ash::vk;
use std::sync::Arc;

/// Queries of a transform-feedback stream, one for each frame in flight.
pub struct StreamQuery {
    pub(crate) pool: vk::QueryPool,
    device: Arc<Device>,
}

/// `needed > written`: the buffer was too small. Only this query can tell; the counter is clipped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamCount {
    pub written: u64,
    pub needed: u64,
}

impl Gpu {
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

/// Counts of what the shaders of a pass did, one for each frame in flight.
pub struct ShaderQuery {
    pub(crate) pool: vk::QueryPool,
    device: Arc<Device>,
}

/// What the device says that it did. Only `input_vertices` is the same on every device; the others are the device's
/// own way of working (`VkQueryPipelineStatisticFlagBits` allows it to shade more than it must, and less).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShaderCounts {
    /// Indices of the draws.
    pub input_vertices: u64,
    pub vertex_invocations: u64,
    pub fragment_invocations: u64,
}

impl Gpu {
    /// The device must have been opened with [`Feature::PipelineStatistics`].
    ///
    /// # Errors
    /// Out of memory.
    pub fn shader_query(&self, name: &str, count: u32) -> Result<ShaderQuery> {
        assert!(self.has(Feature::PipelineStatistics), "{name}: the device was opened without the feature");
        use vk::QueryPipelineStatisticFlags as S;
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::PIPELINE_STATISTICS)
            .pipeline_statistics(
                S::INPUT_ASSEMBLY_VERTICES | S::VERTEX_SHADER_INVOCATIONS | S::FRAGMENT_SHADER_INVOCATIONS,
            )
            .query_count(count);
        // SAFETY: the device lives.
        let pool =
            unsafe { self.device.handle.create_query_pool(&info, None) }.check("vkCreateQueryPool", name)?;
        self.device.name(pool, name);
        Ok(ShaderQuery { pool, device: self.device.clone() })
    }
}

impl ShaderQuery {
    /// The counts of a frame that has ended, and in which [`super::Cmd::counted`] was given `index`.
    ///
    /// # Errors
    /// Device lost.
    pub fn read(&self, index: u32) -> Result<ShaderCounts> {
        let mut counts = [[0u64; 3]];
        // SAFETY: the query ended with its frame, which the caller has waited for.
        unsafe {
            self.device.handle.get_query_pool_results(
                self.pool,
                index,
                &mut counts,
                vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT,
            )
        }
        .check("vkGetQueryPoolResults", "shader query")?;
        // In the order of the flags' bits.
        let [input_vertices, vertex_invocations, fragment_invocations] = counts[0];
        Ok(ShaderCounts { input_vertices, vertex_invocations, fragment_invocations })
    }
}

impl Drop for ShaderQuery {
    fn drop(&mut self) {
        self.device.bury(Dead::Queries(self.pool));
    }
}

impl StreamQuery {
    /// The result of a frame that has ended.
    ///
    /// # Errors
    /// Device lost.
    pub fn read(&self, index: u32) -> Result<StreamCount> {
        let mut counts = [[0u64; 2]];
        // SAFETY: the query ended with its frame, which the caller has waited for.
        unsafe {
            self.device.handle.get_query_pool_results(
                self.pool,
                index,
                &mut counts,
                vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT,
            )
        }
        .check("vkGetQueryPoolResults", "stream query")?;
        Ok(StreamCount { written: counts[0][0], needed: counts[0][1] })
    }
}

impl Drop for StreamQuery {
    fn drop(&mut self) {
        self.device.bury(Dead::Queries(self.pool));
    }
}
