//! One session with every variant, every overlay and many sizes.

use crate::display::{Display, key};
use crate::program::{Program, Seen};
use crate::{FAST, open};
use ortelius::paper::virtual_texture::choices::{Compaction, Dedup, Listing, RequestDraw};
use std::collections::BTreeSet;

const SIZE: [u32; 2] = [240, 135];

/// The default variants that have another filter than [`FAST`].
const FILTERS: [&str; 5] = [
    "paper 3: ellipse",
    "paper 1: up to 16 trilinear samples",
    "Feline: up to 16 trilinear samples",
    "Mavridis and Papaioannou: 4 taps",
    "pbrt's EWA",
];

/// The rows of a window above its status line, which is one line however narrow the window is.
fn above_the_message(seen: &Seen) -> Vec<u8> {
    assert_eq!([seen.0.width, seen.0.height], SIZE);
    seen.0.rgba[..4 * 240 * (135 - 60)].to_vec()
}

/// Presses Space until the first variant is shown again. Filters must show other pictures. Methods must show the
/// picture of the scene's own variant.
fn switch_every_variant(window: &mut Program<'_>, bare: &Seen) {
    let mut names = Vec::new();
    while names.last().is_none_or(|name| name != "the scene's own") {
        window.press(key::SPACE);
        // With INFO, this does not match "opening variant: ", which may come before.
        let said = window.said("INFO variant: ");
        // The text in brackets, which names what was loaded again, is dropped.
        names.push(said.split(" (").next().unwrap_or_default().to_owned());
        let shown = window.settled_picture();
        let is_same = above_the_message(&shown) == above_the_message(bare);
        assert_eq!(is_same, !FILTERS.contains(&&**names.last().unwrap()), "{names:?}");
    }
    assert_eq!(names[..FILTERS.len()], FILTERS, "filters come first");
    let distinct: BTreeSet<&String> = names.iter().collect();
    let stages = Dedup::ALL.len() + Compaction::ALL.len();
    let methods = stages + Listing::ALL.len() + RequestDraw::ALL.len() - 4;
    assert_eq!([distinct.len(), names.len()], [1 + FILTERS.len() + methods; 2], "{names:?}");
}

/// Presses G until no overlay is left. Each overlay must change the picture. After the last overlay, the picture must
/// be the first one again.
fn switch_every_overlay(window: &mut Program<'_>, bare: &Seen, expected: &[&str]) {
    let bare = above_the_message(bare);
    let mut names = Vec::new();
    let mut shown = bare.clone();
    while names.last().is_none_or(|name| name != "none") {
        window.press(key::G);
        let name = window.said("overlay: ");
        let alone = name == "none";
        // A thread computes the error overlay for some time. Until then, the picture is shown alone.
        let before = shown.clone();
        window.until(&name, |window| {
            shown = above_the_message(&window.picture());
            if alone { shown == bare } else { shown != bare && shown != before }
        });
        names.push(name);
    }
    assert_eq!(names, expected);
}

fn resize_20_times(window: &mut Program<'_>) {
    for n in 0..20 {
        window.resize([[200, 150], [333, 77], [64, 64], [1, 1], SIZE][n % 5]);
    }
    assert!(window.settled_picture().is_varied(), "after 20 resizes");
}

#[test]
fn the_earth_shows_every_variant_and_overlay_and_closes_in_silence() {
    let display = Display::start();
    let mut window = open(&display, &["earth", "--size", "240x135", "--no-panels", "-D", FAST]);
    let bare = window.settled_picture();
    switch_every_variant(&mut window, &bare);
    let overlays = ["levels", "shown minus requested level", "error against the reference", "none"];
    switch_every_overlay(&mut window, &bare, &overlays);
    resize_20_times(&mut window);
    window.quit_in_silence();
}

#[test]
fn the_valley_shows_every_variant_and_overlay_and_closes_with_its_button() {
    let display = Display::start();
    let mut window = open(&display, &["valley", "--size", "240x135", "-D", FAST]);
    let first = window.settled_picture();
    window.press(key::F2);
    let bare = window.until_other("F2 closes the panels", &first);
    switch_every_variant(&mut window, &bare);
    let overlays = [
        "levels",
        "shown minus requested level",
        "collapse levels",
        "vertex-cache misses",
        "error against the reference",
        "none",
    ];
    switch_every_overlay(&mut window, &bare, &overlays);
    resize_20_times(&mut window);
    window.close_button();
    window.closed_in_silence();
}
