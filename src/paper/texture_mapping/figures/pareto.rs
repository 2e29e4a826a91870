//! tm.pareto: cost and error of all filters on one chart.

use super::lab::{GAUSSIAN, Lab, errors, excused, geometric_mean};
use super::methods::{self, OURS};
use crate::figure::claim::{Bound::AtMost, Bound::Equal, Claim, Test, best, every, one};
use crate::figure::{Bench, Cell, Effort, Figure, Plot, Row, Value};
use crate::paper::texture_mapping::method::Method;
use crate::paper::texture_mapping::plane::{Plane, Tilt};
use crate::picture::write::Srgb8Picture;
use crate::reference::pattern::Pattern;
use crate::reference::supersample::{Kernel, Truth};

pub const PARETO: Figure = Figure {
    id: "tm.pareto",
    title: "Filters: time and texels against error",
    about: "18 cases (`planes`): a checker of 2 texels, a zone plate and 1/f noise on a plane tilted by 0, 30, 60, \
            70, 75 and 80 degrees. The field of view is 16 degrees, with one texel per pixel at the centre. The truth \
            is the f64 mean of thousands of stratified samples per pixel under the kernel of EWA filters, a Gaussian \
            of sigma 0.5 pixels cut at one pixel. A line shows the truth's own error, the smallest error that can be \
            measured. The second truth is a box of one pixel, which favours box-like filters. NMSE is the geometric \
            mean over the cases. Texels fetched per pixel are a cost that does not depend on the device; the device's \
            own samplers do not report them. The time is the mean over the six tilts of 1/f noise. Pictures have 96 x \
            72 (quick) or 256 x 192 pixels. A software device's anisotropic sampler is an EWA filter; it is listed as \
            `software driver's EWA`, not as a GPU's sampler.",
    scenes: &["planes"],
    variants: || names().into_iter().chain([FLOOR.into(), FRONT.into()]).collect(),
    paper: &["paper's rows", "paper's columns", "object space, spacing 1"],
    ours: &[OURS],
    sweep: None,
    measure,
    plots: &[
        Plot::curves(BY_TEXELS, "texels fetched a pixel").log_x().log_y(),
        Plot::curves(BY_TIME, "NMSE").log_x().log_y(),
        Plot::bars(NMSE).log_y().floor(FLOOR),
        Plot::bars(BOX).log_y().floor(FLOOR),
        Plot::bars(FLIP),
        Plot::bars(TIME).log_y().floor("empty pass"),
    ],
    claims: &[
        Claim::ours(
            "best",
            "Our filter has an NMSE of at most 1e-4 (worst case 1e-3) and fetches at most 100 texels per \
             pixel.",
            &[
                Test::value(one(NMSE, OURS), AtMost(1e-4)),
                Test::value(one(WORST_CASE, OURS), AtMost(1e-3)),
                Test::value(one(TEXELS, OURS), AtMost(100.0)),
            ],
        ),
        Claim::ours(
            "cheap",
            "A cheap setting of our filter has an NMSE of at most 5e-4 and fetches at most 32 texels per \
             pixel.",
            &[Test::value(one(NMSE, CHEAP), AtMost(5e-4)), Test::value(one(TEXELS, CHEAP), AtMost(32.0))],
        ),
        Claim::ours(
            "front",
            "For every other method, one of our settings fetches no more texels and has no larger error.",
            &[Test::value(every(AHEAD), Equal(0.0))],
        ),
        Claim::ours(
            "truth",
            "The truth's own error is at most a tenth of the smallest error of a filter.",
            &[Test::ratio(one(NMSE, FLOOR), best(NMSE, names), AtMost(0.1))],
        ),
    ],
};

const CHEAP: &str = "ellipse, ratio 4";
const FLOOR: &str = "the truth's own error";
const FRONT: &str = "front of all";

const NMSE: &str = "NMSE";
const WORST_CASE: &str = "NMSE of the worst case";
const BOX: &str = "NMSE against a box";
const FLIP: &str = "FLIP";
const WORST_PIXEL: &str = "worst pixel";
const TEXELS: &str = "texels fetched a pixel";
const TIME: &str = "time a pixel";
const AHEAD: &str = "ahead of our settings";
const BY_TEXELS: &str = "NMSE by texels";
const BY_TIME: &str = "time by NMSE";

const PATTERNS: [Pattern; 3] = [Pattern::Checker(2), Pattern::ZonePlate, Pattern::PinkNoise];
const TILTS: [f64; 6] = [0.0, 30.0, 60.0, 70.0, 75.0, 80.0];

fn names() -> Vec<String> {
    methods::all().into_iter().map(|(name, _)| name).collect()
}

/// A method's results in all cases; `worst` is the largest error of a pixel.
#[derive(Default)]
struct Score {
    nmse: Vec<f64>,
    of_box: Vec<f64>,
    flip: Vec<f64>,
    worst: f64,
    fetched: Vec<f64>,
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = if bench.effort == Effort::Quick { [96, 72] } else { [256, 192] };
    let gpu = bench.gpu(&[])?;
    let (present, absent): (Vec<_>, Vec<_>) =
        methods::all().into_iter().partition(|(name, method)| excused(&gpu, name, method).is_none());
    let planes = TILTS.map(|tilt| Tilt::of(tilt).plane(size[1]));
    let mut scores: Vec<Score> = present.iter().map(|_| Score::default()).collect();
    let mut floors = Vec::new();
    for pattern in PATTERNS {
        let lab = Lab::new(&gpu, pattern, size)?;
        let truths: Vec<[Truth; 2]> = planes
            .iter()
            .map(|plane| [GAUSSIAN, Kernel::Box].map(|kernel| lab.truth(plane, kernel)))
            .collect();
        floors.extend(truths.iter().map(|[truth, _]| truth.own_nmse));
        for ((name, method), score) in present.iter().zip(&mut scores) {
            score_of(&lab, method, &planes, &truths, score)?;
            if pattern == Pattern::PinkNoise {
                continue;
            }
            let shown = lab.show(&lab.pass(method)?, &planes[5], 0)?;
            let file = format!("tm.pareto-{}-{}-{}", cell.scene, pattern.name(), plain(name));
            bench.picture(&file, &Srgb8Picture::from(&shown.picture))?;
        }
    }
    let mut rows: Vec<Row> =
        present.iter().zip(&scores).flat_map(|((name, _), score)| rows_of(name, score)).collect();
    rows.push(Row::new(FLOOR, NMSE, "", Value::Number(geometric_mean(&floors))));
    rows.push(Row::new(FLOOR, BOX, "", Value::Number(geometric_mean(&floors))));
    for (name, method) in &absent {
        let why = excused(&gpu, name, method).expect("absent methods have a reason");
        rows.push(Row::new(&**name, NMSE, "", Value::Missing(why.into())));
    }
    rows.extend(ahead(&present, &scores));
    rows.push(Row::new(FRONT, BY_TEXELS, "", Value::Series(front(&scores))));
    rows.extend(time_rows(bench, &Lab::new(&gpu, Pattern::PinkNoise, size)?, &present, &planes, &scores)?);
    Ok(rows)
}

fn score_of(
    lab: &Lab,
    method: &Method,
    planes: &[Plane],
    truths: &[[Truth; 2]],
    score: &mut Score,
) -> anyhow::Result<()> {
    let pass = lab.pass(method)?;
    for (plane, [gaussian, of_box]) in planes.iter().zip(truths) {
        let shown = lab.show(&pass, plane, 0)?;
        let found = errors(&shown.picture, gaussian)?;
        score.nmse.push(found.nmse);
        score.flip.push(found.flip);
        score.worst = score.worst.max(found.worst);
        score.of_box.push(errors(&shown.picture, of_box)?.nmse);
        score.fetched.push(shown.fetched);
    }
    Ok(())
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn rows_of(name: &str, score: &Score) -> Vec<Row> {
    let (nmse, fetched) = (geometric_mean(&score.nmse), mean(&score.fetched));
    let number = |quantity, unit, number| Row::new(name, quantity, unit, Value::Number(number));
    let mut rows = vec![
        number(NMSE, "", nmse),
        number(WORST_CASE, "", score.nmse.iter().copied().fold(0.0, f64::max)),
        number(BOX, "", geometric_mean(&score.of_box)),
        number(FLIP, "", mean(&score.flip)),
        number(WORST_PIXEL, "of white", score.worst),
    ];
    // A device's sampler does not report its texels.
    if fetched > 0.0 {
        rows.push(number(TEXELS, "texels", fetched));
        rows.push(Row::new(name, BY_TEXELS, "", Value::Series(vec![[fetched, nmse]])));
    }
    rows
}

/// (texels, NMSE) of the Pareto-optimal methods, in order of texels.
fn front(scores: &[Score]) -> Vec<[f64; 2]> {
    let mut points: Vec<[f64; 2]> = scores
        .iter()
        .map(|score| [mean(&score.fetched), geometric_mean(&score.nmse)])
        .filter(|[fetched, _]| *fetched > 0.0)
        .collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut least = f64::INFINITY;
    points.retain(|&[_, nmse]| {
        let better = nmse < least;
        least = least.min(nmse);
        better
    });
    points
}

/// For every other method whose texels are counted: 0 if one of our settings has no more texels and no larger error,
/// else 1.
fn ahead(methods: &[(String, Method)], scores: &[Score]) -> Vec<Row> {
    let points: Vec<(&str, f64, f64)> = methods
        .iter()
        .zip(scores)
        .map(|((name, _), score)| (&**name, mean(&score.fetched), geometric_mean(&score.nmse)))
        .filter(|(_, texels, _)| *texels > 0.0)
        .collect();
    let (ours, others): (Vec<_>, Vec<_>) = points.into_iter().partition(|(name, ..)| name.starts_with(OURS));
    let matched = |texels, nmse| ours.iter().any(|&(_, t, e)| t <= texels && e <= nmse);
    let row =
        |(name, texels, nmse)| Row::number(name, AHEAD, "", f64::from(u8::from(!matched(texels, nmse))));
    others.into_iter().map(row).collect()
}

fn time_rows(
    bench: &Bench,
    lab: &Lab,
    methods: &[(String, Method)],
    planes: &[Plane],
    scores: &[Score],
) -> anyhow::Result<Vec<Row>> {
    let timed = lab.times(bench, methods, planes)?;
    let mut rows: Vec<Row> = timed.iter().map(|timed| lab.time_row(timed, planes.len(), TIME)).collect();
    for (row, score) in rows.clone().iter().zip(scores) {
        if let Value::Summary(ns) = row.value {
            let spread = Value::Spreads(vec![(geometric_mean(&score.nmse), ns)]);
            rows.push(Row::new(&*row.variant, BY_TIME, "ns", spread));
        }
    }
    Ok(rows)
}

/// A name as part of a file name.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '.' { c } else { '-' }).collect()
}
