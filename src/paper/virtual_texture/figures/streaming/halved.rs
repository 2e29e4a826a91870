//! vt.cache: the caches as built with half of the room that the path needs.

use super::cache::{AT_REST, BIASED, HALVED, MOST_BIAS, TO_REST, play};
use crate::figure::{Row, Value};
use crate::math::pyramid::{Pyramid, TileId};
use crate::paper::virtual_texture::streaming::StreamingConfig;

/// Frames at the path's end: far more than any number of tiles that are still to come takes.
const LAST_STAYS: usize = 100;

/// Goes the path with N1 = half of the largest visible set, with the budgets of a frame, and stays at its end.
pub(super) fn halved(pyramid: &Pyramid, lists: &[Vec<TileId>], largest: usize) -> Vec<Row> {
    let gpu_tiles = (largest / 2).max(1) as u32;
    let config = StreamingConfig {
        gpu_tiles,
        host_tiles: 2 * gpu_tiles,
        upload_tiles_per_frame: 8,
        load_tiles_per_frame: 8,
        deterministic: true,
        ..StreamingConfig::default()
    };
    let last = lists.last().expect("a path has frames");
    let path: Vec<Vec<TileId>> = lists.iter().chain(std::iter::repeat_n(last, LAST_STAYS)).cloned().collect();
    let reports = play(pyramid, config, &path);
    let (moving, staying) = reports.split_at(lists.len());
    let biased = moving.iter().filter(|report| report.oversubscribed).count();
    let most_bias = moving.iter().map(|report| report.bias).max().unwrap_or(0);
    let to_rest = staying.iter().position(|report| report.pending == 0).unwrap_or(LAST_STAYS);
    let at_rest: usize = staying[LAST_STAYS - 20..].iter().map(|report| report.uploads).sum();
    let row = |quantity, unit, value: f64| Row::new(HALVED, quantity, unit, Value::Number(value));
    vec![
        row(BIASED, "% of frames", 100.0 * biased as f64 / moving.len() as f64),
        row(MOST_BIAS, "levels", f64::from(most_bias)),
        row(TO_REST, "frames", to_rest as f64),
        row(AT_REST, "tiles", at_rest as f64),
    ]
}
