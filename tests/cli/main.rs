//! The program from outside: what it says, writes and returns.

mod again;
mod compare;
mod doctor;
mod dumps;
mod fetch;
mod figures;
mod keys;
mod mesh;
mod pictures;
mod program;
mod report;
mod tiles;
mod trade;
mod words;

use ortelius::picture::write::{Srgb8Picture, read_png};
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

/// The program, in `folder`: never in the repository, so that nothing of it can be missed.
fn ortelius(folder: &TempDir, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ortelius"));
    // Validation in every test that draws: any message of the layer is then an error.
    command.current_dir(folder).args(arguments).env("ORTELIUS_VALIDATE", "1");
    command
}

fn run(folder: &TempDir, arguments: &[&str]) -> Output {
    ortelius(folder, arguments).output().unwrap()
}

/// `ortelius render ARGUMENTS`, which must succeed. What it said on stderr.
fn rendered(folder: &TempDir, arguments: &[&str]) -> String {
    let ran = run(folder, &[&["render"], arguments].concat());
    let words = String::from_utf8(ran.stderr).unwrap();
    assert_eq!(ran.status.code(), Some(0), "{arguments:?}: {words}");
    words
}

/// A command that must fail in one line on stderr, with nothing on stdout. Its exit code and that line.
fn failure(command: &mut Command) -> (i32, String) {
    let ran = command.output().unwrap();
    let words = String::from_utf8(ran.stderr).unwrap();
    // What it did before (device, frames) may be told; the error is the last line and the only one.
    let lines: Vec<&str> = words.lines().filter(|line| !line.starts_with(" INFO ")).collect();
    assert_eq!(lines.len(), 1, "{command:?}: not one line: {words}");
    assert!(lines[0].starts_with("ortelius: "), "{words}");
    assert_eq!(String::from_utf8(ran.stdout).unwrap(), "", "{command:?}: stdout is for data");
    (ran.status.code().expect("an exit code, no signal"), lines[0].to_owned())
}

fn render_failure(folder: &TempDir, arguments: &[&str]) -> (i32, String) {
    failure(&mut ortelius(folder, &[&["render"], arguments].concat()))
}

/// Asserts that a line holds each of some words.
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

/// An earth of 2^11 x 2^10 texels in tiles of 128 (levels 0 ..= 3 are streamed), seen at 160 x 90 so that
/// levels 0 to 2 are visible. `texture` is what its table says beside the kind.
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
