//! Filtered relief compared with its f64 form, and with the mean of exact intersections.

use ortelius::paper::texture_mapping::agreement::nmse;
use ortelius::paper::texture_mapping::relief::parallax::{ParallaxFilter, ParallaxView, truth};
use ortelius::paper::texture_mapping::relief::parallax_reference::{RayPixel, pixels};
use ortelius::paper::texture_mapping::relief::pass::FilteredRelief;
use ortelius::paper::texture_mapping::relief::{Relief, ReliefKind};
use ortelius::vk::{GpuOptions, Watched};

const SIDE: usize = 32;

fn view(elevation_degrees: f64) -> ParallaxView {
    ParallaxView { elevation_degrees, columns: SIDE as u32 / 4, pixel: 4.0 }
}

/// Each pixel's colour, and the number of texels visited.
fn read(
    gpu: &Watched,
    relief: &Relief,
    colours: &[f32],
    view: &ParallaxView,
    method: ParallaxFilter,
) -> Vec<[f32; 2]> {
    let own = FilteredRelief::new(gpu, relief, colours, view, method).unwrap();
    gpu.run_pass("filter", |cmd| own.run(cmd)).unwrap();
    own.read(gpu).unwrap()
}

fn filtered(
    gpu: &Watched,
    relief: &Relief,
    colours: &[f32],
    view: &ParallaxView,
    method: ParallaxFilter,
) -> Vec<f64> {
    read(gpu, relief, colours, view, method).iter().map(|pixel| f64::from(pixel[0])).collect()
}

/// The number of pixels whose colour or number of texels is outside the range that f64 allows.
fn outliers(found: &[[f32; 2]], right: &[RayPixel]) -> usize {
    assert_eq!(found.len(), right.len());
    let within = |&(found, right): &(&[f32; 2], &RayPixel)| {
        let [colour, texels] = *found;
        let [low, high] = right.range;
        let [fewest, max] = right.texels.map(|n| n as f32);
        (low..=high).contains(&f64::from(colour)) && (fewest..=max).contains(&texels)
    };
    found.iter().zip(right).filter(|pair| !within(pair)).count()
}

#[test]
fn every_methods_pixels_are_those_of_its_f64_form_and_not_of_another_method() {
    let gpu = Watched::open(&GpuOptions::default());
    for (kind, elevation) in
        ReliefKind::ALL.into_iter().flat_map(|kind| [15.0, 30.0, 60.0].map(|at| (kind, at)))
    {
        let (relief, view) = (kind.relief(SIDE), view(elevation));
        let colours = relief.colours();
        let right = ParallaxFilter::ALL.map(|method| pixels(&relief, &colours, &view, method));
        for (n, method) in ParallaxFilter::ALL.into_iter().enumerate() {
            let found = read(&gpu, &relief, &colours, &view, method);
            let others = right.each_ref().map(|right| outliers(&found, right));
            let wide = right[n].iter().filter(|pixel| pixel.range[1] - pixel.range[0] > 2e-3).count();
            let of = format!("{} at {elevation} by {}", kind.name(), method.name());
            println!("{of}: {others:?} of {} pixels differ, {wide} ranges are wide", found.len());
            assert_eq!(others[n], 0, "{of}");
            // On flat tops, many ends lie exactly at a texel.
            if matches!(kind, ReliefKind::Rock | ReliefKind::Bricks) && elevation == 30.0 {
                assert!(wide * 3 <= found.len(), "{of}: {wide} wide ranges");
                // The pixels' centres lie on flat tops of bricks, where the offset needs no tracing.
                let on_tops = |n: usize| {
                    kind == ReliefKind::Bricks
                        && [ParallaxFilter::Offset, ParallaxFilter::Unperturbed]
                            .contains(&ParallaxFilter::ALL[n])
                };
                let distinct = |other: &usize| *other != n && !(on_tops(n) && on_tops(*other));
                let min = (0..others.len()).filter(distinct).map(|other| others[other]).min();
                assert!(min >= Some(found.len() / 8), "{of}: {others:?} differ from other methods");
            }
        }
    }
}

#[test]
fn one_colour_stays_what_it_is_by_every_method_on_every_relief() {
    let gpu = Watched::open(&GpuOptions::default());
    for (kind, elevation) in
        ReliefKind::ALL.into_iter().flat_map(|kind| [10.0, 45.0, 89.0].map(|angle| (kind, angle)))
    {
        let relief = kind.relief(SIDE);
        for method in ParallaxFilter::ALL {
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
    for kind in [ReliefKind::Bricks, ReliefKind::Rock] {
        let (relief, view) = (kind.relief(SIDE), view(30.0));
        let colours = relief.colours();
        let right = truth(&relief, &colours, &view, 24);
        let [point, visible, projected] =
            [ParallaxFilter::Point, ParallaxFilter::Visible, ParallaxFilter::Projected].map(|method| {
                nmse(filtered(&gpu, &relief, &colours, &view, method).into_iter(), &right.values)
            });
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
        [ParallaxFilter::Whole, ParallaxFilter::Visible].map(|m| filtered(&gpu, &plane, &colours, &view, m));
    assert_eq!(whole, visible);
    // On a plane, projected widths are a box filter.
    let right = truth(&plane, &colours, &view, 64);
    let found = filtered(&gpu, &plane, &colours, &view, ParallaxFilter::Projected);
    let projected = nmse(found.into_iter(), &right.values);
    assert!(projected < 1e-6, "{projected}");
}
