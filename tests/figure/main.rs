//! Figures: runs that are killed, shared and merged, failing cells, verdicts and the page. The figures are made up, so
//! the tests need no device and little time; the last module checks the real figures.

mod against;
mod browser;
mod claims;
mod committed;
mod family;
mod listed;
mod outputs;
mod runs;

use ortelius::figure::{
    Cell, CellResult, Effort, Figure, FigureRun, Machine, Partition, Results, RunError, RunProgress, Store,
    Tally, write_outputs,
};
use std::path::Path;
use tempfile::TempDir;

/// The machine of all runs here.
fn machine() -> Machine {
    Machine {
        device: "made-up device".into(),
        device_kind: "cpu".into(),
        driver: "made-up 1.0".into(),
        vulkan: "1.3.0".into(),
        processor: "made-up processor".into(),
        cores: 2,
        commit: "0123456789abcdef".into(),
        date: "2026-11-21".into(),
    }
}

struct Silent;

impl RunProgress for Silent {
    fn begins(&self, _: &str, _: &Cell, _: usize, _: usize) {}
    fn ended(&self, _: &CellResult) {}
    fn skipped(&self, _: &CellResult) {}
}

fn a_run<'a>(figures: &'a [&'static Figure], folder: &'a Path) -> FigureRun<'a> {
    FigureRun {
        figures,
        folder,
        effort: Effort::Quick,
        device: None,
        machine: machine(),
        validate: false,
        partition: Partition::WHOLE,
        resume: false,
        program: "build 1".into(),
        from: 0,
    }
}

fn run(run: &FigureRun) -> Result<Tally, RunError> {
    run.run(run.figures, &Silent)
}

/// Writes the report of the results of `figures` in `folder`.
fn report(figures: &[&'static Figure], folder: &Path) -> Results {
    let store = Store::at(folder);
    let cells = store.all(figures).unwrap();
    let results = Results::gather(figures, Effort::Quick, &cells);
    write_outputs(&store, figures, &results, &cells, &["ortelius".to_string()], None).unwrap();
    results
}

/// A complete run and its report.
fn reported(figures: &[&'static Figure], folder: &Path) -> Results {
    run(&a_run(figures, folder)).unwrap();
    report(figures, folder)
}

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}
