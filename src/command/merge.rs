//! `ortelius merge`: parts of a run become one report.

use super::outputs::check_folder;
use super::report::{report, stored};
use clap::Args;
use ortelius::figure::{Figure, Store, choose, merge};
use ortelius::paper::FAMILIES;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct MergeArgs {
    /// Folders that `reproduce` has written, with --partition or without
    #[arg(value_name = "DIR", required = true)]
    folders: Vec<PathBuf>,
    /// The report's folder, made if absent
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Show what changed against stored results (a report's results.json)
    #[arg(long, value_name = "RESULTS.json")]
    against: Option<PathBuf>,
}

pub fn run(args: &MergeArgs) -> anyhow::Result<()> {
    check_folder(&args.output)?;
    let against = stored(args.against.as_deref())?;
    let known = choose(&FAMILIES, &[]).expect("no name is unknown");
    let folders: Vec<&Path> = args.folders.iter().map(PathBuf::as_path).collect();
    let effort = merge(&folders, &args.output, &known)?;
    let store = Store::at(&args.output);
    let cells = store.all(&known)?;
    let merged = |figure: &&'static Figure| cells.iter().any(|cell| cell.figure == figure.id);
    let figures: Vec<&Figure> = known.iter().copied().filter(merged).collect();
    report(&store, &figures, effort, against.as_ref())?;
    tracing::info!("{} cells; the report is {}/index.html", cells.len(), args.output.display());
    Ok(())
}
