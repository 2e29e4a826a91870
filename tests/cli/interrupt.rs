//! Ctrl-C.

use super::*;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Stdio};

const SIGTERM: i32 = 15;

/// Uses the shell's own `kill`. SIGTERM has the same handler as Ctrl-C; SIGINT is ignored in tests that a shell
/// runs in the background, and in their children.
pub fn interrupt(processes: &str) {
    super::figures::signal("-TERM", processes);
}

fn started(folder: &TempDir, arguments: &[&str]) -> Child {
    ortelius(folder, arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

/// The last line of an interrupted process.
pub fn last_line(child: Child) -> String {
    let ended = child.wait_with_output().unwrap();
    let words = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.signal(), Some(SIGTERM), "{words}");
    words.lines().last().unwrap_or_default().to_owned()
}

#[test]
fn an_interrupted_command_leaves_nothing_half_written() {
    let folder = folder();
    // Noise cannot be compressed, so the difference is larger than the pipe's buffer.
    let noise = |n: u32| (n.wrapping_mul(0x9E37_79B1) ^ n.wrapping_mul(0x85EB_CA6B) >> 7).to_be_bytes();
    let rgba = (0..256 * 256).flat_map(noise).collect();
    Srgb8Picture { width: 256, height: 256, rgba }.save(&folder.path().join("noise.png")).unwrap();
    Srgb8Picture { width: 256, height: 256, rgba: vec![255; 4 << 16] }
        .save(&folder.path().join("white.png"))
        .unwrap();
    for arguments in [
        &["render", "earth", "--size", "160x90", "-o", "a.exr"][..],
        &["compare", "noise.png", "white.png", "-o", "a.exr"],
    ] {
        // The output is a pipe that nobody reads, so that writing blocks.
        let (mut reader, writer) = std::io::pipe().unwrap();
        let pipe = format!("/proc/{}/fd/{}", std::process::id(), std::os::fd::AsRawFd::as_raw_fd(&writer));
        let mut command = ortelius_writing_to(&pipe, "a.exr", &folder, arguments);
        let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        reader.read_exact(&mut [0]).unwrap();
        interrupt(&child.id().to_string());
        holds(&last_line(child), &["ortelius: stopped; ", "no half-written file"]);
        assert_eq!(names(&folder), ["noise.png", "white.png"], "{arguments:?}");
    }
}

#[test]
fn an_interrupted_bake_says_that_it_can_resume_and_does() {
    let folder = folder();
    // The bake would take hours and is stopped after seconds. tests/bake finishes interrupted bakes.
    let bake = ["bake", "earth:18", "-o", "a.tiles"];
    let mut child = started(&folder, &bake);
    // The journal's header and one job.
    let at_work =
        || std::fs::metadata(folder.path().join("a.tiles.journal")).is_ok_and(|file| file.len() > 56);
    while !at_work() {
        assert!(child.try_wait().unwrap().is_none(), "a bake of hours is done");
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    interrupt(&child.id().to_string());
    holds(&last_line(child), &["ortelius: stopped; ", "run the same command to resume", "OUT.journal"]);
    assert!(names(&folder).contains(&"a.tiles.partial".to_owned()));
    let mut child = started(&folder, &bake);
    let mut lines = BufReader::new(child.stderr.as_mut().unwrap()).lines().map(Result::unwrap);
    let line = lines.find(|line| line.contains("resuming")).expect("a line before its end");
    holds(&line, &["a.tiles: resuming", "jobs are already done"]);
    interrupt(&child.id().to_string());
    holds(&last_line(child), &["ortelius: stopped; "]);
}

#[test]
fn completions_and_man_pages_know_every_subcommand() {
    let folder = folder();
    let printed = |arguments: &[&str]| {
        let ran = run(&folder, arguments);
        assert!(ran.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&ran.stderr));
        String::from_utf8(ran.stdout).unwrap()
    };
    for shell in ["bash", "zsh", "fish"] {
        holds(&printed(&["completions", shell]), &["reproduce", "compare-plain", "moves-budget"]);
    }
    holds(&printed(&["man"]), &[".TH ortelius 1", "ortelius\\-reproduce(1)"]);
    holds(&printed(&["man", "mesh", "build"]), &[".TH ortelius-mesh-build 1", "\\-\\-moves\\-budget"]);
    let (code, line) = failure(&mut ortelius(&folder, &["man", "mesh", "bild"]));
    assert_eq!(code, 2, "{line}");
    holds(&line, &["\"bild\"", "build"]);
}
