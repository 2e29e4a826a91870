//! Filtered relief compared with the mean of exact intersections.

use ortelius::paper::texture_mapping::relief::parallax::{Method, View, truth};
use ortelius::paper::texture_mapping::relief::pass::Filtered;
use ortelius::paper::texture_mapping::relief::{Kind, Relief};
use ortelius::vk::{GpuOptions, Watched};

const SIDE: usize = 32;

fn view(elevation_degrees: f64) -> View {
    View { elevation_degrees, columns: SIDE as u32 / 4, pixel: 4.0 }
}

fn filtered(gpu: &Watched, relief: &Relief, colours: &[f32], view: &View, method: Method) -> Vec<f64> {
    let own = Filtered::new(gpu, relief, colours, view, method).unwrap();
    let mut frame = gpu.frame().unwrap();
    frame.pass("filter", |cmd| own.run(cmd)).unwrap();
    frame.submit().unwrap().wait().unwrap();
    own.read(gpu).unwrap().iter().map(|pixel| f64::from(pixel[0])).collect()
}

/// NMSE: the sum of squared errors, divided by the sum of squares of the truth. NaN if a pixel is NaN.
fn error(found: &[f64], right: &[f64]) -> f64 {
    assert_eq!(found.len(), right.len());
    let squares = found.iter().zip(right).map(|(found, right)| (found - right).powi(2));
    squares.sum::<f64>() / right.iter().map(|right| right * right).sum::<f64>()
}

#[test]
fn one_colour_stays_what_it_is_by_every_method_on_every_relief() {
    let gpu = Watched::open(&GpuOptions::default());
    for (kind, elevation) in
        Kind::ALL.into_iter().flat_map(|kind| [10.0, 45.0, 89.0].map(|angle| (kind, angle)))
    {
        let relief = kind.relief(SIDE);
        for method in Method::ALL {
            let pixels = filtered(&gpu, &relief, &[0.5; SIDE * SIDE], &view(elevation), method);
            // Sums of at most a few hundred products, each with a rounding error of 2^-24.
            let far = pixels.iter().find(|pixel| pixel.is_nan() || (*pixel - 0.5).abs() > 1e-5);
            assert_eq!(far, None, "{} at {elevation} by {}", kind.name(), method.name());
        }
    }
}

#[test]
fn projected_widths_are_near_the_truth_and_other_methods_are_not() {
    let gpu = Watched::open(&GpuOptions::default());
    for kind in [Kind::Bricks, Kind::Rock] {
        let (relief, view) = (kind.relief(SIDE), view(30.0));
        let colours = relief.colours();
        let right = truth(&relief, &colours, &view, 24);
        let [point, visible, projected] = [Method::Point, Method::Visible, Method::Projected]
            .map(|method| error(&filtered(&gpu, &relief, &colours, &view, method), &right));
        // The remaining error comes from two lines per texel and one sample per segment.
        assert!(projected < 5e-3, "{}: {projected}", kind.name());
        assert!(visible > 2.0 * projected && point > 10.0 * projected, "{}: {visible} {point}", kind.name());
    }
}

#[test]
fn on_a_plane_nothing_is_hidden() {
    let gpu = Watched::open(&GpuOptions::default());
    let plane = Relief { side: SIDE, depth: 8.0, heights: vec![255; SIDE * SIDE] };
    let (colours, view) = (plane.colours(), view(30.0));
    let [whole, visible] =
        [Method::Whole, Method::Visible].map(|m| filtered(&gpu, &plane, &colours, &view, m));
    assert_eq!(whole, visible);
    // Projected widths are then a box filter.
    let right = truth(&plane, &colours, &view, 64);
    let projected = error(&filtered(&gpu, &plane, &colours, &view, Method::Projected), &right);
    assert!(projected < 1e-6, "{projected}");
}
