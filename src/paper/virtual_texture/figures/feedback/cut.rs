//! Subsampled feedback after a cut to a camera at rest: the frame in which each tile is first listed, for every start
//! in the cycle.

use super::watch::{SUBSAMPLINGS, Watch, name};
use super::{ALL_PIXELS, PIXELS, RECALL, TO_ALL};
use crate::figure::{Bench, Row, Value};
use crate::math::pyramid::TileId;
use crate::paper::virtual_texture::feedback::{MAX_LOG2, blocks, cycle};
use crate::paper::virtual_texture::read_requests;
use crate::picture::write::Srgb8Picture;
use crate::stats::Summary;

/// For a cut at each frame of the cycle: the frame in which each tile is first seen, counted from 1.
fn delays(tiles: &[TileId], seen: &[Vec<TileId>]) -> Vec<Vec<u64>> {
    let cycle = seen.len();
    let mut delays = vec![vec![0; tiles.len()]; cycle];
    for (at, tile) in tiles.iter().enumerate() {
        let mut next = None;
        // Goes backwards through the cycle twice, so that the next sighting is known for each start.
        for frame in (0..2 * cycle).rev() {
            if seen[frame % cycle].binary_search(tile).is_ok() {
                next = Some(frame);
            }
            if frame < cycle {
                let next =
                    next.unwrap_or_else(|| panic!("{tile:?} is seen in no frame of a cycle of {cycle}"));
                delays[frame][at] = (next - frame + 1) as u64;
            }
        }
    }
    delays
}

/// A map of the pixels: grey if the pixel's tile is among a frame's samples, red if it is missing, black if the pixel
/// needs no tile.
fn map(size: [u32; 2], triples: &[[u32; 3]], seen: &[TileId], first_resident_level: u32) -> Srgb8Picture {
    let colour = |&[level, i, j]: &[u32; 3]| match level {
        level if level >= first_resident_level => [0, 0, 0, 255],
        level => match seen.binary_search(&TileId { level, row: i >> level, column: j >> level }) {
            Ok(_) => [110, 110, 110, 255],
            Err(_) => [230, 60, 50, 255],
        },
    };
    Srgb8Picture { width: size[0], height: size[1], rgba: triples.iter().flat_map(colour).collect() }
}

/// Measures one camera at rest. `named` is the picture's file name without extension.
pub fn measure(bench: &mut Bench, named: &str, watch: &mut Watch) -> anyhow::Result<Vec<Row>> {
    let pose = watch.opened.pose;
    let exact = watch.look(&pose)?;
    let (tiles, pixels): (Vec<TileId>, Vec<u64>) = exact.into_iter().unzip();
    let mut seen: Vec<Vec<Vec<TileId>>> = vec![Vec::new(); watch.subsamplings.len()];
    for frame in 0..cycle(MAX_LOG2) {
        // Skips subsamplings whose cycle has ended.
        let min = u64::BITS - frame.leading_zeros();
        for (n, tiles) in SUBSAMPLINGS.into_iter().zip(watch.sample(frame, min)?).filter(|(n, _)| *n >= min) {
            seen[(n - SUBSAMPLINGS[0]) as usize].push(tiles);
        }
    }
    let session = &watch.opened.session;
    let pyramid = session.technique.source.pyramid();
    let size = session.technique.settings.size;
    let triples = read_requests(&session.gpu, watch.opened.stage1(), &pyramid)?;
    let first = seen.last().and_then(|frames| frames.first()).expect("a cycle has frames");
    bench.picture(named, &map(size, &triples, first, pyramid.first_resident_level()))?;
    let mut rows = vec![Row::number(ALL_PIXELS, "visible tiles", "tiles", tiles.len() as f64)];
    for (n, seen) in SUBSAMPLINGS.into_iter().zip(&seen) {
        let [columns, rows_of_samples] = blocks(n, size).map(f64::from);
        rows.push(Row::number(name(n), "samples per frame", "pixels", columns * rows_of_samples));
        if !tiles.is_empty() {
            rows.extend(delay_rows(n, &pixels, &delays(&tiles, seen)));
        }
    }
    Ok(rows)
}

fn delay_rows(n: u32, pixels: &[u64], delays: &[Vec<u64>]) -> Vec<Row> {
    let all_pixels = pixels.iter().sum::<u64>() as f64;
    let count = (delays.len() * pixels.len()) as f64;
    // Means over all starts in the cycle.
    let of_tiles =
        |frame: u64| delays.iter().flatten().filter(|delay| **delay <= frame).count() as f64 / count;
    let of_pixels = |frame: u64| {
        let served = |delays: &Vec<u64>| -> u64 {
            delays.iter().zip(pixels).filter(|(delay, _)| **delay <= frame).map(|(_, pixels)| pixels).sum()
        };
        delays.iter().map(served).sum::<u64>() as f64 / all_pixels / delays.len() as f64
    };
    let series = |of: &dyn Fn(u64) -> f64| {
        Value::Series((1..=cycle(n)).map(|frame| [frame as f64, of(frame)]).collect())
    };
    let last = |delays: &Vec<u64>| delays.iter().copied().max().map(|frame| frame as f64);
    let to_all: Vec<f64> = delays.iter().filter_map(last).collect();
    let to_all = Summary::of(&to_all).expect("a cycle has frames and tiles");
    vec![
        Row::new(name(n), RECALL, "", series(&of_tiles)),
        Row::new(name(n), PIXELS, "", series(&of_pixels)),
        Row::new(name(n), TO_ALL, "frames", Value::Summary(to_all)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_is_red_for_missed_tiles_and_black_for_pixels_without_a_tile() {
        let seen = [TileId { level: 1, row: 0, column: 2 }];
        let map = map([4, 1], &[[1, 1, 5], [1, 1, 6], [3, 0, 0], [u32::MAX; 3]], &seen, 3);
        let reds: Vec<u8> = map.rgba.chunks(4).map(|pixel| pixel[0]).collect();
        assert_eq!((reds, map.rgba[1]), (vec![110, 230, 0, 0], 110));
    }

    #[test]
    fn a_delay_is_counted_from_every_start_of_the_cycle() {
        let tile = |column| TileId { level: 0, row: 0, column };
        let (often, rare) = (tile(0), tile(1));
        let seen = [vec![often], vec![], vec![often, rare], vec![]];
        let delays = delays(&[often, rare], &seen);
        assert_eq!(delays, [[1, 3], [2, 2], [1, 1], [2, 4]]);
    }
}
