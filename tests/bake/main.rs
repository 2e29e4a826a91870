//! `ortelius bake` from the command line.

mod content;
mod faults;
mod pictures;
mod png_by_hand;
mod refused;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn ortelius() -> Command {
    Command::new(env!("CARGO_BIN_EXE_ortelius"))
}

fn bake_command(source: &Path, output: &Path, more: &[&str]) -> Command {
    let mut command = ortelius();
    command.arg("bake").arg(source).arg("-o").arg(output).args(more);
    command
}

fn bake(source: &Path, output: &Path, more: &[&str]) -> Output {
    bake_command(source, output, more).output().unwrap()
}

/// Bakes and returns the file's bytes; checks that no other file is left beside it.
fn baked(source: &Path, output: &Path, more: &[&str]) -> Vec<u8> {
    let ran = bake(source, output, more);
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    assert_eq!(leftovers(output), Vec::<String>::new());
    fs::read(output).unwrap()
}

/// The working files of a bake that exist.
fn leftovers(output: &Path) -> Vec<String> {
    let names = [".partial", ".scratch", ".journal"];
    names.iter().filter(|suffix| beside(output, suffix).exists()).map(ToString::to_string).collect()
}

fn beside(output: &Path, suffix: &str) -> PathBuf {
    let mut name = output.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

/// A failed run: its exit code and its only line.
fn failure(ran: &Output) -> (i32, String) {
    let line = String::from_utf8(ran.stderr.clone()).unwrap();
    assert_eq!(line.trim_end().lines().count(), 1, "not one line: {line}");
    (ran.status.code().unwrap(), line)
}

/// The first number in the line of a dry run that begins with `start`.
fn stated(dry: &Output, start: &str) -> u64 {
    let text = String::from_utf8(dry.stdout.clone()).unwrap();
    let line = text.lines().find(|line| line.starts_with(start)).unwrap();
    line.split_whitespace().find_map(|word| word.parse().ok()).unwrap()
}
