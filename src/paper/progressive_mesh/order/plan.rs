//! The way up from M0, group by group: splits are executed, then the faces get a new order.

use super::assemble::{Arrangement, Move};
use super::coherent::{Offer, coherent};
use super::depend::dependencies;
use super::descent::Descent;
use super::greedy::{Lines, Stretch, greedy};
use super::groups::group_ends;
use super::patch::Numbering;
use super::{OrderOptions, Within};
use crate::math::ragged::Ragged;
use crate::paper::progressive_mesh::mesh::NOWHERE;
use crate::paper::progressive_mesh::simplify::Collapses;
use crate::scene::model::Model;
use std::collections::HashMap;

/// The mesh on its way up. Splits are called by their collapses.
pub(super) struct Plan<'a> {
    model: &'a Model,
    collapses: &'a Collapses,
    options: &'a OrderOptions,
    /// The model's faces: as they are at the present level, or as they will appear.
    corners: Vec<[u32; 3]>,
    /// For each removed wedge the faces that change, and for each collapse the first of its wedges.
    changed: Ragged<u32>,
    first_wedge: Vec<u32>,
    /// Live faces by slot, and the slots of the faces.
    at: Vec<u32>,
    slot_of: Vec<u32>,
    numbering: Numbering,
    /// What has been done: the splits in their order, and what an arrangement needs.
    sequence: Vec<u32>,
    arrangement: Arrangement,
}

/// The order of all faces at all levels, and the collapses in the order that it needs.
pub(super) fn plan(
    model: &Model,
    collapses: &Collapses,
    options: &OrderOptions,
    base: Vec<u32>,
    progress: &mut dyn FnMut(usize, usize),
) -> (Collapses, Arrangement) {
    let mut plan = Plan::new(model, collapses, options, base);
    let coherent = (options.within == Within::Coherent).then(|| dependencies(model, collapses));
    let last = collapses.wedges.len();
    let mut level = 0;
    for end in group_ends(options.groups, collapses, model.faces.len()) {
        let group: Vec<u32> = (level..end).map(|level| last as u32 - 1 - level).collect();
        match &coherent {
            None => plan.group(&group),
            Some(dependencies) => plan.parts(&group, dependencies),
        }
        level = end;
        progress(plan.at.len(), model.faces.len());
    }
    plan.finish()
}

impl<'a> Plan<'a> {
    fn new(model: &'a Model, collapses: &'a Collapses, options: &'a OrderOptions, base: Vec<u32>) -> Self {
        let down = Descent::new(model, collapses);
        let first_wedge = (0..collapses.wedges.len())
            .map(|collapse| collapses.wedges.range(collapse).start as u32)
            .collect();
        let mut slot_of = vec![NOWHERE; model.faces.len()];
        base.iter().enumerate().for_each(|(slot, &face)| slot_of[face as usize] = slot as u32);
        let mut plan = Self {
            model,
            collapses,
            options,
            corners: down.faces,
            changed: down.changed,
            first_wedge,
            at: base,
            slot_of,
            numbering: Numbering::new(model.wedge_positions.len()),
            sequence: Vec::with_capacity(collapses.wedges.len()),
            arrangement: Arrangement::default(),
        };
        // M0 needs no tswap: its faces are born where they shall stand.
        plan.sort(0, plan.at.len(), plan.at.len(), &mut Lines::new(plan.at.len()));
        plan.arrangement = Arrangement { births: plan.at.clone(), moves: Vec::new() };
        plan
    }

    fn finish(mut self) -> (Collapses, Arrangement) {
        self.sequence.reverse();
        (reordered(self.collapses, &self.sequence), self.arrangement)
    }

    /// A group in the order of errors.
    fn group(&mut self, group: &[u32]) {
        group.iter().for_each(|&collapse| self.split(collapse));
        let mut lines = Lines::new(self.at.len());
        if self.options.weights.line != 0.0 {
            // What the splits write is touched in any case.
            for &collapse in group {
                self.faces_of(collapse).for_each(|face| lines.touch(self.slot_of[face as usize] as usize));
            }
        }
        self.sort(0, self.at.len(), self.at.len(), &mut lines);
    }

    /// A group part by part: each part's splits in a coherent order, then a tswap of that part and what it added.
    fn parts(&mut self, group: &[u32], dependencies: &Ragged<u32>) {
        let live = self.at.len();
        let parts = self.divide(group, dependencies);
        let (count, ends) = (parts.len(), |part: usize| (part * live).div_ceil(parts.len()));
        for (part, splits) in parts.iter().enumerate().filter(|(_, splits)| !splits.is_empty()) {
            let tail = self.at.len();
            let offers: Vec<Offer> = splits.iter().map(|&collapse| self.offer(collapse)).collect();
            for collapse in coherent(&offers, dependencies, self.options.cache_entries) {
                self.split(collapse);
            }
            let (start, end) = if count == 1 { (0, self.at.len()) } else { (ends(part), ends(part + 1)) };
            self.sort(start, end, tail.max(end), &mut Lines::new(self.at.len()));
        }
    }

    /// The splits of a group by runs of slots, in the order of these: a split belongs to the run in which most of the
    /// faces stand that it changes, or to the later one of a split that it depends on.
    fn divide(&self, group: &[u32], dependencies: &Ragged<u32>) -> Vec<Vec<u32>> {
        let live = self.at.len();
        let count = self.options.run_faces.map_or(1, |faces| (live / faces.max(1) as usize).max(1));
        let mut parts = vec![Vec::new(); count];
        let mut part_of: HashMap<u32, usize> = HashMap::new();
        let mut part_of_face: HashMap<u32, usize> = HashMap::new();
        for &collapse in group {
            let part = |&face: &u32| match part_of_face.get(&face) {
                Some(&part) => part,
                None => self.slot_of[face as usize] as usize * count / live,
            };
            let mut changed: Vec<usize> = self.changed_by(collapse).map(|face| part(&face)).collect();
            changed.sort_unstable();
            let here = changed.get(changed.len() / 2).copied().unwrap_or(0);
            let before = dependencies.row(collapse as usize).iter().filter_map(|before| part_of.get(before));
            let part = before.copied().fold(here, usize::max);
            part_of.insert(collapse, part);
            part_of_face.extend(self.collapses.faces.row(collapse as usize).iter().map(|&face| (face, part)));
            parts[part].push(collapse);
        }
        parts
    }

    fn offer(&self, collapse: u32) -> Offer {
        let faces = self.collapses.faces.row(collapse as usize).iter();
        let mut vertices: Vec<u32> = faces.flat_map(|&face| self.shared(face)).collect();
        vertices.sort_unstable();
        vertices.dedup();
        Offer { collapse, vertices }
    }

    /// The live faces that a split changes.
    fn changed_by(&self, collapse: u32) -> impl Iterator<Item = u32> {
        let first = self.first_wedge[collapse as usize] as usize;
        let wedges = self.collapses.wedges.row(collapse as usize).len();
        (first..first + wedges).flat_map(|wedge| self.changed.row(wedge)).copied()
    }

    /// Those and what it adds.
    fn faces_of(&self, collapse: u32) -> impl Iterator<Item = u32> {
        self.changed_by(collapse).chain(self.collapses.faces.row(collapse as usize).iter().copied())
    }

    fn split(&mut self, collapse: u32) {
        self.sequence.push(collapse);
        let first = self.first_wedge[collapse as usize] as usize;
        for (n, &[wedge, target]) in self.collapses.wedges.row(collapse as usize).iter().enumerate() {
            for &face in self.changed.row(first + n) {
                let corners = &mut self.corners[face as usize];
                corners.iter_mut().filter(|corner| **corner == target).for_each(|corner| *corner = wedge);
            }
        }
        for &face in self.collapses.faces.row(collapse as usize) {
            self.slot_of[face as usize] = self.at.len() as u32;
            self.at.push(face);
            self.arrangement.births.push(face);
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

    /// A new order for the faces in slots `start .. end` and from `tail` on.
    fn sort(&mut self, start: usize, end: usize, tail: usize, lines: &mut Lines) {
        let slots: Vec<u32> = (start..end).chain(tail..self.at.len()).map(|slot| slot as u32).collect();
        let faces: Vec<u32> = slots.iter().map(|&slot| self.at[slot as usize]).collect();
        let corners: Vec<[u32; 3]> = faces.iter().map(|&face| self.shared(face)).collect();
        let mut stretches = vec![(0, start)];
        if start < end && tail > end && tail < self.at.len() {
            stretches.push((end - start, tail));
        }
        let warm: Vec<Vec<u32>> = stretches.iter().map(|&(_, slot)| self.warm(slot)).collect();
        let (patch, warm) = self.numbering.patch(&corners, &warm);
        let stretches = stretches.into_iter().zip(warm);
        let stretches: Vec<Stretch> = stretches.map(|((first, _), warm)| Stretch { first, warm }).collect();
        let order =
            greedy(&patch, self.options.simulated_entries(), &self.options.weights, &stretches, lines);
        let moves: Vec<Move> = slots
            .iter()
            .zip(order.iter().map(|&face| faces[face as usize]))
            .filter(|&(&slot, face)| self.at[slot as usize] != face)
            .map(|(&slot, face)| Move { slot, face })
            .collect();
        for &Move { slot, face } in &moves {
            self.at[slot as usize] = face;
            self.slot_of[face as usize] = slot;
        }
        if !moves.is_empty() {
            self.arrangement.moves.push((self.sequence.len() as u32, moves));
        }
    }
}

/// The collapses in another order, from the full mesh down; errors are those of the worst so far.
fn reordered(collapses: &Collapses, order: &[u32]) -> Collapses {
    let mut worst = 0.0f64;
    let mut error = |&collapse: &u32| {
        worst = worst.max(collapses.errors[collapse as usize]);
        worst
    };
    Collapses {
        errors: order.iter().map(&mut error).collect(),
        wedges: order
            .iter()
            .map(|&collapse| collapses.wedges.row(collapse as usize).iter().copied())
            .collect(),
        faces: order.iter().map(|&collapse| collapses.faces.row(collapse as usize).iter().copied()).collect(),
    }
}
