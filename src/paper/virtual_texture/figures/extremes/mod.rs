//! vt.extremes: what happens at the edges of what a picture, a texture and a camera can be, variant by variant,
//! against the reference.

mod contenders;
mod examine;
mod scenes;
mod shapes;

pub use contenders::variants;
pub use examine::{Examination, Examiner, Outcome, Settled};
pub use scenes::{EXTREMES, Expected, Extreme, Landscape, Sight};

use crate::figure::{Bench, Cell, Claim, Figure, Finding, Origin, Row, Table, Value, Verdict};
use crate::paper::virtual_texture::all_needs;
use anyhow::Context;

/// Rows that are not a variant's.
const STAGE_1: &str = "stage 1";
const PICTURE: &str = "settled picture";
/// Quantity: pixels whose every sample was held against the texel that it must be.
const COMPARED: &str = "compared";
/// Quantity: pixels of stage 1 that were held against f64.
const LOOKED_AT: &str = "looked at";
/// Quantity: what a superset has beyond the reference.
const BEYOND: &str = "beyond";

pub const EXTREMES_FIGURE: Figure = Figure {
    id: "vt.extremes",
    title: "The edges: horizons, poles, seams, zeros, NaN, giants",
    about: "What happens where a footprint, a coordinate, a picture or a texture is as large, as small or as broken as \
            it can be? The paper names two such cases (section 2.1: t = 1 and s = 1) and leaves the others open. Every \
            variant's list is held against the exact set from the device's own U1, stage 1 against an f64 rasteriser, \
            and the settled picture against a texture whose every texel is known: each pixel that the landscape covers, and \
            each of its samples. Quick and full runs are alike, at most 360 rows of pixels.",
    scenes: &NAMES,
    variants: || variants().into_iter().map(|(name, _)| name).collect(),
    sweep: None,
    measure,
    plots: &[],
    claims: &[
        Claim {
            id: "edges-of-the-texture",
            text: "i = min(i, hT^0 - 1) and j = min(j, wT^0 - 1) give a tile to every pixel with t = 1 or s = 1",
            from: Origin::Paper("2.1"),
            check: |table| exact(table, &["corners", "south-pole", "antimeridian"]),
        },
        Claim {
            id: "every-set-is-exact",
            text: "Every variant that a device can run lists the reference's tiles at every extreme, no more and no fewer; \
                   those that promise a superset, no fewer",
            from: Origin::Ours,
            check: |table| exact(table, &NAMES),
        },
        Claim {
            id: "stage-1-is-explained",
            text: "Where a pixel's triple is not the f64 reference's, the border of a decision explains it",
            from: Origin::Ours,
            check: stage_1_is_explained,
        },
        Claim {
            id: "every-texel-is-right",
            text: "The settled picture mixes the right texels only, and every pixel of it is a number",
            from: Origin::Ours,
            check: every_texel_is_right,
        },
        Claim {
            id: "refusals-are-words",
            text: "What a device cannot do is refused in one line that says what and why",
            from: Origin::Ours,
            check: refusals_are_words,
        },
    ],
};

/// The cells: a name each.
const NAMES: [&str; EXTREMES.len()] = {
    let mut names = [""; EXTREMES.len()];
    let mut n = 0;
    while n < names.len() {
        names[n] = EXTREMES[n].name;
        n += 1;
    }
    names
};

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let extreme = Extreme::find(&cell.scene).with_context(|| format!("no extreme {:?}", cell.scene))?;
    let gpu = bench.gpu(&all_needs())?;
    let examined = Examiner::new(gpu).examine(extreme, extreme.size)?;
    let name: String = extreme.name.chars().map(|c| if "^.".contains(c) { '-' } else { c }).collect();
    bench.picture(&format!("vt.extremes-{name}"), &examined.picture)?;
    Ok(rows(&examined))
}

fn number(variant: &str, quantity: &str, unit: &str, count: usize) -> Row {
    Row::new(variant, quantity, unit, Value::Number(count as f64))
}

fn rows(examined: &Examination) -> Vec<Row> {
    let mut rows = Vec::new();
    let check = &examined.stage1;
    let (differing, unexplained) = (check.differing, check.unexplained.len());
    let words = match (differing, unexplained) {
        (0, _) => format!("all {} pixels equal", check.pixels),
        (_, 0) => format!("{differing} of {} pixels at the border of a decision", check.pixels),
        _ => format!("{unexplained} pixels unexplained: {}", check.unexplained[0]),
    };
    rows.push(Row::new(STAGE_1, "outcome", "", Value::Text(words)));
    rows.push(number(STAGE_1, LOOKED_AT, "pixels", check.pixels));
    rows.push(number(STAGE_1, "differing", "pixels", differing));
    rows.push(number(STAGE_1, "unexplained", "pixels", unexplained));
    examined
        .variants
        .iter()
        .for_each(|(name, outcome)| rows.extend(of_variant(name, outcome, examined.tiles)));
    rows.extend(examined.settled.iter().flat_map(of_picture));
    rows
}

fn of_variant(name: &str, outcome: &Outcome, tiles: usize) -> Vec<Row> {
    let text = |words| Row::new(name, "outcome", "", Value::Text(words));
    let count = |quantity, unit, count| number(name, quantity, unit, count);
    match outcome {
        Outcome::Refused(line) => vec![Row::new(name, "outcome", "", Value::Missing(line.clone()))],
        &Outcome::Listed { lost, extra, entries, right_entries } => {
            let words = match (lost, extra) {
                (0, 0) if entries == right_entries => format!("equal, {tiles} tiles"),
                (0, 0) => format!("{entries} entries, {right_entries} are right"),
                _ => format!("{lost} tiles lost, {extra} too many, of {tiles}"),
            };
            vec![
                text(words),
                count("lost", "tiles", lost),
                count("extra", "tiles", extra),
                count("list length", "triples", entries),
                count("repeated", "triples", entries.abs_diff(right_entries)),
            ]
        }
        &Outcome::Superset { lost, beyond, repeated } => {
            let words = match lost {
                0 => format!("all {tiles} tiles, {beyond} hidden ones"),
                _ => format!("{lost} tiles lost of {tiles}"),
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

fn of_picture(settled: &Settled) -> Vec<Row> {
    let (wrong, not_finite) = (settled.wrong() as usize, settled.not_finite);
    let coarser = if settled.bias > 0 { format!(", {} levels coarser", settled.bias) } else { String::new() };
    let words = match settled.verdicts {
        _ if not_finite > 0 => format!("{not_finite} pixels hold no number"),
        None => format!("every pixel holds a number{coarser}"),
        Some(verdicts) if wrong > 0 => format!("{wrong} of {} pixels wrong{coarser}", verdicts.covered),
        Some(verdicts) => format!("every texel of {} pixels right{coarser}", verdicts.covered),
    };
    let compared = settled.verdicts.map_or(0, |verdicts| verdicts.covered as usize);
    vec![
        Row::new(PICTURE, "outcome", "", Value::Text(words)),
        number(PICTURE, "wrong", "pixels", wrong),
        number(PICTURE, COMPARED, "pixels", compared),
        number(PICTURE, "not finite", "pixels", not_finite),
    ]
}

/// (sum, number of records) of a quantity over some cells.
fn sum(table: &Table, quantity: &str, cells: &[&str]) -> (f64, usize) {
    let values =
        table.of(quantity).filter(|r| cells.contains(&&*r.scene)).filter_map(|r| r.row.value.number());
    values.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1))
}

/// A verdict on counts of faults that are all to be 0 in so many records.
fn faultless(faults: f64, records: usize, missing: usize, numbers: String, what: &str) -> Finding {
    match (faults, records, missing) {
        (_, 0, _) => Finding::new(Verdict::NotMeasurable, numbers, "nothing of it ran on this device"),
        (0.0, _, 0) => Finding::new(Verdict::Reproduced, numbers, format!("no {what} anywhere")),
        (0.0, ..) => {
            Finding::new(Verdict::InPart, numbers, format!("no {what}, but {missing} cells are missing"))
        }
        _ => Finding::new(Verdict::NotReproduced, numbers, format!("{faults} {what}")),
    }
}

fn exact(table: &Table, cells: &[&str]) -> Finding {
    let ((lost, lists), (extra, _)) = (sum(table, "lost", cells), sum(table, "extra", cells));
    let (repeated, _) = sum(table, "repeated", cells);
    let (beyond, supersets) = sum(table, BEYOND, cells);
    let numbers = format!(
        "{lists} lists at {} extremes: {lost} tiles lost, {extra} too many, {repeated} triples repeated; {beyond} hidden \
         tiles in {supersets} of them that may have such",
        cells.len()
    );
    faultless(lost + extra + repeated, lists, table.missing, numbers, "wrong entry")
}

fn stage_1_is_explained(table: &Table) -> Finding {
    let (differing, pictures) = sum(table, "differing", &NAMES);
    let (unexplained, _) = sum(table, "unexplained", &NAMES);
    let (looked_at, _) = sum(table, LOOKED_AT, &NAMES);
    let numbers = format!(
        "{pictures} pictures: {differing} of {looked_at} pixels differ from f64, {unexplained} of them unexplained"
    );
    faultless(unexplained, pictures, table.missing, numbers, "unexplained pixel")
}

fn every_texel_is_right(table: &Table) -> Finding {
    let ((wrong, pictures), (broken, _)) = (sum(table, "wrong", &NAMES), sum(table, "not finite", &NAMES));
    let (compared, _) = sum(table, COMPARED, &NAMES);
    let numbers = format!(
        "{pictures} settled pictures: of {compared} pixels, each with all its samples, {wrong} wrong; {broken} no number"
    );
    faultless(wrong + broken, pictures, table.missing, numbers, "wrong pixel")
}

/// A refusal is a line of words: "U2: 65536 x 65536 texels; the device takes …".
fn refusals_are_words(table: &Table) -> Finding {
    let lines: Vec<&str> = table
        .of("outcome")
        .filter_map(|r| if let Value::Missing(line) = &r.row.value { Some(&**line) } else { None })
        .collect();
    let bad = lines.iter().filter(|line| line.contains('\n') || line.split_whitespace().count() < 4).count();
    let first = lines.first().map_or(String::new(), |line| format!(", first: {line}"));
    let numbers = format!("{} refusals{first}", lines.len());
    faultless(bad as f64, lines.len(), table.missing, numbers, "refusal without a reason")
}
