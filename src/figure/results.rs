//! The results of a run, figure by figure: the content of `results.json` and of the page.

use super::{
    Cell, CellOutcome, CellResult, Effort, Figure, Finding, Machine, Row, Table, TableRecord, Verdict, json,
    renamed,
};
use crate::header::{JsonFormat, WrongFormat};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// `results.json`. In format version 1, the key `version` held the program's version. Format version 3 added verdicts
/// and rounds, version 4 cells that were left out, version 5 new names of variants and quantities.
pub const FORMAT: JsonFormat =
    JsonFormat { name: "ortelius-results", version: 5, oldest: 1, first_name: Some("ortelius results 1") };

/// The first format version with the rounds that the judge needs.
const WITH_ROUNDS: u32 = 3;

/// The first format version with today's names.
const WITH_NAMES: u32 = 5;

/// Depth down to which the file is indented; a measured row is one line.
const LEVELS: usize = 6;

/// The results of one run, or of several merged runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// Version of the format from which these results were read.
    #[serde(skip)]
    pub format_version: u32,
    /// Version of the program that gathered these results; empty if the file does not state a version.
    #[serde(default)]
    pub program_version: String,
    pub effort: Effort,
    /// Machines that measured cells; usually one.
    pub machines: Vec<Machine>,
    pub figures: Vec<FigureResult>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FigureResult {
    pub id: String,
    pub title: String,
    pub claims: Vec<ClaimResult>,
    /// All cells of the figure in order, measured or not.
    pub cells: Vec<CellRows>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClaimResult {
    pub id: String,
    pub text: String,
    /// "paper, section 2.2", or "ours".
    pub from: String,
    #[serde(flatten)]
    pub finding: Finding,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellRows {
    #[serde(flatten)]
    pub cell: Cell,
    /// Index into [`Results::machines`]; `None` if not measured.
    pub machine: Option<usize>,
    pub pictures: Vec<String>,
    #[serde(flatten)]
    pub outcome: CellOutcome,
}

/// Text that cannot be read as results.
#[derive(Debug, Error)]
pub enum ResultsError {
    #[error("not results of `ortelius reproduce` (results.json): {0}")]
    Json(#[from] serde_json::Error),
    #[error("the file has {0}")]
    Format(WrongFormat),
}

impl Results {
    /// Reads the text of a `results.json`. Earlier versions get today's names of variants and quantities.
    ///
    /// # Errors
    /// [`ResultsError`].
    pub fn parse(text: &str) -> Result<Results, ResultsError> {
        /// In version 1 this field is the program's version, a string.
        #[derive(Deserialize)]
        struct First {
            version: Option<serde_json::Value>,
        }
        let version = FORMAT.check(text).map_err(|wrong| match wrong {
            WrongFormat::Json(error) => ResultsError::Json(error),
            wrong => ResultsError::Format(wrong),
        })?;
        let mut results: Results = serde_json::from_str(text)?;
        results.format_version = version;
        if version == 1 {
            let First { version } = serde_json::from_str(text)?;
            let version = version.as_ref().and_then(|version| version.as_str());
            results.program_version = version.unwrap_or_default().to_owned();
        }
        if version < WITH_NAMES {
            results.figures.iter_mut().for_each(FigureResult::renew);
        }
        Ok(results)
    }

    /// The text of a `results.json`.
    pub fn text(&self) -> String {
        json::text(&FORMAT.head(self), LEVELS)
    }

    /// Sorts the cells of `effort` into the figures and judges the claims of `figures`.
    pub fn gather(figures: &[&Figure], effort: Effort, cells: &[CellResult]) -> Results {
        let mut machines: Vec<Machine> = Vec::new();
        let figures = figures.iter().map(|figure| of_figure(figure, effort, cells, &mut machines)).collect();
        let program_version = env!("CARGO_PKG_VERSION").to_string();
        Results { format_version: FORMAT.version, program_version, effort, machines, figures }
    }

    /// These results with the texts and verdicts of today's claims; figures that are not in `known` keep their stored
    /// texts and verdicts. `None` if the rows have no rounds (format versions 1 and 2).
    pub fn judged_again(&self, known: &[&Figure]) -> Option<Results> {
        let again = |result: &FigureResult| {
            let Some(figure) = known.iter().find(|figure| figure.id == result.id) else {
                return result.clone();
            };
            let stored = |cell: Cell| match result.cells.iter().find(|stored| stored.cell == cell) {
                Some(stored) => stored.clone(),
                None => CellRows::absent(cell),
            };
            let cells: Vec<CellRows> = figure.cells(self.effort).into_iter().map(stored).collect();
            FigureResult::of((figure, self.effort), cells, &self.machines)
        };
        let figures = self.figures.iter().map(again).collect();
        self.has_rounds().then(|| Results { figures, ..self.clone() })
    }

    /// True if the file has the time of each round, which today's rules need for a verdict.
    pub fn has_rounds(&self) -> bool {
        self.format_version >= WITH_ROUNDS
    }

    /// The number of claims for each verdict that occurs.
    pub fn counts(&self) -> impl Iterator<Item = (Verdict, usize)> {
        let count = |verdict| self.claims().filter(|(_, claim)| claim.finding.verdict == verdict).count();
        Verdict::ALL.into_iter().map(move |verdict| (verdict, count(verdict))).filter(|(_, count)| *count > 0)
    }

    /// All claims in order, with their figures.
    pub fn claims(&self) -> impl Iterator<Item = (&FigureResult, &ClaimResult)> {
        self.figures.iter().flat_map(|figure| figure.claims.iter().map(move |claim| (figure, claim)))
    }
}

fn of_figure(
    figure: &Figure,
    effort: Effort,
    results: &[CellResult],
    machines: &mut Vec<Machine>,
) -> FigureResult {
    let mut rows_of = |cell: Cell| {
        let found = results.iter().find(|r| r.figure == figure.id && r.effort == effort && r.cell == cell);
        match found {
            None => CellRows::absent(cell),
            Some(result) => CellRows {
                cell,
                machine: Some(place_of(&result.machine, machines)),
                pictures: result.pictures.clone(),
                outcome: result.outcome.clone(),
            },
        }
    };
    let cells: Vec<CellRows> = figure.cells(effort).into_iter().map(&mut rows_of).collect();
    FigureResult::of((figure, effort), cells, machines)
}

impl CellRows {
    fn absent(cell: Cell) -> CellRows {
        CellRows { cell, machine: None, pictures: Vec::new(), outcome: CellOutcome::Absent }
    }
}

impl FigureResult {
    /// Gives the rows today's names.
    fn renew(&mut self) {
        for cell in &mut self.cells {
            if let CellOutcome::Rows(rows) = &mut cell.outcome {
                renamed::rename_old(&self.id, rows);
            }
        }
    }

    fn of(of: (&Figure, Effort), cells: Vec<CellRows>, machines: &[Machine]) -> FigureResult {
        let (claims, figure) = (judge(of, &cells, machines), of.0);
        FigureResult { id: figure.id.to_string(), title: figure.title.to_string(), claims, cells }
    }
}

/// A machine's index in the list. A new machine is added to the list. If the machine measured on another day too, the
/// dates of its entry are extended.
fn place_of(machine: &Machine, machines: &mut Vec<Machine>) -> usize {
    let dates = |date: &str| -> Vec<String> { date.split(" to ").map(String::from).collect() };
    if let Some(at) = machines.iter().position(|known| known.is_same(machine)) {
        let mut all = [dates(&machines[at].date), dates(&machine.date)].concat();
        all.sort();
        all.dedup();
        machines[at].date = match &all[..] {
            [first, .., last] => format!("{first} to {last}"),
            _ => all.concat(),
        };
        return at;
    }
    machines.push(machine.clone());
    machines.len() - 1
}

fn judge((figure, effort): (&Figure, Effort), cells: &[CellRows], machines: &[Machine]) -> Vec<ClaimResult> {
    let table = table(cells, machines);
    let not_in_quick = |claim: &super::Claim| match effort {
        Effort::Quick => figure.only_in_full_runs(&claim.places),
        Effort::Full => Vec::new(),
    };
    let result = |claim: &super::Claim| ClaimResult {
        id: claim.id.to_string(),
        text: claim.text.to_string(),
        from: claim.from.to_string(),
        finding: match &table {
            None => Finding::new(Verdict::NotMeasured, "", "no cell was measured"),
            Some(table) => noted(claim.judge(table), cells, &not_in_quick(claim)),
        },
    };
    figure.claims.iter().map(result).collect()
}

/// The rows for the claims; `None` if nothing was measured.
pub fn table(cells: &[CellRows], machines: &[Machine]) -> Option<Table> {
    let used = || cells.iter().filter_map(|cell| cell.machine.map(|at| &machines[at]));
    // If cells come from several machines and one is a software device, claims about time get the verdicts of a
    // software device.
    let machine = used().find(|machine| machine.is_software()).or_else(|| used().next())?.clone();
    let mut table = Table { machine, records: Vec::new(), lost: Vec::new() };
    for CellRows { cell, outcome, .. } in cells {
        let record = |row: &Row| TableRecord { scene: cell.scene.clone(), x: cell.x, row: row.clone() };
        let became = match outcome {
            CellOutcome::Rows(rows) => {
                table.records.extend(rows.iter().map(record));
                continue;
            }
            CellOutcome::LeftOut(why) => format!("left out ({why})"),
            CellOutcome::Failed(_) => "failed".into(),
            CellOutcome::Crashed(_) => "crashed the driver".into(),
            CellOutcome::Absent => "left out".into(),
        };
        table.lost.push((cell.clone(), became));
    }
    Some(table)
}

/// Adds up to two notes: one if a quick run leaves out some of the claim's scenes, and one if the cells come from
/// several machines.
fn noted(mut finding: Finding, cells: &[CellRows], not_in_quick: &[&str]) -> Finding {
    if !not_in_quick.is_empty() {
        finding.why += &format!(" (not in quick runs: {})", not_in_quick.join(", "));
    }
    let mut used: Vec<usize> = cells.iter().filter_map(|cell| cell.machine).collect();
    used.sort_unstable();
    used.dedup();
    if used.len() > 1 {
        finding.why +=
            &format!(" (cells of {} machines: times of different cells are not comparable)", used.len());
    }
    finding
}
