//! The sub-commands, one file each.

pub mod bake;
pub mod compare;
pub mod demo;
mod device;
pub mod doctor;
pub mod fetch;
pub mod keys;
pub mod list;
pub mod merge;
pub mod mesh;
mod outputs;
pub mod render;
mod report;
pub mod reproduce;
pub mod trade;
pub mod verify;

use std::io::Write;

/// A line of data on stdout. A reader that wants no more (`| head`) is no error.
///
/// # Errors
/// What else can be wrong with stdout: a full disk.
pub fn say(line: impl std::fmt::Display) -> anyhow::Result<()> {
    match writeln!(std::io::stdout(), "{line}") {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(anyhow::Error::new(error).context("stdout: cannot write"))
        }
        _ => Ok(()),
    }
}

/// The command line says something that cannot be: exit code 2.
#[derive(Debug)]
pub struct Usage(pub String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}
