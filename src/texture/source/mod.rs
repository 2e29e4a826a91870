//! Sources of a texture's tiles: a file, or a pure function.

pub mod border;
pub mod cached;
#[cfg(test)]
mod checks;
pub mod earth;
pub mod encoded;
pub mod ruler;
pub mod terrain;

use crate::math::pyramid::{Pyramid, TileId};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Storage format of a tile's texels in memory, on disk and in video memory. Colours are sRGB.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TileFormat {
    /// Four bytes per texel.
    #[default]
    Rgba8,
    /// 8 bytes for each 4 x 4 texels, no alpha.
    Bc1,
}

impl TileFormat {
    /// Bytes of one stored tile: its own level with the border, then the next coarser level with half the border.
    pub fn tile_bytes(self, pyramid: &Pyramid) -> usize {
        match self {
            TileFormat::Rgba8 => pyramid.tile_bytes_rgba8(),
            TileFormat::Bc1 => pyramid.tile_bytes_rgba8() / 8,
        }
    }
}

/// A tile that could not be read. Rendering continues without it.
#[derive(Debug, Error)]
pub enum TileError {
    #[error("{path}: {tile} at byte {offset}: {source}")]
    Read { path: String, tile: TileId, offset: u64, source: std::io::Error },
    #[error(
        "{path}: {tile} at byte {offset}: checksum differs, the file is damaged; `ortelius verify` lists all damage"
    )]
    Checksum { path: String, tile: TileId, offset: u64 },
    /// For sources that fail deliberately (injected faults, tests).
    #[error("{tile}: {reason}")]
    Refused { tile: TileId, reason: String },
}

/// A texture of many levels, read tile by tile. Calls come from several threads at once.
pub trait TileSource: Send + Sync {
    /// One line for reports: kind, size, file name.
    fn describe(&self) -> String;

    fn pyramid(&self) -> Pyramid;

    fn format(&self) -> TileFormat {
        TileFormat::Rgba8
    }

    /// Writes one stored tile into `bytes`, whose length is exactly [`TileFormat::tile_bytes`]. Borders hold
    /// the neighbours' texels: columns wrap at the antimeridian; a row beyond a pole is the mirrored row half
    /// a turn away. After the tile follows the same region of the next coarser level.
    ///
    /// # Errors
    /// [`TileError`]; `bytes` is then unspecified.
    fn read_tile(&self, tile: TileId, bytes: &mut [u8]) -> Result<(), TileError>;

    /// One whole level of the resident mip tail (`level >= first_resident_level()`), RGBA8, rows tightly packed from
    /// the north.
    ///
    /// # Errors
    /// [`TileError`] names the file and the level.
    fn read_resident_level(&self, level: u32) -> Result<Vec<u8>, TileError>;

    /// Ends simulated delays (`disk.delay_ms`), now and in later reads. Called before the texture is closed.
    fn stop_waiting(&self) {}
}
