//! The release program is small enough to ship, and its panics can be located.

use std::process::Command;

/// A fifth more than the current size. Line tables alone would add 80 MB.
const MAX_BYTES: u64 = 40_000_000;

#[test]
fn the_release_program_is_under_40_megabytes() {
    if cfg!(debug_assertions) {
        return; // a debug build keeps its tables
    }
    let bytes = std::fs::metadata(env!("CARGO_BIN_EXE_ortelius")).unwrap().len();
    assert!(bytes < MAX_BYTES, "{bytes} bytes");
}

/// The program has no panic to trigger; this test program is built with the same profile.
#[test]
fn a_panic_names_its_file_and_line() {
    let mut child = Command::new(std::env::current_exe().unwrap());
    child.args(["--exact", "--ignored", "--nocapture", "program::panics_in_the_library"]);
    let ran = child.output().unwrap();
    let words = String::from_utf8(ran.stderr).unwrap();
    let place = words.lines().find_map(|line| line.split_once("panicked at "));
    let (_, place) = place.unwrap_or_else(|| panic!("no panic: {words}"));
    let line = place.strip_prefix("src/stats/mod.rs:").and_then(|rest| rest.split(':').next());
    assert!(line.is_some_and(|line| line.parse::<u32>().is_ok()), "{words}");
}

#[test]
#[ignore = "run by a_panic_names_its_file_and_line"]
fn panics_in_the_library() {
    ortelius::stats::median(&[f64::NAN]);
}
