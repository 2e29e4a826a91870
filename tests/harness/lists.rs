//! Neighbours of a right list of tiles.

use ortelius::math::pyramid::{Pyramid, TileId};
use ortelius::paper::virtual_texture::reference::{distinct_triples, visible_tiles};
use ortelius::paper::virtual_texture::streaming::{Keying, distinct_tiles};
use std::collections::BTreeSet;

fn pyramid() -> Pyramid {
    Pyramid::new(9, 8, 4, 2, None).unwrap()
}

/// 64 x 32 pixels; level and place change, and the last rows are background.
fn u1() -> Vec<[u32; 3]> {
    (0..2048u32)
        .map(|pixel| match pixel {
            1920.. => [u32::MAX, 0, 0],
            _ => [pixel / 500, pixel / 128, pixel % 32],
        })
        .collect()
}

#[test]
fn a_list_with_a_tile_more_or_less_or_another_is_rejected() {
    let expected = visible_tiles(&u1(), &pyramid());
    let right = distinct_tiles(&u1(), Keying::Paper, pyramid().first_resident_level());
    let set = |tiles: &[TileId]| tiles.iter().copied().collect::<BTreeSet<_>>();
    assert_eq!(set(&right), expected);
    for index in 0..right.len() {
        let less: Vec<TileId> = right.iter().copied().filter(|&tile| tile != right[index]).collect();
        assert_ne!(set(&less), expected, "without {:?}", right[index]);
    }
    let more = [&right[..], &[TileId { level: 4, row: 0, column: 1 }]].concat();
    assert_ne!(set(&more), expected);
    let mut other = right.clone();
    other[7].column ^= 1 << 4;
    assert_ne!(set(&other), expected);
}

#[test]
fn one_pixel_decides() {
    let mut spoilt = u1();
    // The only pixel that sees this tile.
    spoilt[1000] = [4, 0, 31];
    assert_ne!(visible_tiles(&spoilt, &pyramid()), visible_tiles(&u1(), &pyramid()));
}

#[test]
fn triples_that_name_the_same_tile_are_told_apart() {
    let (one, other) = ([[1, 4, 6]], [[1, 5, 7]]);
    assert_eq!(visible_tiles(&one, &pyramid()), visible_tiles(&other, &pyramid()));
    assert_ne!(distinct_triples(&one, &pyramid()), distinct_triples(&other, &pyramid()));
}
