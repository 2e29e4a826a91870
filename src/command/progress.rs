//! The progress bar: work done, total work, time left. The bar appears only on a terminal, and not with --quiet.

use indicatif::{ProgressBar, ProgressStyle};
use ortelius::file::cache_folder;
use ortelius::paper::progressive_mesh::keep::{BuildProgress, Builds, keep};
use std::time::Duration;

pub struct ProgressLine(ProgressBar);

/// Keeps the meshes of scenes in the user's cache folder, and shows a bar while one is built.
pub fn keep_meshes() {
    let step = |name| -> BuildProgress {
        let bar = ProgressLine::counting("faces");
        bar.phase(name, None);
        Box::new(move |done, all| bar.set(done, all))
    };
    keep(Builds { folder: cache_folder("meshes"), step: Box::new(step) });
}

impl ProgressLine {
    /// Counts items of a kind, for example "faces".
    pub fn counting(unit: &str) -> ProgressLine {
        ProgressLine::with(&format!(
            "{{msg}} {{wide_bar}} {{pos}}/{{len}} {unit}, {{elapsed}}, about {{eta}} left"
        ))
    }

    pub fn of_bytes() -> ProgressLine {
        ProgressLine::with("{msg:>8} {wide_bar} {bytes}/{total_bytes} {bytes_per_sec}, about {eta} left")
    }

    fn with(template: &str) -> ProgressLine {
        if !tracing::enabled!(tracing::Level::INFO) {
            return ProgressLine(ProgressBar::hidden());
        }
        let bar = ProgressBar::no_length();
        // The template is constant; if it were wrong, the default style would be shown.
        bar.set_style(
            ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()),
        );
        ProgressLine(bar)
    }

    /// Starts a new phase; the total may become known later.
    pub fn phase(&self, name: impl Into<String>, all: Option<u64>) {
        self.0.reset();
        self.0.set_message(name.into());
        if let Some(all) = all {
            self.0.set_length(all);
        }
        // Ticks keep the elapsed time current during steps of several minutes.
        self.0.enable_steady_tick(Duration::from_millis(500));
    }

    pub fn message(&self, text: String) {
        self.0.set_message(text);
    }

    pub fn set(&self, done: usize, all: usize) {
        self.0.set_length(all as u64);
        self.0.set_position(done as u64);
    }

    pub fn advance(&self, count: u64) {
        self.0.inc(count);
    }

    /// True if no bar is shown.
    pub fn is_hidden(&self) -> bool {
        self.0.is_hidden()
    }

    /// Prints lines above the bar.
    pub fn above(&self, print: impl FnOnce()) {
        self.0.suspend(print);
    }
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
