//! Contenders of one pass each.

use crate::figure::{Contender, Row, Timed};
use crate::vk::{Cmd, Gpu};

/// Runs `record` as the only pass of a frame, and times it.
pub fn pass<'a>(
    gpu: &'a Gpu,
    variant: impl Into<String>,
    mut record: impl FnMut(&mut Cmd<'_>) -> crate::vk::Result<()> + 'a,
) -> Contender<'a> {
    let variant = variant.into();
    let label = variant.clone();
    let run = move || Ok(gpu.run_pass(&label, &mut record)?);
    Contender { variant, run: Box::new(run) }
}

/// The time of `base` over the time of every other contender, by round.
pub fn gains(timed: &[Timed], base: &str, quantity: &str) -> Vec<Row> {
    let of_base = timed.iter().find(|one| one.variant == base).and_then(Timed::total_of_rounds);
    let gain = |one: &Timed| {
        let rounds = of_base.iter().flatten().zip(one.total_of_rounds()?);
        // A device with coarse timestamps may report 0.
        Some(rounds.map(|(base, own)| base / own).filter(|gain| gain.is_finite()).collect())
    };
    let others = timed.iter().filter(|one| one.variant != base && one.variant != "empty pass");
    others.map(|one| Row::of_rounds(&one.variant, quantity, "", gain(one))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vk::PassTime;

    #[test]
    fn a_gain_is_the_ratio_of_the_times_of_two_contenders_in_one_round() {
        let timed = |name: &str, ns: [u64; 3]| {
            let pass = |ns| vec![PassTime { label: "p".into(), ns: Some(ns), work: None }];
            Timed::of(name, ns.map(pass).to_vec())
        };
        let all = [timed("a", [10, 20, 30]), timed("b", [5, 5, 0]), timed("empty pass", [1; 3])];
        let rows = gains(&all, "a", "gain");
        let found: Vec<_> = rows.iter().map(|row| (&*row.variant, &row.rounds[..])).collect();
        assert_eq!(found, [("b", &[2.0, 4.0][..])]);
    }
}
