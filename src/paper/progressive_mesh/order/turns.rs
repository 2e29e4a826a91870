//! Regions in turns: a tswap of a part of the faces, whenever the budget of moves pays for one.
//!
//! Where few faces may move, orders of all faces are far apart, and the levels before one cost half as much again as those
//! after it. A region is a run of neighbouring slots, which an order has made a patch of the surface, and the new
//! faces that belong to it. The faces that no order has seen then stay few, and the levels even. It costs what the
//! regions' borders cost, and so pays only where orders of all faces are far apart: see [`super`] for the numbers.

use super::Groups;
use super::assemble::Move;
use super::greedy::Lines;
use super::plan::Plan;
use std::ops::Range;

/// Faces of a region at least: the border of a smaller one costs more than the order saves.
const LEAST_FACES: usize = 800;

/// The faces that no order has seen.
struct Tail {
    /// Their first slot.
    start: usize,
    /// The splits that brought them.
    splits: Vec<u32>,
    /// For each of the model's faces, if it is one of them, the slot of the ordered ones to which it belongs.
    home: Vec<u32>,
    /// For each slot of the ordered ones, how many belong to it.
    guests: Vec<u32>,
}

impl Plan<'_> {
    /// Splits in the order of errors; at no level have more faces moved than the budget has for the splits so far.
    ///
    /// # Panics
    /// If the groups are not told as a budget.
    pub fn turns(&mut self, progress: &mut dyn FnMut(usize)) {
        let Groups::Budget(budget) = self.options.groups else {
            panic!("regions take turns within a budget of moves, not with {:?}", self.options.groups);
        };
        self.begin();
        let mut tail = Tail {
            start: self.at.len(),
            splits: Vec::new(),
            home: vec![0; self.slot_of.len()],
            guests: Vec::new(),
        };
        let (mut allowed, mut wait) = (0.0, 0.0);
        for level in 0..self.collapses.wedges.len() as u32 {
            let collapse = self.collapse(level);
            self.split(collapse);
            tail.splits.push(collapse);
            allowed += budget;
            let live = self.at.len();
            let length = (live / self.options.regions as usize).max(LEAST_FACES).min(tail.start);
            let share = (live - tail.start) * length / tail.start.max(1);
            if allowed < wait || allowed < (length + share) as f64 {
                continue;
            }
            tail.settle(self);
            let (region, guests) = tail.fullest(length);
            let most = (length + guests + tail.strangers(self, &region, guests)) as f64;
            if allowed < most {
                wait = most;
                continue;
            }
            // Its next turn comes when the budget has paid for all faces: half-way there is what its order is made for.
            let half = (0.5 * live as f64 / budget) as u32;
            self.look(level.saturating_add(half).min(self.collapses.wedges.len() as u32));
            allowed -= tail.renew(self, region, guests) as f64;
            wait = 0.0;
            progress(live);
        }
    }

    /// A face stands in a slot from now on.
    fn place(&mut self, slot: usize, face: u32) {
        self.at[slot] = face;
        self.slot_of[face as usize] = slot as u32;
    }
}

impl Tail {
    /// Finds where the tail's faces belong: to the middle one of the faces that their split changed.
    fn settle(&mut self, plan: &Plan) {
        self.guests.clear();
        self.guests.resize(self.start, 0);
        let mut slots = Vec::new();
        for &collapse in &self.splits {
            slots.clear();
            slots.extend(plan.changed_by(collapse).map(|face| match plan.slot_of[face as usize] {
                slot if (slot as usize) < self.start => slot,
                _ => self.home[face as usize],
            }));
            slots.sort_unstable();
            let home = slots.get(slots.len() / 2).copied().unwrap_or(0);
            for &face in plan.collapses.faces.row(collapse as usize) {
                self.home[face as usize] = home;
                self.guests[home as usize] += 1;
            }
        }
    }

    /// The run of `length` ordered slots with the most guests, the first of equal ones; and how many there are.
    fn fullest(&self, length: usize) -> (Range<usize>, usize) {
        let mut guests: usize = self.guests[..length].iter().map(|&guests| guests as usize).sum();
        let (mut start, mut most) = (0, guests);
        for end in length..self.guests.len() {
            guests = guests + self.guests[end] as usize - self.guests[end - length] as usize;
            if guests > most {
                (start, most) = (end + 1 - length, guests);
            }
        }
        (start..start + length, most)
    }

    /// Of the tail's first faces how many are no guests of a region, and make room for those that are.
    fn strangers(&self, plan: &Plan, region: &Range<usize>, guests: usize) -> usize {
        let first = &plan.at[self.start..self.start + guests];
        first.iter().filter(|&&face| !self.is_guest(face, region)).count()
    }

    fn is_guest(&self, face: u32, region: &Range<usize>) -> bool {
        region.contains(&(self.home[face as usize] as usize))
    }

    /// Brings a region's guests to the beginning of the tail, and gives the region with them a new order. Returns how many
    /// faces moved.
    fn renew(&mut self, plan: &mut Plan, region: Range<usize>, guests: usize) -> usize {
        let before = plan.at[self.start..].to_vec();
        let end = self.start + guests;
        let is_guest = |slot: &usize| self.is_guest(plan.at[*slot], &region);
        let coming = (end..plan.at.len()).filter(is_guest);
        let leaving = (self.start..end).filter(|slot| !is_guest(slot));
        let pairs: Vec<(usize, usize)> = coming.zip(leaving).collect();
        for (from, to) in pairs {
            let (guest, other) = (plan.at[from], plan.at[to]);
            plan.place(to, guest);
            plan.place(from, other);
        }
        let ranges = [region.clone(), self.start..end];
        let mut moves = plan.sorted(&ranges, &mut Lines::new(plan.at.len()));
        moves.iter().for_each(|&Move { slot, face }| plan.place(slot as usize, face));
        moves.retain(|moved| (moved.slot as usize) < self.start);
        let tail = plan.at[self.start..].iter().zip(self.start as u32..).zip(&before);
        moves.extend(
            tail.filter(|((face, _), old)| face != old).map(|((&face, slot), _)| Move { slot, face }),
        );
        let count = moves.len();
        plan.execute(moves);
        self.start = end;
        let mut splits = std::mem::take(&mut self.splits);
        splits.retain(|&collapse| {
            let face = plan.collapses.faces.row(collapse as usize).first();
            face.is_some_and(|&face| !self.is_guest(face, &region))
        });
        self.splits = splits;
        count
    }
}
