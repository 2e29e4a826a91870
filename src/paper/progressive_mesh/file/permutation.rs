//! The permutation of a level: which face each slot gets.
//!
//! Coding cycles would take about 2 bytes per slot. But the new order is made for the vertex cache, so a
//! slot's face usually shares a vertex with the faces in the slots before it. The format therefore suggests
//! such faces and stores the index of the right suggestion. The cycles follow from the slots.

use super::coder::Coder;
use super::level::{Growing, Left, LevelFault};
use super::live::NONE;
use super::models::SUGGESTIONS;
use super::moving::Moving;
use crate::paper::progressive_mesh::mesh::ProgressiveMesh;

impl Growing {
    /// Codes whether the level has a permutation, and the permutation.
    pub(super) fn swaps(
        &mut self,
        coder: &mut impl Coder,
        source: Option<&ProgressiveMesh>,
        left: &mut Left,
    ) -> Result<(), LevelFault> {
        let level = self.mesh.levels.len() as u32 - 1;
        let at = self.mesh.swaps.levels.len();
        let swaps = source.map(|source| &source.swaps);
        let swaps = swaps.filter(|swaps| swaps.levels.get(at) == Some(&level));
        if !coder.bit(&mut self.models.permutation.is_there, swaps.is_some()) {
            return Ok(());
        }
        // The paper's tswap gives each slot of a cycle the face of the next slot.
        let mut want: Vec<(u32, u32)> = Vec::new();
        if let Some(swaps) = swaps {
            for cycle in swaps.cycles_of(at) {
                let slots = swaps.cycles.row(cycle);
                want.extend(
                    slots.iter().zip(slots.iter().cycle().skip(1)).map(|(&slot, &from)| (slot, from)),
                );
            }
            want.sort_unstable();
        }
        let slots = self.moving_slots(coder, &want, left)?;
        self.moving.begin(&self.live, slots);
        let moved = self.moved_faces(coder, &want)?;
        self.push_cycles(level, &moved)
    }

    /// The slots that get another face, ascending.
    fn moving_slots(
        &mut self,
        coder: &mut impl Coder,
        want: &[(u32, u32)],
        left: &mut Left,
    ) -> Result<Vec<u32>, LevelFault> {
        let models = &mut self.models.permutation;
        let count = models.moved.code(coder, want.len() as u32);
        left.moved = left.moved.checked_sub(count).ok_or(LevelFault("more faces move than declared"))?;
        if self.mesh.swaps.cycles.items().len() + count as usize > u32::MAX as usize {
            return Err(LevelFault("2^32 faces move"));
        }
        let live = self.live.corners.len();
        let (mut slots, mut next) = (Vec::with_capacity(count as usize), 0_u32);
        for at in 0..count as usize {
            let gap = models.gap.code(coder, want.get(at).map_or(0, |(slot, _)| slot - next));
            let slot = next.checked_add(gap).filter(|&slot| (slot as usize) < live);
            slots.push(slot.ok_or(LevelFault("a face moves to a slot that is not live"))?);
            next = slots[at] + 1;
        }
        Ok(slots)
    }

    /// Codes the face that each slot gets, as an index into the moving faces.
    fn moved_faces(&mut self, coder: &mut impl Coder, want: &[(u32, u32)]) -> Result<Vec<u32>, LevelFault> {
        let (moving, models) = (&mut self.moving, &mut self.models.permutation);
        let count = moving.slots.len();
        let (mut moved, mut lowest, mut was_first) = (Vec::with_capacity(count), 0, true);
        for at in 0..count {
            while moving.is_placed(lowest) {
                lowest += 1;
            }
            moving.reach(&self.live, moving.slots[at]);
            let want = want.get(at).map(|&(_, from)| moving.at_slot[from as usize] as usize);
            let rank = want.and_then(|want| rank_of(moving, want));
            let ranks = &mut models.rank[usize::from(was_first)];
            let found = (0..SUGGESTIONS).find(|&n| coder.bit(&mut ranks[n], rank == Some(n)));
            was_first = found == Some(0);
            let face = match found {
                // When writing, the face of that rank is known.
                Some(_) if rank.is_some() => want,
                Some(found) => suggestion(moving, found),
                None => {
                    let ahead = models.other.code(coder, want.map_or(0, |want| (want - lowest) as u32));
                    let face = lowest.checked_add(ahead as usize);
                    face.filter(|&face| face < count && !moving.is_placed(face))
                }
            };
            let face = face.ok_or(LevelFault("a moved face does not exist, or moves twice"))?;
            moving.place(face);
            moved.push(face as u32);
        }
        Ok(moved)
    }

    /// Stores the permutation as the paper's cycles, each from its lowest slot.
    fn push_cycles(&mut self, level: u32, moved: &[u32]) -> Result<(), LevelFault> {
        let (moving, live, swaps) = (&mut self.moving, &mut self.live, &mut self.mesh.swaps);
        // From here on, `at_slot` holds the slot from which each slot's face comes.
        for (&slot, &at) in moving.slots.iter().zip(moved) {
            let face = moving.faces[at as usize];
            live.slot_of[face as usize] = slot;
            live.face_at[slot as usize] = face;
            moving.at_slot[slot as usize] = moving.slots[at as usize];
        }
        moving.end();
        let mut cycle = Vec::new();
        for &start in &moving.slots {
            let mut slot = start;
            loop {
                let from = std::mem::replace(&mut moving.at_slot[slot as usize], NONE);
                if from == NONE {
                    break;
                }
                cycle.push(slot);
                slot = from;
            }
            match cycle.len() {
                0 => {}
                1 => return Err(LevelFault("a face moves to its own slot")),
                _ => swaps.cycles.push(cycle.drain(..)),
            }
        }
        swaps.levels.push(level);
        swaps.cycle_ends.push(swaps.cycles.len() as u32);
        Ok(())
    }
}

/// The rank of a face among the suggestions, if it is suggested.
fn rank_of(moving: &mut Moving, wanted: usize) -> Option<usize> {
    let (mut rank, mut found) = (0, None);
    moving.suggest(|face| {
        found = (face == wanted).then_some(rank);
        rank += 1;
        found.is_some() || rank == SUGGESTIONS
    });
    found
}

/// The suggestion of a rank, if it exists.
fn suggestion(moving: &mut Moving, mut rank: usize) -> Option<usize> {
    let mut found = None;
    moving.suggest(|face| {
        found = (rank == 0).then_some(face);
        rank = rank.wrapping_sub(1);
        found.is_some()
    });
    found
}
