//! `view --measure`: frame times along the scene's path with cold caches, with warm caches, and with open
//! panels. All passes have the same steps, so the first differs from the second only by its loads. Then frames
//! from key presses to changed pictures are counted.

use super::path::Player;
use super::response::Response;
use anyhow::bail;
use ortelius::scene::Scene;
use ortelius::stats::percentile;
use std::time::Instant;

/// Steps per pass. Of 240 times, the 99th percentile lies between the fourth- and the third-longest.
const STEPS: usize = 240;

/// Names of the passes, in order.
const PASSES: [&str; 3] = ["cold caches", "warm caches", "panels open"];

/// A measurement in progress.
pub struct Measure {
    begun: Instant,
    /// Frame times of each pass so far, in milliseconds.
    frames_ms: Vec<Vec<f64>>,
    /// Processor time of this process at the start, and at the end of each pass, in milliseconds.
    processor_ms: Vec<Option<f64>>,
    /// After the passes.
    pub response: Option<Response>,
    ended: bool,
}

impl Measure {
    /// # Errors
    /// The scene has no path.
    pub fn new(scene: &Scene) -> anyhow::Result<Measure> {
        if scene.paths.is_empty() {
            bail!("--measure: scene {} has no path; add [paths.NAME] or use another scene", scene.name);
        }
        let processor_ms = vec![processor_ms()];
        Ok(Measure {
            begun: Instant::now(),
            frames_ms: vec![Vec::new()],
            processor_ms,
            response: None,
            ended: false,
        })
    }

    /// Called at the start of a frame: moves along the path to the next step. Returns true if the panels are
    /// open in this frame; `None` after the passes.
    pub fn begin(&mut self, player: &mut Player) -> Option<bool> {
        if self.response.is_some() {
            return None;
        }
        self.begun = Instant::now();
        let step = self.frames_ms.last().map_or(0, Vec::len);
        if let Some((_, frames)) = player.place() {
            player.seek(frames * step as f64 / (STEPS - 1) as f64);
        }
        Some(self.frames_ms.len() == PASSES.len())
    }

    /// Called at the end of a frame: records its time. Returns a part of the report that is complete.
    pub fn end(&mut self) -> Option<String> {
        if let Some(response) = &self.response {
            let report = response.report();
            self.ended = report.is_some();
            return report;
        }
        let pass = self.frames_ms.last_mut().expect("the first pass exists from the start");
        pass.push(self.begun.elapsed().as_secs_f64() * 1e3);
        if pass.len() < STEPS {
            return None;
        }
        let number = self.frames_ms.len() - 1;
        let (name, [median, p99]) = (PASSES[number], self.times_ms(number));
        self.processor_ms.push(processor_ms());
        let line = format!(
            "{name}: {STEPS} frames, median {median:.2} ms, 99th percentile {p99:.2} ms{}",
            self.processor(number).map_or(String::new(), |ms| format!(", processor time {ms:.2} ms a frame"))
        );
        if self.frames_ms.len() < PASSES.len() {
            self.frames_ms.push(Vec::new());
            return Some(line);
        }
        self.response = Some(Response::default());
        let [cold, warm, open] = [0, 1, 2].map(|pass| self.times_ms(pass));
        let (ratio, panels) = (cold[1] / warm[1], open[0] - warm[0]);
        let processor = self.processor(2).zip(self.processor(1));
        let processor = processor.map(|(open, warm)| format!(", {:+.2} ms of processor time", open - warm));
        Some(format!(
            "{line}\n99th percentile, cold over warm: {ratio:.2}; panels: {panels:+.2} ms a frame{}",
            processor.unwrap_or_default()
        ))
    }

    /// Processor time a frame in a pass, milliseconds of all threads.
    fn processor(&self, pass: usize) -> Option<f64> {
        Some((self.processor_ms[pass + 1]? - self.processor_ms[pass]?) / STEPS as f64)
    }

    /// True after the last part of the report.
    pub fn has_ended(&self) -> bool {
        self.ended
    }

    /// Median and 99th percentile of a pass.
    fn times_ms(&self, pass: usize) -> [f64; 2] {
        [0.5, 0.99].map(|at| percentile(&self.frames_ms[pass], at).unwrap_or(f64::NAN))
    }
}

/// Processor time of all threads of this process so far, in milliseconds. Other programs hardly change it, unlike the
/// times of frames. `None` unless the system reports it (Linux does, in steps of 10 ms).
fn processor_ms() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name in parentheses may contain spaces. User and system time are the 12th and 13th fields after it.
    let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |n: usize| fields.get(n)?.parse::<f64>().ok();
    Some(10.0 * (ticks(11)? + ticks(12)?))
}
