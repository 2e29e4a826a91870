//! vt.keying: how long the list is, and what it costs, with the paper's keying and with the native one.

use super::common::{passes, pixels_of};
use super::list_on_the_host::{ON_THE_HOST, host_pass};
use super::stages::Stage1;
use crate::figure::claim::{Bound::Above, Bound::AtLeast, Bound::Equal, Claim, Places, Test, each, one};
use crate::figure::{Bench, Cell, Contender, Figure, Plot, Row, Sweep, Timed};
use crate::paper::virtual_texture::compact::CompactPass;
use crate::paper::virtual_texture::dedup::DedupPass;
use crate::paper::virtual_texture::streaming::distinct_tiles;
use crate::paper::virtual_texture::{Config, Keying, PAPER, U1Format};

pub const KEYING: Figure = Figure {
    id: "vt.keying",
    title: "Paper's keying and native keying",
    about: "The paper's U2 keeps (i, j) in level 0's grid (section 2.2), so that U3 can list a tile of level q once for \
            each of its 4^q cells, and the host must find the repeats. Native keying sets bit q of texel \
            (i >> q, j >> q) instead: one bit is one tile. How long are the lists, and what do both cost in stages 2 and 3 \
            (the paper's shaders, p = 3, memo) and on the host (the triples become tiles, sorted, each once: what A1 \
            starts from)? Quick and full runs look alike but for the heights.",
    scenes: &["globe/africa", "earth/oblique"],
    variants,
    // 1080 also when quick: the claim is about it, a list's length needs no repetition, and a frame of it 60 ms.
    sweep: Some(Sweep {
        name: "picture height, pixels",
        quick: &[360.0, 720.0, 1080.0],
        full: &[360.0, 540.0, 720.0, 1080.0, 1440.0, 2160.0],
    }),
    measure,
    plots: &[
        Plot::sweep(LENGTH).log_y(),
        Plot::sweep(ON_THE_HOST).log_y(),
        Plot::sweep(STAGES).log_y(),
    ],
    claims: &[
        Claim::ours(
            "native-exact",
            "The native list is as long as there are distinct visible tiles, and both lists name the same tiles.",
            &[
                Test::difference(one(LENGTH, "native"), one(TILES, "native"), Equal(0.0)),
                Test::value(each(SAME, variants), Equal(0.0)),
            ],
        ),
        Claim::ours(
            "globe-500",
            "Seen from 20 000 km at 1920 x 1080, the native list is at least 500 times shorter than the paper's.",
            &[Test::ratio(one(LENGTH, "paper"), one(LENGTH, "native"), AtLeast(500.0))],
        )
        .at(Places::scenes(&["globe/africa"]).x(1080.0, 1080.0)),
        Claim::ours(
            "host-work",
            "The host's work on the list shrinks with it.",
            &[Test::ratio(one(ON_THE_HOST, "paper"), one(ON_THE_HOST, "native"), Above(1.0))],
        )
        .timed(),
    ],
};

const LENGTH: &str = "list length";
const STAGES: &str = "stages 2 and 3";
const TILES: &str = "distinct tiles";
const SAME: &str = "tiles that the other keying does not name";
const NAMES: [&str; 2] = ["paper", "native"];

fn variants() -> Vec<String> {
    NAMES.map(String::from).into()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let stage1 = Stage1::draw_at(bench, &cell.scene, pixels_of(cell.x.expect("the sweep has values")))?;
    let (gpu, pyramid, u1) = (&stage1.gpu, &stage1.pyramid, &stage1.footprint.u1);
    let config = |keying| Config { u1: Some(U1Format::Packed), keying, ..PAPER };
    let keyings = [Keying::Paper, Keying::Native];
    if let Some(why) = stage1.lacks(&config(Keying::Paper)) {
        return Ok(NAMES.map(|name| Row::missing(name, LENGTH, why.clone())).into());
    }
    let (mut rows, mut lists) = (Vec::new(), Vec::new());
    let mut stages = Vec::new();
    for keying in keyings {
        let config = config(keying);
        let dedup = DedupPass::new(gpu, pyramid, &config, &stage1.footprint)?;
        let compact = CompactPass::new(gpu, pyramid, &config)?;
        let marks = dedup.marks(gpu)?;
        let mut list = compact.list(gpu, u64::from(config.list_capacity))?;
        let mut frame = gpu.frame()?;
        frame.pass("dedup", |cmd| dedup.run(cmd, u1, &marks))?;
        frame.pass("compact", |cmd| compact.run(cmd, &marks, &list))?;
        frame.pass("read-back", |cmd| {
            list.read_back(cmd);
            Ok(())
        })?;
        frame.submit()?.wait()?;
        lists.push(compact.collect(gpu, &marks, &mut list)?.0);
        stages.push((dedup, compact, marks, list));
    }
    let first_resident = pyramid.first_resident_level();
    let tiles = [0, 1].map(|n| distinct_tiles(&lists[n], keyings[n], first_resident));
    for (n, name) in NAMES.into_iter().enumerate() {
        let number = |quantity, unit, count: usize| Row::number(name, quantity, unit, count as f64);
        let alone = tiles[n].iter().filter(|tile| tiles[1 - n].binary_search(tile).is_err()).count();
        rows.push(number(LENGTH, "triples", lists[n].len()));
        rows.push(number(TILES, "tiles", tiles[n].len()));
        rows.push(number(SAME, "tiles", alone));
    }
    let contenders = stages.iter().enumerate().map(|(n, (dedup, compact, marks, list))| {
        let mut on_the_device = passes(gpu, NAMES[n], |frame| {
            frame.pass("dedup", |cmd| dedup.run(cmd, u1, marks))?;
            frame.pass("compact", |cmd| compact.run(cmd, marks, list))
        });
        let (triples, keying) = (&lists[n], keyings[n]);
        let run = move || {
            let mut times = (on_the_device.run)()?;
            times.push(host_pass(|| distinct_tiles(triples, keying, first_resident)));
            Ok(times)
        };
        Contender { variant: NAMES[n].into(), run: Box::new(run) }
    });
    let timed = bench.interleave(gpu, contenders.collect())?;
    rows.extend(timed.iter().flat_map(time_rows));
    Ok(rows)
}

fn time_rows(timed: &Timed) -> Vec<Row> {
    // Both passes of each round together.
    let [dedup, compact] = ["dedup", "compact"].map(|label| timed.pass_of_rounds(label));
    let both =
        dedup.zip(compact).map(|(dedup, compact)| dedup.iter().zip(&compact).map(|(a, b)| a + b).collect());
    timed.pass_rows().chain([Row::of_rounds(&timed.variant, STAGES, "ms", both)]).collect()
}
