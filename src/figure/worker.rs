//! Cells are measured in a child process, so that a driver crash does not end the run. The child records the cell that
//! it measures. If the child dies, that cell has crashed, and a new child continues with the next cell. A run with
//! `--resume` does not measure a crashed cell again until the cell's file is removed.

use super::{CellOutcome, CellResult, Store, StoreError};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::ExitStatus;
use thiserror::Error;

/// Errors while supervising a worker.
#[derive(Debug, Error)]
pub enum WorkerError {
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error("the measuring process cannot be started: {0}")]
    Start(std::io::Error),
}

/// SIGHUP, SIGINT, SIGQUIT and SIGTERM: the user ends the run.
const ASKED: [i32; 4] = [1, 2, 3, 15];

/// SIGKILL. Only the out-of-memory killer sends it to the child alone.
const KILLED: i32 = 9;

/// Runs `worker`, which measures into `folder` starting at a cell ([`super::FigureRun::from`]), until it ends by
/// itself or by a signal of the user. After each crash, `report` receives the cell and the next worker starts
/// with the next cell. Returns the exit status of the last worker.
///
/// # Errors
/// Errors of the folder; a worker that cannot be started.
pub fn outlive(
    folder: &Path,
    mut worker: impl FnMut(usize) -> std::io::Result<ExitStatus>,
    report: impl Fn(&CellResult),
) -> Result<ExitStatus, WorkerError> {
    let store = Store::at(folder);
    // Discards the record of an earlier run that was killed.
    store.end()?;
    let mut from = 0;
    loop {
        let status = worker(from).map_err(WorkerError::Start)?;
        if status.success() || status.signal().is_some_and(|signal| ASKED.contains(&signal)) {
            return Ok(status);
        }
        // A worker that ends by itself has no cell under way.
        let Some((number, result)) = store.under_way()? else { return Ok(status) };
        assert!(number >= from, "a worker from cell {from} on was at {number}");
        let crashed = CellResult { outcome: CellOutcome::Crashed(how(status)), ..result };
        store.put(&crashed)?;
        store.end()?;
        report(&crashed);
        from = number + 1;
    }
}

fn how(status: ExitStatus) -> String {
    match status.signal() {
        Some(KILLED) => format!("the process was killed, probably by the out-of-memory killer ({status})"),
        _ => format!("the driver crashed ({status})"),
    }
}
