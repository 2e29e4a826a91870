//! The progress bar, on a pseudo-terminal.

use super::*;
use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, unlockpt};
use std::fs::File;
use std::io::Read;
use std::process::Stdio;

/// Runs the program with a terminal as stderr until it shows `end`, or to its end. Returns what the terminal received.
fn on_a_terminal(folder: &TempDir, arguments: &[&str], end: &str) -> String {
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY;
    let terminal = openpt(flags).unwrap();
    grantpt(&terminal).unwrap();
    unlockpt(&terminal).unwrap();
    let programs_end = ioctl_tiocgptpeer(&terminal, flags).unwrap();
    // Without TERM, a terminal counts as one that cannot draw a bar.
    let mut child = ortelius(folder, arguments)
        .env("TERM", "xterm")
        .stdout(Stdio::null())
        .stderr(programs_end)
        .spawn()
        .unwrap();
    let (mut terminal, mut shown, mut bytes) = (File::from(terminal), Vec::new(), [0; 1024]);
    // When the program and its children have ended, reading fails.
    while let Ok(count @ 1..) = terminal.read(&mut bytes) {
        shown.extend(&bytes[..count]);
        if !end.is_empty() && String::from_utf8_lossy(&shown).contains(end) {
            child.kill().unwrap();
        }
    }
    child.wait().unwrap();
    String::from_utf8_lossy(&shown).into_owned()
}

#[test]
fn long_commands_show_the_time_left_on_a_terminal_alone_and_not_if_quiet() {
    let folder = folder();
    let pan = ["render", "plane", "--size", "32x18", "--path", "pan", "--frames", "3", "-o", "a.png"];
    for (arguments, unit) in [
        (&pan[..], "frames, "),
        (&["trade", "earth", "--size", "32x18", "--knobs", "level-bias"], "settings, "),
        (&["mesh", "build", "bunny", "-o", "a.pmesh"], "faces, "),
        (&["reproduce", "vt.address", "--partition", "1/3", "-o", "out"], "cells, "),
    ] {
        let shown = on_a_terminal(&folder, arguments, " left");
        holds(&shown, &[unit, "about ", " left"]);
    }
    let quiet = on_a_terminal(&folder, &[&pan[..], &["--quiet"]].concat(), "");
    assert_eq!(quiet, "");
    let words = rendered(&folder, &pan[1..]);
    assert!(!words.contains(" left") && !words.contains(['\r', '\u{1b}']), "{words:?}");
}
