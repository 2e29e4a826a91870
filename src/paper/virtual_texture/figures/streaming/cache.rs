//! vt.cache: sizes of the two caches, and the replacement policy.

use super::halved::{AT_REST, DIFFERING, HALVED, LAST_STAYS, MISREPORTED, TO_REST, halved};
use super::{Blank, PATHS, RULER, Route, extent};
use crate::figure::claim::{Bound::AtMost, Bound::Below, Bound::Equal, Claim, Places, Test, one};
use crate::figure::{Bench, Cell, Figure, Plot, Row, Show, Value};
use crate::math::pyramid::{Pyramid, TileId};
use crate::paper::virtual_texture::streaming::replay::{Replacement, replay, steps};
use crate::paper::virtual_texture::streaming::{
    Order, Streaming, StreamingConfig, StreamingCounts, Uploader,
};
use anyhow::Context;
use std::collections::HashSet;
use std::sync::Arc;

/// N1 relative to the largest visible set of the path.
const SHARES: [f64; 8] = [0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0];
/// N2 relative to N1, where N1 is the largest visible set.
const HOST_SHARES: [f64; 5] = [0.5, 1.0, 2.0, 4.0, 8.0];

const FAULTS: &str = "faults";
const FAULTS_AT_DOUBLE: &str = "faults at N1 = 2 x the largest visible set";
const FIRST_USES: &str = "first uses";
const READS: &str = "reads from disk";
const LARGEST: &str = "largest visible set";
pub(super) const BUILT: &str = "as built, N2 from 0.5 to 8 x N1";

pub const CACHE: Figure = Figure {
    id: "vt.cache",
    title: "Hits and faults of the two caches",
    about: "Faults are wanted tiles that are not in video memory. Reads are tiles that must be read from disk. Both \
            are shown against the sizes of the tile pool (N1) and of the host cache (N2), on six paths over the \
            earth. The paper (section 3) evicts the least recently used tile. It chooses N1 by experiment and gives \
            no numbers. N1 must be at least the largest possible number of visible tiles. Belady's optimum knows the \
            whole path; no policy has fewer faults. `LRU` evicts the tile that was wanted least recently. With \
            `stand-ins kept`, the policy of this program, a coarser tile that is shown in place of a missing one \
            also counts as used. Policies and sizes are replayed on the lists of every frame (quick: every second \
            one) of each path at 640 x 360 (quick) or 1920 x 1080 pixels, with tiles of 256 texels. A real session \
            also runs each path with N1 = half of the largest visible set. If the visible set exceeds N1, all tiles \
            are coarser than listed by a level bias, which each frame reports. Pixels have one sample (NA = 1).",
    scenes: &PATHS,
    variants: || Replacement::ALL.iter().map(|rule| rule.name()).chain([BUILT, HALVED]).map(str::to_owned).collect(),
    ours: &["LRU, stand-ins kept (as built)"],
    show: Show::scenes(RULER),
    measure,
    plots: &[
        Plot::curves(FAULTS, "N1 / largest visible set").log_y(),
        Plot::curves(READS, "N2 / N1").log_y(),
    ],
    claims: &[
        Claim::ours(
            "lru-near-the-optimum",
            "At twice the largest visible set, LRU copies at most 10 % more tiles than Belady's optimum (on the orbit: \
             no other path returns to a tile that it has left).",
            &[Test::ratio(
                one(FAULTS_AT_DOUBLE, Replacement::LeastRecentlyShown.name()),
                one(FAULTS_AT_DOUBLE, Replacement::Optimum.name()),
                AtMost(1.1),
            )],
        )
        .at(Places::scenes(&["earth/orbit"])),
        Claim::ours(
            "half-a-cache-comes-to-rest",
            "With N1 = half of the largest visible set a session runs each of the six paths, with coarser tiles if \
             needed, and settles at its end: no more tiles are copied, and the picture stays the same to the last \
             byte.",
            &[
                Test::value(one(TO_REST, HALVED), Below(LAST_STAYS as f64)),
                Test::value(one(AT_REST, HALVED), Equal(0.0)),
                Test::value(one(DIFFERING, HALVED), Equal(0.0)),
            ],
        ),
        Claim::ours(
            "bias-is-reported",
            "In these sessions a frame reports that its visible set exceeds N1 exactly if it does. It has a level bias \
             exactly then, and while an earlier bias is held. The biased set fits N1.",
            &[Test::value(one(MISREPORTED, HALVED), Equal(0.0))],
        ),
    ],
    ..Figure::BASE
};

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let route = Route::of_ruler(&cell.scene, &[])?;
    let pyramid = route.pyramid()?;
    let (size, step) = extent(bench);
    let records = route.records(bench, size, step, 0)?;
    let lists: Vec<Vec<TileId>> = records.into_iter().map(|record| record.visible).collect();
    let largest = lists.iter().map(Vec::len).max().context("a path has frames")?;
    let distinct = lists.iter().flatten().collect::<HashSet<_>>().len();
    let mut rows = vec![
        Row::number(Replacement::Optimum.name(), LARGEST, "tiles", largest as f64),
        Row::number(Replacement::Optimum.name(), FIRST_USES, "tiles", distinct as f64),
    ];
    rows.extend(Replacement::ALL.iter().flat_map(|&rule| of_rule(rule, &lists, largest, &pyramid)));
    let reads = HOST_SHARES.map(|share| {
        let config = unhurried(largest as u32, (share * largest as f64).ceil() as u32);
        let reports = play(&pyramid, config, &lists);
        let reads: usize = reports.iter().map(|report| report.loads).sum();
        [share, reads as f64 / lists.len() as f64]
    });
    rows.push(Row::new(BUILT, READS, "tiles a frame", Value::Series(reads.to_vec())));
    rows.extend(halved(bench, cell, size, step, largest)?);
    Ok(rows)
}

fn of_rule(rule: Replacement, lists: &[Vec<TileId>], largest: usize, pyramid: &Pyramid) -> Vec<Row> {
    let at = |share: f64| {
        let slots = (share * largest as f64).ceil() as u32;
        let frames = replay(&steps(lists, slots, pyramid.first_resident_level()), slots, rule);
        let faults: usize = frames.iter().map(|frame| frame.faults).sum();
        let wanted: usize = frames.iter().map(|frame| frame.wanted).sum();
        (faults as f64, wanted as f64)
    };
    let curve = SHARES.map(|share| {
        let (faults, wanted) = at(share);
        [share, 100.0 * faults / wanted]
    });
    vec![
        Row::new(rule.name(), FAULTS, "% of wanted tiles", Value::Series(curve.to_vec())),
        Row::number(rule.name(), FAULTS_AT_DOUBLE, "tiles", at(2.0).0),
    ]
}

/// Settings whose budgets never limit a frame, so that only the cache sizes matter.
fn unhurried(gpu_tiles: u32, host_tiles: u32) -> StreamingConfig {
    StreamingConfig {
        gpu_tiles,
        host_tiles,
        upload_tiles_per_frame: 1 << 16,
        load_tiles_per_frame: 1 << 16,
        // The results stored in results/ were measured with this order.
        order: Order::Finest,
        deterministic: true,
        ..StreamingConfig::default()
    }
}

/// An uploader that copies nothing.
pub(super) struct Nowhere;

impl Uploader for Nowhere {
    fn upload(&mut self, _: u32, _: TileId, _: &[u8]) -> bool {
        true
    }
}

/// Runs the real streaming on recorded lists.
fn play(pyramid: &Pyramid, config: StreamingConfig, lists: &[Vec<TileId>]) -> Vec<StreamingCounts> {
    let mut streaming = Streaming::new(Arc::new(Blank::like(pyramid)), config).expect("settings of our own");
    lists.iter().map(|list| streaming.frame(list, &mut Nowhere)).collect()
}
