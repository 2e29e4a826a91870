//! The slots of the tile pool and of the host cache (paper 1, section 3): their tiles, and which tile is evicted.

use super::lru::Lru;
use crate::math::pyramid::TileId;

/// A slot that may be taken, and the tile that it must evict.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AvailableSlot {
    pub slot: u32,
    pub evicts: Option<TileId>,
}

/// Slots `k = 0 .. capacity` of one cache. A slot is free, holds a tile that can be evicted (least recently used
/// first), or holds a pinned tile.
pub struct Slots {
    tiles: Vec<Option<TileId>>,
    /// Counts the tiles that each slot has held: a changed generation means that the slot was reassigned.
    generations: Vec<u64>,
    /// The slots that hold a tile and are not pinned.
    lru: Lru,
    free: Vec<u32>,
}

impl Slots {
    pub fn new(capacity: u32) -> Self {
        Self {
            tiles: vec![None; capacity as usize],
            generations: vec![0; capacity as usize],
            lru: Lru::new(capacity),
            free: (0..capacity).rev().collect(),
        }
    }

    /// `capacity` empty slots that replace these slots. The new generations are higher than all present ones.
    pub fn after(&self, capacity: u32) -> Self {
        let generation = self.generations.iter().max().map_or(0, |latest| latest + 1);
        Self { generations: vec![generation; capacity as usize], ..Slots::new(capacity) }
    }

    /// The slots that hold a tile, the least recently used first, pinned ones last.
    pub fn by_use(&self) -> Vec<u32> {
        let listed: Vec<u32> = self.lru.in_order().collect();
        let mut pinned: Vec<bool> = self.tiles.iter().map(Option::is_some).collect();
        listed.iter().for_each(|slot| pinned[*slot as usize] = false);
        let pinned = (0..self.capacity()).filter(|slot| pinned[*slot as usize]);
        listed.iter().copied().chain(pinned).collect()
    }

    pub fn capacity(&self) -> u32 {
        self.tiles.len() as u32
    }

    pub fn tile(&self, slot: u32) -> Option<TileId> {
        self.tiles[slot as usize]
    }

    /// When the slot was last used; `None` if it is free or pinned.
    pub fn last_use(&self, slot: u32) -> Option<u64> {
        self.lru.last_use(slot)
    }

    pub fn generation(&self, slot: u32) -> u64 {
        self.generations[slot as usize]
    }

    /// A free slot, or else the least recently used one if its last use was before `before`. Changes nothing.
    pub fn claimable(&self, before: u64) -> Option<AvailableSlot> {
        if let Some(&slot) = self.free.last() {
            return Some(AvailableSlot { slot, evicts: None });
        }
        let (slot, _) = self.lru.oldest().filter(|&(_, last_use)| last_use < before)?;
        Some(AvailableSlot { slot, evicts: self.tile(slot) })
    }

    /// Puts `tile` into the slot that [`Slots::claimable`] has just returned, pins it, and returns its new generation.
    pub fn claim(&mut self, claim: AvailableSlot, tile: TileId) -> u64 {
        assert_eq!(self.tile(claim.slot), claim.evicts, "slot {} was reassigned", claim.slot);
        match claim.evicts {
            Some(_) => self.lru.remove(claim.slot),
            None => assert_eq!(self.free.pop(), Some(claim.slot), "not the next free slot"),
        }
        self.tiles[claim.slot as usize] = Some(tile);
        self.generations[claim.slot as usize] += 1;
        self.generation(claim.slot)
    }

    /// Unpins the slot and gives it this time of use.
    pub fn touch(&mut self, slot: u32, now: u64) {
        assert!(self.tile(slot).is_some(), "slot {slot} is free");
        self.lru.touch(slot, now);
    }

    /// Pins the slot: it cannot be claimed until it is touched again.
    pub fn pin(&mut self, slot: u32) {
        assert!(self.tile(slot).is_some(), "slot {slot} is free");
        self.lru.remove(slot);
    }

    /// Takes the tile out and frees the slot.
    pub fn release(&mut self, slot: u32) -> TileId {
        let tile = self.tiles[slot as usize].take();
        self.lru.remove(slot);
        self.free.push(slot);
        tile.unwrap_or_else(|| panic!("slot {slot} was free already"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(column: u32) -> TileId {
        TileId { level: 0, row: 0, column }
    }

    fn fill(slots: &mut Slots, tile: TileId, now: u64) -> (u32, u64) {
        let claim = slots.claimable(now).unwrap();
        let generation = slots.claim(claim, tile);
        slots.touch(claim.slot, now);
        (claim.slot, generation)
    }

    #[test]
    fn a_slot_used_now_cannot_be_claimed_now() {
        let mut slots = Slots::new(1);
        fill(&mut slots, tile(0), 4);
        assert_eq!(slots.claimable(4), None);
        assert_eq!(slots.claimable(5), Some(AvailableSlot { slot: 0, evicts: Some(tile(0)) }));
    }

    #[test]
    fn a_pinned_slot_cannot_be_claimed_until_it_is_touched() {
        let mut slots = Slots::new(1);
        fill(&mut slots, tile(0), 4);
        slots.pin(0);
        assert_eq!(slots.claimable(u64::MAX), None);
        slots.touch(0, 9);
        assert!(slots.claimable(10).is_some());
    }

    #[test]
    fn a_reused_slot_has_another_generation() {
        let mut slots = Slots::new(1);
        let (slot, first) = fill(&mut slots, tile(0), 1);
        let (again, second) = fill(&mut slots, tile(1), 2);
        assert_eq!(slot, again);
        assert_ne!(first, second);
        assert_eq!(slots.release(slot), tile(1));
        let (_, third) = fill(&mut slots, tile(1), 3);
        assert_ne!(second, third);
    }
}
