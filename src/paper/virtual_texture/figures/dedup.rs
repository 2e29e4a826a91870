//! vt.dedup: stage 2 in all its variants.

use super::super::counts::{Requests, of_stage_2};
use super::common::{PAPERS, setting};
use super::stages::{NOISE, SCENES, Stage1};
use crate::figure::prelude::*;
use crate::frame::FrameSlot;
use crate::paper::virtual_texture::dedup::DedupPass;
use crate::paper::virtual_texture::read_requests;
use crate::paper::virtual_texture::{Compaction, Config, Dedup, PAPER, TileAddress, reference};

pub const DEDUP: Figure = Figure {
    id: "vt.dedup",
    title: "Stage 2: merging equal triples",
    about: "Section 2.2: rendering a vertex for each pixel costs too much, so a geometry shader handles blocks of \
            2^p x 2^p pixels. With the memo it emits a point only if the triple differs from the last one. The paper \
            gives no numbers and no p. The figure shows the time of stage 2 alone over the same packed request image \
            (1280 x 720 in quick runs, 1920 x 1080 in full ones). Its levels are those of the paper's filter, with \
            NA = 16. The variants are: p = 0 to 4 without and with memo; a vertex for each pixel without geometry \
            shader (the paper's naive baseline); and the compute variants. The emitted points, the texels that \
            shaders fetch, the tests of the tile mask (loads that avoid superfluous atomics) and the atomics are \
            counted exactly from the request image; a count that depends on the order of invocations or on the size \
            of subgroups is left out. The synthetic view `noise` requests a random tile in each pixel (640 x 360 in \
            quick runs). `bitset` keeps one bit per tile and runs with own-level tile addresses, all others with \
            level-0 ones. The fused variants are not passes over the request image; vt.pipeline and vt.limit show \
            what they add to the texturing draw.",
    scenes: SCENES,
    variants: || {
        let fused = Dedup::ALL.iter().filter(|dedup| dedup.fused()).map(|dedup| dedup.name().to_string());
        variants().into_iter().map(|(name, _)| name).chain(fused).collect()
    },
    paper: &[
        "geometry, p = 1",
        "geometry, p = 1, memo",
        "geometry, p = 2",
        "geometry, p = 2, memo",
        "geometry, p = 3",
        "geometry, p = 3, memo",
        "geometry, p = 4",
        "geometry, p = 4, memo",
    ],
    ours: &["runs"],
    show: Show::scenes(PAPERS).variants(settings),
    measure,
    plots: &[
        Plot::bars(TIME).log_y().floor("empty pass"),
        Plot::curves(BY_P, "p: blocks of 2^p x 2^p pixels").log_y(),
        Plot::curves(POINTS_BY_P, "p: blocks of 2^p x 2^p pixels").log_y(),
    ],
    claims: &[
        Claim::paper_timed(
            "2.2",
            "blocks",
            "Blocks handled by a geometry shader are faster than a vertex for each pixel.",
            &[Test::ratio(one(TIME, NAIVE_BASELINE), best(TIME, || geometry_names(|p, _| p > 0)), Above(1.0))],
        ),
        Claim::paper_timed(
            "2.2",
            "memo",
            "Emitting only if the triple differs from the last one is faster than emitting always (p = 3; `noise` is \
             not judged).",
            &[Test::ratio(without_memo(TIME), with_memo(TIME), Above(1.0))],
        )
        .at(Places::except(&[NOISE])),
        Claim::ours(
            "memo-points",
            "The memo saves at least 90 % of the points in every view but `noise` (p = 3).",
            &[Test::ratio(without_memo(POINTS), with_memo(POINTS), AtLeast(10.0))],
        )
        .at(Places::except(&[NOISE])),
        Claim::ours(
            "device-points",
            "The device emits as many points as the reference counts.",
            &[Test::value(every(POINTS_OFF), Equal(0.0))],
        ),
        Claim::ours_timed(
            "compute",
            "A compute variant is faster than the best geometry shader in every view.",
            &[Test::ratio(best(TIME, || geometry_names(|_, _| true)), best(TIME, compute_names), Above(1.0))],
        ),
    ],
    ..Figure::BASE
};

/// Quantities.
const TIME: &str = "dedup";
const POINTS: &str = "points emitted";
const POINTS_OFF: &str = "points emitted, the device's count less the reference's";
const BY_P: &str = "dedup by p";
const POINTS_BY_P: &str = "points emitted by p";

const NAIVE_BASELINE: &str = "points";

fn geometry_name(block_log2: u32, memo: bool) -> String {
    format!("geometry, p = {block_log2}{}", if memo { ", memo" } else { "" })
}

/// The geometry shaders' settings. A block of one pixel needs no memo.
fn geometry() -> impl Iterator<Item = (u32, bool)> {
    (0..=4).flat_map(|p| [(p, false), (p, true)]).filter(|&block| block != (0, true))
}

fn geometry_names(keep: impl Fn(u32, bool) -> bool) -> Vec<String> {
    geometry().filter(|&(p, memo)| keep(p, memo)).map(|(p, memo)| geometry_name(p, memo)).collect()
}

fn others() -> impl Iterator<Item = Dedup> {
    Dedup::staged().filter(|&dedup| dedup != Dedup::Geometry)
}

/// All variants that are passes over the request image, by name.
fn variants() -> Vec<(String, Config)> {
    let blocks = geometry()
        .map(|(block_log2, memo)| (geometry_name(block_log2, memo), Config { block_log2, memo, ..PAPER }));
    // Stage 3 does not run here; append fits all layouts of the mask.
    let marked = |dedup| Config { dedup, compact: Compaction::Append, ..PAPER };
    blocks.chain(others().map(|dedup| (dedup.name().to_string(), marked(dedup)))).collect()
}

/// The variants as settings of a scene. The bitset needs own-level tile addresses.
fn settings() -> Vec<Setting> {
    let fused = Dedup::ALL.iter().copied().filter(|dedup| dedup.fused());
    let fused =
        fused.map(|dedup| (dedup.name().to_owned(), Config { dedup, compact: Compaction::Append, ..PAPER }));
    let addressed = |(name, config): (String, Config)| match config.dedup {
        Dedup::Bitset => setting(name, &Config { address: TileAddress::OwnLevel, ..config }),
        _ => setting(name, &config),
    };
    variants().into_iter().chain(fused).map(addressed).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let stage1 = Stage1::draw(bench, &cell.scene)?;
    let Stage1 { gpu, pyramid, footprint, .. } = &stage1;
    assert!(!footprint.reaches, "a border of 16 texels contains all samples, so no pass marks neighbours");
    let triples = read_requests(gpu, footprint, pyramid)?;
    let requests = Requests { triples: &triples, size: stage1.size, pyramid };
    let (mut contenders, mut rows) = (Vec::new(), Vec::new());
    for (name, config) in variants() {
        let own_level = Config { address: TileAddress::OwnLevel, ..config };
        let config = if config.check(pyramid).is_ok() { config } else { own_level };
        if let Some(why) = stage1.lacks(&config) {
            rows.push(Row::missing(name, TIME, why));
            continue;
        }
        let pass = match DedupPass::new(gpu, pyramid, &config, footprint) {
            Err(error) => {
                rows.push(Row::missing(name, TIME, error.unsupported()?));
                continue;
            }
            Ok(pass) => pass,
        };
        rows.extend(of_stage_2((&name, config.dedup), &requests, pass.groups_and_texels(stage1.size), ""));
        contenders.push(Contender::frame(gpu, name, move |frame| {
            frame.pass("dedup", |cmd| pass.run(cmd, &footprint.requests, FrameSlot::FIRST))
        }));
    }
    let points = points(&requests);
    for timed in bench.interleave(gpu, contenders)? {
        let row = timed.row(TIME);
        let expected =
            points.iter().find(|row| row.variant == timed.variant).and_then(|row| row.value.number());
        // The variant `points` has no geometry shader; its points are its vertices.
        let emitted =
            row.work.map(|work| work.geometry_primitives).filter(|_| timed.variant != NAIVE_BASELINE);
        if let (Some(expected), Some(emitted)) = (expected, emitted) {
            rows.push(Row::number(&*timed.variant, POINTS_OFF, "points", emitted as f64 - expected));
        }
        rows.push(row);
    }
    let no_pass = || {
        Value::Missing(
            "not a pass over the request image: the texturing draw marks the tiles (vt.pipeline, vt.limit)"
                .into(),
        )
    };
    let fused = Dedup::ALL.iter().filter(|dedup| dedup.fused());
    rows.extend(fused.map(|dedup| Row::new(dedup.name(), TIME, "ms", no_pass())));
    rows.extend(points);
    let (times, counts) = (by_p(&rows, TIME, BY_P, "ms"), by_p(&rows, POINTS, POINTS_BY_P, "points"));
    rows.extend(times.into_iter().chain(counts));
    Ok(rows)
}

/// The points that each geometry shader emits. With p = 4, two invocations handle half a block each.
fn points(requests: &Requests<'_>) -> Vec<Row> {
    let Requests { triples, size, pyramid } = requests;
    let count = |block_log2: u32, memo| {
        let block = [1 << block_log2, 1 << block_log2.min(3)];
        let points = reference::emitted_points(triples, size[0], pyramid, block, memo);
        Value::Number(points as f64)
    };
    let rows = geometry().map(|(p, memo)| Row::new(geometry_name(p, memo), POINTS, "points", count(p, memo)));
    rows.chain([Row::new(NAIVE_BASELINE, POINTS, "points", count(0, false))]).collect()
}

/// The geometry shaders' rows of `quantity` as two curves over p: exact numbers, or times with their spread.
fn by_p(rows: &[Row], quantity: &str, name: &str, unit: &str) -> Vec<Row> {
    let line = |memo| {
        let value = |p: u32| {
            let variant = geometry_name(p, memo && p > 0);
            rows.iter().find(|row| row.variant == variant && row.quantity == quantity).map(|row| &row.value)
        };
        let spread = |p| match value(p)? {
            Value::Summary(summary) => Some((f64::from(p), *summary)),
            _ => None,
        };
        let spreads: Vec<_> = (0..=4).filter_map(spread).collect();
        let points = || (0..=4).filter_map(|p| Some([f64::from(p), value(p)?.number()?])).collect();
        let line = if spreads.is_empty() { Value::Series(points()) } else { Value::Spreads(spreads) };
        Row::new(if memo { "with memo" } else { "without memo" }, name, unit, line)
    };
    vec![line(false), line(true)]
}

/// The geometry shader with p = 3, without and with memo.
const fn without_memo(quantity: &'static str) -> Pick {
    best(quantity, || vec![geometry_name(3, false)])
}

const fn with_memo(quantity: &'static str) -> Pick {
    best(quantity, || vec![geometry_name(3, true)])
}

fn compute_names() -> Vec<String> {
    others().filter(|dedup| !dedup.draws()).map(|dedup| dedup.name().to_string()).collect()
}
