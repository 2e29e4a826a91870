//! The subcommands, one file each.

pub mod bake;
pub mod compare;
pub mod demo;
mod device;
pub mod doctor;
pub mod exit;
mod explain;
pub mod fetch;
pub mod interrupt;
pub mod keys;
pub mod list;
pub mod manual;
pub mod merge;
pub mod mesh;
mod outputs;
pub mod page;
pub mod progress;
mod records;
pub mod render;
mod report;
pub mod reproduce;
mod request;
pub mod trade;
pub mod verify;
#[cfg(feature = "window")]
pub mod view;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use ortelius::scene::Choice;
use std::io::Write;

/// Writes a line of data to stdout. A closed pipe (`| head`) is not an error.
///
/// # Errors
/// Any other failure of stdout, for example a full disk.
pub fn say(line: impl std::fmt::Display) -> anyhow::Result<()> {
    match writeln!(std::io::stdout(), "{line}") {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(anyhow::Error::new(error).context("stdout: cannot write"))
        }
        _ => Ok(()),
    }
}

/// An invalid command line: exit code 2.
#[derive(Debug)]
pub struct Usage(pub String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// Parses a choice by its name.
fn named<T: Choice + Send + Sync>(allowed: fn(T) -> bool) -> impl TypedValueParser<Value = T> {
    let value = |choice: T| PossibleValue::new(choice.name()).help(choice.about());
    let names = T::ALL.iter().copied().filter(move |choice| allowed(*choice)).map(value);
    let find = |name: String| T::ALL.iter().copied().find(|choice| choice.name() == name);
    PossibleValuesParser::new(names).try_map(move |name| find(name).ok_or("no choice has this name"))
}

/// Parses a finite number that is not negative.
fn bound(expected: &'static str) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| match text.parse() {
        Ok(bound) if (0.0..f64::INFINITY).contains(&bound) => Ok(bound),
        _ => Err(format!("expected {expected}")),
    }
}
