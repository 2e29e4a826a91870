//! Cells are measured in a child process: a driver that crashes takes the child along and not the hours that the other
//! cells take. The child notes which cell it measures; where it dies, that cell has crashed, and another child goes on
//! with the next. A cell that crashed is not tried again, by no `--resume` either, until its file is removed.

use super::{CellResult, Outcome, Store, StoreError};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::ExitStatus;
use thiserror::Error;

/// What keeps a worker from being watched.
#[derive(Debug, Error)]
pub enum WorkerError {
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error("the process that measures cannot be started: {0}")]
    Start(std::io::Error),
}

/// SIGHUP, SIGINT, SIGQUIT and SIGTERM: somebody wants it to end.
const ASKED: [i32; 4] = [1, 2, 3, 15];

/// SIGKILL, which nobody sends to a child alone but a system without memory.
const KILLED: i32 = 9;

/// Runs `worker`, which measures into `folder` from a cell on ([`super::Run::from`]), until it ends by itself or is asked
/// to; after each crash `told` is given the cell, and the next worker begins behind it. How the last one ended.
///
/// # Errors
/// The folder's, and a worker that cannot be started.
pub fn outlive(
    folder: &Path,
    mut worker: impl FnMut(usize) -> std::io::Result<ExitStatus>,
    told: impl Fn(&CellResult),
) -> Result<ExitStatus, WorkerError> {
    let store = Store::at(folder);
    // What an earlier run was at when it was killed.
    store.end()?;
    let mut from = 0;
    loop {
        let status = worker(from).map_err(WorkerError::Start)?;
        if status.success() || status.signal().is_some_and(|signal| ASKED.contains(&signal)) {
            return Ok(status);
        }
        // A worker that ends by itself, for whatever reason, has no cell under way.
        let Some((number, result)) = store.under_way()? else { return Ok(status) };
        assert!(number >= from, "a worker from cell {from} on was at {number}");
        let crashed = CellResult { outcome: Outcome::Crashed(how(status)), ..result };
        store.put(&crashed)?;
        store.end()?;
        told(&crashed);
        from = number + 1;
    }
}

fn how(status: ExitStatus) -> String {
    match status.signal() {
        Some(KILLED) => format!("the process was killed, as a rule for want of memory ({status})"),
        _ => format!("the driver crashed ({status})"),
    }
}
