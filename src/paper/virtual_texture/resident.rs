//! What texturing reads: `J1`, an array of N1 streamed tiles with their next coarser levels, and [`super::display`]'s
//! table.
//!
//! The paper keeps `G1`, the levels that are always there, in a texture of its own. Here `G1` is cut into tiles with
//! borders like all others, which stand behind the N1 streamed ones in `J1` and are never replaced: one sample shows
//! any level, and the borders carry G1 over the poles and the antimeridian as they do the tiles.

use super::display::Display;
use crate::math::pyramid::{Pyramid, TileId};
use crate::texture::bake::encode_bc1;
use crate::texture::source::{TileError, TileFormat, TileSource};
use crate::vk::{
    Buffer, BufferUse, Cmd, Filter, Format, Gpu, Image, ImageInfo, Result, Sampler, SamplerInfo, TexelCopy,
};
use std::ops::Range;
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
    /// The words of [`Display`].
    pub h1: Buffer,
    pub(super) display: Display,
    pub sampler: Sampler,
    g1: Levels,
    pyramid: Pyramid,
    format: TileFormat,
}

/// Staging memory of one frame in flight: tiles to copy, and cells of the display table to write.
pub struct Uploads {
    staging: Buffer,
    capacity: u32,
    tiles: Vec<u32>,
    /// Places of the display table whose words stand in `table` one after the other.
    places: Vec<Range<usize>>,
    table: Buffer,
}

impl Resident {
    /// Makes `J1` for `slots` streamed tiles, reads `G1` from `source` into it, and shows it everywhere.
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
        let g1 = Levels::new(&pyramid, slots);
        let [side, _] = pyramid.stored_sides();
        let j1_format = match format {
            TileFormat::Rgba8 => Format::Rgba8Srgb,
            TileFormat::Bc1 => Format::Bc1Srgb,
        };
        let j1_info = ImageInfo {
            layers: slots + g1.tiles.len() as u32,
            array: true,
            ..ImageInfo::texture([side; 2], j1_format, 2)
        };
        let resident_tiles = g1.tiles.len();
        gpu.require_layers("J1", j1_info.layers, || match slots > resident_tiles as u32 {
            true => format!("cache.gpu_tiles = {slots} and {resident_tiles} resident tiles; lower it"),
            false => format!("the texture's resident_levels takes {resident_tiles} of them; lower it"),
        })?;
        let in_table: Vec<_> =
            g1.tiles.iter().filter(|(tile, _)| tile.level <= g1.single_level).copied().collect();
        let display = Display::new(&pyramid, &in_table);
        let resident = Resident {
            j1: gpu.image("J1", j1_info)?,
            h1: gpu.buffer_with("H1", display.words(), BufferUse::Texels)?,
            display,
            sampler: gpu.sampler("J1 sampler", SamplerInfo { filter: Filter::Linear, wraps_in_s: false })?,
            g1,
            pyramid,
            format,
        };
        resident.fill_g1(gpu, source)?;
        Ok(resident)
    }

    /// Copies `G1`'s tiles to where they stay.
    fn fill_g1(&self, gpu: &Gpu, source: &dyn TileSource) -> std::result::Result<(), ResidentError> {
        let tiles = self.g1.tiles.clone();
        let mut uploads = self.uploads(gpu, tiles.len() as u32)?;
        let texels: Vec<Vec<u8>> = (self.pyramid.first_resident_level()..=self.pyramid.coarsest_level())
            .map(|level| source.read_resident_level(level))
            .collect::<std::result::Result<_, _>>()?;
        for (tile, slot) in tiles {
            let taken = uploads.tile(slot, &self.g1.tile(tile, &self.pyramid, &texels, self.format));
            assert!(taken, "there is staging for {slot} and all others");
        }
        let mut frame = gpu.frame()?;
        frame.pass("fill G1", |cmd| {
            self.copy(cmd, &uploads);
            Ok(())
        })?;
        frame.submit()?.wait()?;
        Ok(())
    }

    /// Where the shader finds `G1`: SINGLE_LEVEL and SINGLE_SLOT.
    pub(super) fn constants(&self) -> [(&'static str, u32); 3] {
        [
            ("BORDER", self.pyramid.border_texels()),
            ("SINGLE_LEVEL", self.g1.single_level),
            ("SINGLE_SLOT", self.g1.single_slot),
        ]
    }

    /// Staging for at most `tiles` tiles a frame.
    ///
    /// # Errors
    /// Out of memory.
    pub fn uploads(&self, gpu: &Gpu, tiles: u32) -> Result<Uploads> {
        let bytes = self.format.tile_bytes(&self.pyramid) as u64;
        // Grows where tiles of coarse levels, which stand in for many, come or go.
        let cells = 4 * u64::from(tiles).max(256);
        Ok(Uploads {
            staging: gpu.buffer("tile staging", bytes * u64::from(tiles), BufferUse::Upload)?,
            capacity: tiles,
            tiles: Vec::new(),
            places: Vec::new(),
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
        cmd.copy_to_image(&uploads.staging, &self.j1, &tile_copies);
        let mut from = 0;
        for places in &uploads.places {
            let bytes = 4 * places.len() as u64;
            cmd.copy_buffer(&uploads.table, from, &self.h1, 4 * places.start as u64, bytes);
            from += bytes;
        }
    }

    /// Bytes of the streamed tiles of `J1`, of `G1`'s tiles behind them, and of the display table.
    pub fn bytes(&self) -> [u64; 3] {
        let layer = self.j1.bytes() / u64::from(self.j1.info().layers);
        let g1 = layer * self.g1.tiles.len() as u64;
        [self.j1.bytes() - g1, g1, self.h1.bytes()]
    }
}

impl Uploads {
    /// Forgets the last frame's work; the GPU must have passed it.
    pub fn clear(&mut self) {
        self.tiles.clear();
        self.places.clear();
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

    /// Takes a frame's changes of the display table (see [`super::fade`]), the last word about a tile last. A place is
    /// written once, because copies within a pass have no order.
    ///
    /// # Errors
    /// Out of memory, where a frame changes more cells than the staging has room for.
    pub fn show(&mut self, gpu: &Gpu, display: &mut Display, changes: &[(TileId, u32)]) -> Result<()> {
        display.apply(changes);
        self.places = display.take_changes();
        let bytes = 4 * self.places.iter().map(|places| places.len() as u64).sum::<u64>();
        if bytes > self.table.bytes() {
            self.table = gpu.buffer("H1 staging", bytes.next_power_of_two(), BufferUse::Upload)?;
        }
        let mut table = self.table.mapped_mut();
        for places in &self.places {
            let words: &[u8] = bytemuck::cast_slice(&display.words()[places.clone()]);
            let (staged, rest) = table.split_at_mut(words.len());
            staged.copy_from_slice(words);
            table = rest;
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

/// `G1`'s tiles and their slots.
struct Levels {
    tiles: Vec<(TileId, u32)>,
    /// From this level on each level is one tile, and slots follow each other; the table has the first of them.
    single_level: u32,
    single_slot: u32,
}

impl Levels {
    fn new(pyramid: &Pyramid, first_slot: u32) -> Levels {
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
        Levels { single_level: tile.level, single_slot, tiles }
    }

    /// A tile of `G1` as a source would store it: bordered, with its next coarser level. `texels` holds `G1`'s
    /// levels whole, finest first, RGBA8.
    fn tile(&self, tile: TileId, pyramid: &Pyramid, texels: &[Vec<u8>], format: TileFormat) -> Vec<u8> {
        let mut bytes = Vec::new();
        for step in 0..2 {
            // The coarsest level stands for its own next coarser one.
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

/// Place of the texel at a column and row that may lie any number of turns outside the level: columns wrap; down
/// one meridian and up the opposite one, twice the height is a full turn.
fn texel_index([width, height]: [u32; 2], column: i64, row: i64) -> usize {
    let (width, height) = (i64::from(width), i64::from(height));
    let turn = row.rem_euclid(2 * height);
    let (column, row) =
        if turn < height { (column, turn) } else { (column + width / 2, 2 * height - 1 - turn) };
    (row * width + column.rem_euclid(width)) as usize
}
