//! Births in place (ours): all faces that are live at the end of a group are in the index buffer from the group's first
//! level on, each beside its neighbours. An unborn face is degenerate: each unborn corner is drawn at the vertex from
//! which it will split.
//!
//! With the paper's tail, the levels between two tswaps cost more than the level just after a tswap: 0.2 transforms per
//! vertex at 23 moved faces per split, and 0.5 at 10. With births in place they cost no more. In return degenerate
//! faces are drawn: on average half of the faces that a group adds.
//!
//! An order is optimized for the level at three quarters of its group. An order that is optimized for the last level of
//! its group is bad at the first levels: on a torus, the 95th percentile of the levels' costs is then 1.94 transforms
//! per vertex.
//!
//! For a FIFO, each group takes the best of several orders (`candidates.rs`), and or-opt improves it (`or_opt.rs`). The
//! table has means of the closed models without their attributes, over all levels, in transforms per vertex. "Time" is
//! that of the orders, without the simplifier, on one core:
//!
//! | | in-place-23 | in batches | in-place-10 | in batches | time |
//! |---|---|---|---|---|---|
//! | rollouts | 1.242 | 1.661 | 1.267 | 1.688 | 1 |
//! | rollouts or rings | 1.237 | 1.662 | 1.256 | 1.687 | 1.2 |
//! | rollouts with or-opt | 1.235 | 1.661 | 1.258 | 1.687 | 1.3 |
//! | rollouts or rings, with or-opt | 1.230 | 1.661 | 1.248 | 1.686 | 1.5 |

use super::OrderOptions;
use super::assemble::{Move, Step};
use super::candidates::{Levels, best};
use super::greedy::{Lines, greedy};
use super::groups::group_ends;
use super::or_opt::or_opt;
use super::patch::{Numbering, Patch};
use super::rings::ring_orders;
use super::rollout::rollouts;
use crate::model::Model;
use crate::paper::progressive_mesh::cache::Cache;
use crate::paper::progressive_mesh::mesh::NOWHERE;
use crate::paper::progressive_mesh::simplify::Collapses;
use rayon::prelude::*;

/// Arranges the faces. Each group's order is a permutation at the group's last level: see
/// [`super::super::mesh::Births`]. Groups are independent, so their orders are computed in parallel.
pub(super) fn plan(
    model: &Model,
    collapses: &Collapses,
    options: &OrderOptions,
    base: Vec<u32>,
    steps: &mut dyn FnMut(Step),
    progress: &mut dyn FnMut(usize, usize),
) {
    let layout = GroupLayout::new(model, collapses, options);
    let ends = group_ends(options.groups, collapses, model.faces.len());
    let groups: Vec<[u32; 2]> =
        ends.iter().enumerate().map(|(n, &end)| [n.checked_sub(1).map_or(0, |n| ends[n]), end]).collect();
    if groups.is_empty() {
        steps(Step::Base(base));
    }
    let mut at: Vec<u32> = Vec::new();
    for (n, some) in groups.chunks(rayon::current_num_threads()).enumerate() {
        let orders: Vec<Vec<u32>> = some.par_iter().map(|&[start, end]| layout.order(start, end)).collect();
        if n == 0 {
            at.extend(orders[0].iter().filter(|&&face| layout.born[face as usize] == 0));
            steps(Step::Base(at.clone()));
            at.extend(collapses.faces.rows().rev().flatten());
        }
        for (order, &[_, end]) in orders.iter().zip(some) {
            let new = order.iter().enumerate().filter(|&(slot, face)| at[slot] != *face);
            let moves: Vec<Move> = new.map(|(slot, &face)| Move { slot: slot as u32, face }).collect();
            if !moves.is_empty() {
                steps(Step::Splits(end));
                steps(Step::Moves(moves));
            }
            at[..order.len()].copy_from_slice(order);
        }
        progress(orders.last().map_or(0, Vec::len), model.faces.len());
    }
}

/// Data shared by the orders of all groups.
struct GroupLayout<'a> {
    model: &'a Model,
    options: &'a OrderOptions,
    /// The level at which each face and each wedge appears.
    born: Vec<u32>,
    wedge_born: Vec<u32>,
    /// The wedge that replaces each wedge until it appears; [`NOWHERE`] for the wedges of level 0.
    parents: Vec<u32>,
    /// Wedges in the order of appearance.
    wedges: Vec<u32>,
    /// The full mesh's faces in a cache-friendly order: faces next to each other in this order are close on the
    /// surface.
    near: Vec<u32>,
}

impl<'a> GroupLayout<'a> {
    fn new(model: &'a Model, collapses: &Collapses, options: &'a OrderOptions) -> Self {
        let last = collapses.wedges.len() as u32;
        let mut born = vec![0; model.faces.len()];
        let mut wedge_born = vec![0; model.wedge_positions.len()];
        let mut parents = vec![NOWHERE; wedge_born.len()];
        for (collapse, level) in (0..last).rev().enumerate() {
            let level = level + 1;
            collapses.faces.row(collapse).iter().for_each(|&face| born[face as usize] = level);
            let pairs = collapses.wedges.row(collapse);
            // A wedge without a target takes the target of another wedge of its collapse.
            let other = pairs.iter().map(|pair| pair[1]).find(|&target| target != NOWHERE);
            for &[wedge, target] in pairs {
                wedge_born[wedge as usize] = level;
                parents[wedge as usize] = if target == NOWHERE { other.unwrap_or(NOWHERE) } else { target };
            }
        }
        let mut wedges: Vec<u32> = (0..wedge_born.len() as u32).collect();
        wedges.sort_by_key(|&wedge| wedge_born[wedge as usize]);
        // The wedges of a component that has not appeared are drawn at the first vertex.
        if let Some((&first, others)) = wedges.split_first() {
            let lost = |&&wedge: &&u32| wedge_born[wedge as usize] > 0 && parents[wedge as usize] == NOWHERE;
            let lost: Vec<u32> = others.iter().filter(lost).copied().collect();
            lost.iter().for_each(|&wedge| parents[wedge as usize] = first);
        }
        let mut layout = Self { model, options, born, wedge_born, parents, wedges, near: Vec::new() };
        layout.near = layout.nearby();
        layout
    }

    /// The full mesh's faces in the order of the greedy optimizer.
    fn nearby(&self) -> Vec<u32> {
        let faces: Vec<u32> = (0..self.model.faces.len() as u32).collect();
        let patch = self.patch(&faces, u32::MAX);
        greedy(
            &patch,
            self.options.simulated().entries as u32,
            &self.options.weights,
            &[],
            &mut Lines::new(faces.len()),
        )
    }

    /// The faces that are live at level `end`, in the order in which levels from `start` on draw them.
    fn order(&self, start: u32, end: u32) -> Vec<u32> {
        let live = self.near.iter().copied().filter(|&face| self.born[face as usize] <= end);
        let faces: Vec<u32> = live.collect();
        let patch = self.patch(&faces, quarters(start, end)[1]);
        let order = rollouts(&patch.faces, patch.vertices, self.options.simulated());
        let order = match self.options.cache {
            Cache::Fifo(entries) => self.improved(order, &faces, [start, end], entries),
            Cache::Batches | Cache::H100 | Cache::Meshlets => order,
        };
        order.into_iter().map(|face| faces[face as usize]).collect()
    }

    /// The better of an order and orders in rings, after [`or_opt`], for a FIFO. The rings are those of the group's
    /// last level, because degenerate faces disturb them. Orders are indices into `faces`.
    fn improved(&self, order: Vec<u32>, faces: &[u32], [start, end]: [u32; 2], entries: u32) -> Vec<u32> {
        let corners = quarters(start, end).map(|level| self.corners(faces, level));
        let levels = Levels { corners, vertices: self.parents.len(), entries };
        let last = self.patch(faces, end);
        let rings = ring_orders(&last.faces, last.vertices, self.options.simulated().entries as u32);
        or_opt(&levels, best(&levels, [order].into_iter().chain(rings.map(|(order, _)| order))))
    }

    /// [`GroupLayout::corners`] with compact vertex numbers.
    fn patch(&self, faces: &[u32], level: u32) -> Patch {
        Numbering::new(self.parents.len()).patch(&self.corners(faces, level), &[]).0
    }

    /// The faces as a cache sees them at `level`: wedges that have not appeared are replaced by their
    /// predecessors.
    fn corners(&self, faces: &[u32], level: u32) -> Vec<[u32; 3]> {
        let mut shown: Vec<u32> = vec![NOWHERE; self.parents.len()];
        for &wedge in &self.wedges {
            let is_there =
                self.wedge_born[wedge as usize] <= level || self.parents[wedge as usize] == NOWHERE;
            shown[wedge as usize] =
                if is_there { wedge } else { shown[self.parents[wedge as usize] as usize] };
        }
        let vertex = |wedge: u32| match self.options.weld {
            true => self.model.wedge_positions[shown[wedge as usize] as usize],
            false => shown[wedge as usize],
        };
        faces.iter().map(|&face| self.model.faces[face as usize].map(vertex)).collect()
    }
}

/// The levels at one and at three quarters of a group.
fn quarters(start: u32, end: u32) -> [u32; 2] {
    [1, 3].map(|quarters| start + quarters * (end - start) / 4)
}
