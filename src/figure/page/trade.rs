//! The page of `ortelius trade`.

use super::super::plot::scatter::{self, Spot};
use super::super::plot::{self, Chart, Point};
use super::super::words::human;
use super::super::{Budgeted, TimedSetting, Trade};
use super::{STYLES, filled};
use crate::picture::write::write_bytes;
use serde::Serialize;
use std::path::Path;

const TEMPLATE: &str = include_str!("trade.html");

#[derive(Serialize)]
struct TradePage<'a> {
    style: String,
    version: &'static str,
    trade: &'a Trade,
    software: bool,
    /// Milliseconds.
    drift: [String; 2],
    svg: Option<&'a str>,
    answer: &'a str,
    front: Vec<Line<'a>>,
    all: Vec<Line<'a>>,
    budgets: Vec<Budget>,
}

/// A budget as text.
#[derive(Serialize)]
struct Budget {
    changes: String,
    frames: u64,
    wall_ms: String,
    ms: String,
    differing_bytes: usize,
}

impl Budget {
    fn of(budget: &Budgeted) -> Budget {
        Budget {
            changes: budget.changes.join(" "),
            frames: budget.frames,
            wall_ms: human(budget.wall_ms),
            ms: budget.ms.map_or("not timed".into(), |ms| {
                format!("{} ({} – {})", human(ms.median), human(ms.p5), human(ms.p95))
            }),
            differing_bytes: budget.differing_bytes,
        }
    }
}

/// A setting as text.
#[derive(Serialize)]
struct Line<'a> {
    name: &'a str,
    changes: String,
    ms: String,
    spread: String,
    errors: [String; 3],
    on_front: bool,
    /// A remark, if there is one.
    note: Option<String>,
}

impl Line<'_> {
    fn of(setting: &TimedSetting) -> Line<'_> {
        let errors = setting.errors;
        Line {
            name: &setting.name,
            changes: setting.changes.join(" "),
            ms: human(setting.ms.median),
            spread: format!("{} – {}", human(setting.ms.p5), human(setting.ms.p95)),
            errors: [errors.nmse, errors.flip, errors.max].map(human),
            on_front: setting.on_front,
            note: (setting.list_frames > 1).then(|| {
                format!("the list of visible tiles is complete only after {} frames", setting.list_frames)
            }),
        }
    }
}

impl Trade {
    /// Writes `index.html`, `trade.svg` and `trade.json` into an existing folder; the page starts with
    /// `answer`.
    ///
    /// # Errors
    /// I/O errors.
    pub fn write(&self, folder: &Path, answer: &str) -> anyhow::Result<()> {
        let drawn = self.draw();
        let put = |name: &str, text: String| write_bytes(&folder.join(name), &text);
        if let Some(drawn) = &drawn {
            put("trade.svg", plot::file(drawn))?;
        }
        put("trade.json", self.json())?;
        Ok(put("index.html", html(self, drawn.as_deref(), answer)?)?)
    }

    fn draw(&self) -> Option<String> {
        let chart = Chart {
            title: format!("{}, {} x {}: time and error", self.scene, self.size[0], self.size[1]),
            below: format!(
                "median of {} to {}, p5 to p95 · {}",
                self.runs, self.max_runs, self.machine.device
            ),
            quantity: self.measure.clone(),
            unit: String::new(),
            log: true,
        };
        let spot = |setting: &TimedSetting| Spot {
            name: setting.name.clone(),
            tooltip: format!("{}, {} {:.2e}", setting.name, self.measure, setting.error),
            time: Point { y: setting.ms.median, low: setting.ms.p5, high: setting.ms.p95 },
            error: setting.error,
            on_front: setting.on_front,
        };
        let others = self.settings.iter().filter(|setting| !setting.on_front);
        let spots: Vec<Spot> = self.front().into_iter().chain(others).map(spot).collect();
        scatter::draw(&chart, "settled frame, ms (logarithmic)", &spots)
    }
}

/// # Errors
/// Only for a wrong template.
fn html(trade: &Trade, svg: Option<&str>, answer: &str) -> anyhow::Result<String> {
    let mut all: Vec<&TimedSetting> = trade.settings.iter().collect();
    all.sort_by(|a, b| a.ms.median.total_cmp(&b.ms.median));
    let page = TradePage {
        style: STYLES.concat(),
        version: env!("CARGO_PKG_VERSION"),
        trade,
        software: trade.machine.is_software(),
        drift: trade.drift_ms.map(human),
        svg,
        answer,
        front: trade.front().into_iter().map(Line::of).collect(),
        all: all.into_iter().map(Line::of).collect(),
        budgets: trade.budgets.iter().map(Budget::of).collect(),
    };
    filled("trade.html", TEMPLATE, page)
}
