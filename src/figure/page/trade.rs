//! The page of `ortelius trade`.

use super::super::words::human;
use super::super::{Budgeted, Trade, Traded};
use super::{STYLES, filled};
use serde::Serialize;

const TEMPLATE: &str = include_str!("trade.html");

#[derive(Serialize)]
struct Page<'a> {
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

/// A budget for people.
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

/// A setting for people.
#[derive(Serialize)]
struct Line<'a> {
    name: &'a str,
    changes: String,
    ms: String,
    spread: String,
    errors: [String; 3],
    on_front: bool,
    /// What is to be known besides.
    note: Option<String>,
}

impl Line<'_> {
    fn of(setting: &Traded) -> Line<'_> {
        let errors = setting.errors;
        Line {
            name: &setting.name,
            changes: setting.changes.join(" "),
            ms: human(setting.ms.median),
            spread: format!("{} – {}", human(setting.ms.p5), human(setting.ms.p95)),
            errors: [errors.nmse, errors.flip, errors.max].map(human),
            on_front: setting.on_front,
            note: (setting.list_frames > 1)
                .then(|| format!("incomplete list: whole after {} frames", setting.list_frames)),
        }
    }
}

/// # Errors
/// None but a template that is wrong.
pub fn html(trade: &Trade, svg: Option<&str>, answer: &str) -> anyhow::Result<String> {
    let mut all: Vec<&Traded> = trade.settings.iter().collect();
    all.sort_by(|a, b| a.ms.median.total_cmp(&b.ms.median));
    let page = Page {
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
