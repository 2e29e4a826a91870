//! The order of faces at every level of detail (paper 2, sections 4 and 5).
//!
//! [`classical`] is the plain view-independent progressive mesh, the paper's starting point: splits append vertices
//! and faces, and no face changes its slot. [`order`] is the paper's extension: the splits are divided into groups,
//! and each group ends with a permutation of the live faces (tswap).
//!
//! New faces are drawn in one of two places, see [`Births`]. In the paper they stay at the tail of the buffer until the
//! next tswap (`plan.rs`). With births in place (ours, `births.rs`) they are drawn beside their neighbours from the
//! first level of the group, and are degenerate until they are born. The mesh format is the same in both cases.
//!
//! Costs are transforms per position: means over the five closed shipped models. Tail orders are measured at 513 levels
//! of each model, births in place at all levels (in batches at 128: pm.average). "Mean", "95 %" (the cost that 95 % of
//! the levels do not exceed) and "full" (the full mesh) are for a FIFO of 16 entries. "Batches" is the mean for batches
//! of 32 vertices and 32 triangles. Orders that are optimized for batches are counted with each wedge as a vertex.
//! "Degenerate" is the number of degenerate faces drawn per live face, and "moved" is the number of faces that change
//! their slot per split. The 513 levels fall on the same few positions within each of the paper's 64 equal groups. Over
//! all levels the paper's order costs more: mean 2.10, 95 % 2.91 (pm.average).
//!
//! | order | mean | 95 % | full | batches | degenerate | moved |
//! |---|---|---|---|---|---|---|
//! | classical | 4.57 | 4.67 | 4.60 | 4.60 | | 0 |
//! | the paper's greedy, 64 equal groups ([`OrderOptions::PAPER`]) | 2.06 | 2.89 | 1.69 | 2.22 | | 60.1 |
//! | + valence term, geometric groups, 15 cache entries in the optimizer | 1.50 | 1.68 | 1.48 | 1.83 | | 22.6 |
//! | + optimized for half-way to the next tswap ([`OrderOptions::TAIL_23`]) | 1.49 | 1.65 | 1.26 | 1.81 | | 22.7 |
//! | the same with fewer groups | 1.74 | 2.07 | 1.26 | 2.01 | | 9.8 |
//! | three regions in turns ([`OrderOptions::TAIL_10`]) | 1.80 | 1.98 | 1.83 | 2.05 | | 9.6 |
//! | births in place ([`OrderOptions::IN_PLACE_23`]) | 1.23 | 1.26 | 1.22 | 1.66 | 0.05 | 22.7 |
//! | the same with fewer groups ([`OrderOptions::IN_PLACE_10`]) | 1.25 | 1.28 | 1.23 | 1.69 | 0.12 | 10.0 |
//! | births in place, optimized for batches ([`OrderOptions::cache`]) | | | | 1.52 | 0.05 | 22.7 |
//! | the same with fewer groups | | | | 1.55 | 0.12 | 10.0 |
//!
//! Why the tail orders are made this way (FIFO of 16 entries; collapses from one pass of the simplifier):
//! - There are as many groups as the budget allows, and each multiplies the number of faces by the same ratio, because
//!   new faces at the tail dominate the cost between two tswaps. An isolated pair of new faces costs 4 transforms
//!   instead of 1.3, so a group that adds a tenth of the faces costs 0.15 more on average. At the level of the
//!   tswap itself the order costs 1.30. Choosing the best of five weightings would save 0.02 transforms and take five
//!   times the work.
//! - The optimizer simulates 15 entries (`spare_entries`). An order that uses all 16 costs 1.24 on a torus, but 0.05
//!   more at the next levels. With 15 entries the mean falls from 1.54 to 1.52.
//! - Each order is optimized for the level half-way to the next tswap (`ahead`). This saves 0.01 at 23 moved faces per
//!   split and 0.04 at 10, and makes the levels more even.
//! - No split follows the last level, so it gets the best of eight greedy orders. Small meshes try each order from
//!   seven starting faces. The full mesh of a torus then costs 1.29; with one starting face 1.44, with one order 1.78.
//! - With few groups, `regions` are reordered in turns. If tswaps reorder all faces, the levels just before a tswap
//!   cost 0.8 more than the levels after it; with regions, 0.3 more. A region's borders cost transforms: with 1, 2, 3,
//!   4 and 8 regions and no limit on moves the mean is 1.33, 1.39, 1.44, 1.49 and 1.63.
//!
//! pm.moves compares other groups and regions, and pm.average compares meshoptimizer's orders.

mod assemble;
mod births;
mod candidates;
mod descent;
mod greedy;
mod groups;
mod or_opt;
mod patch;
mod plan;
mod rings;
mod rollout;
#[cfg(test)]
pub(super) mod scratch;
mod turns;

use super::cache::Cache;
use super::mesh::{Births, ProgressiveMesh};
use super::simplify::Collapses;
use crate::model::Model;
use crate::paper::progressive_mesh::choices::FaceOrder;
use assemble::{Step, assemble};
use rollout::Simulated;
use std::sync::mpsc;

pub use greedy::Weights;
pub use groups::Groups;
pub use rings::ring_order;

/// How [`order`] arranges faces.
#[derive(Clone, Debug, PartialEq)]
pub struct OrderOptions {
    /// The vertex cache that the order is optimized for; a FIFO has at least 4 entries. Only orders with births in
    /// place are optimized for batches and meshlets.
    pub cache: Cache,
    /// Entries of a FIFO or a batch that the optimizer leaves unused: an order that fills the cache completely gets
    /// worse with the first split after it. The paper spares no entry (0).
    pub spare_entries: u32,
    pub groups: Groups,
    /// Where faces are drawn between two tswaps. With births in place, `regions` and `ahead` have no effect.
    pub births: Births,
    /// Number of regions that tswaps reorder in turns, whenever the budget allows. A region has about `1 /
    /// regions` of the live faces; 1 reorders all live faces at once. More than 1 requires
    /// [`Groups::Budget`].
    pub regions: u32,
    /// Optimize each order for the level half-way to the next tswap, and keep the best of several orders for the last
    /// level. The paper does neither.
    pub ahead: bool,
    pub weights: Weights,
    /// Count wedges at the same position as one vertex, as the paper does. A device shares no vertex across a
    /// seam: see [`OrderOptions::with_cache`].
    pub weld: bool,
}

impl OrderOptions {
    /// The paper's greedy optimizer, as far as the paper describes it: no valence term; its preferences for faces in
    /// place and in touched cache lines only decide among faces of equal cost. The paper does not give the number of
    /// groups; 64 is our choice.
    pub const PAPER: OrderOptions = OrderOptions {
        groups: Groups::Uniform(64),
        spare_entries: 0,
        ahead: false,
        weights: Weights { valence: 0.0, in_place: 0.5, line: 0.25 },
        ..OrderOptions::TAIL_23
    };

    /// At most 23 moved faces per split: in a file, 10 bytes of permutations per split, and 5 bytes per split of
    /// everything else except positions (pm.size, bunny).
    pub const TAIL_23: OrderOptions = OrderOptions {
        cache: Cache::Fifo(16),
        spare_entries: 1,
        groups: Groups::Budget(23.0),
        births: Births::Tail,
        regions: 1,
        ahead: true,
        weights: Weights { valence: 0.6, in_place: 0.0, line: 0.0 },
        weld: true,
    };

    /// At most 10 moved faces per split. Below 20, the levels just before a tswap of all faces cost 0.2 more
    /// than the mean, so regions take turns.
    pub const TAIL_10: OrderOptions =
        OrderOptions { groups: Groups::Budget(10.0), regions: 3, ..OrderOptions::TAIL_23 };

    /// Births in place and at most 23 moved faces per split: groups that grow by a tenth.
    pub const IN_PLACE_23: OrderOptions = OrderOptions { births: Births::InPlace, ..OrderOptions::TAIL_23 };

    /// Births in place and at most 10 moved faces per split: groups that grow by a quarter. With two spare entries
    /// instead of one, the closed models need 0.007 fewer transforms per vertex in batches of 32, and 0.011 more with
    /// a FIFO of 16. The whole budget is used: a smaller ratio of the groups means fewer degenerate faces.
    pub const IN_PLACE_10: OrderOptions =
        OrderOptions { groups: Groups::WholeBudget(10.0), spare_entries: 2, ..OrderOptions::IN_PLACE_23 };

    /// These options with another cache. Batches and meshlets are those of devices, which share no vertex across a
    /// seam: with shared vertices, a batch that is full for the optimizer overflows on the device.
    pub const fn with_cache(self, cache: Cache) -> OrderOptions {
        OrderOptions { cache, weld: matches!(cache, Cache::Fifo(_)), ..self }
    }

    /// The options of a named order. `None` for orders without tswaps: the classical order and the baselines.
    pub const fn of(order: FaceOrder) -> Option<OrderOptions> {
        match order {
            FaceOrder::Paper => Some(OrderOptions::PAPER),
            FaceOrder::Tail23 => Some(OrderOptions::TAIL_23),
            FaceOrder::Tail10 => Some(OrderOptions::TAIL_10),
            FaceOrder::InPlace23 => Some(OrderOptions::IN_PLACE_23),
            FaceOrder::InPlace10 => Some(OrderOptions::IN_PLACE_10),
            FaceOrder::Classical
            | FaceOrder::Random
            | FaceOrder::ReOptimised
            | FaceOrder::ReOptimisedFifo
            | FaceOrder::ReOptimisedRings
            | FaceOrder::Compacted
            | FaceOrder::SkipLists
            | FaceOrder::Discrete => None,
        }
    }

    /// These options with at most `moves` moved faces per split.
    pub const fn with_moves(self, moves: f64) -> OrderOptions {
        let regions = match self.births {
            Births::Tail if moves < 20.0 => OrderOptions::TAIL_10.regions,
            _ => 1,
        };
        OrderOptions { groups: Groups::Budget(moves), regions, ..self }
    }

    /// The cache that the optimizer simulates.
    fn simulated(&self) -> Simulated {
        let (entries, triangles) = match self.cache {
            // A meshlet ends at 64 vertices, and each split adds one, so an order that fills the meshlets of one level
            // does not fill those of other levels. In meshlets (in-place-23; mean of bunny, sphere and torus, which
            // have no seams), orders for a FIFO of 19 entries need 1.320 transforms per vertex, for 15 entries 1.327,
            // and for simulated meshlets 1.34.
            Cache::Meshlets => (20, None),
            cache => (cache.entries(), cache.triangles()),
        };
        assert!(entries >= 4, "{:?} has fewer than 4 entries", self.cache);
        // A face needs 3 entries.
        let entries = entries.saturating_sub(self.spare_entries).max(3);
        Simulated {
            entries: entries as usize,
            triangles: triangles.map(|max| max as usize),
            look_back: self.cache.look_back(),
        }
    }
}

impl Default for OrderOptions {
    fn default() -> Self {
        OrderOptions::TAIL_23
    }
}

/// The extended order (section 5): groups of splits, each followed by a tswap. `progress` receives the number
/// of live faces so far and the total.
///
/// # Panics
/// If `collapses` do not belong to `model` (see [`classical`]), or the options are invalid: see [`Groups`],
/// [`OrderOptions::cache`] and [`OrderOptions::regions`].
pub fn order(
    model: &Model,
    collapses: &Collapses,
    options: &OrderOptions,
    progress: &mut dyn FnMut(usize, usize),
) -> ProgressiveMesh {
    order_or_classical(model, collapses, Some(options), progress)
}

/// As [`order()`]; the classical order without options.
pub fn order_or_classical(
    model: &Model,
    collapses: &Collapses,
    options: Option<&OrderOptions>,
    progress: &mut dyn FnMut(usize, usize),
) -> ProgressiveMesh {
    order_growing(model, collapses, options, progress, &mut |_, _| ())
}

/// As [`order_or_classical`]. `grown` receives the mesh several times, each time with the number of levels that are
/// final. The splits and permutations of the other levels are missing. The last call has all levels. With options,
/// `grown` runs on a second thread beside the ordering. `progress` is called with two equal numbers as soon as all
/// faces are ordered; the last calls of `grown` follow.
pub fn order_growing(
    model: &Model,
    collapses: &Collapses,
    options: Option<&OrderOptions>,
    progress: &mut dyn FnMut(usize, usize),
    grown: &mut (dyn FnMut(&ProgressiveMesh, usize) + Send),
) -> ProgressiveMesh {
    let (base, faces) = (base(model, collapses), model.faces.len());
    let Some(options) = options else {
        progress(faces, faces);
        return assemble(model, collapses, Births::Tail, [Step::Base(base)], grown);
    };
    let plan = match options.births {
        Births::Tail => {
            assert_eq!(options.cache.triangles(), None, "the greedy optimizer simulates a FIFO only");
            plan::plan
        }
        Births::InPlace => births::plan,
    };
    std::thread::scope(|scope| {
        let (sender, steps) = mpsc::channel();
        let mesh = scope.spawn(move || assemble(model, collapses, options.births, steps, grown));
        // If the other thread has panicked, nobody receives the steps, and `join` reports the panic.
        let mut send = move |step| drop(sender.send(step));
        plan(model, collapses, options, base, &mut send, progress);
        progress(faces, faces);
        drop(send);
        mesh.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// The standard order (section 4): faces in the reverse order of their removal, no tswaps.
///
/// # Panics
/// If `collapses` do not belong to `model`: a wedge or face is removed twice, or a face remains without a
/// vertex.
pub fn classical(model: &Model, collapses: &Collapses) -> ProgressiveMesh {
    order_or_classical(model, collapses, None, &mut |_, _| ())
}

/// The faces of level 0 in the model's order.
fn base(model: &Model, collapses: &Collapses) -> Vec<u32> {
    let mut stays = vec![true; model.faces.len()];
    collapses.faces.items().iter().for_each(|&face| stays[face as usize] = false);
    (0..model.faces.len() as u32).filter(|&face| stays[face as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::named;
    use crate::paper::progressive_mesh::cache::{level_costs, live_faces, sampled_levels};
    use crate::paper::progressive_mesh::run::Program;
    use crate::paper::progressive_mesh::simplify::{SimplifyOptions, simplify};
    use std::collections::HashSet;

    fn cost(mesh: &ProgressiveMesh) -> (f64, f64) {
        let levels = sampled_levels(mesh, 100_000, 256);
        assert_eq!(levels.len(), mesh.levels.len());
        let costs = &level_costs(mesh, &[Cache::Fifo(16)], &levels)[0];
        (costs.mean(), costs.exceeded_by(0.0))
    }

    fn moved(mesh: &ProgressiveMesh) -> f64 {
        mesh.swaps.cycles.items().len() as f64 / f64::from(mesh.last_level())
    }

    /// A model, its collapses, and every kind of order made from them.
    fn orders(side: u32, target: usize) -> (Model, Collapses, Vec<(&'static str, ProgressiveMesh)>) {
        let model = scratch::torus(side);
        let collapses = scratch::collapses(&model, target);
        let options = [
            ("paper", OrderOptions { groups: Groups::Uniform(16), ..OrderOptions::PAPER }),
            ("tail", OrderOptions::TAIL_23),
            ("turns", OrderOptions::TAIL_10),
            ("wedges", OrderOptions { weld: false, groups: Groups::Geometric(1.5), ..OrderOptions::TAIL_23 }),
            ("in place", OrderOptions::IN_PLACE_23),
            ("in place, few", OrderOptions::IN_PLACE_10),
        ];
        let extended =
            options.map(|(name, options)| (name, order(&model, &collapses, &options, &mut |_, _| {})));
        let all = [("classical", classical(&model, &collapses))].into_iter().chain(extended).collect();
        (model, collapses, all)
    }

    #[test]
    fn the_classical_order_wastes_the_cache() {
        let model = scratch::torus(40);
        let (mean, worst) = cost(&classical(&model, &scratch::collapses(&model, 64)));
        assert!(4.0 < mean && mean < worst && worst < 6.0, "{mean}, {worst}: the paper says 4 to 6");
    }

    #[test]
    fn tswaps_save_two_thirds_of_the_transforms_within_their_budget() {
        let (_, _, orders) = orders(40, 64);
        let of = |name| &orders.iter().find(|(found, _)| *found == name).expect("an order").1;
        let [classical, tail] = ["classical", "tail"].map(|name| cost(of(name)).0);
        assert!(tail < 1.6 && 2.5 * tail < classical, "{classical} without tswaps, {tail} with");
        for (name, budget, max) in [
            ("tail", 23.0, 1.6),
            ("turns", 10.0, 1.85),
            ("in place", 23.0, 1.3),
            ("in place, few", 10.0, 1.32),
        ] {
            let (found, moved) = (cost(of(name)).0, moved(of(name)));
            assert!(found < max && (0.65 * budget..=budget).contains(&moved), "{name}: {found} at {moved}");
        }
    }

    #[test]
    fn births_in_place_cost_as_much_between_tswaps_as_after_them_and_draw_few_faces_more() {
        let (_, _, orders) = orders(60, 64);
        for (name, max) in [("in place", 0.06), ("in place, few", 0.13)] {
            let mesh = &orders.iter().find(|(found, _)| *found == name).expect("an order").1;
            let costs = &level_costs(mesh, &[Cache::Fifo(16)], &sampled_levels(mesh, 100_000, 256))[0];
            assert!(costs.exceeded_by(0.05) < costs.mean() + 0.06, "{name}: {}", costs.exceeded_by(0.05));
            let program = Program::new(mesh).expect("a mesh that runs");
            let more =
                |level: u32| f64::from(program.drawn(level)) / f64::from(mesh.levels[level as usize].faces);
            let mean = (0..=mesh.last_level()).map(more).sum::<f64>() / mesh.levels.len() as f64 - 1.0;
            assert!((0.02..max).contains(&mean), "{name}: {mean} degenerate faces per live face");
        }
    }

    #[test]
    fn regions_in_turns_make_levels_even_and_never_exceed_the_budget() {
        let model = scratch::torus(60);
        let collapses = scratch::collapses(&model, 64);
        let spread = |options: &OrderOptions| {
            let mesh = order(&model, &collapses, options, &mut |_, _| {});
            for (index, &level) in mesh.swaps.levels.iter().enumerate() {
                let end = mesh.swaps.cycles_of(index).end;
                let moved: usize = (0..end).map(|cycle| mesh.swaps.cycles.row(cycle).len()).sum();
                assert!(options.regions == 1 || moved as f64 <= 10.0 * f64::from(level), "{moved}, {level}");
            }
            let levels = sampled_levels(&mesh, 100_000, 256);
            let costs = &level_costs(&mesh, &[Cache::Fifo(16)], &levels)[0];
            costs.exceeded_by(0.05) - costs.mean()
        };
        let few = OrderOptions::TAIL_10;
        let (turns, at_once) = (spread(&few), spread(&OrderOptions { regions: 1, ..few.clone() }));
        assert!(turns <= 0.2 && at_once > 0.25, "{turns} in turns, {at_once} at once");
    }

    #[test]
    fn the_full_mesh_is_well_ordered() {
        // A grid of quads: a single greedy order with a spare entry reaches only 1.7.
        let model = named("torus:32").expect("a generated model");
        let collapses = simplify(&model, &SimplifyOptions::default(), &mut |_, _| {}).collapses;
        let last = |options: &OrderOptions| {
            let mesh = order(&model, &collapses, options, &mut |_, _| {});
            level_costs(&mesh, &[Cache::Fifo(16)], &[mesh.last_level()])[0].mean()
        };
        let [paper, tail, in_place] = [OrderOptions::PAPER, OrderOptions::TAIL_23, OrderOptions::IN_PLACE_23]
            .map(|options| last(&options));
        assert!(tail < 1.5 && tail < paper && in_place < 1.35, "{paper}, {tail}, {in_place}");
    }

    #[test]
    fn the_papers_greedy_needs_more_transforms_than_one_that_finishes_vertices() {
        let (_, _, orders) = orders(24, 64);
        let of = |name| cost(&orders.iter().find(|(found, _)| *found == name).expect("an order").1).0;
        assert!(of("paper") > of("tail") + 0.2 && of("paper") < of("classical") - 1.0);
    }

    #[test]
    fn the_last_level_is_the_model_in_every_order() {
        let (model, _, orders) = orders(12, 40);
        let key = |point: [f32; 3]| point.map(|x| (f64::from(x) * 1e5).round() as i64);
        for (name, mesh) in &orders {
            let last = mesh.levels.last().expect("levels");
            assert_eq!((last.vertices, last.faces, last.error), (144, 288, 0.0), "{name}");
            let centre = mesh.vertices.centre;
            let wanted = |vertex: u32| key((model.positions[vertex as usize] - centre).as_vec3().to_array());
            let point = |vertex: u32| key(mesh.vertices.positions[vertex as usize]);
            let ours: HashSet<_> =
                live_faces(mesh, mesh.last_level()).iter().map(|face| cycled(face.map(point))).collect();
            let wanted: HashSet<_> = model.faces.iter().map(|face| cycled(face.map(wanted))).collect();
            assert_eq!(ours, wanted, "{name}");
        }
    }

    /// The corners rotated so that the smallest comes first; the winding is kept.
    fn cycled<T: Copy + Ord>(face: [T; 3]) -> [T; 3] {
        let min = (0..3).min_by_key(|&corner| face[corner]).expect("three corners");
        [0, 1, 2].map(|corner| face[(min + corner) % 3])
    }

    #[test]
    fn every_level_is_a_closed_manifold_in_every_order() {
        let (_, _, orders) = orders(16, 40);
        for (name, mesh) in &orders {
            for level in 0..=mesh.last_level() {
                let faces = live_faces(mesh, level);
                let edges = faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
                let edges: HashSet<[u32; 2]> = edges.collect();
                assert_eq!(edges.len(), 3 * faces.len(), "{name}, level {level}: an edge twice");
                let lonely = edges.iter().find(|[a, b]| a == b || !edges.contains(&[*b, *a]));
                assert_eq!(lonely, None, "{name}, level {level}");
                let used: HashSet<u32> = faces.into_iter().flatten().collect();
                assert_eq!(
                    used.len(),
                    mesh.levels[level as usize].vertices as usize,
                    "{name}, level {level}"
                );
            }
        }
    }

    #[test]
    fn seams_and_boundaries_are_ordered_too() {
        for name in ["solid:4", "knot:6", "grid:12"] {
            let model = named(name).expect("a generated model");
            let options = SimplifyOptions { target_faces: 40, ..SimplifyOptions::default() };
            let collapses = simplify(&model, &options, &mut |_, _| {}).collapses;
            for options in [OrderOptions::PAPER, OrderOptions::TAIL_23, OrderOptions::IN_PLACE_23] {
                let mesh = order(&model, &collapses, &options, &mut |_, _| {});
                mesh.check().expect("a mesh that runs");
                let welded = |vertex: u32| mesh.vertices.welded[vertex as usize];
                for level in [0, mesh.last_level() / 2, mesh.last_level()] {
                    let faces = live_faces(&mesh, level);
                    let degenerate = |face: &[u32; 3]| {
                        let [a, b, c] = face.map(welded);
                        a == b || b == c || c == a
                    };
                    assert_eq!(faces.iter().find(|face| degenerate(face)), None, "{name}, level {level}");
                    let live = mesh.levels[level as usize].vertices;
                    assert!(faces.iter().flatten().all(|&vertex| vertex < live), "{name}, level {level}");
                }
            }
        }
    }
}
