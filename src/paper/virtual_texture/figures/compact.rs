//! vt.compact: stage 3 in all its variants.

use super::super::counts::{of_stage_3, reference_list};
use super::common::{self, SceneView, setting};
use super::side_by_side::{Combination, SideBySide};
use super::stages::{NOISE, Pair, SCENES, Stage1};
use crate::figure::prelude::*;
use crate::paper::virtual_texture::read_requests;
use crate::paper::virtual_texture::{Compaction, Config, Dedup, PAPER, TileAddress};

pub const COMPACT: Figure = Figure {
    id: "vt.compact",
    title: "Stage 3: the tile mask becomes a list",
    about: "Section 2.3: the tile mask is mostly zeros. A geometry shader handles blocks of its texels, and transform \
            feedback appends a triple for each set bit. The paper gives no numbers and no block size. The figure shows \
            the time of stage 3 alone, for blocks of 1, 2 and 4 texels a side and for the compute variants, with \
            level-0 and with own-level tile addresses. The mask is that of a 2^18 x 2^17 texture in tiles of 512 (512 \
            x 256 words), with the levels of the paper's NA = 16. The list lengths are compared with the reference's \
            count in the request image. Pictures have 1280 x 720 (quick) or 1920 x 1080 pixels. The synthetic view \
            `noise` requests a random tile in each pixel. \"fused-append\" is not a pass: the fused draw appends while \
            it marks. Its time and counts are those of the fused draw, less those of a fused draw that only marks. The \
            words of the tile mask that shaders read, their atomics, and the bytes that they write to the list are \
            counted exactly from the reference's list. `subgroup` has one atomic for each subgroup with a set bit; \
            their number depends on the device and is left out.",
    scenes: SCENES,
    variants: || {
        let passes = variants(TileAddress::Level0).into_iter().map(|(name, _)| name);
        passes.chain([Compaction::FusedAppend.name().to_string()]).collect()
    },
    paper: &["transform-feedback, blocks of 2 x 2", "transform-feedback, blocks of 4 x 4"],
    ours: &["append"],
    show: Show::scenes(common::PAPERS).variants(settings),
    measure,
    plots: &[Plot::bars(PAPERS).log_y().floor("empty pass"), Plot::bars(NATIVE).log_y().floor("empty pass")],
    claims: &[
        Claim::paper_timed(
            "2.3",
            "blocks",
            "Blocks of texels are faster than a vertex for each texel of the tile mask (geometry shader and transform \
             feedback).",
            &[Test::ratio(
                best(PAPERS, || vec![feedback_name(0)]),
                best(PAPERS, || vec![feedback_name(1), feedback_name(2)]),
                Above(1.0),
            )],
        ),
        Claim::ours_timed(
            "compute",
            "A compute variant is faster than the best geometry shader in every view.",
            &[Test::ratio(
                best(PAPERS, || (0..=2).map(feedback_name).collect()),
                best(PAPERS, || compute_passes().map(|compact| compact.name().to_string()).collect()),
                Above(1.0),
            )],
        ),
        Claim::ours(
            "length",
            "Every variant's list has exactly the length that the reference counts.",
            &[
                Test::difference(others(LENGTHS[0], REFERENCE), one(LENGTHS[0], REFERENCE), Equal(0.0)),
                Test::difference(others(LENGTHS[1], REFERENCE), one(LENGTHS[1], REFERENCE), Equal(0.0)),
            ],
        ),
    ],
    ..Figure::BASE
};

/// Quantities: the time of stage 3 and the length of the list, by tile address.
const PAPERS: &str = "compact, level-0 tile addresses";
const NATIVE: &str = "compact, own-level tile addresses";
const LENGTHS: [&str; 2] = ["list length, level-0 tile addresses", "list length, own-level tile addresses"];
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

/// All variants that read the tile mask as an image, by name.
fn variants(address: TileAddress) -> Vec<(String, Config)> {
    let base = Config { address, ..PAPER };
    let blocks = (0..=2)
        .map(|compact_block_log2| (feedback_name(compact_block_log2), Config { compact_block_log2, ..base }));
    let marked = Config { dedup: Dedup::TestOr, ..base };
    blocks
        .chain(compute_passes().map(|compact| (compact.name().to_string(), Config { compact, ..marked })))
        .collect()
}

/// The variants as settings of a scene, with level-0 tile addresses.
fn settings() -> Vec<Setting> {
    let compact = Compaction::FusedAppend;
    let fused = (compact.name().to_owned(), Config { dedup: Dedup::FusedExact, compact, ..PAPER });
    let all = variants(TileAddress::Level0).into_iter().chain([fused]);
    all.map(|(name, config)| setting(name, &config)).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let stage1 = Stage1::draw(bench, &cell.scene)?;
    let requests = read_requests(&stage1.gpu, &stage1.footprint, &stage1.pyramid)?;
    let addresses = [(TileAddress::Level0, PAPERS), (TileAddress::OwnLevel, NATIVE)];
    let mut rows = Vec::new();
    for ((address, time), quantity) in addresses.into_iter().zip(LENGTHS) {
        let list = reference_list(&requests, &stage1.pyramid, address);
        let length = list.len();
        let counts = |name: &str, config: &Config| {
            let (_, ending) = time.split_once(',').expect("it names the tile address");
            of_stage_3((name, config), &list, &stage1.pyramid, &format!(",{ending}"))
        };
        rows.push(Row::number(REFERENCE, quantity, "triples", length as f64));
        let mut pairs = Vec::new();
        for (name, config) in variants(address) {
            let list_capacity = (length as u32).next_power_of_two();
            match Pair::new(&stage1, &name, Config { list_capacity, ..config }) {
                Err(why) => rows.push(Row::missing(name, time, why)),
                Ok(pair) => {
                    rows.extend(counts(&name, &config));
                    rows.push(Row::number(name, quantity, "triples", pair.triples(&stage1)?.len() as f64));
                    pairs.push(pair);
                }
            }
        }
        let contenders = pairs.iter().map(|pair| pair.compaction(&stage1, &pair.name));
        rows.extend(bench.times(&stage1.gpu, contenders, time)?);
        rows.extend(fused_append(bench, &cell.scene, &stage1, address, [time, quantity])?);
        if cell.scene != NOISE {
            let config = Config { compact: Compaction::FusedAppend, address, ..PAPER };
            rows.extend(counts(config.compact.name(), &config));
        }
    }
    Ok(rows)
}

/// The extra time of the exact fused draw when it also appends, and the length of its list, as rows of the quantities
/// `time` and `length`.
fn fused_append(
    bench: &Bench,
    scene: &str,
    stage1: &Stage1,
    address: TileAddress,
    [time, length]: [&str; 2],
) -> anyhow::Result<Vec<Row>> {
    let name = Compaction::FusedAppend.name();
    if scene == NOISE {
        return Ok(vec![Row::missing(
            name,
            time,
            "the noise has no mesh to draw: the host fills its request image",
        )]);
    }
    let of = |name, compact| {
        Combination::exact(name, Config { dedup: Dedup::FusedExact, compact, address, ..PAPER })
    };
    let (mask, appends) = ("marks", "marks and appends");
    let both = [of(mask, Compaction::Append), of(appends, Compaction::FusedAppend)];
    let mut frames = SideBySide::settled(bench, SceneView::find(scene)?, stage1.size, (&both, &[]), |_| ())?;
    if let Some((_, why)) = frames.missing.first() {
        return Ok(vec![Row::missing(name, time, why)]);
    }
    let timed = frames.times(bench)?;
    let pass = |variant: &str, label: &str| {
        timed.iter().find(|timed| timed.variant == variant)?.pass_of_rounds(label)
    };
    // Differences are taken per round. The resolution is an empty pass: a smaller difference counts as one empty pass.
    let more = || {
        let (with, without) = (pass(appends, "fused")?, pass(mask, "fused")?);
        let empty = pass("empty pass", "empty pass")?;
        Some(with.iter().zip(&without).zip(&empty).map(|((a, b), e)| (a - b).max(*e)).collect())
    };
    let (_, session) = frames.sessions.last().context("both run")?;
    let listed = session.records.last().context("a settled session has drawn")?.triples;
    Ok(vec![Row::of_rounds(name, time, "ms", more()), Row::number(name, length, "triples", listed as f64)])
}
