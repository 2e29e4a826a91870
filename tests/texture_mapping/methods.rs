//! Pictures of every filter method against the f64 reference.

use super::{SIZE, device, dumped, methods};
use ortelius::math::weight_map::{MapShape, WeightMap};
use ortelius::paper::texture_mapping::agreement::compare;
use ortelius::paper::texture_mapping::baselines::FilterBaseline;
use ortelius::paper::texture_mapping::footprint::{Axes, Determinant, KTexels, Scan};
use ortelius::paper::texture_mapping::method::{EllipseFilter, Method};
use ortelius::paper::texture_mapping::pass::Dumped;
use ortelius::paper::texture_mapping::plane::{Tilt, TiltedPlane};
use ortelius::paper::texture_mapping::reference::ellipse;
use ortelius::paper::texture_mapping::texels::GreyMipmap;
use ortelius::paper::texture_mapping::weights::MIN_WEIGHTS;
use ortelius::reference::pattern::Pattern;

/// Planes: facing, tilted, turned, with a horizon, magnified, with a Jacobian of rank 1, and minified.
fn planes() -> Vec<(&'static str, TiltedPlane)> {
    let turned = |tilt| Tilt { roll_degrees: 20.0, yaw_degrees: 35.0, ..Tilt::of(tilt) };
    vec![
        ("facing", Tilt::of(0.0).plane(SIZE[1])),
        ("60 degrees", Tilt::of(60.0).plane(SIZE[1])),
        ("80 degrees, turned", turned(80.0).plane(SIZE[1])),
        ("horizon", Tilt { half_view_degrees: 20.0, ..turned(82.0) }.plane(SIZE[1])),
        ("89.999 degrees", Tilt::of(89.999).plane(SIZE[1])),
        ("magnified", Tilt { texels_per_pixel: 0.05, ..turned(30.0) }.plane(SIZE[1])),
        ("rank 1", TiltedPlane([[3.0, 1.0, 0.3], [1.5, 0.5, 0.7], [0.0, 0.0, 1.0]])),
        ("minified", minified()),
    ]
}

/// Footprints of levels 1 to 4.
fn minified() -> TiltedPlane {
    Tilt { texels_per_pixel: 5.0, roll_degrees: 20.0, ..Tilt::of(65.0) }.plane(SIZE[1])
}

#[test]
fn every_method_is_the_reference_up_to_rounding() {
    let gpu = device();
    let texels = GreyMipmap::new(64, Pattern::WhiteNoise.texels(64));
    let mut objections = Vec::new();
    for method in methods() {
        // The subtracted determinant of a long footprint is noise in f32: see `tm.extremes`.
        let planes = planes().into_iter().take(if method.subtracts() { 2 } else { 8 });
        for (name, plane) in planes {
            let plane = plane.rounded();
            let found = compare(&dumped(&gpu, &method, &texels, &plane), &method, &plane, SIZE, &texels, 0);
            println!("{method:?} {name}: worst {:.2e}, {:.2e} of its bound", found.worst, found.worst_share);
            if let Some(first) = found.unexplained.first() {
                let count = found.unexplained.len();
                objections.push(format!("{method:?}, {name}: {count} pixels, first {first}"));
            }
        }
    }
    assert!(objections.is_empty(), "\n{}\n", objections.join("\n"));
}

/// The counts of tm.24 and tm.v1: the texels that the shader counts, each with one weight, are the texels that have a
/// weight in the reference.
#[test]
fn each_texel_that_the_shader_counts_has_a_weight_in_the_reference() {
    let gpu = device();
    let texels = GreyMipmap::new(512, Pattern::PinkNoise.texels(512));
    let map = WeightMap { shape: MapShape::Radial, entries: 64, bits: 16, linear: true };
    let (best, paper) = (EllipseFilter::BEST, EllipseFilter::PAPER.scan(Scan::RowSpan).minor_texels(2.0));
    let paper = paper.determinant(Determinant::AllPositive).axes(Axes::Corrected).k(0.8);
    for (tilt, ellipse) in
        [0.0, 30.0, 60.0, 75.0, 80.0].into_iter().flat_map(|tilt| [(tilt, best), (tilt, paper.map(map))])
    {
        let plane = Tilt::of(tilt).plane(SIZE[1]).rounded();
        let found = dumped(&gpu, &Method::Ellipse(ellipse), &texels, &plane);
        let (mut counted, mut weights, mut undecided) = (0, 0, 0);
        for dumped in &found {
            let pixel = dumped.pixel.expect("the plane fills the picture");
            assert!(!dumped.empty && dumped.level < texels.coarsest(), "{tilt} degrees: {dumped:?}");
            let levels = [dumped.level, texels.coarsest()];
            counted += u64::from(dumped.fetched);
            weights += ellipse::weights(&ellipse, &pixel, texels.coarsest(), dumped.level).len() as u64;
            undecided += u64::from(ellipse::filtered(&ellipse, &pixel, levels, |_, _| 0.0).undecided);
        }
        println!("{tilt} degrees: {counted} texels, {weights} weights, {undecided} undecided");
        assert!(counted.abs_diff(weights) <= undecided && 1000 * undecided < weights, "{tilt} degrees");
    }
    assert_eq!([map.entries_read(), WeightMap { linear: false, ..map }.entries_read()], [2, 1]);
}

#[test]
fn a_changed_setting_is_not_explained_by_rounding() {
    let gpu = device();
    let texels = GreyMipmap::new(64, Pattern::WhiteNoise.texels(64));
    let plane = Tilt::of(60.0).plane(SIZE[1]).rounded();
    let found = dumped(&gpu, &Method::Ellipse(EllipseFilter::BEST), &texels, &plane);
    for other in [
        EllipseFilter::BEST.k(0.801),
        EllipseFilter::BEST.edge(ortelius::paper::texture_mapping::weights::Edge::Cubic),
    ] {
        let compared = compare(&found, &Method::Ellipse(other), &plane, SIZE, &texels, 0);
        assert!(compared.unexplained.len() > 100, "{other:?}: {:?}", compared.unexplained.len());
    }
}

/// The reconstruction term of a coarser level, where its two units differ, and where the minor axis is too short.
#[test]
fn in_a_coarser_level_another_unit_of_k_is_not_explained_by_rounding() {
    let gpu = device();
    let texels = GreyMipmap::new(512, Pattern::WhiteNoise.texels(512));
    let (best, plane) = (EllipseFilter::BEST, minified().rounded());
    for ellipse in [best, best.minor_texels(0.5)] {
        for [own, other] in [[KTexels::OfLevel0, KTexels::OfLevel], [KTexels::OfLevel, KTexels::OfLevel0]] {
            let found = dumped(&gpu, &Method::Ellipse(ellipse.k_texels(own)), &texels, &plane);
            assert!(found.iter().filter(|pixel| pixel.level > 1).count() > 200);
            for (unit, wrong) in [(own, 0..1), (other, 1000..4000)] {
                let method = Method::Ellipse(ellipse.k_texels(unit));
                let compared = compare(&found, &method, &plane, SIZE, &texels, 0);
                let unexplained = compared.unexplained;
                assert!(wrong.contains(&unexplained.len()), "{unit:?}: {:?}", unexplained.first());
            }
        }
    }
}

#[test]
fn a_constant_texture_comes_out_exactly() {
    let gpu = device();
    let texels = GreyMipmap::new(64, Pattern::Constant(119).texels(64));
    // The summation of the device's anisotropic filter is unspecified, hence its wider bound.
    let own = methods().into_iter().map(|method| (method, 2f32.powi(-25)));
    for (method, max) in own.chain([(Method::Baseline(FilterBaseline::Hardware(16)), 1.0 / 512.0)]) {
        for (name, plane) in planes() {
            for pixel in dumped(&gpu, &method, &texels, &plane).iter().filter(|pixel| pixel.pixel.is_some()) {
                // A device decodes a byte within an ulp.
                let off = pixel.colour.map(|channel| (channel - 119.0 / 255.0).abs());
                assert!(off.iter().all(|off| *off <= max), "{method:?}, {name}: {pixel:?}");
            }
        }
    }
}

#[test]
fn with_k_of_a_half_no_footprint_is_empty_and_without_it_many_are() {
    let gpu = device();
    let texels = GreyMipmap::new(64, Pattern::WhiteNoise.texels(64));
    let plane = Tilt::of(88.0).plane(SIZE[1]);
    let empty = |ellipse: EllipseFilter| {
        let pixels = dumped(&gpu, &Method::Ellipse(ellipse), &texels, &plane);
        pixels.iter().filter(|pixel| pixel.empty).count()
    };
    let plain =
        EllipseFilter::BEST.edge(ortelius::paper::texture_mapping::weights::Edge::None).minor_texels(0.0);
    assert_eq!(empty(plain.k(0.5)), 0);
    // In a coarser level, with a minor semi-axis of half a texel to a texel.
    let short = plain.k(0.5).minor_texels(0.5);
    let pixels = dumped(&gpu, &Method::Ellipse(short), &texels, &minified());
    assert!(pixels.iter().all(|pixel| !pixel.empty && pixel.level > 0));
    assert!(empty(plain.k(0.0)) > SIZE[0] as usize, "{}", empty(plain.k(0.0)));
}

/// Without k, the edge weights keep texels that are many radii away from a magnified footprint. f32 would lose some of
/// their weights, and how many depends on the device.
#[test]
fn a_footprint_with_weights_too_small_for_f32_is_empty_on_the_device_and_in_the_reference() {
    let gpu = device();
    let texels = GreyMipmap::new(64, Pattern::WhiteNoise.texels(64));
    let (_, plane) = planes()[5];
    let plane = plane.rounded();
    let ellipse = EllipseFilter::BEST.k(0.0);
    let method = Method::Ellipse(ellipse);
    let found = dumped(&gpu, &method, &texels, &plane);
    let compared = compare(&found, &method, &plane, SIZE, &texels, 0);
    assert!(compared.unexplained.is_empty(), "{:#?}", compared.unexplained);
    let sum = |pixel: &Dumped| -> f64 {
        let weights = ellipse::weights(&ellipse, &pixel.pixel.unwrap(), texels.coarsest(), pixel.level);
        weights.iter().map(|(_, weight)| weight).sum()
    };
    // Both sides of the bound occur, also where f32 could still hold some of the weights.
    let empty: Vec<f64> = found.iter().filter(|pixel| pixel.empty).map(sum).collect();
    let shown: Vec<f64> = found.iter().filter(|pixel| !pixel.empty).map(sum).collect();
    let held = empty.iter().filter(|sum| **sum > 2f64.powi(-126)).count();
    assert!(held > 5 && shown.iter().filter(|sum| **sum < 1e-20).count() > 5, "{held} of {}", empty.len());
    assert!(shown.iter().all(|sum| *sum >= MIN_WEIGHTS * (1.0 - 1e-3)));
    assert!(empty.iter().all(|sum| *sum <= MIN_WEIGHTS * (1.0 + 1e-3)));
}
