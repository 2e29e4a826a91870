//! The host tile cache: tiles in main memory (paper 1, section 3).

use super::slots::{AvailableSlot, Slots};
use crate::math::pyramid::TileId;

/// Holds N2 tiles. A buffer is allocated when first needed and reused for later tiles. While a tile is being loaded,
/// the load request owns its buffer.
pub struct HostCache {
    pub slots: Slots,
    buffers: Vec<Option<Vec<u8>>>,
    spare: Vec<Vec<u8>>,
    tile_bytes: usize,
}

impl HostCache {
    pub fn new(capacity: u32, tile_bytes: usize) -> Self {
        let buffers = (0..capacity).map(|_| None).collect();
        Self { slots: Slots::new(capacity), buffers, spare: Vec::new(), tile_bytes }
    }

    /// A cache of `capacity` slots with the most recently used of these tiles, in the same order of use. Also returns
    /// each tile's new slot; `None` if there is no room for the tile. Tiles that are still being loaded are dropped.
    pub fn resized(mut self, capacity: u32) -> (HostCache, Vec<(TileId, Option<u32>)>) {
        let slots = self.slots.after(capacity);
        let mut next = HostCache { slots, ..HostCache::new(capacity, self.tile_bytes) };
        let held = self.slots.by_use().into_iter();
        let held: Vec<u32> = held.filter(|slot| self.buffers[*slot as usize].is_some()).collect();
        let dropped = held.len().saturating_sub(capacity as usize);
        let mut moved = Vec::new();
        for (n, slot) in held.into_iter().enumerate() {
            let tile = self.slots.tile(slot).expect("it holds a tile");
            let claim = next.slots.claimable(0).filter(|_| n >= dropped);
            if let Some(claim) = claim {
                next.slots.claim(claim, tile);
                // Time of use 0 is before that of every frame.
                next.slots.touch(claim.slot, 0);
                next.buffers[claim.slot as usize] = self.buffers[slot as usize].take();
            }
            moved.push((tile, claim.map(|claim| claim.slot)));
        }
        (next, moved)
    }

    /// Takes a slot for a tile that is to be loaded; returns its generation and the buffer to load into.
    pub fn claim(&mut self, claim: AvailableSlot, tile: TileId) -> (u64, Vec<u8>) {
        let generation = self.slots.claim(claim, tile);
        let left = self.buffers[claim.slot as usize].take();
        (generation, left.or_else(|| self.spare.pop()).unwrap_or_else(|| vec![0; self.tile_bytes]))
    }

    /// True if a load that took the slot with this generation may still be stored there.
    pub fn expects(&self, tile: TileId, slot: u32, generation: u64) -> bool {
        slot < self.slots.capacity()
            && self.slots.tile(slot) == Some(tile)
            && self.slots.generation(slot) == generation
    }

    /// Stores a finished load. The slot stays pinned, because the tile enters the upload queue next.
    pub fn fill(&mut self, slot: u32, bytes: Vec<u8>) {
        assert_eq!(bytes.len(), self.tile_bytes, "the buffer of slot {slot}");
        let before = self.buffers[slot as usize].replace(bytes);
        assert!(before.is_none(), "slot {slot} was filled already");
    }

    /// A tile's bytes.
    ///
    /// # Panics
    /// The slot is not filled yet.
    pub fn bytes(&self, slot: u32) -> &[u8] {
        match &self.buffers[slot as usize] {
            Some(bytes) => bytes,
            None => panic!("slot {slot}, {:?}, has no bytes yet", self.slots.tile(slot)),
        }
    }

    /// Frees a slot. Its buffer, unless a load owns it, is kept for a later tile.
    pub fn release(&mut self, slot: u32) -> TileId {
        self.spare.extend(self.buffers[slot as usize].take());
        self.slots.release(slot)
    }

    /// Takes back the buffer of a dropped load.
    pub fn recycle(&mut self, bytes: Vec<u8>) {
        self.spare.push(bytes);
    }
}
