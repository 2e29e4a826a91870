//! `view --measure`: frame times along the scene's path with cold caches, with warm caches, and with open
//! panels. All passes have the same steps, so the first differs from the second only by its loads. Then frames
//! from key presses to changed pictures are counted.

use super::path::Player;
use super::response::Response;
use anyhow::bail;
use ortelius::scene::Scene;
use ortelius::stats::percentile;
use std::fmt::Write as _;
use std::time::Instant;

/// Steps per pass. Of 240 times, the 99th percentile is the third-longest.
const STEPS: usize = 240;

/// Names of the passes, in order.
const PASSES: [&str; 3] = ["cold caches", "warm caches", "panels open"];

/// A measurement in progress.
pub struct Measure {
    begun: Instant,
    /// Frame times of each pass so far, in milliseconds.
    frames_ms: Vec<Vec<f64>>,
    /// After the passes.
    pub response: Option<Response>,
}

impl Measure {
    /// # Errors
    /// The scene has no path.
    pub fn new(scene: &Scene) -> anyhow::Result<Measure> {
        if scene.paths.is_empty() {
            bail!("--measure: scene {} has no path; add [paths.NAME] or use another scene", scene.name);
        }
        Ok(Measure { begun: Instant::now(), frames_ms: vec![Vec::new()], response: None })
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

    /// Called at the end of a frame: records its time. Returns the report after the last key.
    pub fn end(&mut self) -> Option<String> {
        if let Some(response) = &self.response {
            return response.report().map(|frames| format!("{}\n{frames}", self.report()));
        }
        let pass = self.frames_ms.last_mut().expect("the first pass exists from the start");
        pass.push(self.begun.elapsed().as_secs_f64() * 1e3);
        if pass.len() < STEPS {
            return None;
        }
        match self.frames_ms.len() < PASSES.len() {
            true => self.frames_ms.push(Vec::new()),
            false => self.response = Some(Response::default()),
        }
        None
    }

    fn report(&self) -> String {
        let mut text = String::new();
        let [p50, p99] = [0.5, 0.99].map(|at| {
            self.frames_ms.iter().map(|pass| percentile(pass, at).unwrap_or(f64::NAN)).collect::<Vec<_>>()
        });
        for (n, name) in PASSES.iter().enumerate() {
            writeln!(
                text,
                "{name}: {STEPS} frames, median {:.2} ms, 99th percentile {:.2} ms",
                p50[n], p99[n]
            )
            .expect("writing to a String succeeds");
        }
        write!(
            text,
            "99th percentile, cold over warm: {:.2}; panels: {:+.2} ms a frame",
            p99[0] / p99[1],
            p50[2] - p50[1]
        )
        .expect("writing to a String succeeds");
        text
    }
}
