//! Measures cells, one after the other, and keeps each as soon as it is there.

use super::{Bench, Cell, CellResult, Effort, Figure, Machine, Outcome, Store, StoreError};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::Instant;
use thiserror::Error;

/// One machine's share of the cells: every `of`-th, beginning with number `index` (from 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Partition {
    pub index: usize,
    pub of: usize,
}

/// What to measure, and where it goes.
pub struct Run<'a> {
    pub figures: &'a [&'static Figure],
    pub folder: &'a Path,
    pub effort: Effort,
    /// Part of a device's name, or its index.
    pub device: Option<String>,
    /// The device's and this machine's description.
    pub machine: Machine,
    /// With Vulkan's validation layer; a message of it fails the cell.
    pub validate: bool,
    pub partition: Partition,
    /// Keep what the folder has already.
    pub resume: bool,
    /// The build that runs ([`super::program`]).
    pub program: String,
    /// The first cell to measure, from 0: what comes before is an earlier worker's ([`super::outlive`]).
    pub from: usize,
}

/// Told what the run does.
pub trait Progress {
    /// `number` of `count` cells is measured next.
    fn begins(&self, figure: &str, cell: &Cell, number: usize, count: usize);
    fn ended(&self, result: &CellResult);
    /// A cell in which an earlier run died: not tried again.
    fn skipped(&self, result: &CellResult);
}

/// What became of a run's cells.
#[derive(Debug, Default)]
pub struct Tally {
    pub measured: usize,
    /// Kept from an earlier run.
    pub kept: usize,
    pub failures: Vec<Failure>,
}

/// A cell that failed.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    pub figure: String,
    pub cell: Cell,
    pub error: String,
}

/// What stops a run; a cell that fails does not.
#[derive(Debug, Error)]
pub enum RunError {
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(
        "{folder} holds results of another {what} ({theirs}; this run: {ours}); name another folder with -o, or remove {folder}/cells"
    )]
    Mixed { folder: String, what: &'static str, theirs: String, ours: String },
}

impl Partition {
    pub const WHOLE: Partition = Partition { index: 1, of: 1 };
}

impl Run<'_> {
    /// The cells of this run's share, in order.
    pub fn cells(&self) -> Vec<(&'static Figure, Cell)> {
        let of_figure = |figure: &&'static Figure| {
            let figure = *figure;
            figure.cells(self.effort).into_iter().map(move |cell| (figure, cell))
        };
        let all = self.figures.iter().flat_map(of_figure);
        all.skip(self.partition.index - 1).step_by(self.partition.of).collect()
    }

    /// Measures what is to be measured. `known`: every figure whose results the folder may hold.
    ///
    /// # Errors
    /// The folder's, and results in it that belong to another device, effort, commit or build.
    pub fn run(&self, known: &[&Figure], progress: &dyn Progress) -> Result<Tally, RunError> {
        let store = Store::create(self.folder)?;
        for stored in store.all(known)? {
            self.check(&stored)?;
        }
        let cells = self.cells();
        let mut tally = Tally::default();
        for (number, (figure, cell)) in cells.iter().enumerate() {
            let kept = self.resume || number < self.from;
            let stored = if kept { store.get(figure.id, cell)? } else { None };
            let result = match stored {
                Some(stored) if number < self.from => stored,
                Some(stored) if !matches!(stored.outcome, Outcome::Failed(_)) => {
                    if matches!(stored.outcome, Outcome::Crashed(_)) {
                        progress.skipped(&stored);
                    }
                    tally.kept += 1;
                    continue;
                }
                _ => {
                    progress.begins(figure.id, cell, number + 1, cells.len());
                    store.begin(number, &self.result(figure, cell))?;
                    let result = self.measure(figure, cell, &store);
                    store.end()?;
                    store.put(&result)?;
                    progress.ended(&result);
                    result
                }
            };
            tally.measured += 1;
            if let Outcome::Failed(error) | Outcome::Crashed(error) = result.outcome {
                tally.failures.push(Failure { figure: figure.id.to_string(), cell: cell.clone(), error });
            }
        }
        Ok(tally)
    }

    /// A cell's result before it is measured.
    fn result(&self, figure: &Figure, cell: &Cell) -> CellResult {
        CellResult {
            figure: figure.id.to_string(),
            cell: cell.clone(),
            effort: self.effort,
            machine: self.machine.clone(),
            program: self.program.clone(),
            seconds: 0.0,
            pictures: Vec::new(),
            outcome: Outcome::Absent,
        }
    }

    fn measure(&self, figure: &'static Figure, cell: &Cell, store: &Store) -> CellResult {
        let mut bench = Bench::new(self.effort, self.device.clone(), store.pictures());
        bench.validate = self.validate;
        let start = Instant::now();
        // A bug in one figure must not cost the hours that the others take.
        let measured = catch_unwind(AssertUnwindSafe(|| (figure.measure)(&mut bench, cell)));
        let measured = measured.unwrap_or_else(|panic| {
            let words = panic.downcast_ref::<String>().map(String::as_str);
            let words = words.or_else(|| panic.downcast_ref::<&str>().copied());
            Err(anyhow::anyhow!("a bug of this program: {}", words.unwrap_or("a panic without words")))
        });
        let seconds = start.elapsed().as_secs_f64();
        let measured = measured.and_then(|rows| match bench.messages().first() {
            None => Ok(rows),
            Some(first) => Err(anyhow::anyhow!(
                "Vulkan's validation layer had {} messages, first {}: {}",
                bench.messages().len(),
                first.id,
                first.text
            )),
        });
        let (pictures, outcome) = (bench.written, Outcome::of(measured));
        CellResult { seconds, pictures, outcome, ..self.result(figure, cell) }
    }

    /// Whether a stored result may stand beside this run's.
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
