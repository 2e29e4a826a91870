//! tm.temporal: flicker while the camera moves by less than a pixel.

use super::lab::{FLOOR, GAUSSIAN, Lab, TEXELS};
use super::methods::{self, OURS};
use super::shape::pattern_of;
use super::shown::{ellipses_and_trilinear, moving};
use crate::figure::prelude::*;
use crate::paper::texture_mapping::baselines::FilterBaseline;
use crate::paper::texture_mapping::method::Method;
use crate::paper::texture_mapping::plane::Tilt;
use crate::reference::supersample::Truth;
use crate::stats::mean;

pub const TEMPORAL: Figure = Figure {
    id: "tm.temporal",
    title: "Filters in motion: variance over 16 sub-pixel shifts",
    about: "Over 16 frames, the camera moves by 1/16 pixel in x and y per frame. A pixel's error against the f64 truth \
            of its frame flickers if it varies; a constant error does not. The first plot is the mean variance of the \
            error, divided by the mean square of the truth; its line is the truth's own NMSE. The second is the \
            variance of the picture divided by that of the truth: below 1 is blur, above 1 is aliasing. Its line is \
            the truth, at 1; a table gives the truth's own error as a share of the truth's variance. Stochastic \
            filters draw new random numbers in each frame. The pictures show planes of `pink-noise` and `checker-2` \
            and have 48 x 36 pixels.",
    scenes: &["pink-noise", "checker-2"],
    variants: || {
        variants().into_iter().map(|(name, _)| name).chain([FLOOR, TRUTH].map(String::from)).collect()
    },
    paper: &["paper's rows", "paper's columns"],
    ours: &["ellipse"],
    full_only: &[],
    sweep: Some(Sweep { name: "tilt, degrees", quick: &[60.0, 80.0], full: &[0.0, 30.0, 60.0, 75.0, 80.0] }),
    show: Show::views(moving).variants(ellipses_and_trilinear),
    measure,
    plots: &[Plot::sweep(FLICKER).log_y().floor(FLOOR), Plot::sweep(MOTION).log_y().floor(TRUTH)],
    claims: &[Claim::ours(
        "least",
        "Our filter flickers least of all methods that fetch at most twice as many texels as it does (its other \
             settings are not compared).",
        &[Test::value(one(OVER_NEXT, OURS), AtMost(1.0))],
    )],
};

const FRAMES: u32 = 16;
const SIZE: [u32; 2] = [48, 36];

const FLICKER: &str = "variance of the error";
const MOTION: &str = "variance of the picture over the truth's";
const OVER_NEXT: &str = "variance over the least of others with at most twice the texels";
const MOTION_FLOOR: &str = "truth's own error over the truth's variance";

/// The truth's own motion.
const TRUTH: &str = "the truth";

/// All methods, each with its default weights, except the device's samplers, which do not count texels.
fn variants() -> Vec<(String, Method)> {
    let counted = |method: &Method| !matches!(method, Method::Baseline(FilterBaseline::Hardware(_)));
    methods::with_default_weights().into_iter().filter(|(_, method)| counted(method)).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let lab = Lab::new(&bench.gpu(&[])?, pattern_of(&cell.scene), SIZE)?;
    let plane = Tilt::of(cell.x.expect("a sweep")).plane(SIZE[1]);
    let shifted = |frame: u32| plane.shifted([f64::from(frame) / f64::from(FRAMES); 2]);
    let truths: Vec<Truth> = (0..FRAMES).map(|n| lab.truth(&shifted(n), GAUSSIAN)).collect();
    let own = mean(truths.iter().map(Truth::own_nmse));
    let truths: Vec<Vec<f64>> = truths.into_iter().map(|truth| truth.values).collect();
    let square = mean(truths.iter().flatten().map(|value| value * value));
    let true_variance = mean_variance(&truths);
    let mut found = Vec::new();
    let mut rows = vec![
        Row::number(FLOOR, FLICKER, "", own),
        Row::number(TRUTH, MOTION, "", mean_variance(&truths) / true_variance),
        Row::number(FLOOR, MOTION_FLOOR, "", own * square / true_variance),
    ];
    for (name, method) in variants() {
        let pass = lab.pass(&method)?;
        let (mut frames, mut fetched) = (Vec::new(), 0.0);
        for n in 0..FRAMES {
            let shown = lab.show(&pass, &shifted(n), n)?;
            frames.push(shown.picture.rgba.iter().map(|pixel| f64::from(pixel[0])).collect::<Vec<_>>());
            fetched += shown.fetched / f64::from(FRAMES);
        }
        let off: Vec<Vec<f64>> = frames
            .iter()
            .zip(&truths)
            .map(|(found, truth)| found.iter().zip(truth).map(|(a, b)| a - b).collect())
            .collect();
        let number = |quantity, unit, number| Row::number(&*name, quantity, unit, number);
        rows.push(number(FLICKER, "", mean_variance(&off) / square));
        rows.push(number(MOTION, "", mean_variance(&frames) / true_variance));
        rows.push(number(TEXELS, "texels", fetched));
        found.push((name, fetched, mean_variance(&off)));
    }
    let &(_, texels, ours) = found.iter().find(|(name, ..)| name == OURS).expect("one of the variants");
    let others =
        found.iter().filter(|(name, fetched, _)| !name.starts_with(OURS) && *fetched <= 2.0 * texels);
    if let Some(next) = others.map(|(.., variance)| *variance).min_by(f64::total_cmp) {
        rows.push(Row::number(OURS, OVER_NEXT, "", ours / next));
    }
    Ok(rows)
}

/// The mean over pixels of the variance over frames.
fn mean_variance(frames: &[Vec<f64>]) -> f64 {
    let variance = |pixel: usize| {
        let middle = mean(frames.iter().map(|frame| frame[pixel]));
        mean(frames.iter().map(|frame| (frame[pixel] - middle).powi(2)))
    };
    mean((0..frames[0].len()).map(variance))
}
