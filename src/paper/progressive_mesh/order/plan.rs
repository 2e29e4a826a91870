//! The way up from M0, group by group: splits are executed, then the faces get a new order. Where only a region of the
//! faces gets one at a time: see [`super::turns`].

use super::assemble::{Arrangement, Move};
use super::descent::Descent;
use super::greedy::{Lines, Stretch, greedy};
use super::groups::group_ends;
use super::patch::{Numbering, Patch};
use super::{OrderOptions, Weights};
use crate::math::ragged::Ragged;
use crate::model::Model;
use crate::paper::progressive_mesh::cache::{Cache, Counter};
use crate::paper::progressive_mesh::mesh::NOWHERE;
use crate::paper::progressive_mesh::simplify::Collapses;
use std::ops::Range;
use std::slice;

/// The mesh on its way up. Splits are called by their collapses.
pub(super) struct Plan<'a> {
    model: &'a Model,
    pub collapses: &'a Collapses,
    pub options: &'a OrderOptions,
    /// The model's faces as orders are made for them: at the level that [`Plan::look`] has reached, or as they will
    /// appear.
    corners: Vec<[u32; 3]>,
    /// How many splits in the order of errors `corners` knows.
    seen: u32,
    /// For each removed wedge the faces that change, and for each collapse the first of its wedges.
    changed: Ragged<u32>,
    first_wedge: Vec<u32>,
    /// Live faces by slot, and the slots of the faces.
    pub at: Vec<u32>,
    pub slot_of: Vec<u32>,
    numbering: Numbering,
    /// What has been done: splits, and what an arrangement needs.
    done: u32,
    arrangement: Arrangement,
}

/// The order of all faces at all levels, those that splits bring at the tail.
pub(super) fn plan(
    model: &Model,
    collapses: &Collapses,
    options: &OrderOptions,
    base: Vec<u32>,
    progress: &mut dyn FnMut(usize, usize),
) -> Arrangement {
    let mut plan = Plan::new(model, collapses, options, base);
    let mut progress = |done| progress(done, model.faces.len());
    match options.regions {
        1 => plan.groups(&mut progress),
        _ => plan.turns(&mut progress),
    }
    plan.arrangement
}

impl<'a> Plan<'a> {
    fn new(model: &'a Model, collapses: &'a Collapses, options: &'a OrderOptions, base: Vec<u32>) -> Self {
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
            arrangement: Arrangement::default(),
        }
    }

    /// The faces of M0 need no tswap: they are born where they shall stand.
    pub fn begin(&mut self) {
        self.sort(slice::from_ref(&(0..self.at.len())), &mut Lines::new(self.at.len()));
        self.arrangement = Arrangement { births: self.at.clone(), moves: Vec::new() };
    }

    /// Groups in the order of errors.
    fn groups(&mut self, progress: &mut dyn FnMut(usize)) {
        let ends = group_ends(self.options.groups, self.collapses, self.model.faces.len());
        self.look_between(0, ends.first().copied().unwrap_or(0));
        self.begin();
        for (n, &end) in ends.iter().enumerate() {
            let start = self.done;
            (start..end).for_each(|level| self.split(self.collapse(level)));
            let mut lines = Lines::new(self.at.len());
            if self.options.weights.line != 0.0 {
                // What the splits write is touched in any case.
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

    /// The collapse that the split from `level` to the next one undoes, in the order of errors.
    pub fn collapse(&self, level: u32) -> u32 {
        self.collapses.wedges.len() as u32 - 1 - level
    }

    /// Orders are made for the faces of a level from now on: it does not fall.
    pub fn look(&mut self, level: u32) {
        while self.seen < level {
            self.write(self.collapse(self.seen));
            self.seen += 1;
        }
    }

    /// The order that is made at one tswap stands until the next: the level half-way is what it is made for.
    fn look_between(&mut self, level: u32, next: u32) {
        self.look(if self.options.ahead { level.midpoint(next) } else { level });
    }

    /// The live faces that a split changes.
    pub fn changed_by(&self, collapse: u32) -> impl Iterator<Item = u32> {
        let first = self.first_wedge[collapse as usize] as usize;
        let wedges = self.collapses.wedges.row(collapse as usize).len();
        (first..first + wedges).flat_map(|wedge| self.changed.row(wedge)).copied()
    }

    /// Those and what it adds.
    fn faces_of(&self, collapse: u32) -> impl Iterator<Item = u32> {
        self.changed_by(collapse).chain(self.collapses.faces.row(collapse as usize).iter().copied())
    }

    /// Appends a split's faces.
    pub fn split(&mut self, collapse: u32) {
        self.done += 1;
        for &face in self.collapses.faces.row(collapse as usize) {
            self.slot_of[face as usize] = self.at.len() as u32;
            self.at.push(face);
            self.arrangement.births.push(face);
        }
    }

    /// Puts a split's wedges into the corners of the faces that it changes.
    fn write(&mut self, collapse: u32) {
        let first = self.first_wedge[collapse as usize] as usize;
        for (n, &[wedge, target]) in self.collapses.wedges.row(collapse as usize).iter().enumerate() {
            for &face in self.changed.row(first + n) {
                let corners = &mut self.corners[face as usize];
                corners.iter_mut().filter(|corner| **corner == target).for_each(|corner| *corner = wedge);
            }
        }
    }

    /// A face as the cache is to see it.
    fn shared(&self, face: u32) -> [u32; 3] {
        let wedges = self.corners[face as usize];
        if self.options.weld {
            wedges.map(|wedge| self.model.wedge_positions[wedge as usize])
        } else {
            wedges
        }
    }

    /// What a cache holds when slot `slot` is drawn: the distinct vertices before it, the oldest first.
    fn warm(&self, slot: usize) -> Vec<u32> {
        let mut warm = Vec::new();
        for before in (0..slot).rev() {
            for vertex in self.shared(self.at[before]).into_iter().rev() {
                if !warm.contains(&vertex) {
                    warm.push(vertex);
                }
            }
            if warm.len() >= self.options.cache_entries as usize {
                break;
            }
        }
        warm.reverse();
        warm
    }

    /// A new order for the faces in some ranges of slots, ascending.
    pub fn sort(&mut self, ranges: &[Range<usize>], lines: &mut Lines) {
        let moves = self.sorted(ranges, lines);
        self.execute(moves);
    }

    /// What moves where the faces in some ranges of slots, ascending, get a new order.
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

    /// The greedy's order; of the last level, that of the best of several greedies.
    fn best_order(&self, patch: &Patch, stretches: &[Stretch], lines: &mut Lines) -> Vec<u32> {
        let options = self.options;
        if !options.ahead || (self.done as usize) < self.collapses.wedges.len() {
            return greedy(patch, options.simulated_entries(), &options.weights, stretches, lines);
        }
        let mut counter = Counter::new(Cache::Fifo(options.cache_entries), patch.vertices);
        let count = patch.faces.len();
        let begins = (LAST_FACES / count.max(1)).clamp(1, 7);
        // A dragon takes a second for each try.
        let few = [options.weights.valence];
        let valences: &[f64] = if count > LAST_FACES { &few } else { &VALENCES };
        let mut best = (u64::MAX, Vec::new());
        for begin in (0..begins).map(|n| n * count / begins) {
            let turned = patch.turned(begin);
            for &valence in valences {
                // Nothing is split any more: no entry need be spared.
                for entries in [options.simulated_entries(), options.cache_entries] {
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

    /// Faces get other slots at the present level.
    pub fn execute(&mut self, moves: Vec<Move>) {
        for &Move { slot, face } in &moves {
            self.at[slot as usize] = face;
            self.slot_of[face as usize] = slot;
        }
        if !moves.is_empty() {
            self.arrangement.moves.push((self.done, moves));
        }
    }
}

/// What the last level's orders value a finished vertex at (see [`Weights::valence`]): no one value is best on all meshes.
const VALENCES: [f64; 4] = [0.3, 0.6, 1.0, 1.6];

/// Faces that are ordered with each of these, in all tries together: small meshes are begun at seven faces, and larger ones
/// are ordered with the weights of all other levels alone.
const LAST_FACES: usize = 100_000;
