//! The command line.

mod command;

use clap::{Parser, Subcommand};
use command::verify::Damaged;
use ortelius::scene::bake::BakeError;
use ortelius::scene::tiles::TileFileError;
use std::process::ExitCode;

#[derive(Parser)]
#[command(name = "ortelius", version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Bake(command::bake::BakeArgs),
    Verify(command::verify::VerifyArgs),
}

fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::Bake(args) => command::bake::run(&args),
        Command::Verify(args) => command::verify::run(&args),
    };
    let Err(error) = result else {
        return ExitCode::SUCCESS;
    };
    // Not the chain: each error says its cause itself.
    eprintln!("error: {error}");
    let code = if let Some(error) = error.downcast_ref::<BakeError>() {
        error.exit_code()
    } else if let Some(error) = error.downcast_ref::<TileFileError>() {
        error.exit_code()
    } else if error.is::<Damaged>() {
        3
    } else {
        1
    };
    ExitCode::from(code)
}
