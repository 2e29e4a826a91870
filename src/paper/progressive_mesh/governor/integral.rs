//! The simple rule: an integral controller on log2 of the error factor, which uses only frame times.
//!
//! A frame's time falls with a power of the error. So the plant (the controlled system) is a straight line in
//! logarithms, with a slope `k`: 0.5 to 1 if faces dominate the time, 0 if they do not. The time is measured two frames
//! late. The controller neither overshoots nor rings if its gain `g` satisfies `g k <= d^d / (d + 1)^(d + 1)` for a
//! delay of `d` frames; this is 4/27 for two frames. An exponential mean with weight one half smooths noise, and inside
//! a dead band the factor does not move. The controller cannot detect that all instances are at their coarsest level.
//! In this case the controller's factor winds up, to at most [`MAX_LOG2`].

use super::MAX_LOG2;

/// Octaves of error per octave of frame time: 4/27 = 0.148, reduced to allow for the delay of the smoothing.
const GAIN: f64 = 0.12;
/// Weight of the newest frame in the mean.
const NEWEST: f64 = 0.5;
/// Distances from the target, in octaves, at which the controller starts to move (7 %) and stops (2 %).
const STARTS: f64 = 0.10;
const RESTS: f64 = 0.03;
/// The target as a share of the budget. The controller stops within 2 % of the target, which is within the budget. The
/// dead band lets frames exceed the budget by up to 2 % before the controller starts again.
const AIM: f64 = 0.95;
/// Maximum change per frame, in octaves: a single hanging frame must not remove most detail.
const FASTEST: f64 = 0.25;
/// The controller.
#[derive(Clone, Debug)]
pub struct Integral {
    budget_ms: f64,
    factor_log2: f64,
    mean: Option<f64>,
    moving: bool,
}

impl Integral {
    /// A controller that starts with the scene's own errors.
    ///
    /// # Panics
    /// If the budget is not positive.
    pub fn new(budget_ms: f64) -> Integral {
        assert!(budget_ms > 0.0, "a budget of {budget_ms} ms");
        Integral { budget_ms, factor_log2: 0.0, mean: None, moving: false }
    }

    /// The factor on all wanted errors, 1 ..= 1024.
    pub fn factor(&self) -> f64 {
        self.factor_log2.exp2()
    }

    /// Records the time of a finished frame.
    pub fn frame_took(&mut self, ms: f64) {
        if !(ms > 0.0 && ms.is_finite()) {
            return;
        }
        let over = (ms / (AIM * self.budget_ms)).log2();
        let mean = self.mean.map_or(over, |mean| mean + NEWEST * (over - mean));
        self.mean = Some(mean);
        self.moving = mean.abs() > STARTS || (self.moving && mean.abs() > RESTS);
        if self.moving {
            let step = (GAIN * mean).clamp(-FASTEST, FASTEST);
            self.factor_log2 = (self.factor_log2 + step).clamp(0.0, MAX_LOG2);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;

    const BUDGET_MS: f64 = 10.0;

    /// Frames that take `fixed_ms` plus a load of `load_ms` at the scene's own error. They are measured two
    /// frames late.
    struct Plant {
        slope: f64,
        fixed_ms: f64,
        /// Largest relative noise of a frame.
        noise: f64,
        state: u64,
    }

    impl Plant {
        fn noise_sample(&mut self) -> f64 {
            self.state = self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (self.state >> 33) as f64 / f64::from(1u32 << 30) - 1.0
        }

        /// Time in milliseconds and factor of each frame.
        fn run(&mut self, frames: usize, load_ms: impl Fn(usize) -> f64) -> Vec<(f64, f64)> {
            let mut controller = Integral::new(BUDGET_MS);
            let mut in_flight = VecDeque::new();
            let mut frame = |n| {
                let factor = controller.factor();
                let noise = 1.0 + self.noise * self.noise_sample();
                let ms = (self.fixed_ms + load_ms(n) * factor.powf(-self.slope)) * noise;
                in_flight.push_back(ms);
                if in_flight.len() > 2 {
                    controller.frame_took(in_flight.pop_front().expect("three frames"));
                }
                (ms, factor)
            };
            (0..frames).map(&mut frame).collect()
        }
    }

    fn plant(slope: f64) -> Plant {
        Plant { slope, fixed_ms: 0.0, noise: 0.0, state: 1 }
    }

    #[test]
    fn a_load_of_four_times_the_budget_settles_within_the_budget_without_overshoot() {
        for (slope, settles) in [(0.4, 60), (0.7, 35), (1.0, 25)] {
            let frames = plant(slope).run(200, |_| 40.0);
            let lowest = frames.iter().map(|(ms, _)| *ms).fold(f64::INFINITY, f64::min);
            // 5 % below the target of 9.5 ms is still inside the dead band.
            assert!(lowest > 0.95 * 0.95 * BUDGET_MS, "slope {slope}: {lowest} ms");
            assert!(
                frames[settles..].iter().all(|(ms, _)| *ms <= 1.03 * BUDGET_MS),
                "slope {slope}: too late"
            );
            let rest = frames[150].1;
            assert!(frames[150..].iter().all(|(_, factor)| *factor == rest), "slope {slope}: still moving");
        }
    }

    #[test]
    fn detail_returns_when_the_load_falls_and_stops_at_the_scenes_own_error() {
        let frames = plant(0.7).run(400, |n| if n < 100 { 40.0 } else { 12.0 });
        let (ms, factor) = frames[399];
        assert!((8.5..=10.0).contains(&ms) && factor < 2.0, "{ms} ms at {factor}");
        assert!(frames[100..].iter().all(|(ms, _)| *ms < 1.05 * BUDGET_MS), "no overshoot upwards");
        let idle = plant(0.7).run(400, |n| if n < 100 { 40.0 } else { 1.0 });
        assert_eq!(idle[399].1, 1.0);
    }

    #[test]
    fn noise_of_fifteen_percent_moves_the_error_by_less_than_a_third_of_an_octave() {
        for slope in [0.4, 0.7, 1.0] {
            let frames = Plant { noise: 0.15, ..plant(slope) }.run(600, |_| 40.0);
            let log2: Vec<f64> = frames[200..].iter().map(|(_, factor)| factor.log2()).collect();
            let min = log2.iter().copied().fold(f64::INFINITY, f64::min);
            let max = log2.iter().copied().fold(0.0, f64::max);
            // The noise itself is 0.2 octaves in each direction.
            assert!(max - min < 1.0 / 3.0, "slope {slope}: {min} to {max}");
        }
    }

    #[test]
    fn a_budget_that_cannot_be_met_ends_at_the_coarsest_and_recovers() {
        let mut hopeless = Plant { fixed_ms: 20.0, ..plant(1.0) };
        assert_eq!(hopeless.run(300, |_| 20.0)[299].1, 1024.0);
        // The wind-up is limited: the factor falls with the first frames below the budget.
        let mut controller = Integral::new(BUDGET_MS);
        (0..300).for_each(|_| controller.frame_took(40.0));
        (0..8).for_each(|_| controller.frame_took(1.0));
        assert!(controller.factor() < 1024.0);
    }

    #[test]
    fn one_hanging_frame_costs_a_quarter_of_an_octave_and_invalid_times_are_ignored() {
        let mut controller = Integral::new(BUDGET_MS);
        controller.frame_took(1e6);
        assert_eq!(controller.factor(), FASTEST.exp2());
        let before = controller.factor();
        [f64::NAN, f64::INFINITY, 0.0, -1.0].into_iter().for_each(|ms| controller.frame_took(ms));
        assert_eq!(controller.factor(), before);
    }
}
