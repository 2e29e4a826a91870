//! Tests whether two sweeps of `ortelius trade` found the same Pareto front.

use super::{TimedSetting, Trade};
use crate::stats::{ALIKE, percentile};
use std::collections::HashMap;

/// A sweep compared with an earlier sweep of the same scene.
///
/// Two fronts are the same within noise if both sweeps make the same choice for every bound on the error. Two choices
/// count as the same if their times (over both sweeps) differ by at most [`ALIKE`] times the noise between the sweeps.
/// The noise is measured: it is the factor within which the times of 95 % of the settings agree. Each of these times is
/// expressed as a multiple of the time of the scene's own frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Same {
    /// Settings in both sweeps.
    pub settings: usize,
    /// A factor; 1 without noise.
    pub noise: f64,
    /// Settings whose error changed: their pictures differ.
    pub other_errors: Vec<String>,
    /// The error bounds for which the choices differ, smallest first.
    pub choices: Vec<Choices>,
}

/// The choices of both sweeps for a bound.
#[derive(Clone, Debug, PartialEq)]
pub struct Choices {
    pub bound: f64,
    /// Names of the earlier and the later sweep's choice; `None` if no setting meets the bound.
    pub earlier: Option<String>,
    pub later: Option<String>,
    /// Ratio of the slower choice's time to the faster choice's time: the geometric mean over both sweeps. Infinite if
    /// one choice is missing.
    pub factor: f64,
}

impl Same {
    /// # Errors
    /// The reason why the sweeps cannot be compared.
    pub fn of(earlier: &Trade, later: &Trade) -> Result<Same, String> {
        let subject = |trade: &Trade| {
            let ([width, height], machine) = (trade.size, &trade.machine);
            let Trade { scene, measure, truth, .. } = trade;
            format!("{scene} at {width} x {height} by {measure} on {} ({truth})", machine.device)
        };
        if subject(earlier) != subject(later) {
            return Err(format!(
                "the earlier sweep is of {}, this one of {}",
                subject(earlier),
                subject(later)
            ));
        }
        let pairs = pairs(earlier, later);
        if pairs.len() < earlier.settings.len().max(later.settings.len()) {
            let (common, [before, now]) = (pairs.len(), [earlier, later].map(|trade| trade.settings.len()));
            let all = [earlier, later].into_iter().flat_map(|trade| &trade.settings);
            let alone: Vec<&str> =
                all.map(|setting| &*setting.name).filter(|name| !pairs.contains_key(name)).collect();
            return Err(format!(
                "the earlier sweep has {before} settings, this one {now}, {common} in common; only one of them has: {}",
                alone.join("; ")
            ));
        }
        let ratio = |&(before, now): &(f64, f64)| (now / before).max(before / now);
        let ratios: Vec<f64> = pairs.values().map(ratio).collect();
        let other = |setting: &&TimedSetting| !alike(setting.error, named(earlier, &setting.name).error);
        let other_errors = later.settings.iter().filter(other).map(|setting| setting.name.clone()).collect();
        let mut bounds: Vec<f64> =
            [earlier, later].iter().flat_map(|trade| trade.front()).map(|setting| setting.error).collect();
        bounds.sort_by(f64::total_cmp);
        let mut choices: Vec<Choices> = Vec::new();
        for bound in bounds {
            let both = [earlier, later].map(|trade| trade.cheapest(bound * THREE_DIGITS));
            let [before, now] = both.map(|setting| setting.map(|setting| setting.name.clone()));
            let last = choices.last().map(|last| (&last.earlier, &last.later));
            if before != now && last != Some((&before, &now)) {
                let factor = factor(&pairs, before.as_deref(), now.as_deref());
                choices.push(Choices { bound, earlier: before, later: now, factor });
            }
        }
        let noise = percentile(&ratios, 0.95).unwrap_or(1.0);
        Ok(Same { settings: pairs.len(), noise, other_errors, choices })
    }

    /// The largest factor between choices that are the same within noise.
    pub fn bound(&self) -> f64 {
        ALIKE * self.noise
    }

    /// True if the fronts are the same within noise.
    pub fn holds(&self) -> bool {
        self.other_errors.is_empty() && self.choices.iter().all(|choices| choices.factor <= self.bound())
    }

    /// Text, the verdict first.
    pub fn lines(&self) -> Vec<String> {
        let percent = |factor: f64| format!("{:.1} %", 100.0 * (factor - 1.0));
        let name = |name: &Option<String>| name.clone().unwrap_or("none".into());
        let verdict =
            if self.holds() { "the same Pareto front within noise" } else { "another Pareto front" };
        let (settings, noise) = (self.settings, percent(self.noise));
        let mut lines =
            vec![format!("{verdict}: the times of 95 % of the {settings} settings agree within {noise}")];
        lines.extend(self.choices.iter().map(|choices| {
            let (earlier, later) = (name(&choices.earlier), name(&choices.later));
            let apart = match choices.factor.is_finite() {
                true => format!("{} apart (allowed: {})", percent(choices.factor), percent(self.bound())),
                false => "no setting to compare with".to_string(),
            };
            format!("  for an error of {:.2e}: then {earlier}, now {later}: {apart}", choices.bound)
        }));
        lines.extend(self.other_errors.iter().map(|name| format!("  {name}: another error")));
        lines
    }
}

/// Errors that agree in three digits count as equal.
const THREE_DIGITS: f64 = 1.005;

fn alike(a: f64, b: f64) -> bool {
    a.max(b) <= THREE_DIGITS * a.min(b)
}

fn named<'a>(trade: &'a Trade, name: &str) -> &'a TimedSetting {
    trade.settings.iter().find(|setting| setting.name == name).expect("a setting that both have")
}

/// Times of the common settings, as multiples of the scene's own frame.
fn pairs<'a>(earlier: &Trade, later: &'a Trade) -> HashMap<&'a str, (f64, f64)> {
    let times = |trade: &Trade| -> HashMap<String, f64> {
        let own = trade.settings.first().map_or(1.0, |own| own.ms.median);
        trade.settings.iter().map(|setting| (setting.name.clone(), setting.ms.median / own)).collect()
    };
    let (before, now) = (times(earlier), times(later));
    let names = later.settings.iter().map(|setting| &*setting.name);
    names.filter_map(|name| Some((name, (*before.get(name)?, now[name])))).collect()
}

/// See [`Choices::factor`].
fn factor(pairs: &HashMap<&str, (f64, f64)>, earlier: Option<&str>, later: Option<&str>) -> f64 {
    let (Some(earlier), Some(later)) = (earlier, later) else { return f64::INFINITY };
    let [(a_then, a_now), (b_then, b_now)] = [earlier, later].map(|name| pairs[name]);
    let ratio = (a_then / b_then * (a_now / b_now)).sqrt();
    ratio.max(1.0 / ratio)
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::{Errors, Machine};
    use super::*;
    use crate::stats::Summary;

    /// Settings as name, milliseconds and error; each interval is a hundredth of its median.
    pub fn sweep(settings: &[(&str, f64, f64)]) -> Trade {
        let text = |text: &str| text.to_string();
        let machine = Machine {
            device: text("made-up device"),
            device_kind: text("cpu"),
            driver: text("1.0"),
            vulkan: text("1.3.0"),
            processor: text("a processor"),
            cores: 2,
            commit: text("0123456789abcdef"),
            date: text("2026-11-21"),
        };
        let traded = |&(name, ms, error): &(&str, f64, f64)| TimedSetting {
            name: text(name),
            changes: Vec::new(),
            ms: Summary::of(&[ms]).unwrap(),
            interval_ms: [0.995 * ms, 1.005 * ms],
            error,
            errors: Errors { nmse: error, flip: error, max: error },
            forced_bias: 0,
            list_frames: 1,
            on_front: false,
        };
        let mut trade = Trade {
            scene: text("made up"),
            size: [96, 54],
            measure: text("NMSE"),
            truth: String::new(),
            machine,
            runs: 10,
            max_runs: 60,
            drift_ms: [1.0; 2],
            settings: settings.iter().map(traded).collect(),
            refused: Vec::new(),
            budgets: Vec::new(),
        };
        trade.mark_front();
        trade
    }

    const FIRST: [(&str, f64, f64); 4] =
        [("own", 10.0, 0.1), ("coarse", 8.0, 0.2), ("coarser", 7.0, 0.3), ("coarsest", 6.0, 0.4)];

    fn with(name: &str, ms: f64) -> Trade {
        sweep(&FIRST.map(|(n, before, error)| (n, if n == name { ms } else { before }, error)))
    }

    #[test]
    fn a_sweep_twice_as_slow_has_the_same_front() {
        let slow = sweep(&FIRST.map(|(name, ms, error)| (name, 2.0 * ms, error)));
        let same = Same::of(&sweep(&FIRST), &slow).unwrap();
        assert!(same.holds() && same.choices.is_empty(), "{same:?}");
        assert!((same.noise - 1.0).abs() < 1e-9, "{}", same.noise);
        assert!(
            same.lines()[0]
                .starts_with("the same Pareto front within noise: the times of 95 % of the 4 settings")
        );
    }

    #[test]
    fn a_setting_that_leaves_the_front_within_noise_is_no_change() {
        // The time of "coarser" rises from 7 to 7.7, so this setting leaves the front. The change is within the noise.
        let same = Same::of(&sweep(&FIRST), &with("coarser", 7.7)).unwrap();
        assert!(same.holds(), "{same:?}");
        let choices = &same.choices[0];
        assert_eq!((choices.earlier.as_deref(), choices.later.as_deref()), (Some("coarser"), Some("coarse")));
        // The geometric mean of 8 / 7 and 8 / 7.7.
        assert!((choices.factor - 1.08964).abs() < 1e-4 && choices.factor < same.bound(), "{same:?}");
    }

    #[test]
    fn a_choice_that_is_clearly_slower_is_another_front() {
        // One setting of 40 changed by more than the noise of all other settings.
        let many = |ms| {
            let names: Vec<String> = (0..36).map(|n| format!("slow {n}")).collect();
            let slow = names.iter().map(|name| (&**name, 20.0, 0.5));
            sweep(
                &FIRST
                    .map(|(n, t, e)| (n, if n == "coarsest" { ms } else { t }, e))
                    .into_iter()
                    .chain(slow)
                    .collect::<Vec<_>>(),
            )
        };
        let same = Same::of(&many(6.0), &many(12.0)).unwrap();
        assert!(!same.holds() && same.choices.len() == 1, "{same:?}");
        let lines = same.lines();
        assert!(lines[0].starts_with("another Pareto front: "), "{lines:?}");
        assert!(
            lines[1].contains("then coarsest, now coarser") && lines[1].contains("(allowed: 5.0 %)"),
            "{lines:?}"
        );
    }

    #[test]
    fn a_changed_picture_changes_the_front_and_another_scene_is_an_error() {
        let other =
            sweep(&FIRST.map(|(name, ms, error)| (name, ms, if name == "coarse" { 0.22 } else { error })));
        let same = Same::of(&sweep(&FIRST), &other).unwrap();
        assert!(!same.holds() && same.other_errors == ["coarse"], "{same:?}");
        let mut flip = sweep(&FIRST);
        flip.measure = "FLIP".into();
        let words = Same::of(&sweep(&FIRST), &flip).unwrap_err();
        assert!(words.contains("by NMSE on made-up device") && words.contains("by FLIP"), "{words}");
        let words = Same::of(&sweep(&FIRST), &sweep(&FIRST[..3])).unwrap_err();
        let missing = format!("4 settings, this one 3, 3 in common; only one of them has: {}", FIRST[3].0);
        assert!(words.contains(&missing), "{words}");
    }
}
