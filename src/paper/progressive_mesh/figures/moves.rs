//! pm.moves: transforms saved by moving faces, the trade-off between CPU load and GPU load.

use super::super::cache::{Cache, level_costs, sampled_levels};
use super::super::order::{Groups, OrderOptions};
use super::super::simplify::Collapses;
use super::models;
use super::orders::{CLOSED, PAPER, moved_per_split, ordered, simplified};
use crate::figure::prelude::*;
use rayon::prelude::*;

pub const MOVES: Figure = Figure {
    id: "pm.moves",
    title: "Transforms against moved faces",
    about: "The number of tswaps balances the load between CPU and GPU (section 5). The budget is the number of faces \
            that may change their slots per split. Costs are for FIFO-16, as the mean over up to 512 levels; the \
            models are those of pm.order: `bunny`, `sphere`, `torus`, `knot`, `solid`. `paper` is the paper's greedy \
            order with equal groups: as many as fit the budget, with the same number of splits each. `equal groups` \
            has the same groups with our greedy. In `one ratio` every group multiplies the number of faces by the same \
            factor. `threshold` plans groups of one ratio for one and a half times the budget, and then moves a face \
            only if that saves more than one transform. `regions in turns` reorders a third of the faces at a time, \
            whenever the budget allows it. In all of these, new faces stay at the tail until the next tswap. `births \
            in place` has groups of one ratio. New faces lie beside their neighbours from the group's first level on, \
            and are degenerate until their split.",
    scenes: &CLOSED,
    variants,
    paper: &[PAPER],
    ours: &[RATIO],
    full_only: &[],
    sweep: Some(Sweep {
        name: "budget, moved faces per split",
        quick: &[5.0, 10.0, 16.0, 23.0, 40.0],
        full: &[4.0, 5.0, 7.0, 10.0, 13.0, 16.0, 19.0, 23.0, 30.0, 40.0, 60.0],
    }),
    show: Show::views(|| models(&CLOSED)),
    measure,
    plots: &[Plot::sweep(COST).log_x(), Plot::sweep(MOVED).log_x().log_y()],
    claims: &[
        Claim::paper(
            "5",
            "balance",
            "The number of tswaps balances the load: with more moved faces, fewer vertices are transformed.",
            &[Test::steps(one(COST, PAPER), Below(1.0)), Test::steps(one(MOVED, PAPER), Above(1.0))],
        )
        .at(Places::mean(&CLOSED)),
        Claim::ours(
            "our-balance",
            "Also in groups of one ratio with new faces at the tail, fewer vertices are transformed with more moved \
             faces.",
            &[Test::steps(one(COST, RATIO), Below(1.0)), Test::steps(one(MOVED, RATIO), Above(1.0))],
        )
        .at(Places::mean(&CLOSED)),
        Claim::ours(
            "one-ratio",
            "At budgets of 10 to 23, groups of one ratio need fewer transforms than equal groups.",
            &[Test::ratio_of(COST, [RATIO, EQUAL], Below(1.0))],
        )
        .at(Places::mean(&CLOSED).x(10.0, 23.0)),
        Claim::ours(
            "births-in-place",
            "At every budget, births in place need fewer transforms than the best order with new faces at \
             the tail.",
            &[Test::ratio(one(COST, IN_PLACE), best(COST, at_the_tail), Below(1.0))],
        )
        .at(Places::mean(&CLOSED)),
    ],
};

const COST: &str = "transforms per vertex";
const MOVED: &str = "moved faces per split";
const RATIO: &str = "one ratio";
const EQUAL: &str = "equal groups";
const THRESHOLD: &str = "threshold";
const REGIONS: &str = "regions in turns";
const IN_PLACE: &str = "births in place";
const AT_THE_TAIL: [&str; 4] = [RATIO, EQUAL, THRESHOLD, REGIONS];

fn at_the_tail() -> Vec<String> {
    AT_THE_TAIL.map(String::from).into()
}

fn variants() -> Vec<String> {
    [PAPER].into_iter().chain(AT_THE_TAIL).chain([IN_PLACE]).map(String::from).collect()
}

fn options(name: &str, budget: f64, collapses: &Collapses, faces: usize) -> OrderOptions {
    let one_ratio = OrderOptions { groups: Groups::Budget(budget), ..OrderOptions::TAIL_23 };
    match name {
        PAPER => OrderOptions { groups: equal_groups(budget, collapses, faces), ..OrderOptions::PAPER },
        EQUAL => OrderOptions { groups: equal_groups(budget, collapses, faces), ..one_ratio },
        THRESHOLD => {
            let mut options = OrderOptions { groups: Groups::Budget(1.5 * budget), ..one_ratio };
            options.weights.in_place = 1.3;
            options
        }
        REGIONS => OrderOptions { regions: OrderOptions::TAIL_10.regions, ..one_ratio },
        IN_PLACE => OrderOptions { groups: one_ratio.groups, ..OrderOptions::IN_PLACE_23 },
        _ => one_ratio,
    }
}

/// The largest number of equal groups that keeps the budget.
fn equal_groups(budget: f64, collapses: &Collapses, faces: usize) -> Groups {
    // Group k of n ends with level 0's faces and about k/n of the other faces.
    let base = faces - collapses.faces.items().len();
    let all = budget * collapses.faces.len() as f64;
    let moved = |count: f64| count * base as f64 + (faces - base) as f64 * (count + 1.0) / 2.0;
    let fits = (1..=collapses.faces.len() as u32).take_while(|&count| moved(f64::from(count)) <= all);
    Groups::Uniform(fits.last().unwrap_or(1))
}

fn measure(_: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (model, collapses) = simplified(&cell.scene)?;
    let budget = cell.x.expect("the sweep has values");
    let rows = |name: String| {
        let options = options(&name, budget, &collapses, model.faces.len());
        let mesh = ordered(&model, &collapses, Some(&options));
        let levels = sampled_levels(&mesh, 0, 512);
        let cost = level_costs(&mesh, &[Cache::Fifo(16)], &levels)[0].mean();
        let moved = moved_per_split(&mesh);
        [Row::number(&*name, COST, "", cost), Row::number(&*name, MOVED, "faces", moved)]
    };
    Ok(variants().into_par_iter().flat_map_iter(rows).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_groups_keep_the_budget() {
        let (model, collapses) = simplified("sphere:5").unwrap();
        for name in [EQUAL, PAPER] {
            let options = options(name, 10.0, &collapses, model.faces.len());
            assert!(moved_per_split(&ordered(&model, &collapses, Some(&options))) <= 10.0, "{name}");
        }
    }
}
