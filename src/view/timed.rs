//! The times of measured frames, and of the flights along the path.

use ortelius::stats::{Summary, median, percentile};
use serde::Serialize;
use std::time::Duration;

/// Consecutive steps with the panels in one state, open or closed. The same steps follow in the other state. The state
/// that comes first alternates from block to block, so the number of steps in a flight is a multiple of `2 * BLOCK`.
pub const BLOCK: usize = 12;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flight {
    Cold,
    Warm,
    Closed,
    Open,
}

impl Flight {
    pub const ALL: [(Flight, &str); 4] = [
        (Flight::Cold, "cold caches"),
        (Flight::Warm, "warm caches"),
        (Flight::Closed, "panels closed"),
        (Flight::Open, "panels open"),
    ];

    /// The flight and the step of a frame, with `steps` steps per flight; `None` after the last flight.
    pub fn of_frame(n: usize, steps: usize) -> Option<(Flight, usize)> {
        match n / steps {
            0 => Some((Flight::Cold, n)),
            1 => Some((Flight::Warm, n - steps)),
            2 | 3 => {
                let n = n - 2 * steps;
                let (block, within) = (n / (2 * BLOCK), n % (2 * BLOCK));
                let is_open = (within >= BLOCK) == (block % 2 == 1);
                let step = block * BLOCK + within % BLOCK;
                Some((if is_open { Flight::Open } else { Flight::Closed }, step))
            }
            _ => None,
        }
    }
}

/// Parts of a frame's time on the window's thread.
#[derive(Clone, Copy, Default)]
pub struct FrameCost {
    /// Layout of the panels; zero in a frame that draws the last layout again.
    pub layout: Duration,
    /// Making the panels' triangles, and uploading them.
    pub triangles: Duration,
    /// Waits for an image of the window, and for its presentation.
    pub display: Duration,
}

/// One measured frame.
pub struct TimedFrame {
    pub flight: Flight,
    pub step: usize,
    pub ms: f64,
    /// Processor time of all threads.
    pub processor_ms: Option<f64>,
    pub cost: FrameCost,
    /// Frame time without waits for the device and for the display: work, and all other waits.
    pub host_ms: f64,
    /// The device's times of the render passes that draw into the window: the picture's, and the panels'.
    pub device_ms: Option<[f64; 2]>,
}

/// Times of a flight, in milliseconds a frame.
#[derive(Serialize)]
pub struct FlightTimes {
    pub name: &'static str,
    pub frame: Summary,
    pub p99: f64,
    pub processor_mean: Option<f64>,
    /// The longest frame time after the waits for the device and for the display are subtracted.
    pub host_longest: f64,
    /// Frames that laid out the panels.
    pub layouts: usize,
    pub layout_mean: f64,
    pub triangles_mean: f64,
    /// The device's times of the render passes that draw the picture and the panels into the window.
    pub present_pass_mean: Option<f64>,
    pub panels_pass_mean: Option<f64>,
    pub panels_pass_median: Option<f64>,
}

impl FlightTimes {
    /// `frames`: all frames of the flight.
    pub fn of(flight: Flight, frames: &[&TimedFrame]) -> FlightTimes {
        let ms: Vec<f64> = frames.iter().map(|frame| frame.ms).collect();
        let mean_of = |part: &dyn Fn(&TimedFrame) -> f64| {
            mean(&frames.iter().map(|frame| part(frame)).collect::<Vec<_>>())
        };
        let processor: Option<Vec<f64>> = frames.iter().map(|frame| frame.processor_ms).collect();
        let device =
            |n: usize| frames.iter().filter_map(move |frame| Some(frame.device_ms?[n])).collect::<Vec<_>>();
        let [present, panels] = [0, 1].map(device);
        let mean_device = |ms: &[f64]| (!ms.is_empty()).then(|| mean(ms));
        FlightTimes {
            name: Flight::ALL.into_iter().find(|(named, _)| *named == flight).expect("all are named").1,
            frame: Summary::of(&ms).expect("a flight has frames"),
            p99: percentile(&ms, 0.99).expect("a flight has frames"),
            processor_mean: processor.map(|ms| mean(&ms)),
            host_longest: frames.iter().map(|frame| frame.host_ms).fold(0.0, f64::max),
            layouts: frames.iter().filter(|frame| !frame.cost.layout.is_zero()).count(),
            layout_mean: mean_of(&|frame| frame.cost.layout.as_secs_f64() * 1e3),
            triangles_mean: mean_of(&|frame| frame.cost.triangles.as_secs_f64() * 1e3),
            present_pass_mean: mean_device(&present),
            panels_pass_mean: mean_device(&panels),
            panels_pass_median: median(&panels),
        }
    }

    /// The panels' mean cost per frame: layout, triangles, and the render passes that draw into the window, minus the
    /// same mean with closed panels. `None` without timestamps.
    pub fn parts_over(&self, closed: &FlightTimes) -> Option<f64> {
        let parts = |of: &FlightTimes| {
            Some(of.layout_mean + of.triangles_mean + of.present_pass_mean? + of.panels_pass_mean?)
        };
        Some(parts(self)? - parts(closed)?)
    }

    pub fn line(&self) -> String {
        let processor = self.processor_mean.map(|ms| format!(", processor time {ms:.2} ms a frame"));
        format!(
            "{}: {} frames, median {:.2} ms, 99th percentile {:.2} ms{}",
            self.name,
            self.frame.count,
            self.frame.median,
            self.p99,
            processor.unwrap_or_default()
        )
    }
}

pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Processor time of all threads of this process so far, in milliseconds. Other programs hardly change it, but they do
/// change the times of frames. `None` unless the system reports it (Linux does, in steps of 10 ms).
pub fn processor_ms() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name in parentheses may contain spaces. User and system time are the 12th and 13th fields after it.
    let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |n: usize| fields.get(n)?.parse::<f64>().ok();
    Some(10.0 * (ticks(11)? + ticks(12)?))
}

#[cfg(test)]
mod tests {
    use super::super::measure::STEPS;
    use super::*;

    #[test]
    fn every_flight_takes_every_step_once() {
        for steps in [2 * BLOCK, STEPS] {
            let mut counts = vec![[0; 4]; steps];
            let frames = (0..).map_while(|n| Flight::of_frame(n, steps)).collect::<Vec<_>>();
            for (flight, step) in &frames {
                counts[*step][Flight::ALL.iter().position(|(named, _)| named == flight).unwrap()] += 1;
            }
            assert!(frames.len() == 4 * steps && counts.as_flattened().iter().all(|count| *count == 1));
            // Open and closed panels come first equally often.
            let first_open =
                frames[2 * steps..].chunks(2 * BLOCK).filter(|block| block[0].0 == Flight::Open).count();
            assert_eq!(first_open, steps / BLOCK / 2);
        }
    }
}
