//! The permutation of a level: which face each slot gets.
//!
//! Cycles would take some 2 bytes a slot. But the new order was made for the vertex cache: a slot's face mostly shares
//! a vertex with the faces in the slots before it. So the format suggests such faces and stores which suggestion it
//! is; cycles follow from that.

use super::coder::Coder;
use super::level::{Fault, Growing, Left};
use super::live::NONE;
use super::models::SUGGESTIONS;

/// Instead of a search: the face has its place.
const PLACED: u64 = u64::MAX;

/// Slots before a slot whose faces' neighbours are suggested for it.
const WINDOW: u32 = 8;

impl Growing<'_> {
    /// Whether the level carries a permutation, and which.
    pub(super) fn swaps(&mut self, coder: &mut impl Coder, left: &mut Left) -> Result<(), Fault> {
        let level = self.mesh.levels.len() as u32 - 1;
        let at = self.mesh.swaps.levels.len();
        let swaps = self.source.map(|source| &source.swaps);
        let swaps = swaps.filter(|swaps| swaps.levels.get(at) == Some(&level));
        if !coder.bit(&mut self.models.permutation.is_there, swaps.is_some()) {
            return Ok(());
        }
        // The paper's tswap gives each slot of a cycle the next one's face.
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
        let moved = self.moved_faces(coder, &slots, &want)?;
        self.push_cycles(level, &slots, &moved)
    }

    /// The slots that get another face, ascending.
    fn moving_slots(
        &mut self,
        coder: &mut impl Coder,
        want: &[(u32, u32)],
        left: &mut Left,
    ) -> Result<Vec<u32>, Fault> {
        let models = &mut self.models.permutation;
        let count = models.moved.code(coder, want.len() as u32);
        left.moved = left.moved.checked_sub(count).ok_or(Fault("more faces move than declared"))?;
        let live = self.live.corners.len();
        let (mut slots, mut next) = (Vec::with_capacity(count as usize), 0_u32);
        for at in 0..count as usize {
            let gap = models.gap.code(coder, want.get(at).map_or(0, |(slot, _)| slot - next));
            let slot = next.checked_add(gap).filter(|&slot| (slot as usize) < live);
            slots.push(slot.ok_or(Fault("a face moves to a slot that is not live"))?);
            next = slots[at] + 1;
        }
        self.moving.resize(live, NONE);
        self.suggested.resize(live, PLACED);
        for (at, &slot) in slots.iter().enumerate() {
            self.moving[slot as usize] = at as u32;
            self.suggested[self.live.face_at[slot as usize] as usize] = 0;
        }
        Ok(slots)
    }

    /// The face that each of the slots gets. They stand in `live.face_at` from now on; `live.slot_of` is still what it
    /// was.
    fn moved_faces(
        &mut self,
        coder: &mut impl Coder,
        slots: &[u32],
        want: &[(u32, u32)],
    ) -> Result<Vec<u32>, Fault> {
        let faces: Vec<u32> = slots.iter().map(|&slot| self.live.face_at[slot as usize]).collect();
        let (mut moved, mut lowest, mut was_first) = (Vec::with_capacity(slots.len()), 0, true);
        for (at, &slot) in slots.iter().enumerate() {
            while self.is_placed(faces[lowest]) {
                lowest += 1;
            }
            let want = want.get(at).map(|&(_, from)| self.moving[from as usize] as usize);
            let rank = want.and_then(|want| self.rank_of(slot, &faces, faces[want]));
            let models = &mut self.models.permutation.rank[usize::from(was_first)];
            let found = (0..SUGGESTIONS).find(|&n| coder.bit(&mut models[n], rank == Some(n)));
            was_first = found == Some(0);
            let face = match found {
                // Who writes knows already which face has that rank.
                Some(_) if rank.is_some() => want.map(|want| faces[want]),
                Some(found) => self.suggestion(slot, &faces, found),
                None => {
                    let other = &mut self.models.permutation.other;
                    let ahead = other.code(coder, want.map_or(0, |want| (want - lowest) as u32)) as usize;
                    let face = lowest.checked_add(ahead).and_then(|at| faces.get(at)).copied();
                    face.filter(|&face| !self.is_placed(face))
                }
            };
            let face = face.ok_or(Fault("a face moves that is not there, or moves twice"))?;
            self.suggested[face as usize] = PLACED;
            self.live.face_at[slot as usize] = face;
            moved.push(face);
        }
        Ok(moved)
    }

    /// Whether a face has its place already, or does not move.
    fn is_placed(&self, face: u32) -> bool {
        self.suggested[face as usize] == PLACED
    }

    /// Which suggestion a face is, if it is one.
    fn rank_of(&mut self, slot: u32, faces: &[u32], wanted: u32) -> Option<usize> {
        let (mut rank, mut found) = (0, None);
        self.suggest(slot, faces, |face| {
            found = (face == wanted).then_some(rank);
            rank += 1;
            found.is_some() || rank == SUGGESTIONS
        });
        found
    }

    /// A suggestion by its rank, if there are so many.
    fn suggestion(&mut self, slot: u32, faces: &[u32], mut rank: usize) -> Option<u32> {
        let mut found = None;
        self.suggest(slot, faces, |face| {
            found = (rank == 0).then_some(face);
            rank = rank.wrapping_sub(1);
            found.is_some()
        });
        found
    }

    /// Suggests faces for a slot, likely ones first, none twice, until `enough` says that it needs no more: the face
    /// that followed on that of the slot before; then, for the slots before, the nearest first, the faces around
    /// each corner of theirs. Only faces without a place yet.
    fn suggest(&mut self, slot: u32, faces: &[u32], mut enough: impl FnMut(u32) -> bool) {
        self.searches += 1;
        let (live, moving, suggested) = (&self.live, &self.moving, &mut self.suggested);
        let mut offer = |face: u32| {
            let last = &mut suggested[face as usize];
            // A face that is placed has a number above all searches.
            let is_new = *last < self.searches;
            if is_new {
                *last = self.searches;
            }
            is_new && enough(face)
        };
        let Some(previous) = slot.checked_sub(1).map(|before| live.face_at[before as usize]) else { return };
        let followed = live.slot_of[previous as usize] as usize + 1;
        if let Some(&at) = moving.get(followed).filter(|&&at| at != NONE)
            && offer(faces[at as usize])
        {
            return;
        }
        for before in (slot.saturating_sub(WINDOW)..slot).rev() {
            for vertex in live.corners[live.face_at[before as usize] as usize] {
                if live.around[vertex as usize].iter().any(|&face| offer(face)) {
                    return;
                }
            }
        }
    }

    /// The permutation as the paper's cycles, each from its least slot.
    fn push_cycles(&mut self, level: u32, slots: &[u32], moved: &[u32]) -> Result<(), Fault> {
        // From here `moving` has for each slot the one that its face comes from.
        for (&slot, &face) in slots.iter().zip(moved) {
            let from = &mut self.live.slot_of[face as usize];
            self.moving[slot as usize] = std::mem::replace(from, slot);
        }
        let swaps = &mut self.mesh.swaps;
        for &start in slots {
            let (mut cycle, mut slot) = (Vec::new(), start);
            loop {
                let from = std::mem::replace(&mut self.moving[slot as usize], NONE);
                if from == NONE {
                    break;
                }
                cycle.push(slot);
                slot = from;
            }
            match cycle.len() {
                0 => {}
                1 => return Err(Fault("a face moves to where it is")),
                _ => swaps.cycles.push(cycle),
            }
        }
        swaps.levels.push(level);
        swaps.cycle_ends.push(swaps.cycles.len() as u32);
        Ok(())
    }
}
