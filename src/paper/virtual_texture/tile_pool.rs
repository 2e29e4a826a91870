//! The tile pool: an array of N1 streamed tiles with their next coarser levels, and the device's copy of the
//! [`super::page_table`].
//!
//! The paper keeps the resident mip tail, the levels that are always in video memory, in a separate texture. Here it is
//! also cut into tiles with borders. These tiles follow the N1 streamed tiles in the array and are never replaced. So
//! one lookup serves all levels, and borders continue the resident tail over the poles and the antimeridian.

use super::page_table::PageTable;
use crate::math::pyramid::{Pyramid, TileId};
use crate::texture::bake::encode_bc1;
use crate::texture::source::{TileError, TileFormat, TileSource};
use crate::vk::{
    Buffer, BufferUse, Cmd, Format, Gpu, Image, ImageInfo, Result, Sampler, SamplerFilter, SamplerInfo,
    TexelCopy,
};
use std::ops::Range;
use thiserror::Error;

/// The tile pool could not be created.
#[derive(Debug, Error)]
pub enum TilePoolError {
    #[error(transparent)]
    Vulkan(#[from] crate::vk::Error),
    /// The resident tail could not be read. It is the fallback of all other levels, so there is no picture without it.
    #[error("{0}")]
    Source(#[from] TileError),
}

pub struct TilePool {
    pub tiles: Image,
    /// The words of [`PageTable`] on the device.
    pub page_table_words: Buffer,
    pub(super) page_table: PageTable,
    pub sampler: Sampler,
    resident_tail: ResidentTail,
    pyramid: Pyramid,
    format: TileFormat,
}

/// Staging memory of one frame in flight: tiles to copy, and cells of the page table to write.
pub struct Uploads {
    staging: Buffer,
    capacity: u32,
    tiles: Vec<u32>,
    /// Ranges of the page table. Their words are in `table`, in this order.
    ranges: Vec<Range<usize>>,
    table: Buffer,
}

impl TilePool {
    /// Creates a pool of `slots` streamed tiles and reads the resident tail from `source`. The page table first shows
    /// only the tail.
    ///
    /// # Errors
    /// Too many layers for the device; out of memory; the resident tail cannot be read.
    pub fn new(
        gpu: &Gpu,
        source: &dyn TileSource,
        slots: u32,
    ) -> std::result::Result<TilePool, TilePoolError> {
        let pyramid = source.pyramid();
        let format = source.format();
        let resident_tail = ResidentTail::new(&pyramid, slots);
        let [side, _] = pyramid.stored_sides();
        let image_format = match format {
            TileFormat::Rgba8 => Format::Rgba8Srgb,
            TileFormat::Bc1 => Format::Bc1Srgb,
        };
        let info = ImageInfo {
            layers: slots + resident_tail.tiles.len() as u32,
            array: true,
            ..ImageInfo::texture([side; 2], image_format, 2)
        };
        let resident_tiles = resident_tail.tiles.len();
        gpu.require_layers("tile pool", info.layers, || match slots > resident_tiles as u32 {
            true => format!(
                "cache.gpu_tiles = {slots} and {resident_tiles} resident tiles; lower cache.gpu_tiles"
            ),
            false => {
                format!("{resident_tiles} layers are resident tiles; lower the texture's resident_levels")
            }
        })?;
        let in_table: Vec<_> = resident_tail
            .tiles
            .iter()
            .filter(|(tile, _)| tile.level <= resident_tail.single_level)
            .copied()
            .collect();
        // Before the host allocates as much: the table of a texture with small tiles can exceed the host's memory.
        gpu.require_buffer("page table", PageTable::bytes(&pyramid), BufferUse::Texels)?;
        let page_table = PageTable::new(&pyramid, &in_table);
        let resident = TilePool {
            tiles: gpu.image("tile pool", info)?,
            page_table_words: gpu.buffer_with("page table", page_table.words(), BufferUse::Texels)?,
            page_table,
            sampler: gpu.sampler(
                "tile pool sampler",
                SamplerInfo { filter: SamplerFilter::Linear, wraps_in_s: false },
            )?,
            resident_tail,
            pyramid,
            format,
        };
        resident.fill_resident_tail(gpu, source)?;
        Ok(resident)
    }

    /// Copies the resident tail's tiles into their slots.
    fn fill_resident_tail(
        &self,
        gpu: &Gpu,
        source: &dyn TileSource,
    ) -> std::result::Result<(), TilePoolError> {
        let tiles = self.resident_tail.tiles.clone();
        let mut uploads = self.uploads(gpu, tiles.len() as u32)?;
        let texels: Vec<Vec<u8>> = (self.pyramid.first_resident_level()..=self.pyramid.coarsest_level())
            .map(|level| source.read_resident_level(level))
            .collect::<std::result::Result<_, _>>()?;
        for (tile, slot) in tiles {
            let taken =
                uploads.tile(slot, &self.resident_tail.tile(tile, &self.pyramid, &texels, self.format));
            assert!(taken, "no staging for resident slot {slot}");
        }
        gpu.run_pass("fill resident tail", |cmd| self.copy(cmd, &uploads))?;
        Ok(())
    }

    /// The specialization constants for the single-tile levels: SINGLE_LEVEL and SINGLE_SLOT.
    pub(super) fn constants(&self) -> [(&'static str, u32); 2] {
        [("SINGLE_LEVEL", self.resident_tail.single_level), ("SINGLE_SLOT", self.resident_tail.single_slot)]
    }

    /// As [`PageTable::cells_by_level`].
    pub fn cells_by_level(&self) -> Vec<[usize; 4]> {
        self.page_table.cells_by_level()
    }

    /// Creates staging memory for at most `tiles` tiles per frame.
    ///
    /// # Errors
    /// Out of memory.
    pub fn uploads(&self, gpu: &Gpu, tiles: u32) -> Result<Uploads> {
        let bytes = self.format.tile_bytes(&self.pyramid) as u64;
        // This buffer grows if needed: a coarse tile that arrives or leaves changes many cells.
        let cells = 4 * u64::from(tiles).max(256);
        Ok(Uploads {
            staging: gpu.buffer("tile staging", bytes * u64::from(tiles), BufferUse::Upload)?,
            capacity: tiles,
            tiles: Vec::new(),
            ranges: Vec::new(),
            table: gpu.buffer("page table staging", 4 * cells, BufferUse::Upload)?,
        })
    }

    /// Copies the tiles of `uploads` into the pool, then writes the page table.
    pub fn copy(&self, cmd: &mut Cmd<'_>, uploads: &Uploads) {
        let bytes = self.format.tile_bytes(&self.pyramid) as u64;
        let [side, half] = self.pyramid.stored_sides();
        let own_level = self.tiles.info().format.bytes([side; 2]);
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
        cmd.copy_to_image(&uploads.staging, &self.tiles, &tile_copies);
        let mut from = 0;
        for range in &uploads.ranges {
            let bytes = 4 * range.len() as u64;
            cmd.copy_buffer(&uploads.table, from, &self.page_table_words, 4 * range.start as u64, bytes);
            from += bytes;
        }
    }

    /// Bytes of the streamed tiles, of the resident tail, and of the page table.
    pub fn bytes(&self) -> [u64; 3] {
        let layer = self.tiles.bytes() / u64::from(self.tiles.info().layers);
        let resident_tail = layer * self.resident_tail.tiles.len() as u64;
        [self.tiles.bytes() - resident_tail, resident_tail, self.page_table_words.bytes()]
    }
}

impl Uploads {
    /// Removes the tiles and cells that an earlier frame staged. The GPU must have finished that frame.
    pub fn clear(&mut self) {
        self.tiles.clear();
        self.ranges.clear();
    }

    /// Stages a tile for `slot`; returns false if this frame's staging memory is full.
    pub fn tile(&mut self, slot: u32, bytes: &[u8]) -> bool {
        if self.tiles.len() as u32 == self.capacity {
            return false;
        }
        let at = self.tiles.len() * bytes.len();
        self.staging.mapped_mut()[at..at + bytes.len()].copy_from_slice(bytes);
        self.tiles.push(slot);
        true
    }

    /// Stages a frame's changes of the page table (see [`super::fade`]). The last change of a tile counts. Each cell is
    /// written once, because copies within a pass have no order.
    ///
    /// # Errors
    /// Out of memory, if a frame changes more cells than the staging memory holds.
    pub fn show(&mut self, gpu: &Gpu, page_table: &mut PageTable, changes: &[(TileId, u32)]) -> Result<()> {
        page_table.apply(changes);
        self.ranges = page_table.take_changes();
        let bytes = 4 * self.ranges.iter().map(|range| range.len() as u64).sum::<u64>();
        if bytes > self.table.bytes() {
            self.table = gpu.buffer("page table staging", bytes.next_power_of_two(), BufferUse::Upload)?;
        }
        let (mut table, mut at) = (self.table.mapped_mut(), 0);
        for range in &self.ranges {
            let words: &[u8] = bytemuck::cast_slice(&page_table.words()[range.clone()]);
            table[at..at + words.len()].copy_from_slice(words);
            at += words.len();
        }
        Ok(())
    }

    /// Bytes on the host.
    pub fn bytes(&self) -> u64 {
        self.staging.bytes() + self.table.bytes()
    }

    /// Tiles copied this frame.
    pub fn tile_count(&self) -> usize {
        self.tiles.len()
    }
}

/// The tiles of the resident mip tail and their slots.
struct ResidentTail {
    tiles: Vec<(TileId, u32)>,
    /// The first level that is one tile. This level and the coarser ones are in consecutive slots; the page table holds
    /// only the first slot.
    single_level: u32,
    single_slot: u32,
}

impl ResidentTail {
    fn new(pyramid: &Pyramid, first_slot: u32) -> ResidentTail {
        let mut tiles = Vec::new();
        let grid = |level: u32| pyramid.level_size(level).map(|side| side.div_ceil(pyramid.tile_size()));
        for level in pyramid.first_resident_level()..=pyramid.coarsest_level() {
            let [columns, rows] = grid(level);
            for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
                tiles.push((TileId { level, row, column }, first_slot + tiles.len() as u32));
            }
        }
        let single = tiles.iter().find(|(tile, _)| grid(tile.level) == [1, 1]);
        let (tile, single_slot) = *single.expect("the coarsest level is one texel");
        ResidentTail { single_level: tile.level, single_slot, tiles }
    }

    /// A tile of the resident tail as a source would store it: with borders and its next coarser level. `texels` holds
    /// the whole resident levels, finest first, in RGBA8.
    fn tile(&self, tile: TileId, pyramid: &Pyramid, texels: &[Vec<u8>], format: TileFormat) -> Vec<u8> {
        let mut bytes = Vec::new();
        for step in 0..2 {
            // The coarsest level also serves as its own next coarser level.
            let level = (tile.level + step).min(pyramid.coarsest_level());
            let texels = &texels[(level - pyramid.first_resident_level()) as usize];
            let (size, border) =
                (i64::from(pyramid.tile_size() >> step), i64::from((pyramid.border_texels() + step) >> step));
            let side = pyramid.stored_sides()[step as usize];
            let mut rgba = Vec::with_capacity(4 * side as usize * side as usize);
            for y in 0..i64::from(side) {
                for x in 0..i64::from(side) {
                    let [column, row] =
                        [i64::from(tile.column) * size + x - border, i64::from(tile.row) * size + y - border];
                    let at = 4 * texel_index(pyramid.level_size(level), column, row);
                    rgba.extend_from_slice(&texels[at..at + 4]);
                }
            }
            match format {
                TileFormat::Rgba8 => bytes.extend(rgba),
                TileFormat::Bc1 => {
                    let mut blocks = vec![0; rgba.len() / 8];
                    encode_bc1(&rgba, side as usize, &mut blocks);
                    bytes.extend(blocks);
                }
            }
        }
        bytes
    }
}

/// Index of the texel at a column and row that may lie outside the level. Columns wrap. Rows continue over the pole on
/// the opposite meridian, so they repeat after twice the height.
fn texel_index([width, height]: [u32; 2], column: i64, row: i64) -> usize {
    let (width, height) = (i64::from(width), i64::from(height));
    let turn = row.rem_euclid(2 * height);
    let (column, row) =
        if turn < height { (column, turn) } else { (column + width / 2, 2 * height - 1 - turn) };
    (row * width + column.rem_euclid(width)) as usize
}
