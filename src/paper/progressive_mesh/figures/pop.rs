//! pm.pop: how much the picture jumps when levels change, with and without geomorphing.

use super::{scans, seen, session};
use crate::figure::prelude::*;
use crate::frame::{FRAME_SECONDS, Run};
use crate::math::camera::Pose;
use crate::paper::progressive_mesh::config::{NO_LIMIT, PIXELS_PER_SECOND};
use crate::paper::progressive_mesh::surface::pace::step;
use crate::paper::progressive_mesh::{ProgressiveMeshSettings, ProgressiveMeshes};
use crate::picture::PixelFormat;
use crate::picture::srgb::from_linear_f64;
use crate::scene::Scene;
use crate::stats::Summary;
use rayon::prelude::*;

/// Name, true with geomorphing, and the limit `pixels_per_second`.
const VARIANTS: [(&str, bool, f64); 5] = [
    (AT_ONCE, false, NO_LIMIT),
    (AT_ONCE_SLOWLY, false, PIXELS_PER_SECOND),
    (GEOMORPH, true, PIXELS_PER_SECOND),
    ("geomorph, 6 pixels per second", true, 6.0),
    (UNLIMITED, true, NO_LIMIT),
];
const AT_ONCE: &str = "at once (the paper)";
const AT_ONCE_SLOWLY: &str = "at once, as slowly as geomorph";
const GEOMORPH: &str = "geomorph";
const UNLIMITED: &str = "geomorph without a limit";

/// Models and views that were not used to choose the limit.
const UNSEEN: [&str; 4] = ["knot/near", "torus/near", "solid/near", "dragon_res4/near"];

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
            level's error; this draws about twice the faces. `pixels_per_second` limits how fast the error drawn \
            follows the wanted one. Its default is 2.58, and a frame lasts 1/60 second. A limited picture is late: \
            the figure reports the frames after the approach until the wanted error is drawn, and counts their \
            changes too. Each pixel is the mean of 16 samples in linear light: with one sample, an outline that \
            moves by a hundredth of a pixel would switch whole pixels and count as a pop in all variants. The change \
            of a frame is the root mean square over the pixels that any frame covers. A change of more than 8 levels \
            of 8-bit sRGB is visible. The figure reports the worst of all frames, and the worst of the frames with \
            an error of at most one pixel, as scenes use it. The difference from the full mesh is measured in the \
            frames of the approach. The limit was chosen on the bunny; `knot/near`, `torus/near`, `solid/near` and \
            `dragon_res4/near` (if it has been fetched) are the scene `bunny/near` with models on which it was not \
            chosen.",
    scenes: &["bunny/near", "bunny/above", UNSEEN[0], UNSEEN[1], UNSEEN[2], UNSEEN[3]],
    variants: || VARIANTS.map(|(name, ..)| name.to_string()).into(),
    paper: &[AT_ONCE],
    ours: &["geomorph"],
    show: Show::views(|| seen(POP.scenes)).variants(settings),
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
            &[Test::ratio_of(LARGEST_FRAME, [AT_ONCE, GEOMORPH], AtLeast(2.0))],
        ),
        Claim::ours(
            "few-see-it",
            "Without geomorphing, no frame of the whole approach changes more than 1 % of the covered pixels visibly \
             (T. Forsyth, \"Comparison of VIPM Methods\", 2001: no visible pops if a few triangles collapse at a \
             time).",
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
            "With geomorphing, no frame changes more than 1 % of the covered pixels visibly, from the start of the \
             approach until the wanted error is drawn (on the bunny, where the limit was chosen).",
            &[Test::value(one(VISIBLE, GEOMORPH), AtMost(1.0))],
        )
        .at(Places::except(&UNSEEN)),
        Claim::ours(
            "unseen-model",
            "The same holds on models on which the limit was not chosen.",
            &[Test::value(one(VISIBLE, GEOMORPH), AtMost(1.0))],
        )
        .at(Places::scenes(&UNSEEN)),
        Claim::ours(
            "geomorph-alone",
            "Without the limit, geomorphing is not enough: in some frame more than 1 % of the covered pixels change \
             visibly.",
            &[Test::value(one(VISIBLE, UNLIMITED), Above(1.0))],
        ),
        Claim::ours(
            "slowness-alone",
            "Without geomorphing, the limit is not enough: in some frame more than 1 % of the covered pixels change \
             visibly.",
            &[Test::value(one(VISIBLE, AT_ONCE_SLOWLY), Above(1.0))],
        ),
    ],
    ..Figure::BASE
};

/// The variants as settings of the scene.
fn settings() -> Vec<Setting> {
    let setting = |(name, morphs, limit): (&'static str, bool, f64)| {
        let changes = [format!("geomorph={morphs}"), format!("pixels_per_second={limit:?}")];
        Setting::new(name, changes.map(|change| format!("surface.bunny.geometry.{change}")))
    };
    VARIANTS.map(setting).into()
}

/// The error of the first frame in pixels. It is coarser than practical settings, because visible changes are largest
/// at errors of 4 to 12 pixels.
const FIRST: f64 = 16.0;
/// The approach ends at a quarter of a pixel.
const OCTAVES: usize = 6;
/// Frames per octave of the wanted error.
const APPROACH: usize = 16;

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (mut rows, mut full) = (Vec::new(), Vec::new());
    for morphs in [false, true] {
        // Each picture is requested by its error, so the surface needs no limit of its own.
        let (model, eye) = cell.scene.split_once('/').context("a scene is MODEL/CAMERA")?;
        scans::check_fetched(model)?;
        let changes = [
            format!("source={model}"),
            format!("geomorph={morphs}"),
            format!("pixels_per_second={NO_LIMIT:?}"),
        ]
        .map(|change| format!("surface.bunny.geometry.{change}"));
        let scene = Scene::load_with("bunny", &changes)?;
        let pose = scene.camera(eye)?.pose();
        let fine = |settings: &mut ProgressiveMeshSettings| {
            settings.size = settings.size.map(|side| side * SAMPLES);
            settings.target = PixelFormat::Linear32;
        };
        let mut session = session(bench, &scene, fine)?;
        if full.is_empty() {
            full = at(&mut session, &pose, 0.0)?;
        }
        for (name, _, limit) in VARIANTS.into_iter().filter(|(_, geomorph, _)| *geomorph == morphs) {
            let errors = errors(limit);
            let pictures: Vec<Vec<u8>> =
                errors.iter().map(|&error| at(&mut session, &pose, error)).collect::<anyhow::Result<_>>()?;
            rows.extend(approach(&pictures, &errors, &full, name)?);
        }
    }
    Ok(rows)
}

/// The error drawn in each frame from the start of the approach until the last wanted error is drawn.
fn errors(pixels_per_second: f64) -> Vec<f64> {
    let max = pixels_per_second * FRAME_SECONDS;
    let wanted = |n: usize| FIRST * (-(n.min(OCTAVES * APPROACH) as f64) / APPROACH as f64).exp2();
    let mut errors = vec![FIRST];
    for n in 1.. {
        let (before, to) = (errors[n - 1], wanted(n));
        if n > OCTAVES * APPROACH && before == to {
            break;
        }
        errors.push(step(max, before, to, 1.0));
    }
    errors
}

/// The largest change of a pixel that is not visible, in levels of 8-bit sRGB.
pub const INVISIBLE: u8 = 8;

/// Samples along each side of a pixel.
pub const SAMPLES: u32 = 4;

/// The surface at a wanted error in pixels, as sRGB bytes: one per pixel, because the picture is grey.
fn at(session: &mut Run<ProgressiveMeshes>, pose: &Pose, pixels: f64) -> anyhow::Result<Vec<u8>> {
    session.technique.surfaces[0].set_error_pixels(pixels * f64::from(SAMPLES));
    session.frame(pose)?;
    let size = session.technique.settings.size.map(|side| (side / SAMPLES) as usize);
    Ok(session.read_picture(|bytes| averaged(bytemuck::cast_slice(bytes), size, SAMPLES as usize))?)
}

/// Means of the red channel's linear light over squares of `side` x `side` samples, as sRGB bytes for `width`
/// x `height` pixels.
pub fn averaged(samples: &[[f32; 4]], [width, height]: [usize; 2], side: usize) -> Vec<u8> {
    let pixels = |rows: &[[f32; 4]]| {
        let pixel = |column: usize| {
            let square = rows.chunks(width * side).flat_map(|row| &row[column * side..][..side]);
            from_linear_f64(square.map(|sample| f64::from(sample[0])).sum::<f64>() / (side * side) as f64)
        };
        (0..width).map(pixel).collect::<Vec<u8>>()
    };
    samples[..width * height * side * side].par_chunks(width * side * side).flat_map_iter(pixels).collect()
}

/// The rows of a variant with these pictures, drawn at these errors.
fn approach(pictures: &[Vec<u8>], errors: &[f64], full: &[u8], variant: &str) -> anyhow::Result<Vec<Row>> {
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
    // Percentage of the covered pixels that change visibly: in the worst frame, with its error, and in the worst frame
    // with an error of at most a pixel.
    let (mut worst, mut worst_fine) = ((0.0, f64::NAN), 0.0_f64);
    for (pair, &error) in pictures.windows(2).zip(&errors[1..]) {
        along.push([error, rms(&pair[0], &pair[1])]);
        let changes: Vec<f64> = covered.iter().map(|&pixel| change(&pair[0], &pair[1], pixel)).collect();
        largest = changes.iter().copied().fold(largest, f64::max);
        let seen = changes.iter().filter(|change| **change > f64::from(INVISIBLE)).count();
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
    fn a_limit_draws_late_what_the_approach_wants() {
        let free = errors(NO_LIMIT);
        assert_eq!((free.len(), free[16], *free.last().unwrap()), (97, 8.0, 0.25));
        let limited = errors(PIXELS_PER_SECOND);
        assert_eq!((limited.len(), *limited.last().unwrap()), (368, 0.25));
        assert!(
            limited.windows(2).all(|pair| { pair[1] < pair[0] && pair[0] - pair[1] <= 0.043 * (1.0 + 1e-9) })
        );
    }

    /// The limit was chosen as 0.043 pixels per frame. The levels' errors are f32.
    #[test]
    fn the_limit_of_a_frame_is_the_limit_that_was_chosen() {
        let mut chosen = FIRST;
        for (n, error) in errors(PIXELS_PER_SECOND).into_iter().enumerate() {
            let wanted = FIRST * (-(n.min(OCTAVES * APPROACH) as f64) / APPROACH as f64).exp2();
            chosen = step(0.043, chosen, wanted, 1.0);
            assert_eq!(error as f32, chosen as f32, "frame {n}");
        }
    }

    #[test]
    fn an_outline_that_covers_half_a_pixel_is_half_the_light_and_not_half_the_levels() {
        let (dark, light) = ([0.0, 0.0, 0.0, 1.0], [1.0; 4]);
        // Two rows of two pixels of 2 x 2 samples: one half covered, one fully covered; one empty, one fully covered.
        let above = [dark, light, light, light, dark, light, light, light];
        let below = [dark, dark, light, light, dark, dark, light, light];
        let levels = averaged(&[above, below].concat(), [2, 2], 2);
        assert_eq!(levels, [188, 255, 0, 255]);
    }
}
