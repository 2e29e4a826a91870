//! vt.cache: how large the two caches must be, and how good their rule of replacement is.

use super::halved::{
    AT_REST, BIASED, DIFFERING, HALVED, LAST_STAYS, MISREPORTED, MOST_BIAS, TO_REST, halved,
};
use super::{Blank, PATHS, Route, extent, numbers};
use crate::figure::{Axis, Bench, Cell, Claim, Figure, Finding, Origin, Plot, Row, Table, Value, Verdict};
use crate::math::pyramid::{Pyramid, TileId};
use crate::paper::virtual_texture::streaming::replay::{Rule, replay, steps};
use crate::paper::virtual_texture::streaming::{FrameReport, Order, Streaming, StreamingConfig, Uploader};
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

/// The figure.
pub const CACHE: Figure = Figure {
    id: "vt.cache",
    title: "Hits and faults of the two caches",
    about: "How many of the wanted tiles are not in video memory, and how many must be read from disk, against the \
            sizes N1 and N2 of the caches, on six paths over the earth. The paper (section 3) replaces the tile unused \
            for longest, and chooses N1 by experiment, not smaller than the largest possible number of visible tiles; \
            it shows no numbers. Belady's optimum, which knows the whole path, is the least that any rule could do. Rules and sizes \
            are replayed on the lists of every frame (quick: every second one) of each path at 640 x 360 (quick) or 1920 x 1080 \
            pixels, tiles of 256 texels. With half of the room a real session goes each path. Bias: levels by which every tile is \
            taken coarser than listed, because what a frame sees exceeds N1; the report of each frame says it.",
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
            text: "With N1 = half of the largest visible set a session goes each of the six paths, coarser where it must, and \
                   comes to rest where it ends: nothing is copied any more, and the picture stays the same to the last byte.",
            from: Origin::Ours,
            check: comes_to_rest,
        },
        Claim {
            id: "bias-is-reported",
            text: "There every frame's report says by how many levels tiles are coarser, exactly where the visible set exceeds \
                   N1, and what is wanted then fits.",
            from: Origin::Ours,
            check: bias_is_reported,
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
    rows.extend(halved(bench, cell, size, step, largest)?);
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
        // As the committed results were measured.
        order: Order::Finest,
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
fn play(pyramid: &Pyramid, config: StreamingConfig, lists: &[Vec<TileId>]) -> Vec<FrameReport> {
    let mut streaming = Streaming::new(Arc::new(Blank::like(pyramid)), config).expect("settings of our own");
    lists.iter().map(|list| streaming.frame(list, &mut Nowhere)).collect()
}

/// The verdict on what is to hold of each of the six paths; those of which it does not are named.
fn of_paths(found: &[(&str, bool)], missing: usize, numbers: String, why: &str) -> Finding {
    let lacking: Vec<&str> = found.iter().filter(|(_, holds)| !holds).map(|(path, _)| *path).collect();
    let verdict = match found.len() - lacking.len() {
        _ if found.is_empty() => Verdict::NotMeasurable,
        all if all == PATHS.len() && missing == 0 => Verdict::Reproduced,
        0 => Verdict::NotReproduced,
        _ => Verdict::InPart,
    };
    let held = format!("{} of {} paths", found.len() - lacking.len(), PATHS.len());
    let but = if lacking.is_empty() { String::new() } else { format!(", not {}", lacking.join(", ")) };
    Finding::new(verdict, numbers, format!("{held}{but}; {why}"))
}

/// The path with the largest number.
fn worst<'a>(numbers: &[(&'a str, f64)]) -> (&'a str, f64) {
    numbers.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(("none", 0.0))
}

fn holds_the_visible_set(table: &Table) -> Finding {
    let biased: Vec<(&str, f64)> = numbers(table, HALVED, BIASED).collect();
    let list: Vec<String> = biased.iter().map(|(path, share)| format!("{path} {share:.0} %")).collect();
    let words = format!("frames that are shown coarser with half of it: {}", list.join(", "));
    let held: Vec<(&str, bool)> = biased.iter().map(|(path, share)| (*path, *share > 0.0)).collect();
    let why = format!(
        "a smaller cache cannot hold what a frame sees, so some frames take all tiles a level or more coarser, most of them on {}; \
         at that size and above none does",
        worst(&biased).0
    );
    of_paths(&held, table.missing, words, &why)
}

fn near_the_optimum(table: &Table) -> Finding {
    let best = numbers(table, Rule::Optimum.name(), FAULTS_AT_DOUBLE);
    let built = numbers(table, Rule::LeastRecentlyShown.name(), FAULTS_AT_DOUBLE);
    let pairs: Vec<(&str, f64, f64)> =
        best.zip(built).map(|((path, best), (_, built))| (path, best, built)).collect();
    let excess = |best: f64, built: f64| 100.0 * (built / best - 1.0);
    let list = pairs
        .iter()
        .map(|(path, best, built)| format!("{path} {built} of {best} ({:+.1} %)", excess(*best, *built)));
    let words =
        format!("tiles copied, LRU as built beside the optimum: {}", list.collect::<Vec<_>>().join(", "));
    let held: Vec<(&str, bool)> = pairs.iter().map(|(path, a, b)| (*path, excess(*a, *b) <= 10.0)).collect();
    let (path, most) = worst(&pairs.iter().map(|(path, a, b)| (*path, excess(*a, *b))).collect::<Vec<_>>());
    let why = format!("worst {path} with {most:+.1} %; first uses, which no rule avoids, included");
    of_paths(&held, table.missing, words, &why)
}

fn comes_to_rest(table: &Table) -> Finding {
    let of = |quantity| numbers(table, HALVED, quantity).collect::<Vec<(&str, f64)>>();
    let (frames, copies, differing) = (of(TO_REST), of(AT_REST), of(DIFFERING));
    let bias = worst(&of(MOST_BIAS));
    let rest = frames.iter().zip(&copies).zip(&differing);
    let held: Vec<(&str, bool)> =
        rest.map(|((a, b), c)| (a.0, a.1 < LAST_STAYS as f64 && b.1 == 0.0 && c.1 == 0.0)).collect();
    let list: Vec<String> = frames.iter().map(|(path, frames)| format!("{path} {frames}")).collect();
    let sum = |numbers: &[(&str, f64)]| numbers.iter().map(|(_, number)| number).sum::<f64>();
    let words = format!(
        "frames until at rest: {}; then {} tiles copied in 20 frames and {} bytes of the picture changed; bias up to {} levels ({})",
        list.join(", "),
        sum(&copies),
        sum(&differing),
        bias.1,
        bias.0
    );
    let why = format!(
        "slowest {}; the bias follows from the visible set alone, so it cannot hunt",
        worst(&frames).0
    );
    of_paths(&held, table.missing, words, &why)
}

fn bias_is_reported(table: &Table) -> Finding {
    let wrong: Vec<(&str, f64)> = numbers(table, HALVED, MISREPORTED).collect();
    let most = numbers(table, HALVED, MOST_BIAS).map(|(path, bias)| format!("{path} {bias}"));
    let words = format!(
        "{} frames with a wrong report; largest bias, levels: {}",
        wrong.iter().map(|(_, frames)| frames).sum::<f64>(),
        most.collect::<Vec<_>>().join(", ")
    );
    let held: Vec<(&str, bool)> = wrong.iter().map(|(path, frames)| (*path, *frames == 0.0)).collect();
    of_paths(
        &held,
        table.missing,
        words,
        "each frame's list against its report, and N1 against what it wants",
    )
}

#[cfg(test)]
mod tests {
    use super::super::super::judge::tests::table;
    use super::*;

    fn rest(
        path: &'static str,
        rows: &mut Vec<(&'static str, Option<f64>, &'static str, &'static str, f64)>,
        changed: f64,
    ) {
        let at = |quantity, number| (path, None, HALVED, quantity, number);
        rows.extend([at(TO_REST, 7.0), at(AT_REST, 0.0), at(DIFFERING, changed), at(MOST_BIAS, 2.0)]);
    }

    #[test]
    fn a_picture_that_changes_at_rest_on_one_path_is_told_by_its_name() {
        let found = |changed| {
            let mut rows = Vec::new();
            PATHS
                .iter()
                .for_each(|path| rest(path, &mut rows, if *path == "earth/dive" { changed } else { 0.0 }));
            comes_to_rest(&table("cpu", &rows))
        };
        assert_eq!((found(0.0).verdict, found(3.0).verdict), (Verdict::Reproduced, Verdict::InPart));
        assert!(found(3.0).why.starts_with("5 of 6 paths, not dive; "), "{}", found(3.0).why);
        assert_eq!(comes_to_rest(&table("cpu", &[])).verdict, Verdict::NotMeasurable);
    }

    #[test]
    fn the_path_that_misses_the_optimum_most_is_named_with_its_counts() {
        let (best, built) = (Rule::Optimum.name(), Rule::LeastRecentlyShown.name());
        let rows = PATHS.iter().flat_map(|path| {
            let copies = if *path == "earth/orbit" { 78.0 } else { 70.0 };
            [(*path, None, best, FAULTS_AT_DOUBLE, 70.0), (*path, None, built, FAULTS_AT_DOUBLE, copies)]
        });
        let found = near_the_optimum(&table("cpu", &rows.collect::<Vec<_>>()));
        assert_eq!(found.verdict, Verdict::InPart);
        assert!(
            found.numbers.contains("orbit 78 of 70 (+11.4 %), pan 70 of 70 (+0.0 %)"),
            "{}",
            found.numbers
        );
        assert!(found.why.starts_with("5 of 6 paths, not orbit; worst orbit with +11.4 %"), "{}", found.why);
    }
}
