//! Faults while a window is open. `--record` draws some frames in it and closes it.

use super::{Ended, run_with};
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

const RECORD: [&str; 14] = [
    "view",
    "earth",
    "--size",
    "64x36",
    "--record",
    "--no-panels",
    "-D",
    "view.path=orbit",
    "-D",
    "paths.orbit.frames=6",
    "-D",
    "surface.land.filter={max_anisotropy=1}",
    "-D",
    "surface.land.geometry={kind='ellipsoid',columns=96,rows=48}",
];

/// A virtual display.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    fn start() -> Display {
        let mut server = Command::new("Xvfb");
        server.args(["-displayfd", "1", "-screen", "0", "800x600x24", "-nolisten", "tcp"]);
        server.stdout(Stdio::piped()).stderr(Stdio::null());
        let mut server =
            server.spawn().unwrap_or_else(|error| panic!("Xvfb: {error}; `./x test` installs it"));
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).unwrap();
        Display { server, name: format!(":{}", number.trim()) }
    }

    /// Records the path with validation on.
    fn record(&self, masked: &str, changes: &[&str], kind: &str, call: &str) -> Ended {
        let environment = [
            ("DISPLAY", &*self.name),
            ("WAYLAND_DISPLAY", ""),
            ("ORTELIUS_VALIDATE", "1"),
            ("ORTELIUS_MASK", masked),
        ];
        let changes = changes.iter().flat_map(|change| ["-D", *change]);
        run_with(&environment, &RECORD.into_iter().chain(changes).collect::<Vec<_>>(), kind, call)
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        // Both calls fail only if the server has already ended.
        let _ended = self.server.kill().and_then(|()| self.server.wait().map(drop));
    }
}

fn loud(ended: &Ended) -> Vec<&str> {
    ended.stderr.lines().filter(|line| !line.starts_with(" INFO ")).collect()
}

#[test]
fn a_lost_surface_is_replaced_and_no_frame_is_missing() {
    let display = Display::start();
    let undisturbed = display.record("", &[], "surface", "0");
    assert_eq!((undisturbed.code, loud(&undisturbed).len()), (Some(0), 0), "{}", undisturbed.stderr);
    assert!(undisturbed.files.len() >= 6 + 2, "{} files", undisturbed.files.len());
    for call in ["vkAcquireNextImageKHR:3", "vkQueuePresentKHR:3"] {
        let ended = display.record("", &[], "surface", call);
        let name = call.split(':').next().unwrap();
        assert_eq!(ended.calls, [name], "{}", ended.stderr);
        assert_eq!((ended.code, loud(&ended).len()), (Some(0), 0), "{call}: {}", ended.stderr);
        assert!(ended.files == undisturbed.files, "{call}: another film");
    }
}

#[test]
fn a_device_that_is_lost_when_it_presents_is_exit_code_4() {
    let ended = Display::start().record("", &[], "lost", "vkQueuePresentKHR:3");
    assert_eq!(ended.code, Some(4), "{}", ended.stderr);
    assert!(ended.stderr.contains("device lost in vkQueuePresentKHR"), "{}", ended.stderr);
}

#[test]
fn a_window_on_a_device_without_a_feature_says_what_needs_it() {
    let display = Display::start();
    // One warning for the window, and one for the recording.
    let replaced = display.record("geometryShader", &[], "host", "0");
    let said = loud(&replaced);
    let is_warning = |line: &&str| line.starts_with(" WARN ") && line.contains("without geometryShader");
    assert!(said.len() == 2 && said.iter().all(is_warning), "{}", replaced.stderr);
    assert_eq!(replaced.code, Some(0), "{}", replaced.stderr);
    // Variants that the scene names are refused.
    let named = ["variant.dedup=geometry", "variant.compact=transform-feedback"];
    let refused = display.record("geometryShader", &named, "host", "0");
    let [line] = loud(&refused)[..] else { panic!("{}", refused.stderr) };
    assert!(line.starts_with("ortelius: ") && line.contains("needs geometryShader"), "{line}");
    assert!(line.contains("this device lacks") && line.contains("does not need it"), "{line}");
    assert_eq!((refused.code, refused.files.len()), (Some(1), 0));
}
