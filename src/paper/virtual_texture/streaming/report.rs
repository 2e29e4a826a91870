//! What one frame of streaming did.

use crate::math::pyramid::TileId;

/// A tile that could not be read, named in the report of the frame that learnt it and never again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TileFailure {
    pub tile: TileId,
    /// The source's own words.
    pub reason: String,
}

/// Counts of one call of [`Streaming::frame`](super::Streaming::frame). Counts of tiles where nothing
/// else is said.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameReport {
    /// 1 for the first frame.
    pub frame: u64,
    /// Entries of the visible list, repeats included.
    pub triples: usize,
    /// Distinct entries of the visible list.
    pub tiles: usize,
    /// Tiles to stream for them, after bias and failures: `hits + misses`.
    pub wanted: usize,
    /// Wanted tiles that A1 found in `J1`.
    pub hits: usize,
    pub misses: usize,
    /// Tiles copied from `J2` to `J1` (A2).
    pub uploads: usize,
    pub upload_bytes: u64,
    /// Tiles to fetch ahead, and those of `uploads` that were such.
    pub ahead: usize,
    pub ahead_uploads: usize,
    /// Tiles that gave up their slot of `J1`.
    pub gpu_evictions: usize,
    /// Tiles that gave up their place in `J2`.
    pub host_evictions: usize,
    /// Tiles that A3 has loaded since the last frame.
    pub loads: usize,
    /// Loads that came back after their place was given away, and were dropped.
    pub stale_loads: usize,
    /// Tiles found unreadable since the last frame.
    pub failures: Vec<TileFailure>,
    /// Tiles known to be unreadable, those of earlier frames included.
    pub failed_tiles: usize,
    /// Wanted tiles that are not in `J1` at the end of the frame.
    pub pending: usize,
    /// Levels by which tiles are taken coarser than listed, the user's constant included.
    pub bias: u32,
    /// Whether the bias is above the user's constant, because the visible set does not fit N1.
    pub oversubscribed: bool,
    /// Lengths of `Q1` and `Q2` at the end of the frame, and loads under way.
    pub queued_uploads: usize,
    pub queued_loads: usize,
    pub loads_under_way: u64,
    /// Cells of the display table to write, in this order, once this frame's uploads have been copied:
    /// the tile's slot in `J1`, or `None` where it has left.
    pub display: Vec<(TileId, Option<u32>)>,
}
