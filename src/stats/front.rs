//! The Pareto front of time and error over many settings, with differences below the measurement's resolution
//! ignored.
//!
//! One setting is clearly faster than another if the intervals of their medians are disjoint and the medians
//! differ by more than a factor of [`ALIKE`]; otherwise their times count as equal. Errors count as equal if they agree
//! in three digits. Intervals of medians narrow with the number of runs; a range of p5 to p95 does not. On a
//! shared machine the range from p5 to p95 is half as large as the median, and a front based on it changes
//! from run to run.

/// A setting's measured time, in any unit, and its error (not NaN).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredSetting {
    /// Median, and its confidence interval ([`super::median_interval`]).
    pub time: f64,
    pub interval: [f64; 2],
    pub error: f64,
}

/// Two times count as equal if their ratio is at most this. So small a difference justifies neither a larger
/// error nor a setting that differs from the default.
pub const ALIKE: f64 = 1.05;

impl MeasuredSetting {
    fn clearly_faster_than(&self, other: &MeasuredSetting) -> bool {
        self.interval[1] < other.interval[0] && ALIKE * self.time < other.time
    }
}

/// An error rounded to three digits.
fn rounded(error: f64) -> f64 {
    assert!(!error.is_nan(), "the error is NaN");
    format!("{error:.2e}").parse().expect("what was just printed")
}

/// Indices of the front's members in `choices`, from the smallest error to the least time. `choices` is in order of
/// simplicity, the simplest first. Each member is clearly faster than all members with a smaller error. For each choice
/// that is left out, some member has no larger error and is not clearly slower. Among choices with the same error, the
/// simplest one whose time is at most [`ALIKE`] times the least time is kept.
pub fn front(choices: &[MeasuredSetting]) -> Vec<usize> {
    let mut places: Vec<usize> = (0..choices.len()).collect();
    places.sort_by(|&a, &b| rounded(choices[a].error).total_cmp(&rounded(choices[b].error)));
    let mut members: Vec<usize> = Vec::new();
    for alike in places.chunk_by(|&a, &b| rounded(choices[a].error) == rounded(choices[b].error)) {
        let faster = |&place: &usize| {
            members.iter().all(|&member| choices[place].clearly_faster_than(&choices[member]))
        };
        let faster: Vec<usize> = alike.iter().copied().filter(faster).collect();
        let min = faster.iter().map(|&place| choices[place].time).fold(f64::INFINITY, f64::min);
        let as_fast = |&place: &usize| choices[place].time <= ALIKE * min;
        // The sort is stable, so the first is the simplest.
        members.extend(faster.iter().copied().find(as_fast));
    }
    members
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn choice(low: f64, high: f64, error: f64) -> MeasuredSetting {
        MeasuredSetting { time: (low + high) / 2.0, interval: [low, high], error }
    }

    #[test]
    fn slower_and_less_accurate_choices_are_left_out() {
        let choices = [
            choice(9.0, 10.0, 0.1),
            choice(1.0, 2.0, 0.5),
            choice(11.0, 12.0, 0.2),
            choice(5.0, 6.0, 0.5),
            choice(4.0, 5.0, 0.3),
        ];
        assert_eq!(front(&choices), [0, 4, 1]);
        assert_eq!(front(&[]), [0; 0]);
    }

    #[test]
    fn at_overlapping_times_the_smaller_error_wins_and_at_equal_errors_the_simplest() {
        assert_eq!(front(&[choice(1.0, 2.1, 0.5), choice(2.0, 3.0, 0.4)]), [1]);
        assert_eq!(front(&[choice(1.0, 1.9, 0.5), choice(2.0, 3.0, 0.4)]), [1, 0]);
        assert_eq!(front(&[choice(2.0, 2.3, 0.4), choice(2.0, 2.1, 0.4)]), [0]);
        // Disjoint intervals, but only 4 % apart.
        assert_eq!(front(&[choice(1.03, 1.05, 0.4), choice(0.99, 1.01, 0.5)]), [0]);
        assert_eq!(front(&[choice(1.06, 1.08, 0.4), choice(0.99, 1.01, 0.5)]), [0, 1]);
        // Overlapping intervals, with medians a quarter apart.
        assert_eq!(front(&[choice(2.0, 3.0, 0.4), choice(1.9, 2.1, 0.4)]), [1]);
        assert_eq!(front(&[choice(2.0, 3.0, 0.4), choice(1.0, 1.9, 0.4)]), [1]);
        // 0.4 and 0.4001 round to the same three digits.
        assert_eq!(front(&[choice(2.0, 2.3, 0.4001), choice(2.0, 2.1, 0.4)]), [0]);
    }

    #[test]
    fn a_chain_of_overlaps_does_not_hide_its_fast_end() {
        // Each overlaps the next; the first and the last are disjoint.
        let choices = [choice(1.0, 2.0, 0.3), choice(1.5, 2.5, 0.2), choice(2.2, 3.0, 0.1)];
        assert_eq!(front(&choices), [2, 0]);
    }

    fn many() -> impl Strategy<Value = Vec<MeasuredSetting>> {
        let one = (1.0..50.0, 0.0..8.0, 0u32..6).prop_map(|(p5, spread, error): (f64, f64, u32)| {
            choice(p5, p5 + spread, f64::from(error) / 10.0)
        });
        prop::collection::vec(one, 0..24)
    }

    proptest! {
        #[test]
        fn members_are_clearly_apart_and_each_omitted_choice_has_a_member_as_good(choices in many()) {
            let members = front(&choices);
            for pair in members.windows(2) {
                let [accurate, fast] = [choices[pair[0]], choices[pair[1]]];
                prop_assert!(accurate.error < fast.error && fast.clearly_faster_than(&accurate));
            }
            for choice in &choices {
                let as_good = |&member: &usize| {
                    choices[member].error <= choice.error && !choice.clearly_faster_than(&choices[member])
                };
                prop_assert!(members.iter().any(as_good));
            }
        }

        #[test]
        fn with_different_errors_the_order_of_the_list_does_not_matter(choices in many(), turn in 0usize..24) {
            let mut choices = choices;
            for (n, choice) in choices.iter_mut().enumerate() {
                // 7 and 24 have no common divisor, so all errors differ.
                choice.error = 1.0 + 0.01 * (n * 7 % 24) as f64;
            }
            let named = |choices: &[MeasuredSetting]| front(choices).iter().map(|&n| choices[n]).collect::<Vec<_>>();
            let found = named(&choices);
            let turned = turn.min(choices.len());
            choices.rotate_left(turned);
            prop_assert_eq!(named(&choices), found);
        }
    }
}
