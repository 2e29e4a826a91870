//! pm.pop: how much the picture jumps when levels change, with and without geomorphing.

use super::{scene, session};
use crate::figure::claim::{Bound::Above, Bound::AtLeast, Bound::AtMost, Claim, Test, one};
use crate::figure::{Bench, Cell, Figure, Plot, Row, Value};
use crate::frame::Run;
use crate::math::camera::Pose;
use crate::paper::progressive_mesh::{ProgressiveMeshSettings, ProgressiveMeshes};
use crate::picture::PixelFormat;
use crate::picture::srgb::from_linear_f64;
use crate::stats::Summary;
use anyhow::Context;

/// Name, true with geomorphing, and the number of frames in which the drawn error falls by an octave.
const VARIANTS: [(&str, bool, usize); 5] = [
    (AT_ONCE, false, 16),
    (AT_ONCE_SLOWLY, false, 64),
    (GEOMORPH, true, 16),
    ("geomorph, 1/32 octave per frame", true, 32),
    (GEOMORPH_SLOWLY, true, 64),
];
const AT_ONCE: &str = "at once (the paper)";
const AT_ONCE_SLOWLY: &str = "at once, 1/64 octave per frame";
const GEOMORPH: &str = "geomorph";
const GEOMORPH_SLOWLY: &str = "geomorph, 1/64 octave per frame";

const ALONG: &str = "change of a frame along the path";
const LARGEST_FRAME: &str = "largest change of a frame";
const LARGEST_PIXEL: &str = "largest change of a pixel";
const VISIBLE: &str = "most pixels that change visibly in a frame";
const FINE: &str = "most pixels that change visibly at an error of at most a pixel";
const WORST_AT: &str = "error of the frame in which most change visibly";
const BEHIND: &str = "difference to the full mesh";
const LATE: &str = "frames after the approach until the wanted error is drawn";

/// The figure.
pub const POP: Figure = Figure {
    id: "pm.pop",
    title: "Jumps of the picture when levels change",
    about: "An approach that halves the distance every 16 frames halves the wanted error as well. Here the camera \
            stands still and only the wanted error falls, from 16 pixels to a quarter. The full mesh's picture does \
            not change, so every change is a pop. In the paper a new vertex appears at its position at once. With \
            `geomorph` it moves there from its split vertex while the wanted error falls by the last octave to its \
            level's error; this draws about twice the faces. `octaves_per_frame` limits how fast the error drawn \
            follows the wanted one. 1/16 octave per frame, the default of geomorphing, is as fast as the wanted error \
            falls here. With 1/32 and 1/64 the picture is late: the figure reports the frames after the approach until \
            the wanted error is drawn, and counts their changes too. If the wanted error jumps by an octave, the error \
            drawn follows within 16, 32 or 64 frames. Each pixel is the mean of 16 samples in linear light: with one \
            sample, an outline that moves by a hundredth of a pixel would switch whole pixels and count as a pop in \
            all variants. The change of a frame is the root mean square over the pixels that any frame covers. A \
            change of more than 8 levels of 8-bit sRGB is visible. The figure reports the worst of all frames, and the \
            worst of the frames with an error of at most one pixel, as scenes use it. The difference from the full \
            mesh is measured in the frames of the approach.",
    scenes: &["bunny/near", "bunny/above"],
    variants,
    paper: &[AT_ONCE],
    ours: &["geomorph"],
    measure,
    plots: &[
        Plot::curves(ALONG, "error, pixels").log_x(),
        Plot::bars(VISIBLE),
        Plot::bars(LATE),
        Plot::bars(BEHIND),
    ],
    claims: &[
        Claim::ours(
            "geomorph-tames",
            "Geomorphing at least halves the largest change of a frame.",
            &[Test::ratio(one(LARGEST_FRAME, AT_ONCE), one(LARGEST_FRAME, GEOMORPH), AtLeast(2.0))],
        ),
        Claim::ours(
            "few-see-it",
            "Without geomorphing, no frame of the whole approach changes more than 1 % of the covered pixels \
             visibly (Forsyth 2001: no visible pops if a few triangles collapse at a time).",
            &[Test::value(one(VISIBLE, AT_ONCE), AtMost(1.0))],
        ),
        Claim::ours(
            "few-see-it-at-a-pixel",
            "Without geomorphing, no frame with an error of at most one pixel changes more than 1 % of the \
             covered pixels visibly.",
            &[Test::value(one(FINE, AT_ONCE), AtMost(1.0))],
        ),
        Claim::ours(
            "geomorph-at-a-pixel",
            "With geomorphing, no frame with an error of at most one pixel changes more than 1 % of the \
             covered pixels visibly.",
            &[Test::value(one(FINE, GEOMORPH), AtMost(1.0))],
        ),
        Claim::ours(
            "geomorph-everywhere",
            "With geomorphing, no frame of the whole approach changes more than 1 % of the covered pixels \
             visibly.",
            &[Test::value(one(VISIBLE, GEOMORPH), AtMost(1.0))],
        ),
        Claim::ours(
            "slow-geomorph",
            "With geomorphing at 1/64 octave per frame, no frame changes more than 1 % of the covered pixels \
             visibly, from the start of the approach until the wanted error is drawn.",
            &[Test::value(one(VISIBLE, GEOMORPH_SLOWLY), AtMost(1.0))],
        ),
        Claim::ours(
            "slowness-alone",
            "Without geomorphing, the limit of 1/64 octave per frame is not enough: in some frame more than 1 % of \
             the covered pixels change visibly.",
            &[Test::value(one(VISIBLE, AT_ONCE_SLOWLY), Above(1.0))],
        ),
    ],
    ..Figure::BASE
};

fn variants() -> Vec<String> {
    VARIANTS.map(|(name, ..)| name.to_string()).into()
}

/// The error of the first frame in pixels. It is coarser than practical settings, because the most pixels change
/// visibly at errors of 4 to 12 pixels.
const FIRST: f64 = 16.0;
/// The approach ends at a quarter of a pixel.
const OCTAVES: usize = 6;
/// Frames per octave of the wanted error.
const APPROACH: usize = 16;
/// Frames per octave of the slowest variant. A picture depends only on the error drawn, so the others show a
/// part of its pictures.
const SLOWEST: usize = 64;

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (mut rows, mut full) = (Vec::new(), Vec::new());
    for morphs in [false, true] {
        // Each picture is requested by its error, so no limit is needed.
        let changes = [format!("geomorph={morphs}"), "octaves_per_frame=1000".to_owned()]
            .map(|change| format!("surface.bunny.geometry.{change}"));
        let (scene, eye) = scene(&cell.scene, &changes)?;
        let pose = scene.camera(eye)?.pose();
        let fine = |settings: &mut ProgressiveMeshSettings| {
            settings.size = settings.size.map(|side| side * SAMPLES);
            settings.target = PixelFormat::Linear32;
        };
        let mut session = session(bench, &scene, fine)?;
        if full.is_empty() {
            full = at(&mut session, &pose, 0.0)?;
        }
        let pictures: Vec<Vec<u8>> = (0..=OCTAVES * SLOWEST)
            .map(|n| at(&mut session, &pose, error(n, SLOWEST)))
            .collect::<anyhow::Result<_>>()?;
        for (name, _, frames) in VARIANTS.into_iter().filter(|(_, geomorph, _)| *geomorph == morphs) {
            rows.extend(approach(&pictures, frames, &full, name)?);
        }
    }
    Ok(rows)
}

/// The error drawn in the n-th frame, with `frames` frames per octave.
fn error(n: usize, frames: usize) -> f64 {
    FIRST * (-(n as f64) / frames as f64).exp2()
}

/// Samples along each side of a pixel.
pub const SAMPLES: u32 = 4;

/// The surface at a wanted error in pixels, as sRGB bytes: one per pixel, because the picture is grey.
fn at(session: &mut Run<ProgressiveMeshes>, pose: &Pose, pixels: f64) -> anyhow::Result<Vec<u8>> {
    session.technique.surfaces[0].settings.error_pixels = pixels * f64::from(SAMPLES);
    session.frame(pose)?;
    let [width, height] = session.technique.settings.size.map(|side| (side / SAMPLES) as usize);
    let bytes = session.picture_bytes()?;
    Ok(averaged(bytemuck::cast_slice(&bytes), [width, height], SAMPLES as usize))
}

/// Means of the red channel's linear light over squares of `side` x `side` samples, as sRGB bytes for `width`
/// x `height` pixels.
pub fn averaged(samples: &[[f32; 4]], [width, height]: [usize; 2], side: usize) -> Vec<u8> {
    let sample = |x: usize, y: usize| f64::from(samples[y * width * side + x][0]);
    let pixel = |n: usize| {
        let [left, top] = [n % width * side, n / width * side];
        let sum: f64 = (0..side * side).map(|n| sample(left + n % side, top + n / side)).sum();
        from_linear_f64(sum / (side * side) as f64)
    };
    (0..width * height).map(pixel).collect()
}

/// The rows of a variant that shows an octave of `pictures` in `frames` frames.
fn approach(pictures: &[Vec<u8>], frames: usize, full: &[u8], variant: &str) -> anyhow::Result<Vec<Row>> {
    let pictures: Vec<&[u8]> = pictures.iter().step_by(SLOWEST / frames).map(Vec::as_slice).collect();
    // The corner pixel shows the background.
    let covers = |picture: &[u8], pixel: usize| picture[pixel] != picture[0];
    let covered: Vec<usize> = (0..full.len())
        .filter(|&pixel| covers(full, pixel) || pictures.iter().any(|picture| covers(picture, pixel)))
        .collect();
    let change = |a: &[u8], b: &[u8], pixel: usize| f64::from(a[pixel].abs_diff(b[pixel]));
    let rms = |a: &[u8], b: &[u8]| {
        let squares = covered.iter().map(|&pixel| change(a, b, pixel).powi(2)).sum::<f64>();
        (squares / covered.len() as f64).sqrt()
    };
    let (mut along, mut largest): (Vec<[f64; 2]>, f64) = (Vec::new(), 0.0);
    // The share of covered pixels that change visibly, in percent, with the error of that frame: the worst of
    // all frames, and the worst of the fine ones.
    let (mut worst, mut worst_fine) = ((0.0, f64::NAN), 0.0_f64);
    for (n, pair) in pictures.windows(2).enumerate() {
        let error = error(n + 1, frames);
        along.push([error, rms(pair[0], pair[1])]);
        let changes: Vec<f64> = covered.iter().map(|&pixel| change(pair[0], pair[1], pixel)).collect();
        largest = changes.iter().copied().fold(largest, f64::max);
        let seen = changes.iter().filter(|change| **change > 8.0).count();
        let percent = 100.0 * seen as f64 / covered.len() as f64;
        if percent > worst.0 || worst.1.is_nan() {
            worst = (percent, error);
        }
        if error <= 1.0 {
            worst_fine = worst_fine.max(percent);
        }
    }
    let frames_of_approach = OCTAVES * APPROACH + 1;
    let behind: Vec<f64> =
        pictures.iter().take(frames_of_approach).map(|picture| rms(picture, full)).collect();
    // Rows are sorted by x.
    along.reverse();
    let largest_frame = along.iter().map(|[_, change]| *change).fold(0.0, f64::max);
    let levels = "levels of 255";
    Ok(vec![
        Row::number(variant, LARGEST_FRAME, levels, largest_frame),
        Row::number(variant, LARGEST_PIXEL, levels, largest),
        Row::number(variant, VISIBLE, "% of the covered", worst.0),
        Row::number(variant, WORST_AT, "pixels", worst.1),
        Row::number(variant, FINE, "% of the covered", worst_fine),
        Row::number(variant, LATE, "frames", (pictures.len() - frames_of_approach) as f64),
        Row::new(variant, ALONG, levels, Value::Series(along)),
        Row::new(variant, BEHIND, levels, Value::Summary(Summary::of(&behind).context("a path has frames")?)),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outline_that_covers_half_a_pixel_is_half_the_light_and_not_half_the_levels() {
        let (dark, light) = ([0.0, 0.0, 0.0, 1.0], [1.0; 4]);
        // Two pixels of 2 x 2 samples: one half covered, one fully covered.
        let samples = [dark, light, light, light, dark, light, light, light];
        let levels = averaged(&samples, [2, 1], 2);
        assert_eq!(levels, [188, 255]);
    }
}
