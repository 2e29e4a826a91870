//! tm.17: time of every form of the coordinates, by screen area and tilt.

use super::methods::THESIS;
use super::shown::tilted_boards;
use crate::figure::prelude::*;
use crate::paper::texture_mapping::coordinates::pass::{CoordinatesPass, Output, set_up};
use crate::paper::texture_mapping::coordinates::{Band, DerivativeMethod, Form, RowWalk};
use crate::paper::texture_mapping::plane::TiltedPlane;
use crate::vk::{Format, Gpu, Image, ImageInfo, Sampler, SamplerFilter, SamplerInfo};
use std::cell::RefCell;
use std::time::Instant;

pub const COORDINATES: Figure = Figure {
    id: "tm.17",
    title: "Coordinates: time against screen area and tilt",
    about: "Figure 17 of the thesis: in a fragment shader, texturing with modified Heckbert coordinates is 26 % faster \
            than with the original ones \"in all tests\" (elsewhere the thesis states a gain of 0.25). The modified \
            form computes numerators and denominator of the homography along a row by additions. A tilted plane fills \
            the picture. Each pixel takes one bilinear sample of a 2048 x 2048 texture; every form fetches the same \
            texels. The tilts are 0 to 80 degrees (`tilt 0`, `tilt 30`, `tilt 60`, `tilt 80`), with 20 degrees of \
            roll, so that the homography's denominator varies along rows. Fragments of a row run in no order, so they \
            cannot add from pixel to pixel. Instead, a fragment shader reads the constants of its row from a buffer \
            and uses one multiply-add per value, or it receives varyings from the rasteriser. A thread of a compute \
            shader reads the constants of its row once, for a run of 64 pixels of the row or for every 32nd pixel, and \
            computes each of these pixels from them by one multiply-add per value (`row constants, runs of 64`, `row \
            constants, 32 lanes`). Textbook coordinates run in the same threads; each thread computes the terms that \
            are the same for its whole row only once (`textbook, runs of 64`, `textbook, 32 lanes`). Other compute \
            shaders walk the rows by formulas (7) and (8) of the thesis, with and without restarts. The set-up of the \
            rows in f64 on the host is reported separately. Each form writes 4 bytes per pixel. The figure also counts \
            the invocations that have pixels, and the bytes of the rows' constants that they read. Derivatives are \
            timed without a texture fetch: as differences to the coordinates of two neighbours, and as quotients whose \
            numerators come from the row's constants. A plot shows the time of textbook coordinates in a fragment \
            shader over each form's time, and as a line the thesis's 1.26.",
    scenes: &["tilt 0", "tilt 30", "tilt 60", "tilt 80"],
    variants: || {
        let methods = DerivativeMethod::ALL.map(derivatives_name);
        forms().map(Form::name).chain(methods).chain([THESIS.into()]).collect()
    },
    paper: &["row constants", "sequential"],
    sweep: Some(Sweep {
        name: "screen area, 10^6 pixels",
        quick: &[0.25, 0.5, 0.9],
        full: &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
    }),
    show: Show::views(|| tilted_boards(&[0.0, 30.0, 60.0, 80.0])),
    measure,
    plots: &[plot(TIME), Plot::sweep(GAIN).log_y().floor(THESIS), plot(DERIVATIVES)],
    claims: &[
        Claim::paper_timed(
            "claim 5, figure 17",
            "26-percent",
            "In a fragment shader, modified Heckbert coordinates (the row's constants) are 26 % faster than textbook \
             coordinates, in all tests.",
            &[Test::ratio(TEXTBOOK, one(TIME, "row constants"), AtLeast(THESIS_GAIN))],
        ),
        Claim::paper_timed(
            "E, formula (7)",
            "sequential",
            "One thread per row, which adds from pixel to pixel by formula (7), is faster than a fragment shader with \
             textbook coordinates.",
            &[Test::ratio(TEXTBOOK, one(TIME, "sequential"), AtLeast(1.0))],
        ),
        Claim::ours_timed(
            "26-percent-noperspective",
            "In a fragment shader that takes numerators and denominator from the rasteriser (`noperspective`), \
             coordinates are 26 % faster than textbook coordinates, in all tests.",
            &[Test::ratio(TEXTBOOK, one(TIME, "noperspective"), AtLeast(THESIS_GAIN))],
        ),
        Claim::ours_timed(
            "not-slower",
            "In a thread that computes 64 pixels of a row, the row's constants, which are more accurate, are at most 3 % \
             slower than textbook coordinates, of which the thread computes the part that the row shares only once.",
            &[Test::ratio(one(TIME, "textbook, runs of 64"), ROW_CONSTANTS, AtLeast(0.97))],
        ),
        Claim::ours_timed(
            "not-slower-than-fragments",
            "In such a thread they are also at most 3 % slower than textbook coordinates in a fragment shader.",
            &[Test::ratio(TEXTBOOK, ROW_CONSTANTS, AtLeast(0.97))],
        ),
        Claim::ours_timed(
            "not-slower-in-fragments",
            "In a fragment shader, which reads the row's constants for each pixel, they are at most 3 % slower than \
             textbook coordinates.",
            &[Test::ratio(TEXTBOOK, one(TIME, "row constants"), AtLeast(0.97))],
        ),
        Claim::ours_timed(
            "derivatives",
            "Derivatives with numerators from the row's constants are faster than differences of coordinates.",
            &[Test::ratio_of(
                DERIVATIVES,
                ["differences derivatives", "incremental derivatives"],
                AtLeast(1.0),
            )],
        ),
    ],
    ..Figure::BASE
};

const TIME: &str = "coordinates and a texel";
const DERIVATIVES: &str = "derivatives";
const GAIN: &str = "time of textbook coordinates over the form's";
const SET_UP: &str = "set-up on the host";
/// Counts of the whole picture, reported beside [`TIME`].
const INVOCATIONS: &str = "invocations that have pixels";
const BYTES: &str = "bytes of the rows' constants read";

/// "26 % faster in all tests".
const THESIS_GAIN: f64 = 1.26;

const TEXTBOOK: Pick = one(TIME, "textbook");
const ROW_CONSTANTS: Pick = one(TIME, "row constants, runs of 64");

/// Texels along the image's side.
const SIDE: u32 = 2048;

/// All forms but the walks whose lengths only tm.drift measures.
fn forms() -> impl Iterator<Item = Form> {
    let only_in_drift = [RowWalk::Lanes(8), RowWalk::Lanes(1024), RowWalk::Restart(8), RowWalk::Restart(256)];
    Form::ALL.into_iter().filter(move |form| !only_in_drift.iter().any(|walk| *form == Form::Walk(*walk)))
}

const fn plot(quantity: &'static str) -> Plot {
    Plot::sweep(quantity).log_y().floor("empty pass")
}

fn derivatives_name(method: DerivativeMethod) -> String {
    format!("{} derivatives", method.name())
}

/// The tilt of a scene `tilt DEGREES`, and the size of its 16:9 picture; the sweep is in million pixels.
pub fn tilt_and_size(cell: &Cell) -> anyhow::Result<(f64, [u32; 2])> {
    let tilt = cell.scene.trim_start_matches("tilt ").parse().context("a scene's tilt")?;
    let height = (cell.x.context("a sweep")? * 1e6 * 9.0 / 16.0).sqrt();
    Ok((tilt, [(height * 16.0 / 9.0).round() as u32, height.round() as u32]))
}

/// An image of pseudo-random texels, and its sampler.
pub fn noise(gpu: &Gpu, side: u32) -> crate::vk::Result<(Image, Sampler)> {
    let image = gpu.image("noise", ImageInfo::texture([side; 2], Format::Rgba8, 1))?;
    let texel = |n: u32| n.wrapping_mul(0x9e37_79b9).rotate_left(15).wrapping_mul(0x85eb_ca6b).to_le_bytes();
    gpu.fill_levels(&image, &[(0..side * side).flat_map(texel).collect()])?;
    let sampler = gpu.sampler("linear", SamplerInfo { filter: SamplerFilter::Linear, wraps_in_s: false })?;
    Ok((image, sampler))
}

/// A contender that owns its pass.
fn contender<'a>(
    gpu: &'a Gpu,
    name: String,
    own: CoordinatesPass,
    (image, sampler): &'a (Image, Sampler),
) -> Contender<'a> {
    Contender::pass(gpu, name, move |cmd| own.run(cmd, image, sampler))
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (tilt, size) = tilt_and_size(cell)?;
    let band = Band { size, first_row: 0 };
    let plane = TiltedPlane::tilted(size, tilt, 20.0, f64::from(SIDE));
    let gpu = bench.gpu(&[])?;
    let source = noise(&gpu, SIDE)?;
    let (mut rows, mut passes, mut methods) = (Vec::new(), Vec::new(), Vec::new());
    for form in forms() {
        match CoordinatesPass::new(&gpu, form, Output::Texels, &plane, band, SIDE) {
            Ok(own) => {
                let [invocations, bytes] = form.invocations_and_bytes(size).map(|count| count as f64);
                rows.push(Row::number(form.name(), INVOCATIONS, "invocations", invocations));
                rows.push(Row::number(form.name(), BYTES, "bytes", bytes));
                passes.push(contender(&gpu, form.name(), own, &source));
            }
            Err(error) => rows.push(Row::missing(form.name(), TIME, error.unsupported()?)),
        }
        if matches!(form, Form::RowConstants | Form::RowConstantsBy(_) | Form::Walk(_)) {
            rows.push(host_time(form, &plane, band));
        }
    }
    for method in DerivativeMethod::ALL {
        let form = if method == DerivativeMethod::Differences { Form::Textbook } else { Form::RowConstants };
        let own = CoordinatesPass::new(&gpu, form, Output::Derivatives(method), &plane, band, SIDE)?;
        methods.push(contender(&gpu, derivatives_name(method), own, &source));
    }
    // The claims compare times that differ by a few per cent, so there are twelve times as many rounds as usual.
    let timed = bench.interleave_until(&gpu, passes, 12, |_| false)?;
    rows.extend(timed.iter().map(|one| one.row(TIME)));
    rows.push(Row::number(THESIS, GAIN, "", THESIS_GAIN));
    rows.extend(Timed::gains(&timed, "textbook", GAIN));
    rows.extend(bench.times(&gpu, methods, DERIVATIVES)?);
    Ok(rows)
}

/// Time of the set-up on the host, in ms: the shortest of five runs.
fn host_time(form: Form, plane: &TiltedPlane, band: Band) -> Row {
    let words = RefCell::new(0);
    let run = |_| {
        let start = Instant::now();
        *words.borrow_mut() += set_up(form, plane, band).len();
        start.elapsed().as_secs_f64() * 1e3
    };
    let min = (0..5).map(run).fold(f64::INFINITY, f64::min);
    assert!(words.into_inner() > 0, "the set-up has no words");
    Row::number(form.name(), SET_UP, "ms", min)
}
