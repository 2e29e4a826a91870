//! The order with new faces at the tail. Walks up from level 0 group by group: executes the splits, then
//! reorders the faces. [`super::turns`] reorders one region at a time.

use super::assemble::{Move, Step};
use super::descent::Descent;
use super::greedy::{Lines, Stretch, greedy};
use super::groups::group_ends;
use super::patch::{Numbering, Patch};
use super::{OrderOptions, Weights};
use crate::math::ragged::Ragged;
use crate::model::Model;
use crate::paper::progressive_mesh::cache::Counter;
use crate::paper::progressive_mesh::mesh::NOWHERE;
use crate::paper::progressive_mesh::simplify::Collapses;
use std::ops::Range;
use std::slice;

/// The mesh on its way up from level 0. A split is named by the collapse that it undoes.
pub(super) struct RefinementState<'a> {
    model: &'a Model,
    pub collapses: &'a Collapses,
    pub options: &'a OrderOptions,
    /// The corners of the model's faces at the level that [`RefinementState::look`] has reached; for faces that appear
    /// later, the corners of their first level.
    corners: Vec<[u32; 3]>,
    /// The number of splits applied to `corners`.
    seen: u32,
    /// For each removed wedge the faces that its split changes, and for each collapse its first wedge.
    changed: Ragged<u32>,
    first_wedge: Vec<u32>,
    /// The live face in each slot, and the slot of each face.
    pub at: Vec<u32>,
    pub slot_of: Vec<u32>,
    numbering: Numbering,
    /// The number of splits executed.
    done: u32,
    /// Receives the steps of the arrangement.
    steps: &'a mut dyn FnMut(Step),
}

/// Arranges the faces of all levels, with new faces at the tail.
pub(super) fn plan(
    model: &Model,
    collapses: &Collapses,
    options: &OrderOptions,
    base: Vec<u32>,
    steps: &mut dyn FnMut(Step),
    progress: &mut dyn FnMut(usize, usize),
) {
    let mut plan = RefinementState::new(model, collapses, options, base, steps);
    let mut progress = |done| progress(done, model.faces.len());
    match options.regions {
        1 => plan.groups(&mut progress),
        _ => plan.turns(&mut progress),
    }
}

impl<'a> RefinementState<'a> {
    fn new(
        model: &'a Model,
        collapses: &'a Collapses,
        options: &'a OrderOptions,
        base: Vec<u32>,
        steps: &'a mut dyn FnMut(Step),
    ) -> Self {
        let down = Descent::new(model, collapses);
        let first_wedge = (0..collapses.wedges.len())
            .map(|collapse| collapses.wedges.range(collapse).start as u32)
            .collect();
        let mut slot_of = vec![NOWHERE; model.faces.len()];
        base.iter().enumerate().for_each(|(slot, &face)| slot_of[face as usize] = slot as u32);
        Self {
            model,
            collapses,
            options,
            corners: down.faces,
            seen: 0,
            changed: down.changed,
            first_wedge,
            at: base,
            slot_of,
            numbering: Numbering::new(model.wedge_positions.len()),
            done: 0,
            steps,
        }
    }

    /// Level 0 needs no tswap: its faces get their final order at once.
    pub fn begin(&mut self) {
        let moves = self.sorted(slice::from_ref(&(0..self.at.len())), &mut Lines::new(self.at.len()));
        self.place(&moves);
        (self.steps)(Step::Base(self.at.clone()));
    }

    /// Reorders all live faces at the end of each group.
    fn groups(&mut self, progress: &mut dyn FnMut(usize)) {
        let ends = group_ends(self.options.groups, self.collapses, self.model.faces.len());
        self.look_between(0, ends.first().copied().unwrap_or(0));
        self.begin();
        for (n, &end) in ends.iter().enumerate() {
            let start = self.done;
            (start..end).for_each(|level| self.split(self.collapse(level)));
            (self.steps)(Step::Splits(end));
            let mut lines = Lines::new(self.at.len());
            if self.options.weights.line != 0.0 {
                // The splits touch the lines of the faces that they write.
                for collapse in (start..end).map(|level| self.collapse(level)) {
                    self.faces_of(collapse)
                        .for_each(|face| lines.touch(self.slot_of[face as usize] as usize));
                }
            }
            self.look_between(end, ends.get(n + 1).copied().unwrap_or(end));
            self.sort(slice::from_ref(&(0..self.at.len())), &mut lines);
            progress(self.at.len());
        }
    }

    /// The collapse that the split from `level` to the next level undoes.
    pub fn collapse(&self, level: u32) -> u32 {
        self.collapses.wedges.len() as u32 - 1 - level
    }

    /// From now on, orders are optimized for the faces' corners at `level`. A lower level than before has no
    /// effect.
    pub fn look(&mut self, level: u32) {
        while self.seen < level {
            self.write(self.collapse(self.seen));
            self.seen += 1;
        }
    }

    /// As [`RefinementState::look`], for an order that is made at `level` and used until level `next`: with `ahead`,
    /// the order is optimized for the level half-way between the two.
    fn look_between(&mut self, level: u32, next: u32) {
        self.look(if self.options.ahead { level.midpoint(next) } else { level });
    }

    /// The live faces that a split changes.
    pub fn changed_by(&self, collapse: u32) -> impl Iterator<Item = u32> {
        let first = self.first_wedge[collapse as usize] as usize;
        let wedges = self.collapses.wedges.row(collapse as usize).len();
        (first..first + wedges).flat_map(|wedge| self.changed.row(wedge)).copied()
    }

    /// The faces that a split changes or adds.
    fn faces_of(&self, collapse: u32) -> impl Iterator<Item = u32> {
        self.changed_by(collapse).chain(self.collapses.faces.row(collapse as usize).iter().copied())
    }

    /// Appends a split's faces to the tail.
    pub fn split(&mut self, collapse: u32) {
        self.done += 1;
        for &face in self.collapses.faces.row(collapse as usize) {
            self.slot_of[face as usize] = self.at.len() as u32;
            self.at.push(face);
        }
    }

    /// Writes a split's wedges into the corners of the faces that it changes.
    fn write(&mut self, collapse: u32) {
        let first = self.first_wedge[collapse as usize] as usize;
        for (n, &[wedge, target]) in self.collapses.wedges.row(collapse as usize).iter().enumerate() {
            for &face in self.changed.row(first + n) {
                let corners = &mut self.corners[face as usize];
                corners.iter_mut().filter(|corner| **corner == target).for_each(|corner| *corner = wedge);
            }
        }
    }

    /// A face's corners as the cache sees them: positions if wedges are welded.
    fn shared(&self, face: u32) -> [u32; 3] {
        let wedges = self.corners[face as usize];
        if self.options.weld {
            wedges.map(|wedge| self.model.wedge_positions[wedge as usize])
        } else {
            wedges
        }
    }

    /// The cache's content before `slot` is drawn: the distinct vertices before it, oldest first.
    fn warm(&self, slot: usize) -> Vec<u32> {
        let mut warm = Vec::new();
        for before in (0..slot).rev() {
            for vertex in self.shared(self.at[before]).into_iter().rev() {
                if !warm.contains(&vertex) {
                    warm.push(vertex);
                }
            }
            if warm.len() >= self.options.cache.entries() as usize {
                break;
            }
        }
        warm.reverse();
        warm
    }

    /// Reorders the faces in ascending ranges of slots.
    pub fn sort(&mut self, ranges: &[Range<usize>], lines: &mut Lines) {
        let moves = self.sorted(ranges, lines);
        self.execute(moves);
    }

    /// The moves that reorder the faces in ascending ranges of slots.
    pub fn sorted(&mut self, ranges: &[Range<usize>], lines: &mut Lines) -> Vec<Move> {
        let slots: Vec<usize> = ranges.iter().cloned().flatten().collect();
        let faces: Vec<u32> = slots.iter().map(|&slot| self.at[slot]).collect();
        let corners: Vec<[u32; 3]> = faces.iter().map(|&face| self.shared(face)).collect();
        let begins = |place: usize| place == 0 || slots[place - 1] + 1 < slots[place];
        let firsts: Vec<usize> = (0..slots.len()).filter(|&place| begins(place)).collect();
        let warm: Vec<Vec<u32>> = firsts.iter().map(|&place| self.warm(slots[place])).collect();
        let (patch, warm) = self.numbering.patch(&corners, &warm);
        let stretches = firsts.into_iter().zip(warm).map(|(first, warm)| Stretch { first, warm });
        let order = self.best_order(&patch, &stretches.collect::<Vec<_>>(), lines);
        let new = slots.into_iter().zip(order.iter().map(|&face| faces[face as usize]));
        let moved = new.filter(|&(slot, face)| self.at[slot] != face);
        moved.map(|(slot, face)| Move { slot: slot as u32, face }).collect()
    }

    /// A greedy order; for the last level, the best of several greedy orders.
    fn best_order(&self, patch: &Patch, stretches: &[Stretch], lines: &mut Lines) -> Vec<u32> {
        let options = self.options;
        let simulated = options.simulated().entries as u32;
        if !options.ahead || (self.done as usize) < self.collapses.wedges.len() {
            return greedy(patch, simulated, &options.weights, stretches, lines);
        }
        let mut counter = Counter::new(options.cache, patch.vertices);
        let count = patch.faces.len();
        let begins = (LAST_FACES / count.max(1)).clamp(1, 7);
        // One greedy order of the dragon takes a second.
        let few = [options.weights.valence];
        let valences: &[f64] = if count > LAST_FACES { &few } else { &VALENCES };
        let mut best = (u64::MAX, Vec::new());
        for begin in (0..begins).map(|n| n * count / begins) {
            let turned = patch.turned(begin);
            for &valence in valences {
                // No split follows, so the whole cache is tried too, without spare entries.
                for entries in [simulated, options.cache.entries()] {
                    let weights = Weights { valence, ..options.weights };
                    let order = greedy(&turned, entries, &weights, stretches, &mut Lines::new(self.at.len()));
                    let drawn = counter.count(order.iter().map(|&face| turned.faces[face as usize]));
                    if drawn.transforms < best.0 {
                        let faces = order.into_iter().map(|face| ((face as usize + begin) % count) as u32);
                        best = (drawn.transforms, faces.collect());
                    }
                }
            }
        }
        best.1
    }

    /// Moves faces to other slots at the current level.
    pub fn execute(&mut self, moves: Vec<Move>) {
        self.place(&moves);
        if !moves.is_empty() {
            (self.steps)(Step::Splits(self.done));
            (self.steps)(Step::Moves(moves));
        }
    }

    /// As [`RefinementState::execute`], but the moves are not a step of the arrangement.
    pub fn place(&mut self, moves: &[Move]) {
        for &Move { slot, face } in moves {
            self.at[slot as usize] = face;
            self.slot_of[face as usize] = slot;
        }
    }
}

/// Values of [`Weights::valence`] that the last level tries: no single value is best on all meshes.
const VALENCES: [f64; 4] = [0.3, 0.6, 1.0, 1.6];

/// Maximum number of faces ordered with each of these weights, over all starting faces together. Meshes below a seventh
/// of this number try seven starting faces. Meshes above this number try only the weight of the other levels.
const LAST_FACES: usize = 100_000;
