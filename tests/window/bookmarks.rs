//! Bookmarks persist between runs, and the camera stays above the ground.

use crate::display::{Display, key};
use crate::program::Program;
use crate::{FAST, open};

/// A value of the camera that the key C prints.
fn camera_value(window: &mut Program<'_>, name: &str) -> f64 {
    let before = window.stdout().matches("[cameras.NAME]").count();
    window.press(key::C);
    window.until("the camera is printed", |window| {
        let words = window.stdout();
        words.matches("[cameras.NAME]").count() > before && words.ends_with("\n\n")
    });
    let words = window.stdout();
    let camera = words.rsplit("[cameras.NAME]").next().unwrap();
    let line =
        camera.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name}: {camera}"));
    line.split(" = ").nth(1).unwrap().parse().unwrap()
}

#[test]
fn a_saved_bookmark_is_found_by_the_next_run() {
    let display = Display::start();
    let config = tempfile::tempdir().unwrap();
    let home = [("XDG_CONFIG_HOME", config.path().to_str().unwrap())];
    let arguments = ["globe", "--size", "200x150", "--no-panels", "-D", FAST];
    let mut window = Program::start(&display, &arguments, &home);
    let start = window.settled_picture();
    window.wheel([100, 70], 4);
    window.until_other("nearer", &start);
    let altitude_m = camera_value(&mut window, "altitude_m");
    window.press_with_control(key::DIGIT_1 + 6);
    window.said("bookmark 7");
    window.quit();

    let mut window = Program::start(&display, &arguments, &home);
    window.settled_picture();
    window.press(key::DIGIT_1 + 6);
    window
        .until("the camera reaches the bookmark", |window| camera_value(window, "altitude_m") == altitude_m);
    window.quit();

    // A file in place of the configuration folder, so that saving fails.
    let file = config.path().join("file");
    std::fs::write(&file, "").unwrap();
    let nowhere = [("XDG_CONFIG_HOME", file.to_str().unwrap())];
    let mut window = Program::start(&display, &arguments, &nowhere);
    window.settled_picture();
    window.press_with_control(key::DIGIT_1);
    window.said("file/ortelius/bookmarks.toml: the bookmark is kept until the window closes");
    window.quit();
}

#[test]
fn l_plays_the_path_and_f9_pauses_it_and_lets_it_go_on() {
    let display = Display::start();
    // A path of several hours, so that it does not end during the test.
    let slow = ["-D", "paths.dive.frames=1000000"];
    let mut window =
        open(&display, &[&["globe", "--size", "96x54", "--no-panels", "-D", FAST][..], &slow].concat());
    window.settled_picture();
    let start = camera_value(&mut window, "altitude_m");
    window.press(key::L);
    window.until("the path is played", |window| camera_value(window, "altitude_m") < start);
    window.press(key::F9);
    let paused = camera_value(&mut window, "altitude_m");
    window.settled_picture();
    assert_eq!(camera_value(&mut window, "altitude_m"), paused);
    window.press(key::F9);
    window.until("the path goes on", |window| camera_value(window, "altitude_m") < paused);
    window.quit();
}

#[test]
fn no_flight_goes_below_the_valleys_ground() {
    let display = Display::start();
    let mut window = open(&display, &["valley", "--size", "160x120", "--no-panels", "-D", FAST]);
    window.settled_picture();
    // The camera starts 4,480 m above sea level, near a lake bed at 4,150 m.
    window.hold(key::Q, 2500);
    window.until("the camera stays above the ground", |window| {
        window.press(key::Q);
        camera_value(window, "altitude_m") > 4000.0
    });
    let altitude_m = camera_value(&mut window, "altitude_m");
    let near_m = camera_value(&mut window, "near_m");
    assert!(altitude_m < 4480.0 && near_m < 1.0, "{altitude_m} {near_m}");
    window.settled_picture();
    window.quit();
}
