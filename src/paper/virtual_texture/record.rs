//! What is kept of each frame.

use crate::math::pyramid::TileId;
use crate::paper::virtual_texture::streaming::FrameReport;
use crate::vk::PassTime;
use std::time::Duration;

/// One frame, as the report tells it.
#[derive(Clone, Debug)]
pub struct FrameRecord {
    /// 0 for the first.
    pub index: u64,
    pub streaming: FrameReport,
    /// The frame whose list was streamed: [`crate::vk::FRAMES_IN_FLIGHT`] ago; none at the start and after a pause.
    pub list_of: Option<u64>,
    pub passes: Vec<PassTime>,
    /// The host's time from the frame's end to its list of tiles.
    pub host_list: Duration,
    /// Length of the frame's own `U3`.
    pub triples: usize,
    /// The frame's own distinct tiles, before any bias, sorted; subsampled, what the last frames saw together.
    pub visible: Vec<TileId>,
    /// The tiles that it expected to be visible `cache.prefetch_frames` later, sorted.
    pub ahead: Vec<TileId>,
    /// `U3` was too short at first.
    pub overflowed: bool,
}

/// What a frame found out: the tiles that it sees, and those that it expects.
#[derive(Clone)]
pub(super) struct Lists {
    pub visible: Vec<TileId>,
    pub ahead: Vec<TileId>,
}
