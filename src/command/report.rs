//! The end of `reproduce` and `merge`: the report, the verdicts on stdout, and the exit status.

use super::outputs::check_place;
use super::{Usage, say};
use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use ortelius::figure::{Changes, Effort, Figure, Results, Store, Verdict, write_outputs};
use ortelius::file::{MAX_RESULTS_BYTES, read_text};
use ortelius::picture::write::write_bytes;
use std::path::PathBuf;

#[derive(Args)]
pub struct ReportArgs {
    /// List changes from stored results (a report's results.json)
    #[arg(long, value_name = "RESULTS.json")]
    against: Option<PathBuf>,
    /// Exit with code 1 if a claim has one of these verdicts. `changed`: another verdict than in --against.
    /// `not-reproduced` includes "does not hold here"
    #[arg(long, value_name = "WHAT", value_delimiter = ',')]
    fail_on: Vec<FailOn>,
    /// Also write the verdicts as JUnit XML
    #[arg(long, value_name = "FILE.xml")]
    junit: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum FailOn {
    Changed,
    NotReproduced,
    NotMeasured,
}

/// Hidden option that `reproduce` gives to its child process, followed by the first cell to measure. The option and the
/// number are the last arguments, so that reports can leave them out.
pub const WORKER: &str = "--worker";

/// Limit of printed changes; the page lists all.
const MAX_CHANGES: usize = 20;

/// Inputs of a report, checked before anything is measured.
pub struct Checked<'a> {
    args: &'a ReportArgs,
    against: Option<Results>,
}

impl ReportArgs {
    /// # Errors
    /// A file of `--against` that cannot be read or holds no results; incompatible options.
    pub fn check(&self) -> anyhow::Result<Checked<'_>> {
        if self.fail_on.contains(&FailOn::Changed) && self.against.is_none() {
            bail!(Usage("--fail-on changed needs --against RESULTS.json".into()));
        }
        self.junit.as_deref().map(check_place).transpose()?;
        let read = |path: &PathBuf| -> anyhow::Result<Results> {
            Ok(Results::parse(&read_text(path, MAX_RESULTS_BYTES)?)?)
        };
        let context = |path: &PathBuf| read(path).with_context(|| format!("--against {}", path.display()));
        Ok(Checked { args: self, against: self.against.as_ref().map(context).transpose()? })
    }
}

impl Checked<'_> {
    /// Writes the report of `figures` from `store`, prints a line for each claim, and the count of each verdict.
    /// Returns the message of `--fail-on`, if it applies.
    ///
    /// # Errors
    /// I/O errors.
    pub fn report(
        &self,
        store: &Store,
        figures: &[&'static Figure],
        effort: Effort,
    ) -> anyhow::Result<Option<String>> {
        let cells = store.all(figures)?;
        let results = Results::gather(figures, effort, &cells);
        let changes = self.against.as_ref().map(|before| Changes::between(before, &results));
        let text = |text: std::ffi::OsString| text.to_string_lossy().into_owned();
        let given = std::env::args_os().take_while(|argument| argument != WORKER);
        let command: Vec<String> = given.map(text).collect();
        write_outputs(store, figures, &results, &cells, &command, changes.as_ref())?;
        if let Some(path) = &self.args.junit {
            write_bytes(path, results.junit())?;
        }
        for (figure, claim) in results.claims() {
            let finding = &claim.finding;
            let name = format!("{} {}", figure.id, claim.id);
            say(format_args!("{name:32} {:30} {}", finding.verdict.name(), finding.numbers))?;
        }
        changes.iter().flat_map(|changes| changes.lines(MAX_CHANGES)).try_for_each(say)?;
        let counts = results.counts().map(|(verdict, count)| format!("{count} {}", verdict.name()));
        say(format_args!("{} claims: {}", results.claims().count(), counts.collect::<Vec<_>>().join(", ")))?;
        Ok(self.failed(&results, changes.as_ref()))
    }

    fn failed(&self, results: &Results, changes: Option<&Changes>) -> Option<String> {
        let of = |verdicts: &[Verdict]| -> Vec<String> {
            let those = results.claims().filter(|(_, claim)| verdicts.contains(&claim.finding.verdict));
            those.map(|(figure, claim)| format!("{} {}", figure.id, claim.id)).collect()
        };
        let found = |what: &FailOn| {
            let (words, claims) = match what {
                FailOn::NotReproduced => ("not reproduced", of(&[Verdict::NotReproduced, Verdict::NotHere])),
                FailOn::NotMeasured => ("not measured", of(&[Verdict::NotMeasured])),
                FailOn::Changed => {
                    let changed = changes.iter().flat_map(|changes| &changes.claims);
                    ("with another verdict", changed.map(|c| format!("{} {}", c.figure, c.claim)).collect())
                }
            };
            let first = claims.first()?;
            Some(format!("{} claims {words}, first {first}", claims.len()))
        };
        let failed: Vec<String> = self.args.fail_on.iter().filter_map(found).collect();
        (!failed.is_empty()).then(|| format!("--fail-on: {}", failed.join("; ")))
    }
}
