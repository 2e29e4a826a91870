//! Every form of the coordinates. Numerators and denominators equal their f32 twin to the bit; the errors of
//! coordinates and derivatives against the f64 reference stay within derived bounds.

use ortelius::paper::texture_mapping::coordinates::pass::{CoordinatesPass, Output, needs};
use ortelius::paper::texture_mapping::coordinates::twin::{self, Fma};
use ortelius::paper::texture_mapping::coordinates::{Band, DerivativeMethod, Form, RowWalk, reference};
use ortelius::paper::texture_mapping::method::{Coordinates, EllipseFilter};
use ortelius::paper::texture_mapping::pass::{Dumped, FilterPass, Targets, Uploaded, push};
use ortelius::paper::texture_mapping::plane::{Tilt, TiltedPlane};
use ortelius::paper::texture_mapping::texels::GreyMipmap;
use ortelius::reference::pattern::Pattern;
use ortelius::vk::{
    Feature, Format, Gpu, GpuOptions, ImageInfo, PassTime, SamplerFilter, SamplerInfo, Watched, Work,
};

const WIDTH: u32 = 16_384;
const PICTURE: [u32; 2] = [WIDTH, 9216];

fn device() -> Watched {
    let wishes = &[Feature::Int64, Feature::PipelineStatistics];
    Watched::open(&GpuOptions { wishes, ..GpuOptions::default() })
}

/// Planes with coordinates within 8192 texels, and two rows of each.
fn planes() -> impl Iterator<Item = (TiltedPlane, Band)> {
    (0..6).map(|seed| {
        let band = Band { size: [WIDTH, 2], first_row: 1800 * seed };
        (TiltedPlane::random(u64::from(seed), PICTURE, 8192.0), band)
    })
}

/// The work that the device counts while a form draws texels.
fn work(gpu: &Gpu, form: Form, plane: &TiltedPlane, band: Band) -> Work {
    gpu.count_work(true);
    let (_, passes) = run_counted(gpu, form, Output::Texels, plane, band);
    gpu.count_work(false);
    passes[0].work.expect("the device counts")
}

fn run(gpu: &Gpu, form: Form, output: Output, plane: &TiltedPlane, band: Band) -> CoordinatesPass {
    run_counted(gpu, form, output, plane, band).0
}

fn run_counted(
    gpu: &Gpu,
    form: Form,
    output: Output,
    plane: &TiltedPlane,
    band: Band,
) -> (CoordinatesPass, Vec<PassTime>) {
    let image = gpu.image("ramp", ImageInfo::texture([64, 64], Format::Rgba8, 1)).unwrap();
    let texels: Vec<u8> =
        (0..64 * 64).flat_map(|n: u32| [n % 64 * 4, n / 64 * 4, 0, 255].map(|c| c as u8)).collect();
    gpu.fill_levels(&image, &[texels]).unwrap();
    let sampler =
        gpu.sampler("linear", SamplerInfo { filter: SamplerFilter::Linear, wraps_in_s: false }).unwrap();
    let pass = CoordinatesPass::new(gpu, form, output, plane, band, 64).unwrap();
    let passes = gpu.run_pass("coordinates", |cmd| pass.run(cmd, &image, &sampler)).unwrap();
    (pass, passes)
}

fn values(gpu: &Gpu, form: Form, output: Output, plane: &TiltedPlane, band: Band) -> Vec<[f32; 4]> {
    run(gpu, form, output, plane, band).read_values(gpu).unwrap()
}

/// The terms of a band, computed by a form's twin.
fn twin_of(form: Form, plane: &TiltedPlane, band: Band, fma: Fma) -> Vec<[f32; 3]> {
    let [width, height] = band.size;
    let rows = (0..height).flat_map(|row| {
        let constants = plane.row_constants(band.first_row + row);
        match form {
            Form::Textbook => {
                (0..width).map(|column| twin::textbook(plane, column, band.first_row + row)).collect()
            }
            Form::TextbookBy(_) => {
                let row = band.first_row + row;
                (0..width).map(|column| twin::textbook_by(plane, column, row, fma)).collect()
            }
            Form::RowConstants | Form::RowConstantsBy(_) => {
                (0..width).map(|n| twin::row_constants(&constants, n, fma)).collect()
            }
            Form::Walk(walk) => twin::walk(&constants, walk, width, fma),
            other => panic!("{other:?} has no f32 twin"),
        }
    });
    rows.collect()
}

/// The errors of a band's coordinates and their bounds, in texels.
fn errors(found: &[[f32; 4]], plane: &TiltedPlane, band: Band) -> Vec<(f64, f64)> {
    let width = band.size[0] as usize;
    let of_pixel = |(at, found): (usize, &[f32; 4])| {
        let (column, row) = ((at % width) as u32, band.first_row + (at / width) as u32);
        let exact = reference::coordinates(plane, f64::from(column) + 0.5, f64::from(row) + 0.5);
        let bound = twin::row_constants_error(&plane.row_constants(row), column);
        let axis = |axis: usize| (f64::from(found[axis]) - exact[axis]).abs();
        [(axis(0), bound[0]), (axis(1), bound[1])]
    };
    found.iter().enumerate().flat_map(of_pixel).collect()
}

/// The largest value. NaN, which marks an unwritten pixel, counts as infinite.
fn greatest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |max: f64, value| if value.is_nan() { f64::INFINITY } else { max.max(value) })
}

fn largest(errors: &[(f64, f64)]) -> f64 {
    greatest(errors.iter().map(|&(error, _)| error))
}

#[test]
fn numerators_and_denominators_are_those_of_the_f32_twin_to_the_bit() {
    let gpu = device();
    let walks = [
        RowWalk::Sequential,
        RowWalk::TwoEnds,
        RowWalk::Lanes(8),
        RowWalk::Lanes(128),
        RowWalk::Restart(1),
        RowWalk::Restart(16),
    ];
    let runs = [RowWalk::Restart(64), RowWalk::Lanes(32)];
    let forms = [Form::Textbook, Form::RowConstants].into_iter().chain(walks.map(Form::Walk));
    let forms = forms.chain(runs.map(Form::RowConstantsBy)).chain(runs.map(Form::TextbookBy));
    let mut roundings = Vec::new();
    for (form, (plane, band)) in forms.flat_map(|form| planes().take(2).map(move |case| (form, case))) {
        let found: Vec<_> =
            values(&gpu, form, Output::Terms, &plane, band).iter().map(|&[a, b, c, _]| [a, b, c]).collect();
        let equal = |fma: &Fma| found == twin_of(form, &plane, band, *fma);
        let matching: Vec<Fma> = [Fma::Fused, Fma::Twice].into_iter().filter(equal).collect();
        assert!(!matching.is_empty(), "{} equals no twin", form.name());
        if form != Form::Textbook {
            roundings.push(matching);
        }
    }
    // A device rounds `fma` the same way in every shader.
    let common = [Fma::Fused, Fma::Twice].into_iter().any(|fma| roundings.iter().all(|m| m.contains(&fma)));
    assert!(common, "{roundings:?}");
    // The twins of different forms differ, so this test would find a form that computes another form's values.
    let (plane, band) = planes().next().unwrap();
    let runs = RowWalk::Restart(64);
    let own = [Form::RowConstantsBy(runs), Form::TextbookBy(runs), Form::Walk(runs)];
    let [row_constants, textbook, added] = own.map(|form| twin_of(form, &plane, band, Fma::Fused));
    assert!(row_constants != textbook && row_constants != added && textbook != added);
}

#[test]
fn row_constants_err_by_less_than_their_bound_and_by_less_than_5_thousandths_of_a_texel() {
    let gpu = device();
    for (plane, band) in planes() {
        let runs = [RowWalk::Restart(64), RowWalk::Lanes(32)].map(Form::RowConstantsBy);
        for form in [Form::RowConstants, Form::Walk(RowWalk::Restart(1))].into_iter().chain(runs) {
            let errors = errors(&values(&gpu, form, Output::Coordinates, &plane, band), &plane, band);
            let beyond = errors.iter().find(|(error, bound)| error.is_nan() || error > bound);
            assert_eq!(beyond, None, "{}: error and bound", form.name());
            assert!(largest(&errors) <= 0.005, "{}: {} texels", form.name(), largest(&errors));
        }
    }
}

/// Shows that the bound can fail: the error of sums of 16,384 terms exceeds it.
#[test]
fn sequential_sums_drift_beyond_the_bound_of_row_constants() {
    let gpu = device();
    let (plane, band) = planes().next().unwrap();
    let sequential = Form::Walk(RowWalk::Sequential);
    let errors = errors(&values(&gpu, sequential, Output::Coordinates, &plane, band), &plane, band);
    assert!(errors.iter().any(|(error, bound)| error > bound));
    assert!(largest(&errors) > 0.05, "{}", largest(&errors));
}

#[test]
fn integers_have_no_drift() {
    let gpu = device();
    if !gpu.has(Feature::Int64) {
        let form = Form::Integer(RowWalk::Sequential);
        let (plane, band) = planes().next().unwrap();
        let refused = CoordinatesPass::new(&gpu, form, Output::Coordinates, &plane, band, 64);
        assert!(refused.err().is_some_and(|error| error.to_string().contains("shaderInt64")));
        assert_eq!(needs(form).len(), 1);
        return;
    }
    for (walk, (plane, band)) in
        [RowWalk::Sequential, RowWalk::Lanes(32), RowWalk::TwoEnds].into_iter().zip(planes())
    {
        let form = Form::Integer(walk);
        for (at, found) in values(&gpu, form, Output::Terms, &plane, band).iter().enumerate() {
            let (column, row) = (at as u32 % WIDTH, at as u32 / WIDTH);
            let set_up = twin::integers(&plane.row_constants(band.first_row + row), WIDTH);
            let exact = twin::integer_terms(set_up, column);
            for c in 0..3 {
                // A conversion to f32 may round to either neighbour.
                let error = (f64::from(found[c]) - exact[c] as f64).abs();
                assert!(
                    error <= 2f64.powi(-23) * (exact[c] as f64).abs(),
                    "{walk:?}: {column}: {} {}",
                    found[c],
                    exact[c]
                );
            }
        }
        let errors = errors(&values(&gpu, form, Output::Coordinates, &plane, band), &plane, band);
        // Two conversions (1 ulp each) and a division (2.5 ulp): 4.5 ulp of 8192 texels.
        assert!(largest(&errors) <= 4.5 * 2f64.powi(-11), "{}", largest(&errors));
    }
}

/// The largest error of derivatives, relative to the largest derivative of the pixel.
fn derivative_error(gpu: &Gpu, form: Form, method: DerivativeMethod, plane: &TiltedPlane, band: Band) -> f64 {
    let found = values(gpu, form, Output::Derivatives(method), plane, band);
    let of_pixel = |(at, found): (usize, &[f32; 4])| {
        let x = f64::from(at as u32 % WIDTH) + 0.5;
        let y = f64::from(band.first_row + at as u32 / WIDTH) + 0.5;
        let exact = reference::derivatives(method, plane, x, y);
        let largest = exact.iter().fold(0.0, |max: f64, d| max.max(d.abs()));
        greatest((0..4).map(|n| (f64::from(found[n]) - exact[n]).abs())) / largest
    };
    greatest(found.iter().enumerate().map(of_pixel))
}

#[test]
fn derivatives_of_the_rows_constants_err_by_a_few_ulp_and_differences_by_thousands() {
    let gpu = device();
    for (plane, band) in planes() {
        for method in [DerivativeMethod::Incremental, DerivativeMethod::Analytic] {
            let error = derivative_error(&gpu, Form::RowConstants, method, &plane, band);
            // w varies tenfold, so the sums of the numerator and of w may lose a factor of 10. The derivative divides
            // by w twice. The division adds 2.5 ulp.
            assert!(error <= 40.0 * 2f64.powi(-24), "{}: {error}", method.name());
        }
        let differences = derivative_error(&gpu, Form::Textbook, DerivativeMethod::Differences, &plane, band);
        assert!(differences > 1e-4, "{differences}");
    }
}

#[test]
fn every_form_draws_every_pixel_of_the_same_picture() {
    let gpu = device();
    let size = [321, 67];
    let plane = TiltedPlane::tilted(size, 60.0, 20.0, 64.0);
    let band = Band { size, first_row: 0 };
    let texels = |form| -> Vec<[u8; 4]> {
        let words = run(&gpu, form, Output::Texels, &plane, band).read(&gpu).unwrap();
        words.into_iter().map(u32::to_le_bytes).collect()
    };
    let first = texels(Form::Textbook);
    assert_eq!(first.len(), 321 * 67);
    let distinct: std::collections::BTreeSet<_> = first.iter().collect();
    assert!(distinct.len() > 1000, "the picture shows the ramp: {} colours", distinct.len());
    for form in Form::ALL.into_iter().filter(|form| gpu.require(&needs(*form)).is_ok()) {
        // The ramp has 4 codes per texel. A drift of 0.01 texels, or a varying's position off by 1/256 pixel, changes
        // a byte by at most one code.
        let found = texels(form);
        let near = |(a, b): (&[u8; 4], &[u8; 4])| a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) <= 1);
        let far = found.iter().zip(&first).position(|pair| !near(pair));
        assert_eq!(far.map(|at| (at, found[at], first[at])), None, "{}", form.name());
    }
}

/// The counts of tm.17, compared with the device's statistics.
#[test]
fn a_forms_invocations_are_those_that_the_device_counts() {
    let gpu = device();
    assert!(gpu.has(Feature::PipelineStatistics), "the test needs a device that counts invocations");
    let size = [320, 64];
    let (plane, band) = (TiltedPlane::tilted(size, 60.0, 20.0, 64.0), Band { size, first_row: 0 });
    for form in Form::ALL.into_iter().filter(|form| gpu.require(&needs(*form)).is_ok()) {
        let work = work(&gpu, form, &plane, band);
        let [invocations, _] = form.invocations_and_bytes(size);
        // Of 1024 lanes, the lanes beyond column 320 have no pixel. Workgroups have 64 threads.
        let idle = if form == Form::Walk(RowWalk::Lanes(1024)) { (1024 - 320) * 64 } else { 0 };
        match work.dispatches {
            0 => assert!(work.fragment_invocations >= invocations, "{}: {work:?}", form.name()),
            _ => assert_eq!(work.compute_invocations, invocations + idle, "{}", form.name()),
        }
    }
    let bytes = |form: Form| form.invocations_and_bytes(size)[1];
    let pixels = 320 * 64;
    assert_eq!([bytes(Form::Textbook), bytes(Form::RowConstants)], [0, 12 * pixels]);
    assert_eq!(bytes(Form::RowConstantsBy(RowWalk::Restart(64))), 12 * pixels / 64);
    assert_eq!(bytes(Form::Integer(RowWalk::Lanes(32))), 48 * 32 * 64);
}

/// With a thread for each pixel, this picture has more groups than one dimension of a dispatch may have.
#[test]
fn a_picture_of_66048_groups_is_drawn_whole() {
    let gpu = device();
    let (width, height) = (2048, 2064);
    let plane = TiltedPlane::tilted([width, height], 60.0, 20.0, 64.0);
    let texels = |first_row, rows| {
        let band = Band { size: [width, rows], first_row };
        run(&gpu, Form::Walk(RowWalk::Restart(1)), Output::Texels, &plane, band).read(&gpu).unwrap()
    };
    let whole = texels(0, height);
    let parts = [0, 1024, height - 16].map(|first| (first, texels(first, 16)));
    for (first, part) in &parts {
        let begin = (first * width) as usize;
        assert!(whole[begin..begin + part.len()] == part[..], "rows from {first} on");
    }
    assert!(parts[0].1 != parts[1].1 && parts[1].1 != parts[2].1, "the parts differ");
}

/// The pixels of an ellipse filter with this form of the coordinates.
fn filtered(gpu: &Gpu, form: Coordinates, plane: &TiltedPlane) -> Vec<Dumped> {
    let size = super::SIZE;
    let texels = GreyMipmap::new(64, Pattern::WhiteNoise.texels(64));
    let pass =
        FilterPass::by(gpu, &EllipseFilter::BEST, texels.coarsest(), form, (plane, size), true).unwrap();
    let targets = Targets::new(gpu, size, true).unwrap();
    let uploaded = Uploaded::new(gpu, "texture", &texels).unwrap();
    pass.run(gpu, &uploaded, &targets, &push(plane, size, 0)).unwrap();
    targets.dumped(gpu).unwrap()
}

/// For each pixel, the error of the Jacobian divided by its bound: the larger quotient of the Jacobian's two rows.
fn jacobian_errors(found: &[Dumped], form: Coordinates, plane: &TiltedPlane) -> Vec<f64> {
    let [width, height] = super::SIZE;
    let of_pixel = |(n, dumped): (usize, &Dumped)| {
        let [column, row] = [n as u32 % width, n as u32 / width].map(|c| f64::from(c) + 0.5);
        let (x, y) = (column - f64::from(width) / 2.0, row - f64::from(height) / 2.0);
        let pixel = dumped.pixel.expect("the plane fills the picture");
        let exact = match form {
            Coordinates::Analytic => plane.jacobian(x, y),
            _ => reference::differences(plane, x, y),
        };
        // A numerator or denominator is a sum of three terms. Its constants, products and sums each have a rounding
        // error of 2^-24: at most 8 such errors of `term`, the sum of the terms' largest magnitudes in the picture.
        let term = |c: usize| {
            let [by_x, by_y, constant] = plane.0[c];
            (by_x * f64::from(width)).abs() + (by_y * f64::from(height)).abs() + constant.abs()
        };
        let w = plane.0[2][0] * x + plane.0[2][1] * y + plane.0[2][2];
        let error = |axis: usize| {
            let texels = pixel.centre[axis].abs();
            let position =
                8.0 * 2f64.powi(-24) * (term(axis) + texels * term(2)) / w + 2.5 * 2f64.powi(-23) * texels;
            let largest = exact[axis][0].abs().max(exact[axis][1].abs());
            let bound = match form {
                // The sum of the numerator's relative error, twice the denominator's relative error, and the error of
                // the division.
                Coordinates::Incremental | Coordinates::Analytic => {
                    40.0 * 2f64.powi(-24) * term(2) / w * largest
                }
                // The error of a difference is at most the sum of the errors of the pixel's position and of its
                // neighbour's position.
                Coordinates::Textbook | Coordinates::Rows => 2.5 * position,
            };
            let off = [0, 1].map(|n| (pixel.jacobian[axis][n] - exact[axis][n]).abs());
            greatest(off.into_iter()) / bound
        };
        error(0).max(error(1))
    };
    found.iter().enumerate().map(of_pixel).collect()
}

#[test]
fn an_ellipse_filters_footprint_has_the_derivatives_of_its_coordinates() {
    let gpu = device();
    for tilt in [30.0, 75.0] {
        let plane = Tilt { roll_degrees: 20.0, ..Tilt::of(tilt) }.plane(super::SIZE[1]);
        let forms =
            [Coordinates::Analytic, Coordinates::Textbook, Coordinates::Rows, Coordinates::Incremental];
        let found = forms.map(|form| filtered(&gpu, form, &plane));
        for (found, form) in found.iter().zip(forms) {
            let worst = greatest(jacobian_errors(found, form, &plane).into_iter());
            println!("{form:?} at {tilt}: {worst} of the bound");
            assert!(worst <= 1.0, "{form:?} at {tilt} degrees: {worst} times the bound");
        }
        // Derivatives at the pixel's centre are not differences to its neighbours.
        let other = jacobian_errors(&found[0], Coordinates::Textbook, &plane);
        assert!(greatest(other.into_iter()) > 10.0, "at {tilt} degrees");
    }
}
