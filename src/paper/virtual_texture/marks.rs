//! Tile mask: a mark for each distinct triple, written by stage 2 for stage 3, in one of three layouts.

use super::variants::{Layout, most_triples};
use super::{Config, Keying};
use crate::math::pyramid::Pyramid;
use crate::vk::{Buffer, BufferUse, Cmd, Format, Gpu, Image, ImageInfo, Resource, Result, View};
use std::cell::Cell;

/// The marks of one frame in flight.
pub struct Marks(Store);

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
    /// Words that stage 3 reads one by one; a texel of `U2` is a word.
    pub(super) fn words_of(pyramid: &Pyramid, config: &Config) -> u64 {
        let [columns, rows] = pyramid.tile_grid(0).map(u64::from);
        let places = most_triples(pyramid, config.keying);
        match config.dedup.layout() {
            Layout::U2 => columns * rows,
            Layout::Bits => places.div_ceil(32),
            Layout::Bytes => places.div_ceil(4),
        }
    }

    /// The triple whose mark stands at `place` where marks are bits: triple_at of tile_order.glsl.
    pub(super) fn triple_at(pyramid: &Pyramid, keying: Keying, place: u32) -> [u32; 3] {
        let (mut level, mut at) = (0, u64::from(place));
        loop {
            let grid = pyramid.tile_grid(if keying == Keying::Native { level } else { 0 });
            let [columns, rows] = grid.map(u64::from);
            if at < columns * rows {
                return [level, (at / columns) as u32, (at % columns) as u32];
            }
            (level, at) = (level + 1, at - columns * rows);
        }
    }

    /// Nothing is marked before the first [`Marks::begin`].
    ///
    /// # Errors
    /// An image or buffer that the device does not take; out of memory.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, config: &Config) -> Result<Marks> {
        let bytes = 4 * Marks::words_of(pyramid, config);
        Ok(Marks(match config.dedup.layout() {
            Layout::U2 => {
                let storage = !config.dedup.draws();
                let info = ImageInfo { storage, ..ImageInfo::target(pyramid.tile_grid(0), Format::R32Uint) };
                Store::U2(gpu.image("U2", info)?)
            }
            Layout::Bits => {
                let usage = if config.dedup.fused() { BufferUse::FetchedStorage } else { BufferUse::Storage };
                Store::Bits(gpu.buffer("tile bits", bytes, usage)?)
            }
            Layout::Bytes => Store::Bytes {
                buffer: gpu.buffer("tile bytes", bytes, BufferUse::Storage)?,
                frame: Cell::new(0),
            },
        }))
    }

    /// Unmarks everything, for a frame whose marks shaders store. Commands that follow in the pass see it.
    pub fn begin(&self, cmd: &mut Cmd<'_>) {
        match &self.0 {
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
        match &self.0 {
            Store::U2(image) => Some(image),
            _ => None,
        }
    }

    /// As shaders see it.
    pub fn resource(&self) -> Resource<'_> {
        match &self.0 {
            Store::U2(image) => Resource::Texture(image, View::Whole),
            Store::Bits(buffer) | Store::Bytes { buffer, .. } => Resource::Buffer(buffer),
        }
    }

    /// The byte that marks in this frame; 0 where marks are bits.
    pub fn frame(&self) -> u32 {
        match &self.0 {
            Store::Bytes { frame, .. } => frame.get(),
            _ => 0,
        }
    }

    pub fn bytes(&self) -> u64 {
        match &self.0 {
            Store::U2(image) => image.bytes(),
            Store::Bits(buffer) | Store::Bytes { buffer, .. } => buffer.bytes(),
        }
    }
}
