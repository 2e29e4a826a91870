//! vt.limit: the time of stages 2 and 3 relative to a lower bound, one copy of the request image.

use super::super::counts::{Requests, of_list};
use super::common::{PAPERS, SceneView, own_level_tiles, pixels_of, setting};
use super::cost::{LIST, ON_THE_HOST, list_of_rounds, list_row};
use super::side_by_side::{COMPUTE, Combination, ONE_DRAW, SideBySide, THE_PAPER, UNLISTED};
use super::stages::{Pair, Stage1};
use crate::figure::prelude::*;
use crate::math::pyramid::TileId;
use crate::paper::virtual_texture::read_back::{HostCopy, HostList, HostPass};
use crate::paper::virtual_texture::streaming::distinct_tiles;
use crate::paper::virtual_texture::{
    Compaction, Config, Dedup, Listing, PAPER, RequestFormat, TileAddress, read_requests,
};
use crate::stats::Summary;
use crate::vk::{BufferUse, TexelCopy};
use std::cell::RefCell;

pub const LIMIT: Figure = Figure {
    id: "vt.limit",
    title: "The distance to the physical limit",
    about: "Any method must read every pixel of the request image at least once. The figure divides the time of stages 2 \
            and 3 by the time of one copy of the packed request image (one word per pixel) within the device's memory, \
            and by the time of an empty pass. The levels are those of the paper's NA = 16. Each variant of stage 2 \
            runs with the variant of stage 3 that is fastest with it on this device. The paper's pair (section 2: \
            geometry shader over blocks of 8 x 8 pixels with memo, logic OR, transform feedback) uses level-0 tile \
            addresses, all others own-level ones. The fused variants have no request image, and the variants \
            named \"one draw\" write it in the texturing draw. Their times include the difference between their \
            texturing draw and the same draw without triples and marks. \"host-hash\" and \"host-bitmap\" are \
            read-back: the copy and the host's pass over it. No time includes reading the list back. All variants take \
            turns; ratios and differences are taken in each round. The figure also counts, from the request image, the \
            texels and words that are read, the tests, the atomics, and the bytes of the list.",
    scenes: &["earth/headline", "earth/oblique", "globe/africa"],
    variants,
    paper: &["paper"],
    ours: &["runs"],
    full_only: &[],
    sweep: Some(Sweep { name: "picture height, pixels", quick: &[720.0], full: &[720.0, 1080.0] }),
    show: Show::scenes(PAPERS).variants(settings),
    measure,
    plots: &[Plot::bars(LIST).log_y().floor(COPY), Plot::bars(COPIES).log_y()],
    claims: &[
        Claim::ours_timed(
            "three-times",
            "The best exact variant finds the list at least 3 times faster than the paper's best.",
            &[Test::ratio(one(LIST, THE_PAPER), best(LIST, ours), AtLeast(3.0))],
        ),
        Claim::ours_timed(
            "four-copies",
            "The best exact variant on the device takes at most 4 times as long as one copy of the packed request \
             image in the device's memory.",
            &[Test::ratio(best(LIST, ours), one(LIST, COPY), AtMost(4.0))],
        ),
        Claim::ours(
            "exact",
            "Every variant lists the same tiles, each once.",
            &[Test::value(every(WRONG), Equal(0.0))],
        ),
    ],
};

const COPIES: &str = "stages 2 and 3 over one copy of the request image";
const EMPTY_PASSES: &str = "stages 2 and 3 over an empty pass";
const WRONG: &str = "tiles too many or too few";
const COPY: &str = "copy of the request image";

/// Names of the device's variants of stage 2, all with own-level tile addresses. The paper's pair is separate.
fn on_the_device() -> Vec<String> {
    Dedup::staged().map(|dedup| dedup.name().to_string()).collect()
}

/// The exact variants that find the tiles while they texture: fused, with and without stage 3 as a pass, and one draw
/// that stores the triples.
fn texturing() -> Vec<Combination> {
    let fused =
        |name, compact| Combination::exact(name, Config { dedup: Dedup::FusedExact, compact, ..COMPUTE });
    let one_draw = |name, dedup| Combination::exact(name, Config { dedup, ..ONE_DRAW });
    vec![
        fused("fused-exact", Compaction::Append),
        fused("fused-exact, fused-append", Compaction::FusedAppend),
        one_draw("one draw, runs", Dedup::Runs),
        one_draw("one draw, mark-bytes", Dedup::MarkBytes),
    ]
}

fn names_of_texturing() -> impl Iterator<Item = String> {
    texturing().into_iter().map(|combination| combination.name.to_string())
}

fn variants() -> Vec<String> {
    let host = [Listing::HostHash, Listing::HostBitmap].map(|list| list.name().to_string());
    let staged = [THE_PAPER.to_string()].into_iter().chain(on_the_device());
    staged.chain(names_of_texturing()).chain(host).chain([COPY.to_string()]).collect()
}

/// The variants as settings of a scene.
fn settings() -> Vec<Setting> {
    let staged = Dedup::staged().map(|dedup| setting(dedup.name(), &Config { dedup, ..COMPUTE }));
    let texturing = texturing();
    let texturing = texturing.iter().map(|combination| setting(combination.name, &combination.config));
    let host = [Listing::HostHash, Listing::HostBitmap];
    let host = host.map(|list| setting(list.name(), &Config { list, ..COMPUTE }));
    [setting(THE_PAPER, &PAPER)].into_iter().chain(staged).chain(texturing).chain(host).collect()
}

/// The tiles that a pair lists, sorted. With own-level tile addresses, repeats are kept.
fn tiles(pair: &Pair, stage1: &Stage1) -> anyhow::Result<Vec<TileId>> {
    let triples = pair.triples(stage1)?;
    Ok(match pair.config.address {
        TileAddress::Level0 => {
            distinct_tiles(&triples, TileAddress::Level0, stage1.pyramid.first_resident_level())
        }
        TileAddress::OwnLevel => own_level_tiles(&triples),
    })
}

/// `dedup` with the variant of stage 3 that is fastest with it on this device, or the reason why none runs.
fn fastest_behind(bench: &Bench, stage1: &Stage1, dedup: Dedup) -> anyhow::Result<Result<Pair, String>> {
    let config = |compact| Config {
        dedup,
        compact,
        address: TileAddress::OwnLevel,
        request_format: Some(RequestFormat::Packed),
        ..PAPER
    };
    let (pairs, reasons): (Vec<_>, Vec<_>) = Compaction::ALL
        .iter()
        .map(|&compact| Pair::new(stage1, dedup.name(), config(compact)))
        .partition(|pair| pair.is_ok());
    let mut pairs: Vec<Pair> = pairs.into_iter().flatten().collect();
    if pairs.len() > 1 {
        // Runs stage 2 once for each pair, then times stage 3 alone.
        let compactions = pairs
            .iter()
            .map(|pair| pair.triples(stage1).map(|_| pair.compaction(stage1, pair.config.compact.name())));
        let compactions = compactions.collect::<anyhow::Result<Vec<_>>>()?;
        let timed = bench.interleave(&stage1.gpu, compactions)?;
        let ms = |pair: &Pair| {
            let timed = timed.iter().find(|timed| timed.variant == pair.config.compact.name());
            timed.and_then(|timed| timed.total).map_or(f64::INFINITY, |total| total.median)
        };
        pairs.sort_by(|a, b| ms(a).total_cmp(&ms(b)));
    }
    let why = || reasons.into_iter().find_map(Result::err).unwrap_or_else(|| "no variant of stage 3".into());
    Ok(pairs.into_iter().next().ok_or_else(why))
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = pixels_of(cell.x.expect("the sweep has values"));
    let stage1 = Stage1::draw_at(bench, &cell.scene, size)?;
    let paper = Config { request_format: Some(RequestFormat::Packed), ..PAPER };
    let mut pairs = vec![Pair::new(&stage1, THE_PAPER, paper)];
    if let Some(Ok(pair)) = pairs.first() {
        // A list that is too short grows before it is timed.
        pair.triples(&stage1)?;
    }
    for dedup in Dedup::staged() {
        pairs.push(fastest_behind(bench, &stage1, dedup)?);
    }
    let mut rows = Vec::new();
    for (pair, name) in pairs.iter().zip(variants()) {
        rows.push(match pair {
            Ok(pair) => Row::new(&*name, "stage 3", "", Value::Text(pair.config.compact.name().into())),
            Err(why) => Row::missing(&*name, LIST, why.clone()),
        });
    }
    let pairs: Vec<Pair> = pairs.into_iter().flatten().collect();
    let frames = (&*texturing(), FLOORS);
    let mut frames = SideBySide::settled(bench, SceneView::find(&cell.scene)?, size, frames, |_| ())?;
    rows.extend(frames.missing_rows(LIST));
    rows.extend(times(bench, &stage1, &pairs, &mut frames)?);
    rows.extend(frames.counts()?);
    let Stage1 { gpu, pyramid, footprint, .. } = &stage1;
    let requests = Requests { triples: &read_requests(gpu, footprint, pyramid)?, size, pyramid };
    for pair in &pairs {
        rows.extend(of_list(gpu, (&pair.name, &pair.config), &requests, Some(footprint))?);
    }
    Ok(rows)
}

/// Frames without a list that are timed together with the variants that texture.
const FLOORS: &[&str] = &[UNLISTED];

/// Times all contenders in turn and compares their lists.
fn times(
    bench: &Bench,
    stage1: &Stage1,
    pairs: &[Pair],
    frames: &mut SideBySide,
) -> anyhow::Result<Vec<Row>> {
    let (gpu, requests) = (&stage1.gpu, &stage1.footprint.requests);
    let copy = HostCopy::new(gpu, stage1.size, RequestFormat::Packed)?;
    let host = |pass| {
        HostList::new(pass, &stage1.pyramid, RequestFormat::Packed, TileAddress::OwnLevel).map(RefCell::new)
    };
    let lists = [(Listing::HostHash, host(HostPass::Hash)?), (Listing::HostBitmap, host(HostPass::Bitmap)?)];
    let mut contenders: Vec<Contender> = pairs.iter().map(|pair| pair.contender(stage1)).collect();
    contenders.extend(lists.iter().map(|(list, host)| {
        let bring = Contender::frame(gpu, list.name(), |frame| {
            frame.pass("copy request image", |cmd| copy.run(cmd, requests))
        });
        bring.and_host(ON_THE_HOST, || host.borrow_mut().list(&copy.words()))
    }));
    let place =
        gpu.buffer(COPY, 4 * u64::from(stage1.size[0]) * u64::from(stage1.size[1]), BufferUse::Storage)?;
    let whole = TexelCopy { offset: 0, mip: 0, layer: 0, at: [0; 2], size: stage1.size };
    contenders.push(Contender::frame(gpu, COPY, move |frame| {
        frame.pass(COPY, |cmd| cmd.copy_from_image(requests, &place, &[whole]))
    }));
    contenders.extend(frames.contenders()?);
    let timed = bench.interleave(gpu, contenders)?;
    let mut rows: Vec<Row> = timed.iter().flat_map(|of| time_rows(of, &timed)).collect();
    let exact = own_level_tiles(&lists[1].1.borrow_mut().list(&copy.words()));
    rows.push(Row::number(COPY, "visible tiles", "tiles", exact.len() as f64));
    for pair in pairs {
        let wrong = differing(&tiles(pair, stage1)?, &exact);
        rows.push(Row::number(&*pair.name, WRONG, "tiles", wrong as f64));
    }
    for (name, session) in &frames.sessions {
        let record = session.records.last().context("a settled session has drawn")?;
        // With own-level tile addresses, a list longer than its distinct tiles has a repeat.
        let twice = record.triples - record.visible.len();
        let wrong = differing(&record.visible, &exact) + twice;
        rows.push(Row::number(&**name, WRONG, "tiles", wrong as f64));
    }
    Ok(rows)
}

/// Number of entries of two sorted lists that are in one list only.
fn differing(a: &[TileId], b: &[TileId]) -> usize {
    let (mut at, mut matched) = (0, 0);
    for tile in a {
        while at < b.len() && b[at] < *tile {
            at += 1;
        }
        if at < b.len() && b[at] == *tile {
            matched += 1;
            at += 1;
        }
    }
    a.len() + b.len() - 2 * matched
}

/// Rows of a contender's time, its passes, and its ratios to a copy and to an empty pass of the same round. For a frame
/// that also textures, only the list's time counts. The frame without a list has only the rows of its passes.
fn time_rows(timed: &Timed, others: &[Timed]) -> Vec<Row> {
    let textures = timed.pass("fused").is_some();
    let own = if textures { list_of_rounds(timed, others) } else { timed.total_of_rounds() };
    let mut rows = Vec::from_iter(list_row(timed, others));
    if rows.is_empty() && !textures {
        rows.push(timed.row(LIST));
    }
    if timed.passes.len() > 1 {
        rows.extend(timed.pass_rows());
    }
    let ratio = |(quantity, name): (&str, &str)| {
        let floor = others.iter().find(|other| other.variant == name)?;
        let over = Summary::of_pairs(own.as_ref()?, &floor.total_of_rounds()?, |own, floor| own / floor)?;
        Some(Row::new(&*timed.variant, quantity, "", Value::Summary(over)))
    };
    rows.extend([(COPIES, COPY), (EMPTY_PASSES, "empty pass")].into_iter().filter_map(ratio));
    rows
}

/// All variants on the device except the paper's.
fn ours() -> Vec<String> {
    let staged = on_the_device().into_iter().filter(|name| name != Dedup::Geometry.name());
    staged.chain(names_of_texturing()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_additional_missing_or_repeated_tile_is_a_difference() {
        let tile = |column| TileId { level: 0, row: 0, column };
        let exact = [tile(1), tile(2), tile(3)];
        assert_eq!(differing(&exact, &exact), 0);
        assert_eq!(differing(&[tile(1), tile(3)], &exact), 1);
        assert_eq!(differing(&[tile(1), tile(2), tile(2), tile(3)], &exact), 1);
        assert_eq!(differing(&[tile(0), tile(2), tile(3)], &exact), 2);
        assert_eq!(differing(&[], &exact), 3);
    }
}
