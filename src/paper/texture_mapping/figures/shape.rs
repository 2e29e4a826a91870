//! tm.24: error and time of weights that follow the footprint's shape, and of weight maps.

use super::lab::{FLOOR, FORMULA_4, Lab, TEXELS, TIME, errors};
use super::map_error::{self, BY_ENTRIES, THESIS_NMSE};
use super::methods::{PAPER_BY_LEVEL, QUADRANT_32, RADIAL_64, SQUARE_64, SQUARED_128, THESIS};
use super::shown::patterns;
use crate::figure::prelude::*;
use crate::math::weight_map::{MapShape, WeightMap};
use crate::paper::texture_mapping::footprint::Axes;
use crate::paper::texture_mapping::method::{EllipseFilter, Method};
use crate::paper::texture_mapping::plane::Tilt;
use crate::paper::texture_mapping::weights::EllipseKernel;
use crate::picture::Picture;
use crate::picture::error::compare;
use crate::reference::pattern::Pattern;
use crate::reference::supersample;

pub const SHAPE: Figure = Figure {
    id: "tm.24",
    title: "Weights: none, circular, following the footprint's shape, and from maps",
    about: "Figure 24 of the thesis: Gaussian weights that follow the footprint's shape, formula (4), are more \
            accurate (by expert ratings) and cost at most 5 %. Weight maps are up to 25 % faster than the formula, and \
            their picture has an NMSE of 0.000708 against the formula's. Here all variants sum the same texels, those \
            of the exact ellipse with a reconstruction term of 0.8. \"As printed\" takes the lengths of the Jacobian's \
            rows (columns) as the axes. \"Diameter 1\" is the other reading of formula (4)'s base: its diameter, not \
            its radius, is one pixel. \"Blind to shape\" uses the weights of a circle. The truths are formula (4)'s \
            kernel, exp(-3.125 r^2), and a box of one pixel. The ellipse without weights is also compared with its own \
            kernel, a disc. A line shows each truth's own error. The shader counts the texels that it fetches; each \
            takes one weight, by the formula or from one or two entries of a map. Maps of every shape with 4 to 256 \
            entries a side, in 8 and 16 bits, are compared with the formula in f64, by pictures of 48 x 36 pixels. The \
            pictures show planes of `pink-noise` and `checker-2` and have 96 x 72 (quick) or 256 x 192 pixels. On a \
            GPU, times are of pictures with 8 times as many rows and columns.",
    scenes: &["pink-noise", "checker-2"],
    variants: || {
        let own = variants().into_iter().map(|(name, _)| name);
        own.chain(map_error::names()).chain([FLOOR, THESIS].map(String::from)).collect()
    },
    paper: &["as printed, rows", "as printed, columns", ROWS_MAP],
    ours: &[FORMULA],
    full_only: &[],
    sweep: Some(Sweep { name: "tilt, degrees", quick: TILTS, full: TILTS }),
    show: Show::views(|| patterns(TILTS)),
    measure,
    plots: &[
        Plot::sweep(NMSE).log_y().floor(FLOOR),
        Plot::sweep(BOX).log_y().floor(FLOOR),
        // These plots compare with the formula, not with the truth, so their floor is the thesis's number.
        Plot::sweep(OF_MAP).log_y().floor(THESIS),
        Plot::curves(BY_ENTRIES, "entries along a side").log_x().log_y().floor(THESIS),
        Plot::sweep(TIME),
    ],
    claims: &[
        Claim::paper(
            "claim 2, figures 1-3",
            "accuracy",
            "Weights that follow the footprint's shape, as printed, are more accurate than no weights.",
            &[Test::ratio_of(NMSE, [ROWS, NONE], Below(1.0))],
        ),
        // At tilt 0 the blind and the printed weights equal the exact weights, hence the bound of 1.001.
        Claim::ours(
            "corrected",
            "At every tilt, weights with the exact axes are more accurate than none, and at least as \
             accurate as blind and printed ones.",
            &[
                Test::ratio_of(NMSE, [FORMULA, NONE], Below(1.0)),
                Test::ratio_of(NMSE, [FORMULA, BLIND], Below(1.001)),
                Test::ratio_of(NMSE, [FORMULA, ROWS], Below(1.001)),
                Test::ratio_of(NMSE, [FORMULA, COLUMNS], Below(1.001)),
            ],
        ),
        Claim::paper_timed(
            "claim 2, figure 24",
            "cost",
            "Computing the weights costs at most 5 %.",
            &[Test::ratio_of(TIME, [ROWS, NONE], AtMost(1.05))],
        ),
        Claim::paper_timed(
            "claim 4, figure 24",
            "map-speed",
            "At some tilt a weight map is 25 % faster than the formula (the thesis: \"up to 25 %\").",
            &[Test::ratio_of(TIME, [ROWS, ROWS_MAP], AtLeast(1.25))],
        )
        .somewhere(),
        Claim::ours_timed(
            "our-map-speed",
            "With the exact axes, a radial map of 64 entries is 25 % faster than the formula at some tilt.",
            &[Test::ratio_of(TIME, [FORMULA, RADIAL], AtLeast(1.25))],
        )
        .somewhere(),
        Claim::paper(
            "claim 4, figure 24",
            "map-error",
            "A weight map's picture has an NMSE of at most 0.000708 against the formula's picture.",
            &[Test::value(one(OF_MAP, ROWS_MAP), AtMost(THESIS_NMSE))],
        ),
        Claim::ours(
            "map-64",
            "With a radial map of 64 entries, the NMSE against the formula's picture is at most 5e-6.",
            &[Test::value(one(OF_MAP, RADIAL), AtMost(5e-6))],
        ),
    ],
};

pub const TILTS: &[f64] = &[0.0, 30.0, 60.0, 75.0, 80.0];

const NONE: &str = "none";
const BLIND: &str = "blind to shape";
const ROWS: &str = "as printed, rows";
const COLUMNS: &str = "as printed, columns";
const DIAMETER_1: &str = "as printed, rows, diameter 1";
const ROWS_MAP: &str = "as printed, rows, 2-D map of 64";
const FORMULA: &str = "corrected";
const RADIAL: &str = "corrected, radial map of 64";

const NMSE: &str = "NMSE against formula (4)'s kernel";
const BOX: &str = "NMSE against a box";
const OWN: &str = "NMSE against its own kernel";
const OF_MAP: &str = "NMSE against the formula's picture";
/// Equal on every device, like [`TEXELS`]: the texels times the map entries per weight.
const ENTRIES: &str = "entries of the weight map read per pixel";

/// The filter with the exact axes and the weights of formula (4).
fn formula() -> EllipseFilter {
    PAPER_BY_LEVEL.axes(Axes::Corrected).k(0.8).max_ratio(64.0)
}

fn variants() -> Vec<(String, EllipseFilter)> {
    let formula = formula();
    let map = |shape, entries, bits| formula.map(WeightMap { shape, entries, bits, linear: false });
    let named = [
        (NONE, formula.kernel(EllipseKernel::UNIFORM)),
        (BLIND, formula.axes(Axes::Round)),
        (ROWS, formula.axes(Axes::Rows)),
        (COLUMNS, formula.axes(Axes::Columns)),
        (DIAMETER_1, formula.axes(Axes::Rows).kernel(EllipseKernel::DIAMETER_1)),
        (ROWS_MAP, formula.map(SQUARE_64).axes(Axes::Rows)),
        (FORMULA, formula),
        (RADIAL, formula.map(RADIAL_64)),
        ("corrected, radial map of 64, nearest", map(MapShape::Radial, 64, 16)),
        ("corrected, radial map of 4", map(MapShape::Radial, 4, 16)),
        ("corrected, radial map of 16", map(MapShape::Radial, 16, 16)),
        ("corrected, radial map of 256", map(MapShape::Radial, 256, 16)),
        ("corrected, radial map of 64, 8 bits", map(MapShape::Radial, 64, 8)),
        ("corrected, r^2 map of 128", formula.map(SQUARED_128)),
        ("corrected, quadrant map of 32", formula.map(QUADRANT_32)),
        ("corrected, 2-D map of 64", formula.map(SQUARE_64)),
    ];
    named.into_iter().map(|(name, ellipse)| (name.to_string(), ellipse)).collect()
}

/// The pattern that a scene names.
pub fn pattern_of(scene: &str) -> Pattern {
    let known = [Pattern::PinkNoise, Pattern::Checker(2)];
    known.into_iter().find(|pattern| pattern.name() == scene).expect("one of the scenes")
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = bench.effort_of([96, 72], [256, 192]);
    let lab = Lab::new(&bench.gpu(&[])?, pattern_of(&cell.scene), size)?;
    let tilt_degrees = cell.x.expect("a sweep");
    let plane = Tilt::of(tilt_degrees).plane(size[1]);
    let gaussian = |sigma, radius| supersample::PixelKernel::Gaussian { sigma, radius };
    let kernels = [FORMULA_4, supersample::PixelKernel::Box, gaussian(1e3, 1.0), gaussian(0.2, 0.5)];
    let [formula_4, of_box, disc, diameter_1] = kernels.map(|kernel| lab.truth(&plane, kernel));
    let floors = [(NMSE, &formula_4), (BOX, &of_box)];
    let mut rows =
        floors.map(|(quantity, truth)| Row::number(FLOOR, quantity, "", truth.own_nmse())).to_vec();
    let mut formulas: Vec<(EllipseFilter, Picture)> = Vec::new();
    for (name, ellipse) in variants() {
        let shown = lab.show(&lab.pass(&Method::Ellipse(ellipse))?, &plane, 0)?;
        let own = match &*name {
            NONE => &disc,
            DIAMETER_1 => &diameter_1,
            _ => &formula_4,
        };
        for (quantity, truth) in [(NMSE, &formula_4), (BOX, &of_box), (OWN, own)] {
            let nmse = errors(&shown.picture, truth)?.nmse;
            rows.push(Row::new(&*name, quantity, "", Value::Number(nmse)));
        }
        let entries = ellipse.map.map_or(0.0, |map| f64::from(map.entries_read()));
        for (quantity, unit, count) in [(TEXELS, "texels", 1.0), (ENTRIES, "entries", entries)] {
            rows.push(Row::number(&*name, quantity, unit, count * shown.fetched));
        }
        match formulas.iter().find(|(of, _)| *of == EllipseFilter { map: None, ..ellipse }) {
            None => formulas.push((ellipse, shown.picture)),
            Some((_, formula)) => {
                let nmse = compare(&shown.picture, formula)?.nmse();
                rows.push(Row::new(&*name, OF_MAP, "", Value::Number(nmse)));
            }
        }
    }
    rows.extend(map_error::rows(&lab, &formula(), tilt_degrees));
    rows.push(Row::number(THESIS, OF_MAP, "", THESIS_NMSE));
    let methods: Vec<_> = variants().into_iter().map(|(name, e)| (name, Method::Ellipse(e))).collect();
    let timed = Lab::timed(&lab.gpu, pattern_of(&cell.scene), size)?;
    rows.extend(timed.time_rows(bench, &methods, &[Tilt::of(tilt_degrees).plane(timed.size[1])])?);
    Ok(rows)
}
