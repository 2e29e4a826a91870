//! Checks of synthesised tiles that the tests of several sources share.

use super::TileSource;
use super::border::true_texel;
use crate::math::pyramid::TileId;
use rayon::prelude::*;
use std::time::Instant;

pub fn tile(source: &dyn TileSource, level: u32, row: u32, column: u32) -> Vec<u8> {
    let mut bytes = vec![0; source.pyramid().tile_bytes_rgba8()];
    source.read_tile(TileId { level, row, column }, &mut bytes).unwrap();
    bytes
}

/// A texel of any level, read from the tile whose payload contains it.
pub fn texel(source: &dyn TileSource, level: u32, [x, y]: [u32; 2]) -> [u8; 4] {
    let pyramid = source.pyramid();
    let tile = tile(source, level, y >> pyramid.tile_log2(), x >> pyramid.tile_log2());
    let inside = [x, y].map(|at| (at % pyramid.tile_size() + pyramid.border_texels()) as usize);
    let at = (inside[1] * pyramid.stored_sides()[0] as usize + inside[0]) * 4;
    tile[at..at + 4].try_into().unwrap()
}

/// Compares a sample of the texels of one tile, in its border, its payload and its second picture, with the payloads of
/// a pyramid with another tile size. Returns the number of differences.
pub fn differing_texels(source: &dyn TileSource, other: &dyn TileSource, id: TileId) -> usize {
    let pyramid = source.pyramid();
    let bytes = tile(source, id.level, id.row, id.column);
    let [fine, coarse] = pyramid.stored_sides().map(|side| side as usize);
    let mut differing = 0;
    for (picture, side, bytes) in
        [(0, fine, &bytes[..fine * fine * 4]), (1, coarse, &bytes[fine * fine * 4..])]
    {
        let frame = pyramid.border_texels() as usize >> picture;
        let size = pyramid.level_size(id.level + picture);
        let origin = [id.column, id.row]
            .map(|index| (i64::from(index) << pyramid.tile_log2() >> picture) - frame as i64);
        let outside = |at: usize| at < frame || at >= side - frame;
        // Every 7th texel of the border, and every 7063rd of the payload.
        let sampled = |index: &usize| {
            let (x, y) = (index % side, index / side);
            index.is_multiple_of(7) && (outside(x) || outside(y) || index.is_multiple_of(1009))
        };
        for index in (0..side * side).filter(sampled) {
            let place =
                true_texel(size, origin[0] + (index % side) as i64, origin[1] + (index / side) as i64);
            differing += usize::from(bytes[index * 4..][..4] != texel(other, id.level + picture, place));
        }
    }
    differing
}

/// Reads the tiles in order, backwards, and in 1, 2 and 5 threads; all must be equal.
pub fn assert_independent_of_threads(source: &dyn TileSource, ids: &[TileId]) {
    let read = |id: &TileId| tile(source, id.level, id.row, id.column);
    let one_after_the_other: Vec<_> = ids.iter().map(read).collect();
    let mut backwards: Vec<_> = ids.iter().rev().map(read).collect();
    backwards.reverse();
    assert_eq!(one_after_the_other, backwards);
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let at_once: Vec<_> = pool.install(|| ids.par_iter().map(read).collect());
        assert_eq!(one_after_the_other, at_once, "{threads} threads");
    }
}

/// Prints the time of one tile of level 0.
pub fn print_time(name: &str, source: &dyn TileSource, row: u32, column: u32) {
    let mut nanoseconds = [0; 9].map(|_: u8| {
        let start = Instant::now();
        tile(source, 0, row, column);
        start.elapsed().as_nanos()
    });
    nanoseconds.sort_unstable();
    println!("{name}: {} us a tile, median of 9", nanoseconds[4] / 1000);
}
