//! Near misses of a correct tile list.

use ortelius::math::pyramid::{Pyramid, TileId};
use ortelius::paper::virtual_texture::reference::{distinct_triples, visible_tiles};
use ortelius::paper::virtual_texture::streaming::{TileAddress, distinct_tiles};
use std::collections::BTreeSet;

fn pyramid() -> Pyramid {
    Pyramid::new(9, 8, 4, 2, None).unwrap()
}

/// 64 x 32 pixels with varying level and position; the last rows are background.
fn requests() -> Vec<[u32; 3]> {
    (0..2048u32)
        .map(|pixel| match pixel {
            1920.. => [u32::MAX, 0, 0],
            _ => [pixel / 500, pixel / 128, pixel % 32],
        })
        .collect()
}

#[test]
fn a_list_with_an_extra_missing_or_wrong_tile_is_rejected() {
    let expected = visible_tiles(&requests(), &pyramid());
    let right = distinct_tiles(&requests(), TileAddress::Level0, pyramid().first_resident_level());
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
fn one_pixel_can_add_a_tile() {
    let mut spoilt = requests();
    // Only this pixel sees the tile.
    spoilt[1000] = [4, 0, 31];
    assert_ne!(visible_tiles(&spoilt, &pyramid()), visible_tiles(&requests(), &pyramid()));
}

#[test]
fn different_triples_of_the_same_tile_are_distinguished() {
    let (one, other) = ([[1, 4, 6]], [[1, 5, 7]]);
    assert_eq!(visible_tiles(&one, &pyramid()), visible_tiles(&other, &pyramid()));
    assert_ne!(distinct_triples(&one, &pyramid()), distinct_triples(&other, &pyramid()));
}
