//! pm.order: transforms per vertex at every level of detail, for all orders and rivals.

use super::super::cache::{Cache, LevelCosts, sampled_levels};
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
            chain. Vertices are positions. Where they have been fetched, also the scans `dragon_res4` and, with --full, \
            `dragon`; claims speak of the shipped models alone.",
    scenes: &WITH_SCANS,
    variants,
    sweep: None,
    measure,
    plots: &[plot("FIFO-16"), plot("FIFO-32"), plot("batches")],
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

const CACHES: [Cache; 3] = [Cache::Fifo(16), Cache::Fifo(32), Cache::Batches];
const FIFO_16: &str = "FIFO-16";

const fn plot(quantity: &'static str) -> Plot {
    Plot { quantity, x: Axis::Series("faces"), log_x: true, log_y: false, floor: None }
}

fn variants() -> Vec<String> {
    let rivals = RIVALS.iter().map(|rival| rival.name());
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
    let mut rows = Vec::new();
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
    }
    for rival in RIVALS {
        add(&rival.name(), &rival_costs(&plain, rival, &CACHES, &levels).costs);
    }
    Ok(rows)
}

/// The points of a series at 1000 faces or more.
fn points(table: &Table, scene: &str, variant: &str) -> Option<Vec<[f64; 2]>> {
    match table.value(scene, None, variant, FIFO_16)? {
        Value::Series(points) => Some(points.iter().copied().filter(|point| point[0] >= 1000.0).collect()),
        _ => None,
    }
}

fn classical_is_close_to_the_worst(table: &Table) -> Finding {
    let least =
        |scene: &&str| points(table, scene, CLASSICAL)?.iter().map(|point| point[1]).min_by(f64::total_cmp);
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
    let most = |variant: &str, scene: &str| {
        let (ours, classical) = (points(table, scene, variant)?, points(table, scene, CLASSICAL)?);
        ours.iter().zip(&classical).map(|(ours, classical)| ours[1] / classical[1]).max_by(f64::total_cmp)
    };
    let of = |variant: &str| -> Option<f64> {
        let each: Option<Vec<f64>> = CLOSED.iter().map(|scene| most(variant, scene)).collect();
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

    fn table(classical: f64, ours: f64) -> Table {
        let mut table = super::super::tests::table("cpu", &[]);
        for scene in CLOSED {
            for (variant, cost) in [(CLASSICAL, classical), (OURS, ours)] {
                // Below 1000 faces nothing is asked.
                let value = Value::Series(vec![[64.0, 3.0], [1000.0, cost], [2000.0, cost]]);
                let row = Row::new(variant, FIFO_16, "", value);
                table.records.push(Record { scene: scene.into(), x: None, row });
            }
        }
        table
    }

    #[test]
    fn claims_look_at_each_level_from_1000_faces_on() {
        let verdicts = |classical, ours| {
            let table = table(classical, ours);
            [classical_is_close_to_the_worst(&table), ours_is_good_at_every_level(&table)].map(|f| f.verdict)
        };
        assert_eq!(verdicts(4.5, 1.5), [Verdict::Reproduced; 2]);
        assert_eq!(verdicts(3.9, 2.0), [Verdict::NotReproduced; 2]);
        let empty = super::super::tests::table("cpu", &[]);
        assert_eq!(classical_is_close_to_the_worst(&empty).verdict, Verdict::NotMeasurable);
    }
}
