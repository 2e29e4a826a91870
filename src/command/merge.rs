//! `ortelius merge`: joins the parts of a run into one report.

use super::outputs::check_folder;
use super::report::ReportArgs;
use anyhow::bail;
use clap::Args;
use ortelius::figure::{Figure, Store, choose, merge};
use ortelius::renderer::figures::FAMILIES;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct MergeArgs {
    /// Folders written by `reproduce`, with or without --partition
    #[arg(value_name = "DIR", required = true)]
    folders: Vec<PathBuf>,
    /// The report's folder, created if absent
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    report: ReportArgs,
}

pub fn run(args: &MergeArgs) -> anyhow::Result<()> {
    check_folder(&args.output)?;
    let report = args.report.check()?;
    let known = choose(&FAMILIES, &[]).expect("no name is unknown");
    let folders: Vec<&Path> = args.folders.iter().map(PathBuf::as_path).collect();
    let store = Store::at(&args.output);
    let _lock = args.output.join("cells").is_dir().then(|| store.lock()).transpose()?;
    let effort = merge(&folders, &args.output, &known)?;
    let cells = store.all(&known)?;
    let merged = |figure: &&'static Figure| cells.iter().any(|cell| cell.figure == figure.id);
    let figures: Vec<&Figure> = known.iter().copied().filter(merged).collect();
    let failed = report.report(&store, &figures, effort)?;
    tracing::info!("{} cells; the report is {}/index.html", cells.len(), args.output.display());
    failed.map_or(Ok(()), |failed| bail!(failed))
}
