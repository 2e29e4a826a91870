//! vt.resolution, vt.tile-size and vt.texture-size: how the frame grows with the screen, with the tiles and with the
//! texture.

use super::common::{Place, pixels_of};
use super::cost::{FRAME, LIST};
use super::judge::{Bound, Ratio, judge, on_a_gpu, places, short, why_none};
use super::side_by_side::{Combination, SideBySide, THE_PAPER, combinations};
use crate::figure::{
    Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Sweep, Table, Value, Verdict,
};
use crate::texture::source::TileSource;
use std::collections::BTreeMap;

/// The variant that does nothing: no time is less.
const EMPTY: &str = "empty pass";

const MIB: f64 = 1_048_576.0;

const fn lines(quantity: &'static str, log_x: bool) -> Plot {
    Plot { quantity, x: Axis::Sweep, log_x, log_y: true, floor: Some(EMPTY) }
}

pub const RESOLUTION: Figure = Figure {
    id: "vt.resolution",
    title: "Growth with the screen",
    about: "The settled frame and its lists for pictures of 16:9 from 360 to 720 (quick) or 2160 rows. The paper (its \
            headline: 1920 x 1080) does not say how its stages grow; stage 2 looks at every pixel once, so no \
            variant should grow faster than the pixels do.",
    scenes: &["earth/oblique", "globe/africa"],
    variants: variants_and_empty,
    sweep: Some(Sweep {
        name: "picture height, pixels",
        quick: &[360.0, 540.0, 720.0],
        full: &[360.0, 540.0, 720.0, 1080.0, 1440.0, 2160.0],
    }),
    measure: |bench, cell| {
        let rows = cell.x.expect("a sweep");
        let place = Place::find(&cell.scene)?;
        measure(bench, place, rows, 192)
    },
    plots: &[lines(FRAME, true), lines(LIST, true), lines("visible tiles", true)],
    claims: &[
        Claim {
            id: "linear",
            text: "From the smallest to the largest picture, stages 2 and 3 of the paper grow at most a quarter more \
                   than the number of pixels.",
            from: Origin::Ours,
            check: |table| grows(table, LIST, 1.25),
        },
        Claim {
            id: "tiles",
            text: "The number of visible tiles grows no faster than the number of pixels.",
            from: Origin::Ours,
            check: |table| grows(table, "visible tiles", 1.0),
        },
    ],
};

pub const TILE_SIZE: Figure = Figure {
    id: "vt.tile-size",
    title: "The choice of the tile size",
    about: "Tiles of 64 (quick: 128) to 1024 texels a side under the same picture: small ones make the list and the tables long and \
            spend more of themselves on borders, large ones bring texels that nobody sees. The working set is what \
            the visible tiles take, all of which must be uploaded once. The paper takes 512 (its headline) without \
            a reason. 960 x 540 (quick) or 1920 x 1080 pixels; a border of 4 texels throughout.",
    scenes: &["earth/oblique"],
    variants: variants_and_empty,
    sweep: Some(Sweep {
        name: "tile side, texels",
        quick: &[128.0, 256.0, 512.0, 1024.0],
        full: &[64.0, 128.0, 256.0, 512.0, 1024.0],
    }),
    measure: measure_tile_size,
    plots: &[lines(WORKING_SET, true), lines("visible tiles", true), lines(FRAME, true), lines("U2", true)],
    claims: &[Claim {
        id: "512",
        text: "The paper's tiles of 512 texels need at most twice the working set of the best size.",
        from: Origin::Ours,
        check: paper_tile,
    }],
};

pub const TEXTURE_SIZE: Figure = Figure {
    id: "vt.texture-size",
    title: "Growth with the texture",
    about: "The same picture over textures of 2^12 x 2^11 to 2^20 x 2^19 texels: memory on the device (U1 and J1 know \
            nothing of the texture's size; U2 and H1 are 4 bytes or so for each tile of level 0) and time. The paper \
            (abstract and introduction) promises textures of the order of 10^6 x 10^6 texels in real time. \
            960 x 540 (quick) or 1920 x 1080 pixels, tiles of 512, N1 = 96.",
    scenes: &["earth/oblique"],
    variants: variants_and_empty,
    sweep: Some(Sweep {
        name: "log2 of the texture's width in texels",
        quick: &[12.0, 14.0, 16.0, 18.0, 20.0],
        full: &[12.0, 13.0, 14.0, 15.0, 16.0, 17.0, 18.0, 19.0, 20.0],
    }),
    measure: measure_texture_size,
    plots: &[lines(FRAME, false), lines(MEMORY, false), lines("U2", false), lines("H1", false)],
    claims: &[
        Claim {
            id: "10^6",
            text: "Textures of the order of 10^6 x 10^6 texels are shown in real time (here: 30 frames a second of \
                   2^20 x 2^19 texels).",
            from: Origin::Paper("introduction"),
            check: real_time,
        },
        Claim {
            id: "memory",
            text: "At 2^20 x 2^19 texels all that a frame needs takes at most 1 GiB on the device, as much as the \
                   paper's GTX 285 has.",
            from: Origin::Ours,
            check: one_gibibyte,
        },
        Claim {
            id: "flat",
            text: "A texture 16 times as large (2^20 against 2^18) makes the cheapest frame at most a quarter dearer.",
            from: Origin::Ours,
            check: flat,
        },
    ],
};

/// Quantity: MiB of the visible tiles as they are stored, borders and second levels included.
const WORKING_SET: &str = "working set";

/// Quantity: MiB on the device, all of it.
const MEMORY: &str = "memory";

const LARGEST: Option<f64> = Some(20.0);

/// Those that make an exact list on the device.
fn contenders() -> Vec<Combination> {
    combinations().into_iter().filter(Combination::is_ours).collect()
}

fn names() -> Vec<String> {
    contenders().iter().map(|combination| combination.name.to_string()).collect()
}

fn variants_and_empty() -> Vec<String> {
    names().into_iter().chain([EMPTY.to_string()]).collect()
}

/// Rows of pixels where the screen is not what is swept.
fn pixel_rows(bench: &Bench) -> f64 {
    match bench.effort {
        Effort::Quick => 540.0,
        Effort::Full => 1080.0,
    }
}

/// Times, lists and memory of all combinations; `tiles` is N1 and N2.
fn measure(bench: &mut Bench, place: Place, pixel_rows: f64, tiles: u32) -> anyhow::Result<Vec<Row>> {
    let mut frames =
        SideBySide::settled(bench, place, pixels_of(pixel_rows), (&contenders(), &[]), |settings| {
            (settings.streaming.gpu_tiles, settings.streaming.host_tiles) = (tiles, tiles);
        })?;
    let mut rows = frames.time(bench)?;
    rows.extend(frames.lists());
    let tile_mib = frames.source.format().tile_bytes(&frames.source.pyramid()) as f64 / MIB;
    for (name, session) in &frames.sessions {
        let row = |quantity: &str, unit, number| Row::new(&**name, quantity, unit, Value::Number(number));
        let visible = session.records.last().map_or(0, |record| record.visible.len());
        rows.push(row(WORKING_SET, "MiB", visible as f64 * tile_mib));
        rows.push(row("level bias", "levels", f64::from(session.technique.bias())));
        let memory: BTreeMap<_, _> = session.memory().into_iter().collect();
        let on_device = memory.iter().filter(|(object, _)| !object.contains("host"));
        rows.push(row(MEMORY, "MiB", on_device.map(|(_, bytes)| *bytes as f64 / MIB).sum()));
        for object in ["U1", "U2", "U3", "H1", "J1", "G1"] {
            let bytes = memory.get(object).copied().unwrap_or(0);
            rows.push(row(object, "MiB", bytes as f64 / MIB));
        }
    }
    Ok(rows)
}

fn measure_tile_size(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let side = cell.x.expect("a sweep") as u32;
    let mut place = Place::find(&cell.scene)?;
    place.scene = place.scene.with(&[format!("surface.land.texture.tile_size={side}")])?;
    let pixel_rows = pixel_rows(bench);
    // Tiles of a quarter of the area are up to four times as many; 2048 layers are what devices have.
    let most = if pixel_rows > 540.0 { 192 } else { 96 };
    let tiles = most * 512 * 512 / (side * side);
    measure(bench, place, pixel_rows, tiles.clamp(64, 2000))
}

fn measure_texture_size(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let width_log2 = cell.x.expect("a sweep") as u32;
    let mut place = Place::find(&cell.scene)?;
    let sizes = [("width", width_log2), ("height", width_log2 - 1)];
    let changes = sizes.map(|(side, log2)| format!("surface.land.texture.{side}_log2={log2}"));
    place.scene = place.scene.with(&changes)?;
    let pixel_rows = pixel_rows(bench);
    measure(bench, place, pixel_rows, 96)
}

/// How much faster than the number of pixels the paper's `quantity` grows, from the smallest to the largest picture
/// of each scene.
fn grows(table: &Table, quantity: &str, bound: f64) -> Finding {
    let mut scenes: Vec<String> = places(table).into_iter().map(|(scene, _)| scene).collect();
    scenes.dedup();
    let growth = |scene: String| {
        let all = places(table).into_iter().filter(|(other, x)| *other == scene && x.is_some());
        let number = |x| Some((x?, table.number(&scene, x, THE_PAPER, quantity)?));
        let mut ends: Vec<(f64, f64)> = all.filter_map(|(_, x)| number(x)).collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        let [(least, small), .., (most, large)] = ends[..] else { return None };
        let of = format!("{} to {}", short(small), short(large));
        let value = large / small / (most / least).powi(2);
        Some(Ratio { at: (scene, Some(most)), of, value, range: None, tie: false })
    };
    let found: Vec<Ratio> = scenes.into_iter().filter_map(growth).collect();
    judge(table, Bound::AtMost(bound), &found, || why_none(table, quantity, &[THE_PAPER.to_string()]))
}

fn paper_tile(table: &Table) -> Finding {
    let of = |x| table.number("earth/oblique", x, THE_PAPER, WORKING_SET);
    let sizes = places(table).into_iter().filter_map(|(_, x)| Some((x?, of(x)?)));
    let Some(papers) = of(Some(512.0)) else {
        return Finding::new(
            Verdict::NotMeasurable,
            "",
            why_none(table, WORKING_SET, &[THE_PAPER.to_string()]),
        );
    };
    let sizes: Vec<(f64, f64)> = sizes.collect();
    let (best, least) = sizes.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1)).expect("512 is one of them");
    let at = ("earth/oblique".to_string(), Some(512.0));
    let ratio =
        Ratio { at, of: format!("over tiles of {best}"), value: papers / least, range: None, tie: false };
    let mut finding = judge(table, Bound::AtMost(2.0), &[ratio], String::new);
    let all = sizes.iter().map(|(side, mib)| format!("{side}: {} MiB", short(*mib)));
    finding.numbers = format!("{}; {}", finding.numbers, all.collect::<Vec<_>>().join(", "));
    finding
}

fn real_time(table: &Table) -> Finding {
    let names = names();
    let cheapest = super::judge::least(table, &("earth/oblique".into(), LARGEST), FRAME, &names);
    let time = cheapest.and_then(|name| Some((name, table.number("earth/oblique", LARGEST, name, FRAME)?)));
    let Some((name, ms)) = time else {
        return Finding::new(Verdict::NotMeasurable, "", why_none(table, FRAME, &names));
    };
    let verdict = if ms <= 1000.0 / 30.0 { Verdict::Reproduced } else { Verdict::NotReproduced };
    let numbers = format!("{} ms, {} frames/s ({name})", short(ms), short(1000.0 / ms));
    on_a_gpu(table, Finding::new(verdict, numbers, "bound: 33.3 ms a frame"))
}

fn one_gibibyte(table: &Table) -> Finding {
    let Some(mib) = table.number("earth/oblique", LARGEST, THE_PAPER, MEMORY) else {
        return Finding::new(Verdict::NotMeasurable, "", why_none(table, MEMORY, &[THE_PAPER.to_string()]));
    };
    let verdict = if mib <= 1024.0 { Verdict::Reproduced } else { Verdict::NotReproduced };
    Finding::new(verdict, format!("{} MiB", short(mib)), "bound: 1024 MiB")
}

fn flat(table: &Table) -> Finding {
    let names = names();
    let of = |x| {
        let name = super::judge::least(table, &("earth/oblique".into(), x), FRAME, &names)?;
        table.number("earth/oblique", x, name, FRAME)
    };
    let (Some(large), Some(small)) = (of(LARGEST), of(Some(18.0))) else {
        return Finding::new(Verdict::NotMeasurable, "", why_none(table, FRAME, &names));
    };
    let of = format!("{} ms over {} ms", short(large), short(small));
    let ratio =
        Ratio { at: ("earth/oblique".into(), LARGEST), of, value: large / small, range: None, tie: false };
    judge(table, Bound::AtMost(1.25), &[ratio], String::new)
}

#[cfg(test)]
mod tests {
    use super::super::judge::tests::table;
    use super::*;
    use crate::figure::Verdict::{NotMeasurable, NotReproduced, Reproduced};

    const SCENE: &str = "earth/oblique";

    #[test]
    fn growth_is_taken_from_the_smallest_to_the_largest_picture() {
        let verdict = |large| {
            let at = |x, ms| (SCENE, Some(x), THE_PAPER, LIST, ms);
            grows(&table("cpu", &[at(720.0, 7.0), at(360.0, 2.0), at(1440.0, large)]), LIST, 1.25).verdict
        };
        // 16 times the pixels.
        assert_eq!((verdict(39.0), verdict(41.0)), (Reproduced, NotReproduced));
        let one = table("cpu", &[(SCENE, Some(360.0), THE_PAPER, LIST, 2.0)]);
        assert_eq!(grows(&one, LIST, 1.25).verdict, NotMeasurable, "one picture tells no growth");
    }

    #[test]
    fn the_papers_tile_is_held_against_the_best() {
        let verdict = |papers| {
            let at = |x, mib| (SCENE, Some(x), THE_PAPER, WORKING_SET, mib);
            paper_tile(&table("cpu", &[at(64.0, 10.0), at(128.0, 9.0), at(512.0, papers)]))
        };
        assert_eq!((verdict(18.0).verdict, verdict(18.1).verdict), (Reproduced, NotReproduced));
        assert!(verdict(18.0).numbers.contains("over tiles of 128"), "{:?}", verdict(18.0));
        assert_eq!(paper_tile(&table("cpu", &[])).verdict, NotMeasurable);
    }

    #[test]
    fn real_time_is_judged_on_a_gpu_alone() {
        let verdict = |kind, ms| real_time(&table(kind, &[(SCENE, LARGEST, THE_PAPER, FRAME, ms)])).verdict;
        assert_eq!((verdict("discrete", 33.0), verdict("discrete", 34.0)), (Reproduced, NotReproduced));
        assert_eq!(verdict("cpu", 33.0), NotMeasurable);
        assert_eq!(real_time(&table("discrete", &[])).verdict, NotMeasurable);
    }

    #[test]
    fn memory_and_flatness_have_their_bounds() {
        let memory = |mib| one_gibibyte(&table("cpu", &[(SCENE, LARGEST, THE_PAPER, MEMORY, mib)])).verdict;
        assert_eq!((memory(1024.0), memory(1025.0)), (Reproduced, NotReproduced));
        let flat_at = |ms| {
            let at = |x, ms| (SCENE, x, THE_PAPER, FRAME, ms);
            flat(&table("cpu", &[at(Some(18.0), 10.0), at(LARGEST, ms)])).verdict
        };
        assert_eq!((flat_at(12.4), flat_at(12.6)), (Reproduced, NotReproduced));
        assert_eq!(flat(&table("cpu", &[])).verdict, NotMeasurable);
    }
}
