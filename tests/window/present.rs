//! How the picture reaches the display.

use crate::display::Display;
use crate::program::Program;
use crate::{differing, open};

#[test]
fn every_present_mode_shows_the_same_picture() {
    let display = Display::start();
    let mut shown = Vec::new();
    for mode in ["fifo", "mailbox", "immediate"] {
        let mut window =
            open(&display, &["zone-plate", "--size", "192x108", "--no-panels", "--present", mode]);
        shown.push(window.settled_picture().0);
        window.quit_in_silence();
    }
    assert!(shown[1..].iter().all(|other| differing(&shown[0], other) == 0));
}

#[test]
fn a_window_of_twice_as_many_pixels_per_point_shows_the_same_picture() {
    let display = Display::start();
    let mut shown = Vec::new();
    for factor in ["1", "2"] {
        let scene = ["zone-plate", "--size", "192x108", "--no-panels"];
        let mut window = Program::start(&display, &scene, &[("WINIT_X11_SCALE_FACTOR", factor)]);
        shown.push(window.settled_picture().0);
        window.quit_in_silence();
    }
    assert_eq!(shown.iter().map(|picture| picture.width).collect::<Vec<_>>(), [192, 192]);
    assert_eq!(differing(&shown[0], &shown[1]), 0);
}
