//! Subsampled feedback along a path: compares the tiles sampled in the last frames with the current frame's exact
//! tiles.

use super::watch::{SUBSAMPLINGS, Watch, name};
use crate::figure::{Row, Value};
use crate::math::camera::Pose;
use crate::math::pyramid::TileId;
use crate::paper::virtual_texture::feedback::{MAX_LOG2, SampleHistory, cycle};
use crate::stats::Summary;
use std::collections::BTreeMap;

/// Lengths of a moving camera's history in frames (`None` is a whole cycle), and their row names. 16 is about Unreal
/// Engine 5's `PageFreeThreshold`.
const MEMORIES: [(Option<u64>, &str); 3] =
    [(Some(1), "one moving frame"), (Some(16), "16 moving frames"), (None, "a moving cycle")];

/// The results of one subsampling with one length of history, along a path.
#[derive(Default)]
struct Along {
    recall: Vec<f64>,
    precision: Vec<f64>,
    pixels: Vec<f64>,
}

impl Along {
    fn add(&mut self, list: &[TileId], exact: &BTreeMap<TileId, u64>) {
        if exact.is_empty() || list.is_empty() {
            return;
        }
        let found: Vec<u64> = list.iter().filter_map(|tile| exact.get(tile)).copied().collect();
        self.recall.push(found.len() as f64 / exact.len() as f64);
        self.precision.push(found.len() as f64 / list.len() as f64);
        self.pixels.push(found.iter().sum::<u64>() as f64 / exact.values().sum::<u64>() as f64);
    }

    fn rows(&self, n: u32, memory: &str) -> Vec<Row> {
        let quantities =
            [("recall", &self.recall), ("precision", &self.precision), ("pixels served", &self.pixels)];
        let row = |(quantity, samples): (&str, &Vec<f64>)| {
            let value =
                Summary::of(samples).map_or(Value::Missing("no frame shows a tile".into()), Value::Summary);
            Row::new(name(n), format!("{quantity} of {memory}"), "", value)
        };
        quantities.map(row).into()
    }
}

/// Measures frames 1 to `frames`. Before that, the camera rests at frame 0 for the longest cycle.
pub fn measure(watch: &mut Watch, frames: u32, pose: impl Fn(u32) -> Pose) -> anyhow::Result<Vec<Row>> {
    let stands = cycle(MAX_LOG2);
    let new =
        |n| MEMORIES.map(|(frames, _)| (SampleHistory::new(frames.unwrap_or(cycle(n))), Along::default()));
    let mut lists: Vec<_> = SUBSAMPLINGS.into_iter().map(new).collect();
    watch.look(&pose(0))?;
    for frame in 0..stands + u64::from(frames) {
        let moved = (frame + 1).saturating_sub(stands) as u32;
        let exact = if moved > 0 { watch.look(&pose(moved))? } else { BTreeMap::new() };
        for (at, seen) in watch.sample(frame, 0)?.iter().enumerate() {
            for (memory, along) in &mut lists[at] {
                let list = memory.add(seen);
                along.add(&list, &exact);
            }
        }
    }
    let mut rows = Vec::new();
    for (n, lists) in SUBSAMPLINGS.into_iter().zip(&lists) {
        rows.extend(lists.iter().zip(MEMORIES).flat_map(|((_, along), (_, memory))| along.rows(n, memory)));
    }
    Ok(rows)
}
