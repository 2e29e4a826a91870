//! The cost of a frame and of its list, relative to the frames of the same rounds.
//!
//! Contenders take turns ([`Bench::interleave`](crate::figure::Bench::interleave)), so other load or a change of the
//! clock affects all frames of a round alike. Differences and ratios are therefore taken within each round, and their
//! median is reported with p5 and p95 ([`Summary::of_pairs`]). A ratio of two medians would mix rounds, and on a shared
//! machine would vary as much as either median.

use crate::figure::{Row, Timed, Value};
use crate::stats::Summary;

/// The frame of the same mesh with one plain trilinear texture.
pub const PLAIN: &str = "plain texture";

/// The frame that textures in one draw and makes no list: the baseline of the fused variants.
pub const UNLISTED: &str = "one draw, no list";

/// The paper's frame, by the name of its combination.
pub const THE_PAPER: &str = "paper";

/// Quantity of a whole frame's time.
pub const FRAME: &str = "frame";

/// Quantity: the passes of stages 2 and 3 together; of a variant that textures in the draw that finds its triples, and
/// what that draw takes longer than [`UNLISTED`]'s.
pub const LIST: &str = "stages 2 and 3";

/// Quantities: a frame over [`PLAIN`]'s and over [`UNLISTED`]'s.
pub const OVER_PLAIN: &str = "frame over the plain one";
pub const OVER_UNLISTED: &str = "frame over the one without a list";

/// Quantity: how many times the variant's list is cheaper than [`THE_PAPER`]'s.
pub const CHEAPER: &str = "paper's list over this one";

/// [`LIST`] of `timed` in each round, which ran with the `others`; `None` for frames without a list of the device's.
pub fn list_of_rounds(timed: &Timed, others: &[Timed]) -> Option<Vec<f64>> {
    let [dedup, compact] = ["dedup", "compact"].map(|label| timed.pass_of_rounds(label));
    let stages = |round: usize| [&dedup, &compact].into_iter().flatten().map(|pass| pass[round]).sum::<f64>();
    let Some(draw) = timed.pass_of_rounds("fused") else {
        return Some((0..dedup.as_ref()?.len()).map(stages).collect());
    };
    let named = |name: &str| others.iter().find(|other| other.variant == name && name != timed.variant);
    let unlisted = named(UNLISTED)?.pass_of_rounds("fused")?;
    let empty = named("empty pass")?.total_of_rounds()?;
    // An empty pass is the resolution: a smaller difference counts as one empty pass.
    let more = |round: usize| (draw[round] - unlisted[round] + stages(round)).max(empty[round]);
    Some((0..draw.len()).map(more).collect())
}

/// `of` over `to`, round by round; `None` where the clock is too coarse to tell `to` from nothing.
pub fn over(of: &[f64], to: &[f64]) -> Option<Value> {
    Summary::of_pairs(of, to, |of, to| of / to).map(Value::Summary)
}

/// [`LIST`] and [`CHEAPER`] of a contender.
pub fn list_rows(timed: &Timed, others: &[Timed]) -> Vec<Row> {
    let Some(list) = list_of_rounds(timed, others) else { return Vec::new() };
    let row = |quantity, unit, value| Row::new(&*timed.variant, quantity, unit, value);
    let papers = others.iter().find(|other| other.variant == THE_PAPER && other.variant != timed.variant);
    let cheaper = papers.and_then(|papers| over(&list_of_rounds(papers, others)?, &list));
    let own = Summary::of(&list).map(|summary| row(LIST, "ms", Value::Summary(summary)));
    own.into_iter().chain(cheaper.map(|value| row(CHEAPER, "", value))).collect()
}

/// A contender's whole, its list, its passes, and its ratios to the frames that do less.
pub fn rows(timed: &Timed, others: &[Timed]) -> Vec<Row> {
    let pass = |(label, summary): &(String, Option<Summary>)| {
        summary.map(|summary| Row::new(&*timed.variant, &**label, "ms", Value::Summary(summary)))
    };
    let ratio = |(quantity, name): (&str, &str)| {
        let to = others.iter().find(|other| other.variant == name && name != timed.variant)?;
        let value = over(&timed.total_of_rounds()?, &to.total_of_rounds()?)?;
        Some(Row::new(&*timed.variant, quantity, "", value))
    };
    let floors = [(OVER_PLAIN, PLAIN), (OVER_UNLISTED, UNLISTED)];
    let ratios = floors.into_iter().filter(|_| timed.variant != "empty pass").filter_map(ratio);
    // A frame of one pass is reported once.
    let passes = timed.passes.iter().filter(|_| timed.passes.len() > 1);
    let list = list_rows(timed, others);
    [timed.row(FRAME)].into_iter().chain(list).chain(ratios).chain(passes.filter_map(pass)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vk::PassTime;

    /// Passes with their milliseconds in each round.
    fn timed(variant: &str, passes: &[(&str, [f64; 3])]) -> Timed {
        let pass = |&(label, ms): &(&str, [f64; 3]), round: usize| PassTime {
            label: label.into(),
            ns: Some((ms[round] * 1e6) as u64),
        };
        let rounds = (0..3).map(|round| passes.iter().map(|of| pass(of, round)).collect()).collect();
        Timed::of(variant, rounds)
    }

    #[test]
    fn a_list_costs_its_passes_and_what_the_draw_takes_longer_for_it() {
        let all = [
            timed("compute", &[("footprint", [9.0; 3]), ("dedup", [3.0; 3]), ("compact", [1.0; 3])]),
            timed("fused", &[("fused", [26.0; 3]), ("compact", [1.0; 3]), ("read-back", [5.0; 3])]),
            timed("one draw", &[("fused", [25.5; 3]), ("dedup", [3.0; 3]), ("compact", [1.0; 3])]),
            timed("fused, appending", &[("fused", [26.5; 3]), ("read-back", [5.0; 3])]),
            timed("fused, by luck", &[("fused", [24.9; 3]), ("read-back", [5.0; 3])]),
            timed(UNLISTED, &[("fused", [25.0; 3])]),
            timed("classic", &[("copy U1", [2.0; 3])]),
            timed("empty pass", &[("empty pass", [0.25; 3])]),
        ];
        let lists = all.iter().map(|of| list_of_rounds(of, &all).map(|rounds| rounds[0]));
        let expected = [Some(4.0), Some(2.0), Some(4.5), Some(1.5), Some(0.25), None, None, None];
        assert_eq!(lists.collect::<Vec<_>>(), expected);
        assert_eq!(list_of_rounds(&all[1], &all[..2]), None, "nothing to hold it against");
    }

    #[test]
    fn what_disturbs_a_round_changes_no_ratio_and_no_difference() {
        // The second round ran at half the speed, the third began before a neighbour left: medians of other rounds.
        let all = [
            timed(PLAIN, &[("plain", [10.0, 20.0, 15.0])]),
            timed(UNLISTED, &[("fused", [15.0, 30.0, 30.0])]),
            timed("fused", &[("fused", [16.0, 32.0, 32.0])]),
            timed("empty pass", &[("empty pass", [0.1; 3])]),
        ];
        let of = |quantity: &str| {
            let rows = rows(&all[2], &all);
            rows.iter().find(|row| row.quantity == quantity).unwrap().value.number().unwrap()
        };
        assert_eq!((of(FRAME), of(LIST), of(OVER_PLAIN)), (32.0, 2.0, 1.6));
        assert!((of(OVER_UNLISTED) - 16.0 / 15.0).abs() < 1e-12);
        assert!(rows(&all[0], &all).iter().all(|row| row.quantity != OVER_PLAIN), "it is its own measure");
    }

    #[test]
    fn a_list_is_held_against_the_papers_of_the_same_round() {
        let stages = |ms: [f64; 3]| [("dedup", ms), ("compact", [0.0; 3])];
        let all = [timed(THE_PAPER, &stages([8.0, 40.0, 12.0])), timed("compute", &stages([2.0, 10.0, 4.0]))];
        let cheaper = |n: usize| list_rows(&all[n], &all).into_iter().find(|row| row.quantity == CHEAPER);
        assert_eq!(cheaper(1).unwrap().value.number(), Some(4.0));
        assert_eq!(cheaper(0), None);
    }
}
