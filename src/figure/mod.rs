//! A figure: a question, a measurement, and the claims to judge by the numbers. Independent of any paper.
//!
//! A figure is one const. Each of its scenes, at each value of its sweep, is a [`Cell`]. A run resumes at cells, and
//! several machines divide the cells among them. [`Figure::measure`] measures all variants of a cell and returns
//! [`Row`]s. The runs of the variants are interleaved ([`Bench::interleave`]), so drift affects all of them equally.
//! `list`, `reproduce`, `merge`, the tests and the report iterate the same list.

mod against;
mod bench;
mod choose;
pub mod claim;
mod csv;
mod json;
mod judge;
mod junit;
mod machine;
mod merge;
mod page;
mod plot;
pub mod prelude;
mod renamed;
mod results;
mod run;
mod same;
mod show;
mod store;
mod table;
mod trade;
mod words;
mod worker;
mod write;

pub use against::{Changes, ClaimChange, ValueChange};
pub use bench::{Bench, Contender, Timed};
pub use choose::{Family, UnknownFigure, choose};
pub use claim::{Claim, Origin};
pub use machine::{load, peak_memory, program};
pub use merge::{MergeError, merge};
pub use page::of_results as page_of_results;
pub use results::{CellRows, ClaimResult, FigureResult, Results, ResultsError};
pub use run::{Failure, FigureRun, Partition, RunError, RunProgress, Tally};
pub use same::{Choices, Same};
pub use show::{FigureView, Setting, Show, Views};
pub use store::{CellOutcome, CellResult, LeftOut, Lock, Store, StoreError};
pub use table::{Machine, Row, Table, TableRecord, Value};
pub use trade::{Budgeted, Errors, Refused, TimedSetting, Trade};
pub use worker::outlive;
pub use write::write_outputs;

use claim::Places;
use serde::{Deserialize, Serialize};

/// One figure or table of a report.
pub struct Figure {
    /// Family and name: `vt.dedup`.
    pub id: &'static str,
    pub title: &'static str,
    /// The question, and the paper's answer in words and numbers, with the section of the paper.
    pub about: &'static str,
    /// Views by name, resolved by [`Figure::measure`]: `earth/oblique`.
    pub scenes: &'static [&'static str],
    /// Names of all variants, in the order of legends and tables.
    pub variants: fn() -> Vec<String>,
    /// The paper's own variants. The page highlights them.
    pub paper: &'static [&'static str],
    /// This project's recommended variants. The page highlights them too.
    pub ours: &'static [&'static str],
    /// Scenes that are too large for quick runs.
    pub full_only: &'static [&'static str],
    pub sweep: Option<Sweep>,
    /// What the window shows for this figure.
    pub show: Show,
    /// Measures one cell, all variants interleaved. Rows may come in any order.
    pub measure: fn(&mut Bench, &Cell) -> anyhow::Result<Vec<Row>>,
    pub plots: &'static [Plot],
    pub claims: &'static [Claim],
}

/// The quantity along a figure's horizontal axis.
#[derive(Clone, Copy)]
pub struct Sweep {
    /// The name of the quantity with its unit: "picture height, pixels".
    pub name: &'static str,
    pub quick: &'static [f64],
    pub full: &'static [f64],
}

/// How long a run may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Effort {
    /// Most pictures have at most 720 rows of pixels. Most times are measured in 12 runs, some in 6.
    Quick,
    /// Most times are measured in at least 30 runs, some in 6.
    Full,
}

/// A unit of work.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    pub scene: String,
    /// The sweep's value; `None` without a sweep.
    pub x: Option<f64>,
}

/// A plot of a figure's rows. A plot is drawn for each scene.
pub struct Plot {
    /// The quantity on the vertical axis.
    pub quantity: &'static str,
    pub x: Axis,
    pub log_x: bool,
    pub log_y: bool,
    /// A variant drawn as a horizontal line: the physical limit, or the paper's number.
    pub floor: Option<&'static str>,
    /// For curves of one point each: the family of a variant. A family has one colour and one form of marks.
    pub families: Option<fn(&str) -> &'static str>,
}

/// What a plot's horizontal axis shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// The sweep, with a line for each variant.
    Sweep,
    /// No axis: a bar for each variant.
    Variant,
    /// The first number of each point of a [`Value::Series`] or [`Value::Spreads`], with its name and unit;
    /// a line for each variant.
    Series(&'static str),
}

/// The verdict on a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    Reproduced,
    /// In every place, the numbers are beyond the stated range, on its better side.
    BetterThanStated,
    /// The claim holds in some places and fails in other places.
    InPart,
    NotReproduced,
    /// Verdicts on a claim about time on a software device. They correspond to [`Verdict::Reproduced`] or better,
    /// [`Verdict::InPart`] and [`Verdict::NotReproduced`].
    HoldsHere,
    InPartHere,
    NotHere,
    /// A confidence interval contains the bound.
    Undecided,
    /// The device lacks a feature that the measurement needs.
    NotMeasurable,
    /// Some of the claim's cells are missing, failed, or crashed the driver.
    NotMeasured,
}

/// A claim's verdict with its numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    pub verdict: Verdict,
    /// Our numbers, with units.
    pub numbers: String,
    /// The reason: the bound that was met or missed, or why the claim was not measured.
    pub why: String,
}

impl Plot {
    const fn of(quantity: &'static str, x: Axis) -> Plot {
        Plot { quantity, x, log_x: false, log_y: false, floor: None, families: None }
    }

    /// A bar for each variant.
    pub const fn bars(quantity: &'static str) -> Plot {
        Plot::of(quantity, Axis::Variant)
    }

    /// Lines along the sweep.
    pub const fn sweep(quantity: &'static str) -> Plot {
        Plot::of(quantity, Axis::Sweep)
    }

    /// A series of each variant; `x` names the first number of its points, with the unit.
    pub const fn curves(quantity: &'static str, x: &'static str) -> Plot {
        Plot::of(quantity, Axis::Series(x))
    }

    pub const fn log_x(self) -> Plot {
        Plot { log_x: true, ..self }
    }

    pub const fn log_y(self) -> Plot {
        Plot { log_y: true, ..self }
    }

    pub const fn floor(self, variant: &'static str) -> Plot {
        Plot { floor: Some(variant), ..self }
    }

    pub const fn families(self, family: fn(&str) -> &'static str) -> Plot {
        Plot { families: Some(family), ..self }
    }
}

impl Figure {
    /// Defaults for the fields that a figure does not set.
    pub const BASE: Figure = Figure {
        id: "",
        title: "",
        about: "",
        scenes: &[],
        variants: Vec::new,
        paper: &[],
        ours: &[],
        full_only: &[],
        sweep: None,
        show: Show::scenes(&[]),
        measure: |_, _| Ok(Vec::new()),
        plots: &[],
        claims: &[],
    };

    /// The CSS class of a variant, with a leading space: one for the paper's own variants, one for ours. Empty for all
    /// other variants.
    fn highlight(&self, variant: &str) -> &'static str {
        match (self.paper.contains(&variant), self.ours.contains(&variant)) {
            (true, _) => " cited",
            (_, true) => " ours",
            _ => "",
        }
    }

    /// The sweep's values for `effort`; one `None` without a sweep.
    pub fn values(&self, effort: Effort) -> Vec<Option<f64>> {
        match (&self.sweep, effort) {
            (None, _) => vec![None],
            (Some(sweep), Effort::Quick) => sweep.quick.iter().copied().map(Some).collect(),
            (Some(sweep), Effort::Full) => sweep.full.iter().copied().map(Some).collect(),
        }
    }

    /// The units of work, in order.
    pub fn cells(&self, effort: Effort) -> Vec<Cell> {
        let values = self.values(effort);
        let of_scene = |scene: &&str| {
            let scene = scene.to_string();
            values.iter().map(move |&x| Cell { scene: scene.clone(), x }).collect::<Vec<_>>()
        };
        let included = |scene: &&&str| effort == Effort::Full || !self.full_only.contains(scene);
        self.scenes.iter().filter(included).flat_map(of_scene).collect()
    }

    /// Text: what a quick run omits. [`Figure::about`] may name more omissions.
    pub fn quick_leaves_out(&self) -> String {
        let mut left_out = vec!["three fifths of the runs of each timed pass".to_string()];
        if let Some(Sweep { name, quick, full }) = &self.sweep {
            let values: Vec<String> =
                full.iter().filter(|x| !quick.contains(x)).map(ToString::to_string).collect();
            left_out.extend((!values.is_empty()).then(|| format!("{name}: {}", values.join(", "))));
        }
        left_out.extend(self.full_only.iter().map(|scene| format!("scene {scene}")));
        left_out.join(", and ")
    }

    /// The scenes of `places` that have cells only in a full run.
    fn only_in_full_runs(&self, places: &Places) -> Vec<&'static str> {
        let has = |effort, scene: &str| {
            self.cells(effort).iter().any(|cell| cell.scene == scene && places.hold(scene, cell.x))
        };
        let only_full = |scene: &&str| has(Effort::Full, scene) && !has(Effort::Quick, scene);
        self.scenes.iter().copied().filter(only_full).collect()
    }
}

/// "earth/oblique" or "earth/oblique at 3".
impl std::fmt::Display for Cell {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.x {
            Some(x) => write!(f, "{} at {x}", self.scene),
            None => f.write_str(&self.scene),
        }
    }
}

impl Effort {
    pub fn name(self) -> &'static str {
        match self {
            Effort::Quick => "quick",
            Effort::Full => "full",
        }
    }
}

impl Verdict {
    /// All verdicts, in the order in which their counts are shown.
    pub const ALL: [Verdict; 10] = [
        Verdict::Reproduced,
        Verdict::BetterThanStated,
        Verdict::InPart,
        Verdict::NotReproduced,
        Verdict::HoldsHere,
        Verdict::InPartHere,
        Verdict::NotHere,
        Verdict::Undecided,
        Verdict::NotMeasurable,
        Verdict::NotMeasured,
    ];

    /// The name of the verdict as shown to users.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Reproduced => "reproduced",
            Verdict::BetterThanStated => "better than stated",
            Verdict::InPart => "in part",
            Verdict::NotReproduced => "not reproduced",
            Verdict::HoldsHere => "holds here",
            Verdict::InPartHere => "holds here in part",
            Verdict::NotHere => "does not hold here",
            Verdict::Undecided => "undecided (noise)",
            Verdict::NotMeasurable => "not measurable on this device",
            Verdict::NotMeasured => "not measured",
        }
    }

    /// The verdict of a claim about time on a software device: the times of such a device do not predict the times of a
    /// GPU.
    fn here(self) -> Verdict {
        match self {
            Verdict::Reproduced | Verdict::BetterThanStated => Verdict::HoldsHere,
            Verdict::InPart => Verdict::InPartHere,
            Verdict::NotReproduced => Verdict::NotHere,
            other => other,
        }
    }
}

impl Finding {
    pub fn new(verdict: Verdict, numbers: impl Into<String>, why: impl Into<String>) -> Finding {
        Finding { verdict, numbers: numbers.into(), why: why.into() }
    }
}
