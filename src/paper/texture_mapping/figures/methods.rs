//! The methods that figures compare, by name.

use super::lab::SOFTWARE_SAMPLER;
use crate::paper::texture_mapping::baselines::FilterBaseline;
use crate::paper::texture_mapping::footprint::{Axes, Determinant, Scan};
use crate::paper::texture_mapping::method::{EllipseFilter, Method};
use crate::paper::texture_mapping::weight_map::{MapShape, WeightMap};
use crate::paper::texture_mapping::weights::{Edge, EllipseKernel};

/// The paper's filter at the level that the minor axis selects. The filter as printed always reads level 0, where a
/// distant pixel scans thousands of texels.
pub const PAPER_BY_LEVEL: EllipseFilter =
    EllipseFilter::PAPER.scan(Scan::RowSpan).minor_texels(2.0).determinant(Determinant::AllPositive);

pub const RADIAL_64: WeightMap = WeightMap { shape: MapShape::Radial, entries: 64, bits: 16, linear: true };
pub const SQUARED_128: WeightMap =
    WeightMap { shape: MapShape::SquaredRadius, entries: 128, bits: 16, linear: false };

/// The names of our settings begin with this.
pub const OURS: &str = "ellipse";

/// Object-space texturing with two spacings, in pixels.
pub const OBJECT_SPACE: [(&str, Method); 2] = [
    ("object space, spacing 1", Method::ObjectSpace(1.0)),
    ("object space, spacing 1/2", Method::ObjectSpace(0.5)),
];

/// All methods of `tm.pareto`.
pub fn all() -> Vec<(String, Method)> {
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
        (format!("{OURS}, r^2 map"), best.map(SQUARED_128)),
        (format!("{OURS}, box scan"), best.scan(Scan::BoundingBox)),
        (format!("{OURS}, ratio 16"), best.most_ratio(16.0)),
        (format!("{OURS}, ratio 4"), best.most_ratio(4.0)),
        (format!("{OURS}, 1/2 texel across"), best.minor_texels(0.5)),
        (format!("{OURS}, 1/4 texel across"), best.minor_texels(0.25)),
        (format!("{OURS}, 1/4 texel across, ratio 2"), best.minor_texels(0.25).most_ratio(2.0)),
        (format!("{OURS}, 1/4 texel across, ratio 1.8"), best.minor_texels(0.25).most_ratio(1.8)),
    ];
    settings.into_iter().map(|(name, ellipse)| (name, Method::Ellipse(ellipse))).collect()
}

fn baselines() -> Vec<(String, Method)> {
    let mut all = vec![("trilinear".to_string(), FilterBaseline::Trilinear)];
    all.extend([2, 4, 8, 16].map(|most| (format!("anisotropic {most}"), FilterBaseline::Anisotropic(most))));
    all.extend(
        [2, 4, 8, 16].map(|most| (format!("GPU's anisotropic {most}"), FilterBaseline::Hardware(most))),
    );
    all.push((SOFTWARE_SAMPLER.into(), FilterBaseline::Hardware(16)));
    all.extend([4, 8, 16].map(|most| (format!("Feline {most}"), FilterBaseline::Feline(most))));
    all.extend([3, 5, 7].map(|taps| (format!("Mavridis {taps}"), FilterBaseline::Mavridis(taps))));
    all.push(("pbrt EWA".into(), FilterBaseline::Pbrt));
    all.extend([1, 4, 16, 64].map(|n| (format!("stochastic {n}"), FilterBaseline::Stochastic(n))));
    all.push(("summed area".into(), FilterBaseline::SummedArea));
    all.into_iter().map(|(name, baseline)| (name, Method::Baseline(baseline))).collect()
}
