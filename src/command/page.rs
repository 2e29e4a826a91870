//! `ortelius page`: writes the HTML page of stored results. The stored rows are judged again with this program's claims
//! and rules.

use super::outputs::check_place;
use anyhow::{Context, anyhow};
use clap::Args;
use ortelius::figure::{Changes, ClaimChange, Results, choose, page_of_results};
use ortelius::file::{MAX_RESULTS_BYTES, read_text};
use ortelius::picture::write::write_bytes;
use ortelius::renderer::figures::FAMILIES;
use std::path::PathBuf;

#[derive(Args)]
pub struct PageArgs {
    /// A report's results.json, or a file of results/
    #[arg(value_name = "RESULTS.json")]
    results: PathBuf,
    /// The page to write; default: beside the results
    #[arg(short, long, value_name = "PAGE.html")]
    output: Option<PathBuf>,
    /// Also write the results with the page's claims and verdicts
    #[arg(long, value_name = "RESULTS.json")]
    json: Option<PathBuf>,
}

pub fn run(args: &PageArgs) -> anyhow::Result<()> {
    let shown = || args.results.display().to_string();
    let output = check_place(&args.output.clone().unwrap_or_else(|| args.results.with_extension("html")))?;
    let text = read_text(&args.results, MAX_RESULTS_BYTES).with_context(shown)?;
    let stored = Results::parse(&text).with_context(shown)?;
    let known = choose(&FAMILIES, &[]).expect("no name is unknown");
    let judged = stored.judged_again(&known);
    if let Some(json) = &args.json {
        let judged = judged.as_ref().ok_or_else(|| {
            anyhow!("--json: the file's format lacks the times of single rounds, which verdicts need; measure the figures \
                 again")
        });
        let text = judged.with_context(shown)?.text();
        write_bytes(&check_place(json)?, &text)?;
    }
    if judged.is_none() {
        tracing::warn!(
            "{}: the verdicts follow the rules of an earlier version: the file lacks the times of single rounds",
            shown()
        );
    }
    let changes = judged.as_ref().map(|judged| Changes::between(&stored, judged).claims);
    for ClaimChange { figure, claim, before, after, .. } in changes.iter().flatten() {
        tracing::info!("{figure} {claim}: {before} -> {after}");
    }
    let results = judged.unwrap_or(stored);
    let (page, gone) = page_of_results(&results, &known)?;
    for id in gone {
        tracing::warn!("{}: this program has no figure {id}; the page leaves it out", shown());
    }
    write_bytes(&output, &page)?;
    tracing::info!("the page is {}", output.display());
    Ok(())
}
