//! Parts of a run, measured on one machine or on several, put together.

use super::{CellResult, Effort, Figure, Outcome, Store, StoreError};
use std::path::Path;
use thiserror::Error;

/// Folders that do not go together.
#[derive(Debug, Error)]
pub enum MergeError {
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error("{folder} holds no result; name folders that `ortelius reproduce` has written")]
    Empty { folder: String },
    #[error("{one} is of {what} {theirs}, {other} of {what} {ours}: they do not merge")]
    Mixed { one: String, other: String, what: &'static str, theirs: String, ours: String },
    #[error(
        "{figure} {cell} was measured in {one} and in {other}, with different outcomes; remove one of both files"
    )]
    Twice { figure: String, cell: String, one: String, other: String },
    #[error("{file}: the picture cannot be copied: {source}")]
    Picture { file: String, source: std::io::Error },
}

/// Copies the results of `figures` from `sources` into `out` (made if absent; what it holds counts as one of them), and
/// returns their common effort. Machines may differ, effort and commit may not. Of a cell that failed in one folder and
/// was measured in another the measurement is taken.
///
/// # Errors
/// [`MergeError`]; nothing is copied where the folders do not go together.
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
        // Pictures first: a cell that is there has all of its own.
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
    let failed = |result: &CellResult| matches!(result.outcome, Outcome::Failed(_) | Outcome::Crashed(_));
    match merged.iter_mut().find(|(_, known)| same(known)) {
        None => merged.push((folder, result)),
        Some(place) if failed(&place.1) => *place = (folder, result),
        // NaN equals nothing, and a copy of it is a copy: told apart as text.
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
