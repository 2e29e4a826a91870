//! vt.cache: how large the two caches must be, and how good their rule of replacement is.

use super::halved::halved;
use super::{Blank, PATHS, Route, extent, numbers};
use crate::figure::{Axis, Bench, Cell, Claim, Figure, Finding, Origin, Plot, Row, Table, Value, Verdict};
use crate::math::pyramid::{Pyramid, TileId};
use crate::paper::virtual_texture::streaming::replay::{Rule, replay, steps};
use crate::paper::virtual_texture::streaming::{FrameReport, Streaming, StreamingConfig, Uploader};
use anyhow::Context;
use std::collections::HashSet;
use std::sync::Arc;

/// N1 over the largest visible set of the path.
const SHARES: [f64; 8] = [0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0];
/// N2 over N1, with N1 the largest visible set.
const HOST_SHARES: [f64; 5] = [0.5, 1.0, 2.0, 4.0, 8.0];

const FAULTS: &str = "faults";
const FAULTS_AT_DOUBLE: &str = "faults at N1 = 2 x the largest visible set";
const FIRST_USES: &str = "first uses";
const READS: &str = "reads from disk";
const LARGEST: &str = "largest visible set";
pub(super) const BUILT: &str = "as built, N2 from 0.5 to 8 x N1";
pub(super) const HALVED: &str = "as built, N1 = half of the largest visible set";
pub(super) const BIASED: &str = "frames with a level bias";
pub(super) const MOST_BIAS: &str = "largest bias";
pub(super) const AT_REST: &str = "copies in 20 frames at rest";
pub(super) const TO_REST: &str = "frames until at rest";

/// The figure.
pub const CACHE: Figure = Figure {
    id: "vt.cache",
    title: "Hits and faults of the two caches",
    about: "How many of the wanted tiles are not in video memory, and how many must be read from disk, against the \
            sizes N1 and N2 of the caches, on six paths over the earth. The paper (section 3) replaces the tile unused \
            for longest, and chooses N1 by experiment, not smaller than the largest possible number of visible tiles; \
            it shows no numbers. Belady's optimum, which knows the whole path, is the least that any rule could do.",
    scenes: &PATHS,
    variants,
    sweep: None,
    measure,
    plots: &[
        Plot {
            quantity: FAULTS,
            x: Axis::Series("N1 / largest visible set"),
            log_x: false,
            log_y: true,
            floor: None,
        },
        Plot { quantity: READS, x: Axis::Series("N2 / N1"), log_x: false, log_y: true, floor: None },
    ],
    claims: &[
        Claim {
            id: "n1-holds-the-visible-set",
            text: "N1 is to be not smaller than the largest number of visible tiles.",
            from: Origin::Paper("3"),
            check: holds_the_visible_set,
        },
        Claim {
            id: "lru-near-the-optimum",
            text: "At twice the largest visible set, LRU copies at most 10 % more tiles than Belady's optimum.",
            from: Origin::Ours,
            check: near_the_optimum,
        },
        Claim {
            id: "half-a-cache-comes-to-rest",
            text: "With N1 = half of the largest visible set every path goes on, coarser, and comes to rest where it ends.",
            from: Origin::Ours,
            check: comes_to_rest,
        },
    ],
};

fn variants() -> Vec<String> {
    Rule::ALL.iter().map(|rule| rule.name()).chain([BUILT, HALVED]).map(str::to_owned).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let route = Route::of_ruler(&cell.scene, &[])?;
    let pyramid = route.pyramid()?;
    let (size, step) = extent(bench.effort);
    let records = route.records(bench, size, step, 0)?;
    let lists: Vec<Vec<TileId>> = records.into_iter().map(|record| record.visible).collect();
    let largest = lists.iter().map(Vec::len).max().context("a path has frames")?;
    let distinct = lists.iter().flatten().collect::<HashSet<_>>().len();
    let mut rows = vec![
        Row::new(Rule::Optimum.name(), LARGEST, "tiles", Value::Number(largest as f64)),
        Row::new(Rule::Optimum.name(), FIRST_USES, "tiles", Value::Number(distinct as f64)),
    ];
    rows.extend(Rule::ALL.iter().flat_map(|&rule| of_rule(rule, &lists, largest, &pyramid)));
    let reads = HOST_SHARES.map(|share| {
        let config = unhurried(largest as u32, (share * largest as f64).ceil() as u32);
        let reports = play(&pyramid, config, &lists);
        let reads: usize = reports.iter().map(|report| report.loads).sum();
        [share, reads as f64 / lists.len() as f64]
    });
    rows.push(Row::new(BUILT, READS, "tiles a frame", Value::Series(reads.to_vec())));
    rows.extend(halved(&pyramid, &lists, largest));
    Ok(rows)
}

fn of_rule(rule: Rule, lists: &[Vec<TileId>], largest: usize, pyramid: &Pyramid) -> Vec<Row> {
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
        Row::new(rule.name(), FAULTS_AT_DOUBLE, "tiles", Value::Number(at(2.0).0)),
    ]
}

/// Budgets that never bind: sizes alone count.
fn unhurried(gpu_tiles: u32, host_tiles: u32) -> StreamingConfig {
    StreamingConfig {
        gpu_tiles,
        host_tiles,
        upload_tiles_per_frame: 1 << 16,
        load_tiles_per_frame: 1 << 16,
        deterministic: true,
        ..StreamingConfig::default()
    }
}

/// Video memory of nothing.
pub(super) struct Nowhere;

impl Uploader for Nowhere {
    fn upload(&mut self, _: u32, _: TileId, _: &[u8]) -> bool {
        true
    }
}

/// The real streaming on recorded lists.
pub(super) fn play(pyramid: &Pyramid, config: StreamingConfig, lists: &[Vec<TileId>]) -> Vec<FrameReport> {
    let mut streaming = Streaming::new(Arc::new(Blank::like(pyramid)), config).expect("settings of our own");
    lists.iter().map(|list| streaming.frame(list, &mut Nowhere)).collect()
}

fn holds_the_visible_set(table: &Table) -> Finding {
    let biased: Vec<(&str, f64)> = numbers(table, HALVED, BIASED).collect();
    let list: Vec<String> = biased.iter().map(|(path, share)| format!("{path} {share:.0} %")).collect();
    let numbers = format!("frames that are shown coarser with half of it: {}", list.join(", "));
    let verdict = match biased.len() == PATHS.len() && biased.iter().all(|(_, share)| *share > 0.0) {
        true => Verdict::Reproduced,
        false => Verdict::NotReproduced,
    };
    let why = "a smaller cache cannot hold what a frame sees, so some frames take all tiles a level or more coarser; at \
               that size and above none does";
    Finding::new(verdict, numbers, why)
}

fn near_the_optimum(table: &Table) -> Finding {
    let best: Vec<(&str, f64)> = numbers(table, Rule::Optimum.name(), FAULTS_AT_DOUBLE).collect();
    let built: Vec<(&str, f64)> = numbers(table, Rule::LeastRecentlyShown.name(), FAULTS_AT_DOUBLE).collect();
    let excess: Vec<(&str, f64)> = best
        .iter()
        .zip(&built)
        .map(|(&(path, best), &(_, built))| (path, 100.0 * (built / best - 1.0)))
        .collect();
    let list: Vec<String> = excess.iter().map(|(path, excess)| format!("{path} {excess:+.1} %")).collect();
    let within = excess.iter().filter(|(_, excess)| *excess <= 10.0).count();
    let verdict = match within {
        all if all == PATHS.len() => Verdict::Reproduced,
        0 => Verdict::NotReproduced,
        _ => Verdict::InPart,
    };
    let why =
        format!("{within} of {} paths within 10 %; first uses, which no rule avoids, included", PATHS.len());
    Finding::new(verdict, format!("copies above the optimum: {}", list.join(", ")), why)
}

fn comes_to_rest(table: &Table) -> Finding {
    let copies: Vec<(&str, f64)> = numbers(table, HALVED, AT_REST).collect();
    let frames: Vec<(&str, f64)> = numbers(table, HALVED, TO_REST).collect();
    let bias = numbers(table, HALVED, MOST_BIAS).map(|(_, bias)| bias).fold(0.0, f64::max);
    let list: Vec<String> = frames.iter().map(|(path, frames)| format!("{path} {frames}")).collect();
    let numbers = format!("frames until at rest: {}; bias up to {bias} levels", list.join(", "));
    let verdict = match copies.len() == PATHS.len() && copies.iter().all(|(_, copies)| *copies == 0.0) {
        true => Verdict::Reproduced,
        false => Verdict::NotReproduced,
    };
    Finding::new(verdict, numbers, "the bias follows from the visible set alone, so it cannot hunt")
}
