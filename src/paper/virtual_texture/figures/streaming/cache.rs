//! vt.cache: sizes of the two caches, and the replacement policy.

use super::super::common::{MIB, samples};
use super::halved::{AT_REST, DIFFERING, HALVED, LAST_STAYS, MISREPORTED, TO_REST, halved};
use super::{Blank, PATHS, RULER, Route, extent};
use crate::figure::prelude::*;
use crate::math::pyramid::{Pyramid, TileId};
use crate::paper::virtual_texture::streaming::replay::{Replacement, Replayed, replay, steps};
use crate::paper::virtual_texture::streaming::{
    Order, Streaming, StreamingConfig, StreamingCounts, Uploader,
};
use crate::texture::source::TileFormat;
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
const WORKING_SET: &str = "largest working set";
const TOO_SMALL: &str = "frames with a level bias if N1 = 2 x the largest visible set of NA = 1";
/// The variants with NA = 16.
const OPTIMUM_16: &str = "optimum (Belady), NA = 16";
const LRU_16: &str = "LRU, stand-ins kept (as built), NA = 16";
const BUILT_16: &str = "as built, N2 from 0.5 to 8 x N1, NA = 16";
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
            are coarser than listed by a level bias, which each frame reports. Pixels have one sample (NA = 1); three \
            variants have the paper's NA = 16 with a border of 16 texels. NA changes nothing on the pan and on the dive, \
            which show level 0, and is not measured there.",
    scenes: &PATHS,
    variants: || {
        let rules = Replacement::ALL.iter().map(|rule| rule.name());
        rules.chain([BUILT, HALVED, OPTIMUM_16, LRU_16, BUILT_16]).map(str::to_owned).collect()
    },
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
            &[Test::ratio_of(FAULTS_AT_DOUBLE, [Replacement::LeastRecentlyShown.name(), Replacement::Optimum.name()], AtMost(1.1))],
        )
        .at(Places::scenes(&["earth/orbit"])),
        Claim::ours(
            "na-needs-a-larger-pool",
            "A tile pool with N1 = 2 x the largest visible set of NA = 1 does not hold the visible set of NA = 16 in any \
             frame of some path: those frames have a level bias.",
            &[Test::value(one(TOO_SMALL, LRU_16), AtLeast(100.0))],
        )
        .somewhere(),
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
    let (size, step) = extent(bench);
    let one = Path::record(bench, &cell.scene, 1)?;
    let mut rows = one.rows(Replacement::Optimum.name(), BUILT);
    for rule in Replacement::ALL {
        rows.extend([one.curve(rule, rule.name()), one.at_double(rule, rule.name())]);
    }
    // The pixels of the pan and of the dive all show level 0, so they request the same tiles with every NA.
    if one.lists.iter().flatten().any(|tile| tile.level > 0) {
        rows.extend(with_sixteen(&Path::record(bench, &cell.scene, 16)?, one.largest));
    }
    rows.extend(halved(bench, cell, size, step, one.largest)?);
    Ok(rows)
}

/// The rows of a path with NA = 16; `largest_of_one` is the largest visible set with NA = 1.
fn with_sixteen(path: &Path, largest_of_one: usize) -> Vec<Row> {
    let mut rows = path.rows(OPTIMUM_16, BUILT_16);
    let lru = Replacement::LeastRecentlyShown;
    rows.extend([path.at_double(Replacement::Optimum, OPTIMUM_16), path.curve(lru, LRU_16)]);
    let frames = steps(&path.lists, 2 * largest_of_one as u32, path.pyramid.first_resident_level());
    let biased = frames.iter().filter(|frame| frame.bias > 0).count();
    let share = 100.0 * biased as f64 / frames.len() as f64;
    rows.extend([path.at_double(lru, LRU_16), Row::number(LRU_16, TOO_SMALL, "% of frames", share)]);
    rows
}

/// The exact lists of a path.
struct Path {
    pyramid: Pyramid,
    lists: Vec<Vec<TileId>>,
    largest: usize,
}

impl Path {
    fn record(bench: &Bench, name: &str, na: u32) -> anyhow::Result<Path> {
        let route = Route::of_ruler(name, &samples(na))?;
        let (size, step) = extent(bench);
        let records = route.records(bench, size, step, 0)?;
        let lists: Vec<Vec<TileId>> = records.into_iter().map(|record| record.visible).collect();
        let largest = lists.iter().map(Vec::len).max().context("a path has frames")?;
        Ok(Path { pyramid: route.pyramid()?, lists, largest })
    }

    /// Counts that no policy changes (`of_path`), and the reads of the program's own caches (`built`).
    fn rows(&self, of_path: &str, built: &str) -> Vec<Row> {
        let distinct = self.lists.iter().flatten().collect::<HashSet<_>>().len();
        let mib = TileFormat::Rgba8.tile_bytes(&self.pyramid) as f64 / MIB;
        let reads = HOST_SHARES.map(|share| {
            // These budgets never limit a frame, so only the sizes of the caches matter.
            let config = replayed(self.largest as u32, (share * self.largest as f64).ceil() as u32, 1 << 16);
            let reports = play(&self.pyramid, config, &self.lists);
            let reads: usize = reports.iter().map(|report| report.loads).sum();
            [share, reads as f64 / self.lists.len() as f64]
        });
        vec![
            Row::number(of_path, LARGEST, "tiles", self.largest as f64),
            Row::number(of_path, WORKING_SET, "MiB", self.largest as f64 * mib),
            Row::number(of_path, FIRST_USES, "tiles", distinct as f64),
            Row::new(built, READS, "tiles a frame", Value::Series(reads.to_vec())),
        ]
    }

    /// Faults and wanted tiles with N1 = `share` of the largest visible set.
    fn at(&self, rule: Replacement, share: f64) -> [f64; 2] {
        let slots = (share * self.largest as f64).ceil() as u32;
        let frames = replay(&steps(&self.lists, slots, self.pyramid.first_resident_level()), slots, rule);
        let sum = |of: fn(&Replayed) -> usize| frames.iter().map(of).sum::<usize>() as f64;
        [sum(|frame| frame.faults), sum(|frame| frame.wanted)]
    }

    fn curve(&self, rule: Replacement, name: &str) -> Row {
        let point = |share| {
            let [faults, wanted] = self.at(rule, share);
            [share, 100.0 * faults / wanted]
        };
        Row::new(name, FAULTS, "% of wanted tiles", Value::Series(SHARES.map(point).to_vec()))
    }

    fn at_double(&self, rule: Replacement, name: &str) -> Row {
        Row::number(name, FAULTS_AT_DOUBLE, "tiles", self.at(rule, 2.0)[0])
    }
}

/// Settings of a replay; `tiles_per_frame` limits both uploads and loads.
pub(super) fn replayed(gpu_tiles: u32, host_tiles: u32, tiles_per_frame: u32) -> StreamingConfig {
    StreamingConfig {
        gpu_tiles,
        host_tiles,
        upload_tiles_per_frame: tiles_per_frame,
        load_tiles_per_frame: tiles_per_frame,
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
