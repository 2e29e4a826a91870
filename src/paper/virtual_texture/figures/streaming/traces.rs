//! The error of a recovering picture over time, from several measurements (for vt.budget and vt.disk).

use crate::figure::Row;
use crate::stats::Summary;

/// Number of measurements of each recovery, also in quick runs: the fewest with a 95 % confidence interval.
pub(super) const ROUNDS: usize = 6;

/// For each frame, its time in milliseconds since the beginning and its error.
#[derive(Clone, Debug, Default)]
pub(super) struct Trace(pub Vec<[f64; 2]>);

/// The times at which traces are sampled, in milliseconds: two per doubling, from 10 ms to 14 s. They are the same in
/// all runs, although each run's frames end at different times.
fn times() -> impl Iterator<Item = f64> {
    (0..=21).map(|n| 10.0 * 2.0f64.powf(f64::from(n) / 2.0))
}

fn summary(samples: impl Iterator<Item = f64>) -> Summary {
    Summary::of(&samples.collect::<Vec<_>>()).expect("a recovery is measured more than once")
}

/// A row with a number for each round. If any round has no number, the row is a single infinite number.
pub(super) fn repeated<T>(
    name: &str,
    quantity: &str,
    unit: &str,
    rounds: &[T],
    of: impl Fn(&T) -> Option<f64>,
) -> Row {
    match rounds.iter().map(of).collect::<Option<Vec<f64>>>() {
        Some(rounds) => Row::of_rounds(name, quantity, unit, Some(rounds)),
        None => Row::number(name, quantity, unit, f64::INFINITY),
    }
}

impl Trace {
    /// The first frame, counted from 1, from which the error stays at or below a share of the first frame's error; and
    /// its time in milliseconds.
    pub fn reached(&self, share: f64) -> Option<(f64, f64)> {
        let bound = share * self.0.first()?[1];
        let at = self.0.iter().rposition(|[_, error]| *error > bound).map_or(0, |last| last + 1);
        Some((at as f64 + 1.0, self.0.get(at)?[0]))
    }

    /// The error of frame `n`; after the last frame it stays constant.
    fn at_frame(&self, n: usize) -> f64 {
        self.0.get(n).or(self.0.last()).map_or(0.0, |[_, error]| *error)
    }

    /// The error of the picture that is shown at a time. Before the first frame it is the first frame's error.
    fn at_time(&self, ms: f64) -> f64 {
        let shown = self.0.iter().rev().find(|[at, _]| *at <= ms).or(self.0.first());
        shown.map_or(0.0, |[_, error]| *error)
    }

    /// The spread of the errors at each frame, from 1 to the longest trace's last.
    pub fn by_frame(traces: &[Trace]) -> Vec<(f64, Summary)> {
        let frames = traces.iter().map(|trace| trace.0.len()).max().unwrap_or(0);
        (0..frames).map(|n| (n as f64 + 1.0, summary(traces.iter().map(|trace| trace.at_frame(n))))).collect()
    }

    /// The spread of the errors at each of [`times`].
    pub fn by_time(traces: &[Trace]) -> Vec<(f64, Summary)> {
        times().map(|ms| (ms, summary(traces.iter().map(|trace| trace.at_time(ms))))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_is_reached_once_the_error_stays_below_it() {
        let trace = Trace(vec![[10.0, 1.0], [20.0, 0.4], [30.0, 0.6], [40.0, 0.5], [50.0, 0.0]]);
        assert_eq!((trace.reached(0.5), trace.reached(0.05)), (Some((4.0, 40.0)), Some((5.0, 50.0))));
        assert_eq!(Trace(trace.0[..4].to_vec()).reached(0.05), None);
    }

    #[test]
    fn traces_of_different_lengths_and_times_are_aligned() {
        let traces =
            [Trace(vec![[15.0, 1.0], [30.0, 0.0]]), Trace(vec![[12.0, 1.0], [25.0, 0.5], [39.0, 0.0]])];
        let frames: Vec<(f64, f64, f64)> =
            Trace::by_frame(&traces).iter().map(|(n, error)| (*n, error.min, error.max)).collect();
        assert_eq!(frames, [(1.0, 1.0, 1.0), (2.0, 0.0, 0.5), (3.0, 0.0, 0.0)]);
        let at =
            |ms: f64| Trace::by_time(&traces).into_iter().find(|(at, _)| (at - ms).abs() < 0.1).unwrap().1;
        assert_eq!([at(10.0).min, at(28.28).min, at(28.28).max, at(40.0).max], [1.0, 0.5, 1.0, 0.0]);
    }
}
