//! Times of settings as multiples of the scene's own frame, which is timed in every round of every batch. A disturbance
//! affects a setting's frame and the scene's own frame of the same round, so the median of ratios is more stable than
//! the ratio of medians. Example: two sweeps of the earth at 320 x 180 ran beside three busy processes. Between the two
//! sweeps, a setting's median of 10 frame times typically differed by 11 % (for the worst setting: 35 %). Its median of
//! 60 ratios typically differed by 2 % (for the worst setting: 6 %).

use super::{ErrorMeasure, TradeResult};
use crate::figure::{Bench, Contender, Errors, Timed, TimedSetting};
use crate::stats::{Summary, median, median_interval};
use crate::vk::Gpu;
use anyhow::Context;

/// A batch is timed until the medians of its settings are known (`KNOWN`), for at most this multiple of the usual
/// number of rounds.
pub const MAX_REPEATS: usize = 6;

/// A median is known if its confidence interval is at most this wide, relative to its middle. The Pareto front treats
/// times as equal up to the same difference.
const KNOWN: f64 = 0.05;

/// A batch of settings that were timed in turn with the scene's own setting.
pub struct Batch {
    /// Milliseconds of the scene's own frame in each round.
    own_ms: Vec<f64>,
    /// The settings' times as multiples of the scene's own frame of the same round.
    settings: Vec<TimedSetting>,
}

impl Batch {
    /// `contenders`: the scene's own setting, then the settings of `found`.
    ///
    /// # Errors
    /// Device lost, or a device without timestamps.
    pub fn time(
        bench: &Bench,
        gpu: &Gpu,
        measure: ErrorMeasure,
        found: &[TradeResult],
        contenders: Vec<Contender<'_>>,
    ) -> anyhow::Result<Batch> {
        let count = found.len();
        let enough = |timed: &[Timed]| timed[1..=count].iter().all(|setting| known(setting, &timed[0]));
        let timed = bench.interleave_until(gpu, contenders, MAX_REPEATS, enough)?;
        let device = &gpu.physical().name;
        let own_ms = timed[0].total_of_rounds();
        let own_ms =
            own_ms.with_context(|| format!("{device} has no timestamps: the trade cannot be measured"))?;
        let settings = found.iter().zip(&timed[1..]).map(|(found, timed)| {
            let ratios = ratios(timed, &own_ms).expect("a device with timestamps times every frame");
            traded(found, measure, &ratios)
        });
        Ok(Batch { settings: settings.collect(), own_ms })
    }
}

/// True if the median of a setting's ratios is known well enough, or if there are no ratios.
fn known(timed: &Timed, own: &Timed) -> bool {
    let ratios = own.total_of_rounds().and_then(|own_ms| ratios(timed, &own_ms));
    ratios.is_none_or(|ratios| {
        let [low, high] = median_interval(&ratios).expect("there are rounds");
        high - low <= KNOWN * (low + high) / 2.0
    })
}

/// A setting's time divided by the time of the scene's own setting, in each round; `None` if the device has no
/// timestamps.
fn ratios(timed: &Timed, own_ms: &[f64]) -> Option<Vec<f64>> {
    Some(timed.total_of_rounds()?.iter().zip(own_ms).map(|(ms, own_ms)| ms / own_ms).collect())
}

/// A setting's result, with `times` in any unit.
fn traded(found: &TradeResult, measure: ErrorMeasure, times: &[f64]) -> TimedSetting {
    let worst = found.measures.worst.map_or(0.0, |worst| worst.value);
    let errors = Errors { nmse: found.measures.nmse, flip: found.measures.flip_mean, max: worst };
    TimedSetting {
        name: found.setting.name.clone(),
        changes: found.setting.changes.clone(),
        ms: Summary::of(times).expect("there are rounds"),
        interval_ms: median_interval(times).expect("there are rounds"),
        error: measure.of(&errors),
        errors,
        forced_bias: found.forced_bias,
        list_frames: found.list_frames,
        on_front: false,
    }
}

/// All settings, the scene's own first. A time in milliseconds is a ratio times the median of the scene's own frame
/// over all batches. Also returns the smallest and the largest median of that frame in a batch.
pub fn in_milliseconds(
    own: &TradeResult,
    batches: Vec<Batch>,
    measure: ErrorMeasure,
) -> (Vec<TimedSetting>, [f64; 2]) {
    let medians = batches.iter().map(|batch| median(&batch.own_ms).expect("there are rounds"));
    let medians: Vec<f64> = medians.collect();
    let all: Vec<f64> = batches.iter().flat_map(|batch| batch.own_ms.iter().copied()).collect();
    let mut own = traded(own, measure, &all);
    let unit = own.ms.median;
    // The scene's own time is the unit of all others.
    own.interval_ms = [unit; 2];
    let mut settings = vec![own];
    for mut setting in batches.into_iter().flat_map(|batch| batch.settings) {
        setting.ms = setting.ms.scaled(unit);
        setting.interval_ms = setting.interval_ms.map(|end| end * unit);
        settings.push(setting);
    }
    let min = medians.iter().copied().fold(f64::INFINITY, f64::min);
    (settings, [min, medians.iter().copied().fold(0.0, f64::max)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vk::PassTime;

    fn timed(ms: impl Iterator<Item = f64>) -> Timed {
        let round =
            |ms| vec![PassTime { label: "texturing".into(), ns: Some((ms * 1e6) as u64), work: None }];
        Timed::of("made up", ms.map(round).collect())
    }

    #[test]
    fn a_setting_is_known_once_its_ratios_are_stable_even_if_its_times_are_not() {
        // Every third frame takes three times as long, as beside another process. The ratios of `steady` vary by
        // 2 %, those of `loose` by 20 %.
        let own = |n: usize| if n.is_multiple_of(3) { 30.0 } else { 10.0 };
        let rounds = || (0..10).map(move |n| (n, own(n)));
        let own = timed(rounds().map(|(_, ms)| ms));
        let steady = timed(rounds().map(|(n, ms)| ms * (1.5 + 0.01 * (n % 4) as f64)));
        let loose = timed(rounds().map(|(n, ms)| ms * (1.5 + 0.1 * (n % 4) as f64)));
        assert!(known(&steady, &own) && !known(&loose, &own));
        assert!(
            !known(&steady, &timed((0..10).map(|_| 10.0))),
            "frames of different rounds are not comparable"
        );
    }
}
