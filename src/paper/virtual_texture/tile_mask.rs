//! The tile mask: a mark for each distinct triple, in one of three layouts. Stage 2 writes it, stage 3 reads it.

use super::variants::{MaskLayout, max_triples};
use super::{Config, TileAddress};
use crate::math::pyramid::Pyramid;
use crate::vk::{Buffer, BufferUse, Cmd, Format, Gpu, Image, ImageInfo, ReadAs, Resource, Result};
use std::cell::Cell;

/// A tile mask as stage 3 and the shaders read it.
#[derive(Clone, Copy)]
pub struct Mask<'a> {
    pub resource: Resource<'a>,
    /// The byte that marks a tile in this frame; 0 in the layouts without bytes.
    pub frame: u32,
}

impl Mask<'_> {
    /// A mask in the layout [`MaskLayout::Texels`].
    pub fn of_image(image: &Image) -> Mask<'_> {
        Mask { resource: Resource::Texture(image, ReadAs::Whole), frame: 0 }
    }
}

/// The tile mask of one frame in flight, for variants whose shaders store to it.
pub struct TileMask(Store);

enum Store {
    Texels(Image),
    Bits(Buffer),
    Bytes {
        buffer: Buffer,
        /// The last frame's number, 1 ..= 255; 0 before the first.
        frame: Cell<u32>,
    },
}

impl TileMask {
    /// Number of words that stage 3 reads; a texel of the tile mask is one word.
    pub(super) fn words_of(pyramid: &Pyramid, config: &Config) -> u64 {
        let [columns, rows] = pyramid.tile_grid(0).map(u64::from);
        let places = max_triples(pyramid, config.address);
        match config.dedup.layout() {
            MaskLayout::Texels => columns * rows,
            MaskLayout::Bits => places.div_ceil(32),
            MaskLayout::Bytes => places.div_ceil(4),
        }
    }

    /// The triple of bit `place` in the layout [`MaskLayout::Bits`], as `triple_at` in tile_order.glsl.
    pub(super) fn triple_at(pyramid: &Pyramid, address: TileAddress, place: u32) -> [u32; 3] {
        let (mut level, mut at) = (0, u64::from(place));
        loop {
            let grid = pyramid.tile_grid(if address == TileAddress::OwnLevel { level } else { 0 });
            let [columns, rows] = grid.map(u64::from);
            if at < columns * rows {
                return [level, (at / columns) as u32, (at % columns) as u32];
            }
            (level, at) = (level + 1, at - columns * rows);
        }
    }

    /// The image of the layout [`MaskLayout::Texels`]. `storage` is true if shaders store to the image.
    ///
    /// # Errors
    /// The image exceeds a limit of the device; out of memory.
    pub fn image(gpu: &Gpu, pyramid: &Pyramid, storage: bool) -> Result<Image> {
        let info = ImageInfo { storage, ..ImageInfo::target(pyramid.tile_grid(0), Format::R32Uint) };
        gpu.image("tile mask", info)
    }

    /// Creates a mask; its content is undefined before the first [`TileMask::begin`].
    ///
    /// # Errors
    /// The image or buffer exceeds a limit of the device; out of memory.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config) -> Result<TileMask> {
        let bytes = 4 * TileMask::words_of(pyramid, config);
        Ok(TileMask(match config.dedup.layout() {
            MaskLayout::Texels => Store::Texels(TileMask::image(gpu, pyramid, true)?),
            MaskLayout::Bits => {
                let usage = if config.dedup.fused() { BufferUse::FetchedStorage } else { BufferUse::Storage };
                Store::Bits(gpu.buffer("tile bits", bytes, usage)?)
            }
            MaskLayout::Bytes => Store::Bytes {
                buffer: gpu.buffer("tile bytes", bytes, BufferUse::Storage)?,
                frame: Cell::new(0),
            },
        }))
    }

    /// Clears the mask. Later commands of the pass see the cleared mask.
    pub fn begin(&self, cmd: &mut Cmd<'_>) {
        match &self.0 {
            Store::Texels(image) => cmd.clear_uint(image, 0),
            Store::Bits(buffer) => cmd.fill(buffer, buffer.bytes(), 0),
            Store::Bytes { buffer, frame } => {
                // A new frame number invalidates all bytes. They are cleared once in 255 frames.
                frame.set(frame.get() % 255 + 1);
                if frame.get() > 1 {
                    return;
                }
                cmd.fill(buffer, buffer.bytes(), 0);
            }
        }
        cmd.sync();
    }

    /// The mask of the frame that began last.
    pub fn of_frame(&self) -> Mask<'_> {
        match &self.0 {
            Store::Texels(image) => Mask::of_image(image),
            Store::Bits(buffer) => Mask { resource: Resource::Buffer(buffer), frame: 0 },
            Store::Bytes { buffer, frame } => Mask { resource: Resource::Buffer(buffer), frame: frame.get() },
        }
    }

    pub fn bytes(&self) -> u64 {
        match &self.0 {
            Store::Texels(image) => image.bytes(),
            Store::Bits(buffer) | Store::Bytes { buffer, .. } => buffer.bytes(),
        }
    }
}
