//! Converts deviations to queue keys, fitted to a first pass over the same model.
//!
//! The first pass orders collapses by quadrics. Their deviations scatter: a few are far above those of the
//! collapses around them. The stated error, a running maximum, then stays constant for thousands of
//! collapses. The second pass delays these few until the others deviate as much. The distance at equal
//! numbers of faces hardly changes, because most collapses keep their order.

/// Collapses per window, as a share of the remaining collapses, so that the table is as fine at 1,000 faces
/// as at a million.
const WINDOW: f64 = 0.04;

/// Collapses in the smallest window: a quantile needs several.
const MIN_WINDOW: usize = 16;

/// The quantile of the deviations in a window. Deviations above it are delayed. Mean and Hausdorff distances relative
/// to one pass (pm.continuity): 0.997 and 0.790 at 0.7, 1.000 and 0.814 at 0.75; on the scan `dragon_res4` 1.023 and
/// 0.618 at 0.7, 1.013 and 0.642 at 0.75. With earlier rules for holes and pinches, larger windows (6 %) gave the same,
/// and a third pass, which starts from the second's log, reduced the Hausdorff distance by 2 % and increased the mean
/// distance by 1 %.
const QUANTILE: f64 = 0.75;

/// Where the first pass has deviated more than this many times as much as the quantile, as on scans with floating
/// specks, fewer collapses are delayed: the deviation of a window is then this part of the largest so far, but at most
/// its [`FAR_QUANTILE`]. Without this rule, the mean distance on the dragon of 871,414 faces is 1.049 of one pass.
const FAR: f64 = 2.5;
const FAR_QUANTILE: f64 = 0.9;

/// Deviations below this share of the model's size count as rounding errors.
const ROUNDING: f64 = 1e-12;

/// Range of the slope beyond the ends of the table, in logarithms. A key is a squared distance times an area.
const SLOPES: [f64; 2] = [1.0, 6.0];

/// An increasing function from deviation to key, piecewise linear in logarithms.
#[derive(Clone, Debug)]
pub struct DeviationKeys {
    /// (ln deviation, ln key), both increasing; at least two points.
    points: Vec<[f64; 2]>,
}

impl DeviationKeys {
    /// `log` holds, for each collapse of the first pass, the largest key so far and the deviation. `None` if
    /// it is too short.
    pub fn of(log: &[[f64; 2]]) -> Option<DeviationKeys> {
        let mut points: Vec<[f64; 2]> = Vec::new();
        let mut rest = log;
        let mut max: f64 = 0.0;
        while rest.len() >= MIN_WINDOW {
            let size = ((rest.len() as f64 * WINDOW) as usize).max(MIN_WINDOW);
            let (window, after) = rest.split_at(size);
            rest = after;
            let mut deviations: Vec<f64> = window.iter().map(|[_, deviation]| *deviation).collect();
            max = deviations.iter().copied().fold(max, f64::max);
            let mut quantile = |part: f64| {
                let at = (size as f64 * part) as usize;
                *deviations.select_nth_unstable_by(at, f64::total_cmp).1
            };
            let deviation = quantile(QUANTILE).max(quantile(FAR_QUANTILE).min(max / FAR));
            let key = window[size / 2][0];
            if deviation > ROUNDING && key > 0.0 {
                let point = [deviation.ln(), key.ln()];
                if points.last().is_none_or(|last| point[0] > last[0] && point[1] > last[1]) {
                    points.push(point);
                }
            }
        }
        (points.len() > 1).then_some(DeviationKeys { points })
    }

    /// The key of a deviation.
    pub fn key(&self, deviation: f64) -> f64 {
        if deviation > ROUNDING { self.along(deviation.ln(), 0).exp() } else { 0.0 }
    }

    /// The deviation of a key.
    pub fn deviation(&self, key: f64) -> f64 {
        if key > 0.0 { self.along(key.ln(), 1).exp() } else { 0.0 }
    }

    /// The other coordinate of the point whose coordinate `axis` is `value`.
    fn along(&self, value: f64, axis: usize) -> f64 {
        let points = &self.points;
        let above = points.partition_point(|point| point[axis] < value);
        let last = points.len() - 1;
        let [low, high] = [above.clamp(1, last) - 1, above.clamp(1, last)].map(|at| points[at]);
        let mut slope = (high[1] - low[1]) / (high[0] - low[0]);
        let outside = above == 0 || above > last;
        if outside {
            slope = slope.clamp(SLOPES[0], SLOPES[1]);
        }
        let from = if above > last { high } else { low };
        let slope = if axis == 0 { slope } else { 1.0 / slope };
        from[1 - axis] + (value - from[axis]) * slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_follow_the_first_pass_and_a_twentieth_of_outliers_changes_nothing() {
        let deviation = |n: usize| 1e-6 * 1.01_f64.powi(n as i32);
        let outlier = |n: usize| if n.is_multiple_of(20) { 100.0 } else { 1.0 };
        let log: Vec<[f64; 2]> =
            (0..1000).map(|n| [deviation(n).powi(3), deviation(n) * outlier(n)]).collect();
        let pace = DeviationKeys::of(&log).unwrap();
        // The table reaches from 1e-6 to 0.02. Beyond, the slope of its last two points is up to 8 % off: the key by
        // exp(0.08 x 3 ln 100) = 3 times.
        for (deviation, max) in [(1e-8, 4.0), (1e-5, 2.0), (1e-3, 2.0), (1.0, 4.0)] {
            let key = pace.key(deviation);
            // The quantile lies up to half a window, 20 steps of 1 %, from the middle of its window.
            let ratio = key / deviation.powi(3);
            assert!((1.0 / max..max).contains(&ratio), "{deviation}: {key}");
            assert!((pace.deviation(key) / deviation - 1.0).abs() < 1e-9, "{deviation}: {key}");
        }
        assert_eq!((pace.key(0.0), pace.deviation(0.0)), (0.0, 0.0));
    }

    #[test]
    fn a_pace_never_falls_and_does_not_exist_without_deviations() {
        let log: Vec<[f64; 2]> = (0..400).map(|n| [f64::from(n), f64::from(n * 7919 % 401 + n)]).collect();
        let pace = DeviationKeys::of(&log).unwrap();
        let keys: Vec<f64> = (1..2000).map(|n| pace.key(f64::from(n))).collect();
        assert!(keys.is_sorted() && keys[0] < keys[1998]);
        assert!(DeviationKeys::of(&[[1.0, 0.0]; 400]).is_none() && DeviationKeys::of(&log[..20]).is_none());
    }
}
