//! The ellipse on tiles with the settings that paper 3 has and a scene can choose: the reconstruction term k, the
//! texels visited, the formula of the determinant, level 0, and axis ratios up to 64. Compared with paper 3's f64
//! reference.

use crate::TextureSession;
use crate::ellipse::{listed, needed, of_ellipse, wrong_levels};
use crate::texel_filters::{compared, filter, in_tiles, noise, plain_compared};
use ortelius::math::weight_map::{MapShape, WeightMap};
use ortelius::paper::texture_mapping::footprint::{Axes, Determinant, KTexels, Scan};
use ortelius::paper::texture_mapping::method::{EllipseFilter, Method};
use ortelius::paper::texture_mapping::weights::{Edge, EllipseKernel};
use ortelius::paper::virtual_texture::Filtering;
use ortelius::paper::virtual_texture::choices::{
    FilterAxes, FilterDeterminant, FilterEdge, FilterKernel, FilterMap, FilterScan,
};
use ortelius::paper::virtual_texture::config::Filter;

/// The setting of a scene and its method: the literal paper 3, up to the limit of the axis ratio.
fn literal() -> (Filter, EllipseFilter) {
    let own = Filter {
        minor_texels: 0.0,
        k: 0.0,
        axes: FilterAxes::Rows,
        kernel: FilterKernel::Formula4,
        edge: FilterEdge::None,
        scan: FilterScan::BoundingBox,
        determinant: FilterDeterminant::Subtracting,
        ..filter(Filtering::Ellipse, 64, 1)
    };
    (own, EllipseFilter::PAPER.max_ratio(64.0))
}

/// The filter of scenes, and its method.
fn usual(ratio: u32) -> (Filter, EllipseFilter) {
    let ellipse = EllipseFilter::BEST.max_ratio(ratio as f32).minor_texels(2.0);
    (filter(Filtering::Ellipse, ratio, 1), ellipse)
}

/// Each new setting alone, and with the settings on which it depends: the limit of the footprint depends on k, the edge
/// and the ratio.
fn cases() -> Vec<(Filter, EllipseFilter)> {
    let (own, best) = usual(16);
    let with_k = |k: f64| (Filter { k, ..own }, best.k(k as f32));
    let sharp = |(filter, ellipse): (Filter, EllipseFilter)| {
        (Filter { edge: FilterEdge::None, ..filter }, ellipse.edge(Edge::None))
    };
    let (long, longer) = usual(64);
    let exact = literal();
    vec![
        with_k(0.0),
        with_k(0.1),
        with_k(0.25),
        with_k(4.0),
        sharp(with_k(0.0)),
        sharp(with_k(0.5)),
        (long, longer),
        (Filter { k: 0.0, ..long }, longer.k(0.0)),
        (Filter { scan: FilterScan::BoundingBox, ..long }, longer.scan(Scan::BoundingBox)),
        (Filter { minor_texels: 0.0, ..own }, best.minor_texels(0.0)),
        (Filter { minor_texels: 0.5, ..own }, best.minor_texels(0.5)),
        // The subtracting determinant has no f64 reference within these bounds.
        (
            Filter { determinant: FilterDeterminant::AllPositive, ..exact.0 },
            exact.1.determinant(Determinant::AllPositive),
        ),
    ]
}

/// The filter of scenes with a weight map of 16 bits.
fn mapped(weight_map: FilterMap, map_entries: u32, map_linear: bool) -> (Filter, EllipseFilter) {
    let shape = match weight_map {
        FilterMap::None => panic!("no map"),
        FilterMap::Square => MapShape::Square,
        FilterMap::Quadrant => MapShape::Quadrant,
        FilterMap::Radial => MapShape::Radial,
        FilterMap::SquaredRadius => MapShape::SquaredRadius,
    };
    let (own, best) = usual(16);
    let map = WeightMap { shape, entries: map_entries, bits: 16, linear: map_linear };
    (Filter { weight_map, map_entries, map_linear, ..own }, best.map(map))
}

/// Every shape of map with few and with many entries; 8 bits; with and without texels beyond the edge; the printed axes
/// and kernel.
fn maps() -> Vec<(Filter, EllipseFilter)> {
    let (square, of_square) = mapped(FilterMap::Square, 64, false);
    let (radial, of_radial) = mapped(FilterMap::Radial, 64, false);
    let of_bits = |entries, shape| WeightMap { shape, entries, bits: 8, linear: false };
    vec![
        (square, of_square),
        mapped(FilterMap::Square, 256, false),
        mapped(FilterMap::Quadrant, 32, false),
        (radial, of_radial),
        mapped(FilterMap::Radial, 4, true),
        mapped(FilterMap::Radial, 256, true),
        mapped(FilterMap::SquaredRadius, 128, false),
        mapped(FilterMap::SquaredRadius, 16, true),
        (Filter { map_bits: 8, ..radial }, of_radial.map(of_bits(64, MapShape::Radial))),
        (Filter { edge: FilterEdge::None, ..square }, of_square.edge(Edge::None)),
        (
            Filter { axes: FilterAxes::Rows, kernel: FilterKernel::Formula4, ..square },
            of_square.axes(Axes::Rows).kernel(EllipseKernel::FORMULA_4),
        ),
    ]
}

fn settled(tile_log2: u32, border: u32, camera: &str, own: Filter) -> TextureSession {
    crate::texel_filters::settled(noise(tile_log2, border, None), camera, |settings| {
        settings.config.filter = own
    })
}

#[test]
fn every_setting_of_the_ellipse_on_tiles_is_the_f64_filter() {
    for (own, ellipse) in cases() {
        for (camera, tile_log2, border) in [("edge", 6, 0), ("above", 4, 1), ("edge", 7, 3)] {
            let mut renderer = settled(tile_log2, border, camera, own);
            let found = compared(&mut renderer, in_tiles(Method::Ellipse(ellipse), tile_log2), None);
            let case = format!("{own:?}, {camera}, {tile_log2}, {border}: {found:?}");
            assert!(found.wrong == 0 && found.judged > 2000 && found.undecided == 0, "{case}");
        }
    }
}

#[test]
fn every_setting_of_the_ellipse_on_a_plain_texture_is_the_f64_filter() {
    // Magnified pixels of `low` have weights close to 0 if k is 0.
    for camera in ["above", "low"] {
        let mut renderer = settled(7, 2, camera, usual(16).0);
        for (own, ellipse) in cases() {
            let found = plain_compared(&mut renderer, camera, &own, Method::Ellipse(ellipse));
            assert!(found.wrong == 0 && found.judged > 1000 && found.undecided == 0, "{own:?}: {found:?}");
        }
    }
    let mut renderer = settled(7, 2, "low", usual(16).0);
    // Near misses that must be rejected.
    let (own, best) = usual(64);
    for other in
        [best.k(0.0), best.k(0.7), best.minor_texels(0.5), best.max_ratio(16.0), best.scan(Scan::BoundingBox)]
    {
        let found = plain_compared(&mut renderer, "low", &own, Method::Ellipse(other));
        assert!(found.wrong > 20, "{other:?}: {found:?}");
    }
}

#[test]
fn a_weight_map_gives_the_f64_filter_with_that_map() {
    let mut on_tiles = settled(7, 2, "above", usual(16).0);
    for (own, ellipse) in maps() {
        for (camera, tile_log2, border) in [("edge", 6, 0), ("above", 7, 3)] {
            let mut renderer = settled(tile_log2, border, camera, own);
            let found = compared(&mut renderer, in_tiles(Method::Ellipse(ellipse), tile_log2), None);
            let case = format!("{own:?}, {camera}, {tile_log2}, {border}: {found:?}");
            assert!(found.wrong == 0 && found.judged > 2000 && found.undecided == 0, "{case}");
        }
        let found = plain_compared(&mut on_tiles, "above", &own, Method::Ellipse(ellipse));
        assert!(found.wrong == 0 && found.judged > 1000 && found.undecided == 0, "{own:?}: {found:?}");
    }
    // Near misses that must be rejected: other entries, another shape, interpolation, no map. The bound of a
    // two-dimensional map allows a neighbouring entry everywhere, so it rejects only coarse maps.
    let few = mapped(FilterMap::Radial, 4, false);
    for (own, other) in [
        (few.0, mapped(FilterMap::Radial, 8, false).1),
        (few.0, mapped(FilterMap::SquaredRadius, 4, false).1),
        (few.0, mapped(FilterMap::Radial, 4, true).1),
        (few.0, usual(16).1),
        (mapped(FilterMap::Square, 4, false).0, mapped(FilterMap::Square, 256, false).1),
    ] {
        let mut renderer = settled(7, 0, "edge", own);
        let found = compared(&mut renderer, in_tiles(Method::Ellipse(other), 7), None);
        assert!(20 * found.wrong > found.judged, "{own:?} as {other:?}: {found:?}");
        let found = plain_compared(&mut on_tiles, "above", &own, Method::Ellipse(other));
        assert!(20 * found.wrong > found.judged, "{own:?} as {other:?}: {found:?}");
    }
}

/// A square map holds each entry of a quadrant map of half the side four times. At an edge between two entries,
/// rounding may take either.
#[test]
fn a_quadrant_map_gives_the_picture_of_the_square_map_with_twice_the_entries() {
    let picture = |weight_map, map_entries| {
        let (own, _) = mapped(weight_map, map_entries, false);
        settled(6, 0, "edge", own).linear_picture().unwrap().rgba
    };
    let square = picture(FilterMap::Square, 64);
    let differing = |entries| {
        let quadrant = picture(FilterMap::Quadrant, entries);
        let differs = |(a, b): (&[f32; 4], &[f32; 4])| (0..3).any(|c| (a[c] - b[c]).abs() > 1e-6);
        quadrant.iter().zip(&square).filter(|pair| differs(*pair)).count()
    };
    // One of a thousand pixels; the near miss differs in half of the surface's pixels.
    let counts = [32, 64].map(differing);
    assert!(1000 * counts[0] < square.len() && counts[1] > 1500, "{counts:?} of {}", square.len());
}

/// The list has each tile from which a pixel reads texels, and no other.
#[test]
fn every_setting_of_the_ellipse_lists_the_tiles_that_it_reads() {
    for (own, ellipse) in cases() {
        for (scene, camera, border) in [("ruler", "corner-oblique", 0), ("earth", "low", 4)] {
            let mut renderer = crate::ellipse::settled(scene, camera, border, |settings| {
                settings.streaming.gpu_tiles = 1024;
                settings.config.filter = own;
            });
            let ellipse = ellipse.within(renderer.technique.source.pyramid().tile_size() / 2);
            let [wrong, covered] = wrong_levels(&mut renderer, &ellipse);
            assert!(wrong == 0 && covered > 4000, "{own:?}, {scene}: {wrong} of {covered}");
            let (tiles, counts) = needed(&mut renderer, i64::from(border), &of_ellipse(ellipse));
            println!("{scene}, {own:?}: {} tiles, {counts:?}", tiles.len());
            assert_eq!(listed(&renderer), tiles, "{own:?}, {scene}");
        }
    }
}

/// Near misses that must be rejected: the neighbouring value of each setting.
#[test]
fn another_setting_of_the_ellipse_is_not_the_picture() {
    let (own, best) = usual(16);
    let (long, longer) = usual(64);
    for (filter, other) in [
        (Filter { minor_texels: 0.0, ..own }, best.minor_texels(1.0)),
        (Filter { minor_texels: 0.0, k: 0.0, ..own }, best.minor_texels(0.0)),
        (literal().0, literal().1.axes(Axes::Columns)),
        (literal().0, literal().1.k(0.8)),
        (literal().0, literal().1.kernel(EllipseKernel::EWA)),
    ] {
        let mut renderer = settled(7, 0, "edge", filter);
        let found = compared(&mut renderer, in_tiles(Method::Ellipse(other), 7), None);
        assert!(20 * found.wrong > found.judged, "{filter:?} as {other:?}: {found:?}");
    }
    // Level 0, which most pixels have, does not depend on the unit of k.
    let mut renderer = settled(7, 0, "edge", own);
    let other = Method::Ellipse(best.k_texels(KTexels::OfLevel));
    let found = compared(&mut renderer, in_tiles(other, 7), None);
    assert!(found.wrong > 100, "{found:?}");
    // Few pixels have a longer ellipse than 16, or so many texels that the box raises the level, or are in level 0,
    // outside of which a small change of k is smaller still.
    for (filter, other) in [
        (Filter { k: 0.0, ..own }, best.k(0.1)),
        (Filter { k: 0.1, ..own }, best.k(0.0)),
        (own, best.k(0.7)),
        (long, longer.max_ratio(16.0)),
        (long, longer.scan(Scan::BoundingBox)),
        (Filter { scan: FilterScan::BoundingBox, ..long }, longer),
    ] {
        let mut renderer = settled(7, 0, "low", filter);
        let found = compared(&mut renderer, in_tiles(Method::Ellipse(other), 7), None);
        assert!(found.wrong > 20, "{filter:?} as {other:?}: {found:?}");
    }
}

/// At one level, V11 V22 - V12^2 has a relative error of at most `2 V11 V22 2^-23 / det`. With V11 V22 <= (larger +
/// smaller)^2 / 4 and a ratio of 64, this is 2^-23 64^2 / 2 = 2.4e-4, and the entries of V have roundings of their own.
/// r changes by half of it, and the weights by 2 alpha r^2 times that: less than 1e-3. So the two determinants give
/// nearly, but not exactly, the same picture.
#[test]
fn the_subtracting_determinant_differs_by_its_rounding() {
    let (own, _) = usual(64);
    let of = |determinant| {
        settled(7, 0, "low", Filter { k: 0.0, determinant, ..own }).linear_picture().unwrap().rgba
    };
    let (a, b) = (of(FilterDeterminant::AllPositive), of(FilterDeterminant::Subtracting));
    let off = |(a, b): (&[f32; 4], &[f32; 4])| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
    let offs: Vec<f32> = a.iter().zip(&b).map(off).collect();
    let (differing, worst) =
        (offs.iter().filter(|&&off| off > 0.0).count(), offs.iter().copied().fold(0.0, f32::max));
    println!("{differing} of {} pixels differ, by at most {worst:.1e}", offs.len());
    assert!(differing > 100 && worst < 1e-3, "{differing}, {worst}");
}
