//! Faults while a window is open. `--record` draws some frames in it and closes it.

#[path = "../window/server.rs"]
mod server;

use super::{Ended, run_with};
use server::Server;

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

/// Records the path with validation on.
fn record(server: &Server, masked: &str, changes: &[&str], kind: &str, call: &str) -> Ended {
    let environment = [
        ("DISPLAY", &*server.name),
        ("WAYLAND_DISPLAY", ""),
        ("ORTELIUS_VALIDATE", "1"),
        ("ORTELIUS_MASK", masked),
    ];
    let changes = changes.iter().flat_map(|change| ["-D", *change]);
    run_with(&environment, &RECORD.into_iter().chain(changes).collect::<Vec<_>>(), kind, call)
}

fn loud(ended: &Ended) -> Vec<&str> {
    ended.stderr.lines().filter(|line| !line.starts_with(" INFO ")).collect()
}

#[test]
fn a_lost_surface_is_replaced_and_no_frame_is_missing() {
    let server = Server::start();
    let undisturbed = record(&server, "", &[], "surface", "0");
    assert_eq!((undisturbed.code, loud(&undisturbed).len()), (Some(0), 0), "{}", undisturbed.stderr);
    assert!(undisturbed.files.len() >= 6 + 2, "{} files", undisturbed.files.len());
    for call in ["vkAcquireNextImageKHR:3", "vkQueuePresentKHR:3"] {
        let ended = record(&server, "", &[], "surface", call);
        let name = call.split(':').next().unwrap();
        assert_eq!(ended.calls, [name], "{}", ended.stderr);
        assert_eq!((ended.code, loud(&ended).len()), (Some(0), 0), "{call}: {}", ended.stderr);
        assert!(ended.files == undisturbed.files, "{call}: another film");
    }
}

#[test]
fn a_device_that_is_lost_when_it_presents_is_exit_code_4() {
    let ended = record(&Server::start(), "", &[], "lost", "vkQueuePresentKHR:3");
    assert_eq!(ended.code, Some(4), "{}", ended.stderr);
    assert!(ended.stderr.contains("device lost in vkQueuePresentKHR"), "{}", ended.stderr);
}

#[test]
fn a_window_on_a_device_without_a_feature_says_what_needs_it() {
    let server = Server::start();
    // One warning for the window, and one for the recording.
    let replaced = record(&server, "geometryShader", &[], "host", "0");
    let said = loud(&replaced);
    let is_warning = |line: &&str| line.starts_with(" WARN ") && line.contains("without geometryShader");
    assert!(said.len() == 2 && said.iter().all(is_warning), "{}", replaced.stderr);
    assert_eq!(replaced.code, Some(0), "{}", replaced.stderr);
    // Variants that the scene names are refused.
    let named = ["variant.dedup=geometry", "variant.compact=transform-feedback"];
    let refused = record(&server, "geometryShader", &named, "host", "0");
    let [line] = loud(&refused)[..] else { panic!("{}", refused.stderr) };
    assert!(line.starts_with("ortelius: ") && line.contains("needs geometryShader"), "{line}");
    assert!(line.contains("this device lacks") && line.contains("does not need it"), "{line}");
    assert_eq!((refused.code, refused.files.len()), (Some(1), 0));
}
