//! `view --measure`: frame times along the scene's path, in four flights with the same steps:
//! - with cold caches, then with warm ones;
//! - with closed and with open panels in turn, some steps each, so that other load on the machine affects both flights
//!   alike.
//!
//! After that, keys are pressed, and the frames until the picture changes are counted ([`super::response`]).

use super::path::Player;
use super::response::Response;
use super::timed::{BLOCK, Flight, FlightTimes, FrameCost, TimedFrame, mean, processor_ms};
use anyhow::bail;
use ortelius::figure::Machine;
use ortelius::header::JsonFormat;
use ortelius::picture::write::write_bytes;
use ortelius::scene::Scene;
use ortelius::stats::{Summary, median, median_interval};
use ortelius::vk::{FRAMES_IN_FLIGHT, PhysicalDevice};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Default steps per flight. Of 120 times, the 99th percentile lies between the third- and the second-longest.
pub const STEPS: usize = 120;

const FORMAT: JsonFormat = JsonFormat::new("ortelius-window-times", 2);

/// A measurement in progress.
pub struct Measurement {
    /// Start of the frame, processor time, and time that the program has waited for the device.
    begun: (Instant, Option<f64>, Duration),
    /// Steps per flight.
    steps: usize,
    frames: Vec<TimedFrame>,
    /// `None` until the flights are complete.
    pub response: Option<Response>,
    ended: bool,
    /// The file of the results.
    file: Option<PathBuf>,
}

/// The results, as a file holds them. Times in milliseconds.
#[derive(Serialize)]
struct Results<'a> {
    machine: Machine,
    scene: &'a str,
    path: Option<&'a String>,
    size: [u32; 2],
    disk_delay_ms: f64,
    flights: Vec<FlightTimes>,
    /// 99th percentile with cold caches, divided by the 99th percentile with warm caches.
    cold_over_warm_p99: f64,
    /// Frame time with open panels minus frame time with closed panels, at the same step.
    panels_ms: Summary,
    panels_ms_mean: f64,
    /// What the panels' own timers report, as [`FlightTimes::parts_over`].
    panels_parts_ms_mean: Option<f64>,
    panels_ms_median_interval: [f64; 2],
    response: Option<String>,
}

impl Measurement {
    /// `steps`, the number of steps per flight, is rounded up to a multiple of 24.
    ///
    /// # Errors
    /// The scene has no path.
    pub fn new(scene: &Scene, steps: usize, file: Option<PathBuf>) -> anyhow::Result<Measurement> {
        if scene.paths.is_empty() {
            bail!("--measure: scene {} has no path; add [paths.NAME] or use another scene", scene.name);
        }
        let begun = (Instant::now(), processor_ms(), Duration::ZERO);
        let steps = steps.max(1).next_multiple_of(2 * BLOCK);
        Ok(Measurement { begun, steps, frames: Vec::new(), response: None, ended: false, file })
    }

    /// Called at the start of a frame: moves along the path to the next step. `waited`: as [`Self::end`]. Returns true
    /// if the panels must be open in this frame, false if they must be closed, and `None` after the last flight.
    pub fn begin(&mut self, player: &mut Player, waited: Duration) -> Option<bool> {
        let (flight, step) = Flight::of_frame(self.frames.len(), self.steps)?;
        self.begun = (Instant::now(), processor_ms(), waited);
        if let Some((_, frames)) = player.place() {
            player.seek(frames * step as f64 / (self.steps - 1) as f64);
        }
        Some(flight == Flight::Open)
    }

    /// Called at the end of a frame: records its times. `waited` is the time that the program has waited for the device
    /// so far. `device_ns` holds the device's times of the render passes that draw into the window; they belong to the
    /// frame [`FRAMES_IN_FLIGHT`] frames earlier. Returns a part of the report if this frame completes one.
    pub fn end(&mut self, cost: FrameCost, waited: Duration, device_ns: Option<[u64; 2]>) -> Option<String> {
        if let Some(response) = &self.response {
            let report = response.report();
            self.ended = report.is_some();
            return report;
        }
        let (flight, step) =
            Flight::of_frame(self.frames.len(), self.steps).expect("the flights have not ended");
        let (begun, processor_before, waited_before) = self.begun;
        let (took, processor) = (begun.elapsed(), processor_ms().zip(processor_before));
        let waits = waited.saturating_sub(waited_before) + cost.display;
        self.frames.push(TimedFrame {
            flight,
            step,
            ms: took.as_secs_f64() * 1e3,
            processor_ms: processor.map(|(end, begin)| end - begin),
            cost,
            host_ms: took.saturating_sub(waits).as_secs_f64() * 1e3,
            device_ms: None,
        });
        if let Some(earlier) = self.frames.iter_mut().rev().nth(FRAMES_IN_FLIGHT) {
            earlier.device_ms = device_ns.map(|ns| ns.map(|ns| ns as f64 / 1e6));
        }
        let steps = self.steps;
        match self.frames.len() {
            n if n == steps => Some(self.times(Flight::Cold).line()),
            n if n == 2 * steps => {
                Some(format!("{}\n{}", self.times(Flight::Warm).line(), self.caches_report()))
            }
            n if n == 4 * steps => {
                self.response = Some(Response::default());
                Some(self.panels_report())
            }
            _ => None,
        }
    }

    /// True after the last part of the report.
    pub fn has_ended(&self) -> bool {
        self.ended
    }

    /// The frames of a flight, in the order of the path.
    fn of(&self, flight: Flight) -> Vec<&TimedFrame> {
        let mut frames: Vec<&TimedFrame> =
            self.frames.iter().filter(|frame| frame.flight == flight).collect();
        frames.sort_by_key(|frame| frame.step);
        frames
    }

    fn times(&self, flight: Flight) -> FlightTimes {
        FlightTimes::of(flight, &self.of(flight))
    }

    fn ms(&self, flight: Flight) -> Vec<f64> {
        self.of(flight).into_iter().map(|frame| frame.ms).collect()
    }

    /// Cold frames differ from warm frames not only by their loads. They also show coarser tiles in place of missing
    /// ones, and a footprint covers fewer of the coarser texels. So the report also has the longest frame time without
    /// waits for the device and the display.
    fn caches_report(&self) -> String {
        let [cold, warm] = [Flight::Cold, Flight::Warm].map(|flight| self.times(flight).host_longest);
        format!(
            "99th percentile, cold over warm: {:.2} (cold frames show coarser tiles, so footprints hold fewer \
             texels)\nlongest frame without its waits for the device and the display: cold {cold:.2} ms, warm \
             {warm:.2} ms",
            self.cold_over_warm()
        )
    }

    fn cold_over_warm(&self) -> f64 {
        self.times(Flight::Cold).p99 / self.times(Flight::Warm).p99
    }

    /// Frame time with open panels minus frame time with closed panels, for each step.
    fn panels_ms(&self) -> Vec<f64> {
        let [open, closed] = [Flight::Open, Flight::Closed].map(|flight| self.ms(flight));
        open.iter().zip(&closed).map(|(open, closed)| open - closed).collect()
    }

    fn panels_report(&self) -> String {
        let [closed, open] = [Flight::Closed, Flight::Open].map(|flight| self.times(flight));
        let ms = self.panels_ms();
        let (mean, [low, high]) = (mean(&ms), median_interval(&ms).expect("a flight has frames"));
        let processor = open.processor_mean.zip(closed.processor_mean);
        let processor =
            processor.map(|(open, closed)| format!(", {:+.2} ms of processor time", open - closed));
        format!(
            "{}\n{}\npanels: median {:+.2} ms a frame ({low:+.2} .. {high:+.2}), mean {mean:+.2} ms{}\n panels by \
             their own timers: mean {:+.2} ms a frame; layout {:.2} ms (in {} frames), triangles {:.2} ms, the rest on \
             the device",
            closed.line(),
            open.line(),
            median(&ms).expect("a flight has frames"),
            processor.unwrap_or_default(),
            open.parts_over(&closed).unwrap_or(f64::NAN),
            open.layout_mean,
            open.layouts,
            open.triangles_mean,
        )
    }

    /// Writes the results, if a file was named.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save(&self, scene: &Scene, size: [u32; 2], device: &PhysicalDevice) -> anyhow::Result<()> {
        let Some(file) = &self.file else { return Ok(()) };
        let panels = self.panels_ms();
        let delay = scene.value(&["disk", "delay_ms"]);
        let delay = delay.and_then(|ms| ms.as_float().or(ms.as_integer().map(|ms| ms as f64)));
        let results = Results {
            machine: Machine::here(device),
            scene: &scene.name,
            path: scene.view.path.as_ref(),
            size,
            disk_delay_ms: delay.unwrap_or(0.0),
            flights: Flight::ALL.into_iter().map(|(flight, _)| self.times(flight)).collect(),
            cold_over_warm_p99: self.cold_over_warm(),
            panels_ms: Summary::of(&panels).expect("a flight has frames"),
            panels_ms_mean: mean(&panels),
            panels_parts_ms_mean: self.times(Flight::Open).parts_over(&self.times(Flight::Closed)),
            panels_ms_median_interval: median_interval(&panels).expect("a flight has frames"),
            response: self.response.as_ref().and_then(Response::report),
        };
        write(file, &results)
    }
}

fn write(file: &Path, results: &Results<'_>) -> anyhow::Result<()> {
    let text = serde_json::to_string_pretty(&FORMAT.head(results))?;
    Ok(write_bytes(file, &text)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_panels_cost_is_the_difference_at_the_same_step() {
        let scene = Scene::embedded("globe").unwrap();
        // Rounded up to a whole number of blocks.
        let mut measure = Measurement::new(&scene, 2 * BLOCK - 1, None).unwrap();
        assert_eq!(measure.steps, 2 * BLOCK);
        for n in 0..4 * measure.steps {
            let (flight, step) = Flight::of_frame(n, measure.steps).unwrap();
            // The cost of the picture varies along the path by much more than the panels cost.
            let ms = 10.0 + step as f64 + if flight == Flight::Open { 1.5 } else { 0.0 };
            let (cost, host_ms) = (FrameCost::default(), if flight == Flight::Cold { ms } else { 0.5 });
            let (processor_ms, device_ms) =
                (None, Some([2.0, if flight == Flight::Open { 0.5 } else { 0.25 }]));
            measure.frames.push(TimedFrame { flight, step, ms, processor_ms, cost, host_ms, device_ms });
        }
        assert!(measure.panels_ms().iter().all(|ms| (ms - 1.5).abs() < 1e-9));
        assert_eq!(measure.cold_over_warm(), 1.0);
        let report = measure.panels_report();
        let by_timers = "panels by their own timers: mean +0.25 ms";
        assert!(report.contains("panels: median +1.50 ms") && report.contains(by_timers), "{report}");
        let caches = measure.caches_report();
        assert!(
            caches.contains("cold over warm: 1.00") && caches.contains("cold 33.00 ms, warm 0.50 ms"),
            "{caches}"
        );
    }

    #[test]
    fn waits_for_the_device_and_the_display_are_not_host_time() {
        let scene = Scene::embedded("globe").unwrap();
        let mut measure = Measurement::new(&scene, STEPS, None).unwrap();
        let mut player = Player::new(&scene);
        measure.begin(&mut player, Duration::ZERO);
        std::thread::sleep(Duration::from_millis(2));
        measure.end(FrameCost::default(), Duration::ZERO, None);
        assert!(measure.frames[0].host_ms >= 2.0, "other waits are host time");
        measure.begin(&mut player, Duration::from_secs(1));
        measure.end(
            FrameCost { display: Duration::from_secs(60), ..FrameCost::default() },
            Duration::from_secs(61),
            None,
        );
        assert_eq!(measure.frames[1].host_ms, 0.0);
    }
}
