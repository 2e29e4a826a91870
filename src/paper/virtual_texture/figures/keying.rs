//! vt.keying: how long the list is, and what it costs, with the paper's keying and with the native one.

use super::common::{passes, pixels_of};
use super::judge::{Bound, judge, ratios, why_none};
use super::list_on_the_host::{ON_THE_HOST, host_pass};
use super::stages::Stage1;
use crate::figure::{
    Axis, Bench, Cell, Claim, Contender, Figure, Finding, Origin, Plot, Row, Sweep, Table, Timed, Value,
    Verdict,
};
use crate::paper::virtual_texture::compact::CompactPass;
use crate::paper::virtual_texture::dedup::DedupPass;
use crate::paper::virtual_texture::streaming::distinct_tiles;
use crate::paper::virtual_texture::{Config, Keying, PAPER, U1Format};
use crate::stats::Summary;

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
        Plot { quantity: LENGTH, x: Axis::Sweep, log_x: false, log_y: true, floor: None },
        Plot { quantity: ON_THE_HOST, x: Axis::Sweep, log_x: false, log_y: true, floor: None },
        Plot { quantity: STAGES, x: Axis::Sweep, log_x: false, log_y: true, floor: None },
    ],
    claims: &[
        Claim {
            id: "native-exact",
            text: "The native list is as long as there are distinct visible tiles, and both lists name the same tiles.",
            from: Origin::Ours,
            check: native_exact,
        },
        Claim {
            id: "globe-500",
            text: "Seen from 20 000 km at 1920 x 1080, the native list is at least 500 times shorter than the paper's.",
            from: Origin::Ours,
            check: globe_500,
        },
        Claim {
            id: "host-work",
            text: "The host's work on the list shrinks with it.",
            from: Origin::Ours,
            check: host_work,
        },
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
        return Ok(NAMES.map(|name| Row::new(name, LENGTH, "triples", Value::Missing(why.clone()))).into());
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
        let number =
            |quantity, unit, count: usize| Row::new(name, quantity, unit, Value::Number(count as f64));
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
    let pass = |(label, summary): &(String, Option<Summary>)| {
        summary.map(|summary| Row::new(&*timed.variant, &**label, "ms", Value::Summary(summary)))
    };
    // Both passes of each round together.
    let [dedup, compact] = ["dedup", "compact"].map(|label| timed.pass_of_rounds(label));
    let both =
        dedup.zip(compact).and_then(|(dedup, compact)| Summary::of_pairs(&dedup, &compact, |a, b| a + b));
    let stages = both.map(|both| Row::new(&*timed.variant, STAGES, "ms", Value::Summary(both)));
    timed.passes.iter().filter_map(pass).chain(stages).collect()
}

fn native_exact(table: &Table) -> Finding {
    let (mut right, mut places, mut numbers) = (0, 0, Vec::new());
    let (mut triples, mut tiles) = (0.0, 0.0);
    for record in table.of(LENGTH).filter(|r| r.row.variant == "native") {
        let of = |variant, quantity| table.number(&record.scene, record.x, variant, quantity);
        let Some(length) = record.row.value.number() else { continue };
        places += 1;
        triples += of("paper", LENGTH).unwrap_or(0.0);
        tiles += of("native", TILES).unwrap_or(0.0);
        let alone = NAMES.map(|name| of(name, SAME));
        right += usize::from(Some(length) == of("native", TILES) && alone == [Some(0.0); 2]);
        numbers.push(format!("{} at {} {length}", record.scene, record.x.unwrap_or(f64::NAN)));
    }
    let verdict = match right {
        _ if places == 0 => Verdict::NotMeasurable,
        right if right == places && table.missing == 0 => Verdict::Reproduced,
        0 => Verdict::NotReproduced,
        _ => Verdict::InPart,
    };
    let why = match places {
        0 => why_none(table, LENGTH, &variants()),
        _ => format!(
            "{right} of {places} native lists are as long as the tiles are many, and name the paper's tiles; compared: every \
             one of the {tiles} tiles with every one of the paper's {triples} triples"
        ),
    };
    Finding::new(verdict, numbers.join(", "), why)
}

fn globe_500(table: &Table) -> Finding {
    let found = ratios(table, LENGTH, &["paper".to_string()], &["native".to_string()]);
    let found: Vec<_> =
        found.into_iter().filter(|r| r.at == ("globe/africa".to_string(), Some(1080.0))).collect();
    judge(table, Bound::AtLeast(500.0), &found, || why_none(table, LENGTH, &variants()))
}

fn host_work(table: &Table) -> Finding {
    let found = ratios(table, ON_THE_HOST, &["paper".to_string()], &["native".to_string()]);
    judge(table, Bound::Wins, &found, || why_none(table, ON_THE_HOST, &variants()))
}

#[cfg(test)]
mod tests {
    use super::super::judge::tests::table;
    use super::*;

    type Rows<'a> = Vec<(&'a str, Option<f64>, &'a str, &'a str, f64)>;

    fn rows(paper: f64, native: f64, tiles: f64, alone: f64) -> Rows<'static> {
        let at = ("globe/africa", Some(1080.0));
        let row = |variant, quantity, number| (at.0, at.1, variant, quantity, number);
        vec![
            row("paper", LENGTH, paper),
            row("native", LENGTH, native),
            row("native", TILES, tiles),
            row("paper", SAME, alone),
            row("native", SAME, 0.0),
        ]
    }

    #[test]
    fn a_tile_twice_or_another_tile_refutes_the_native_list() {
        let found =
            |native, tiles, alone| native_exact(&table("cpu", &rows(100.0, native, tiles, alone))).verdict;
        assert_eq!(found(45.0, 45.0, 0.0), Verdict::Reproduced);
        assert_eq!(found(46.0, 45.0, 0.0), Verdict::NotReproduced);
        assert_eq!(found(45.0, 45.0, 1.0), Verdict::NotReproduced);
        assert_eq!(native_exact(&table("cpu", &[])).verdict, Verdict::NotMeasurable);
    }

    #[test]
    fn five_hundred_times_is_judged_at_1080_rows_of_the_globe() {
        let found = |paper| globe_500(&table("cpu", &rows(paper, 45.0, 45.0, 0.0))).verdict;
        assert_eq!((found(22_500.0), found(22_000.0)), (Verdict::Reproduced, Verdict::NotReproduced));
        let elsewhere = [
            ("globe/africa", Some(720.0), "paper", LENGTH, 9e4),
            ("globe/africa", Some(720.0), "native", LENGTH, 9.0),
        ];
        assert_eq!(globe_500(&table("cpu", &elsewhere)).verdict, Verdict::NotMeasurable);
    }
}
