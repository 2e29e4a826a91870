//! The end of `reproduce` and `merge`: the report, and the verdicts on stdout.

use super::say;
use anyhow::Context;
use ortelius::figure::{Changes, Effort, Figure, Results, Store, write_outputs};
use std::path::Path;

/// Precedes the last argument of a `reproduce` that a `reproduce` started; the user did not give it.
pub const WORKER: &str = "--worker";

/// Most lines on stdout for changed values; the page lists all.
const MOST_CHANGES: usize = 20;

/// Stored results, for `--against`.
///
/// # Errors
/// The file cannot be read, or holds no results.
pub fn stored(path: Option<&Path>) -> anyhow::Result<Option<Results>> {
    let read = |path: &Path| -> anyhow::Result<Results> {
        let text = std::fs::read_to_string(path)?;
        Ok(Results::parse(&text)?)
    };
    path.map(|path| read(path).with_context(|| format!("--against {}", path.display()))).transpose()
}

/// Writes the report of `figures` as `store` has them, and prints a line for each claim.
///
/// # Errors
/// The disk's.
pub fn report(
    store: &Store,
    figures: &[&'static Figure],
    effort: Effort,
    against: Option<&Results>,
) -> anyhow::Result<()> {
    let cells = store.all(figures)?;
    let results = Results::gather(figures, effort, &cells);
    let changes = against.map(|before| Changes::between(before, &results));
    let text = |text: std::ffi::OsString| text.to_string_lossy().into_owned();
    let given = std::env::args_os().take_while(|argument| argument != WORKER);
    let command: Vec<String> = given.map(text).collect();
    write_outputs(store, figures, &results, &cells, &command, changes.as_ref())?;
    for (figure, claim) in results.claims() {
        let finding = &claim.finding;
        let name = format!("{} {}", figure.id, claim.id);
        say(format_args!("{name:32} {:30} {}", finding.verdict.name(), finding.numbers))?;
    }
    changes.iter().flat_map(|changes| changes.lines(MOST_CHANGES)).try_for_each(say)
}
