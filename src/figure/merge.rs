//! Merges parts of a run, measured on one or several machines.

use super::{CellOutcome, CellResult, Effort, Figure, Store, StoreError};
use std::path::Path;
use thiserror::Error;

/// Folders that cannot be merged.
#[derive(Debug, Error)]
pub enum MergeError {
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error("{folder} holds no results; name folders written by `ortelius reproduce`")]
    Empty { folder: String },
    #[error("{one} and {other} cannot be merged: their {what} differs ({theirs}, {ours})")]
    Mixed { one: String, other: String, what: &'static str, theirs: String, ours: String },
    #[error(
        "{figure} {cell} was measured in {one} and in {other}, with different outcomes; remove one of the two files"
    )]
    Twice { figure: String, cell: String, one: String, other: String },
    #[error("{file}: the picture cannot be copied: {source}")]
    Picture { file: String, source: std::io::Error },
}

/// Copies the results of `figures` from `sources` into `out` and returns their common effort. `out` is created if
/// absent; results that it already holds count as one more source. Machines may differ; effort and commit may not. A
/// measured cell replaces a cell that failed in another folder.
///
/// # Errors
/// [`MergeError`]; nothing is copied if the folders cannot be merged.
pub fn merge(sources: &[&Path], out: &Path, figures: &[&Figure]) -> Result<Effort, MergeError> {
    let mut merged: Vec<(&Path, CellResult)> = Vec::new();
    let earlier = Store::at(out).all(figures)?;
    merged.extend(earlier.into_iter().map(|result| (out, result)));
    for &folder in sources.iter().filter(|folder| **folder != out) {
        let results = Store::at(folder).all(figures)?;
        if results.is_empty() {
            return Err(MergeError::Empty { folder: folder.display().to_string() });
        }
        for result in results {
            add(&mut merged, folder, result)?;
        }
    }
    let effort = merged.first().map(|(_, result)| result.effort);
    let effort = effort.ok_or_else(|| MergeError::Empty { folder: out.display().to_string() })?;
    let store = Store::create(out)?;
    for (folder, result) in merged.iter().filter(|(folder, _)| *folder != out) {
        // Pictures are copied first, so that a stored cell has all of its pictures.
        for picture in &result.pictures {
            let from = Store::at(folder).pictures().join(picture);
            std::fs::copy(&from, store.pictures().join(picture))
                .map_err(|source| MergeError::Picture { file: from.display().to_string(), source })?;
        }
        store.put(result)?;
    }
    Ok(effort)
}

fn add<'a>(
    merged: &mut Vec<(&'a Path, CellResult)>,
    folder: &'a Path,
    result: CellResult,
) -> Result<(), MergeError> {
    if let Some((other, first)) = merged.first() {
        let effort = |effort: Effort| effort.name().to_string();
        let mixed = [
            ("effort", effort(result.effort), effort(first.effort)),
            ("commit", result.machine.commit.clone(), first.machine.commit.clone()),
        ];
        if let Some((what, theirs, ours)) = mixed.into_iter().find(|(_, theirs, ours)| theirs != ours) {
            let (one, other) = (folder.display().to_string(), other.display().to_string());
            return Err(MergeError::Mixed { one, other, what, theirs, ours });
        }
    }
    let same = |known: &CellResult| known.figure == result.figure && known.cell == result.cell;
    let failed = |result: &CellResult| !matches!(result.outcome, CellOutcome::Rows(_));
    match merged.iter_mut().find(|(_, known)| same(known)) {
        None => merged.push((folder, result)),
        Some(place) if failed(&place.1) => *place = (folder, result),
        // Compared as text, so that a result with a NaN equals its own copy.
        Some((_, known)) if failed(&result) || format!("{known:?}") == format!("{result:?}") => {}
        Some((other, _)) => {
            return Err(MergeError::Twice {
                figure: result.figure,
                cell: result.cell.to_string(),
                one: other.display().to_string(),
                other: folder.display().to_string(),
            });
        }
    }
    Ok(())
}
