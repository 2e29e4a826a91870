//! The panels are used with the pointer: the trade's slider, and the governor's rows.

use crate::display::{Display, key};
use crate::program::{COARSE, Program};
use crate::{FAST, differing, open, rendered_again};
use ortelius::figure::{Errors, Machine, TimedSetting, Trade};
use ortelius::picture::write::read_png;
use ortelius::stats::Summary;
use std::path::Path;
use std::process::Command;

/// Columns of the left end, middle and right end of a slider, in a window of 560 pixels with a panel of 330 points.
const SLIDER: [i16; 3] = [236, 290, 350];

/// Two columns on the numbers of the governor's rows, in the same window.
const NUMBER: [i16; 2] = [405, 430];

/// A sweep with these settings, all on the front: (name, change, error).
fn trade(folder: &Path, scene: &str, settings: &[(&str, &str, f64)]) -> String {
    let traded = |(n, &(name, change, error)): (usize, &(&str, &str, f64))| TimedSetting {
        name: name.to_owned(),
        changes: if change.is_empty() { Vec::new() } else { vec![change.to_owned()] },
        ms: Summary::of(&[10.0 - n as f64]).unwrap(),
        interval_ms: [9.9 - n as f64, 10.1 - n as f64],
        error,
        errors: Errors { nmse: error, flip: error, max: error },
        forced_bias: 0,
        list_frames: 1,
        on_front: true,
    };
    let trade = Trade {
        scene: scene.to_owned(),
        size: [64, 36],
        measure: "NMSE".to_owned(),
        truth: String::new(),
        machine: Machine::default(),
        runs: 10,
        max_runs: 60,
        drift_ms: [1.0; 2],
        settings: settings.iter().enumerate().map(traded).collect(),
        refused: Vec::new(),
        budgets: Vec::new(),
    };
    let path = folder.join("trade.json");
    std::fs::write(&path, trade.json()).unwrap();
    path.display().to_string()
}

/// Drags row after row of the panel until `word` is on stderr. Returns that row. A drag, unlike a press, clicks no
/// button.
fn drag_rows(window: &mut Program<'_>, [from, to]: [i16; 2], word: &str) -> i16 {
    for row in (30..500).step_by(5) {
        window.drag_in_steps([from, row], [to, row], 1);
        if window.stderr().contains(word) {
            return row;
        }
    }
    panic!("no row answers {word:?}: {}", window.stderr());
}

/// The settings that the slider has selected so far.
fn selected(window: &Program<'_>) -> Vec<String> {
    window.stderr().lines().filter_map(|line| line.split("setting: ").nth(1).map(str::to_owned)).collect()
}

#[test]
fn the_trade_slider_moves_along_the_measured_front() {
    let display = Display::start();
    let folder = tempfile::tempdir().unwrap();
    // The file does not list the settings in the order of the front.
    let settings = [
        ("sharp", "", 0.001),
        ("coarsest", "variant.level_bias=4", 0.2),
        ("coarse", "variant.level_bias=2", 0.03),
    ];
    let trade = trade(folder.path(), "globe", &settings);
    let arguments = ["globe", "--size", "560x520", "-D", FAST, "--trade", &trade];
    let mut window = open(&display, &[&arguments[..], &["--variant", "view.width=560"]].concat());
    window.settled_picture();
    let [left, middle, right] = SLIDER;
    let row = drag_rows(&mut window, [middle, right], "setting: coarsest");
    // Drags back to the least error. On the way, every setting of the front is selected, in the order of the front.
    window.drag_in_steps([right, row], [left, row], 12);
    window.until("the first setting", |window| selected(window).last().is_some_and(|name| name == "sharp"));
    let names = selected(&window);
    let back = names.iter().rposition(|name| *name == "coarsest").unwrap();
    assert_eq!(names[back..], ["coarsest", "coarse", "sharp"], "{names:?}");

    window.drag_in_steps([middle, row], [right, row], 1);
    window.until("the last setting", |window| selected(window).last().is_some_and(|name| name == "coarsest"));
    window.settled_picture();
    window.press(key::F12);
    let png = window.printed(".png");
    let folder = window.quit_in_silence();
    // The picture must be the one that `render` makes with the setting's changes.
    let render = |changes: &[&str], name: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_ortelius"));
        command.current_dir(&folder).args(["render", "globe", "--size", "560x520", "-D", FAST, "-o", name]);
        command.args(["-D", COARSE]);
        assert!(command.args(changes).output().unwrap().status.success());
        read_png(&folder.path().join(name)).unwrap()
    };
    let saved = read_png(&folder.path().join(&png)).unwrap();
    assert!(saved == render(&["-D", "variant.level_bias=4"], "coarsest.png"));
    assert!(differing(&saved, &render(&[], "sharp.png")) > 1000, "the slider changed the picture");
    rendered_again(folder.path(), &png.replace(".png", ".json"), "again.png");
    assert!(saved == read_png(&folder.path().join("again.png")).unwrap());
}

#[test]
fn the_governors_rows_set_its_budgets_and_take_them_back() {
    let display = Display::start();
    let mut window = open(&display, &["herd", "--size", "560x520", "--deterministic"]);
    window.settled_picture();
    let row = drag_rows(&mut window, NUMBER, "governor.frame_faces = ");
    let words = window.stderr();
    let faces: u64 = words.rsplit("governor.frame_faces = ").next().unwrap().trim().parse().unwrap();
    window.press(key::F12);
    let png = window.printed(".png");
    // At the left end, a row has no budget.
    window.drag_in_steps([NUMBER[0], row], [0, row], 1);
    window.until("no budget", |window| window.stderr().contains("governor.frame_faces: the scene's own"));
    let folder = window.quit();
    let report = std::fs::read_to_string(folder.path().join(png.replace(".png", ".json"))).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let last = report["frames"].as_array().unwrap().last().unwrap();
    // An instance has at least the 64 faces of its coarsest level.
    let min = 64 * last["instances_seen"].as_u64().unwrap();
    assert!(last["faces"].as_u64().unwrap() <= faces.max(min), "{faces} faces: {last}");
    assert!(last["error_factor"].as_f64().unwrap() > 1.0, "{last}");
}
