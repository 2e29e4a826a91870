//! The cost of a frame and of its list, relative to the frames of the same rounds.
//!
//! Contenders take turns ([`Bench::interleave`](crate::figure::Bench::interleave)), so other load or a change of the
//! clock affects all frames of a round alike. Differences are therefore taken within each round, as claims take ratios
//! ([`crate::figure::claim::Term`]). A difference of two medians would mix rounds, and on a shared machine would vary
//! as much as either median.

use crate::figure::{Row, Timed};

/// The frame of the same mesh with one plain trilinear texture.
pub const PLAIN: &str = "plain texture";

/// The frame that textures in one draw without making a list: the baseline of the variants that find
/// the tiles while they texture.
pub const UNLISTED: &str = "one draw, no list";

/// Name of the paper's frame.
pub const THE_PAPER: &str = "paper";

/// Label of the host's pass that makes a list.
pub const ON_THE_HOST: &str = "list on the host";

/// Quantity: the time of a whole frame.
pub const FRAME: &str = "frame";

/// Quantity: the time of stages 2 and 3 together. For a variant that finds the tiles while it textures, it includes
/// the difference between its draw and [`UNLISTED`].
pub const LIST: &str = "stages 2 and 3";

/// [`LIST`] of `timed` in each round. `others` are the contenders of the same rounds. `None` if the list is not made
/// on the device.
pub fn list_of_rounds(timed: &Timed, others: &[Timed]) -> Option<Vec<f64>> {
    if ["copy request image", "feedback"].iter().any(|label| timed.pass(label).is_some()) {
        return None;
    }
    let [dedup, compact] = ["dedup", "compact"].map(|label| timed.pass_of_rounds(label));
    let stages = |round: usize| [&dedup, &compact].into_iter().flatten().map(|pass| pass[round]).sum::<f64>();
    let Some(draw) = timed.pass_of_rounds("fused") else {
        return Some((0..dedup.as_ref()?.len()).map(stages).collect());
    };
    let named = |name: &str| others.iter().find(|other| other.variant == name && name != timed.variant);
    let unlisted = named(UNLISTED)?.pass_of_rounds("fused")?;
    let empty = named("empty pass")?.total_of_rounds()?;
    // An empty pass is the resolution: a smaller difference counts as one empty pass. A negative difference would make
    // a claim's ratio meaningless.
    let more = |round: usize| (draw[round] - unlisted[round] + stages(round)).max(empty[round]);
    Some((0..draw.len()).map(more).collect())
}

/// [`LIST`] of a contender.
pub fn list_row(timed: &Timed, others: &[Timed]) -> Option<Row> {
    let row = Row::of_rounds(&timed.variant, LIST, "ms", Some(list_of_rounds(timed, others)?));
    // A fused draw also textures, so its work does not belong to this quantity alone.
    let work = timed.work(&["dedup", "compact"]).filter(|_| timed.pass("fused").is_none());
    Some(Row { work, ..row })
}

/// Rows of a contender's frame, its list and its passes.
pub fn rows(timed: &Timed, others: &[Timed]) -> Vec<Row> {
    // A frame with a single pass is reported once.
    let passes = timed.pass_rows().filter(|_| timed.passes.len() > 1);
    [timed.row(FRAME)].into_iter().chain(list_row(timed, others)).chain(passes).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vk::PassTime;

    /// Passes with their milliseconds in each round.
    fn timed(variant: &str, passes: &[(&str, [f64; 3])]) -> Timed {
        let pass = |&(label, ms): &(&str, [f64; 3]), round: usize| {
            PassTime::new(label, Some((ms[round] * 1e6) as u64))
        };
        let rounds = (0..3).map(|round| passes.iter().map(|of| pass(of, round)).collect()).collect();
        Timed::of(variant, rounds)
    }

    #[test]
    fn the_time_of_a_list_is_its_passes_and_the_extra_time_of_the_draw() {
        let all = [
            timed("compute", &[("footprint", [9.0; 3]), ("dedup", [3.0; 3]), ("compact", [1.0; 3])]),
            timed("fused", &[("fused", [26.0; 3]), ("compact", [1.0; 3]), ("read-back", [5.0; 3])]),
            timed("one draw", &[("fused", [25.5; 3]), ("dedup", [3.0; 3]), ("compact", [1.0; 3])]),
            timed("fused, appending", &[("fused", [26.5; 3]), ("read-back", [5.0; 3])]),
            timed("fused, by luck", &[("fused", [24.9; 3]), ("read-back", [5.0; 3])]),
            timed(UNLISTED, &[("fused", [25.0; 3])]),
            timed("read-back", &[("copy request image", [2.0; 3])]),
            timed("one draw, read-back", &[("fused", [27.0; 3]), ("copy request image", [2.0; 3])]),
            timed("one draw, feedback", &[("fused", [27.0; 3]), ("feedback", [2.0; 3])]),
            timed("empty pass", &[("empty pass", [0.25; 3])]),
        ];
        let lists = all.iter().map(|of| list_of_rounds(of, &all).map(|rounds| rounds[0]));
        let expected = [Some(4.0), Some(2.0), Some(4.5), Some(1.5), Some(0.25), None, None, None, None, None];
        assert_eq!(lists.collect::<Vec<_>>(), expected);
        assert_eq!(list_of_rounds(&all[1], &all[..2]), None, "no baseline to subtract");
    }
}
