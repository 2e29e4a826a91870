//! vt.prefetch: the number of visible tiles that are missing, without and with prefetch.

use super::super::common::samples;
use super::cache::{Nowhere, replayed};
use super::{Blank, RULER, Route, UNMAGNIFIED, extent};
use crate::figure::prelude::*;
use crate::math::pyramid::{Pyramid, TileId};
use crate::paper::virtual_texture::TextureFrameRecord;
use crate::paper::virtual_texture::streaming::Streaming;
use crate::vk::FRAMES_IN_FLIGHT;
use std::collections::HashSet;
use std::sync::Arc;

/// Frames of prefetch, NA, and the variants' names.
const AHEAD: [(u32, u32, &str); 6] = [
    (0, 1, "none"),
    (4, 1, "4 frames ahead"),
    (8, 1, "8 frames ahead"),
    (16, 1, "16 frames ahead"),
    (0, 16, "none, NA = 16"),
    (8, 16, "8 frames ahead, NA = 16"),
];

/// Additional frames of delay of the slow disk: 50 ms at 60 frames a second.
const SLOW_FRAMES: usize = 3;

const MISSING: &str = "missing tiles";
const MISSING_SLOW: &str = "missing tiles, disk of 50 ms at 60 frames/s";
const ALONG: &str = "missing along the path";
const COPIES: &str = "copies";
const UNSEEN: &str = "copies never seen";

pub const PREFETCH: Figure = Figure {
    id: "vt.prefetch",
    title: "Missing tiles, with and without prefetch along the camera's motion",
    about: "The paper (section 3) requests a tile when it is visible. The tile arrives late, after the list has \
            reached the host, the disk has been read and the tile has been copied. A coarser tile is shown meanwhile. \
            With prefetch, stages 1 to 3 also run at a sixteenth of the pixels for the camera extrapolated by some \
            frames, and their tiles are loaded with the budget that the visible tiles leave. A tile counts as missing \
            in each frame whose picture needs it but does not have it. The camera `headline` is used without \
            magnification, so that the dive crosses levels. All frames (quick: every second one) are counted, at 640 x \
            360 (quick) or 1920 x 1080 pixels, with one sample each (NA = 1), or with the paper's NA = 16 where a \
            variant says so.",
    scenes: &["earth/pan", "earth/dive", "earth/orbit"],
    variants: || AHEAD.map(|(.., name)| name.to_owned()).into(),
    show: Show::scenes(VIEW).variants(settings),
    measure,
    plots: &[Plot::bars(MISSING), Plot::bars(MISSING_SLOW), Plot::curves(ALONG, "frame")],
    claims: &[
        Claim::ours(
            "prefetch-halves-misses",
            "8 frames of prefetch at least halve the missing tiles on pan, dive and orbit.",
            &Test::ratios_of(MISSING, [[EIGHT, NONE], [EIGHT_16, NONE_16]], AtMost(0.5)),
        ),
        Claim::ours(
            "prefetch-is-cheap",
            "8 frames of prefetch copy at most a quarter more tiles.",
            &Test::ratios_of(COPIES, [[EIGHT, NONE], [EIGHT_16, NONE_16]], AtMost(1.25)),
        ),
    ],
    ..Figure::BASE
};

const VIEW: &[&str] = &[RULER[0], RULER[1], RULER[2], UNMAGNIFIED];

/// The variants as settings of a scene.
fn settings() -> Vec<Setting> {
    let changes = |frames, na| [samples(na), vec![format!("cache.prefetch_frames={frames}")]].concat();
    AHEAD.map(|(frames, na, name)| Setting::new(name, changes(frames, na))).into()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (size, step) = extent(bench);
    let mut rows = Vec::new();
    for na in [1, 16] {
        let route = Route::of_ruler(&cell.scene, &[vec![UNMAGNIFIED.into()], samples(na)].concat())?;
        let pyramid = route.pyramid()?;
        let variants = AHEAD.iter().filter(|(_, of, _)| *of == na).map(|(frames, _, name)| (*frames, *name));
        let mut none = None;
        for (frames, name) in variants {
            if frames == 0 {
                none = Some(name);
                continue;
            }
            let records = route.records(bench, size, step, frames)?;
            // The lists of the visible tiles do not depend on the prefetch.
            if let Some(none) = none.take() {
                rows.extend(of_path(none, &pyramid, &records, false)?);
            }
            rows.extend(of_path(name, &pyramid, &records, true)?);
        }
    }
    Ok(rows)
}

/// `prefetches`: true if the tiles expected in the records are prefetched.
fn of_path(
    name: &str,
    pyramid: &Pyramid,
    records: &[TextureFrameRecord],
    prefetches: bool,
) -> anyhow::Result<Vec<Row>> {
    let quick = PrefetchCounts::of(pyramid, records, 0, prefetches)?;
    let slow = PrefetchCounts::of(pyramid, records, SLOW_FRAMES, prefetches)?;
    let along: Vec<[f64; 2]> =
        quick.missing.iter().enumerate().map(|(n, &missing)| [n as f64, missing as f64]).collect();
    let share = |outcome: &PrefetchCounts| {
        let missing: usize = outcome.missing.iter().sum();
        Value::Number(100.0 * missing as f64 / outcome.visible as f64)
    };
    Ok(vec![
        Row::new(name, MISSING, "% of visible tiles", share(&quick)),
        Row::new(name, MISSING_SLOW, "% of visible tiles", share(&slow)),
        Row::new(name, ALONG, "tiles", Value::Series(along)),
        Row::number(name, COPIES, "tiles", quick.copies as f64),
        Row::number(name, UNSEEN, "tiles", quick.unseen as f64),
    ])
}

/// The result of streaming a path.
struct PrefetchCounts {
    /// Visible tiles missing in each frame's picture.
    missing: Vec<usize>,
    /// Visible tiles of all frames.
    visible: usize,
    copies: usize,
    unseen: usize,
}

impl PrefetchCounts {
    /// Streams recorded lists as a session does: each list arrives [`FRAMES_IN_FLIGHT`] frames late, plus `delay`
    /// frames for a slow disk.
    fn of(
        pyramid: &Pyramid,
        records: &[TextureFrameRecord],
        delay: usize,
        prefetches: bool,
    ) -> anyhow::Result<PrefetchCounts> {
        let largest = records.iter().map(|record| record.visible.len()).max().context("a path has frames")?;
        // Twice the largest visible set, as in vt.cache.
        let config = replayed(2 * largest as u32, 4 * largest as u32, 8);
        let mut streaming = Streaming::new(Arc::new(Blank::like(pyramid)), config)?;
        // The path begins at rest, so the tiles missing in its first frame are not counted.
        while streaming.frame(&records[0].visible, &mut Nowhere).pending > 0 {}
        let mut outcome = PrefetchCounts { missing: Vec::new(), visible: 0, copies: 0, unseen: 0 };
        let mut copied: HashSet<TileId> = HashSet::new();
        for (n, record) in records.iter().enumerate() {
            let list = &records[n.saturating_sub(FRAMES_IN_FLIGHT + delay)];
            let expected = if prefetches { &list.expected[..] } else { &[] };
            let report = streaming.frame_ahead(&list.visible, expected, &mut Nowhere);
            outcome.copies += report.uploads;
            copied.extend(report.display.iter().filter(|(_, slot)| slot.is_some()).map(|(tile, _)| *tile));
            let lacks = |tile: &&TileId| streaming.state(**tile).0 < 0;
            outcome.missing.push(record.visible.iter().filter(lacks).count());
            outcome.visible += record.visible.len();
        }
        let seen: HashSet<TileId> =
            records.iter().flat_map(|record| record.visible.iter().copied()).collect();
        outcome.unseen = copied.difference(&seen).count();
        Ok(outcome)
    }
}

const NONE: &str = AHEAD[0].2;
const EIGHT: &str = AHEAD[2].2;
const NONE_16: &str = AHEAD[4].2;
const EIGHT_16: &str = AHEAD[5].2;
