//! A figure in the window: all of its views and variants.

use crate::display::{Display, key};
use crate::program::{COARSE, Program, Seen};
use crate::{differing, open};
use ortelius::picture::write::Srgb8Picture;
use std::collections::BTreeSet;

/// The number of pixels that differ in the rows above the status line.
fn changed(a: &Seen, b: &Seen) -> usize {
    let above =
        |seen: &Seen| Srgb8Picture { width: 160, height: 45, rgba: seen.0.rgba[..4 * 160 * 45].to_vec() };
    differing(&above(a), &above(b))
}

/// Presses a key until the first view or variant is shown again, and returns what was shown. `what`: "view" or
/// "variant".
fn all(window: &mut Program<'_>, key: u8, what: &str, first: &str) -> Vec<(String, Seen)> {
    let mut shown: Vec<(String, Seen)> = Vec::new();
    while shown.last().is_none_or(|(name, _)| !name.ends_with(first)) {
        window.press(key);
        // With INFO, this does not match "opening view", which may come before. The text in brackets, which names what
        // was loaded again, is dropped.
        let said = window.said(&format!("INFO {what}"));
        let name = said.split(" (").next().unwrap_or_default();
        let name = name.rsplit(": ").next().unwrap_or_default().to_owned();
        shown.push((name, window.settled_picture()));
    }
    let names: BTreeSet<&String> = shown.iter().map(|(name, _)| name).collect();
    assert_eq!(names.len(), shown.len(), "{what}: {names:?}");
    shown
}

fn names(shown: &[(String, Seen)]) -> Vec<&str> {
    shown.iter().map(|(name, _)| name.as_str()).collect()
}

#[test]
fn a_figure_of_paper_1_shows_its_views_with_its_variants() {
    let display = Display::start();
    let mut window = open(&display, &["vt.address", "--size", "160x90", "--no-panels", "-D", COARSE]);
    let africa = window.settled_picture();
    let views = all(&mut window, key::PAGE_DOWN, "view ", "globe/africa");
    assert_eq!(names(&views), ["earth/oblique", "globe/africa"]);
    assert!(changed(&views[0].1, &africa) > 500 && changed(&views[1].1, &africa) == 0);
    // Both addresses show the same tiles.
    let variants = all(&mut window, key::SPACE, "variant: ", "level-0");
    assert_eq!(names(&variants), ["own-level", "level-0"]);
    assert!(variants.iter().all(|(_, seen)| changed(seen, &africa) == 0));
    // The next view has the variant of the same name.
    window.press(key::SPACE);
    window.said("INFO variant: own-level");
    window.press(key::PAGE_UP);
    window.said("INFO view 2 of 2: earth/oblique");
    window.settled_picture();
    window.press(key::SPACE);
    window.said("INFO variant: level-0");
    window.quit_in_silence();
}

#[test]
fn a_figure_of_paper_3_shows_each_surface_with_its_methods() {
    let display = Display::start();
    let mut window = open(&display, &["tm.pareto", "--size", "160x90", "--no-panels"]);
    let first = window.settled_picture();
    let variants = all(&mut window, key::SPACE, "variant: ", "ellipse, ratio 16");
    assert_eq!(names(&variants), ["ellipse, ratio 4", "trilinear", "ellipse, ratio 16"]);
    let views = all(&mut window, key::PAGE_UP, "view ", "checker, tilt 0");
    let (last, curved) = ("tunnel/wall", ["tunnel/wall", "tunnel/inside", "sphere/pole", "sphere/whole"]);
    assert!(names(&views).starts_with(&curved), "{:?}", names(&views));
    assert_eq!(changed(&views.last().unwrap().1, &first), 0, "the first view again");
    for pair in views.windows(2) {
        assert!(changed(&pair[0].1, &pair[1].1) > 500, "{} and {}", pair[0].0, pair[1].0);
    }
    // On a tilted surface, methods differ.
    window.press(key::PAGE_UP);
    window.said(last);
    let tilted = window.settled_picture();
    let [_, trilinear, ellipse] = &all(&mut window, key::SPACE, "variant: ", "ellipse, ratio 16")[..] else {
        panic!("three variants");
    };
    assert!(changed(&trilinear.1, &tilted) > 100 && changed(&ellipse.1, &tilted) == 0);
    window.quit_in_silence();
}

#[test]
fn a_figure_without_a_picture_says_so_and_names_a_scene() {
    let display = Display::start();
    let window = open(&display, &["tm.map-build"]);
    let (code, words) = window.ended();
    assert_eq!(code, Some(2), "{words}");
    assert!(words.contains("has no picture: it times the building of distance maps"), "{words}");
    assert!(words.contains("the nearest scene is relief-rock"), "{words}");
}
