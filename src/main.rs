//! The command line.

#![forbid(unsafe_code)]

mod command;
#[cfg(feature = "window")]
mod view;

use clap::{CommandFactory, Parser, Subcommand};
use command::progress::keep_meshes;
use command::{
    bake, compare, demo, doctor, exit, fetch, interrupt, keys, list, manual, merge, mesh, page, render,
    reproduce, trade, verify,
};
use ortelius::vk::failure_at_the_end;
use std::io::{IsTerminal, Write};
use std::process::ExitCode;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::prelude::*;

/// Three papers about super-large textures, progressive meshes and texture mapping, rebuilt on Vulkan and measured.
///
/// Exit codes: 0 done, 1 error, 2 usage or no driver, 3 data corrupt, 4 device lost.
#[derive(Parser)]
#[command(version, max_term_width = 100)]
struct CommandLine {
    /// Print more messages on stderr (twice: all)
    #[arg(short, long, global = true, action = clap::ArgAction::Count, display_order = 900)]
    verbose: u8,
    /// Print only errors
    #[arg(short, long, global = true, display_order = 901)]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Measure three figures and render three pictures into out/ (created if absent)
    Demo(demo::DemoArgs),
    /// Render a scene
    Render(Box<render::RenderArgs>),
    /// Show a scene, or all views of a figure, in a window: fly, compare variants, change every setting
    #[cfg(feature = "window")]
    View(Box<command::view::ViewArgs>),
    /// List all figures; with -v also their claims
    List(list::ListArgs),
    /// Measure figures on this machine, with a verdict for each claim
    Reproduce(reproduce::ReproduceArgs),
    /// Find a scene's fastest setting for a given error, or its most accurate one for a given time
    Trade(Box<trade::TradeArgs>),
    /// Merge the parts of a run into one report
    Merge(merge::MergeArgs),
    /// Write the HTML page of stored results
    Page(page::PageArgs),
    /// Cut a picture into a tile pyramid (.tiles)
    ///
    /// To resume an interrupted bake, run the same command again. Until the bake is done, OUT.partial, OUT.scratch and
    /// OUT.journal lie beside OUT.
    Bake(bake::BakeArgs),
    /// Check every byte of a tile pyramid
    Verify(verify::TilesVerifyArgs),
    /// Fetch larger models than the shipped ones, with npm
    Fetch(fetch::FetchArgs),
    /// Build, describe, export and check progressive meshes (.pmesh)
    Mesh(mesh::MeshArgs),
    /// Measure the difference between two pictures
    ///
    /// All measures except FLIP use linear light. Alpha is ignored; the number of pixels with different alpha is
    /// printed. Red, green and blue are compared as stored. In an EXR they are usually premultiplied by alpha, in a PNG
    /// never.
    Compare(compare::CompareArgs),
    /// List the keys of scene files
    Keys(keys::KeysArgs),
    /// Show the Vulkan installation and test it
    Doctor(doctor::DoctorArgs),
    /// Print the completions of a shell: `ortelius completions bash > FILE`, then `source FILE`
    Completions(manual::CompletionsArgs),
    /// Print a man page: `ortelius man mesh build | man -l -`
    Man(manual::ManArgs),
}

impl Command {
    /// The message after Ctrl-C. `None` for commands that write nothing, and for `reproduce` and `demo` (which calls
    /// `reproduce`): `reproduce` stops its worker and prints its own message.
    fn advice(&self) -> Option<&'static str> {
        match self {
            Command::Bake(_) => Some(
                "run the same command to resume; OUT.partial, OUT.scratch and OUT.journal hold the finished work",
            ),
            Command::Render(_)
            | Command::Trade(_)
            | Command::Merge(_)
            | Command::Page(_)
            | Command::Compare(_)
            | Command::Fetch(_)
            | Command::Mesh(_) => Some("no half-written file is left; finished files stay"),
            #[cfg(feature = "window")]
            Command::View(_) => Some("no half-written file is left; finished files stay"),
            _ => None,
        }
    }
}

fn main() -> ExitCode {
    let line = CommandLine::parse();
    let level = match (line.quiet, line.verbose) {
        (true, _) => tracing::Level::ERROR,
        (false, 0) => tracing::Level::INFO,
        (false, 1) => tracing::Level::DEBUG,
        (false, _) => tracing::Level::TRACE,
    };
    // stdout is for data only.
    let colours = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    // Warnings of winit and its libraries about the display do not help the user.
    let levels = Targets::new()
        .with_default(level)
        .with_target("winit", tracing::Level::ERROR)
        .with_target("xkbcommon_dl", tracing::Level::ERROR);
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(colours)
        // Otherwise tracing would report a full stderr on stderr, and panic.
        .log_internal_errors(false)
        .without_time()
        .with_target(false);
    tracing_subscriber::registry().with(lines.with_filter(levels)).init();
    let watched = line.command.advice().map_or(Ok(()), |advice| interrupt::watch(Some(advice)));
    let closed = |()| failure_at_the_end().map_or(Ok(()), |error| Err(error.into()));
    let done = watched.and_then(|()| run(&line)).and_then(closed);
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // stderr may be closed or full; then the exit code is the only report.
            let _ignored = writeln!(std::io::stderr(), "ortelius: {}", printable(&one_line(&error)));
            ExitCode::from(exit::exit_code(&error))
        }
    }
}

fn run(line: &CommandLine) -> anyhow::Result<()> {
    // `reproduce` must build its meshes itself, because it measures what this program builds.
    if !matches!(line.command, Command::Reproduce(_)) {
        keep_meshes();
    }
    match &line.command {
        Command::Demo(args) => demo::run(args),
        Command::Render(args) => render::run(args),
        #[cfg(feature = "window")]
        Command::View(args) => command::view::run(args),
        Command::List(args) => list::run(args, line.verbose > 0),
        Command::Reproduce(args) => reproduce::run(args, &std::env::args_os().skip(1).collect::<Vec<_>>()),
        Command::Trade(args) => trade::run(args),
        Command::Merge(args) => merge::run(args),
        Command::Page(args) => page::run(args),
        Command::Bake(args) => bake::run(args),
        Command::Verify(args) => verify::run(args),
        Command::Fetch(args) => fetch::run(args),
        Command::Mesh(args) => mesh::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Keys(args) => keys::run(args),
        Command::Doctor(args) => doctor::run(args),
        Command::Completions(args) => manual::completions(args, CommandLine::command()),
        Command::Man(args) => manual::man(args, CommandLine::command()),
    }
}

/// Escapes control characters, because names of files and keys may contain terminal escape sequences.
fn printable(text: &str) -> String {
    let escaped = |c: char| match c {
        '\n' | '\t' => c.to_string(),
        c if c.is_control() => c.escape_default().to_string(),
        c => c.to_string(),
    };
    text.chars().map(escaped).collect()
}

/// An error with its causes on one line. Many errors already include their cause, so text is not repeated.
fn one_line(error: &anyhow::Error) -> String {
    error.chain().skip(1).fold(error.to_string(), |line, cause| match cause.to_string() {
        cause if line.contains(&cause) => line,
        cause => format!("{line}: {cause}"),
    })
}
