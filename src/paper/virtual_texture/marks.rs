//! What stage 2 leaves for stage 3: a mark for each distinct triple, in one of three layouts.

use super::variants::Layout;
use super::{Config, Keying};
use crate::math::pyramid::Pyramid;
use crate::vk::{Buffer, BufferUse, Cmd, Format, Gpu, Image, ImageInfo, Resource, Result, View};
use std::cell::Cell;

/// The marks of one frame in flight.
pub struct Marks {
    store: Store,
    /// Words that stage 3 reads one by one; a texel is a word.
    words: u64,
}

enum Store {
    U2(Image),
    Bits(Buffer),
    Bytes {
        buffer: Buffer,
        /// The last frame's number, 1 ..= 255; 0 before the first.
        frame: Cell<u32>,
    },
}

impl Marks {
    /// Nothing is marked before the first [`Marks::begin`].
    ///
    /// # Errors
    /// An image or buffer that the device does not take; out of memory.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config) -> Result<Marks> {
        let grid = pyramid.tile_grid(0);
        let cells = u64::from(grid[0]) * u64::from(grid[1]);
        Ok(match config.dedup.layout() {
            Layout::U2 => {
                let storage = !config.dedup.draws();
                let info = ImageInfo { storage, ..ImageInfo::target(grid, Format::R32Uint) };
                Marks { store: Store::U2(gpu.image("U2", info)?), words: cells }
            }
            Layout::Bits => {
                let words = pyramid.tile_count().div_ceil(32);
                Marks { store: Store::Bits(gpu.buffer("tile bits", 4 * words, BufferUse::Storage)?), words }
            }
            Layout::Bytes => {
                let bytes = match config.keying {
                    Keying::Paper => cells * u64::from(pyramid.first_resident_level()),
                    Keying::Native => pyramid.tile_count(),
                };
                let words = bytes.div_ceil(4);
                let buffer = gpu.buffer("tile bytes", 4 * words, BufferUse::Storage)?;
                Marks { store: Store::Bytes { buffer, frame: Cell::new(0) }, words }
            }
        })
    }

    /// Unmarks everything, for a frame whose marks shaders store. Commands that follow in the pass see it.
    pub fn begin(&self, cmd: &mut Cmd<'_>) {
        match &self.store {
            Store::U2(image) => cmd.clear_uint(image, 0),
            Store::Bits(buffer) => cmd.fill(buffer, buffer.bytes(), 0),
            Store::Bytes { buffer, frame } => {
                // Another number unmarks all; once in 255 frames the old numbers themselves must go.
                frame.set(frame.get() % 255 + 1);
                if frame.get() > 1 {
                    return;
                }
                cmd.fill(buffer, buffer.bytes(), 0);
            }
        }
        cmd.sync();
    }

    /// `U2`, where that is the layout.
    pub fn u2(&self) -> Option<&Image> {
        match &self.store {
            Store::U2(image) => Some(image),
            _ => None,
        }
    }

    /// As shaders see it.
    pub fn resource(&self) -> Resource<'_> {
        match &self.store {
            Store::U2(image) => Resource::Texture(image, View::Whole),
            Store::Bits(buffer) | Store::Bytes { buffer, .. } => Resource::Buffer(buffer),
        }
    }

    /// The byte that marks in this frame; 0 where marks are bits.
    pub fn frame(&self) -> u32 {
        match &self.store {
            Store::Bytes { frame, .. } => frame.get(),
            _ => 0,
        }
    }

    pub fn words(&self) -> u64 {
        self.words
    }

    pub fn bytes(&self) -> u64 {
        match &self.store {
            Store::U2(image) => image.bytes(),
            Store::Bits(buffer) | Store::Bytes { buffer, .. } => buffer.bytes(),
        }
    }
}
