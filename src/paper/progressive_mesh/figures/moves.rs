//! pm.moves: what each moved face buys, the balance between the processor's load and the GPU's.

use super::super::cache::{Cache, sampled_levels};
use super::super::order::{Groups, OrderOptions, Within};
use super::super::simplify::Collapses;
use super::orders::{CLOSED, costs, judged, mean_of, moved_per_split, ordered, simplified};
use crate::figure::{Axis, Bench, Cell, Claim, Figure, Finding, Origin, Plot, Row, Sweep, Table, Value};

pub const MOVES: Figure = Figure {
    id: "pm.moves",
    title: "Transforms against moved faces",
    about: "The number of tswaps balances load between CPU and GPU (section 5). The budget is how many faces may change \
            their slots for each split; FIFO-16, mean over up to 512 levels, models as in pm.order: `bunny`, `sphere`, \
            `torus`, `knot`, `solid`. Groups of one ratio: each multiplies the faces by the same number. Equal groups: \
            of equally many splits, as many as fit the budget. In place: groups of one ratio and half as much again \
            as the budget allows, where a face moves only if that saves more than a transform. Regions: a third of \
            the faces at a time, in turns, whenever the budget pays for it. Coherent: the splits of a group in an \
            order that suits the cache, and the same with a tswap after each 2400 faces.",
    scenes: &CLOSED,
    variants,
    sweep: Some(Sweep {
        name: "budget, moved faces per split",
        quick: &[5.0, 10.0, 16.0, 23.0, 40.0],
        full: &[4.0, 5.0, 7.0, 10.0, 13.0, 16.0, 19.0, 23.0, 30.0, 40.0, 60.0],
    }),
    measure,
    plots: &[
        Plot { quantity: COST, x: Axis::Sweep, log_x: true, log_y: false, floor: None },
        Plot { quantity: MOVED, x: Axis::Sweep, log_x: true, log_y: true, floor: None },
    ],
    claims: &[
        Claim {
            id: "balance",
            text: "The number of tswaps balances the load: the more faces move, the fewer vertices are transformed.",
            from: Origin::Paper("5"),
            check: more_moves_fewer_transforms,
        },
        Claim {
            id: "one-ratio",
            text: "At budgets of 10 and 23, groups of one ratio need fewer transforms than equal groups.",
            from: Origin::Ours,
            check: one_ratio_beats_equal_groups,
        },
        Claim {
            id: "aim",
            text: "With coherent splits, 1.42 at 23 moved faces for each split, and 1.65 at 10.",
            from: Origin::Ours,
            check: aim,
        },
    ],
};

const COST: &str = "transforms per vertex";
const MOVED: &str = "moved faces per split";
const RATIO: &str = "one ratio";
const EQUAL: &str = "equal groups";
const IN_PLACE: &str = "in place";
const REGIONS: &str = "regions in turns";
const COHERENT: &str = "coherent";
const RUNS: &str = "coherent runs";
const NAMES: [&str; 6] = [RATIO, EQUAL, IN_PLACE, REGIONS, COHERENT, RUNS];

fn variants() -> Vec<String> {
    NAMES.map(String::from).into()
}

fn options(name: &str, budget: f64, collapses: &Collapses, faces: usize) -> OrderOptions {
    let one_ratio = OrderOptions { groups: Groups::Budget(budget), ..OrderOptions::BEST };
    match name {
        EQUAL => {
            // Group k of n ends with M0's faces and k/n of the others.
            let base = faces - collapses.faces.items().len();
            let all = budget * collapses.faces.len() as f64;
            let moved = |count: f64| count * base as f64 + (faces - base) as f64 * (count + 1.0) / 2.0;
            let fits = (1..=collapses.faces.len() as u32).take_while(|&count| moved(f64::from(count)) <= all);
            OrderOptions { groups: Groups::Uniform(fits.last().unwrap_or(1)), ..one_ratio }
        }
        IN_PLACE => {
            let mut options = OrderOptions { groups: Groups::Budget(1.5 * budget), ..one_ratio };
            options.weights.in_place = 1.3;
            options
        }
        REGIONS => OrderOptions { regions: OrderOptions::FEW_MOVES.regions, ..one_ratio },
        COHERENT => OrderOptions { within: Within::Coherent, ..one_ratio },
        RUNS => OrderOptions { groups: one_ratio.groups, ..OrderOptions::COHERENT },
        _ => one_ratio,
    }
}

fn measure(_: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (model, collapses) = simplified(&cell.scene)?;
    let budget = cell.x.expect("the sweep has values");
    let mut rows = Vec::new();
    for name in NAMES {
        let options = options(name, budget, &collapses, model.faces.len());
        let mesh = ordered(&model, &collapses, Some(&options));
        let levels = sampled_levels(&mesh, 0, 512);
        let cost = costs(&mesh, &[Cache::Fifo(16)], &levels)[0].mean();
        rows.push(Row::new(name, COST, "", Value::Number(cost)));
        rows.push(Row::new(name, MOVED, "faces", Value::Number(moved_per_split(&mesh))));
    }
    Ok(rows)
}

/// Over all models: transforms and moves of a variant at each budget, ascending.
fn trade(table: &Table, variant: &str) -> Vec<(f64, f64)> {
    let mut budgets: Vec<f64> = table.records.iter().filter_map(|record| record.x).collect();
    budgets.sort_by(f64::total_cmp);
    budgets.dedup();
    let of = |budget, quantity| mean_of(table, Some(budget), variant, quantity, &CLOSED);
    let pair = |budget| of(budget, MOVED).zip(of(budget, COST));
    budgets.into_iter().filter_map(pair).collect()
}

fn more_moves_fewer_transforms(table: &Table) -> Finding {
    let trade = trade(table, RATIO);
    let falls = trade.windows(2).all(|pair| pair[0].0 < pair[1].0 && pair[0].1 > pair[1].1);
    let numbers: Vec<String> = trade.iter().map(|(moved, cost)| format!("{cost:.2} at {moved:.1}")).collect();
    let met = (trade.len() > 1).then_some(falls);
    judged(met, numbers.join(", "), "transforms fall wherever moves rise")
}

fn one_ratio_beats_equal_groups(table: &Table) -> Finding {
    let of = |variant, budget| mean_of(table, Some(budget), variant, COST, &CLOSED);
    let pairs = [10.0, 23.0].map(|budget| of(RATIO, budget).zip(of(EQUAL, budget)));
    let met =
        pairs.into_iter().collect::<Option<Vec<_>>>().map(|p| p.iter().all(|(ours, theirs)| ours < theirs));
    let words = pairs.iter().flatten().map(|(ours, theirs)| format!("{ours:.3} against {theirs:.3}"));
    judged(met, words.collect::<Vec<_>>().join(", "), "fewer at both")
}

fn aim(table: &Table) -> Finding {
    let best = |budget| {
        let of = |variant| mean_of(table, Some(budget), variant, COST, &CLOSED);
        of(COHERENT).into_iter().chain(of(RUNS)).min_by(f64::total_cmp)
    };
    let (many, few) = (best(23.0), best(10.0));
    let met = many.zip(few).map(|(many, few)| [many <= 1.42, few <= 1.65]);
    let words = |cost: Option<f64>| cost.map_or("none".into(), |cost| format!("{cost:.3}"));
    let numbers = format!("{} at 23, {} at 10", words(many), words(few));
    let mut finding = judged(met.map(|met| met == [true; 2]), numbers, "1.42 at 23 and 1.65 at 10");
    if met.is_some_and(|met| met[0] != met[1]) {
        finding.verdict = crate::figure::Verdict::InPart;
        finding.why = "one of the two: 1.42 at 23, 1.65 at 10".into();
    }
    finding
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{Record, Verdict};

    fn table(rows: &[(&str, f64, f64, f64)]) -> Table {
        let mut table = super::super::tests::table("cpu", &[]);
        for scene in CLOSED {
            for &(variant, budget, moved, cost) in rows {
                for (quantity, number) in [(MOVED, moved), (COST, cost)] {
                    let row = Row::new(variant, quantity, "", Value::Number(number));
                    table.records.push(Record { scene: scene.into(), x: Some(budget), row });
                }
            }
        }
        table
    }

    #[test]
    fn a_step_the_wrong_way_refutes_the_balance() {
        let found = |cost| {
            let rows = [(RATIO, 10.0, 9.0, 1.7), (RATIO, 23.0, 22.0, cost)];
            more_moves_fewer_transforms(&table(&rows)).verdict
        };
        assert_eq!((found(1.5), found(1.8)), (Verdict::Reproduced, Verdict::NotReproduced));
        assert_eq!(more_moves_fewer_transforms(&table(&[])).verdict, Verdict::NotMeasurable);
    }

    #[test]
    fn equal_groups_and_the_aim_are_judged_at_10_and_23() {
        let found = |ours| {
            let rows = [10.0, 23.0].map(|x| [(RATIO, x, x, ours), (EQUAL, x, x, 1.6)]).concat();
            one_ratio_beats_equal_groups(&table(&rows)).verdict
        };
        assert_eq!((found(1.5), found(1.7)), (Verdict::Reproduced, Verdict::NotReproduced));
        let aims = |many, few| aim(&table(&[(RUNS, 23.0, 22.0, many), (COHERENT, 10.0, 9.0, few)])).verdict;
        assert_eq!(
            [aims(1.4, 1.6), aims(1.5, 1.6), aims(1.5, 1.7)],
            [Verdict::Reproduced, Verdict::InPart, Verdict::NotReproduced]
        );
    }

    #[test]
    fn equal_groups_keep_the_budget() {
        let (model, collapses) = simplified("sphere:5").unwrap();
        let options = options(EQUAL, 10.0, &collapses, model.faces.len());
        assert!(moved_per_split(&ordered(&model, &collapses, Some(&options))) <= 10.0);
    }
}
