//! The command line.

mod command;

use clap::{Parser, Subcommand};
use command::doctor::Unwell;
use command::mesh::Unsound;
use command::verify::Damaged;
use command::{
    Usage, bake, compare, demo, doctor, fetch, keys, list, merge, mesh, render, reproduce, trade, verify,
};
use ortelius::paper::progressive_mesh::file::PmeshError;
use ortelius::paper::progressive_mesh::load::LoadError;
use ortelius::paper::virtual_texture::config::TextureError;
use ortelius::renderer::RenderError;
use ortelius::scene::SceneError;
use ortelius::texture::bake::BakeError;
use ortelius::texture::tiles::TileFileError;
use ortelius::vk;
use std::io::{IsTerminal, Write};
use std::process::ExitCode;

/// Super-large textures, progressive meshes and texture mapping: three papers rebuilt on Vulkan and measured.
///
/// Exit codes: 0 done, 1 error, 2 usage or no driver, 3 data corrupt, 4 device lost.
#[derive(Parser)]
#[command(version, max_term_width = 100)]
struct CommandLine {
    /// More words on stderr (twice: all)
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    verbose: u8,
    /// Errors only
    #[arg(short, long, global = true)]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render the paper's headline picture and measure three of its figures into out/ (made if absent)
    Demo(demo::DemoArgs),
    /// Render a scene
    Render(Box<render::RenderArgs>),
    /// All figures, with what they claim
    List(list::ListArgs),
    /// Measure figures on this machine, with a verdict for each claim
    Reproduce(reproduce::ReproduceArgs),
    /// Find the cheapest setting of a scene for an error, or the most accurate for a time
    Trade(Box<trade::TradeArgs>),
    /// Join the parts of a run into one report
    Merge(merge::MergeArgs),
    /// Cut a picture into a tile pyramid (.tiles)
    Bake(bake::BakeArgs),
    /// Check every byte of a tile pyramid
    Verify(verify::VerifyArgs),
    /// Fetch larger models than those that are shipped, by npm
    Fetch(fetch::FetchArgs),
    /// Build, describe, export and check progressive meshes (.pmesh)
    Mesh(mesh::MeshArgs),
    /// Measure how far one picture is from another
    Compare(compare::CompareArgs),
    /// List the keys of scene files
    Keys(keys::KeysArgs),
    /// What there is of Vulkan here, and whether it works
    Doctor(doctor::DoctorArgs),
}

fn main() -> ExitCode {
    let line = CommandLine::parse();
    let level = match (line.quiet, line.verbose) {
        (true, _) => tracing::Level::ERROR,
        (false, 0) => tracing::Level::INFO,
        (false, 1) => tracing::Level::DEBUG,
        (false, _) => tracing::Level::TRACE,
    };
    // stdout is for data.
    let colours = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    tracing_subscriber::fmt()
        .with_max_level(level)
        .with_writer(std::io::stderr)
        .with_ansi(colours)
        // It would tell of a full stderr on stderr, and panic.
        .log_internal_errors(false)
        .without_time()
        .with_target(false)
        .init();
    let done = match &line.command {
        Command::Demo(args) => demo::run(args),
        Command::Render(args) => render::run(args),
        Command::List(args) => list::run(args, line.verbose > 0),
        Command::Reproduce(args) => reproduce::run(args, &std::env::args_os().skip(1).collect::<Vec<_>>()),
        Command::Trade(args) => trade::run(args),
        Command::Merge(args) => merge::run(args),
        Command::Bake(args) => bake::run(args),
        Command::Verify(args) => verify::run(args),
        Command::Fetch(args) => fetch::run(args),
        Command::Mesh(args) => mesh::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Keys(args) => keys::run(args),
        Command::Doctor(args) => doctor::run(args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Where stderr is closed or full nobody can be told but by the exit code.
            let _told = writeln!(std::io::stderr(), "ortelius: {}", one_line(&error));
            ExitCode::from(exit_code(&error))
        }
    }
}

/// An error with its causes; many of ours name their cause themselves, and no word is to be said twice.
fn one_line(error: &anyhow::Error) -> String {
    error.chain().skip(1).fold(error.to_string(), |line, cause| match cause.to_string() {
        cause if line.contains(&cause) => line,
        cause => format!("{line}: {cause}"),
    })
}

/// The first cause that has a code of its own decides.
fn exit_code(error: &anyhow::Error) -> u8 {
    error.chain().find_map(code_of).unwrap_or(1)
}

fn code_of(cause: &(dyn std::error::Error + 'static)) -> Option<u8> {
    let vulkan = cause.downcast_ref::<vk::Error>().map(vk::Error::exit_code);
    let render = || match cause.downcast_ref::<RenderError>()? {
        RenderError::Scene(error) | RenderError::Load(LoadError::Scene(error)) => scene_code(error),
        error => error.exit_code(),
    };
    let texture = || match cause.downcast_ref::<TextureError>()? {
        TextureError::Scene(error) => scene_code(error),
        error => error.exit_code(),
    };
    let tiles = || cause.downcast_ref::<TileFileError>().map(TileFileError::exit_code);
    let bake = || cause.downcast_ref::<BakeError>().map(BakeError::exit_code);
    let unwell = || cause.downcast_ref::<Unwell>().map(|unwell| unwell.exit_code);
    let scene = || cause.downcast_ref::<SceneError>().and_then(scene_code);
    let pmesh = || cause.downcast_ref::<PmeshError>().map(PmeshError::exit_code);
    let damaged = || (cause.is::<Damaged>() || cause.is::<Unsound>()).then_some(3);
    vulkan
        .or_else(render)
        .or_else(texture)
        .or_else(tiles)
        .or_else(bake)
        .or_else(pmesh)
        .or_else(damaged)
        .or_else(scene)
        .or_else(unwell)
        .or(cause.is::<Usage>().then_some(2))
}

/// What the command line names and is not there is usage; what is wrong in a file is an error.
fn scene_code(error: &SceneError) -> Option<u8> {
    match error {
        SceneError::Read { .. } | SceneError::Write(_) | SceneError::Content { .. } => None,
        SceneError::Unknown { .. }
        | SceneError::Override { .. }
        | SceneError::Camera { .. }
        | SceneError::Path { .. } => Some(2),
    }
}
