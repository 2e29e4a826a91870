//! tm.v1: the cut-off volume of the texels at the ellipse's edge, its approximations, and what they do to a picture.

use super::lab::{FORMULA_4, GAUSSIAN, Lab, errors, geometric_mean, short};
use super::shape::pattern_of;
use crate::figure::{
    Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Sweep, Table, Value, Verdict,
};
use crate::paper::texture_mapping::method::{Ellipse, Method};
use crate::paper::texture_mapping::plane::Tilt;
use crate::paper::texture_mapping::reference::ellipse::kept;
use crate::paper::texture_mapping::weights::{Edge, Kernel};

pub const EDGES: Figure = Figure {
    id: "tm.v1",
    title: "Edge texels: the cut-off volume and its approximations",
    about: "The thesis weighs a texel that the ellipse cuts by the volume of a Gaussian body (sigma 0.2 texels) on the inner side, and \
            gives three approximations of that volume; it calls the plain part of the texel's area inadequate. Its printed bounds of the \
            approximations' errors are damaged: 1e-2, 5e-3 and 1e-2 are the readings that the forms can keep. Here each is held against the \
            exact volume, and each picture against the f64 truth of its own kernel: formula (4)'s exp(-3.125 r^2) without a \
            reconstruction term, as in the thesis, and the EWA filter's exp(-2 r^2) with k = 0.8, our default. Planes of `pink-noise` and \
            `checker-2`, 96 x 72 (quick) or 256 x 192 pixels.",
    scenes: &["pink-noise", "checker-2"],
    variants: || Edge::ALL.map(|edge| edge.name().to_string()).to_vec(),
    sweep: Some(Sweep { name: "tilt, degrees", quick: TILTS, full: TILTS }),
    measure,
    plots: &[
        Plot { quantity: NMSE, x: Axis::Sweep, log_x: false, log_y: true, floor: None },
        Plot { quantity: NMSE_EWA, x: Axis::Sweep, log_x: false, log_y: true, floor: None },
        Plot { quantity: TIME, x: Axis::Sweep, log_x: false, log_y: false, floor: None },
        Plot {
            quantity: VOLUME,
            x: Axis::Series("distance to the edge, texels"),
            log_x: false,
            log_y: false,
            floor: None,
        },
    ],
    claims: &[
        Claim {
            id: "accuracy",
            text: "The cut-off volume of edge texels makes the picture more accurate than whole texels.",
            from: Origin::Paper("chapter 2, figures 4-6"),
            check: accuracy,
        },
        Claim {
            id: "bounds",
            text: "The quadratic, the cubic and the piecewise linear form are off by at most 1e-2, 5e-3 and 1e-2.",
            from: Origin::Paper("chapter 2, figure 5"),
            check: bounds,
        },
        Claim {
            id: "area",
            text: "The plain part of the texel's area is as good under the EWA filter's kernel: its geometric-mean NMSE is at most 1.1 \
                   times the exact volume's.",
            from: Origin::Ours,
            check: area,
        },
    ],
};

const TILTS: &[f64] = &[0.0, 30.0, 60.0, 75.0, 80.0];

const NMSE: &str = "NMSE, formula (4)";
const NMSE_EWA: &str = "NMSE, EWA kernel";
const TIME: &str = "time a pixel";
const VOLUME: &str = "part of the texel";
const OFF: &str = "largest error of the form";

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = if bench.effort == Effort::Quick { [96, 72] } else { [256, 192] };
    let lab = Lab::new(&bench.gpu(&[])?, pattern_of(&cell.scene), size)?;
    let plane = Tilt::of(cell.x.expect("a sweep")).plane(size[1]);
    let formula_4 = Ellipse::BEST.kernel(Kernel::FORMULA_4).k(0.0);
    let filters = [(NMSE, formula_4, FORMULA_4), (NMSE_EWA, Ellipse::BEST, GAUSSIAN)];
    let truths = filters.map(|(.., of_truth)| lab.truth(&plane, of_truth));
    let mut rows = Vec::new();
    let mut methods = Vec::new();
    for edge in Edge::ALL {
        let method = Method::Ellipse(Ellipse::BEST.edge(edge));
        let row = |quantity, value| Row::new(edge.name(), quantity, "", value);
        for ((quantity, filter, _), truth) in filters.iter().zip(&truths) {
            let method = Method::Ellipse(filter.edge(edge));
            let shown = lab.show(&lab.pass(&method)?, &plane, 0)?;
            rows.push(row(*quantity, Value::Number(errors(&shown.picture, truth)?.nmse)));
        }
        rows.push(row(OFF, Value::Number(largest_error(edge))));
        let at = |n: i32| f64::from(n) / 50.0;
        rows.push(row(VOLUME, Value::Series((-25..=25).map(|n| [at(n), kept(edge, at(n))]).collect())));
        methods.push((edge.name().to_string(), method));
    }
    let timed = lab.times(bench, &methods, &[plane])?;
    rows.extend(timed.iter().map(|timed| lab.time_row(timed, 1, TIME)));
    Ok(rows)
}

/// Against the exact volume, between the texel's middle and its end.
fn largest_error(edge: Edge) -> f64 {
    let error = |n: i32| {
        let d = f64::from(n) / 20_000.0;
        (kept(edge, d) - kept(Edge::Exact, d)).abs()
    };
    (0..10_000).map(error).fold(0.0, f64::max)
}

/// Every cell's NMSE of a form.
fn nmse(table: &Table, quantity: &str, edge: Edge) -> Vec<f64> {
    let of = table.of(quantity).filter(|record| record.row.variant == edge.name());
    of.filter_map(|record| record.row.value.number()).collect()
}

fn accuracy(table: &Table) -> Finding {
    let (exact, none) = (nmse(table, NMSE, Edge::Exact), nmse(table, NMSE, Edge::None));
    let holds = exact.iter().zip(&none).filter(|(exact, none)| exact < none).count();
    let verdict = match holds {
        _ if exact.is_empty() => Verdict::NotMeasured,
        n if n == exact.len() => Verdict::Reproduced,
        0 => Verdict::NotReproduced,
        _ => Verdict::InPart,
    };
    let numbers =
        format!("geometric mean {} beside {}", short(geometric_mean(&exact)), short(geometric_mean(&none)));
    Finding::new(verdict, numbers, format!("smaller in {holds} of {} cells", exact.len()))
}

fn bounds(table: &Table) -> Finding {
    let stated = [(Edge::Quadratic, 1e-2), (Edge::Cubic, 5e-3), (Edge::PiecewiseLinear, 1e-2)];
    let found = stated.map(|(edge, bound)| {
        let record = table.of(OFF).find(|record| record.row.variant == edge.name());
        record.and_then(|record| record.row.value.number()).map(|off| (edge, off, off <= bound))
    });
    let words = found.iter().flatten().map(|(edge, off, _)| format!("{} {}", edge.name(), short(*off)));
    let verdict = match found {
        _ if found.iter().any(Option::is_none) => Verdict::NotMeasured,
        _ if found.iter().flatten().all(|(.., holds)| *holds) => Verdict::Reproduced,
        _ if found.iter().flatten().all(|(.., holds)| !holds) => Verdict::NotReproduced,
        _ => Verdict::InPart,
    };
    Finding::new(verdict, words.collect::<Vec<_>>().join(", "), "at 10 000 distances")
}

fn area(table: &Table) -> Finding {
    let [ramp, exact] = [Edge::AreaRamp, Edge::Exact].map(|edge| nmse(table, NMSE_EWA, edge));
    if ramp.is_empty() {
        return Finding::new(Verdict::NotMeasured, "", "no cell was measured");
    }
    let (ramp, exact) = (geometric_mean(&ramp), geometric_mean(&exact));
    let verdict = if ramp <= 1.1 * exact { Verdict::Reproduced } else { Verdict::NotReproduced };
    Finding::new(verdict, format!("{} beside {}", short(ramp), short(exact)), "geometric mean of the cells")
}
