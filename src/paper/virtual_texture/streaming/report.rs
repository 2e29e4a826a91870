//! The report of one frame of streaming.

use crate::math::pyramid::TileId;

/// A tile that could not be read. It is reported once, by the first frame after the failed read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TileFailure {
    pub tile: TileId,
    /// The error message of the source.
    pub reason: String,
}

/// Counts of one call of [`Streaming::frame`](super::Streaming::frame), in tiles unless stated otherwise.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StreamingCounts {
    /// 1 for the first frame.
    pub frame: u64,
    /// Entries of the visible list, repeats included.
    pub triples: usize,
    /// Distinct entries of the visible list.
    pub tiles: usize,
    /// Tiles to stream for the visible list, after bias and failures: `hits + misses`.
    pub wanted: usize,
    /// Wanted tiles that the update found in the tile pool.
    pub hits: usize,
    pub misses: usize,
    /// Tiles copied from the host cache to the tile pool.
    pub uploads: usize,
    pub upload_bytes: u64,
    /// Tiles to prefetch.
    pub expected: usize,
    /// Prefetched tiles among `uploads`.
    pub ahead_uploads: usize,
    /// Tiles evicted from the tile pool.
    pub gpu_evictions: usize,
    /// Tiles evicted from the host cache.
    pub host_evictions: usize,
    /// Tiles loaded since the last frame.
    pub loads: usize,
    /// Loads that were dropped because their slot had been reassigned.
    pub stale_loads: usize,
    /// Tiles found unreadable since the last frame.
    pub failures: Vec<TileFailure>,
    /// Tiles known to be unreadable, those of earlier frames included.
    pub failed_tiles: usize,
    /// Wanted tiles that are not in the tile pool at the end of the frame.
    pub pending: usize,
    /// Levels by which the wanted tiles are coarser than the listed ones. It includes the constant bias of the
    /// settings.
    pub bias: u32,
    /// True if the visible set does not fit the tile pool (N1 tiles) with the constant bias alone, so that the bias is
    /// larger.
    pub oversubscribed: bool,
    /// True if a lower bias would fit too: a moving picture keeps its bias for some frames
    /// ([`LevelBias`](super::LevelBias)).
    pub bias_held: bool,
    /// Lengths of the upload queue and of the load queue at the end of the frame, and loads under way.
    pub queued_uploads: usize,
    pub queued_loads: usize,
    pub loads_under_way: u64,
    /// Cells of the page table to write, in this order, after this frame's uploads have been copied. Each entry has a
    /// tile and the tile's slot in the tile pool, or `None` if the tile was evicted.
    pub display: Vec<(TileId, Option<u32>)>,
}
