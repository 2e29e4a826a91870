//! pm.order: transforms per vertex at every level of detail, for all orders and rivals.

use super::super::cache::{CACHES, Cache, LevelCosts, sampled_levels};
use super::super::mesh::ProgressiveMesh;
use super::super::rivals::{RIVALS, rival_costs};
use super::orders::{
    CLASSICAL, CLOSED, FEW, ORDERS, OURS, PAPER, WITH_SCANS, costs, judged, ordered, simplified,
};
use super::scans;
use crate::figure::{
    Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Table, Value, Verdict,
};

pub const ORDER: Figure = Figure {
    id: "pm.order",
    title: "Transforms per vertex at every level",
    about: "How often is a vertex transformed at each level of detail (section 2: 1 = the bound, 3 x faces / vertices \
            = no reuse, about 6)? The shipped closed models `bunny`, `sphere`, `torus`, `knot` and `solid`, simplified \
            to 64 faces. Classical: faces in the order in which splits bring them. Paper: section 5 as it is \
            described (greedy without a look at what is left of a vertex; 64 equal groups). Ours: with that look, and \
            groups of one ratio. Coherent: splits of a group in an order that suits the cache. And rivals: random, \
            re-optimised at every level by meshoptimizer, the full mesh's order compacted, skip lists, a discrete \
            chain. Vertices are positions; `solid` has seams, and pm.average tells its cost on wedges, which a device shades, too. Where they have been fetched, also the scans `dragon_res4` and, with --full, \
            `dragon`; claims speak of the shipped models alone.",
    scenes: &WITH_SCANS,
    variants,
    sweep: None,
    measure,
    plots: &[plot("FIFO-12"), plot("FIFO-16"), plot("FIFO-24"), plot("FIFO-32"), plot("batches")],
    claims: &[
        Claim {
            id: "classical-worst",
            text: "The standard order is close to the worst: above 4 transforms per vertex at every level of at least \
                   1000 faces (FIFO-16).",
            from: Origin::Paper("2"),
            check: classical_is_close_to_the_worst,
        },
        Claim {
            id: "every-level",
            text: "The order is good at every level, not on average alone: ours costs less than half of the classical one at each \
                   of at least 1000 faces (FIFO-16).",
            from: Origin::Paper("5"),
            check: ours_is_good_at_every_level,
        },
    ],
};

const FIFO_16: &str = "FIFO-16";
/// Of so many faces on, the claims look at every level: of fewer, M0 and what little stands beside it decide.
const CLAIMED_FROM: u32 = 1000;
const LEAST: &str = "FIFO-16, least from 1000 faces on";
const SHARE: &str = "FIFO-16, most over the classical order's from 1000 faces on";

const fn plot(quantity: &'static str) -> Plot {
    Plot { quantity, x: Axis::Series("faces"), log_x: true, log_y: false, floor: None }
}

fn variants() -> Vec<String> {
    let rivals = RIVALS.iter().map(|rival| rival.name().to_string());
    ORDERS.iter().map(|(name, _)| name.to_string()).chain(rivals).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    if let Some(rows) = scans::absent(cell, bench.effort, &variants(), FIFO_16) {
        return Ok(rows);
    }
    let (model, collapses) = simplified(&cell.scene)?;
    let count = if bench.effort == Effort::Quick { 97 } else { 385 };
    let plain = ordered(&model, &collapses, None);
    let levels = sampled_levels(&plain, 0, count);
    // What is claimed of every level is looked at on every level: between samples lies the top of a sawtooth.
    let all = sampled_levels(&plain, 100_000, 2049);
    let from = all.partition_point(|&level| plain.levels[level as usize].faces < CLAIMED_FROM);
    let every = |mesh: &ProgressiveMesh| costs(mesh, &[Cache::Fifo(16)], &all[from..]).remove(0).per_vertex;
    let classical = every(&plain);
    let (mut rows, mut worst) = (Vec::new(), Vec::new());
    let mut add = |name: &str, costs: &[LevelCosts]| {
        for (cache, costs) in CACHES.iter().zip(costs) {
            let faces = costs.levels.iter().map(|&level| f64::from(plain.levels[level as usize].faces));
            let series = faces.zip(&costs.per_vertex).map(|(faces, &cost)| [faces, cost]).collect();
            rows.push(Row::new(name, cache.name(), "transforms per vertex", Value::Series(series)));
        }
    };
    for (name, options) in &ORDERS {
        let mesh = ordered(&model, &collapses, options.as_ref());
        add(name, &costs(&mesh, &CACHES, &levels));
        worst.extend(extremes(name, &every(&mesh), &classical));
    }
    for rival in RIVALS {
        add(rival.name(), &rival_costs(&plain, rival, &CACHES, &levels).costs);
    }
    rows.extend(worst);
    Ok(rows)
}

/// The least cost of the levels, and the most over the classical order's at the same level.
fn extremes(name: &str, costs: &[f64], classical: &[f64]) -> [Row; 2] {
    let least = costs.iter().copied().min_by(f64::total_cmp).unwrap_or(f64::NAN);
    let shares = costs.iter().zip(classical).map(|(ours, classical)| ours / classical);
    let share = shares.max_by(f64::total_cmp).unwrap_or(f64::NAN);
    [
        Row::new(name, LEAST, "transforms per vertex", Value::Number(least)),
        Row::new(name, SHARE, "", Value::Number(share)),
    ]
}

fn classical_is_close_to_the_worst(table: &Table) -> Finding {
    let least = |scene: &&str| table.number(scene, None, CLASSICAL, LEAST);
    let least: Option<Vec<f64>> = CLOSED.iter().map(least).collect();
    let met = least.as_ref().map(|least| least.iter().all(|&cost| cost > 4.0));
    let numbers = least.iter().flatten().zip(CLOSED).map(|(cost, scene)| format!("{scene} {cost:.2}"));
    let mut finding = judged(met, numbers.collect::<Vec<_>>().join(", "), "the least of each model above 4");
    let above = least.iter().flatten().filter(|&&cost| cost > 4.0).count();
    if met == Some(false) && above > 0 {
        finding.verdict = Verdict::InPart;
        finding.why = format!("above 4 at every level on {above} of {} models", CLOSED.len());
    }
    finding
}

fn ours_is_good_at_every_level(table: &Table) -> Finding {
    let of = |variant: &str| -> Option<f64> {
        let each: Option<Vec<f64>> =
            CLOSED.iter().map(|scene| table.number(scene, None, variant, SHARE)).collect();
        each?.into_iter().max_by(f64::total_cmp)
    };
    let numbers = [OURS, FEW, PAPER].map(|name| format!("{name} {:.2}", of(name).unwrap_or(f64::NAN)));
    let met = of(OURS).map(|worst| worst < 0.5);
    judged(met, numbers.join(", "), "the worst share of the classical cost, over all models, below 0.5")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::Record;

    fn table(least: f64, share: f64) -> Table {
        let mut table = super::super::tests::table("cpu", &[]);
        for scene in CLOSED {
            for (variant, quantity, number) in [(CLASSICAL, LEAST, least), (OURS, SHARE, share)] {
                let row = Row::new(variant, quantity, "", Value::Number(number));
                table.records.push(Record { scene: scene.into(), x: None, row });
            }
        }
        table
    }

    #[test]
    fn claims_look_at_the_least_and_at_the_worst_share() {
        let verdicts = |least, share| {
            let table = table(least, share);
            [classical_is_close_to_the_worst(&table), ours_is_good_at_every_level(&table)].map(|f| f.verdict)
        };
        assert_eq!(verdicts(4.1, 0.49), [Verdict::Reproduced; 2]);
        assert_eq!(verdicts(3.9, 0.5), [Verdict::NotReproduced; 2]);
        let empty = super::super::tests::table("cpu", &[]);
        assert_eq!(classical_is_close_to_the_worst(&empty).verdict, Verdict::NotMeasurable);
    }

    #[test]
    fn the_worst_level_decides() {
        let [least, share] = extremes("order", &[2.0, 1.5, 2.4], &[4.0, 4.5, 4.0]).map(|row| row.value);
        assert_eq!([least, share], [Value::Number(1.5), Value::Number(0.6)]);
    }
}
