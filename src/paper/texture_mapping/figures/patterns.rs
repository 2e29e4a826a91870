//! tm.patterns: the error of filters on every test pattern, on planes of any tilt, roll and yaw.

use super::lab::{FLIP, FLOOR, GAUSSIAN, Lab, LabPass, NMSE, SIDE, TEXELS, TIME, errors, grey, own_errors};
use super::methods::{self, FEW, OURS};
use super::pareto::plain;
use super::shown::{ellipse_and_trilinear, patterns};
use crate::figure::prelude::*;
use crate::paper::texture_mapping::method::Method;
use crate::paper::texture_mapping::plane::{Tilt, TiltedPlane};
use crate::paper::texture_mapping::relief::shipped::CLIFF;
use crate::picture::write::Srgb8Picture;
use crate::reference::pattern::Pattern;
use crate::reference::supersample::{Density, Truth};
use crate::stats::{geometric_mean, mean};

pub const PATTERNS: Figure = Figure {
    id: "tm.patterns",
    title: "Filters on every pattern, at every tilt, roll and yaw",
    about: "tm.pareto has three patterns on planes that only tilt. Here are eleven patterns of 512 x 512 texels: \
            `checker-1`, `checker-2`, `checker-8` with squares of that many texels; `zone-plate`; `siemens-star`; \
            `sinusoid-64-40` with 64 cycles along a row and 40 along a column; `white-noise`; `pink-noise` (1/f); \
            `impulses-16`, one white texel in each 16 x 16; `text` with strokes of 2 texels; `photograph`, a cliff. \
            The planes are tilted by up to 89.9 degrees (full runs: 89.999). Each tilt has three poses: a roll of the \
            camera and a yaw of the texture of 0 and 0, 20 and 15, and 45 and 45 degrees. Full runs have all nine \
            pairs of these angles. The centre of a picture has one texel per pixel across the tilt. The field of view \
            is 16 degrees, or 90 degrees less the tilt if that is smaller, so the horizon is never in the picture. The \
            truth is the f64 mean of 2,048 to 32,768 stratified samples per pixel under a Gaussian of sigma 0.5 \
            pixels, cut at one pixel; a line shows its own error. NMSE is the geometric mean over the poses, and a \
            second plot has the worst pose. An impulse shows the filter's kernel itself, so its NMSE is the relative \
            error of the kernel's shape. Above 85 degrees, some filters' errors are hardly larger than the truth's \
            own. From 89.9 degrees on, a pixel is hundreds of texels long, and most filters read a level that shows \
            little more than the pattern's mean. Large errors remain where a pattern does not average out along a \
            pixel, for instance on a checker at a yaw of 45 degrees. FLIP, the visible difference, is the mean over \
            the poses. Times do not depend on the texels' values, so only `pink-noise` has them: the time of all poses \
            per pixel, and the trilinear filter's time divided by each filter's, round by round. The methods are those \
            of tm.pareto. Pictures have 48 x 36 (quick) or 64 x 48 pixels. On a GPU, times are of pictures with 8 \
            times as many rows and columns.",
    scenes: &[
        "checker-1",
        "checker-2",
        "checker-8",
        "zone-plate",
        "siemens-star",
        "sinusoid-64-40",
        "white-noise",
        "pink-noise",
        "impulses-16",
        "text",
        PHOTOGRAPH,
    ],
    variants: || names().into_iter().chain([FLOOR.into()]).collect(),
    paper: &["paper's rows", "paper's columns"],
    ours: &[OURS],
    sweep: Some(Sweep {
        name: "tilt, degrees",
        quick: &[0.0, 60.0, 80.0, 85.0, 89.0, 89.9],
        full: &[0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 80.0, 85.0, 87.0, 89.0, 89.9, 89.99, 89.999],
    }),
    show: Show::views(|| patterns(&[0.0, 60.0, 80.0, 85.0])).variants(ellipse_and_trilinear),
    measure,
    plots: &[
        Plot::sweep(NMSE).log_y().floor(FLOOR),
        Plot::sweep(WORST_POSE).log_y().floor(FLOOR),
        Plot::sweep(FLIP).log_y().floor(FLOOR),
        Plot::sweep(TEXELS).log_y(),
        Plot::sweep(TIME).log_y(),
        Plot::sweep(SPEED).log_y(),
    ],
    claims: &[
        Claim::ours(
            "every-pose",
            "Up to 85 degrees, our filter has an NMSE of at most 1e-3 on every pattern in every pose: the bound of \
             tm.pareto's worst case.",
            &[Test::value(one(WORST_POSE, OURS), AtMost(1e-3))],
        )
        .at(Places::ALL.x(0.0, 85.0)),
        Claim::ours(
            "least",
            "Up to 89 degrees, our filter has the smallest NMSE of all methods on every pattern.",
            &[Test::ratio(one(NMSE, OURS), best(NMSE, others), AtMost(1.0))],
        )
        .at(Places::ALL.x(0.0, 89.0)),
        Claim::ours(
            "least-flip",
            "Up to 85 degrees, our filter has the smallest FLIP of all methods on every pattern.",
            &[Test::ratio(one(FLIP, OURS), best(FLIP, others), AtMost(1.0))],
        )
        .at(Places::ALL.x(0.0, 85.0)),
        Claim::ours_timed(
            "faster-than-the-paper",
            "Our filter takes less time than the paper's.",
            &[Test::ratio_of(TIME, [OURS, "paper's rows"], Below(1.0))],
        )
        .at(Places::scenes(&[TIMED])),
        Claim::ours(
            "truth",
            "Up to 85 degrees, the truth's own error is at most a fifth of the smallest error of a filter.",
            &[Test::ratio(one(NMSE, FLOOR), best(NMSE, names), AtMost(0.2))],
        )
        .at(Places::ALL.x(0.0, 85.0)),
    ],
    ..Figure::BASE
};

const PHOTOGRAPH: &str = "photograph";

const WORST_POSE: &str = "NMSE of the worst pose";
const SPEED: &str = "trilinear's time over the filter's";

/// The pattern with the times.
const TIMED: &str = "pink-noise";

const KNOWN: [Pattern; 10] = [
    Pattern::Checker(1),
    Pattern::Checker(2),
    Pattern::Checker(8),
    Pattern::ZonePlate,
    Pattern::SiemensStar,
    Pattern::Sinusoid(64.0, 40.0),
    Pattern::WhiteNoise,
    Pattern::PinkNoise,
    Pattern::Impulses(16),
    Pattern::Text,
];

/// The texels of a scene, one byte of linear light each.
fn texels_of(scene: &str) -> anyhow::Result<Vec<u8>> {
    if scene == PHOTOGRAPH {
        let light = CLIFF.luminance(SIDE as usize);
        return Ok(light.into_iter().map(|light| (light * 255.0).round() as u8).collect());
    }
    let known = KNOWN.into_iter().find(|pattern| pattern.name() == scene);
    Ok(known.with_context(|| format!("no pattern {scene:?}"))?.texels(SIDE))
}

/// The compared methods of tm.pareto.
const METHODS: [&str; 13] = [
    "paper's rows",
    "paper's columns",
    OURS,
    "ellipse, ratio 16",
    "ellipse, 18 fetches",
    FEW,
    "trilinear",
    "anisotropic 16",
    "Feline 16",
    "Mavridis 7",
    "pbrt EWA",
    "stochastic 16",
    "summed area",
];

fn names() -> Vec<String> {
    METHODS.map(String::from).into()
}

/// All methods but ours and its other settings.
fn others() -> Vec<String> {
    names().into_iter().filter(|name| !name.starts_with(OURS)).collect()
}

fn contenders() -> Vec<(String, Method)> {
    methods::with_default_weights().into_iter().filter(|(name, _)| METHODS.contains(&&**name)).collect()
}

/// The planes of a tilt: roll and yaw in degrees. The corners of the pictures are at most 83 % of the way from the
/// centre to the horizon.
fn planes(tilt_degrees: f64, effort: Effort, height: u32) -> Vec<TiltedPlane> {
    let half_view_degrees = 8f64.min((90.0 - tilt_degrees) / 2.0);
    let turns: &[[f64; 2]] = match effort {
        Effort::Quick => &[[0.0, 0.0], [20.0, 15.0], [45.0, 45.0]],
        Effort::Full => &[
            [0.0, 0.0],
            [0.0, 15.0],
            [0.0, 45.0],
            [20.0, 0.0],
            [20.0, 15.0],
            [20.0, 45.0],
            [45.0, 0.0],
            [45.0, 15.0],
            [45.0, 45.0],
        ],
    };
    let of = |[roll_degrees, yaw_degrees]: [f64; 2]| Tilt {
        roll_degrees,
        yaw_degrees,
        half_view_degrees,
        ..Tilt::of(tilt_degrees)
    };
    turns.iter().map(|&turn| of(turn).plane(height)).collect()
}

/// 2 x 32 x 32 to 2 x 128 x 128 samples per pixel.
const DENSITY: Density = Density { per_texel: 2.0, min: 32, max: 128 };

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = bench.effort_of([48, 36], [64, 48]);
    let tilt = cell.x.context("a sweep")?;
    let lab = Lab::of_texels(&bench.gpu(&[])?, (&cell.scene, texels_of(&cell.scene)?), size)?;
    let small = planes(tilt, bench.effort, size[1]);
    let truths: Vec<Truth> = small.iter().map(|plane| lab.supersampled(plane, GAUSSIAN, DENSITY)).collect();
    let file = |name: &str| format!("tm.patterns-{}-{tilt}-{}", cell.scene, plain(name));
    bench.picture(&file("truth"), &Srgb8Picture::from(&grey(size, &truths[1].values)))?;
    let own = truths.iter().map(own_errors).collect::<anyhow::Result<Vec<_>>>()?;
    let mut rows = error_rows(FLOOR, &own).to_vec();
    let pass = |(name, method): (String, Method)| Ok((name, lab.pass(&method)?));
    let passes = contenders().into_iter().map(pass).collect::<anyhow::Result<Vec<_>>>()?;
    for (name, pass) in &passes {
        let (mut found, mut fetched) = (Vec::new(), 0.0);
        for (n, (plane, truth)) in small.iter().zip(&truths).enumerate() {
            let shown = lab.show(pass, plane, 0)?;
            found.push(errors(&shown.picture, truth)?);
            fetched += shown.fetched / small.len() as f64;
            if n == 1 && [OURS, "trilinear"].contains(&&**name) {
                bench.picture(&file(name), &Srgb8Picture::from(&shown.picture))?;
            }
        }
        rows.extend(error_rows(name, &found));
        rows.push(Row::number(&**name, TEXELS, "texels", fetched));
    }
    if cell.scene == TIMED {
        let timed = Lab::timed(&lab.gpu, Pattern::PinkNoise, size)?;
        rows.extend(time_rows(bench, &timed, &passes, &planes(tilt, bench.effort, timed.size[1]))?);
    }
    Ok(rows)
}

fn time_rows(
    bench: &Bench,
    lab: &Lab,
    passes: &[(String, LabPass)],
    planes: &[TiltedPlane],
) -> anyhow::Result<Vec<Row>> {
    let timed = lab.times_of(bench, passes, planes)?;
    let times = timed.iter().map(|timed| lab.time_row(timed, planes.len()));
    Ok(times.chain(Timed::gains(&timed, "trilinear", SPEED)).collect())
}

/// The errors of a method in every pose.
fn error_rows(name: &str, poses: &[Errors]) -> [Row; 3] {
    let nmse = || poses.iter().map(|errors| errors.nmse);
    let flip = mean(poses.iter().map(|errors| errors.flip));
    [
        Row::number(name, NMSE, "", geometric_mean(nmse())),
        Row::number(name, WORST_POSE, "", nmse().fold(0.0, f64::max)),
        Row::number(name, FLIP, "", flip),
    ]
}
