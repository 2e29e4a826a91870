//! tm.24: what weights that follow the footprint's shape gain and cost, and what their maps do.

use super::lab::{FORMULA_4, Lab, errors, short, time_ratio};
use super::methods::{PAPER_BY_LEVEL, RADIAL_64, SQUARED_128};
use crate::figure::{
    Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Sweep, Table, Value, Verdict,
};
use crate::paper::texture_mapping::footprint::Axes;
use crate::paper::texture_mapping::method::{Ellipse, Method};
use crate::paper::texture_mapping::plane::Tilt;
use crate::paper::texture_mapping::weight_map::{Shape, WeightMap};
use crate::paper::texture_mapping::weights::Kernel;
use crate::picture::error::compare;
use crate::reference::pattern::Pattern;
use crate::reference::supersample;

pub const SHAPE: Figure = Figure {
    id: "tm.24",
    title: "Weights: none, blind to the footprint's shape, following it, from maps",
    about: "The thesis (figure 24): Gaussian weights that follow the footprint's shape, formula (4), are more accurate (by expert ratings) and \
            cost at most 5 %; weight maps in their place are up to 25 % faster, with an NMSE of 0.000708 of the picture against the \
            formula's. Here all variants sum the same texels, those of the exact ellipse with k = 0.8. \"As printed\" takes the lengths of the \
            rows (columns) of J for the axes. Truths: formula (4)'s kernel, exp(-3.125 r^2), and a box of one pixel; the uniform ellipse \
            is also compared with its own kernel, a disc. Planes of `pink-noise` and `checker-2`, 96 x 72 (quick) or 256 x 192 \
            pixels.",
    scenes: &["pink-noise", "checker-2"],
    variants: || variants().into_iter().map(|(name, _)| name).collect(),
    sweep: Some(Sweep { name: "tilt, degrees", quick: TILTS, full: TILTS }),
    measure,
    plots: &[
        Plot { quantity: NMSE, x: Axis::Sweep, log_x: false, log_y: true, floor: None },
        Plot { quantity: BOX, x: Axis::Sweep, log_x: false, log_y: true, floor: None },
        Plot { quantity: OF_MAP, x: Axis::Sweep, log_x: false, log_y: true, floor: None },
        Plot { quantity: TIME, x: Axis::Sweep, log_x: false, log_y: false, floor: None },
    ],
    claims: &[
        Claim {
            id: "accuracy",
            text: "Weights that follow the footprint's shape, as printed, are more accurate than none.",
            from: Origin::Paper("chapter 2, figures 1-3"),
            check: |table| smaller(table, NMSE, ROWS, NONE, 1.0),
        },
        Claim {
            id: "corrected",
            text: "With the exact axes they are more accurate than none at every tilt, and no less than blind ones and than as printed.",
            from: Origin::Ours,
            check: corrected,
        },
        Claim {
            id: "cost",
            text: "Computing the weights costs at most 5 %.",
            from: Origin::Paper("chapter 2, figure 24"),
            check: |table| cost(table, OVER_NONE, ROWS, |ratio| ratio <= 1.05),
        },
        Claim {
            id: "map-speed",
            text: "A weight map is up to 25 % faster than the formula.",
            from: Origin::Paper("chapter 2, figure 24"),
            check: map_speed,
        },
        Claim {
            id: "map-error",
            text: "A weight map's picture has an NMSE of at most 0.000708 against the formula's.",
            from: Origin::Paper("chapter 2, figure 24"),
            check: |table| at_most(table, RADIAL, 7.08e-4),
        },
        Claim {
            id: "map-64",
            text: "A radial map of 64 entries has an NMSE of at most 5e-6 against the formula.",
            from: Origin::Ours,
            check: |table| at_most(table, RADIAL, 5e-6),
        },
    ],
};

const TILTS: &[f64] = &[0.0, 30.0, 60.0, 75.0, 80.0];

const NONE: &str = "none";
const BLIND: &str = "blind to shape";
const ROWS: &str = "as printed, rows";
const COLUMNS: &str = "as printed, columns";
const FORMULA: &str = "corrected";
const RADIAL: &str = "corrected, radial map of 64";

const NMSE: &str = "NMSE against formula (4)'s kernel";
const BOX: &str = "NMSE against a box";
const OWN: &str = "NMSE against its own kernel";
const OF_MAP: &str = "NMSE against the formula's picture";
const TIME: &str = "time a pixel";
const OVER_NONE: &str = "time over no weights";
const OVER_MAP: &str = "formula's time over this one";

fn variants() -> Vec<(String, Ellipse)> {
    let formula = PAPER_BY_LEVEL.axes(Axes::Corrected).k(0.8).most_ratio(64.0);
    let map = |shape, entries, bits| formula.map(WeightMap { shape, entries, bits, linear: false });
    let named = [
        (NONE, formula.kernel(Kernel::UNIFORM)),
        (BLIND, formula.axes(Axes::Round)),
        (ROWS, formula.axes(Axes::Rows)),
        (COLUMNS, formula.axes(Axes::Columns)),
        (FORMULA, formula),
        (RADIAL, formula.map(RADIAL_64)),
        ("corrected, radial map of 64, nearest", map(Shape::Radial, 64, 16)),
        ("corrected, radial map of 4", map(Shape::Radial, 4, 16)),
        ("corrected, radial map of 16", map(Shape::Radial, 16, 16)),
        ("corrected, radial map of 256", map(Shape::Radial, 256, 16)),
        ("corrected, radial map of 64, 8 bits", map(Shape::Radial, 64, 8)),
        ("corrected, r^2 map of 128", formula.map(SQUARED_128)),
        ("corrected, quadrant map of 32", map(Shape::Quadrant, 32, 16)),
        ("corrected, 2-D map of 64", map(Shape::Square, 64, 16)),
    ];
    named.into_iter().map(|(name, ellipse)| (name.to_string(), ellipse)).collect()
}

/// The pattern of a cell's scene.
pub fn pattern_of(scene: &str) -> Pattern {
    let known = [Pattern::PinkNoise, Pattern::Checker(2)];
    known.into_iter().find(|pattern| pattern.name() == scene).expect("one of the scenes")
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = if bench.effort == Effort::Quick { [96, 72] } else { [256, 192] };
    let lab = Lab::new(&bench.gpu(&[])?, pattern_of(&cell.scene), size)?;
    let plane = Tilt::of(cell.x.expect("a sweep")).plane(size[1]);
    let disc = supersample::Kernel::Gaussian { sigma: 1e3, radius: 1.0 };
    let [formula_4, of_box, disc] =
        [FORMULA_4, supersample::Kernel::Box, disc].map(|kernel| lab.truth(&plane, kernel));
    let mut rows = Vec::new();
    let mut formula = None;
    for (name, ellipse) in variants() {
        let shown = lab.show(&lab.pass(&Method::Ellipse(ellipse))?, &plane, 0)?;
        let own = if name == NONE { &disc } else { &formula_4 };
        for (quantity, truth) in [(NMSE, &formula_4), (BOX, &of_box), (OWN, own)] {
            let nmse = errors(&shown.picture, truth)?.nmse;
            rows.push(Row::new(&*name, quantity, "", Value::Number(nmse)));
        }
        if name == FORMULA {
            formula = Some(shown.picture);
        } else if let (Some(formula), Some(_)) = (&formula, ellipse.map) {
            let nmse = compare(&shown.picture, formula)?.nmse();
            rows.push(Row::new(&*name, OF_MAP, "", Value::Number(nmse)));
        }
    }
    let methods: Vec<_> = variants().into_iter().map(|(name, e)| (name, Method::Ellipse(e))).collect();
    let timed = lab.times(bench, &methods, &[plane])?;
    let named = |name: &str| timed.iter().find(|timed| timed.variant == name).expect("all were timed");
    for one in &timed {
        rows.push(lab.time_row(one, 1, TIME));
        for (quantity, of, to) in [(OVER_NONE, one, named(NONE)), (OVER_MAP, named(FORMULA), one)] {
            let value = time_ratio(of, to).filter(|_| one.variant != "empty pass");
            rows.extend(value.map(|ratio| Row::new(&*one.variant, quantity, "", Value::Summary(ratio))));
        }
    }
    Ok(rows)
}

/// Every cell's number of a variant.
fn numbers<'a>(
    table: &'a Table,
    quantity: &'a str,
    variant: &'a str,
) -> impl Iterator<Item = (String, f64)> + 'a {
    table.of(quantity).filter(move |record| record.row.variant == variant).filter_map(|record| {
        let x = record.x.map_or(String::new(), |x| format!(" at {x}"));
        Some((format!("{}{x}", record.scene), record.row.value.number()?))
    })
}

/// Whether one variant's number is below `factor` times another's in every cell, and in which not.
fn smaller(table: &Table, quantity: &str, of: &str, than: &str, factor: f64) -> Finding {
    let pairs: Vec<(String, f64, f64)> = numbers(table, quantity, of)
        .zip(numbers(table, quantity, than))
        .map(|((cell, a), (_, b))| (cell, a, b))
        .collect();
    let holds = pairs.iter().filter(|(_, a, b)| *a < factor * b).count();
    let words = pairs.iter().map(|(cell, a, b)| format!("{cell} {} and {}", short(*a), short(*b)));
    let why = format!("{quantity}, {of} and {than}: smaller in {holds} of {} cells", pairs.len());
    Finding::new(of_count(holds, pairs.len()), words.collect::<Vec<_>>().join("; "), why)
}

fn of_count(holds: usize, of: usize) -> Verdict {
    match (holds, of) {
        (_, 0) => Verdict::NotMeasured,
        (holds, of) if holds == of => Verdict::Reproduced,
        (0, _) => Verdict::NotReproduced,
        _ => Verdict::InPart,
    }
}

fn corrected(table: &Table) -> Finding {
    // Facing the plane, blind weights and those as printed are the exact ones.
    let others = [(NONE, 1.0), (BLIND, 1.001), (ROWS, 1.001), (COLUMNS, 1.001)];
    let found = others.map(|(other, factor)| smaller(table, NMSE, FORMULA, other, factor));
    let all = |verdict| found.iter().all(|finding| finding.verdict == verdict);
    let verdict = match () {
        () if all(Verdict::NotMeasured) => Verdict::NotMeasured,
        () if all(Verdict::Reproduced) => Verdict::Reproduced,
        () if all(Verdict::NotReproduced) => Verdict::NotReproduced,
        () => Verdict::InPart,
    };
    let why = found.iter().map(|finding| finding.why.clone()).collect::<Vec<_>>().join("; ");
    Finding::new(verdict, found[0].numbers.clone(), why)
}

/// Whether a variant's time ratio `holds` in every cell; on a GPU.
fn cost(table: &Table, quantity: &str, variant: &str, holds: impl Fn(f64) -> bool) -> Finding {
    let ratios: Vec<(String, f64)> = numbers(table, quantity, variant).collect();
    let words =
        ratios.iter().map(|(cell, ratio)| format!("{cell} {ratio:.3}")).collect::<Vec<_>>().join(", ");
    let count = ratios.iter().filter(|(_, ratio)| holds(*ratio)).count();
    if table.machine.is_software() && !ratios.is_empty() {
        return Finding::new(
            Verdict::NotMeasurable,
            words,
            "times of a software device say nothing of a GPU",
        );
    }
    Finding::new(of_count(count, ratios.len()), words, format!("{quantity}: {variant}"))
}

fn map_speed(table: &Table) -> Finding {
    let found = cost(table, OVER_MAP, RADIAL, |ratio| ratio > 1.0);
    let most = numbers(table, OVER_MAP, RADIAL).map(|(_, ratio)| ratio).fold(0.0, f64::max);
    match found.verdict {
        Verdict::Reproduced | Verdict::InPart if most < 1.25 => Finding { verdict: Verdict::InPart, ..found },
        Verdict::InPart => Finding { verdict: Verdict::Reproduced, ..found },
        _ => found,
    }
}

fn at_most(table: &Table, variant: &str, most: f64) -> Finding {
    let found: Vec<(String, f64)> = numbers(table, OF_MAP, variant).collect();
    let words =
        found.iter().map(|(cell, nmse)| format!("{cell} {}", short(*nmse))).collect::<Vec<_>>().join(", ");
    let count = found.iter().filter(|(_, nmse)| *nmse <= most).count();
    Finding::new(of_count(count, found.len()), words, format!("{variant}: at most {}", short(most)))
}
