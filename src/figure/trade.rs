//! Time and error of a scene's settings: the report of `ortelius trade`.

use super::table::any_f64;
use super::{Machine, json};
use crate::header::{JsonFormat, WrongFormat};
use crate::stats::{MeasuredSetting, Summary, front};
use serde::{Deserialize, Serialize};

/// `trade.json`. The first files had no header.
const FORMAT: JsonFormat = JsonFormat::new("ortelius-trade", 1);

/// A sweep's result.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Trade {
    pub scene: String,
    /// Pixels of the frames.
    pub size: [u32; 2],
    /// Name of the error measure: NMSE, FLIP, largest error.
    pub measure: String,
    /// The reference picture, and the pixels that are compared.
    pub truth: String,
    pub machine: Machine,
    /// Fewest timed frames of a setting. More are taken, up to `max_runs`, until the median is precise.
    pub runs: usize,
    #[serde(rename = "most_runs")]
    pub max_runs: usize,
    /// The scene's own setting is timed again with each batch of settings: the least and the greatest of its medians,
    /// in milliseconds. They show the drift during the sweep.
    pub drift_ms: [f64; 2],
    /// The settings, sorted by the number of scene keys that a setting changes, fewest first.
    pub settings: Vec<TimedSetting>,
    pub refused: Vec<Refused>,
    /// Empty if budgets were not varied.
    pub budgets: Vec<Budgeted>,
}

/// A measured setting.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TimedSetting {
    pub name: String,
    /// Its changes to the scene, as arguments of `-D`.
    pub changes: Vec<String>,
    /// Time of the settled frame. In each round, this setting's time is divided by the time of the scene's own setting.
    /// These ratios are multiplied by the median time of the scene's own setting.
    pub ms: Summary,
    /// Interval of the median ([`median_interval`](crate::stats::median_interval)).
    pub interval_ms: [f64; 2],
    /// The error by the chosen measure.
    #[serde(with = "any_f64")]
    pub error: f64,
    pub errors: Errors,
    /// Levels by which the picture is coarser than requested because the visible tiles exceed the tile pool.
    pub forced_bias: u32,
    /// Frames until a resting camera has listed every visible tile; 1 if each frame's list is exact.
    #[serde(default = "at_once")]
    pub list_frames: u64,
    pub on_front: bool,
}

fn at_once() -> u64 {
    1
}

/// All error measures of a picture against the truth.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Errors {
    #[serde(with = "any_f64")]
    pub nmse: f64,
    /// Mean FLIP.
    #[serde(with = "any_f64")]
    pub flip: f64,
    /// Largest difference of a channel, linear light.
    #[serde(with = "any_f64")]
    pub max: f64,
}

/// A streaming budget: frames until the picture has settled, and the time of the settled frame.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Budgeted {
    /// Its changes to the scene, as arguments of `-D`.
    pub changes: Vec<String>,
    /// Starting with empty caches.
    pub frames: u64,
    pub wall_ms: f64,
    /// Time of the settled frame; `None` if the device has no timestamps.
    pub ms: Option<Summary>,
    /// Bytes of the settled picture that differ from the picture of the scene's own setting.
    pub differing_bytes: usize,
}

/// A setting that does not run on this device.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Refused {
    pub name: String,
    pub why: String,
}

impl Trade {
    /// Computes the Pareto front after all settings are measured. Settings whose list converges more slowly than the
    /// list of the scene's own setting are excluded: after each move of the camera their lists miss tiles, and the
    /// settled picture does not show this.
    pub fn mark_front(&mut self) {
        let choice = |setting: &TimedSetting| MeasuredSetting {
            time: setting.ms.median,
            interval: setting.interval_ms,
            error: setting.error,
        };
        let whole = self.settings.first().map_or(1, |own| own.list_frames);
        let places: Vec<usize> =
            (0..self.settings.len()).filter(|&place| self.settings[place].list_frames <= whole).collect();
        let members = front(&places.iter().map(|&place| choice(&self.settings[place])).collect::<Vec<_>>());
        for setting in &mut self.settings {
            setting.on_front = false;
        }
        members.into_iter().for_each(|member| self.settings[places[member]].on_front = true);
    }

    /// Settings excluded from the front because their lists converge more slowly than the list of the scene's own
    /// setting.
    pub fn incomplete(&self) -> Vec<&TimedSetting> {
        let whole = self.settings.first().map_or(1, |own| own.list_frames);
        self.settings.iter().filter(|setting| setting.list_frames > whole).collect()
    }

    /// The front, from the smallest error to the least time.
    pub fn front(&self) -> Vec<&TimedSetting> {
        let mut members: Vec<&TimedSetting> =
            self.settings.iter().filter(|setting| setting.on_front).collect();
        members.sort_by(|a, b| a.error.total_cmp(&b.error));
        members
    }

    /// The fastest setting of the front with an error of at most `bound`.
    pub fn cheapest(&self, bound: f64) -> Option<&TimedSetting> {
        // Times on the front fall as errors rise.
        self.front().into_iter().rfind(|setting| setting.error <= bound)
    }

    /// Of the front's settings with a median of at most `ms`, the setting with the smallest error.
    pub fn most_accurate(&self, ms: f64) -> Option<&TimedSetting> {
        self.front().into_iter().find(|setting| setting.ms.median <= ms)
    }

    /// JSON, one line for each setting.
    pub fn json(&self) -> String {
        json::text(&FORMAT.head(self), 2)
    }

    /// Reads the text of a `trade.json`.
    ///
    /// # Errors
    /// [`WrongFormat`]
    pub fn parse(text: &str) -> Result<Trade, WrongFormat> {
        FORMAT.check(text)?;
        Ok(serde_json::from_str(text)?)
    }
}

#[cfg(test)]
mod tests {
    use super::super::same::tests::sweep;

    #[test]
    fn a_setting_whose_list_converges_more_slowly_is_excluded_from_the_front() {
        let mut trade =
            sweep(&[("the scene's own", 10.0, 0.1), ("feedback 1/64", 5.0, 0.1), ("bias 1", 8.0, 0.2)]);
        let front = |trade: &super::Trade| {
            trade.front().iter().map(|setting| setting.name.clone()).collect::<Vec<_>>()
        };
        trade.mark_front();
        assert_eq!(front(&trade), ["feedback 1/64"]);
        trade.settings[1].list_frames = 64;
        trade.mark_front();
        assert_eq!(front(&trade), ["the scene's own", "bias 1"]);
        assert_eq!(
            trade.incomplete().iter().map(|setting| &*setting.name).collect::<Vec<_>>(),
            ["feedback 1/64"]
        );
        // The scene's own list converges equally slowly: nothing is excluded.
        trade.settings[0].list_frames = 64;
        trade.mark_front();
        assert_eq!(front(&trade), ["feedback 1/64"]);
    }
}
