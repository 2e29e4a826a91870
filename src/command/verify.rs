//! `ortelius verify`: checks every byte of a `.tiles` file.

use super::{progress::ProgressLine, say};
use anyhow::Result;
use clap::Args;
use ortelius::texture::tiles::{TileFile, verify};
use std::path::PathBuf;
use thiserror::Error;

/// Checks every byte of a .tiles file against its checksums and lists all damage.
#[derive(Args, Debug)]
pub struct TilesVerifyArgs {
    /// The file to check
    #[arg(value_name = "FILE.tiles")]
    file: PathBuf,
}

/// The file opens, but some records are damaged: exit code 3.
#[derive(Debug, Error)]
#[error("{path}: {bad} of {records} records are damaged; bake the file again", path = path.display())]
pub struct Damaged {
    path: PathBuf,
    bad: usize,
    records: u64,
}

/// Runs the subcommand: one line on stdout for each bad record. A failure carries [`Damaged`] or a
/// [`ortelius::texture::tiles::TileFileError`].
pub fn run(args: &TilesVerifyArgs) -> Result<()> {
    let bar = ProgressLine::of_bytes();
    let total_bytes = TileFile::open(&args.file)?.layout().total_bytes();
    bar.phase("checking", Some(total_bytes));
    let report = verify(&args.file, &|bytes| bar.advance(bytes));
    drop(bar);
    let report = report?;
    for bad in &report.bad {
        say(bad)?;
    }
    let records = report.layout.entry_count();
    if !report.bad.is_empty() {
        return Err(Damaged { path: args.file.clone(), bad: report.bad.len(), records }.into());
    }
    say(format_args!("{}: {records} records, {total_bytes} bytes, all intact", args.file.display()))
}
