//! Order statistics of repeated measurements: what a report prints of a time.

use serde::Serialize;

/// The value that `percent` (0.0 ..= 100.0) of the samples lie at or below, linear between the two nearest
/// (type 7 of Hyndman and Fan, "Sample quantiles in statistical packages", 1996: the default of R and
/// NumPy). NaN for no samples.
///
/// # Panics
/// Where a sample is NaN or `percent` is outside 0 ..= 100: nothing that was measured is either.
pub fn percentile(samples: &[f64], percent: f64) -> f64 {
    at_percent(&sorted(samples), percent)
}

/// The middle sample, or the mean of the two middle ones: [`percentile`] 50. NaN for none.
pub fn median(samples: &[f64]) -> f64 {
    percentile(samples, 50.0)
}

fn sorted(samples: &[f64]) -> Vec<f64> {
    if let Some(at) = samples.iter().position(|sample| sample.is_nan()) {
        panic!("sample {at} of {} is NaN", samples.len());
    }
    let mut sorted = samples.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

fn at_percent(sorted: &[f64], percent: f64) -> f64 {
    assert!((0.0..=100.0).contains(&percent), "{percent} %");
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = percent / 100.0 * last as f64;
    let (below, above) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
    // below + 0 * (above - below) would be NaN between infinities.
    if below == above { below } else { below + (above - below) * at.fract() }
}

/// A measurement taken `count` times, in the samples' unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Summary {
    pub count: usize,
    pub min: f64,
    pub p5: f64,
    pub median: f64,
    pub p95: f64,
    pub max: f64,
}

impl Summary {
    /// `None` without samples.
    ///
    /// # Panics
    /// Where a sample is NaN.
    pub fn of(samples: &[f64]) -> Option<Summary> {
        let sorted = sorted(samples);
        let at = |percent| at_percent(&sorted, percent);
        let [min, p5, median, p95, max] = [0.0, 5.0, 50.0, 95.0, 100.0].map(at);
        let count = sorted.len();
        (count > 0).then_some(Summary { count, min, p5, median, p95, max })
    }

    /// p95 - p5: nine tenths of the samples lie this close together.
    pub fn spread(&self) -> f64 {
        self.p95 - self.p5
    }

    /// The spread as a share of the median; infinite or NaN where the median is 0.
    pub fn relative_spread(&self) -> f64 {
        self.spread() / self.median
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_or_the_mean_of_both_middles() {
        assert_eq!(median(&[9.0, 1.0, 4.0]), 4.0);
        assert_eq!(median(&[9.0, 1.0, 4.0, 5.0]), 4.5);
        assert_eq!(median(&[7.0]), 7.0);
        assert!(median(&[]).is_nan());
    }

    #[test]
    fn percentiles_lie_between_the_nearest_samples() {
        let samples: Vec<f64> = (0..=20).rev().map(f64::from).collect();
        assert_eq!((percentile(&samples, 5.0), percentile(&samples, 95.0)), (1.0, 19.0));
        assert_eq!((percentile(&samples, 0.0), percentile(&samples, 100.0)), (0.0, 20.0));
        assert_eq!(percentile(&[10.0, 20.0], 25.0), 12.5);
    }

    #[test]
    #[should_panic(expected = "101 %")]
    fn more_than_all_samples_are_refused() {
        percentile(&[1.0], 101.0);
    }

    #[test]
    fn a_summary_holds_the_order_statistics() {
        let samples: Vec<f64> = (0..=100).map(f64::from).collect();
        let summary = Summary::of(&samples).unwrap();
        assert_eq!(summary, Summary { count: 101, min: 0.0, p5: 5.0, median: 50.0, p95: 95.0, max: 100.0 });
        assert_eq!((summary.spread(), summary.relative_spread()), (90.0, 1.8));
        assert_eq!(Summary::of(&[]), None);
    }

    #[test]
    fn one_outlier_moves_the_maximum_alone() {
        let mut samples = vec![1.0; 40];
        samples.push(1e9);
        let summary = Summary::of(&samples).unwrap();
        assert_eq!((summary.median, summary.p95, summary.max, summary.spread()), (1.0, 1.0, 1e9, 0.0));
    }

    #[test]
    fn equal_infinities_have_a_percentile() {
        assert_eq!(median(&[f64::INFINITY; 2]), f64::INFINITY);
    }

    #[test]
    #[should_panic(expected = "sample 1 of 2 is NaN")]
    fn a_sample_that_is_no_number_is_refused() {
        median(&[1.0, f64::NAN]);
    }
}
