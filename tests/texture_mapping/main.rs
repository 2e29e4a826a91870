//! Paper 3 on the device, compared with its f64 references and f32 twins. Every test runs with validation and
//! synchronisation validation.

mod coordinates;
mod kernels;
mod methods;
mod object_space;
mod parallax;
mod relief;

use ortelius::math::weight_map::{MapShape, WeightMap};
use ortelius::paper::texture_mapping::baselines::FilterBaseline;
use ortelius::paper::texture_mapping::footprint::{Axes, Determinant, KTexels, Scan};
use ortelius::paper::texture_mapping::method::{EllipseFilter, Method};
use ortelius::paper::texture_mapping::pass::{Dumped, FilterPass, Targets, Uploaded, push};
use ortelius::paper::texture_mapping::plane::TiltedPlane;
use ortelius::paper::texture_mapping::texels::GreyMipmap;
use ortelius::paper::texture_mapping::weights::{Edge, EllipseKernel};
use ortelius::vk::{Feature, GpuOptions, Watched};

fn device() -> Watched {
    Watched::open(&GpuOptions { wishes: &[Feature::SamplerAnisotropy], ..GpuOptions::default() })
}

const SIZE: [u32; 2] = [48, 36];

/// Methods that cover every value of every setting.
fn methods() -> Vec<Method> {
    let best = EllipseFilter::BEST;
    let map = |shape, entries, bits| best.map(WeightMap { shape, entries, bits, linear: false });
    let mut ellipses = vec![
        EllipseFilter::PAPER,
        EllipseFilter::PAPER.determinant(Determinant::AllPositive),
        EllipseFilter::PAPER.axes(Axes::Columns).determinant(Determinant::AllPositive),
        EllipseFilter::PAPER.axes(Axes::Corrected).scan(Scan::RowSpan).determinant(Determinant::AllPositive),
        best,
        best.scan(Scan::BoundingBox),
        best.axes(Axes::Rows),
        best.axes(Axes::Round),
        best.axes(Axes::Columns).edge(Edge::None),
        best.max_ratio(4.0).minor_texels(2.0),
        best.k_texels(KTexels::OfLevel),
        best.minor_texels(0.5),
        best.axes(Axes::Columns).minor_texels(0.5).max_ratio(16.0),
        map(MapShape::Square, 64, 8),
        map(MapShape::Quadrant, 32, 16),
        map(MapShape::Radial, 64, 16),
        best.map(WeightMap { shape: MapShape::Radial, entries: 64, bits: 16, linear: true }),
        map(MapShape::SquaredRadius, 128, 8).edge(Edge::None),
    ];
    ellipses.extend(Edge::ALL.map(|edge| best.edge(edge).kernel(EllipseKernel::FORMULA_4)));
    ellipses.extend(
        [EllipseKernel::DIAMETER_1, EllipseKernel::UNIFORM]
            .map(|kernel| best.kernel(kernel).edge(Edge::None)),
    );
    let baselines = [
        FilterBaseline::Trilinear,
        FilterBaseline::Anisotropic(16),
        FilterBaseline::Feline(16),
        FilterBaseline::Mavridis(7),
        FilterBaseline::Pbrt,
        FilterBaseline::Stochastic(1),
        FilterBaseline::Stochastic(16),
        FilterBaseline::SummedArea,
    ];
    ellipses.into_iter().map(Method::Ellipse).chain(baselines.map(Method::Baseline)).collect()
}

fn dumped(gpu: &Watched, method: &Method, texels: &GreyMipmap, plane: &TiltedPlane) -> Vec<Dumped> {
    let texture = Uploaded::new(gpu, "texture", texels).unwrap();
    let targets = Targets::new(gpu, SIZE, true).unwrap();
    let pass = FilterPass::new(gpu, method, texels.coarsest(), true).unwrap();
    pass.run(gpu, &texture, &targets, &push(plane, SIZE, 0)).unwrap();
    targets.dumped(gpu).unwrap()
}
