//! pm.average: the paper's measure, the mean over all levels, and the cost of executing each order.

use super::super::baselines::{BASELINES, OrderBaseline, baseline_costs, clustered_costs};
use super::super::cache::{
    CACHES, Cache, LevelCosts, costs_of, level_costs, live_faces, lower_bound, sampled_levels,
};
use super::super::mesh::ProgressiveMesh;
use super::super::order::OrderOptions;
use super::super::run::Program;
use super::super::simplify::Collapses;
use super::equal_memory::{self, AT_MEMORY_OF, EQUAL_MEMORY};
use super::orders::{
    CLASSICAL, CLOSED, DRAWN, FIFO_16, IN_PLACE_10, IN_PLACE_23, MOVED, PAPER, TAIL_10, TAIL_23, WITH_SCANS,
    every_order, moved_per_split, number, ordered, orders_and_baselines, simplified,
};
use super::{face_orders, models, scans};
use crate::figure::prelude::*;
use crate::model::Model;
use crate::paper::progressive_mesh::choices::FaceOrder;
use crate::stats::mean;
use rayon::prelude::*;

pub const AVERAGE: Figure = Figure {
    id: "pm.average",
    title: "Mean over all levels",
    about: "The paper's measure (section 2): transforms per vertex, averaged over all levels of detail with equal \
            weight, including the levels between two tswaps. The paper reports 1.6 to 2.0 for its order and 4 to 6 for \
            the standard order. The models are those of pm.order: `bunny`, `sphere`, `torus`, `knot`, `solid`. The \
            scans (`dragon_res4`, with --full `dragon`) are measured if they have been fetched. They are not included \
            in the means over models. FIFO-16 is counted at every level (above 100 000 faces at 256 levels), the other \
            caches in quick runs at 128 levels, and the baselines at 64. `batches` have at most 32 vertices and 32 \
            triangles, `meshlets` 64 and 126, filled in the order of the faces. `batches of an H100` are batches that \
            find a vertex again only if its last use is at most 42 indices back. Births in place are also measured \
            with orders that are optimised for one of these instead of a FIFO. `clusters` are meshoptimizer's clusters \
            of the same sizes, built anew at every level with the best of four cone weights. Where the order is \
            optimised for one of these, and for clusters, wedges are vertices, as on a device. The figure also shows \
            the faces that change their slots per split on the way through all levels (for baselines, the faces that \
            are copied), the memory of the lists, and the drawn faces per live face. All instances share some memory: \
            commands, tables for jumps over many levels and the index buffer of level 0, or lists and the corners that \
            level changes write. On models with seams, the cost with wedges as vertices is shown too. An index takes \
            16 bits on meshes of fewer than 65,536 vertices, and a word of a command 32 bits. Skip lists are also \
            measured with at most the memory of `in-place-23`, `in-place-10` and `tail-23`. Degenerate faces are drawn \
            and counted. `re-optimised-rings` is an order in rings around vertices, the best of five (H. Hoppe's \
            program MeshReorder). The lower bound holds for every order of a mesh's faces: if more than 34 r + 1 \
            vertices lie within r edges of a vertex, one of them is transformed twice. The bound is weak.",
    scenes: &WITH_SCANS,
    variants,
    paper: &[CLASSICAL, PAPER],
    ours: &[TAIL_23],
    full_only: &[scans::LARGE],
    sweep: None,
    show: Show::views(|| models(&WITH_SCANS)).variants(face_orders),
    measure,
    plots: &[Plot::bars(FIFO_16), Plot::bars(MOVED).log_y()],
    claims: &[
        Claim::paper(
            "2",
            "standard",
            "The standard order needs 4 to 6 transforms per vertex (FIFO-16).",
            &[Test::value(one(FIFO_16, CLASSICAL), Within(4.0, 6.0, Better::Neither))],
        )
        .at(Places::scenes(&CLOSED)),
        Claim::paper(
            "2",
            "extended",
            "The extended order, as the paper describes it, needs 1.6 to 2.0 transforms per vertex (FIFO-16).",
            &[Test::value(one(FIFO_16, PAPER), Within(1.6, 2.0, Better::Less))],
        )
        .at(Places::scenes(&CLOSED)),
        Claim::ours(
            "after-tswaps",
            "The paper's greedy needs 1.6 to 2.0 transforms per vertex just after its tswaps, if it is optimized for \
             a cache of 12, 16, 24 or 32 entries and measured with the same cache (mean over the models).",
            &[
                made_for("FIFO-12, optimised for it, after a tswap"),
                made_for("FIFO-16, optimised for it, after a tswap"),
                made_for("FIFO-24, optimised for it, after a tswap"),
                made_for("FIFO-32, optimised for it, after a tswap"),
            ],
        )
        .at(Places::mean(&CLOSED)),
        Claim::ours(
            "tail-23",
            "With new faces at the tail and at most 23 moved faces per split, an order needs at most 1.55 transforms \
             per vertex; 95 % of the levels need at most 0.2 more (FIFO-16, mean over the models).",
            &bounds(TAIL_23, 1.55, 23.0, 0.2),
        )
        .at(Places::mean(&CLOSED)),
        Claim::ours(
            "tail-10",
            "With new faces at the tail and at most 10 moved faces per split, an order needs at most 1.85 transforms \
             per vertex; 95 % of the levels need at most 0.2 more (FIFO-16, mean over the models).",
            &bounds(TAIL_10, 1.85, 10.0, 0.2),
        )
        .at(Places::mean(&CLOSED)),
        Claim::ours(
            "in-place-23",
            "With births in place and at most 23 moved faces per split, an order needs at most 1.24 transforms per \
             vertex; 95 % of the levels need at most 0.05 more. At most 6 % more faces are drawn than are live \
             (FIFO-16, mean over the models).",
            &bounds_in_place(IN_PLACE_23, 1.24, 23.0, 1.06),
        )
        .at(Places::mean(&CLOSED)),
        Claim::ours(
            "in-place-10",
            "With births in place and at most 10 moved faces per split, an order needs at most 1.26 transforms per \
             vertex; 95 % of the levels need at most 0.05 more. At most 12 % more faces are drawn than are live \
             (FIFO-16, mean over the models).",
            &bounds_in_place(IN_PLACE_10, 1.26, 10.0, 1.12),
        )
        .at(Places::mean(&CLOSED)),
        Claim::ours(
            "re-optimised",
            "Births in place need fewer transforms than meshoptimizer reaches when it reorders every level \
             from scratch, with the better of its two optimizers (FIFO-16, mean over the models).",
            &[below_re_optimised(IN_PLACE_23), below_re_optimised(IN_PLACE_10)],
        )
        .at(Places::mean(&CLOSED)),
        Claim::ours(
            "rings",
            "At 23 moved faces per split, births in place also need fewer transforms than the ring order, rebuilt from \
             scratch at every level (FIFO-16, mean over the models).",
            &[Test::ratio_of(FIFO_16, [IN_PLACE_23, RINGS], Below(1.0))],
        )
        .at(Places::mean(&CLOSED)),
        Claim::ours(
            "rings-10",
            "At 10 moved faces per split, too, births in place need fewer transforms than the ring order (FIFO-16, mean \
             over the models).",
            &[Test::ratio_of(FIFO_16, [IN_PLACE_10, RINGS], Below(1.0))],
        )
        .at(Places::mean(&CLOSED)),
        EQUAL_MEMORY,
        Claim::ours(
            "batches",
            "On devices that have no cache and reuse vertices within batches of 32 vertices and 32 triangles, births \
             in place need at most 1.70 transforms per vertex. That is no more than the compacted order of the full \
             mesh or skip lists need (mean over the models).",
            &[
                Test::value(one(BATCHES, IN_PLACE_23), AtMost(1.70)),
                Test::value(one(BATCHES, IN_PLACE_10), AtMost(1.70)),
                Test::ratio_of(BATCHES, [IN_PLACE_23, OrderBaseline::Compacted.name()], AtMost(1.0)),
                Test::ratio_of(BATCHES, [IN_PLACE_23, FaceOrder::SkipLists.name()], AtMost(1.0)),
            ],
        )
        .at(Places::mean(&CLOSED)),
        Claim::ours(
            "optimised-for-batches",
            "Births in place that are optimised for batches of 32 vertices and 32 triangles need at most 1.54 and 1.58 \
             transforms per vertex there, at 23 and 10 moved faces per split. At 23, that is less than \
             meshoptimizer's clusters of this size need, built anew at every level (mean over the models).",
            &[
                Test::value(one(FOR_BATCHES, IN_PLACE_23), AtMost(1.54)),
                Test::value(one(FOR_BATCHES, IN_PLACE_10), AtMost(1.58)),
                Test::ratio_of(FOR_BATCHES, [IN_PLACE_23, CLUSTERS], Below(1.0)),
            ],
        )
        .at(Places::mean(&CLOSED)),
        Claim::ours(
            "optimised-for-an-h100",
            "Births in place that are optimised for the batches of an H100 need at most 1.54 and 1.58 transforms per \
             vertex there, at 23 and 10 moved faces per split (mean over the models).",
            &[
                Test::value(one(FOR_AN_H100, IN_PLACE_23), AtMost(1.54)),
                Test::value(one(FOR_AN_H100, IN_PLACE_10), AtMost(1.58)),
            ],
        )
        .at(Places::mean(&CLOSED)),
        Claim::ours(
            "in-place-23-on-scans",
            "On the scans, births in place at 23 moved faces per split need at most 1.26 transforms per vertex \
             (FIFO-16), and keep the other bounds of `in-place-23`, `re-optimised` and `batches`.",
            &on_scans(IN_PLACE_23, bounds_in_place(IN_PLACE_23, 1.26, 23.0, 1.06)),
        )
        .at(Places::scenes(&scans::ALL)),
        Claim::ours(
            "in-place-10-on-scans",
            "On the scans, births in place at 10 moved faces per split need at most 1.29 transforms per vertex \
             (FIFO-16), and keep the other bounds of `in-place-10`, `re-optimised` and `batches`.",
            &on_scans(IN_PLACE_10, bounds_in_place(IN_PLACE_10, 1.29, 10.0, 1.12)),
        )
        .at(Places::scenes(&scans::ALL)),
    ],
};

/// Bounds of an order's cost and moved faces, and of the cost that 95 % of the levels may need beyond the mean.
const fn bounds(order: &'static str, cost: f64, moved: f64, beyond: f64) -> [Test; 3] {
    [
        Test::value(one(FIFO_16, order), AtMost(cost)),
        Test::value(one(MOVED, order), AtMost(moved)),
        Test::difference(one(P95, order), one(FIFO_16, order), AtMost(beyond)),
    ]
}

/// As [`bounds`], with a bound of the drawn faces.
const fn bounds_in_place(order: &'static str, cost: f64, moved: f64, drawn: f64) -> [Test; 4] {
    let [cost, moved, p95] = bounds(order, cost, moved, 0.05);
    [cost, moved, p95, Test::value(one(DRAWN, order), AtMost(drawn))]
}

const fn below_re_optimised(order: &'static str) -> Test {
    Test::ratio(one(FIFO_16, order), best(FIFO_16, re_optimised), Below(1.0))
}

/// The bounds of an order with births in place, with those of `re-optimised` and `batches`.
const fn on_scans(order: &'static str, [cost, moved, p95, drawn]: [Test; 4]) -> [Test; 6] {
    let batches = Test::value(one(BATCHES, order), AtMost(1.70));
    [cost, below_re_optimised(order), moved, p95, drawn, batches]
}

/// A test of the paper's range on the paper's greedy order, with the cache for which this order is optimised.
const fn made_for(quantity: &'static str) -> Test {
    Test::value(one(quantity, PAPER), Within(1.6, 2.0, Better::Less))
}

/// The variant with the bound that no order of the faces can beat: see [`lower_bound`].
const LOWER_BOUND: &str = "lower bound";
const BATCHES: &str = "batches";
const P95: &str = "FIFO-16, 95 % of levels";
const WORST: &str = "FIFO-16, worst level";
const AFTER: &str = "FIFO-16, after a tswap";
const MADE: &str = "optimised for it, after a tswap";
const MADE_FOR: &str = "optimised for it";
const FOR_BATCHES: &str = "batches, optimised for it";
const FOR_AN_H100: &str = "batches of an H100, optimised for it";
/// meshoptimizer's clusters: see [`clustered_costs`].
const CLUSTERS: &str = "clusters";
const RINGS: &str = OrderBaseline::ReoptimisedRings.name();
const MADE_ALL: &str = "optimised for it, all levels";
/// Cache sizes of the paper's time and of today. The paper's greedy runs for each of them.
const SIZES: [u32; 4] = [12, 16, 24, 32];
const MEMORY: &str = "memory of the lists";
const WEDGES: &str = "FIFO-16 on wedges";
const PER_VERTEX: &str = "transforms per vertex";

fn variants() -> Vec<String> {
    let at_memory = AT_MEMORY_OF.iter().map(|(_, name)| *name);
    let more = at_memory.chain([CLUSTERS, LOWER_BOUND]).map(str::to_owned);
    orders_and_baselines().into_iter().chain(more).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (model, collapses) = simplified(&cell.scene)?;
    let plain = ordered(&model, &collapses, None);
    let all = sampled_levels(&plain, 100_000, 256);
    let some = bench.effort_of(sampled_levels(&plain, 0, 128), all.clone());
    let mut rows = Vec::new();
    let levels = sampled_levels(&plain, 0, 64);
    for (name, mesh) in every_order(&model, &collapses) {
        for cache in CACHES {
            let levels = if cache == Cache::Fifo(16) { &all } else { &some };
            let found = level_costs(&mesh, &[cache], levels).remove(0);
            rows.push(number(name, cache.name(), PER_VERTEX, found.mean()));
            if cache == Cache::Fifo(16) {
                rows.extend(spread(name, &mesh, &found));
            }
        }
        rows.push(number(name, MOVED, "faces", moved_per_split(&mesh)));
        let program = Program::new(&mesh)?;
        rows.push(number(name, MEMORY, "bytes per face", program.index_type().triangle_bytes() as f64));
        let drawn =
            |&level: &u32| f64::from(program.drawn(level)) / f64::from(plain.levels[level as usize].faces);
        rows.push(number(name, DRAWN, "faces", mean(all.iter().map(drawn))));
        rows.extend(on_wedges(name, &mesh, &program, &some));
        rows.extend(equal_memory::rows(name, &program, &plain, &levels));
    }
    rows.extend(made_for_each_size(&model, &collapses, &some));
    rows.extend(made_for_batches(&model, &collapses, &plain, &some)?);
    rows.push(number(LOWER_BOUND, FIFO_16, PER_VERTEX, bound(&plain, &some)));
    for baseline in BASELINES {
        let (name, found) = (baseline.name(), baseline_costs(&plain, baseline, &CACHES, &levels));
        let means = CACHES.iter().zip(&found.costs);
        rows.extend(means.map(|(cache, costs)| number(name, cache.name(), PER_VERTEX, costs.mean())));
        rows.push(number(name, MOVED, "faces", found.copied_per_split));
        rows.push(number(name, MEMORY, "bytes per face", found.list_bytes as f64 / model.faces.len() as f64));
        rows.push(number(name, DRAWN, "faces", found.traffic));
    }
    Ok(rows)
}

/// The lower bound for any order of the faces, as a mean over `levels`.
fn bound(plain: &ProgressiveMesh, levels: &[u32]) -> f64 {
    let of_level = |&level: &u32| {
        let welded = |vertex: u32| plain.vertices.welded[vertex as usize];
        let faces: Vec<[u32; 3]> = live_faces(plain, level).iter().map(|face| face.map(welded)).collect();
        lower_bound(&faces, 16)
    };
    levels.par_iter().map(of_level).sum::<f64>() / levels.len() as f64
}

/// The cost with wedges as vertices, as a device shades them; for models with more wedges than positions.
fn on_wedges(name: &str, mesh: &ProgressiveMesh, program: &Program, levels: &[u32]) -> Option<Row> {
    let every_vertex: Vec<u32> = (0..mesh.vertices.welded.len() as u32).collect();
    if mesh.vertices.welded == every_vertex {
        return None;
    }
    let found = costs_of(program, &every_vertex, &[Cache::Fifo(16)], levels).remove(0);
    Some(number(name, WEDGES, PER_VERTEX, found.mean()))
}

fn spread(name: &str, mesh: &ProgressiveMesh, costs: &LevelCosts) -> Vec<Row> {
    let after: Vec<f64> = costs
        .levels
        .iter()
        .zip(&costs.per_vertex)
        .filter(|(level, _)| mesh.swaps.levels.binary_search(level).is_ok())
        .map(|(_, &cost)| cost)
        .collect();
    let mut rows = vec![
        number(name, P95, PER_VERTEX, costs.exceeded_by(0.05)),
        number(name, WORST, PER_VERTEX, costs.exceeded_by(0.0)),
    ];
    if !after.is_empty() {
        rows.push(number(name, AFTER, PER_VERTEX, mean(after)));
    }
    rows
}

/// The paper's greedy for each of [`SIZES`], measured with the same cache: just after its tswaps, and at
/// `levels`.
fn made_for_each_size(model: &Model, collapses: &Collapses, levels: &[u32]) -> Vec<Row> {
    let rows = SIZES.into_iter().flat_map(|entries| {
        let cache = Cache::Fifo(entries);
        let options = OrderOptions { cache, ..OrderOptions::PAPER };
        let mesh = ordered(model, collapses, Some(&options));
        [(MADE, &mesh.swaps.levels[..]), (MADE_ALL, levels)].map(|(quantity, levels)| {
            let mean = level_costs(&mesh, &[cache], levels).remove(0).mean();
            number(PAPER, format!("{}, {quantity}", cache.name()), PER_VERTEX, mean)
        })
    });
    rows.collect()
}

/// Births in place optimised for batches and for meshlets, and meshoptimizer's clusters, at `levels`. Wedges are
/// vertices, as on a device.
fn made_for_batches(
    model: &Model,
    collapses: &Collapses,
    plain: &ProgressiveMesh,
    levels: &[u32],
) -> anyhow::Result<Vec<Row>> {
    let every_vertex: Vec<u32> = (0..plain.vertices.welded.len() as u32).collect();
    let rows = [Cache::Batches, Cache::H100, Cache::Meshlets].into_iter().flat_map(|cache| {
        let row = |variant: &str, costs: LevelCosts| {
            number(variant, format!("{}, {MADE_FOR}", cache.name()), PER_VERTEX, costs.mean())
        };
        let orders = [(IN_PLACE_23, OrderOptions::IN_PLACE_23), (IN_PLACE_10, OrderOptions::IN_PLACE_10)];
        let ours = orders.map(|(name, options)| {
            let mesh = ordered(model, collapses, Some(&options.with_cache(cache)));
            Ok(row(name, costs_of(&Program::new(&mesh)?, &every_vertex, &[cache], levels).remove(0)))
        });
        // Clusters have their own batches, which do not look back.
        let clusters = || Ok(row(CLUSTERS, clustered_costs(plain, cache, levels)));
        ours.into_iter().chain(cache.look_back().is_none().then(clusters))
    });
    rows.collect()
}

fn re_optimised() -> Vec<String> {
    [OrderBaseline::Reoptimised, OrderBaseline::ReoptimisedFifo]
        .map(|baseline| baseline.name().to_string())
        .into()
}
