//! vt.extremes: every variant against the reference for extreme pictures, textures and cameras.

use super::common::{ONE_SAMPLE, setting};
use crate::figure::prelude::*;
use crate::paper::virtual_texture::extremes::{
    EXTREMES, Examination, Examiner, Expected, Extreme, Landscape, ListOutcome, SIZE, Settled, variants,
};
use crate::paper::virtual_texture::{Config, all_needs};

/// Names of the rows that belong to no variant.
const STAGE_1: &str = "stage 1";
const PICTURE: &str = "settled picture";
/// The rows with NA = 16.
const STAGE_1_16: &str = "stage 1, NA = 16";
const PICTURE_16: &str = "settled picture, NA = 16";
/// Quantity: pixels whose samples were all compared with the right texel.
const COMPARED: &str = "compared";
/// Quantity: pixels of stage 1 that were compared with the f64 reference.
const LOOKED_AT: &str = "compared with f64";
/// Quantity: visible tiles, and those among them that only samples read.
const TILES: &str = "visible tiles";
const OF_SAMPLES: &str = "visible tiles that only samples read";
/// Quantity: tiles of a superset beyond the reference.
const BEYOND: &str = "beyond the reference";
/// Quantity: refusals that are not one line of at least four words.
const UNREASONED: &str = "refusals without a reason";

pub const EXTREMES_FIGURE: Figure = Figure {
    id: "vt.extremes",
    title: "Extreme inputs: horizons, poles, seams, zeros, NaN, huge sizes",
    about: "The inputs are at the limits: footprints, coordinates, pictures and textures that are as large, as small \
            or as invalid as possible. The paper treats two such cases (section 2.1: t = 1 and s = 1). Every variant's \
            list is compared with the exact set from the device's own request image. Stage 1 is compared with an f64 \
            rasteriser. The settled picture shows a texture whose texels are all known; each sample of each pixel that \
            the textured surface covers is checked. All variants run with one sample per pixel (NA = 1). With the \
            paper's NA = 16 and a border of 4 texels, samples also reach into neighbouring tiles; the methods that list \
            such tiles in code of their own run too. NA changes the number of visible tiles. A square footprint has one \
            sample or two, because nA is rounded up: rounding decides, and with it the level. Quick and full runs are the \
            same, with at most 360 rows of pixels.",
    scenes: &NAMES,
    variants: || [1, 16].into_iter().flat_map(variants).map(|(name, _)| name).collect(),
    paper: &["geometry p=3 memo, transform-feedback, level-0 tile addresses"],
    show: Show::views(views)
        .variants(|| [1, 16].into_iter().flat_map(settings).collect()),
    measure,
    claims: &[
        Claim::paper(
            "2.1",
            "edges-of-the-texture",
            "Clamping (i, j) to the last tile (i = min(i, hT^0 - 1), j = min(j, wT^0 - 1)) gives a tile to every \
            pixel with t = 1 or s = 1.",
            EXACT,
        )
        .at(Places::scenes(&["corners", "south-pole", "antimeridian"])),
        Claim::ours(
            "every-set-is-exact",
            "Every variant that the device supports lists exactly the reference's tiles at every extreme; variants \
             that list a superset lose none.",
            EXACT,
        ),
        Claim::ours(
            "stage-1-is-explained",
            "Every triple that differs from the f64 reference lies so close to a tile's or level's border that \
            rounding explains it.",
            &Test::values([one("unexplained", STAGE_1), one("unexplained", STAGE_1_16)], Equal(0.0)),
        ),
        Claim::ours(
            "every-texel-is-right",
            "The settled picture uses only the right texels, and all of its pixels are finite.",
            &[
                Test::value(one("wrong", PICTURE), Equal(0.0)),
                Test::value(one("not finite", PICTURE), Equal(0.0)),
                Test::value(one("wrong", PICTURE_16), Equal(0.0)),
                Test::value(one("not finite", PICTURE_16), Equal(0.0)),
            ],
        ),
        Claim::ours(
            "refusals-are-words",
            "Each refusal is one line with the unsupported feature and the reason.",
            &[Test::value(every(UNREASONED), Equal(0.0))],
        ),
    ],
    ..Figure::BASE
};

const EXACT: &[Test] = &Test::values([every("lost"), every("extra"), every("repeated")], Equal(0.0));

/// The names of the cells.
const NAMES: [&str; EXTREMES.len()] = {
    let mut names = [""; EXTREMES.len()];
    let mut n = 0;
    while n < names.len() {
        names[n] = EXTREMES[n].name;
        n += 1;
    }
    names
};

/// The extremes that a scene can show at any size. The others need a synthetic mesh or another size, or are refused.
fn views() -> Vec<FigureView> {
    let shown = |extreme: &&Extreme| {
        let is_scene = matches!(extreme.landscape, Landscape::Scene);
        is_scene && extreme.size == SIZE && extreme.expected != Expected::Refused
    };
    let changes = |extreme: &Extreme| ONE_SAMPLE.iter().chain(extreme.changes).copied().collect::<Vec<_>>();
    let views = EXTREMES.iter().filter(shown);
    views.map(|extreme| FigureView::new(extreme.name, extreme.scene, changes(extreme))).collect()
}

/// The variants of one NA as settings of a scene.
fn settings(na: u32) -> Vec<Setting> {
    let of = |(name, config): (String, Config)| {
        let setting = setting(name, &config);
        let samples = (na > 1).then(|| format!("surface.land.filter.max_anisotropy={na}"));
        Setting::new(setting.name, setting.changes.into_iter().chain(samples))
    };
    variants(na).into_iter().map(of).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let extreme = Extreme::find(&cell.scene).with_context(|| format!("no extreme {:?}", cell.scene))?;
    let mut examiner = Examiner::new(bench.gpu(&all_needs())?);
    let examined = examiner.examine(extreme, extreme.size, 1)?;
    let name: String = extreme.name.chars().map(|c| if "^.".contains(c) { '-' } else { c }).collect();
    bench.picture(&format!("vt.extremes-{name}"), &examined.picture)?;
    let mut rows = rows(&examined, [STAGE_1, PICTURE]);
    if extreme.elongates() {
        rows.extend(self::rows(&examiner.examine(extreme, extreme.size, 16)?, [STAGE_1_16, PICTURE_16]));
    }
    Ok(rows)
}

fn number(variant: &str, quantity: &str, unit: &str, count: usize) -> Row {
    Row::number(variant, quantity, unit, count as f64)
}

/// The rows of one NA; `names` are the names of stage 1's and of the picture's rows.
fn rows(examined: &Examination, [stage1, picture]: [&str; 2]) -> Vec<Row> {
    let mut rows = Vec::new();
    let check = &examined.stage1;
    let (differing, unexplained) = (check.differing, check.unexplained.len());
    let words = match (differing, unexplained) {
        (0, _) => format!("all {} pixels equal", check.pixels),
        (_, 0) => format!("{differing} of {} pixels differ, all at a tile's or level's border", check.pixels),
        _ => format!("{unexplained} pixels unexplained: {}", check.unexplained[0]),
    };
    rows.push(Row::new(stage1, "outcome", "", Value::Text(words)));
    rows.push(number(stage1, LOOKED_AT, "pixels", check.pixels));
    rows.push(number(stage1, "differing", "pixels", differing));
    rows.push(number(stage1, "unexplained", "pixels", unexplained));
    rows.push(number(stage1, TILES, "tiles", examined.tiles));
    rows.push(number(stage1, OF_SAMPLES, "tiles", examined.of_samples));
    examined
        .variants
        .iter()
        .for_each(|(name, outcome)| rows.extend(of_variant(name, outcome, examined.tiles)));
    rows.extend(examined.settled.iter().flat_map(|settled| of_picture(settled, picture)));
    rows
}

fn of_variant(name: &str, outcome: &ListOutcome, tiles: usize) -> Vec<Row> {
    let text = |words| Row::new(name, "outcome", "", Value::Text(words));
    let count = |quantity, unit, count| number(name, quantity, unit, count);
    match outcome {
        ListOutcome::Refused(line) => {
            let bad = line.contains('\n') || line.split_whitespace().count() < 4;
            let outcome = Row::missing(name, "outcome", line.clone());
            vec![outcome, count(UNREASONED, "refusals", usize::from(bad))]
        }
        &ListOutcome::Listed { lost, extra, entries, right_entries } => {
            let words = match (lost, extra) {
                (0, 0) if entries == right_entries => format!("equal, {tiles} tiles"),
                (0, 0) => format!("{entries} entries instead of {right_entries}"),
                _ => format!("{lost} of {tiles} tiles lost, {extra} too many"),
            };
            vec![
                text(words),
                count("lost", "tiles", lost),
                count("extra", "tiles", extra),
                count("list length", "triples", entries),
                count("repeated", "triples", entries.abs_diff(right_entries)),
            ]
        }
        &ListOutcome::Superset { lost, beyond, repeated } => {
            let words = match lost {
                0 => format!("all {tiles} tiles and {beyond} hidden ones"),
                _ => format!("{lost} of {tiles} tiles lost"),
            };
            vec![
                text(words),
                count("lost", "tiles", lost),
                count(BEYOND, "tiles", beyond),
                count("repeated", "triples", repeated),
            ]
        }
    }
}

fn of_picture(settled: &Settled, name: &str) -> Vec<Row> {
    let (wrong, not_finite) = (settled.wrong() as usize, settled.not_finite);
    let coarser = if settled.bias > 0 { format!(", {} levels coarser", settled.bias) } else { String::new() };
    let words = match settled.verdicts {
        _ if not_finite > 0 => format!("{not_finite} pixels are not finite"),
        None => format!("all pixels are finite{coarser}"),
        Some(verdicts) if wrong > 0 => format!("{wrong} of {} pixels wrong{coarser}", verdicts.covered),
        Some(verdicts) => format!("every texel of {} pixels right{coarser}", verdicts.covered),
    };
    let compared = settled.verdicts.map_or(0, |verdicts| verdicts.covered as usize);
    vec![
        Row::new(name, "outcome", "", Value::Text(words)),
        number(name, "wrong", "pixels", wrong),
        number(name, COMPARED, "pixels", compared),
        number(name, "not finite", "pixels", not_finite),
    ]
}
