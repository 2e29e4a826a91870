//! Order statistics of repeated measurements, as reports print them.

mod front;

pub use front::{ALIKE, MeasuredSetting, front};

use serde::{Deserialize, Serialize};

/// The `p`-quantile (0.0 ..= 1.0) of the sorted samples, linear between the two nearest (type 7 of Hyndman
/// and Fan, "Sample quantiles in statistical packages", 1996: the default of R and NumPy). `None` without
/// samples.
///
/// # Panics
/// If a sample is NaN, or `p` is outside 0 ..= 1.
pub fn percentile(samples: &[f64], p: f64) -> Option<f64> {
    at_share(&sorted(samples), p)
}

/// The middle sample, or the mean of the two middle ones: [`percentile`] 0.5.
pub fn median(samples: &[f64]) -> Option<f64> {
    percentile(samples, 0.5)
}

/// The arithmetic mean; NaN without values.
pub fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut count = 0.0;
    let sum: f64 = values.into_iter().inspect(|_| count += 1.0).sum();
    sum / count
}

/// The geometric mean; 0 if any value is 0.
pub fn geometric_mean(values: impl IntoIterator<Item = f64>) -> f64 {
    mean(values.into_iter().map(f64::ln)).exp()
}

/// Confidence interval of the median, at least 95 % for any distribution. Its ends are the order statistics that lie
/// 0.98 sqrt(n) ranks on each side of the middle, rounded outwards (W. J. Conover, "Practical Nonparametric
/// Statistics", 1971, section 3.2; normal approximation of the binomial). With fewer than 6 samples it is their whole
/// range and covers less than 95 %. `None` without samples.
///
/// # Panics
/// As [`percentile`].
pub fn median_interval(samples: &[f64]) -> Option<[f64; 2]> {
    let sorted = sorted(samples);
    let count = sorted.len() as f64;
    let below = (0.5 * count - 0.98 * count.sqrt() - 0.5).floor().max(0.0) as usize;
    Some([*sorted.get(below)?, sorted[sorted.len() - 1 - below]])
}

fn sorted(samples: &[f64]) -> Vec<f64> {
    if let Some(at) = samples.iter().position(|sample| sample.is_nan()) {
        panic!("sample {at} of {} is NaN", samples.len());
    }
    let mut sorted = samples.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

fn at_share(sorted: &[f64], p: f64) -> Option<f64> {
    assert!((0.0..=1.0).contains(&p), "a share of {p}");
    let last = sorted.len().checked_sub(1)?;
    let position = p * last as f64;
    let below = position.floor() as usize;
    let (low, high) = (sorted[below], sorted[(below + 1).min(last)]);
    // low + 0 * (high - low) would be NaN between infinities.
    Some(if low == high { low } else { low + (position - below as f64) * (high - low) })
}

/// Summary of `count` measurements, in the samples' unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    /// If a sample is NaN.
    pub fn of(samples: &[f64]) -> Option<Summary> {
        let sorted = sorted(samples);
        let at = |p| at_share(&sorted, p);
        Some(Summary {
            count: sorted.len(),
            min: at(0.0)?,
            p5: at(0.05)?,
            median: at(0.5)?,
            p95: at(0.95)?,
            max: at(1.0)?,
        })
    }

    /// Summary of `of(a, b)` over pairs of measurements taken in turn. A disturbance of a round affects both
    /// measurements, so the median of the ratios (or differences) is steadier than the ratio of the medians. The
    /// ratios also have a spread; the ratio of the medians has none. `None` without samples, or if a pair gives no
    /// finite number.
    ///
    /// # Panics
    /// If the two have different lengths.
    pub fn of_pairs(a: &[f64], b: &[f64], of: impl Fn(f64, f64) -> f64) -> Option<Summary> {
        assert_eq!(a.len(), b.len(), "the two measurements have different numbers of rounds");
        let samples: Vec<f64> = a.iter().zip(b).map(|(&a, &b)| of(a, b)).collect();
        samples.iter().all(|sample| sample.is_finite()).then(|| Summary::of(&samples))?
    }

    /// p95 - p5: 90 % of the samples lie within this range.
    pub fn spread(&self) -> f64 {
        self.p95 - self.p5
    }

    /// This summary in another unit: all values times `factor`.
    pub fn scaled(&self, factor: f64) -> Summary {
        let Summary { count, min, p5, median, p95, max } = *self;
        let [min, p5, median, p95, max] = [min, p5, median, p95, max].map(|value| value * factor);
        Summary { count, min, p5, median, p95, max }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_or_the_mean_of_both_middles() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 3.0, 2.0]), Some(2.5));
        assert_eq!(median(&[7.0]), Some(7.0));
        assert_eq!(median(&[]), None);
    }

    #[test]
    fn means_are_of_sums_and_of_products() {
        assert_eq!(mean([1.0, 2.0, 6.0]), 3.0);
        assert_eq!(geometric_mean([0.0, 8.0]), 0.0);
        assert!((geometric_mean([2.0, 8.0]) - 4.0).abs() < 1e-12);
        assert!(mean([]).is_nan());
    }

    #[test]
    fn percentiles_lie_between_the_nearest_samples() {
        let samples: Vec<f64> = (0..=20).rev().map(f64::from).collect();
        assert_eq!(percentile(&samples, 0.05), Some(1.0));
        assert_eq!(percentile(&samples, 0.95), Some(19.0));
        assert_eq!(percentile(&[10.0, 20.0], 0.25), Some(12.5));
        assert_eq!((percentile(&samples, 0.0), percentile(&samples, 1.0)), (Some(0.0), Some(20.0)));
    }

    /// The probability that the median lies between two order statistics is a sum of binomials.
    #[test]
    fn an_interval_of_the_median_holds_it_in_95_of_100_cases() {
        for count in [6usize, 8, 10, 20, 30, 50, 60, 180] {
            let samples: Vec<f64> = (0..count).map(|n| n as f64).collect();
            let [low, high] = median_interval(&samples).unwrap();
            assert_eq!(low + high, count as f64 - 1.0, "both ends are equally far from the middle");
            // Probability that exactly k of the samples lie below the median.
            let mut chance = 0.5f64.powi(count as i32);
            let mut held = 0.0;
            for below in 0..=count {
                if (low as usize + 1..=high as usize).contains(&below) {
                    held += chance;
                }
                chance *= (count - below) as f64 / (below + 1) as f64;
            }
            assert!((0.95..0.995).contains(&held), "{count}: {held}");
        }
        assert_eq!((median_interval(&[3.0, 1.0]), median_interval(&[])), (Some([1.0, 3.0]), None));
    }

    #[test]
    fn a_summary_holds_the_order_statistics() {
        let samples: Vec<f64> = (0..=100).map(f64::from).collect();
        let summary = Summary::of(&samples).unwrap();
        assert_eq!(summary, Summary { count: 101, min: 0.0, p5: 5.0, median: 50.0, p95: 95.0, max: 100.0 });
        assert_eq!(summary.spread(), 90.0);
        assert_eq!(Summary::of(&[]), None);
    }

    #[test]
    fn one_outlier_moves_only_the_maximum() {
        let mut samples = vec![1.0; 40];
        samples.push(1e9);
        let summary = Summary::of(&samples).unwrap();
        assert_eq!((summary.median, summary.p95, summary.max, summary.spread()), (1.0, 1.0, 1e9, 0.0));
    }

    #[test]
    fn a_disturbance_of_both_does_not_change_the_ratio_of_pairs() {
        let (quiet, disturbed) = ([20.0, 20.0, 20.0], [20.0, 60.0, 200.0]);
        let half = |samples: &[f64]| samples.iter().map(|ms| ms / 2.0).collect::<Vec<f64>>();
        for samples in [quiet, disturbed] {
            let ratio = Summary::of_pairs(&samples, &half(&samples), |a, b| a / b).unwrap();
            assert_eq!((ratio.p5, ratio.median, ratio.p95), (2.0, 2.0, 2.0));
        }
        let unpaired = Summary::of_pairs(&disturbed, &half(&quiet), |a, b| a / b).unwrap();
        assert_eq!((unpaired.median, unpaired.max), (6.0, 20.0));
        assert_eq!(Summary::of_pairs(&[1.0], &[0.0], |a, b| a / b), None);
        assert_eq!(Summary::of_pairs(&[], &[], |a, b| a - b), None);
    }

    #[test]
    fn equal_infinities_have_a_percentile() {
        assert_eq!(median(&[f64::INFINITY; 2]), Some(f64::INFINITY));
    }

    #[test]
    #[should_panic(expected = "sample 1 of 2 is NaN")]
    fn a_nan_sample_is_refused() {
        let _ = median(&[1.0, f64::NAN]);
    }
}
