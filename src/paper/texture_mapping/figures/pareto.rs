//! tm.pareto: cost and error of all filters on one chart.

use super::lab::{
    FLIP, FLOOR, GAUSSIAN, Lab, LabPass, LabPicture, NMSE, TEXELS, TIME, errors, excused, own_errors,
};
use super::methods::{self, FEW, OURS};
use super::shown::{ellipses_and_trilinear, filtered_surfaces};
use crate::figure::prelude::*;
use crate::paper::texture_mapping::baselines::FilterBaseline;
use crate::paper::texture_mapping::method::Method;
use crate::paper::texture_mapping::plane::{Tilt, TiltedPlane};
use crate::picture::write::Srgb8Picture;
use crate::reference::pattern::Pattern;
use crate::reference::supersample::{PixelKernel, Truth};
use crate::stats::{geometric_mean, mean};
use std::f64::consts::PI;

pub const PARETO: Figure = Figure {
    id: "tm.pareto",
    title: "Filters: time and texels against error",
    about: "There are 18 cases (`planes`): a checker of 2 texels, a zone plate and 1/f noise, each on a plane tilted \
            by 0, 30, 60, 70, 75 and 80 degrees. The field of view is 16 degrees, with one texel per pixel at the \
            centre. The truth is the f64 mean of thousands of stratified samples per pixel under the kernel of EWA \
            filters, a Gaussian of sigma 0.5 pixels cut at one pixel. A line shows the truth's own error, the smallest \
            error that can be measured: for FLIP and the worst pixel, the difference between the mean of the samples \
            and the mean of one half of them, drawn independently. The second truth is a box of one pixel, which \
            favours box-like filters. NMSE is the geometric mean over the cases. Texels fetched per pixel are a cost \
            that does not depend on the device; the device's own samplers do not report them. The time is the mean \
            over the six tilts of 1/f noise. `ellipse` has the weights exp(-2 r^2) by the formula, and edge texels by \
            the plain area ramp; its other settings have other weights, edges and maps. The settings with 3 to 18 \
            fetches read coarser levels and limit the axis ratio to 2, 3 or 4; up to 9 fetches, edge texels count as a \
            whole. `nearest texel` reads one texel, which is at most 1.4 pixels wide along the footprint's major axis. \
            Two variants are means of 16 frames, and their texels and times are those of one frame: `stochastic 1, 16 \
            frames` draws new random numbers in each frame, and `ellipse, nearest texel, 16 frames` moves the camera \
            by less than a pixel, as temporal anti-aliasing does. The front is that of single frames. Pictures have 96 \
            x 72 (quick) or 256 x 192 pixels. On a GPU, times are of pictures with 8 times as many rows and columns. A \
            software device's anisotropic sampler is an EWA filter; it is listed as `software driver's EWA`, not as a \
            GPU's sampler.",
    scenes: &["planes"],
    variants: || names().into_iter().chain([FLOOR.into(), FRONT.into()]).collect(),
    paper: &["paper's rows", "paper's columns", "object space, spacing 1"],
    ours: &[OURS],
    show: Show::views(filtered_surfaces).variants(ellipses_and_trilinear),
    measure,
    plots: &[
        points(BY_TEXELS, "texels fetched per pixel"),
        points(BY_TIME, "time per pixel, ns"),
        Plot::bars(NMSE).log_y().floor(FLOOR),
        Plot::bars(BOX).log_y().floor(FLOOR),
        Plot::bars(FLIP).floor(FLOOR),
        Plot::bars(WORST_PIXEL).log_y().floor(FLOOR),
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
            "few",
            "A setting of our filter that fetches at most 10 texels per pixel has an NMSE of at most 6e-4, and at most \
             a ninth of the NMSE of one trilinear sample.",
            &[
                Test::value(one(NMSE, FEW), AtMost(6e-4)),
                Test::value(one(TEXELS, FEW), AtMost(10.0)),
                Test::ratio_of(NMSE, [FEW, "trilinear"], AtMost(1.0 / 9.0)),
            ],
        ),
        Claim::ours(
            "front",
            "For every other method, one of our settings fetches no more texels and has no larger error. (Means of 16 \
             frames are compared with each other.)",
            &[Test::value(every(LOSS), AtLeast(1.0))],
        ),
        Claim::ours(
            "truth",
            "The truth's own error is at most a tenth of the smallest error of a filter.",
            &[Test::ratio(one(NMSE, FLOOR), best(NMSE, names), AtMost(0.1))],
        ),
    ],
    ..Figure::BASE
};

const fn points(quantity: &'static str, cost: &'static str) -> Plot {
    Plot::curves(quantity, cost).log_x().log_y().floor(FLOOR).families(methods::family)
}

const CHEAP: &str = "ellipse, ratio 4";
const FRONT: &str = "front of all";

const WORST_CASE: &str = "NMSE of the worst case";
const BOX: &str = "NMSE against a box";
const WORST_PIXEL: &str = "worst pixel";
const LOSS: &str = "NMSE over that of our best setting with no more texels";
const BY_TEXELS: &str = "NMSE by texels";
const BY_TIME: &str = "NMSE by time";
const SAMPLES: &str = "samples per pixel";
const MAX_SAMPLES: &str = "samples of the pixel with most";

/// One stochastic sample per pixel, accumulated over [`FRAMES`] frames.
const ACCUMULATED: &str = "stochastic 1, 16 frames";
/// The nearest texel, accumulated over [`FRAMES`] frames while the camera moves by less than a pixel ([`jitter`]), as
/// in temporal anti-aliasing.
const JITTERED: &str = "ellipse, nearest texel, 16 frames";
const FRAMES: u32 = 16;

const PATTERNS: [Pattern; 3] = [Pattern::Checker(2), Pattern::ZonePlate, Pattern::PinkNoise];
const TILTS: [f64; 6] = [0.0, 30.0, 60.0, 70.0, 75.0, 80.0];

fn names() -> Vec<String> {
    contenders().into_iter().map(|(name, _)| name).collect()
}

fn contenders() -> Vec<(String, Method)> {
    let accumulated = [
        (ACCUMULATED, Method::Baseline(FilterBaseline::Stochastic(1))),
        (JITTERED, Method::Ellipse(methods::NEAREST)),
    ];
    let accumulated = accumulated.map(|(name, method)| (name.to_string(), method));
    methods::all().into_iter().chain(accumulated).collect()
}

/// A method's results in all cases.
#[derive(Default)]
struct Score {
    nmse: Vec<f64>,
    of_box: Vec<f64>,
    flip: Vec<f64>,
    worst: f64,
    fetched: Vec<f64>,
}

impl Score {
    fn mean_error(&self) -> f64 {
        geometric_mean(self.nmse.iter().copied())
    }

    fn mean_fetched(&self) -> f64 {
        mean(self.fetched.iter().copied())
    }
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = bench.effort_of([96, 72], [256, 192]);
    let gpu = bench.gpu(&[])?;
    let (present, absent): (Vec<_>, Vec<_>) =
        contenders().into_iter().partition(|(name, method)| excused(&gpu, name, method).is_none());
    let planes = TILTS.map(|tilt| Tilt::of(tilt).plane(size[1]));
    let mut scores: Vec<Score> = present.iter().map(|_| Score::default()).collect();
    let mut floors = Vec::new();
    for pattern in PATTERNS {
        let lab = Lab::new(&gpu, pattern, size)?;
        let truths: Vec<[Truth; 2]> = planes
            .iter()
            .map(|plane| [GAUSSIAN, PixelKernel::Box].map(|kernel| lab.truth(plane, kernel)))
            .collect();
        for ((name, method), score) in present.iter().zip(&mut scores) {
            let pass = lab.pass(method)?;
            score_of(&lab, (name, &pass), &planes, &truths, score)?;
            if pattern == Pattern::PinkNoise {
                continue;
            }
            let shown = shown(&lab, (name, &pass), &planes[5])?;
            let file = format!("tm.pareto-{}-{}-{}", cell.scene, pattern.name(), plain(name));
            bench.picture(&file, &Srgb8Picture::from(&shown.picture))?;
        }
        floors.extend(truths);
    }
    let mut rows: Vec<Row> =
        present.iter().zip(&scores).flat_map(|((name, _), score)| rows_of(name, score)).collect();
    rows.extend(floor_rows(&floors)?);
    for (name, method) in &absent {
        let why = excused(&gpu, name, method).expect("absent methods have a reason");
        rows.push(Row::new(&**name, NMSE, "", Value::Missing(why.into())));
    }
    rows.extend(losses(&present, &scores));
    let single = present.iter().zip(&scores).filter(|((name, _), _)| !is_accumulated(name));
    let by_texels = single.map(|(_, score)| [score.mean_fetched(), score.mean_error()]);
    let counted = by_texels.filter(|[fetched, _]| *fetched > 0.0).collect();
    rows.push(Row::new(FRONT, BY_TEXELS, "", Value::Series(front(counted))));
    let timed = Lab::timed(&gpu, Pattern::PinkNoise, size)?;
    let planes = TILTS.map(|tilt| Tilt::of(tilt).plane(timed.size[1]));
    rows.extend(time_rows(bench, &timed, &present, &planes, &scores)?);
    Ok(rows)
}

/// True for the contenders that are means of [`FRAMES`] frames.
fn is_accumulated(name: &str) -> bool {
    [ACCUMULATED, JITTERED].contains(&name)
}

/// A contender's picture. [`ACCUMULATED`] and [`JITTERED`] give the mean of [`FRAMES`] pictures.
fn shown(lab: &Lab, (name, pass): (&str, &LabPass), plane: &TiltedPlane) -> anyhow::Result<LabPicture> {
    match name {
        ACCUMULATED => lab.accumulated(pass, FRAMES, |_| *plane),
        JITTERED => lab.accumulated(pass, FRAMES, |frame| plane.shifted(jitter(frame))),
        _ => lab.show(pass, plane, 0),
    }
}

/// The camera's shift in a frame, in pixels. The shifts of all frames have the distribution of the truth's kernel,
/// exp(-2 r^2) up to r = 1, and lie on a spiral with the golden angle between successive frames.
fn jitter(frame: u32) -> [f64; 2] {
    let share = (f64::from(frame) + 0.5) / f64::from(FRAMES);
    let radius = (-0.5 * (1.0 - share * (1.0 - (-2f64).exp())).ln()).sqrt();
    let angle = f64::from(frame) * PI * (3.0 - 5f64.sqrt());
    [radius * angle.cos(), radius * angle.sin()]
}

fn score_of(
    lab: &Lab,
    contender: (&str, &LabPass),
    planes: &[TiltedPlane],
    truths: &[[Truth; 2]],
    score: &mut Score,
) -> anyhow::Result<()> {
    for (plane, [gaussian, of_box]) in planes.iter().zip(truths) {
        let shown = shown(lab, contender, plane)?;
        let found = errors(&shown.picture, gaussian)?;
        score.nmse.push(found.nmse);
        score.flip.push(found.flip);
        score.worst = score.worst.max(found.max);
        score.of_box.push(errors(&shown.picture, of_box)?.nmse);
        score.fetched.push(shown.fetched);
    }
    Ok(())
}

/// The errors of both truths, and the numbers of samples of the Gaussian truth.
fn floor_rows(truths: &[[Truth; 2]]) -> anyhow::Result<Vec<Row>> {
    let own = |n: usize| geometric_mean(truths.iter().map(|both| both[n].own_nmse()));
    let max = truths.iter().map(|[truth, _]| truth.max_samples).max().unwrap_or(0);
    let quantities = [(NMSE, own(0)), (BY_TEXELS, own(0)), (BY_TIME, own(0)), (BOX, own(1))];
    let mut rows = quantities.map(|(quantity, nmse)| Row::number(FLOOR, quantity, "", nmse)).to_vec();
    let halves = truths.iter().map(|[truth, _]| own_errors(truth)).collect::<anyhow::Result<Vec<_>>>()?;
    rows.push(Row::number(FLOOR, FLIP, "", mean(halves.iter().map(|own| own.flip))));
    let worst = halves.iter().map(|own| own.max).fold(0.0, f64::max);
    rows.push(Row::number(FLOOR, WORST_PIXEL, "of white", worst));
    let samples = mean(truths.iter().map(|[truth, _]| truth.mean_samples));
    rows.push(Row::number(FLOOR, SAMPLES, "samples", samples));
    rows.push(Row::number(FLOOR, MAX_SAMPLES, "samples", max as f64));
    Ok(rows)
}

fn rows_of(name: &str, score: &Score) -> Vec<Row> {
    let (nmse, fetched) = (score.mean_error(), score.mean_fetched());
    let number = |quantity, unit, number| Row::number(name, quantity, unit, number);
    let mut rows = vec![
        number(NMSE, "", nmse),
        number(WORST_CASE, "", score.nmse.iter().copied().fold(0.0, f64::max)),
        number(BOX, "", geometric_mean(score.of_box.iter().copied())),
        number(FLIP, "", mean(score.flip.iter().copied())),
        number(WORST_PIXEL, "of white", score.worst),
    ];
    // A device's sampler does not report its texels.
    if fetched > 0.0 {
        rows.push(number(TEXELS, "texels", fetched));
        rows.push(Row::new(name, BY_TEXELS, "", Value::Series(vec![[fetched, nmse]])));
    }
    rows
}

/// The Pareto-optimal points (cost, NMSE), in order of cost.
fn front(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut min = f64::INFINITY;
    points.retain(|&[_, nmse]| {
        let better = nmse < min;
        min = min.min(nmse);
        better
    });
    points
}

/// For every method that is not ours and whose texels are counted: its NMSE divided by the smallest NMSE of our
/// settings with no more texels. 0 if all our settings have more texels. Means of several frames are compared with each
/// other.
fn losses(methods: &[(String, Method)], scores: &[Score]) -> Vec<Row> {
    let points: Vec<(&str, f64, f64)> = methods
        .iter()
        .zip(scores)
        .map(|((name, _), score)| (&**name, score.mean_fetched(), score.mean_error()))
        .filter(|(_, texels, _)| *texels > 0.0)
        .collect();
    let (ours, others): (Vec<_>, Vec<_>) = points.into_iter().partition(|(name, ..)| name.starts_with(OURS));
    let loss = |(other, max, nmse): (&str, f64, f64)| {
        let comparable = ours
            .iter()
            .filter(|(name, texels, _)| *texels <= max && is_accumulated(name) == is_accumulated(other));
        let least = comparable.map(|(.., nmse)| *nmse).fold(f64::INFINITY, f64::min);
        Row::number(other, LOSS, "", nmse / least)
    };
    others.into_iter().map(loss).collect()
}

fn time_rows(
    bench: &Bench,
    lab: &Lab,
    methods: &[(String, Method)],
    planes: &[TiltedPlane],
    scores: &[Score],
) -> anyhow::Result<Vec<Row>> {
    let mut rows = lab.time_rows(bench, methods, planes)?;
    let point =
        |(row, score): (&Row, &Score)| Some((row.variant.clone(), [row.value.number()?, score.mean_error()]));
    let points: Vec<(String, [f64; 2])> = rows.iter().zip(scores).filter_map(point).collect();
    let single = points.iter().filter(|(name, _)| !is_accumulated(name));
    let ends = front(single.map(|(_, point)| *point).collect());
    let series = points.into_iter().map(|(name, point)| (name, vec![point])).chain([(FRONT.into(), ends)]);
    rows.extend(series.map(|(name, points)| Row::new(name, BY_TIME, "", Value::Series(points))));
    Ok(rows)
}

/// A name as part of a file name.
pub fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '.' { c } else { '-' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::texture_mapping::weights::EllipseKernel;

    #[test]
    fn the_shifts_of_the_camera_have_the_mean_and_the_variance_of_the_kernel() {
        let shifts: Vec<[f64; 2]> = (0..FRAMES).map(jitter).collect();
        let square = mean(shifts.iter().map(|[x, y]| x * x + y * y));
        let kernel = 2.0 * EllipseKernel::EWA.variance();
        assert!((square / kernel - 1.0).abs() < 0.01, "{square}, {kernel}");
        let drift = [0, 1].map(|axis| mean(shifts.iter().map(|shift| shift[axis])));
        assert!(drift.iter().all(|mean| mean.abs() < 0.03), "{drift:?}");
    }

    #[test]
    fn a_mean_of_frames_is_not_compared_with_single_frames() {
        let score =
            |nmse: f64, fetched: f64| Score { nmse: vec![nmse], fetched: vec![fetched], ..Score::default() };
        let methods = [JITTERED, "ellipse, nearest texel", "trilinear", ACCUMULATED]
            .map(|name| (name.to_string(), Method::Ellipse(methods::NEAREST)));
        let scores = [score(0.1, 1.0), score(0.5, 1.0), score(0.4, 8.0), score(0.2, 1.0)];
        let found: Vec<f64> = losses(&methods, &scores).iter().filter_map(|row| row.value.number()).collect();
        assert!((found[0] - 0.8).abs() < 1e-12 && (found[1] - 2.0).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn a_point_that_costs_more_and_is_not_more_accurate_is_not_on_the_front() {
        let points = vec![[4.0, 0.1], [2.0, 0.3], [3.0, 0.3], [1.0, 0.9], [1.0, 0.8], [9.0, 0.2]];
        assert_eq!(front(points), [[1.0, 0.8], [2.0, 0.3], [4.0, 0.1]]);
        assert_eq!(front(Vec::new()), [[0.0; 2]; 0]);
    }
}
