//! Measures cells one by one and stores each result at once.

use super::{Bench, Cell, CellOutcome, CellResult, Effort, Figure, Machine, Store, StoreError};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::Instant;
use thiserror::Error;

/// One machine's share of the cells: every `of`-th cell, starting with number `index` (from 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Partition {
    pub index: usize,
    pub of: usize,
}

/// What to measure and where to store it.
pub struct FigureRun<'a> {
    pub figures: &'a [&'static Figure],
    pub folder: &'a Path,
    pub effort: Effort,
    /// Part of a device's name, or its index.
    pub device: Option<String>,
    /// Description of the device and this machine.
    pub machine: Machine,
    /// Opens devices with the validation layer; a validation message fails the cell.
    pub validate: bool,
    pub partition: Partition,
    /// Keeps results that are already in the folder, except failed and left-out cells.
    pub resume: bool,
    /// The running build ([`super::program`]).
    pub program: String,
    /// The first cell to measure, from 0; earlier cells belong to an earlier worker ([`super::outlive`]).
    pub from: usize,
}

/// Receives the progress of a run.
pub trait RunProgress {
    /// Cell `number` of `count` starts.
    fn begins(&self, figure: &str, cell: &Cell, number: usize, count: usize);
    fn ended(&self, result: &CellResult);
    /// An earlier run crashed in a cell, so this cell is not measured again.
    fn skipped(&self, result: &CellResult);
}

/// Outcome counts of a run's cells.
#[derive(Debug, Default)]
pub struct Tally {
    pub measured: usize,
    /// Kept from an earlier run.
    pub kept: usize,
    /// Cells that this run leaves out, with the reason.
    pub left_out: Vec<String>,
    pub failures: Vec<Failure>,
}

/// A cell that failed.
#[derive(Debug)]
pub struct Failure {
    pub figure: String,
    pub cell: Cell,
    pub error: String,
    /// The error, if this process measured the cell.
    pub cause: Option<anyhow::Error>,
}

/// Errors that stop a run; a failed cell does not.
#[derive(Debug, Error)]
pub enum RunError {
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(
        "{folder} holds results of another {what} ({theirs}; this run: {ours}); name another folder with -o, or remove {folder}/cells"
    )]
    Mixed { folder: String, what: &'static str, theirs: String, ours: String },
}

impl Tally {
    /// Counts a cell of this run; `cause` as [`Failure::cause`].
    fn add(&mut self, result: CellResult, cause: Option<anyhow::Error>) {
        let CellResult { figure, cell, outcome, .. } = result;
        if let CellOutcome::LeftOut(why) = outcome {
            self.left_out.push(format!("{figure} {cell}: {why}"));
            return;
        }
        self.measured += 1;
        if let CellOutcome::Failed(error) | CellOutcome::Crashed(error) = outcome {
            self.failures.push(Failure { figure, cell, error, cause });
        }
    }
}

impl Partition {
    pub const WHOLE: Partition = Partition { index: 1, of: 1 };
}

impl FigureRun<'_> {
    /// The cells of this run's share, in order.
    pub fn cells(&self) -> Vec<(&'static Figure, Cell)> {
        let of_figure = |figure: &&'static Figure| {
            let figure = *figure;
            figure.cells(self.effort).into_iter().map(move |cell| (figure, cell))
        };
        let all = self.figures.iter().flat_map(of_figure);
        all.skip(self.partition.index - 1).step_by(self.partition.of).collect()
    }

    /// Measures the cells that are not kept. `known`: every figure whose results the folder may contain.
    ///
    /// # Errors
    /// Errors of the folder; results in the folder from another device, effort, commit or build.
    pub fn run(&self, known: &[&Figure], progress: &dyn RunProgress) -> Result<Tally, RunError> {
        let store = Store::create(self.folder)?;
        for stored in store.all(known)? {
            self.check(&stored)?;
        }
        let cells = self.cells();
        let mut tally = Tally::default();
        for (number, (figure, cell)) in cells.iter().enumerate() {
            let kept = self.resume || number < self.from;
            let stored = if kept { store.get(figure.id, cell)? } else { None };
            let (result, cause) = match stored {
                Some(stored) if number < self.from => (stored, None),
                Some(stored)
                    if !matches!(stored.outcome, CellOutcome::Failed(_) | CellOutcome::LeftOut(_)) =>
                {
                    if matches!(stored.outcome, CellOutcome::Crashed(_)) {
                        progress.skipped(&stored);
                    }
                    tally.kept += 1;
                    continue;
                }
                _ => {
                    progress.begins(figure.id, cell, number + 1, cells.len());
                    store.begin(number, &self.result(figure, cell))?;
                    let measured = self.measure(figure, cell, &store);
                    store.end()?;
                    store.put(&measured.0)?;
                    progress.ended(&measured.0);
                    measured
                }
            };
            tally.add(result, cause);
        }
        Ok(tally)
    }

    /// A cell's result without its outcome.
    fn result(&self, figure: &Figure, cell: &Cell) -> CellResult {
        CellResult {
            figure: figure.id.to_string(),
            cell: cell.clone(),
            effort: self.effort,
            machine: self.machine.clone(),
            program: self.program.clone(),
            seconds: 0.0,
            pictures: Vec::new(),
            outcome: CellOutcome::Absent,
        }
    }

    fn measure(
        &self,
        figure: &'static Figure,
        cell: &Cell,
        store: &Store,
    ) -> (CellResult, Option<anyhow::Error>) {
        let mut bench = Bench::new(self.effort, self.device.clone(), store.pictures());
        bench.validate = self.validate;
        let start = Instant::now();
        // A bug in one figure must not lose the hours of measurement of the other figures.
        let measured = catch_unwind(AssertUnwindSafe(|| (figure.measure)(&mut bench, cell)));
        let measured = measured.unwrap_or_else(|panic| {
            let words = panic.downcast_ref::<String>().map(String::as_str);
            let words = words.or_else(|| panic.downcast_ref::<&str>().copied());
            Err(anyhow::anyhow!("a bug of this program: {}", words.unwrap_or("a panic without a message")))
        });
        let seconds = start.elapsed().as_secs_f64();
        let measured = measured.and_then(|rows| match bench.messages().first() {
            None => Ok(rows),
            Some(first) => Err(anyhow::anyhow!(
                "the Vulkan validation layer reported {} messages; first: {}: {}",
                bench.messages().len(),
                first.id,
                first.text
            )),
        });
        let (outcome, cause) = CellOutcome::of(measured);
        let result = CellResult { seconds, pictures: bench.written, outcome, ..self.result(figure, cell) };
        (result, cause)
    }

    /// Checks that a stored result may be combined with the results of this run.
    fn check(&self, stored: &CellResult) -> Result<(), RunError> {
        let device =
            |m: &Machine| format!("{}, {}, on {}, {} cores", m.device, m.driver, m.processor, m.cores);
        let (theirs, ours) = (&stored.machine, &self.machine);
        let mixed = [
            ("effort", stored.effort.name().to_string(), self.effort.name().to_string()),
            ("commit", theirs.commit.clone(), ours.commit.clone()),
            ("build of the program", stored.program.clone(), self.program.clone()),
            ("device", device(theirs), device(ours)),
        ];
        match mixed.into_iter().find(|(_, theirs, ours)| theirs != ours) {
            None => Ok(()),
            Some((what, theirs, ours)) => {
                Err(RunError::Mixed { folder: self.folder.display().to_string(), what, theirs, ours })
            }
        }
    }
}
