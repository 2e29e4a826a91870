//! pm.pop: how much the picture jumps when levels change, with and without geomorphing.

use super::{scene, session};
use crate::figure::claim::{Bound::AtLeast, Bound::AtMost, Claim, Test, one};
use crate::figure::{Bench, Cell, Figure, Plot, Row, Value};
use crate::frame::Run;
use crate::math::camera::Pose;
use crate::paper::progressive_mesh::{ProgressiveMeshes, Settings};
use crate::picture::Target;
use crate::picture::srgb::from_linear_f64;
use crate::stats::Summary;
use anyhow::Context;

/// Name, geomorphing, and octaves per frame.
const VARIANTS: [(&str, bool, Option<f64>); 3] =
    [(AT_ONCE, false, None), (GEOMORPH, true, None), (SLOW, true, Some(1.0 / 64.0))];
const AT_ONCE: &str = "at once (the paper)";
const GEOMORPH: &str = "geomorph";
const SLOW: &str = "geomorph, 1/64 octave a frame";

const ALONG: &str = "change of a frame along the path";
const LARGEST_FRAME: &str = "largest change of a frame";
const LARGEST_PIXEL: &str = "largest change of a pixel";
const VISIBLE: &str = "most pixels that change visibly in a frame";
const FINE: &str = "the same at a wanted error of at most a pixel";
const WORST_AT: &str = "wanted error of the frame in which most change visibly";
const BEHIND: &str = "difference to the full mesh";

/// The figure.
pub const POP: Figure = Figure {
    id: "pm.pop",
    title: "Jumps of the picture when levels change",
    about: "An approach that halves the distance every 16 frames halves the wanted error as well. Here the \
            camera stands still and only the wanted error falls, from 16 pixels to a quarter. The full \
            mesh's picture does not change, so every change is a pop. A new vertex appears at its position \
            at once (the paper), or leaves its split vertex an octave before its error is wanted and has arrived \
            then (geomorph). With geomorphing the error shown follows the wanted one by at most 1/16 octave \
            per frame, as fast as the wanted one falls here, or by at most 1/64; it then lags, and the \
            frames until it has arrived are counted too. Each pixel is the mean of 16 samples in linear light: with \
            one sample, an outline that moves by a hundredth of a pixel would switch whole pixels and count \
            as a pop in both variants. The change of a frame is the root mean square over the pixels that \
            any frame covers. A change of more than 8 levels of 8-bit sRGB is visible. The figure reports \
            the worst of all frames, and the worst of the frames with a wanted error of at most one pixel, \
            as scenes use it. The price of geomorphing is a mesh that lags: the difference to the full mesh.",
    scenes: &["bunny/near", "bunny/above"],
    variants,
    paper: &["at once (the paper)"],
    sweep: None,
    measure,
    plots: &[Plot::curves(ALONG, "wanted error, pixels").log_x(), Plot::bars(BEHIND)],
    claims: &[
        Claim::ours(
            "geomorph-tames",
            "Geomorphing makes the largest change of a frame at least 2 times smaller.",
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
            "The same holds for the frames with a wanted error of at most one pixel.",
            &[Test::value(one(FINE, AT_ONCE), AtMost(1.0))],
        ),
        Claim::ours(
            "geomorph-at-a-pixel",
            "With geomorphing, no frame with a wanted error of at most one pixel changes more than 1 % of the \
             covered pixels visibly.",
            &[Test::value(one(FINE, GEOMORPH), AtMost(1.0))],
        ),
        Claim::ours(
            "slow-geomorph",
            "With geomorphing at 1/64 octave per frame, no frame of the whole approach does, and none until the \
             mesh has arrived.",
            &[Test::value(one(VISIBLE, SLOW), AtMost(1.0))],
        ),
    ],
};

fn variants() -> Vec<String> {
    VARIANTS.map(|(name, ..)| name.to_string()).into()
}

/// Wanted errors in pixels: from 16 down over six octaves, in steps of 1/16 octave. 16 is coarser than any
/// practical setting, but the worst frame is there; without it both variants would look better than they are.
fn errors() -> Vec<f64> {
    (0..=96).map(|n| 16.0 * (-f64::from(n) / 16.0).exp2()).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    // The full mesh's picture, which all variants share; the first comes to it at once.
    let (mut rows, mut full) = (Vec::new(), Vec::new());
    for (variant, geomorph, octaves) in VARIANTS {
        let octaves = octaves.map(|octaves| format!("surface.bunny.geometry.octaves_per_frame={octaves}"));
        let mut changes = vec![format!("surface.bunny.geometry.geomorph={geomorph}")];
        changes.extend(octaves);
        let (scene, eye) = scene(&cell.scene, &changes)?;
        let pose = scene.camera(eye)?.pose();
        let fine = |settings: &mut Settings| {
            settings.size = settings.size.map(|side| side * SAMPLES);
            settings.target = Target::Linear32;
        };
        let mut session = session(bench, &scene, fine)?;
        if full.is_empty() {
            full = at(&mut session, &pose, 0.0)?;
        }
        rows.extend(approach(&mut session, &pose, &full, variant)?);
    }
    Ok(rows)
}

/// Samples along each side of a pixel.
const SAMPLES: u32 = 4;

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
fn averaged(samples: &[[f32; 4]], [width, height]: [usize; 2], side: usize) -> Vec<u8> {
    let sample = |x: usize, y: usize| f64::from(samples[y * width * side + x][0]);
    let pixel = |n: usize| {
        let [left, top] = [n % width * side, n / width * side];
        let sum: f64 = (0..side * side).map(|n| sample(left + n % side, top + n / side)).sum();
        from_linear_f64(sum / (side * side) as f64)
    };
    (0..width * height).map(pixel).collect()
}

fn approach(
    session: &mut Run<ProgressiveMeshes>,
    pose: &Pose,
    full: &[u8],
    variant: &str,
) -> anyhow::Result<Vec<Row>> {
    let errors = errors();
    let mut pictures: Vec<Vec<u8>> =
        errors.iter().map(|&pixels| at(session, pose, pixels)).collect::<anyhow::Result<_>>()?;
    let last = *errors.last().context("a path has frames")?;
    while !session.settled() {
        pictures.push(at(session, pose, last)?);
    }
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
    let (mut along, mut largest, mut largest_frame): (Vec<[f64; 2]>, f64, f64) = (Vec::new(), 0.0, 0.0);
    // The share of covered pixels that change visibly, in percent, with the wanted error of that frame: the
    // worst of all frames, and the worst of the fine ones.
    let (mut worst, mut worst_fine) = ((0.0, f64::NAN), 0.0_f64);
    for (n, pair) in pictures.windows(2).enumerate() {
        let (error, change_of_frame) = (*errors.get(n + 1).unwrap_or(&last), rms(&pair[0], &pair[1]));
        largest_frame = f64::max(largest_frame, change_of_frame);
        if n + 1 < errors.len() {
            along.push([error, change_of_frame]);
        }
        let changes: Vec<f64> = covered.iter().map(|&pixel| change(&pair[0], &pair[1], pixel)).collect();
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
    let behind: Vec<f64> = pictures[..errors.len()].iter().map(|picture| rms(picture, full)).collect();
    // Rows are sorted by x.
    along.reverse();
    let levels = "levels of 255";
    Ok(vec![
        Row::number(variant, LARGEST_FRAME, levels, largest_frame),
        Row::number(variant, LARGEST_PIXEL, levels, largest),
        Row::number(variant, VISIBLE, "% of the covered", worst.0),
        Row::number(variant, WORST_AT, "pixels", worst.1),
        Row::number(variant, FINE, "% of the covered", worst_fine),
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
