//! The record of a frame.

use crate::math::pyramid::TileId;
use crate::paper::virtual_texture::streaming::StreamingCounts;
use crate::vk::PassTime;
use std::time::Duration;

/// The reported data of one frame.
#[derive(Clone, Debug)]
pub struct TextureFrameRecord {
    /// The frame's number; 0 for the first frame.
    pub index: u64,
    pub streaming: StreamingCounts,
    /// The frame whose list was streamed: [`crate::vk::FRAMES_IN_FLIGHT`] frames earlier, or while the list is frozen
    /// the frame that made it. `None` at the start and after a pause.
    pub list_of: Option<u64>,
    pub passes: Vec<PassTime>,
    /// The host's time from the frame's end to its list of tiles.
    pub host_list: Duration,
    /// Length of the frame's own visible-tile list.
    pub triples: usize,
    /// The frame's distinct visible tiles before any bias, sorted. With subsampled feedback: the union of the last
    /// frames' tiles.
    pub visible: Vec<TileId>,
    /// The tiles that are expected to be visible `cache.prefetch_frames` frames later, sorted.
    pub expected: Vec<TileId>,
    /// True if the visible-tile list was too short at first.
    pub overflowed: bool,
}

/// A frame's lists: the visible tiles, and the tiles that are expected to be visible soon.
#[derive(Clone)]
pub(super) struct FrameTiles {
    /// The frame's number.
    pub frame: u64,
    pub visible: Vec<TileId>,
    pub expected: Vec<TileId>,
}
