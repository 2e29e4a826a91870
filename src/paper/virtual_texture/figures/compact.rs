//! vt.compact: stage 3 in all its variants.

use super::common::{Place, passes};
use super::side_by_side::{Combination, SideBySide};
use super::stages::{NOISE, SCENES, Stage1};
use crate::figure::claim::{Bound::Above, Bound::Equal, Claim, Test, best, one, others};
use crate::figure::{Bench, Cell, Figure, Plot, Row, Value};
use crate::paper::virtual_texture::compact::CompactPass;
use crate::paper::virtual_texture::dedup::DedupPass;
use crate::paper::virtual_texture::list::List;
use crate::paper::virtual_texture::marks::Marks;
use crate::paper::virtual_texture::read_u1;
use crate::paper::virtual_texture::{Compaction, Config, Dedup, Keying, PAPER, reference};
use anyhow::Context;

pub const COMPACT: Figure = Figure {
    id: "vt.compact",
    title: "Stage 3: marks become a list",
    about: "Section 2.3: U2 is mostly zeros; a geometry shader handles blocks of its texels and transform feedback \
            appends a triple for each set bit. The paper gives no numbers and no block size. Time of stage 3 alone over \
            the same marks of a 2^18 x 2^17 texture in tiles of 512 (U2: 512 x 256 words), with the paper's keying and \
            with the native one, for blocks of 1, 2 and 4 texels a side and for the compute variants. The lists have \
            the length that the reference counts in U1. 1280 x 720 (quick) or 1920 x 1080 pixels; `noise` as in \
            vt.dedup. \"fused-append\" is no pass: the fused draw appends as it marks, and its time is what that draw takes \
            longer than one that only marks.",
    scenes: SCENES,
    variants: || {
        let passes = variants(Keying::Paper).into_iter().map(|(name, _)| name);
        passes.chain([Compaction::FusedAppend.name().to_string()]).collect()
    },
    sweep: None,
    measure,
    plots: &[Plot::bars(PAPERS).log_y().floor("empty pass"), Plot::bars(NATIVE).log_y().floor("empty pass")],
    claims: &[
        Claim::paper(
            "2.3",
            "blocks",
            "Blocks of texels beat a vertex for each texel of U2 (geometry shader and transform feedback).",
            &[Test::ratio(
                best(PAPERS, || vec![feedback_name(0)]),
                best(PAPERS, || vec![feedback_name(1), feedback_name(2)]),
                Above(1.0),
            )],
        )
        .timed(),
        Claim::ours(
            "compute",
            "A compute variant beats the best geometry shader in every place.",
            &[Test::ratio(
                best(PAPERS, || (0..=2).map(feedback_name).collect()),
                best(PAPERS, || compute_passes().map(|compact| compact.name().to_string()).collect()),
                Above(1.0),
            )],
        )
        .timed(),
        Claim::ours(
            "length",
            "Every variant's list has exactly the length that the reference counts.",
            &[
                Test::difference(others(LENGTHS[0], REFERENCE), one(LENGTHS[0], REFERENCE), Equal(0.0)),
                Test::difference(others(LENGTHS[1], REFERENCE), one(LENGTHS[1], REFERENCE), Equal(0.0)),
            ],
        ),
    ],
};

/// Quantities: stage 3's time by keying, and how long the lists are.
const PAPERS: &str = "compact, paper keying";
const NATIVE: &str = "compact, native keying";
const LENGTHS: [&str; 2] = ["list length, paper keying", "list length, native keying"];
const REFERENCE: &str = "reference";

fn feedback_name(block_log2: u32) -> String {
    let side = 1 << block_log2;
    format!("{}, blocks of {side} x {side}", Compaction::TransformFeedback.name())
}

/// The compute passes.
fn compute_passes() -> impl Iterator<Item = Compaction> {
    let apart = [Compaction::TransformFeedback, Compaction::FusedAppend];
    Compaction::ALL.iter().copied().filter(move |compact| !apart.contains(compact))
}

/// All variants by name, over `U2`, which all of them read.
fn variants(keying: Keying) -> Vec<(String, Config)> {
    let base = Config { keying, ..PAPER };
    let blocks = (0..=2)
        .map(|compact_block_log2| (feedback_name(compact_block_log2), Config { compact_block_log2, ..base }));
    let marked = Config { dedup: Dedup::TestOr, ..base };
    blocks
        .chain(compute_passes().map(|compact| (compact.name().to_string(), Config { compact, ..marked })))
        .collect()
}

/// One variant with its marks set.
struct Run {
    name: String,
    pass: CompactPass,
    marks: Marks,
    list: List,
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let stage1 = Stage1::draw(bench, &cell.scene)?;
    let u1 = read_u1(&stage1.gpu, &stage1.footprint, &stage1.pyramid)?;
    let lengths = [
        reference::distinct_triples(&u1, &stage1.pyramid).len(),
        reference::visible_tiles(&u1, &stage1.pyramid).len(),
    ];
    let keyings = [(Keying::Paper, PAPERS), (Keying::Native, NATIVE)];
    let mut rows = Vec::new();
    for (((keying, time), quantity), length) in keyings.into_iter().zip(LENGTHS).zip(lengths) {
        rows.push(Row::number(REFERENCE, quantity, "triples", length as f64));
        let mut runs = Vec::new();
        for (name, config) in variants(keying) {
            match stage1.lacks(&config) {
                Some(why) => rows.push(Row::missing(name, time, why)),
                None => runs.push(Run::marked(&stage1, name, &config, length as u64)?),
            }
        }
        let contenders = runs.iter().map(|Run { name, pass, marks, list }| {
            passes(&stage1.gpu, &**name, move |frame| frame.pass("compact", |cmd| pass.run(cmd, marks, list)))
        });
        let timed = bench.interleave(&stage1.gpu, contenders.collect())?;
        rows.extend(timed.iter().map(|timed| timed.row(time)));
        for run in &mut runs {
            let length = Value::Number(run.length(&stage1)? as f64);
            rows.push(Row::new(&*run.name, quantity, "triples", length));
        }
        rows.extend(fused_append(bench, &cell.scene, &stage1, keying, [time, quantity])?);
    }
    Ok(rows)
}

/// What the exact fused draw takes longer where it also appends, and how long its list is; the quantities' names are
/// of time and length.
fn fused_append(
    bench: &Bench,
    scene: &str,
    stage1: &Stage1,
    keying: Keying,
    [time, length]: [&str; 2],
) -> anyhow::Result<Vec<Row>> {
    let name = Compaction::FusedAppend.name();
    let missing = |why: String| vec![Row::missing(name, time, why)];
    if scene == NOISE {
        return Ok(missing("no mesh draws this noise: U1 is filled by hand".into()));
    }
    let of = |name, compact| {
        let config = Config { dedup: Dedup::FusedExact, compact, keying, ..PAPER };
        Combination { name, config, exact: true }
    };
    let (marks, appends) = ("marks", "marks and appends");
    let both = [of(marks, Compaction::Append), of(appends, Compaction::FusedAppend)];
    let mut frames = SideBySide::settled(bench, Place::find(scene)?, stage1.size, (&both, &[]), |_| ())?;
    if let Some((_, why)) = frames.missing.first() {
        return Ok(missing(why.clone()));
    }
    let gpu = frames.gpu.clone();
    let timed = bench.interleave(&gpu, frames.contenders()?)?;
    let pass = |variant: &str, label: &str| {
        timed.iter().find(|timed| timed.variant == variant)?.pass_of_rounds(label)
    };
    // Of each round; no pass takes less than an empty one: a difference below that is not told apart from it.
    let more = || {
        let (with, without) = (pass(appends, "fused")?, pass(marks, "fused")?);
        let empty = pass("empty pass", "empty pass")?;
        let more: Vec<f64> =
            with.iter().zip(&without).zip(&empty).map(|((a, b), e)| (a - b).max(*e)).collect();
        Some(more)
    };
    let rows = vec![Row::of_rounds(name, time, "ms", more())];
    let (_, session) = frames.sessions.last().context("both run")?;
    let listed = session.records.last().context("a settled session has drawn")?.triples;
    Ok([rows, vec![Row::number(name, length, "triples", listed as f64)]].concat())
}

impl Run {
    /// Runs stage 2 once; the list has room for `length` triples.
    fn marked(stage1: &Stage1, name: String, config: &Config, length: u64) -> anyhow::Result<Run> {
        let Stage1 { gpu, pyramid, footprint, .. } = stage1;
        let dedup = DedupPass::new(gpu, pyramid, config, footprint)?;
        let pass = CompactPass::new(gpu, pyramid, config)?;
        let (marks, list) = (dedup.marks(gpu)?, pass.list(gpu, length.next_power_of_two())?);
        let mut frame = gpu.frame()?;
        frame.pass("dedup", |cmd| dedup.run(cmd, &footprint.u1, &marks))?;
        frame.submit()?.wait()?;
        Ok(Run { name, pass, marks, list })
    }

    /// Runs stage 3 once more, and reads the list.
    fn length(&mut self, stage1: &Stage1) -> anyhow::Result<usize> {
        let Run { pass, marks, list, .. } = self;
        let mut frame = stage1.gpu.frame()?;
        frame.pass("compact", |cmd| pass.run(cmd, marks, list))?;
        frame.pass("read-back", |cmd| {
            list.read_back(cmd);
            Ok(())
        })?;
        frame.submit()?.wait()?;
        Ok(pass.collect(&stage1.gpu, marks, list)?.0.len())
    }
}
