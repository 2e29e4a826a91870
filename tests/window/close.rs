//! Closing the window ends what a thread builds.

use crate::display::{Display, key};
use crate::open;
use crate::program::Program;

/// A relief whose distance map takes a minute.
const DEEP: [&str; 2] = ["surface.floor.relief.method=trace", "surface.floor.relief.depth_m=0.26"];

/// Waits until the program ends. The build must have begun, and must be incomplete.
fn ended_early(window: Program<'_>) {
    let (code, words) = window.ended();
    assert_eq!(code, Some(0), "{words}");
    let last = words.lines().filter_map(|line| line.split("distance map: ").nth(1)).next_back().unwrap();
    let rows: Vec<u32> = last.split(' ').filter_map(|word| word.parse().ok()).collect();
    assert!(matches!(rows[..], [done, all] if done < all), "{last}");
}

#[test]
fn a_window_that_closes_before_its_scene_is_open_ends_the_build() {
    let display = Display::start();
    let arguments = ["relief-brick", "--size", "96x54", "--no-panels", "-D", DEEP[0], "-D", DEEP[1]];
    let mut window = open(&display, &arguments);
    window.said("distance map: ");
    window.close_button();
    ended_early(window);
}

#[test]
fn a_window_that_closes_while_a_variant_is_opened_ends_the_build() {
    let display = Display::start();
    let arguments = ["relief-brick", "--size", "96x54", "--no-panels", "--variant", "sun.azimuth_deg=290.0"];
    let mut window = open(&display, &[&arguments[..], &["--variant", &DEEP.join(",")]].concat());
    window.settled_picture();
    window.press(key::SPACE);
    window.said("distance map: ");
    window.press(key::F12);
    window.press(key::ESCAPE);
    ended_early(window);
}
