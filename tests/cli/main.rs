//! The program as a process: output, files and exit codes.

mod again;
mod auto;
mod compare;
mod doctor;
mod dumps;
mod example;
mod fetch;
mod figures;
mod interrupt;
mod keys;
mod mesh;
mod pictures;
mod program;
mod progress;
mod readers;
mod report;
mod tiles;
mod trade;
mod words;

use ortelius::picture::write::{Srgb8Picture, read_png};
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

/// The program, run in `folder` and never in the repository: it must not depend on the repository's files.
fn ortelius(folder: &TempDir, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ortelius"));
    // Validation is on in every test that draws; any message of the layer is an error.
    command.current_dir(folder).args(arguments).env("ORTELIUS_VALIDATE", "1");
    // Nothing is kept for other runs.
    command.env("ORTELIUS_CACHE", "");
    command
}

/// The program, with the name of its temporary file for `output` already linked to `target` (for example /dev/full, so
/// that writing fails). The name contains the process number, so a shell makes the link and then becomes the program.
fn ortelius_writing_to(target: &str, output: &str, folder: &TempDir, arguments: &[&str]) -> Command {
    let mut command = Command::new("sh");
    command.args(["-c", "ln -s \"$1\" \"$2.$$.partial\" && shift 2 && exec \"$@\"", "sh", target, output]);
    command
        .arg(env!("CARGO_BIN_EXE_ortelius"))
        .current_dir(folder)
        .args(arguments)
        .env("ORTELIUS_VALIDATE", "1")
        .env("ORTELIUS_CACHE", "");
    command
}

fn run(folder: &TempDir, arguments: &[&str]) -> Output {
    ortelius(folder, arguments).output().unwrap()
}

/// `ortelius render ARGUMENTS`, which must succeed; returns stderr.
fn rendered(folder: &TempDir, arguments: &[&str]) -> String {
    let ran = run(folder, &[&["render"], arguments].concat());
    let words = String::from_utf8(ran.stderr).unwrap();
    assert_eq!(ran.status.code(), Some(0), "{arguments:?}: {words}");
    words
}

/// A command that must fail with one line on stderr and nothing on stdout; returns the exit code and the line.
fn failure(command: &mut Command) -> (i32, String) {
    let ran = command.output().unwrap();
    let words = String::from_utf8(ran.stderr).unwrap();
    // Progress (device, frames) may precede the error, which is the last line and the only error.
    let lines: Vec<&str> = words.lines().filter(|line| !line.starts_with(" INFO ")).collect();
    assert_eq!(lines.len(), 1, "{command:?}: not one line: {words}");
    assert!(lines[0].starts_with("ortelius: "), "{words}");
    assert_eq!(String::from_utf8(ran.stdout).unwrap(), "", "{command:?}: stdout is for data");
    (ran.status.code().expect("an exit code, no signal"), lines[0].to_owned())
}

fn render_failure(folder: &TempDir, arguments: &[&str]) -> (i32, String) {
    failure(&mut ortelius(folder, &[&["render"], arguments].concat()))
}

/// Asserts that a line contains each of `words`.
fn holds(line: &str, words: &[&str]) {
    for word in words {
        assert!(line.contains(word), "no {word:?} in: {line}");
    }
}

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn names(folder: &TempDir) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn picture(path: &Path) -> Srgb8Picture {
    read_png(path).unwrap()
}

/// An earth of 2^11 x 2^10 texels in tiles of 128 (levels 0 ..= 3 are streamed), at 160 x 90 pixels, so that levels 0
/// to 2 are visible. `texture` holds more keys of the texture's table.
fn small_scene(texture: &str) -> String {
    format!(
        "[surface.land]\ngeometry = {{ kind = \"ellipsoid\", columns = 96, rows = 48 }}\n\
         [surface.land.texture]\nkind = \"virtual\"\n{texture}\n\
         [view]\nwidth = 160\nheight = 90\ncamera = \"near\"\n\
         [cameras.near]\nlatitude_deg = 30.0\nlongitude_deg = 31.0\naltitude_m = 1.5e6\ntilt_deg = 30.0\n\
         [cameras.elsewhere]\nlatitude_deg = 10.0\nlongitude_deg = -60.0\naltitude_m = 1.5e6\n"
    )
}

const SYNTHETIC: &str = "source = \"earth\"\nwidth_log2 = 11\nheight_log2 = 10\ntile_size = 128\nborder = 4";

/// Bakes the small scene's texture.
fn bake(folder: &TempDir, output: &str, format: &str) {
    let ran = run(folder, &["bake", "earth:11", "--tile", "128", "--format", format, "-o", output]);
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
}

fn write(folder: &TempDir, name: &str, text: &str) {
    std::fs::write(folder.path().join(name), text).unwrap();
}

fn read(folder: &TempDir, name: &str) -> String {
    std::fs::read_to_string(folder.path().join(name)).unwrap()
}
