//! The methods that figures compare, by name.

use super::lab::SOFTWARE_SAMPLER;
use crate::math::weight_map::{MapShape, WeightMap};
use crate::paper::texture_mapping::baselines::FilterBaseline;
use crate::paper::texture_mapping::footprint::{Axes, Determinant, KTexels, Scan};
use crate::paper::texture_mapping::method::{EllipseFilter, Method};
use crate::paper::texture_mapping::weights::{Edge, EllipseKernel};

/// The paper's filter at the level that the minor axis selects. The filter as printed always reads level 0, where a
/// distant pixel scans thousands of texels.
pub const PAPER_BY_LEVEL: EllipseFilter =
    EllipseFilter::PAPER.scan(Scan::RowSpan).minor_texels(2.0).determinant(Determinant::AllPositive);

pub const RADIAL_64: WeightMap = WeightMap { shape: MapShape::Radial, entries: 64, bits: 16, linear: true };
pub const SQUARED_128: WeightMap =
    WeightMap { shape: MapShape::SquaredRadius, entries: 128, bits: 16, linear: false };

pub const SQUARE_64: WeightMap = WeightMap { shape: MapShape::Square, entries: 64, bits: 16, linear: false };
pub const QUADRANT_32: WeightMap =
    WeightMap { shape: MapShape::Quadrant, entries: 32, bits: 16, linear: false };

/// The variant under which figures show the thesis's numbers.
pub const THESIS: &str = "the thesis";

/// The names of our settings begin with this.
pub const OURS: &str = "ellipse";

/// Object-space texturing with two spacings of the fragments, in pixels.
pub const OBJECT_SPACE: [(&str, Method); 2] = [
    ("object space, spacing 1", Method::ObjectSpace(1.0)),
    ("object space, spacing 1/2", Method::ObjectSpace(0.5)),
];

/// A setting with few texels.
pub const FEW: &str = "ellipse, 9 fetches";

/// Edge texels count as a whole, so no texel is read for a small part of its weight.
const fn whole_texels(k: f32, minor_texels: f32, max_ratio: f32) -> EllipseFilter {
    EllipseFilter::BEST.edge(Edge::None).k(k).minor_texels(minor_texels).max_ratio(max_ratio)
}

/// One texel: an ellipse that is so small that it contains no texel's centre shows the nearest texel. The texels of its
/// level are at most 1.4 pixels wide along the footprint's major axis.
pub const NEAREST: EllipseFilter =
    whole_texels(0.0, POINT_PX / 1.4, 1.0).kernel(EllipseKernel { radius_px: POINT_PX, alpha: 2.0 });
const POINT_PX: f32 = 0.01;

/// Our filter with every other weight: no weights, formula (4), every form of the edge, and every shape of map. The
/// filter itself has the area ramp as its edge.
pub fn other_weights() -> Vec<(String, EllipseFilter)> {
    let best = EllipseFilter::BEST;
    let formula_4 = best.kernel(EllipseKernel::FORMULA_4);
    let edges = Edge::ALL.into_iter().filter(|edge| *edge != best.edge).map(|edge| {
        let name = match edge {
            Edge::None => "edge texels as a whole".to_string(),
            Edge::Exact => "V1".into(),
            _ => format!("V1 {}", edge.name()),
        };
        (name, best.edge(edge))
    });
    let others = [
        ("uniform weights", best.kernel(EllipseKernel::UNIFORM)),
        ("formula (4)", formula_4),
        ("radial map of 64", best.map(RADIAL_64)),
        ("quadrant map of 32", best.map(QUADRANT_32)),
        ("2-D map of 64", best.map(SQUARE_64)),
    ];
    let others = others.map(|(name, ellipse)| (name.to_string(), ellipse));
    edges.chain(others).map(|(name, ellipse)| (format!("{OURS}, {name}"), ellipse)).collect()
}

/// The family of a method of [`all`], for the chart of `tm.pareto`.
pub fn family(name: &str) -> &'static str {
    let families = [
        ("paper's", "the paper's filter"),
        ("corrected", "corrected axes, kernel, k"),
        (OURS, "ellipse (ours)"),
        ("object space", "object space"),
        ("trilinear", "trilinear, anisotropic"),
        ("anisotropic", "trilinear, anisotropic"),
        ("GPU's anisotropic", "trilinear, anisotropic"),
        ("Feline", "Feline, Mavridis"),
        ("Mavridis", "Feline, Mavridis"),
        ("pbrt", "EWA by others"),
        (SOFTWARE_SAMPLER, "EWA by others"),
        ("stochastic", "stochastic"),
    ];
    let own = families.into_iter().find(|(start, _)| name.starts_with(start));
    own.map_or("summed area", |(_, family)| family)
}

/// The paper's filter with the other reading of its kernel, with its edge weights, and with its weight map.
fn papers_weights() -> [(&'static str, EllipseFilter); 3] {
    [
        ("paper's rows, diameter 1", PAPER_BY_LEVEL.kernel(EllipseKernel::DIAMETER_1)),
        ("paper's rows, V1", PAPER_BY_LEVEL.edge(Edge::Exact)),
        ("paper's rows, 2-D map of 64", PAPER_BY_LEVEL.map(SQUARE_64)),
    ]
}

/// All methods of `tm.pareto`.
pub fn all() -> Vec<(String, Method)> {
    let papers = papers_weights().map(|(name, ellipse)| (name.to_string(), ellipse)).into_iter();
    let weights = papers.chain(other_weights()).map(|(name, ellipse)| (name, Method::Ellipse(ellipse)));
    with_default_weights().into_iter().chain(weights).collect()
}

/// Each method once, and our filter with every footprint.
pub fn with_default_weights() -> Vec<(String, Method)> {
    let object_space = OBJECT_SPACE.map(|(name, method)| (name.to_string(), method));
    ellipses().into_iter().chain(object_space).chain(baselines()).collect()
}

fn ellipses() -> Vec<(String, Method)> {
    let best = EllipseFilter::BEST;
    let corrected = PAPER_BY_LEVEL.axes(Axes::Corrected).kernel(EllipseKernel::EWA);
    let settings = [
        ("paper's rows".to_string(), PAPER_BY_LEVEL),
        ("paper's columns".into(), PAPER_BY_LEVEL.axes(Axes::Columns)),
        ("corrected, k 0".into(), corrected),
        ("corrected, k 0.8".into(), corrected.k(0.8)),
        ("corrected, k 0.8, V1".into(), corrected.k(0.8).edge(Edge::Exact)),
        (format!("{OURS}, 2 texels across"), best.minor_texels(2.0)),
        (OURS.into(), best),
        (format!("{OURS}, k 0.9"), best.k(0.9)),
        (format!("{OURS}, k of each level"), best.k_texels(KTexels::OfLevel)),
        (format!("{OURS}, r^2 map"), best.map(SQUARED_128)),
        (format!("{OURS}, box scan"), best.scan(Scan::BoundingBox)),
        (format!("{OURS}, ratio 16"), best.max_ratio(16.0)),
        (format!("{OURS}, ratio 4"), best.max_ratio(4.0)),
        (format!("{OURS}, 18 fetches"), best.minor_texels(0.7).max_ratio(4.0)),
        (format!("{OURS}, 14 fetches"), best.k(0.7).minor_texels(0.6).max_ratio(3.0)),
        (FEW.into(), whole_texels(0.7, 0.6, 4.0)),
        (format!("{OURS}, 7 fetches"), whole_texels(0.4, 0.6, 3.0)),
        // With so few texels, the blur of their own level's k removes more aliasing error than the blur itself adds.
        (format!("{OURS}, 5 fetches"), whole_texels(0.4, 0.5, 3.0).k_texels(KTexels::OfLevel)),
        (format!("{OURS}, 3 fetches"), whole_texels(0.4, 0.4, 2.0).k_texels(KTexels::OfLevel)),
        (format!("{OURS}, nearest texel"), NEAREST),
    ];
    settings.into_iter().map(|(name, ellipse)| (name, Method::Ellipse(ellipse))).collect()
}

fn baselines() -> Vec<(String, Method)> {
    let mut all = vec![("trilinear".to_string(), FilterBaseline::Trilinear)];
    all.extend([2, 4, 8, 16].map(|max| (format!("anisotropic {max}"), FilterBaseline::Anisotropic(max))));
    all.extend([2, 4, 8, 16].map(|max| (format!("GPU's anisotropic {max}"), FilterBaseline::Hardware(max))));
    all.push((SOFTWARE_SAMPLER.into(), FilterBaseline::Hardware(16)));
    all.extend([4, 8, 16].map(|max| (format!("Feline {max}"), FilterBaseline::Feline(max))));
    all.extend([3, 5, 7].map(|taps| (format!("Mavridis {taps}"), FilterBaseline::Mavridis(taps))));
    all.push(("pbrt EWA".into(), FilterBaseline::Pbrt));
    all.extend([1, 4, 16, 64].map(|n| (format!("stochastic {n}"), FilterBaseline::Stochastic(n))));
    all.push(("summed area".into(), FilterBaseline::SummedArea));
    all.into_iter().map(|(name, baseline)| (name, Method::Baseline(baseline))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_edge_and_every_shape_of_map_is_a_method() {
        let ellipses: Vec<EllipseFilter> = all()
            .into_iter()
            .filter_map(|(_, method)| match method {
                Method::Ellipse(ellipse) => Some(ellipse),
                _ => None,
            })
            .collect();
        for edge in Edge::ALL {
            assert!(ellipses.iter().any(|ellipse| ellipse.edge == edge), "{edge:?}");
        }
        let shapes = [MapShape::Square, MapShape::Quadrant, MapShape::Radial, MapShape::SquaredRadius];
        for shape in shapes {
            let mut maps = ellipses.iter().filter_map(|ellipse| ellipse.map);
            assert!(maps.any(|map| map.shape == shape), "{shape:?}");
        }
    }

    #[test]
    fn families_have_several_methods_except_summed_area() {
        let all = all();
        let of = |family_of: &str| all.iter().filter(|(name, _)| family(name) == family_of).count();
        let families: BTreeSet<_> = all.iter().map(|(name, _)| family(name)).collect();
        for name in families {
            assert_eq!(of(name) > 1, name != "summed area", "{name}");
        }
    }
}
