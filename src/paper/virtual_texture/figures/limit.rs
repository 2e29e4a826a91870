//! vt.limit: how far stages 2 and 3 are from what the device cannot do without: bringing `U1` to the host once.

use super::common::{Place, passes, pixels_of};
use super::cost::{LIST, list_of_rounds, list_row};
use super::list_on_the_host::and_list;
use super::side_by_side::{COMPUTE, Combination, SideBySide, THE_PAPER, UNLISTED};
use super::stages::Stage1;
use crate::figure::claim::{Bound::AtLeast, Bound::AtMost, Bound::Equal, Claim, Test, best, every, one};
use crate::figure::{Bench, Cell, Contender, Figure, Plot, Row, Sweep, Timed, Value};
use crate::math::pyramid::TileId;
use crate::paper::virtual_texture::classic::{HostCopy, HostList, HostPass};
use crate::paper::virtual_texture::compact::CompactPass;
use crate::paper::virtual_texture::dedup::DedupPass;
use crate::paper::virtual_texture::list::List;
use crate::paper::virtual_texture::marks::Marks;
use crate::paper::virtual_texture::streaming::distinct_tiles;
use crate::paper::virtual_texture::{Compaction, Config, Dedup, Keying, Listing, PAPER, U1Format};
use crate::stats::Summary;
use anyhow::Context;
use std::cell::RefCell;

pub const LIMIT: Figure = Figure {
    id: "vt.limit",
    title: "The distance to the physical limit",
    about: "Whoever lists the visible tiles must at least read every pixel of U1 once. How many times longer than one copy \
            of U1 (packed, a word a pixel) into the host's memory do stages 2 and 3 take together, in each variant of \
            stage 2 with the variant of stage 3 that is the fastest behind it here, and how many times an empty pass? The \
            paper's own (section 2: geometry shader with p = 3 and memo, logic OR, transform feedback) has its own keying, \
            all others the native one. The fused ones have no U1: their share is what the draw that textures takes longer \
            than the same draw, once and with nothing marked. \"host-hash\" and \"host-bitmap\" are the classic: that copy and the \
            host's pass over it. Reading the list back is in none of them. All take turns, and ratios and differences are taken in \
            each turn.",
    scenes: &["earth/headline", "earth/oblique", "globe/africa"],
    variants,
    sweep: Some(Sweep { name: "picture height, pixels", quick: &[720.0], full: &[720.0, 1080.0] }),
    measure,
    plots: &[
        Plot::bars(LIST).log_y().floor(COPY),
        Plot::bars(COPIES).log_y(),
    ],
    claims: &[
        Claim::ours(
            "three-times",
            "The best exact variant finds the list at least 3 times cheaper than the paper's best.",
            &[Test::ratio(one(LIST, THE_PAPER), best(LIST, ours), AtLeast(3.0))],
        )
        .timed(),
        Claim::ours(
            "four-copies",
            "The best exact variant on the device takes at most 4 times as long as one copy of packed U1 to the host.",
            &[Test::ratio(best(LIST, ours), one(LIST, COPY), AtMost(4.0))],
        )
        .timed(),
        Claim::ours(
            "exact",
            "Every variant lists the same tiles, and each once.",
            &[Test::value(every(WRONG), Equal(0.0))],
        ),
    ],
};

const COPIES: &str = "over one copy of U1";
const EMPTY_PASSES: &str = "over an empty pass";
const WRONG: &str = "tiles too many or too few";
const COPY: &str = "copy of U1";

/// The device's variants of stage 2, by name, all with native keying; the paper's own is apart.
fn on_the_device() -> Vec<String> {
    Dedup::staged().map(|dedup| dedup.name().to_string()).collect()
}

/// The exact fused ones, by name, with stage 3 as a pass and without one.
fn fused() -> Vec<Combination> {
    let of = |name, compact| {
        let config = Config { dedup: Dedup::FusedExact, compact, ..COMPUTE };
        Combination { name, config, exact: true }
    };
    vec![of("fused-exact", Compaction::Append), of("fused-exact, fused-append", Compaction::FusedAppend)]
}

fn fused_names() -> impl Iterator<Item = String> {
    fused().into_iter().map(|combination| combination.name.to_string())
}

fn variants() -> Vec<String> {
    let host = [Listing::HostHash, Listing::HostBitmap].map(|list| list.name().to_string());
    let staged = [THE_PAPER.to_string()].into_iter().chain(on_the_device());
    staged.chain(fused_names()).chain(host).chain([COPY.to_string()]).collect()
}

/// Stages 2 and 3 of one variant, with room for a list.
struct Pair {
    name: String,
    config: Config,
    dedup: DedupPass,
    compact: CompactPass,
    marks: Marks,
    list: RefCell<List>,
}

impl Pair {
    fn new(stage1: &Stage1, name: &str, config: Config) -> Result<Pair, String> {
        if let Some(why) = stage1.lacks(&config) {
            return Err(why);
        }
        let (gpu, pyramid) = (&stage1.gpu, &stage1.pyramid);
        let make = || {
            let dedup = DedupPass::new(gpu, pyramid, &config, &stage1.footprint)?;
            let compact = CompactPass::new(gpu, pyramid, &config)?;
            let (marks, list) = (dedup.marks(gpu)?, compact.list(gpu, u64::from(config.list_capacity))?);
            Ok(Pair { name: name.to_string(), config, dedup, compact, marks, list: RefCell::new(list) })
        };
        make().map_err(|error: crate::vk::Error| error.to_string())
    }

    fn contender<'a>(&'a self, stage1: &'a Stage1, name: String) -> Contender<'a> {
        passes(&stage1.gpu, name, |frame| {
            frame.pass("dedup", |cmd| self.dedup.run(cmd, &stage1.footprint.u1, &self.marks))?;
            frame.pass("compact", |cmd| self.compact.run(cmd, &self.marks, &self.list.borrow()))
        })
    }

    /// The tiles that the pair lists, sorted; a tile listed twice is there twice where the keying is native.
    fn tiles(&self, stage1: &Stage1) -> anyhow::Result<Vec<TileId>> {
        let mut list = self.list.borrow_mut();
        let mut frame = stage1.gpu.frame()?;
        frame.pass("dedup", |cmd| self.dedup.run(cmd, &stage1.footprint.u1, &self.marks))?;
        frame.pass("compact", |cmd| self.compact.run(cmd, &self.marks, &list))?;
        frame.pass("read-back", |cmd| {
            list.read_back(cmd);
            Ok(())
        })?;
        frame.submit()?.wait()?;
        let (triples, _) = self.compact.collect(&stage1.gpu, &self.marks, &mut list)?;
        Ok(match self.config.keying {
            Keying::Paper => distinct_tiles(&triples, Keying::Paper, stage1.pyramid.first_resident_level()),
            Keying::Native => native(&triples),
        })
    }
}

fn native(triples: &[[u32; 3]]) -> Vec<TileId> {
    let mut tiles: Vec<TileId> =
        triples.iter().map(|&[level, row, column]| TileId { level, row, column }).collect();
    tiles.sort_unstable();
    tiles
}

/// The variant of stage 3 that is the fastest behind `dedup` here; why there is none.
fn fastest_behind(bench: &Bench, stage1: &Stage1, dedup: Dedup) -> anyhow::Result<Result<Pair, String>> {
    let config =
        |compact| Config { dedup, compact, keying: Keying::Native, u1: Some(U1Format::Packed), ..PAPER };
    let (pairs, reasons): (Vec<_>, Vec<_>) = Compaction::ALL
        .iter()
        .map(|&compact| Pair::new(stage1, dedup.name(), config(compact)))
        .partition(|pair| pair.is_ok());
    let mut pairs: Vec<Pair> = pairs.into_iter().flatten().collect();
    if pairs.len() > 1 {
        // Stage 2 once for each, then stage 3 alone.
        let compactions = pairs.iter().map(|pair| {
            let compact = passes(&stage1.gpu, pair.config.compact.name(), |frame| {
                frame.pass("compact", |cmd| pair.compact.run(cmd, &pair.marks, &pair.list.borrow()))
            });
            pair.tiles(stage1).map(|_| compact)
        });
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
    let paper = Config { u1: Some(U1Format::Packed), ..PAPER };
    let mut pairs = vec![Pair::new(&stage1, THE_PAPER, paper)];
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
    let fused = (&*fused(), FLOORS);
    let mut fused = SideBySide::settled(bench, Place::find(&cell.scene)?, size, fused, |_| ())?;
    let missing = fused.missing.iter();
    rows.extend(missing.map(|(name, why)| Row::missing(&**name, LIST, why.clone())));
    rows.extend(times(bench, &stage1, &pairs, &mut fused)?);
    Ok(rows)
}

/// Frames without a list that are timed with the fused ones.
const FLOORS: &[&str] = &[UNLISTED];

/// All contenders in turn, and what each of them lists.
fn times(bench: &Bench, stage1: &Stage1, pairs: &[Pair], fused: &mut SideBySide) -> anyhow::Result<Vec<Row>> {
    let (gpu, u1) = (&stage1.gpu, &stage1.footprint.u1);
    let copy = HostCopy::new(gpu, stage1.size, U1Format::Packed)?;
    let host =
        |pass| HostList::new(pass, &stage1.pyramid, U1Format::Packed, Keying::Native).map(RefCell::new);
    let lists = [(Listing::HostHash, host(HostPass::Hash)?), (Listing::HostBitmap, host(HostPass::Bitmap)?)];
    let bring = |name: &str| {
        passes(gpu, name, |frame| {
            frame.pass("copy U1", |cmd| {
                copy.run(cmd, u1);
                Ok(())
            })
        })
    };
    let mut contenders: Vec<Contender> =
        pairs.iter().map(|pair| pair.contender(stage1, pair.name.clone())).collect();
    contenders.extend(lists.iter().map(|(list, host)| and_list(bring(list.name()), host, || copy.words())));
    contenders.push(bring(COPY));
    contenders.extend(fused.contenders()?);
    let timed = bench.interleave(gpu, contenders)?;
    let mut rows: Vec<Row> = timed.iter().flat_map(|of| time_rows(of, &timed)).collect();
    let exact = native(&lists[1].1.borrow_mut().list(copy.words()));
    rows.push(Row::number(COPY, "visible tiles", "tiles", exact.len() as f64));
    for pair in pairs {
        let wrong = differing(&pair.tiles(stage1)?, &exact);
        rows.push(Row::number(&*pair.name, WRONG, "tiles", wrong as f64));
    }
    for (name, session) in &fused.sessions {
        let record = session.records.last().context("a settled session has drawn")?;
        // Native keying: a tile listed twice makes the list longer than its tiles.
        let twice = record.triples - record.visible.len();
        let wrong = differing(&record.visible, &exact) + twice;
        rows.push(Row::number(&**name, WRONG, "tiles", wrong as f64));
    }
    Ok(rows)
}

/// How many entries of two sorted lists have no partner in the other.
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

/// A contender's time, its passes, and how many times a copy and an empty pass of the same round it takes. Of a frame
/// that also textures the list's share counts, and the frame without a list is no contender.
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

/// All of the device's variants but the paper's shader.
fn ours() -> Vec<String> {
    let staged = on_the_device().into_iter().filter(|name| name != Dedup::Geometry.name());
    staged.chain(fused_names()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_more_less_or_twice_is_a_difference() {
        let tile = |column| TileId { level: 0, row: 0, column };
        let exact = [tile(1), tile(2), tile(3)];
        assert_eq!(differing(&exact, &exact), 0);
        assert_eq!(differing(&[tile(1), tile(3)], &exact), 1);
        assert_eq!(differing(&[tile(1), tile(2), tile(2), tile(3)], &exact), 1);
        assert_eq!(differing(&[tile(0), tile(2), tile(3)], &exact), 2);
        assert_eq!(differing(&[], &exact), 3);
    }
}
