//! tm.v1: texels that the ellipse's edge cuts. Compares approximations of V1, the volume on the inner side of the cut,
//! and their effect on a picture's error. The thesis calls V1 the cut-off volume.

use super::lab::{FLOOR, FORMULA_4, GAUSSIAN, Lab, TEXELS, TIME, errors};
use super::shape::{TILTS, pattern_of};
use super::shown::patterns;
use crate::figure::prelude::*;
use crate::paper::texture_mapping::method::{EllipseFilter, Method};
use crate::paper::texture_mapping::plane::Tilt;
use crate::paper::texture_mapping::reference::ellipse::kept;
use crate::paper::texture_mapping::weights::{Edge, EllipseKernel};

pub const EDGES: Figure = Figure {
    id: "tm.v1",
    title: "Edge texels: the cut-off volume and its approximations",
    about: "If the ellipse's edge cuts a texel, the thesis weights the texel by the part of a Gaussian body's volume \
            (sigma 0.2 texels) on the inner side of the cut. It gives three approximations of that volume and calls \
            the texel's covered area inadequate. The error bounds of the approximations are partly illegible; we read \
            1e-2, 5e-3 and 1e-2, which the formulas can meet. Each approximation is compared with the exact volume. \
            Each picture is compared with the f64 truth of its own kernel. One kernel is formula (4)'s exp(-3.125 r^2) \
            without a reconstruction term, as in the thesis. The other is our default, the EWA filter's exp(-2 r^2) \
            with a reconstruction term of 0.8. The times and the counts of fetched texels belong to this kernel. In \
            the plots of errors, a line shows the error of the truth itself. The pictures show planes of `pink-noise` \
            and `checker-2` and have 96 x 72 (quick) or 256 x 192 pixels. On a GPU, times are of pictures with 8 times \
            as many rows and columns.",
    scenes: &["pink-noise", "checker-2"],
    variants: || Edge::ALL.map(Edge::name).into_iter().chain([FLOOR]).map(String::from).collect(),
    paper: &["exact", "quadratic", "cubic", "piecewise linear"],
    sweep: Some(Sweep { name: "tilt, degrees", quick: TILTS, full: TILTS }),
    show: Show::views(|| patterns(TILTS)),
    measure,
    plots: &[
        Plot::sweep(NMSE).log_y().floor(FLOOR),
        Plot::sweep(NMSE_EWA).log_y().floor(FLOOR),
        Plot::sweep(TIME),
        Plot::curves(VOLUME, "distance to the edge, texels"),
    ],
    claims: &[
        Claim::paper(
            "claim 3, figures 4-6",
            "accuracy",
            "Weighting edge texels by their cut-off volume is more accurate than counting them as whole \
             texels.",
            &[Test::ratio_of(NMSE, [EXACT, NONE], Below(1.0))],
        ),
        Claim::paper(
            "claim 3, figure 5",
            "bounds",
            "The errors of the quadratic, cubic and piecewise linear form are at most 1e-2, 5e-3 and 1e-2.",
            &[
                Test::value(one(OFF, "quadratic"), AtMost(1e-2)),
                Test::value(one(OFF, "cubic"), AtMost(5e-3)),
                Test::value(one(OFF, "piecewise linear"), AtMost(1e-2)),
            ],
        ),
        Claim::ours(
            "area",
            "Under the EWA filter's kernel, the texel's covered area is as good as the exact volume: its NMSE is \
             at most 1.1 times as large.",
            &[Test::ratio_of(NMSE_EWA, ["area ramp", EXACT], AtMost(1.1))],
        ),
    ],
    ..Figure::BASE
};

/// Names of [`Edge`].
const EXACT: &str = "exact";
const NONE: &str = "none";

const NMSE: &str = "NMSE, formula (4)";
const NMSE_EWA: &str = "NMSE, EWA kernel";
const VOLUME: &str = "part of the texel";
const OFF: &str = "largest error of the form";

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = bench.effort_of([96, 72], [256, 192]);
    let lab = Lab::new(&bench.gpu(&[])?, pattern_of(&cell.scene), size)?;
    let tilt = Tilt::of(cell.x.expect("a sweep"));
    let plane = tilt.plane(size[1]);
    let formula_4 = EllipseFilter::BEST.kernel(EllipseKernel::FORMULA_4).k(0.0);
    let filters = [(NMSE, formula_4, FORMULA_4), (NMSE_EWA, EllipseFilter::BEST, GAUSSIAN)];
    let truths = filters.map(|(.., of_truth)| lab.truth(&plane, of_truth));
    let floors = filters.iter().zip(&truths);
    let mut rows: Vec<Row> =
        floors.map(|((quantity, ..), truth)| Row::number(FLOOR, *quantity, "", truth.own_nmse())).collect();
    let mut methods = Vec::new();
    for edge in Edge::ALL {
        let method = Method::Ellipse(EllipseFilter::BEST.edge(edge));
        let row = |quantity, value| Row::new(edge.name(), quantity, "", value);
        for ((quantity, filter, _), truth) in filters.iter().zip(&truths) {
            let method = Method::Ellipse(filter.edge(edge));
            let shown = lab.show(&lab.pass(&method)?, &plane, 0)?;
            rows.push(row(*quantity, Value::Number(errors(&shown.picture, truth)?.nmse)));
            // The number of texels belongs to the filter that is timed.
            if *quantity == NMSE_EWA {
                rows.push(Row::number(edge.name(), TEXELS, "texels", shown.fetched));
            }
        }
        rows.push(row(OFF, Value::Number(largest_error(edge))));
        let at = |n: i32| f64::from(n) / 50.0;
        rows.push(row(VOLUME, Value::Series((-25..=25).map(|n| [at(n), kept(edge, at(n))]).collect())));
        methods.push((edge.name().to_string(), method));
    }
    let timed = Lab::timed(&lab.gpu, pattern_of(&cell.scene), size)?;
    rows.extend(timed.time_rows(bench, &methods, &[tilt.plane(timed.size[1])])?);
    Ok(rows)
}

/// The largest error against the exact volume, at distances of 0 to 1/2 texel.
fn largest_error(edge: Edge) -> f64 {
    let error = |n: i32| {
        let d = f64::from(n) / 20_000.0;
        (kept(edge, d) - kept(Edge::Exact, d)).abs()
    };
    (0..10_000).map(error).fold(0.0, f64::max)
}
