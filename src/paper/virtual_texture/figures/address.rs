//! vt.address: length and cost of the list with level-0 and with own-level tile addresses.

use super::super::counts::{Requests, of_list};
use super::common::{PAPERS, pixels_of, setting};
use super::cost::ON_THE_HOST;
use super::stages::{Pair, Stage1};
use crate::figure::prelude::*;
use crate::paper::virtual_texture::streaming::distinct_tiles;
use crate::paper::virtual_texture::{Config, PAPER, RequestFormat, TileAddress, read_requests};

pub const ADDRESS: Figure = Figure {
    id: "vt.address",
    title: "Tile addresses of level 0 and of each tile's own level",
    about: "The paper's tile mask keeps (i, j) in level 0's grid (section 2.2). So the list can name a tile of level q \
            up to 4^q times, once per cell, and the host must remove the repeats. Own-level tile addresses set bit q \
            of texel (i >> q, j >> q) instead: one bit per tile. The figure compares the lengths of both lists, the \
            time of stages 2 and 3 (the paper's shaders over blocks of 8 x 8 pixels, with memo) and the host's time to \
            turn triples into sorted, distinct tiles. The levels are those of the paper's NA = 16. Quick and full runs \
            differ only in the picture heights.",
    scenes: &["globe/africa", "earth/oblique"],
    variants: names,
    paper: &["level-0"],
    ours: &["own-level"],
    full_only: &[],
    // Quick runs include 1080 rows, because the claim needs them. A frame takes 60 ms; a length needs no repetition.
    sweep: Some(Sweep {
        name: "picture height, pixels",
        quick: &[360.0, 720.0, 1080.0],
        full: &[360.0, 540.0, 720.0, 1080.0, 1440.0, 2160.0],
    }),
    show: Show::scenes(PAPERS)
        .variants(|| VARIANTS.map(|(name, config)| setting(name, &config)).into()),
    measure,
    plots: &[
        Plot::sweep(LENGTH).log_y(),
        Plot::sweep(ON_THE_HOST).log_y(),
        Plot::sweep(STAGES).log_y(),
    ],
    claims: &[
        Claim::ours(
            "own-level-exact",
            "The list of own-level addresses has one entry per distinct visible tile, and both lists name the same \
             tiles.",
            &[
                Test::difference(one(LENGTH, "own-level"), one(TILES, "own-level"), Equal(0.0)),
                Test::value(each(SAME, names), Equal(0.0)),
            ],
        ),
        Claim::ours(
            "globe-500",
            "Seen from 20 000 km at 1920 x 1080, the list of own-level addresses is at least 500 times shorter than \
             the paper's.",
            &[Test::ratio_of(LENGTH, ["level-0", "own-level"], AtLeast(500.0))],
        )
        .at(Places::scenes(&["globe/africa"]).x(1080.0, 1080.0)),
        Claim::ours_timed(
            "host-work",
            "Own-level addresses also reduce the host's work on the list.",
            &[Test::ratio_of(ON_THE_HOST, ["level-0", "own-level"], Above(1.0))],
        ),
    ],
};

const LENGTH: &str = "list length";
const STAGES: &str = "stages 2 and 3";
const TILES: &str = "distinct tiles";
const SAME: &str = "tiles that the other tile address does not name";
const VARIANTS: [(&str, Config); 2] = [
    ("level-0", Config { address: TileAddress::Level0, ..PAPER }),
    ("own-level", Config { address: TileAddress::OwnLevel, ..PAPER }),
];

fn names() -> Vec<String> {
    VARIANTS.map(|(name, _)| name.to_owned()).into()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let stage1 = Stage1::draw_at(bench, &cell.scene, pixels_of(cell.x.expect("the sweep has values")))?;
    let (gpu, pyramid) = (&stage1.gpu, &stage1.pyramid);
    let pair = |(name, config)| {
        Pair::new(&stage1, name, Config { request_format: Some(RequestFormat::Packed), ..config })
    };
    let pairs = match VARIANTS.into_iter().map(pair).collect::<Result<Vec<_>, _>>() {
        Ok(pairs) => pairs,
        Err(why) => return Ok(VARIANTS.map(|(name, _)| Row::missing(name, LENGTH, why.clone())).into()),
    };
    let lists: Vec<_> = pairs.iter().map(|pair| pair.triples(&stage1)).collect::<anyhow::Result<_>>()?;
    let mut rows = Vec::new();
    let first_resident = pyramid.first_resident_level();
    let tiles = [0, 1].map(|n| distinct_tiles(&lists[n], pairs[n].config.address, first_resident));
    for (n, (name, _)) in VARIANTS.into_iter().enumerate() {
        let number = |quantity, unit, count: usize| Row::number(name, quantity, unit, count as f64);
        let alone = tiles[n].iter().filter(|tile| tiles[1 - n].binary_search(tile).is_err()).count();
        rows.push(number(LENGTH, "triples", lists[n].len()));
        rows.push(number(TILES, "tiles", tiles[n].len()));
        rows.push(number(SAME, "tiles", alone));
    }
    let requested = read_requests(gpu, &stage1.footprint, pyramid)?;
    let requests = Requests { triples: &requested, size: stage1.size, pyramid };
    for pair in &pairs {
        rows.extend(of_list(gpu, (&pair.name, &pair.config), &requests, Some(&stage1.footprint))?);
    }
    let contenders = pairs.iter().enumerate().map(|(n, pair)| {
        let (triples, address) = (&lists[n], pair.config.address);
        let tiles = move || distinct_tiles(triples, address, first_resident);
        pair.contender(&stage1).and_host(ON_THE_HOST, tiles)
    });
    let timed = bench.interleave(gpu, contenders.collect())?;
    rows.extend(timed.iter().flat_map(time_rows));
    Ok(rows)
}

fn time_rows(timed: &Timed) -> Vec<Row> {
    // The sum of both passes in each round.
    let [dedup, compact] = ["dedup", "compact"].map(|label| timed.pass_of_rounds(label));
    let both =
        dedup.zip(compact).map(|(dedup, compact)| dedup.iter().zip(&compact).map(|(a, b)| a + b).collect());
    let stages = Row::of_rounds(&timed.variant, STAGES, "ms", both);
    timed.pass_rows().chain([Row { work: timed.work(&["dedup", "compact"]), ..stages }]).collect()
}
