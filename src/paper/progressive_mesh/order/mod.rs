//! The order of faces at every level of detail (paper 2, sections 4 and 5).
//!
//! [`classical`] is the plain view-independent progressive mesh that the paper starts from: vertices and faces stand
//! in the order in which splits bring them, and nothing ever moves. [`order`] is the paper's extension: groups of
//! splits, and at the end of each a permutation of the live faces.
//!
//! What was tried, as means over all levels of the five closed shipped models (transforms per position by a FIFO of
//! 16; what 95 % of the levels cost at most; the full mesh; moved = faces that change their slot, for each split):
//!
//! | order | transforms | 95 % | full | moved |
//! |---|---|---|---|---|
//! | classical | 4.57 | 4.67 | | 0 |
//! | the paper's greedy, 64 equal groups ([`OrderOptions::PAPER`]) | 2.09 | 2.88 | 1.72 | 59.2 |
//! | + valence term, geometric groups, a cache of 15 in the optimizer | 1.50 | 1.68 | 1.51 | 22.5 |
//! | + orders for the level half-way to the next ([`OrderOptions::BEST`]) | 1.49 | 1.65 | 1.26 | 22.7 |
//! | the same with fewer groups | 1.74 | 2.07 | 1.27 | 9.8 |
//! | three regions in turns ([`OrderOptions::FEW_MOVES`]) | 1.80 | 1.98 | 1.77 | 9.7 |
//! | coherent splits inside a group, 23 | 1.47 | 1.61 | 1.32 | 22.7 |
//! | + a tswap after every 2400 faces ([`OrderOptions::COHERENT`]) | 1.47 | 1.59 | 1.46 | 22.5 |
//! | coherent splits, 10 | 1.65 | 1.91 | 1.26 | 9.8 |
//! | + a tswap after every 2400 faces, 10 | 1.62 | 1.87 | 1.49 | 9.8 |
//!
//! - Between two tswaps it is the tail that costs: a pair of new faces alone is 4 transforms where 1.3 would do, so a
//!   group that adds a tenth costs 0.15 on average. The order inside it matters less: 1.30 with these weights, and
//!   the best of five weightings saves 0.02 for five times the work; orders that fill 16 entries to the last
//!   (fans by age, 1.24 on a torus) lose 0.05 at the levels after. Hence 15 entries in the optimizer: 1.54 became
//!   1.52. At the last level nothing comes after: there the best of eight greedies is taken, on small meshes from
//!   seven faces on each (torus: 1.29 where one has 1.78, and eight from one face 1.44).
//! - An order for the level half-way to the next tswap, with the corners that its faces will have there, saves 0.01 at
//!   23 moved faces and 0.04 at 10, and makes levels more even. A quarter of the way saves less; the whole way as
//!   much, and costs it at the levels before.
//! - With few groups the levels just before a tswap cost 0.8 more than those after it. Regions in turns leave 0.3 of
//!   that and cost 0.06 by their borders: with 1, 2, 3, 4 and 8 regions and no limit on moves the mean is 1.33, 1.39, 1.44,
//!   1.49 and 1.63. Regions that stay what they are and take slots wherever they are free lose more by the cuts in
//!   their order (1.65 with two); regions that stay whole, for which the others make room, cost a fifth of the moves (1.78 at
//!   9.6 with two). New orders for the tail alone in between pay what they cost and no more.
//! - A threshold on moving ([`Weights::in_place`] = 1.3) is worse than fewer groups: 1.57 at 17.5 moved, bunny,
//!   where larger groups give 1.53.
//! - Coherent splits save little, as few of a group's splits are neighbours: 0.02 with groups of a tenth, 0.08 of a
//!   third. The errors inside a group rise by 2 % and 6 % in the geometric mean. A tswap after each run of faces
//!   saves more on large meshes, but runs below 1200 faces leave patches below 100 in the tail that cost more at
//!   every later level (bunny, runs of 300: 1.60 where 600 give 1.46).
//! - Rows of vertices as wide as half the cache (Hoppe's later practice) reached 1.37 on the bunny and 1.25 on a
//!   torus; the greedy 1.30 and 1.23.

mod assemble;
mod coherent;
mod depend;
mod descent;
mod greedy;
mod groups;
mod patch;
mod plan;
#[cfg(test)]
pub(super) mod scratch;
mod turns;

use super::mesh::ProgressiveMesh;
use super::simplify::Collapses;
use crate::model::Model;
use crate::paper::progressive_mesh::choices::FaceOrder;
use assemble::{Arrangement, assemble};

pub use greedy::Weights;
pub use groups::Groups;

/// How the extended order is made.
#[derive(Clone, Debug, PartialEq)]
pub struct OrderOptions {
    /// The entries of the vertex cache that the order is for, first in, first out; at least 4.
    pub cache_entries: u32,
    /// Entries of it that the optimizer leaves unused: an order that fills the cache to the last entry breaks with the
    /// first split after it. The paper knows nothing of the kind.
    pub spare_entries: u32,
    pub groups: Groups,
    /// With [`Groups::Budget`] and [`Within::Error`]: a tswap is of all live faces (1), or of about one in so many, in
    /// turns, whenever the budget pays for it.
    pub regions: u32,
    /// Whether an order is made for the levels at which it will stand: the corners of its faces half-way to the next
    /// one; the last level's the best of several. The paper knows nothing of the kind.
    pub ahead: bool,
    pub within: Within,
    /// With [`Within::Coherent`]: about so many faces that stand together are refined and re-ordered at once, where
    /// the mesh has more; none: the group as a whole.
    pub run_faces: Option<u32>,
    pub weights: Weights,
    /// Whether wedges of one position count as one vertex: what the paper's criterion is about. A device shares
    /// nothing across a seam.
    pub weld: bool,
}

/// The order of the splits inside a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Within {
    /// That of their errors.
    Error,
    /// One that suits the cache; the error of a level inside a group is then that of the worst split to come.
    Coherent,
}

impl OrderOptions {
    /// The paper's optimizer, as far as it is described: greedy, without a look at what is left of a vertex; the two
    /// preferences decide among faces that cost the same. 64 groups: of all that is not said, our choice.
    pub const PAPER: OrderOptions = OrderOptions {
        groups: Groups::Uniform(64),
        spare_entries: 0,
        ahead: false,
        weights: Weights { valence: 0.0, in_place: 0.5, line: 0.25 },
        ..OrderOptions::BEST
    };

    /// At most 23 moved faces for each split: 3.5 bytes of commands for each byte of the splits themselves.
    pub const BEST: OrderOptions = OrderOptions {
        cache_entries: 16,
        spare_entries: 1,
        groups: Groups::Budget(23.0),
        regions: 1,
        ahead: true,
        within: Within::Error,
        run_faces: None,
        weights: Weights { valence: 0.6, in_place: 0.0, line: 0.0 },
        weld: true,
    };

    /// At most 10 moved faces for each split.
    pub const FEW_MOVES: OrderOptions = OrderOptions::of_moves(10.0);

    /// Splits of a group in an order that suits the cache.
    pub const COHERENT: OrderOptions =
        OrderOptions { within: Within::Coherent, run_faces: Some(2400), ..OrderOptions::BEST };

    /// The same with at most 10 moved faces for each split.
    pub const COHERENT_FEW_MOVES: OrderOptions =
        OrderOptions { groups: Groups::Budget(10.0), ..OrderOptions::COHERENT };

    /// Those of an order by its name; none where no face ever moves: the classical one, and that which rivals go through.
    pub const fn of(order: FaceOrder) -> Option<OrderOptions> {
        match order {
            FaceOrder::Paper => Some(OrderOptions::PAPER),
            FaceOrder::Ours => Some(OrderOptions::BEST),
            FaceOrder::OursFewMoves => Some(OrderOptions::FEW_MOVES),
            FaceOrder::Coherent => Some(OrderOptions::COHERENT),
            FaceOrder::CoherentFewMoves => Some(OrderOptions::COHERENT_FEW_MOVES),
            FaceOrder::Classical
            | FaceOrder::Random
            | FaceOrder::ReOptimised
            | FaceOrder::ReOptimisedFifo
            | FaceOrder::Compacted
            | FaceOrder::SkipLists
            | FaceOrder::Discrete => None,
        }
    }

    /// Ours with at most so many moved faces for each split. Below 20 of them the levels just before a tswap of all
    /// faces cost 0.2 more than the mean: there regions take turns.
    pub const fn of_moves(moves: f64) -> OrderOptions {
        let regions = if moves < 20.0 { 3 } else { 1 };
        OrderOptions { groups: Groups::Budget(moves), regions, ..OrderOptions::BEST }
    }

    /// The entries of the cache in the optimizer.
    fn simulated_entries(&self) -> u32 {
        let entries = self.cache_entries.saturating_sub(self.spare_entries);
        assert!(
            entries >= 3,
            "a cache of {} entries, {} of them spare",
            self.cache_entries,
            self.spare_entries
        );
        entries
    }
}

impl Default for OrderOptions {
    fn default() -> Self {
        OrderOptions::BEST
    }
}

/// The extended order (section 5): groups of splits with a tswap at the end of each. `progress` is called with the
/// number of live faces so far and of all.
///
/// # Panics
/// If `collapses` are not of `model` (see [`classical`]), or options make no sense: see [`Groups`] and
/// [`OrderOptions::regions`].
pub fn order(
    model: &Model,
    collapses: &Collapses,
    options: &OrderOptions,
    progress: &mut dyn FnMut(usize, usize),
) -> ProgressiveMesh {
    let (collapses, arrangement) = plan::plan(model, collapses, options, base(model, collapses), progress);
    assemble(model, &collapses, &arrangement)
}

/// The standard order (section 4): what is removed first stands last. No tswaps.
///
/// # Panics
/// If `collapses` are not of `model`: a wedge or face removed twice, or one that lives on without a vertex.
pub fn classical(model: &Model, collapses: &Collapses) -> ProgressiveMesh {
    assemble(model, collapses, &Arrangement { births: births(model, collapses), moves: Vec::new() })
}

/// The model's faces in the order of their appearance: those of M0 as the model lists them, then each split's.
fn births(model: &Model, collapses: &Collapses) -> Vec<u32> {
    base(model, collapses).into_iter().chain(collapses.faces.rows().rev().flatten().copied()).collect()
}

/// The faces of M0, as the model lists them.
fn base(model: &Model, collapses: &Collapses) -> Vec<u32> {
    let mut stays = vec![true; model.faces.len()];
    collapses.faces.items().iter().for_each(|&face| stays[face as usize] = false);
    (0..model.faces.len() as u32).filter(|&face| stays[face as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::named;
    use crate::paper::progressive_mesh::cache::{Cache, level_costs, live_faces, sampled_levels};
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

    /// The model, its collapses, and every kind of order of them.
    fn orders(side: u32, target: usize) -> (Model, Collapses, Vec<(&'static str, ProgressiveMesh)>) {
        let model = scratch::torus(side);
        let collapses = scratch::collapses(&model, target);
        let coherent = OrderOptions { within: Within::Coherent, ..OrderOptions::BEST };
        let runs = OrderOptions { run_faces: Some(200), groups: Groups::Budget(10.0), ..coherent.clone() };
        let options = [
            ("paper", OrderOptions { groups: Groups::Uniform(16), ..OrderOptions::PAPER }),
            ("best", OrderOptions::BEST),
            ("coherent", coherent),
            ("runs", runs),
            ("turns", OrderOptions::FEW_MOVES),
            ("wedges", OrderOptions { weld: false, groups: Groups::Geometric(1.5), ..OrderOptions::BEST }),
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
        let (model, collapses, orders) = orders(40, 64);
        let of = |name| &orders.iter().find(|(found, _)| *found == name).expect("an order").1;
        let [classical, best, coherent] = ["classical", "best", "coherent"].map(|name| cost(of(name)).0);
        assert!(best < 1.6 && 2.5 * best < classical, "{classical} without, {best} with tswaps");
        assert!(coherent < best, "{coherent} with coherent splits, {best} without");
        assert!((15.0..=23.0).contains(&moved(of("best"))), "{}", moved(of("best")));
        let few = order(&model, &collapses, &OrderOptions::FEW_MOVES, &mut |_, _| {});
        assert!(moved(&few) <= 10.0 && cost(&few).0 < 1.85, "{} at {}", cost(&few).0, moved(&few));
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
        let few = OrderOptions::FEW_MOVES;
        let (turns, at_once) = (spread(&few), spread(&OrderOptions { regions: 1, ..few.clone() }));
        assert!(turns <= 0.2 && at_once > 0.25, "{turns} in turns, {at_once} at once");
    }

    #[test]
    fn the_full_mesh_is_well_ordered() {
        // A grid of quads, of which a greedy with a spare entry makes 1.7.
        let model = named("torus:32").expect("a generated model");
        let collapses = simplify(&model, &SimplifyOptions::default(), &mut |_, _| {}).collapses;
        let last = |options: &OrderOptions| {
            let mesh = order(&model, &collapses, options, &mut |_, _| {});
            level_costs(&mesh, &[Cache::Fifo(16)], &[mesh.last_level()])[0].mean()
        };
        let (ours, paper) = (last(&OrderOptions::BEST), last(&OrderOptions::PAPER));
        assert!(ours < 1.5 && ours < paper, "{ours}, the paper's {paper}");
    }

    #[test]
    fn the_papers_greedy_needs_more_transforms_than_ours() {
        let (_, _, orders) = orders(24, 64);
        let of = |name| cost(&orders.iter().find(|(found, _)| *found == name).expect("an order").1).0;
        assert!(of("paper") > of("best") + 0.2 && of("paper") < of("classical") - 1.0);
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

    /// The corners from the least on, in their direction.
    fn cycled<T: Copy + Ord>(face: [T; 3]) -> [T; 3] {
        let least = (0..3).min_by_key(|&corner| face[corner]).expect("three corners");
        [0, 1, 2].map(|corner| face[(least + corner) % 3])
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
    fn coherent_groups_pass_through_the_same_levels_and_never_promise_less_error() {
        let (model, collapses, orders) = orders(20, 60);
        let strict = &orders.iter().find(|(name, _)| *name == "classical").expect("an order").1;
        let (_, runs) = orders.iter().find(|(name, _)| *name == "runs").expect("an order");
        let ends = groups::group_ends(Groups::Budget(10.0), &collapses, model.faces.len());
        for (level, (ours, theirs)) in runs.levels.iter().zip(&strict.levels).enumerate() {
            assert!(ours.error >= theirs.error, "level {level}");
            if ends.contains(&(level as u32)) {
                assert_eq!(ours, theirs, "level {level} ends a group");
            }
        }
    }

    #[test]
    fn seams_and_boundaries_are_ordered_too() {
        for name in ["solid:4", "knot:6", "grid:12"] {
            let model = named(name).expect("a generated model");
            let options = SimplifyOptions { target_faces: 40, ..SimplifyOptions::default() };
            let collapses = simplify(&model, &options, &mut |_, _| {}).collapses;
            let coherent =
                OrderOptions { within: Within::Coherent, run_faces: Some(100), ..OrderOptions::BEST };
            for options in [OrderOptions::PAPER, OrderOptions::BEST, coherent] {
                let mesh = order(&model, &collapses, &options, &mut |_, _| {});
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
