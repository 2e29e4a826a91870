//! After a cut, under a camera that stands still: in which frame each tile is first listed, from every start.

use super::watch::{SUBSAMPLINGS, Watch, name};
use super::{ALL_PIXELS, FALSE_TILES, PIXELS, RECALL, TO_99, TO_ALL};
use crate::figure::{Row, Value};
use crate::math::pyramid::TileId;
use crate::paper::virtual_texture::feedback::{MOST_LOG2, blocks, cycle};
use crate::stats::Summary;

/// When each tile is first seen, 1 for at once, by the frame of the cycle in which the camera cuts to the picture.
fn delays(tiles: &[TileId], seen: &[Vec<TileId>]) -> Vec<Vec<u64>> {
    let cycle = seen.len();
    let mut delays = vec![vec![0; tiles.len()]; cycle];
    for (at, tile) in tiles.iter().enumerate() {
        let mut next = None;
        // Twice through the cycle from its end, so that each start knows the next sighting.
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

/// Frames until so many of the tiles are listed.
fn frames_to(share: f64, delays: &[u64]) -> f64 {
    let mut delays = delays.to_vec();
    delays.sort_unstable();
    let tiles = (share * delays.len() as f64).ceil() as usize;
    delays[tiles.max(1) - 1] as f64
}

pub fn measure(watch: &mut Watch) -> anyhow::Result<Vec<Row>> {
    let pose = watch.opened.pose;
    let exact = watch.look(&pose)?;
    let (tiles, pixels): (Vec<TileId>, Vec<u64>) = exact.into_iter().unzip();
    let mut seen: Vec<Vec<Vec<TileId>>> = vec![Vec::new(); watch.samplers.len()];
    for frame in 0..cycle(MOST_LOG2) {
        // Those whose cycle has not ended.
        let least = u64::BITS - frame.leading_zeros();
        for (n, tiles) in
            SUBSAMPLINGS.into_iter().zip(watch.sample(frame, least)?).filter(|(n, _)| *n >= least)
        {
            seen[(n - SUBSAMPLINGS[0]) as usize].push(tiles);
        }
    }
    let mut rows = vec![Row::new(ALL_PIXELS, "visible tiles", "tiles", Value::Number(tiles.len() as f64))];
    for (n, seen) in SUBSAMPLINGS.into_iter().zip(&seen) {
        let samples = blocks(n, watch.opened.session.settings.size).map(f64::from);
        let wrong = seen.iter().flatten().filter(|tile| tiles.binary_search(tile).is_err()).count();
        let number = |quantity, unit, number| Row::new(name(n), quantity, unit, Value::Number(number));
        rows.push(number("samples a frame", "pixels", samples[0] * samples[1]));
        rows.push(number(FALSE_TILES, "tiles", wrong as f64));
        if !tiles.is_empty() {
            rows.extend(delay_rows(n, &pixels, &delays(&tiles, seen)));
        }
    }
    Ok(rows)
}

fn delay_rows(n: u32, pixels: &[u64], delays: &[Vec<u64>]) -> Vec<Row> {
    let all_pixels = pixels.iter().sum::<u64>() as f64;
    let count = (delays.len() * pixels.len()) as f64;
    // Means over all starts of the cycle.
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
    let to = |share| {
        let frames: Vec<f64> = delays.iter().map(|delays| frames_to(share, delays)).collect();
        Value::Summary(Summary::of(&frames).expect("a cycle has frames"))
    };
    vec![
        Row::new(name(n), RECALL, "", series(&of_tiles)),
        Row::new(name(n), PIXELS, "", series(&of_pixels)),
        Row::new(name(n), TO_99, "frames", to(0.99)),
        Row::new(name(n), TO_ALL, "frames", to(1.0)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_is_counted_from_every_start_of_the_cycle() {
        let tile = |column| TileId { level: 0, row: 0, column };
        let (often, rare) = (tile(0), tile(1));
        let seen = [vec![often], vec![], vec![often, rare], vec![]];
        let delays = delays(&[often, rare], &seen);
        assert_eq!(delays, [[1, 3], [2, 2], [1, 1], [2, 4]]);
        assert_eq!(frames_to(1.0, &delays[0]), 3.0);
        assert_eq!(frames_to(0.5, &delays[0]), 1.0);
        assert_eq!(frames_to(0.51, &delays[3]), 4.0);
    }
}
