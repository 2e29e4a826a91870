//! `ortelius completions` and `ortelius man`: shell completions and man pages, generated from the command line's
//! definition.

use super::{Usage, say};
use anyhow::{Result, bail};
use clap::{Args, Command};
use clap_complete::Shell;

#[derive(Args)]
pub struct CompletionsArgs {
    /// The shell
    shell: Shell,
}

#[derive(Args)]
pub struct ManArgs {
    /// The subcommand, for example `mesh build`; default: the program itself
    #[arg(value_name = "SUBCOMMAND")]
    subcommand: Vec<String>,
}

/// # Errors
/// Errors of stdout.
pub fn completions(args: &CompletionsArgs, mut program: Command) -> Result<()> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut program, "ortelius", &mut text);
    say(String::from_utf8(text)?.trim_end())
}

/// # Errors
/// [`Usage`] for an unknown subcommand; errors of stdout.
pub fn man(args: &ManArgs, mut program: Command) -> Result<()> {
    // Sets the full names of subcommands.
    program.build();
    let mut found = &program;
    for name in &args.subcommand {
        let Some(next) = found.find_subcommand(name) else {
            let there: Vec<&str> = found.get_subcommands().map(Command::get_name).collect();
            bail!(Usage(format!("man: no subcommand {name:?}; available: {}", there.join(", "))));
        };
        found = next;
    }
    let mut text = Vec::new();
    clap_mangen::Man::new(found.clone()).render(&mut text)?;
    say(String::from_utf8(text)?.trim_end())
}
