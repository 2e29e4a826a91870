//! Two variants side by side in one window.

use crate::display::{Display, key};
use crate::{FAST, differing, open};
use ortelius::picture::write::Srgb8Picture;

/// The divider's colour in `present.frag`, as sRGB codes.
const DIVIDER: [u8; 3] = [255, 184, 26];

/// The column of the divider, found in the middle row.
fn divider(picture: &Srgb8Picture) -> Option<u32> {
    let row = (picture.height / 2 * picture.width) as usize;
    let pixel = |column: u32| &picture.rgba[4 * (row + column as usize)..][..3];
    (0..picture.width).find(|column| pixel(*column).iter().zip(DIVIDER).all(|(a, b)| a.abs_diff(b) <= 1))
}

#[test]
fn two_variants_share_the_window_and_their_difference_is_shown() {
    let display = Display::start();
    // The second variant shows levels that are 4 too coarse.
    let arguments =
        ["globe", "--size", "256x144", "--no-panels", "-D", FAST, "--variant", "view.width=256", "--variant"];
    let mut window = open(&display, &[&arguments[..], &["variant.level_bias=4"]].concat());
    let alone = window.settled_picture();
    assert_eq!(divider(&alone.0), None);
    window.press(key::X);
    window.said("variant: view.width=256 | variant.level_bias=4");
    window.until("a divider in the middle", |window| divider(&window.picture().0) == Some(128));
    let both = window.settled_picture();
    let half = |side: usize| {
        let rows = |picture: &Srgb8Picture| -> Vec<u8> {
            let row = 4 * picture.width as usize;
            let part = side * row / 2 + 8 * (1 - side)..(side + 1) * row / 2 - 8 * (1 - side);
            // Only the upper 90 rows: the status line is at the bottom.
            picture.rgba.chunks_exact(row).take(90).flat_map(|row| row[part.clone()].to_vec()).collect()
        };
        let (a, b) = (rows(&alone.0), rows(&both.0));
        a.chunks_exact(4).zip(b.chunks_exact(4)).filter(|(a, b)| a != b).count()
    };
    assert_eq!(half(0), 0, "the first variant must be on the left");
    assert!(half(1) > 500, "the coarse variant must be on the right: {}", half(1));

    window.drag([128, 72], [60, 72], 1);
    window.until("the divider follows the pointer", |window| {
        divider(&window.picture().0).is_some_and(|column| column.abs_diff(60) <= 2)
    });
    window.press(key::V);
    window.until("the difference picture, black outside the globe", |window| {
        let picture = window.picture().0;
        divider(&picture).is_none() && picture.rgba[..3] == [0, 0, 0]
    });
    assert!(differing(&window.picture().0, &alone.0) > 1000);
    let difference = window.settled_picture();
    window.press(key::V);
    // The FLIP map is black at 0. The other colours of its scale begin at purple.
    window.until("the FLIP map", |window| {
        let picture = window.picture().0;
        let purple = |rgba: &&[u8]| rgba[0] > rgba[1].saturating_add(40) && rgba[2] > rgba[1];
        picture != difference.0 && picture.rgba.chunks_exact(4).filter(purple).count() > 1000
    });
    window.settled_picture();
    window.press(key::X);
    window.until("a single picture again", |window| {
        let picture = window.picture().0;
        let rows = 4 * 90 * picture.width as usize;
        picture.rgba[..rows] == alone.0.rgba[..rows]
    });
    window.quit_in_silence();
}
