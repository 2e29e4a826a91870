//! `ortelius page`: writes the HTML page of stored results.

use super::outputs::check_place;
use anyhow::Context;
use clap::Args;
use ortelius::figure::{Results, choose, page_of_results};
use ortelius::file::{MOST_RESULTS_BYTES, read_text};
use ortelius::picture::write::write_whole;
use ortelius::renderer::figures::FAMILIES;
use std::io::Write as _;
use std::path::PathBuf;

#[derive(Args)]
pub struct PageArgs {
    /// A report's results.json, or a file of results/
    #[arg(value_name = "RESULTS.json")]
    results: PathBuf,
    /// The page; default: beside the results
    #[arg(short, long, value_name = "PAGE.html")]
    output: Option<PathBuf>,
}

pub fn run(args: &PageArgs) -> anyhow::Result<()> {
    let shown = || args.results.display().to_string();
    let output = check_place(&args.output.clone().unwrap_or_else(|| args.results.with_extension("html")))?;
    let text = read_text(&args.results, MOST_RESULTS_BYTES).with_context(shown)?;
    let results = Results::parse(&text).with_context(shown)?;
    let known = choose(&FAMILIES, &[]).expect("no name is unknown");
    let (page, gone) = page_of_results(&results, &known)?;
    for id in gone {
        tracing::warn!("{}: this program has no figure {id}; the page leaves it out", shown());
    }
    write_whole(&output, |file| file.write_all(page.as_bytes()))?;
    tracing::info!("the page is {}", output.display());
    Ok(())
}
