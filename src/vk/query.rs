//! The count that transform feedback keeps: points written, and points that wanted to be.

use super::device::{Dead, Device};
use super::{Check, Gpu, Result};
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
