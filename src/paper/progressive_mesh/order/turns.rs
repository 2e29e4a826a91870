//! Regions in turns: a tswap reorders one region of the faces whenever the budget of moves allows it.
//!
//! With a small budget, reorderings of all faces are far apart, and the levels before a reordering cost 1.5
//! times as much as the levels after it. A region is a run of adjacent slots (a patch of the surface, thanks
//! to an earlier order) together with the new faces that belong to it. With regions few faces stay unordered,
//! and the cost is even over the levels. But region borders cost transforms, so regions pay only with small
//! budgets: see [`super`] for the numbers.

use super::Groups;
use super::assemble::Move;
use super::greedy::Lines;
use super::plan::RefinementState;
use std::ops::Range;

/// Minimum faces of a region: the border of a smaller region costs more than the order saves.
const MIN_FACES: usize = 800;

/// The faces that no order covers yet.
struct Tail {
    /// The slot of the tail's first face.
    start: usize,
    /// The splits that added the tail's faces.
    splits: Vec<u32>,
    /// The ordered slot to which each face of the tail belongs, by the face's number in the model.
    home: Vec<u32>,
    /// For each ordered slot: the number of tail faces that belong to it.
    incoming: Vec<u32>,
}

impl RefinementState<'_> {
    /// Executes the splits in the order of errors. At every level, the moved faces so far are within the
    /// budget of the splits so far.
    ///
    /// # Panics
    /// If the groups are not given as a budget.
    pub fn turns(&mut self, progress: &mut dyn FnMut(usize)) {
        let Groups::Budget(budget) = self.options.groups else {
            panic!("regions take turns within a budget of moves, not with {:?}", self.options.groups);
        };
        self.begin();
        let mut tail = Tail {
            start: self.at.len(),
            splits: Vec::new(),
            home: vec![0; self.slot_of.len()],
            incoming: Vec::new(),
        };
        let (mut allowed, mut wait) = (0.0, 0.0);
        for level in 0..self.collapses.wedges.len() as u32 {
            let collapse = self.collapse(level);
            self.split(collapse);
            allowed += budget;
            if tail.start == 0 {
                // Level 0 has no faces: the first faces that appear are not ordered yet.
                tail.start = self.at.len();
                continue;
            }
            tail.splits.push(collapse);
            let live = self.at.len();
            let length = (live / self.options.regions as usize).max(MIN_FACES).min(tail.start);
            let share = (live - tail.start) * length / tail.start.max(1);
            if allowed < wait || allowed < (length + share) as f64 {
                continue;
            }
            tail.settle(self);
            let (region, incoming) = tail.fullest(length);
            let max = (length + incoming + tail.displaced(self, &region, incoming)) as f64;
            if allowed < max {
                wait = max;
                continue;
            }
            // A region's next turn comes when the budget allows as many moves as there are faces. The order is
            // optimized for the level half-way to that turn.
            let half = (0.5 * live as f64 / budget) as u32;
            self.look(level.saturating_add(half).min(self.collapses.wedges.len() as u32));
            allowed -= tail.renew(self, region, incoming) as f64;
            wait = 0.0;
            progress(live);
        }
    }
}

impl Tail {
    /// Finds the ordered slot to which each face of the tail belongs: the median slot of the faces that the split of
    /// this face changed.
    fn settle(&mut self, plan: &RefinementState) {
        self.incoming.clear();
        self.incoming.resize(self.start, 0);
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
                self.incoming[home as usize] += 1;
            }
        }
    }

    /// The run of `length` ordered slots with the most incoming faces (on a tie, the first run), and the number of
    /// these faces.
    fn fullest(&self, length: usize) -> (Range<usize>, usize) {
        let mut incoming: usize = self.incoming[..length].iter().map(|&count| count as usize).sum();
        let (mut start, mut max) = (0, incoming);
        for end in length..self.incoming.len() {
            incoming = incoming + self.incoming[end] as usize - self.incoming[end - length] as usize;
            if incoming > max {
                (start, max) = (end + 1 - length, incoming);
            }
        }
        (start..start + length, max)
    }

    /// The number of the tail's first `incoming` faces that do not belong to `region` and must make room.
    fn displaced(&self, plan: &RefinementState, region: &Range<usize>, incoming: usize) -> usize {
        let first = &plan.at[self.start..self.start + incoming];
        first.iter().filter(|&&face| !self.is_incoming(face, region)).count()
    }

    fn is_incoming(&self, face: u32, region: &Range<usize>) -> bool {
        region.contains(&(self.home[face as usize] as usize))
    }

    /// Swaps a region's incoming faces to the start of the tail, then reorders the region together with them.
    /// Returns the number of moved faces.
    fn renew(&mut self, plan: &mut RefinementState, region: Range<usize>, incoming: usize) -> usize {
        let before = plan.at[self.start..].to_vec();
        let end = self.start + incoming;
        let is_incoming = |slot: &usize| self.is_incoming(plan.at[*slot], &region);
        let coming = (end..plan.at.len()).filter(is_incoming);
        let leaving = (self.start..end).filter(|slot| !is_incoming(slot));
        let pairs: Vec<(usize, usize)> = coming.zip(leaving).collect();
        for (from, to) in pairs {
            let (coming, other) = (plan.at[from], plan.at[to]);
            plan.place(&[Move { slot: to as u32, face: coming }, Move { slot: from as u32, face: other }]);
        }
        let ranges = [region.clone(), self.start..end];
        let mut moves = plan.sorted(&ranges, &mut Lines::new(plan.at.len()));
        plan.place(&moves);
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
            face.is_some_and(|&face| !self.is_incoming(face, &region))
        });
        self.splits = splits;
        count
    }
}
