//! What texturing reads: `J1` (an array of N1 tiles with their next coarser levels), `G1` (the levels that are
//! always there) and the display table.
//!
//! The display table is `H1` as the shader sees it: one mip level for each q, slot + 1 or 0. It is written only
//! after a tile's copy, and apart from A1's states: the paper keeps both in one cell, and so takes a coarser
//! stand-in for the tile itself (erratum of section 3).

use crate::math::pyramid::{Pyramid, TileId};
use crate::scene::source::{TileError, TileFormat, TileSource};
use crate::vk::{
    Buffer, BufferUse, Cmd, Filter, Format, Gpu, Image, ImageInfo, Result, Sampler, SamplerInfo, TexelCopy,
};
use thiserror::Error;

/// A pyramid that could not be brought into video memory.
#[derive(Debug, Error)]
pub enum ResidentError {
    #[error(transparent)]
    Vulkan(#[from] crate::vk::Error),
    /// G1 is what everything falls back on: without it there is no picture.
    #[error("{0}")]
    Source(#[from] TileError),
}

pub struct Resident {
    pub j1: Image,
    pub g1: Image,
    pub h1: Image,
    pub tile_sampler: Sampler,
    pub level_sampler: Sampler,
    pyramid: Pyramid,
    format: TileFormat,
}

/// Staging memory of one frame in flight: tiles to copy, and cells of the display table to write.
pub struct Uploads {
    staging: Buffer,
    capacity: u32,
    tiles: Vec<u32>,
    cells: Vec<(TileId, Option<u32>)>,
    table: Buffer,
}

impl Resident {
    /// Makes `J1` for `slots` tiles, reads `G1` from `source`, empties the display table.
    ///
    /// # Errors
    /// The device has not so many layers; out of memory; `G1` cannot be read.
    pub fn new(
        gpu: &Gpu,
        source: &dyn TileSource,
        slots: u32,
    ) -> std::result::Result<Resident, ResidentError> {
        let pyramid = source.pyramid();
        let format = source.format();
        let [side, _] = pyramid.stored_sides();
        let j1 = gpu.image(
            "J1",
            ImageInfo {
                layers: slots,
                array: true,
                ..ImageInfo::texture(
                    [side; 2],
                    match format {
                        TileFormat::Rgba8 => Format::Rgba8Srgb,
                        TileFormat::Bc1 => Format::Bc1Srgb,
                    },
                    2,
                )
            },
        )?;
        let streamed = pyramid.first_resident_level();
        let h1 = gpu.image("H1", ImageInfo::texture(pyramid.tile_grid(0), Format::R32Uint, streamed))?;
        let mut frame = gpu.frame()?;
        frame.pass("clear H1", |cmd| {
            cmd.clear_uint(&h1, 0);
            Ok(())
        })?;
        frame.submit()?.wait()?;
        let linear = |wraps_in_s| SamplerInfo { filter: Filter::Linear, wraps_in_s };
        Ok(Resident {
            j1,
            g1: resident_levels(gpu, source)?,
            h1,
            tile_sampler: gpu.sampler("J1 sampler", linear(false))?,
            level_sampler: gpu.sampler("G1 sampler", linear(true))?,
            pyramid,
            format,
        })
    }

    /// Staging for at most `tiles` tiles a frame.
    ///
    /// # Errors
    /// Out of memory.
    pub fn uploads(&self, gpu: &Gpu, tiles: u32) -> Result<Uploads> {
        let bytes = self.format.tile_bytes(&self.pyramid) as u64;
        // A tile that comes may send another away: two cells each, and as many again for failures.
        let cells = 4 * u64::from(tiles).max(256);
        Ok(Uploads {
            staging: gpu.buffer("tile staging", bytes * u64::from(tiles), BufferUse::Upload)?,
            capacity: tiles,
            tiles: Vec::new(),
            cells: Vec::new(),
            table: gpu.buffer("H1 staging", 4 * cells, BufferUse::Upload)?,
        })
    }

    /// Copies what `uploads` gathered into `J1`, then writes the display table.
    pub fn copy(&self, cmd: &mut Cmd<'_>, uploads: &Uploads) {
        let bytes = self.format.tile_bytes(&self.pyramid) as u64;
        let [side, half] = self.pyramid.stored_sides();
        let own_level = self.j1.info().format.bytes([side; 2]);
        let tile_copies: Vec<TexelCopy> = uploads
            .tiles
            .iter()
            .enumerate()
            .flat_map(|(n, &slot)| {
                let offset = n as u64 * bytes;
                [
                    TexelCopy { offset, mip: 0, layer: slot, at: [0; 2], size: [side; 2] },
                    TexelCopy {
                        offset: offset + own_level,
                        mip: 1,
                        layer: slot,
                        at: [0; 2],
                        size: [half; 2],
                    },
                ]
            })
            .collect();
        let cell_copies: Vec<TexelCopy> = uploads
            .cells
            .iter()
            .enumerate()
            .map(|(n, (tile, _))| TexelCopy {
                offset: 4 * n as u64,
                mip: tile.level,
                layer: 0,
                at: [tile.column, tile.row],
                size: [1; 2],
            })
            .collect();
        cmd.copy_to_image(&uploads.staging, &self.j1, &tile_copies);
        cmd.copy_to_image(&uploads.table, &self.h1, &cell_copies);
    }

    /// Bytes of `J1`, `G1` and the display table.
    pub fn bytes(&self) -> [u64; 3] {
        [self.j1.bytes(), self.g1.bytes(), self.h1.bytes()]
    }
}

impl Uploads {
    /// Forgets the last frame's work; the GPU must have passed it.
    pub fn clear(&mut self) {
        self.tiles.clear();
        self.cells.clear();
    }

    /// Takes a tile for `slot`; false where this frame's staging is full.
    pub fn tile(&mut self, slot: u32, bytes: &[u8]) -> bool {
        if self.tiles.len() as u32 == self.capacity {
            return false;
        }
        let at = self.tiles.len() * bytes.len();
        self.staging.mapped_mut()[at..at + bytes.len()].copy_from_slice(bytes);
        self.tiles.push(slot);
        true
    }

    /// Shows `tile` in `slot`, or no more. The last word about a tile counts: a cell is written once a frame,
    /// because copies within a pass have no order.
    ///
    /// # Errors
    /// Out of memory, where a frame changes more cells than the staging has room for.
    pub fn show(&mut self, gpu: &Gpu, changes: &[(TileId, Option<u32>)]) -> Result<()> {
        for &(tile, slot) in changes {
            self.cells.retain(|(other, _)| *other != tile);
            self.cells.push((tile, slot));
        }
        let bytes = 4 * self.cells.len() as u64;
        if bytes > self.table.bytes() {
            self.table = gpu.buffer("H1 staging", bytes.next_power_of_two(), BufferUse::Upload)?;
        }
        let table = self.table.mapped_mut();
        for (cell, (_, slot)) in table.chunks_exact_mut(4).zip(&self.cells) {
            cell.copy_from_slice(&slot.map_or(0, |slot| slot + 1).to_ne_bytes());
        }
        Ok(())
    }

    /// Tiles copied this frame.
    pub fn tile_count(&self) -> usize {
        self.tiles.len()
    }
}

/// `G1`: levels L-L'+1 .. L as the mip levels of one image.
fn resident_levels(gpu: &Gpu, source: &dyn TileSource) -> std::result::Result<Image, ResidentError> {
    let pyramid = source.pyramid();
    let first = pyramid.first_resident_level();
    let levels = pyramid.resident_levels();
    let g1 = gpu.image("G1", ImageInfo::texture(pyramid.level_size(first), Format::Rgba8Srgb, levels))?;
    let texels: Vec<Vec<u8>> = (0..levels)
        .map(|level| source.read_resident_level(first + level))
        .collect::<std::result::Result<_, _>>()?;
    fill_levels(gpu, &g1, &texels)?;
    Ok(g1)
}

/// Fills the mip levels of an RGBA8 image, finest first. Waits for the copy.
pub(super) fn fill_levels(gpu: &Gpu, image: &Image, levels: &[Vec<u8>]) -> Result<()> {
    let mut staging =
        gpu.buffer("level staging", levels.iter().map(|l| l.len() as u64).sum(), BufferUse::Upload)?;
    let mut copies = Vec::new();
    let mut offset = 0;
    for (mip, level) in levels.iter().enumerate() {
        let size = image.mip_size(mip as u32);
        assert_eq!(
            level.len() as u64,
            image.info().format.bytes(size),
            "{}: bytes of mip {mip}",
            image.name()
        );
        staging.mapped_mut()[offset..offset + level.len()].copy_from_slice(level);
        copies.push(TexelCopy { offset: offset as u64, mip: mip as u32, layer: 0, at: [0; 2], size });
        offset += level.len();
    }
    let mut frame = gpu.frame()?;
    frame.pass("fill levels", |cmd| {
        cmd.copy_to_image(&staging, image, &copies);
        Ok(())
    })?;
    frame.submit()?.wait()?;
    Ok(())
}
