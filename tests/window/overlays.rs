//! The overlays, and the values of a pixel.

use crate::display::{Display, key};
use crate::program::Seen;
use crate::{FAST, open};

/// The number of pixels whose colour satisfies `holds`.
fn count(seen: &Seen, holds: impl Fn([u8; 3]) -> bool) -> usize {
    seen.0.rgba.chunks_exact(4).filter(|rgba| holds([rgba[0], rgba[1], rgba[2]])).count()
}

fn pixel(seen: &Seen, [x, y]: [u32; 2]) -> [u8; 3] {
    let at = 4 * (y * seen.0.width + x) as usize;
    [0, 1, 2].map(|channel| seen.0.rgba[at + channel])
}

#[test]
fn levels_and_their_shortfall_colour_the_picture() {
    let display = Display::start();
    // With this bias, each pixel shows a level one coarser than it requests, except at the coarsest level.
    let arguments = ["globe", "--size", "320x180", "--no-panels", "-D", FAST, "-D", "variant.level_bias=1"];
    let mut window = open(&display, &arguments);
    let plain = window.settled_picture();
    let saturated = |rgb: [u8; 3]| rgb.iter().max().unwrap() - rgb.iter().min().unwrap() > 90;
    let wanted = count(&plain, saturated) + 500;
    window.press(key::G);
    window.until("levels as colours", |window| count(&window.picture(), saturated) > wanted);
    let levels = window.settled_picture();
    window.press(key::G);
    // The colour for one level too coarse is (1, 2/3, 0), mixed with 40 % of the picture.
    let yellow = |[r, g, b]: [u8; 3]| r > 140 && g > 90 && b < 110 && r > g;
    window.until("one level too coarse", |window| count(&window.picture(), yellow) > 5000);
    let shortfall = window.settled_picture();
    assert!(count(&levels, yellow) < count(&shortfall, yellow));
    window.press(key::G);
    // On the scale of the map, errors of 1e-3 to 1e-1 are purple. The globe has no purple pixels.
    let purple = |[r, g, b]: [u8; 3]| r > g.saturating_add(60) && b > g.saturating_add(20);
    assert!(count(&plain, purple) < 50);
    window.until("the error of each pixel", |window| count(&window.picture(), purple) > 3000);
    window.settled_picture();
    window.quit_in_silence();
}

#[test]
fn the_magnifier_prints_the_numbers_of_the_pixel_that_the_window_shows() {
    let display = Display::start();
    let mut window = open(&display, &["earth", "--size", "720x420", "--no-panels", "--tilt", "40"]);
    window.settled_picture();
    for (n, at) in [[150, 120], [500, 220]].into_iter().enumerate() {
        window.point(at.map(|at| at as i16));
        if n == 0 {
            window.press(key::Z);
        }
        let number = |line: &str, name: &str| -> u32 {
            let digits = line.split(name).nth(1).unwrap().trim_start().split([',', ';']).next().unwrap();
            digits.parse().unwrap_or_else(|_| panic!("{name}: {line}"))
        };
        // Once the requested tile is resident, the pixel shows its level.
        let start = format!("pixel {}, {};", at[0], at[1]);
        let line = window.press_until_printed(key::N, |line| {
            line.starts_with(&start) && number(line, "tile wanted level") == number(line, "level shown")
        });
        let shown = window.settled_picture();
        let [r, g, b] = pixel(&shown, at);
        assert!(line.contains(&format!("sRGB {r} {g} {b};")), "{line}: the window shows {r} {g} {b}");
        assert!(line.contains("footprint ") && line.contains("linear "), "{line}");
    }
    window.quit();
}

#[test]
fn faces_are_coloured_by_collapse_level_and_by_cache_misses() {
    let display = Display::start();
    let mut window = open(&display, &["herd", "--size", "480x420", "--no-panels"]);
    let plain = window.settled_picture();
    // The herd is grey, so saturated pixels come from the overlay.
    let saturated = |rgb: [u8; 3]| rgb.iter().max().unwrap() - rgb.iter().min().unwrap() > 60;
    let before = count(&plain, saturated);
    window.press(key::G);
    window.until("collapse levels", |window| count(&window.picture(), saturated) > before + 1000);
    let collapse = window.settled_picture();
    window.press(key::G);
    let misses = window.until_other("cache misses", &collapse);
    let green = |[r, g, b]: [u8; 3]| g > 100 && r < 110 && b < 110;
    assert!(count(&misses, green) > count(&collapse, green) + 200, "some faces must have no cache misses");
    // A pixel on a face without cache misses.
    let at = (0..480 * 420).map(|n| [n % 480, n / 480]).find(|at| green(pixel(&misses, *at))).unwrap();
    window.point(at.map(|at| at as i16));
    window.press(key::Z);
    let start = format!("pixel {}, {};", at[0], at[1]);
    let line = window.press_until_printed(key::N, |line| line.starts_with(&start));
    window.settled_picture();
    assert!(line.contains("level") && line.contains("; 0 vertices missed the cache"), "{line}");
    window.quit();
}

#[test]
fn the_work_of_a_relief_colours_its_pixels() {
    let display = Display::start();
    let mut window = open(&display, &["relief-brick", "--size", "240x135", "--no-panels"]);
    let plain = window.settled_picture();
    // Bricks and mortar are red and grey; the overlay's colours run from blue over green to red.
    let cold = |[r, g, b]: [u8; 3]| r.saturating_add(40) < g.max(b);
    assert!(count(&plain, cold) < 100);
    window.press(key::G);
    window.until("work as colours", |window| count(&window.picture(), cold) > 5000);
    let work = window.settled_picture();
    window.press(key::G);
    // The colours of errors, as in the test of the globe.
    let purple = |[r, g, b]: [u8; 3]| r > g.saturating_add(60) && b > g.saturating_add(20);
    let wanted = count(&work, purple) + 3000;
    window.until("the error of each pixel", |window| count(&window.picture(), purple) > wanted);
    window.press(key::G);
    window.until("the picture alone", |window| window.picture().0 == plain.0);
    window.quit_in_silence();
}
