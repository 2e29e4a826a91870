//! tm.drift: error of each form of the coordinates against f64, along rows of up to 16,384 pixels.

use super::coordinates::noise;
use super::shown::NONE;
use crate::figure::prelude::*;
use crate::paper::texture_mapping::coordinates::pass::{CoordinatesPass, Output};
use crate::paper::texture_mapping::coordinates::{Band, DerivativeMethod, Form, reference};
use crate::paper::texture_mapping::plane::TiltedPlane;
use crate::stats::percentile;
use crate::vk::{Gpu, Image, Sampler};

pub const DRIFT: Figure = Figure {
    id: "tm.drift",
    title: "Coordinates: error along a row",
    about: "The figure shows the largest error of u and v against f64, in texels, over two rows of each of 150 random \
            planes (quick: 16). `8192 texels`: coordinates lie within 8192 texels of 0, and the homography's \
            denominator w varies up to tenfold. `horizon`: in the first of the two rows w is about 1/200 of its value \
            at the picture's centre, and coordinates reach 500,000 texels, where an ulp of f32 is 1/32 texel. The \
            paper's increments (7) and (8) add f32 numbers along the row, so their error grows linearly with the row's \
            length. Restarts bound the error. The row's constants (f64, rounded to f32) with one `fma` do not drift, \
            whether a thread computes one pixel or many, and neither do 64-bit integers. For derivatives, the figure \
            shows the largest error relative to the pixel's largest derivative.",
    scenes: &[NEAR, HORIZON],
    variants: || {
        let methods = DerivativeMethod::ALL.map(|method| format!("{} derivatives", method.name()));
        Form::ALL.map(Form::name).into_iter().chain(methods).collect()
    },
    paper: &["sequential"],
    sweep: Some(Sweep {
        name: "row, pixels",
        quick: &[1920.0, 16384.0],
        full: &[1920.0, 3840.0, 8192.0, 16384.0],
    }),
    show: Show::views(|| {
        [(NEAR, "plane-tilt/tilted"), (HORIZON, "plane-tilt/grazing")]
            .map(|(name, scene)| FigureView::new(name, scene, NONE))
            .into()
    }),
    measure,
    plots: &[plot(LARGEST), plot(MEDIAN), plot(DERIVATIVE)],
    claims: &[
        Claim::ours(
            "5-thousandths",
            "Within 8192 texels, the row's constants with fma have an error of at most 0.005 texels in rows of 16,384 \
             pixels.",
            &[
                Test::value(ROW_CONSTANTS, AtMost(0.005)),
                Test::value(one(LARGEST, "row constants, runs of 64"), AtMost(0.005)),
            ],
        )
        .at(Places::scenes(&[NEAR]).x(16384.0, 16384.0)),
        Claim::ours(
            "restart-16",
            "Within 8192 texels, a walk that restarts every 16 pixels has an error of at most 1/64 texel.",
            &[Test::value(one(LARGEST, "restart 16"), AtMost(1.0 / 64.0))],
        )
        .at(Places::scenes(&[NEAR])),
        Claim::ours(
            "sequential",
            "The error of the paper's sequential increments (7) is at least 10 times that of the row's \
             constants.",
            &[Test::ratio(one(LARGEST, "sequential"), ROW_CONSTANTS, AtLeast(10.0))],
        ),
        Claim::ours(
            "horizon",
            "Near the horizon, the error of textbook coordinates is at least 4 times that of the row's \
             constants.",
            &[Test::ratio(one(LARGEST, "textbook"), ROW_CONSTANTS, AtLeast(4.0))],
        )
        .at(Places::scenes(&[HORIZON])),
        Claim::ours(
            "derivatives",
            "The error of incremental ellipse parameters is at most 1/100 of that of differences of f32 \
             coordinates.",
            &[Test::ratio_of(DERIVATIVE, ["differences derivatives", "incremental derivatives"], AtLeast(100.0))],
        ),
    ],
    ..Figure::BASE
};

const NEAR: &str = "8192 texels";
const HORIZON: &str = "horizon";

const LARGEST: &str = "largest error";
const MEDIAN: &str = "median error";
const DERIVATIVE: &str = "largest relative error";

const ROW_CONSTANTS: Pick = one(LARGEST, "row constants");

const fn plot(quantity: &'static str) -> Plot {
    Plot::sweep(quantity).log_x().log_y()
}

/// A plane of a scene and the first of its two rows.
fn case(scene: &str, seed: u64, size: [u32; 2]) -> (TiltedPlane, u32) {
    match scene {
        HORIZON => TiltedPlane::near_horizon(seed, size, 5e5),
        _ => (TiltedPlane::random(seed, size, 8192.0), (seed % 8) as u32 * size[1] / 8),
    }
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let width = cell.x.context("a sweep")? as u32;
    let size = [width, width * 9 / 16];
    let planes = bench.effort_of(16, 150);
    let cases: Vec<_> = (0..planes).map(|seed| case(&cell.scene, seed, size)).collect();
    let gpu = bench.gpu(&[])?;
    let source = noise(&gpu, 64)?;
    let mut rows = Vec::new();
    for form in Form::ALL {
        let found = match values(&gpu, &source, form, Output::Coordinates, width, &cases) {
            Ok(found) => found,
            Err(error) => {
                rows.push(Row::missing(form.name(), LARGEST, error.unsupported()?));
                continue;
            }
        };
        let errors = errors(&found, width, &cases, |plane, x, y| {
            let [u, v] = reference::coordinates(plane, x, y);
            ([u, v, 0.0, 0.0], 1.0)
        });
        let number =
            |quantity, p| Some(Row::number(form.name(), quantity, "texels", percentile(&errors, p)?));
        rows.extend(number(LARGEST, 1.0).into_iter().chain(number(MEDIAN, 0.5)));
    }
    for method in DerivativeMethod::ALL {
        let form = if method == DerivativeMethod::Differences { Form::Textbook } else { Form::RowConstants };
        let found = values(&gpu, &source, form, Output::Derivatives(method), width, &cases)?;
        // Relative to the pixel's largest derivative.
        let errors = errors(&found, width, &cases, |plane, x, y| {
            let exact = reference::derivatives(method, plane, x, y);
            (exact, exact.iter().fold(0.0, |max, d| d.abs().max(max)))
        });
        let name = format!("{} derivatives", method.name());
        rows.extend(percentile(&errors, 1.0).map(|largest| Row::number(name, DERIVATIVE, "", largest)));
    }
    Ok(rows)
}

/// A form's values in two rows of each case.
fn values(
    gpu: &Gpu,
    (image, sampler): &(Image, Sampler),
    form: Form,
    output: Output,
    width: u32,
    cases: &[(TiltedPlane, u32)],
) -> crate::vk::Result<Vec<Vec<[f32; 4]>>> {
    let band = Band { size: [width, 2], first_row: 0 };
    let mut own = CoordinatesPass::new(gpu, form, output, &cases[0].0, band, 64)?;
    let of_case = |(plane, first_row): &(TiltedPlane, u32)| {
        own.aim(gpu, plane, *first_row)?;
        gpu.run_pass("coordinates", |cmd| own.run(cmd, image, sampler))?;
        own.read_values(gpu)
    };
    cases.iter().map(of_case).collect()
}

/// Each pixel's largest error, divided by the scale. `exact` returns the exact values and the scale. NaN is an
/// infinite error.
fn errors(
    found: &[Vec<[f32; 4]>],
    width: u32,
    cases: &[(TiltedPlane, u32)],
    exact: impl Fn(&TiltedPlane, f64, f64) -> ([f64; 4], f64),
) -> Vec<f64> {
    let of_case = |(pixels, (plane, first_row)): (&Vec<[f32; 4]>, &(TiltedPlane, u32))| {
        let of_pixel = |(at, pixel): (usize, &[f32; 4])| {
            let (column, row) = (at as u32 % width, first_row + at as u32 / width);
            let (exact, scale) = exact(plane, f64::from(column) + 0.5, f64::from(row) + 0.5);
            let error = (0..4).map(|n| (f64::from(pixel[n]) - exact[n]).abs() / scale);
            error.fold(0.0, |max: f64, e| if e.is_nan() { f64::INFINITY } else { max.max(e) })
        };
        pixels.iter().enumerate().map(of_pixel).collect::<Vec<f64>>()
    };
    found.iter().zip(cases).flat_map(of_case).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_that_nothing_wrote_is_an_infinite_error() {
        let case = case(NEAR, 3, [2, 1]);
        let found = [vec![[f32::NAN; 4], [0.0; 4]]];
        let errors = errors(&found, 2, &[case], |_, _, _| ([0.0, 0.5, 0.0, 0.0], 1.0));
        assert_eq!(errors, [f64::INFINITY, 0.5]);
    }
}
