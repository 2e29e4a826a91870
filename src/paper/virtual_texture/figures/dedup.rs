//! vt.dedup: stage 2 in all its variants.

use super::common::passes;
use super::stages::{NOISE, SCENES, Stage1};
use crate::figure::claim::{Bound::Above, Bound::AtLeast, Claim, Pick, Places, Test, best, one};
use crate::figure::{Bench, Cell, Figure, Plot, Row, Value};
use crate::paper::virtual_texture::dedup::DedupPass;
use crate::paper::virtual_texture::read_u1;
use crate::paper::virtual_texture::{Compaction, Config, Dedup, Keying, PAPER, reference};
use crate::vk::Error;

pub const DEDUP: Figure = Figure {
    id: "vt.dedup",
    title: "Stage 2: repeated triples merge",
    about: "Section 2.2: rendering a vertex for each pixel costs too much; so a geometry shader handles blocks of 2^p x \
            2^p pixels, and with the memo emits a point only where the triple differs from the last one. The paper \
            gives no numbers and no p. Time of stage 2 alone over the same U1 (packed, 1280 x 720 in quick runs, 1920 x \
            1080 in full ones), for p = 0 to 4 without and with memo, a vertex for each pixel without geometry shader \
            (the paper's straw man), and the compute variants. Points emitted are counted exactly, by the reference \
            from U1. The place `noise` asks for a random tile in each pixel (640 x 360 in quick runs). `bitset`, which keeps a bit for \
            each tile, runs with the native keying, all others with the paper's. The fused variants are no pass over U1: what they add \
            to the draw that textures is in vt.pipeline and vt.limit.",
    scenes: SCENES,
    variants: || {
        let fused = Dedup::ALL.iter().filter(|dedup| dedup.fused()).map(|dedup| dedup.name().to_string());
        variants().into_iter().map(|(name, _)| name).chain(fused).collect()
    },
    sweep: None,
    measure,
    plots: &[
        Plot::bars(TIME).log_y().floor("empty pass"),
        Plot::curves(BY_P, "p: blocks of 2^p x 2^p pixels").log_y(),
        Plot::curves(POINTS_BY_P, "p: blocks of 2^p x 2^p pixels").log_y(),
    ],
    claims: &[
        Claim::paper(
            "2.2",
            "blocks",
            "Blocks handled by a geometry shader beat rendering a vertex for each pixel.",
            &[Test::ratio(one(TIME, STRAW_MAN), best(TIME, || geometry_names(|p, _| p > 0)), Above(1.0))],
        )
        .timed(),
        Claim::paper(
            "2.2",
            "memo",
            "Emitting only where the triple differs from the last one beats emitting always (p = 3; `noise` is not judged).",
            &[Test::ratio(without_memo(TIME), with_memo(TIME), Above(1.0))],
        )
        .at(Places::except(&[NOISE]))
        .timed(),
        Claim::ours(
            "memo-points",
            "The memo spares at least nine of ten points in every landscape (p = 3).",
            &[Test::ratio(without_memo(POINTS), with_memo(POINTS), AtLeast(10.0))],
        )
        .at(Places::except(&[NOISE])),
        Claim::ours(
            "compute",
            "A compute variant beats the best geometry shader in every place.",
            &[Test::ratio(best(TIME, || geometry_names(|_, _| true)), best(TIME, compute_names), Above(1.0))],
        )
        .timed(),
    ],
};

/// Quantities.
const TIME: &str = "dedup";
const POINTS: &str = "points emitted";
const BY_P: &str = "dedup by p";
const POINTS_BY_P: &str = "points emitted by p";

const STRAW_MAN: &str = "points";

fn geometry_name(block_log2: u32, memo: bool) -> String {
    format!("geometry, p = {block_log2}{}", if memo { ", memo" } else { "" })
}

/// A block of one pixel has nothing to remember.
fn geometry() -> impl Iterator<Item = (u32, bool)> {
    (0..=4).flat_map(|p| [(p, false), (p, true)]).filter(|&block| block != (0, true))
}

fn geometry_names(keep: impl Fn(u32, bool) -> bool) -> Vec<String> {
    geometry().filter(|&(p, memo)| keep(p, memo)).map(|(p, memo)| geometry_name(p, memo)).collect()
}

fn others() -> impl Iterator<Item = Dedup> {
    Dedup::staged().filter(|&dedup| dedup != Dedup::Geometry)
}

/// All variants by name.
fn variants() -> Vec<(String, Config)> {
    let blocks = geometry()
        .map(|(block_log2, memo)| (geometry_name(block_log2, memo), Config { block_log2, memo, ..PAPER }));
    // Stage 3 does not run here; this one goes with all layouts of marks.
    let marked = |dedup| Config { dedup, compact: Compaction::Append, ..PAPER };
    blocks.chain(others().map(|dedup| (dedup.name().to_string(), marked(dedup)))).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let stage1 = Stage1::draw(bench, &cell.scene)?;
    let Stage1 { gpu, pyramid, footprint, .. } = &stage1;
    let (mut contenders, mut rows) = (Vec::new(), Vec::new());
    for (name, config) in variants() {
        let native = Config { keying: Keying::Native, ..config };
        let config = if config.check(pyramid).is_ok() { config } else { native };
        if let Some(why) = stage1.lacks(&config) {
            rows.push(Row::missing(name, TIME, why));
            continue;
        }
        let pass = match DedupPass::new(gpu, pyramid, &config, footprint) {
            Err(limit @ Error::Limit { .. }) => {
                rows.push(Row::missing(name, TIME, limit.to_string()));
                continue;
            }
            pass => pass?,
        };
        let marks = pass.marks(gpu)?;
        contenders.push(passes(gpu, name, move |frame| {
            frame.pass("dedup", |cmd| pass.run(cmd, &footprint.u1, &marks))
        }));
    }
    rows.extend(bench.interleave(gpu, contenders)?.iter().map(|timed| timed.row(TIME)));
    let no_pass = || {
        Value::Missing("it is no pass over U1: the draw that textures marks (vt.pipeline, vt.limit)".into())
    };
    let fused = Dedup::ALL.iter().filter(|dedup| dedup.fused());
    rows.extend(fused.map(|dedup| Row::new(dedup.name(), TIME, "ms", no_pass())));
    rows.extend(points(&stage1)?);
    let (times, counts) = (by_p(&rows, TIME, BY_P, "ms"), by_p(&rows, POINTS, POINTS_BY_P, "points"));
    rows.extend(times.into_iter().chain(counts));
    Ok(rows)
}

/// What each geometry shader emits; p = 4 is two invocations of half a block.
fn points(stage1: &Stage1) -> anyhow::Result<Vec<Row>> {
    let u1 = read_u1(&stage1.gpu, &stage1.footprint, &stage1.pyramid)?;
    let count = |block_log2: u32, memo| {
        let block = [1 << block_log2, 1 << block_log2.min(3)];
        let points = reference::emitted_points(&u1, stage1.size[0], &stage1.pyramid, block, memo);
        Value::Number(points as f64)
    };
    let rows = geometry().map(|(p, memo)| Row::new(geometry_name(p, memo), POINTS, "points", count(p, memo)));
    Ok(rows.chain([Row::new(STRAW_MAN, POINTS, "points", count(0, false))]).collect())
}

/// The geometry shaders' rows of `quantity` as two lines: exact numbers, or times with their spread.
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
