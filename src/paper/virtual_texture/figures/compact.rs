//! vt.compact: stage 3 in all its variants.

use super::common::{Place, passes};
use super::judge::{Bound, judge, on_a_gpu, ratios, why_none};
use super::side_by_side::{Combination, SideBySide};
use super::stages::{NOISE, SCENES, Stage1};
use crate::figure::{Axis, Bench, Cell, Claim, Figure, Finding, Origin, Plot, Row, Table, Value, Verdict};
use crate::paper::virtual_texture::compact::CompactPass;
use crate::paper::virtual_texture::dedup::DedupPass;
use crate::paper::virtual_texture::list::List;
use crate::paper::virtual_texture::marks::Marks;
use crate::paper::virtual_texture::read_u1;
use crate::paper::virtual_texture::{Compaction, Config, Dedup, Keying, PAPER, reference};
use crate::stats::Summary;
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
    plots: &[
        Plot { quantity: PAPERS, x: Axis::Variant, log_x: false, log_y: true, floor: Some("empty pass") },
        Plot { quantity: NATIVE, x: Axis::Variant, log_x: false, log_y: true, floor: Some("empty pass") },
    ],
    claims: &[
        Claim {
            id: "blocks",
            text: "Blocks of texels beat a vertex for each texel of U2 (geometry shader and transform feedback).",
            from: Origin::Paper("2.3"),
            check: blocks,
        },
        Claim {
            id: "compute",
            text: "A compute variant beats the best geometry shader in every place.",
            from: Origin::Ours,
            check: compute,
        },
        Claim {
            id: "length",
            text: "Every variant's list has exactly the length that the reference counts.",
            from: Origin::Ours,
            check: length,
        },
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
fn others() -> impl Iterator<Item = Compaction> {
    let apart = [Compaction::TransformFeedback, Compaction::FusedAppend];
    Compaction::ALL.iter().copied().filter(move |compact| !apart.contains(compact))
}

/// All variants by name, over `U2`, which all of them read.
fn variants(keying: Keying) -> Vec<(String, Config)> {
    let base = Config { keying, ..PAPER };
    let blocks = (0..=2)
        .map(|compact_block_log2| (feedback_name(compact_block_log2), Config { compact_block_log2, ..base }));
    let marked = Config { dedup: Dedup::TestOr, ..base };
    blocks.chain(others().map(|compact| (compact.name().to_string(), Config { compact, ..marked }))).collect()
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
        rows.push(Row::new(REFERENCE, quantity, "triples", Value::Number(length as f64)));
        let mut runs = Vec::new();
        for (name, config) in variants(keying) {
            match stage1.lacks(&config) {
                Some(why) => rows.push(Row::new(name, time, "ms", Value::Missing(why))),
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
    let missing = |why: String| vec![Row::new(name, time, "ms", Value::Missing(why))];
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
        Summary::of(&more)
    };
    let rows = match more() {
        None => missing("the device keeps no time".into()),
        Some(more) => vec![Row::new(name, time, "ms", Value::Summary(more))],
    };
    let (_, session) = frames.sessions.last().context("both run")?;
    let listed = session.records.last().context("a settled session has drawn")?.triples;
    Ok([rows, vec![Row::new(name, length, "triples", Value::Number(listed as f64))]].concat())
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

fn blocks(table: &Table) -> Finding {
    let (single, blocks) = ([feedback_name(0)], [feedback_name(1), feedback_name(2)]);
    let found = ratios(table, PAPERS, &single, &blocks);
    on_a_gpu(table, judge(table, Bound::Wins, &found, || why_none(table, PAPERS, &single)))
}

fn compute(table: &Table) -> Finding {
    let feedback: Vec<String> = (0..=2).map(feedback_name).collect();
    let others: Vec<String> = others().map(|compact| compact.name().to_string()).collect();
    let found = ratios(table, PAPERS, &feedback, &others);
    judge(table, Bound::Wins, &found, || why_none(table, PAPERS, &others))
}

fn length(table: &Table) -> Finding {
    let (mut equal, mut different) = (0, Vec::new());
    for quantity in LENGTHS {
        for record in table.of(quantity).filter(|record| record.row.variant != REFERENCE) {
            let expected = table.number(&record.scene, record.x, REFERENCE, quantity);
            let found = record.row.value.number();
            if found.is_some() && found == expected {
                equal += 1;
            } else {
                different
                    .push(format!("{}, {}: {found:?} of {expected:?}", record.scene, record.row.variant));
            }
        }
    }
    let verdict = match (equal, different.len()) {
        (0, 0) => Verdict::NotMeasurable,
        (_, 0) if table.missing == 0 => Verdict::Reproduced,
        (_, 0) => Verdict::InPart,
        _ => Verdict::NotReproduced,
    };
    let numbers = format!("{equal} lists of {} have it", equal + different.len());
    let why = match different.first() {
        Some(first) => first.clone(),
        None if table.missing > 0 => format!("{} cells are missing", table.missing),
        None => "counted, not timed".into(),
    };
    Finding::new(verdict, numbers, why)
}

#[cfg(test)]
mod tests {
    use super::super::judge::tests::table;
    use super::*;
    use crate::figure::Verdict::{InPart, NotMeasurable, NotReproduced, Reproduced};

    const SCENE: &str = "earth/oblique";

    #[test]
    fn blocks_are_judged_on_a_gpu_alone() {
        let verdict = |kind, ms| {
            let (single, block) = (feedback_name(0), feedback_name(2));
            let rows = [(SCENE, None, &*single, PAPERS, 10.0), (SCENE, None, &*block, PAPERS, ms)];
            blocks(&table(kind, &rows)).verdict
        };
        assert_eq!((verdict("discrete", 5.0), verdict("discrete", 12.0)), (Reproduced, NotReproduced));
        assert_eq!(verdict("cpu", 5.0), NotMeasurable);
    }

    #[test]
    fn compute_must_beat_the_best_blocks() {
        let verdict = |ms| {
            let block = feedback_name(2);
            let rows =
                [(SCENE, None, &*block, PAPERS, 10.0), (SCENE, None, Compaction::Append.name(), PAPERS, ms)];
            compute(&table("cpu", &rows)).verdict
        };
        assert_eq!((verdict(5.0), verdict(12.0)), (Reproduced, NotReproduced));
        assert_eq!(compute(&table("cpu", &[])).verdict, NotMeasurable);
    }

    #[test]
    fn one_list_that_is_too_long_or_short_fails_all() {
        let lists = |found| {
            let row = |variant, length| (SCENE, None, variant, LENGTHS[0], length);
            table("cpu", &[row(REFERENCE, 7.0), row("append", 7.0), row("subgroup", found)])
        };
        assert_eq!(length(&lists(7.0)).verdict, Reproduced);
        for wrong in [6.0, 8.0] {
            let found = length(&lists(wrong));
            assert_eq!(found.verdict, NotReproduced);
            assert!(found.why.contains("subgroup"), "{}", found.why);
        }
        let mut cut = lists(7.0);
        cut.missing = 1;
        assert_eq!(length(&cut).verdict, InPart);
        assert_eq!(length(&table("cpu", &[])).verdict, NotMeasurable);
    }
}
