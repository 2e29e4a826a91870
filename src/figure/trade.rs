//! Cost and error of a scene's settings: the report of `ortelius trade`.

use super::table::any_f64;
use super::{Machine, json};
use crate::header::{JsonFormat, WrongFormat};
use crate::stats::{Choice, Summary, front};
use serde::{Deserialize, Serialize};

/// `trade.json`. The first files had no header.
const FORMAT: JsonFormat = JsonFormat::new("ortelius-trade", 1);

/// A sweep's result.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Trade {
    pub scene: String,
    /// Pixels of the frames.
    pub size: [u32; 2],
    /// Name of the error measure of the front: NMSE, FLIP, largest error.
    pub measure: String,
    /// What the pictures are compared with, and at which pixels.
    pub truth: String,
    pub machine: Machine,
    /// Fewest timed frames of each setting. More are taken until its median is known, at most `most_runs`.
    pub runs: usize,
    pub most_runs: usize,
    /// Least and most median of the scene's own setting, milliseconds: how far times drifted during the sweep.
    pub drift_ms: [f64; 2],
    /// The simplest first: those that change the fewest keys of the scene.
    pub settings: Vec<Traded>,
    pub refused: Vec<Refused>,
    /// Empty where budgets were not varied.
    pub budgets: Vec<Budgeted>,
}

/// A setting as measured.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Traded {
    pub name: String,
    /// What it changes of the scene, as `-D` takes it.
    pub changes: Vec<String>,
    /// The settled frame: multiples of the scene's own frame of the same round, times the median of that frame.
    pub ms: Summary,
    /// Where the median lies ([`median_interval`](crate::stats::median_interval)).
    pub interval_ms: [f64; 2],
    /// By the chosen measure.
    #[serde(with = "any_f64")]
    pub error: f64,
    pub errors: Errors,
    /// Levels by which the picture is coarser than asked for, because the visible tiles exceed N1.
    pub forced_bias: u32,
    /// Frames until a resting camera has listed every visible tile; 1 where each frame's list is exact.
    #[serde(default = "at_once")]
    pub list_frames: u64,
    pub on_front: bool,
}

fn at_once() -> u64 {
    1
}

/// All measures of a picture against the truth.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Errors {
    #[serde(with = "any_f64")]
    pub nmse: f64,
    /// Mean of FLIP.
    #[serde(with = "any_f64")]
    pub flip: f64,
    /// Largest difference of a channel, linear light.
    #[serde(with = "any_f64")]
    pub max: f64,
}

/// A budget of streaming: how soon the settled frame is there, and that it is the same frame.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Budgeted {
    /// What it changes of the scene, as `-D` takes it.
    pub changes: Vec<String>,
    /// From empty caches on.
    pub frames: u64,
    pub wall_ms: f64,
    /// The settled frame; `None` where the device keeps no time.
    pub ms: Option<Summary>,
    /// Of its picture, against that of the scene's own setting.
    pub differing_bytes: usize,
}

/// A setting that does not run here.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Refused {
    pub name: String,
    pub why: String,
}

impl Trade {
    /// Finds the front once all settings are measured. Settings whose list converges more slowly than the scene's own are
    /// excluded: the settled picture does not show the tiles that they miss after every move of the camera.
    pub fn mark_front(&mut self) {
        let choice = |setting: &Traded| Choice {
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

    /// Settings excluded from the front because their lists converge more slowly than the scene's own.
    pub fn incomplete(&self) -> Vec<&Traded> {
        let whole = self.settings.first().map_or(1, |own| own.list_frames);
        self.settings.iter().filter(|setting| setting.list_frames > whole).collect()
    }

    /// The front, from the smallest error to the least time.
    pub fn front(&self) -> Vec<&Traded> {
        let mut members: Vec<&Traded> = self.settings.iter().filter(|setting| setting.on_front).collect();
        members.sort_by(|a, b| a.error.total_cmp(&b.error));
        members
    }

    /// The fastest of the front whose error is at most `bound`.
    pub fn cheapest(&self, bound: f64) -> Option<&Traded> {
        // Along the front times fall as errors rise.
        self.front().into_iter().rfind(|setting| setting.error <= bound)
    }

    /// The one of the front with the smallest error whose median is at most `ms`.
    pub fn most_accurate(&self, ms: f64) -> Option<&Traded> {
        self.front().into_iter().find(|setting| setting.ms.median <= ms)
    }

    /// JSON, with a line for each setting.
    pub fn json(&self) -> String {
        json::text(&FORMAT.head(self), 2)
    }

    /// From the text of a `trade.json`.
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
    fn a_list_that_is_whole_later_keeps_a_setting_off_the_front_however_fast_it_is() {
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
