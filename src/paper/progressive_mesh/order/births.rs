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
//! that of the orders, without the simplifier, on one core, if rings are tried everywhere. It was measured with earlier
//! rollouts, which took a third longer:
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
use super::patch::Numbering;
use super::rings::Rings;
use super::rollout::rollouts;
use crate::model::Model;
use crate::paper::progressive_mesh::cache::{Cache, Counter};
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
        return steps(Step::Base(base));
    }
    let mut at: Vec<u32> = Vec::new();
    for (n, some) in groups.chunks(rayon::current_num_threads()).enumerate() {
        let orders: Vec<Vec<u32>> = some.par_iter().map(|&[start, end]| layout.order(start, end)).collect();
        if n == 0 {
            let mut is_base = vec![false; model.faces.len()];
            base.iter().for_each(|&face| is_base[face as usize] = true);
            at.extend(orders[0].iter().filter(|&&face| is_base[face as usize]));
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

/// Data shared by the orders of all groups. Wedges are numbered in the order in which they appear; faces are in an
/// order in which neighbours are close to each other on the surface.
struct GroupLayout<'a> {
    options: &'a OrderOptions,
    /// The level at which each wedge appears.
    levels: Vec<u32>,
    /// The wedge that each wedge replaces when it appears; 0 if it replaces none.
    parents: Vec<u32>,
    /// What a cache sees of each wedge: its number in the model or, with [`OrderOptions::weld`], that of its position.
    vertices: Vec<u32>,
    /// The model's numbers of the faces, and the level at which each of them appears.
    faces: Vec<u32>,
    born: Vec<u32>,
    /// The corners of the faces in the full mesh.
    corners: Vec<[u32; 3]>,
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
        let mut number = vec![0; wedges.len()];
        wedges.iter().zip(0..).for_each(|(&wedge, n)| number[wedge as usize] = n);
        // The wedges of a component that has not appeared are drawn at the first vertex.
        let parent = |wedge: usize| match parents[wedge] {
            NOWHERE => 0,
            parent => number[parent as usize],
        };
        let vertex = |wedge: usize| if options.weld { model.wedge_positions[wedge] } else { wedge as u32 };
        let in_order = |of: &dyn Fn(usize) -> u32| wedges.iter().map(|&wedge| of(wedge as usize)).collect();
        let mut layout = Self {
            options,
            levels: in_order(&|wedge| wedge_born[wedge]),
            parents: in_order(&parent),
            vertices: in_order(&vertex),
            faces: (0..model.faces.len() as u32).collect(),
            corners: model.faces.iter().map(|face| face.map(|wedge| number[wedge as usize])).collect(),
            born,
        };
        layout.sort();
        layout
    }

    /// Sorts the faces in the order of the greedy optimizer for the full mesh.
    fn sort(&mut self) {
        let corners = self.corners(&self.faces, u32::MAX);
        let patch = Numbering::new(self.vertices.len()).patch(&corners, &[]).0;
        let (entries, lines) = (self.options.simulated().entries as u32, &mut Lines::new(self.faces.len()));
        self.faces = greedy(&patch, entries, &self.options.weights, &[], lines);
        self.born = self.faces.iter().map(|&face| self.born[face as usize]).collect();
        self.corners = self.faces.iter().map(|&face| self.corners[face as usize]).collect();
    }

    /// The faces that are live at level `end`, in the order in which levels from `start` on draw them.
    fn order(&self, start: u32, end: u32) -> Vec<u32> {
        let live: Vec<u32> =
            (0..).zip(&self.born).filter(|(_, born)| **born <= end).map(|(n, _)| n).collect();
        let mut numbering = Numbering::new(self.vertices.len());
        let mut corners = |level| numbering.compact(&self.corners(&live, level));
        let [first, second] = quarters(start, end);
        let late = corners(second);
        let order = match self.options.cache {
            Cache::Fifo(entries) => {
                let [early, last] = [first, end].map(corners);
                let vertices = numbering.vertices();
                self.fifo_order(Levels { corners: [early, late], vertices, entries }, &last)
            }
            Cache::Batches | Cache::H100 | Cache::Meshlets => {
                rollouts(&late, numbering.vertices(), self.options.simulated())
            }
        };
        order.into_iter().map(|n| self.faces[live[n as usize] as usize]).collect()
    }

    /// The better of the order by rollouts and orders in rings, after [`or_opt`]. The rings are those of the group's
    /// last level, because degenerate faces disturb them.
    fn fifo_order(&self, levels: Levels, last: &[[u32; 3]]) -> Vec<u32> {
        let simulated = self.options.simulated();
        let mut order = rollouts(&levels.corners[1], levels.vertices, simulated);
        let entries = simulated.entries as u32;
        let drawn = order.iter().map(|&face| last[face as usize]);
        let count = Counter::new(Cache::Fifo(entries), levels.vertices).count(drawn).transforms;
        let rings = Rings::new(last, levels.vertices, entries);
        if HOPELESS * u64::from(rings.typical_transforms()) < (HOPELESS + 1) * count {
            let rings = rings.orders().map(|(order, _)| order);
            order = best(&levels, [order].into_iter().chain(rings));
        }
        or_opt(&levels, order)
    }

    /// What a cache sees at `level` of the faces with these indices: a wedge that has not appeared is replaced by its
    /// predecessor.
    fn corners(&self, faces: &[u32], level: u32) -> Vec<[u32; 3]> {
        let mut shown = self.vertices.clone();
        let there = self.levels.partition_point(|&appears| appears <= level);
        // Wedge 0 replaces none, and is always shown.
        for wedge in there.max(1)..shown.len() {
            shown[wedge] = shown[self.parents[wedge] as usize];
        }
        let corners = faces.iter().map(|&face| self.corners[face as usize]);
        corners.map(|corners| corners.map(|wedge| shown[wedge as usize])).collect()
    }
}

/// Rings are not tried where a typical order in rings needs at least 1 / `HOPELESS` more transforms than rollouts, at
/// the group's last level. On scans it needs 5 to 29 % more (the dragon with 47,794 and 202,520 faces).
const HOPELESS: u64 = 16;

/// The levels at one and at three quarters of a group.
fn quarters(start: u32, end: u32) -> [u32; 2] {
    [1, 3].map(|quarters| start + quarters * (end - start) / 4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::named;
    use crate::paper::progressive_mesh::cache::transforms;

    #[test]
    fn on_a_sphere_rings_save_transforms_that_rollouts_and_or_opt_leave() {
        let model = named("sphere").expect("a generated model");
        let options = OrderOptions::IN_PLACE_23;
        let layout = GroupLayout::new(&model, &Collapses::default(), &options);
        let all: Vec<u32> = (0..model.faces.len() as u32).collect();
        let cost = |order: Vec<u32>, corners: &[[u32; 3]]| {
            let drawn: Vec<[u32; 3]> = order.iter().map(|&face| corners[face as usize]).collect();
            transforms(options.cache, &drawn).per_vertex()
        };
        let own: Vec<[u32; 3]> = (0..model.faces.len()).map(|face| model.face_positions(face)).collect();
        let with_rings = cost(layout.order(0, 0), &own);
        let faces = layout.corners(&all, 0);
        let (corners, vertices) = ([faces.clone(), faces.clone()], model.positions.len());
        let order = rollouts(&faces, vertices, options.simulated());
        let without =
            cost(or_opt(&Levels { corners, vertices, entries: options.cache.entries() }, order), &faces);
        assert!(with_rings < 0.99 * without, "{with_rings} with rings, {without} without");
    }
}
