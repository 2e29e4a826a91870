//! pm.order: transforms per vertex at every level of detail, for all orders and baselines.

use super::super::baselines::{BASELINES, baseline_costs};
use super::super::cache::{CACHES, Cache, LevelCosts, level_costs, sampled_levels};
use super::super::mesh::ProgressiveMesh;
use super::orders::{
    CLASSICAL, CLOSED, IN_PLACE_10, IN_PLACE_23, PAPER, TAIL_23, WITH_SCANS, every_order, ordered,
    orders_and_baselines, simplified,
};
use super::{face_orders, models, scans};
use crate::figure::prelude::*;

pub const ORDER: Figure = Figure {
    id: "pm.order",
    title: "Transforms per vertex at every level",
    about: "How often is a vertex transformed at each level of detail (section 2)? The lower bound is 1; \
            without reuse it is 3 x faces / vertices, about 6. The models are the shipped closed models \
            `bunny`, `sphere`, `torus`, `knot` and `solid`, simplified to 64 faces. `classical` keeps the \
            order in which splits add the faces. `paper` is section 5 as described (a greedy without a \
            valence term; 64 equal groups). `tail-23` and `tail-10` use a greedy with a valence term and \
            groups of one ratio; new faces stay at the tail until the next tswap. In `in-place-23` and \
            `in-place-10`, new faces are beside their neighbours, and degenerate until their split. 23 and \
            10 are the moved faces per split. The baselines are random order, reordering by meshoptimizer \
            at every level, the compacted order of the full mesh, skip lists, and discrete meshes. \
            Vertices are positions. `solid` has seams; pm.average also shows its cost with wedges as \
            vertices, which is what a device shades. The scans `dragon_res4` and, with --full, `dragon` \
            are measured if they have been fetched; claims use only the shipped models.",
    scenes: &WITH_SCANS,
    variants: orders_and_baselines,
    paper: &[CLASSICAL, PAPER],
    ours: &[TAIL_23],
    full_only: &[scans::LARGE],
    sweep: None,
    show: Show::views(|| models(&WITH_SCANS)).variants(face_orders),
    measure,
    plots: &[plot("FIFO-12"), plot("FIFO-16"), plot("FIFO-24"), plot("FIFO-32"), plot("batches")],
    claims: &[
        Claim::paper(
            "2",
            "classical-worst",
            "The standard order is close to the worst: above 4 transforms per vertex at every level of at \
             least 1000 faces (FIFO-16).",
            &[Test::value(one(MIN, CLASSICAL), Above(4.0))],
        )
        .at(Places::scenes(&CLOSED)),
        Claim::paper(
            "5",
            "every-level",
            "The order is good at every level, not only on average: at each level of at least 1000 faces, \
             the paper's order costs less than half of the classical order (FIFO-16), as 1.6 to 2.0 is less \
             than half of 4 to 6.",
            &[Test::value(one(SHARE, PAPER), Below(0.5))],
        )
        .at(Places::scenes(&CLOSED)),
        Claim::ours(
            "tail-every-level",
            "At each level of at least 1000 faces, tail-23 costs less than half of the classical order \
             (FIFO-16).",
            &[Test::value(one(SHARE, TAIL_23), Below(0.5))],
        )
        .at(Places::scenes(&CLOSED)),
        Claim::ours(
            "in-place-every-level",
            "At each level of at least 1000 faces, in-place-23 and in-place-10 cost less than a third of the \
             classical order (FIFO-16).",
            &Test::values([one(SHARE, IN_PLACE_23), one(SHARE, IN_PLACE_10)], Below(1.0 / 3.0)),
        )
        .at(Places::scenes(&CLOSED)),
    ],
};

/// Claims test every level from this many faces on; on smaller meshes the result depends on level 0 and few
/// other faces.
const CLAIMED_FROM: u32 = 1000;
const MIN: &str = "FIFO-16, best level of at least 1000 faces";
const SHARE: &str = "FIFO-16 over the classical order's, worst level of at least 1000 faces";

const fn plot(quantity: &'static str) -> Plot {
    Plot::curves(quantity, "faces").log_x()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (model, collapses) = simplified(&cell.scene)?;
    let count = bench.effort_of(97, 385);
    let plain = ordered(&model, &collapses, None);
    let levels = sampled_levels(&plain, 0, count);
    // Claims about every level are tested at every level, because samples could miss the peaks before each
    // tswap.
    let all = sampled_levels(&plain, 100_000, 2049);
    let from = all.partition_point(|&level| plain.levels[level as usize].faces < CLAIMED_FROM);
    let every =
        |mesh: &ProgressiveMesh| level_costs(mesh, &[Cache::Fifo(16)], &all[from..]).remove(0).per_vertex;
    let classical = every(&plain);
    let (mut rows, mut worst) = (Vec::new(), Vec::new());
    let mut add = |name: &str, costs: &[LevelCosts]| {
        for (cache, costs) in CACHES.iter().zip(costs) {
            let faces = costs.levels.iter().map(|&level| f64::from(plain.levels[level as usize].faces));
            let series = faces.zip(&costs.per_vertex).map(|(faces, &cost)| [faces, cost]).collect();
            rows.push(Row::new(name, cache.name(), "transforms per vertex", Value::Series(series)));
        }
    };
    for (name, mesh) in every_order(&model, &collapses) {
        add(name, &level_costs(&mesh, &CACHES, &levels));
        worst.extend(extremes(name, &every(&mesh), &classical));
    }
    for baseline in BASELINES {
        add(baseline.name(), &baseline_costs(&plain, baseline, &CACHES, &levels).costs);
    }
    rows.extend(worst);
    Ok(rows)
}

/// The lowest cost over the levels, and the largest ratio to the classical order's cost at the same level.
fn extremes(name: &str, costs: &[f64], classical: &[f64]) -> [Row; 2] {
    let min = costs.iter().copied().min_by(f64::total_cmp).unwrap_or(f64::NAN);
    let shares = costs.iter().zip(classical).map(|(order, classical)| order / classical);
    let share = shares.max_by(f64::total_cmp).unwrap_or(f64::NAN);
    [Row::number(name, MIN, "transforms per vertex", min), Row::number(name, SHARE, "", share)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_level_decides() {
        let [min, share] = extremes("order", &[2.0, 1.5, 2.4], &[4.0, 4.5, 4.0]).map(|row| row.value);
        assert_eq!([min, share], [Value::Number(1.5), Value::Number(0.6)]);
    }
}
