//! tm.extremes: planes on which filters fail.

use super::lab::{FLOOR, GAUSSIAN, Lab, LabPicture, NMSE, errors, own_errors};
use super::methods::other_weights;
use super::methods::{OBJECT_SPACE, OURS, PAPER_BY_LEVEL, QUADRANT_32, RADIAL_64, SQUARE_64, SQUARED_128};
use super::shown::ellipse_and_trilinear;
use crate::figure::prelude::*;
use crate::math::weight_map::WeightMap;
use crate::paper::texture_mapping::agreement::{Agreement, compare_fragments};
use crate::paper::texture_mapping::baselines::FilterBaseline;
use crate::paper::texture_mapping::footprint::Axes;
use crate::paper::texture_mapping::method::{EllipseFilter, Method};
use crate::paper::texture_mapping::object_space::reference::Mean;
use crate::paper::texture_mapping::plane::{Tilt, TiltedPlane};
use crate::paper::texture_mapping::weights::{Edge, EllipseKernel};
use crate::reference::pattern::Pattern;

pub const EXTREMES: Figure = Figure {
    id: "tm.extremes",
    title: "Filters at the extremes",
    about: "The pictures have 64 x 48 pixels and show 1/f noise on planes on which filters fail. `tilt-89.999`: \
            almost edge-on. `horizon`: the horizon crosses the middle of the picture. `behind`: the homography's \
            denominator changes its sign in the picture, so part of the plane is behind the camera. `rank-1`: a \
            singular Jacobian. `magnified`: 50 pixels per texel. `ratio-10000`: axes of 1000 and 0.1 texels. `far`: \
            10^5 texels per pixel. `overdraw-100`: a plane at 89 degrees that gives object-space texturing more than \
            100 fragments per pixel (planes are cut off where a pixel would receive more than 5000). The figure \
            counts pixels that are not finite or outside 0 to 1, and ellipses in which no texel has a weight (such \
            pixels show the nearest texel). Maps of 8 bits and a map of 4 x 4 entries are the coarsest. The paper's \
            filter as printed has no reconstruction term, and its determinant cancels in f32, so it has no f64 \
            reference. The pixels of every other method are also compared with that method's f64 reference. The truth \
            is the f64 supersample; a line shows its own error.",
    scenes: &[
        "tilt-89.999",
        "horizon",
        "behind",
        "rank-1",
        "magnified",
        "ratio-10000",
        "far",
        "overdraw-100",
    ],
    variants: || variants().into_iter().map(|(name, _)| name).chain([FLOOR.into()]).collect(),
    paper: &[AS_PRINTED, "as printed, columns"],
    ours: &["ellipse"],
    show: Show::views(views).variants(ellipse_and_trilinear),
    measure,
    // Counts of footprints have no truth and therefore no floor.
    plots: &[
        Plot::bars(NMSE).log_y().floor(FLOOR),
        Plot::bars(WORST).log_y().floor(FLOOR),
        Plot::bars(EMPTY),
    ],
    claims: &[
        Claim::ours(
            "finite",
            "Every pixel of every method is finite and between 0 and 1.",
            &[Test::value(every(BROKEN), Equal(0.0))],
        ),
        Claim::ours(
            "no-empty-footprint",
            "With a reconstruction term of at least 1/2, every footprint contains a texel.",
            &[Test::value(each(EMPTY, with_k), Equal(0.0))],
        ),
        Claim::ours(
            "reference",
            "Every pixel equals its f64 reference within f32 rounding: coordinates, levels, texel counts \
             and values.",
            &[Test::value(every(UNEXPLAINED), Equal(0.0))],
        ),
        Claim::ours(
            "paper-empty",
            "As printed, without a reconstruction term, some magnified footprints contain no texel.",
            &[Test::value(one(EMPTY, AS_PRINTED), Above(0.0))],
        )
        .at(Places::scenes(&["magnified"])),
        Claim::ours(
            "overdraw",
            "With more than 100 fragments per pixel, every pixel of the plane gets a fragment and no sum \
             overflows.",
            &[
                Test::value(one(FRAGMENTS, OBJECT_SPACE[0].0), Above(100.0)),
                Test::value(every(HOLES), Equal(0.0)),
                Test::value(every(UNEXPLAINED), Equal(0.0)),
            ],
        )
        .at(Places::scenes(&["overdraw-100"])),
    ],
    ..Figure::BASE
};

const AS_PRINTED: &str = "as printed, rows";

const WORST: &str = "worst pixel";
const BROKEN: &str = "pixels not finite or out of range";
const UNEXPLAINED: &str = "pixels that differ from f64 by more than rounding";
const FIRST: &str = "first pixel that differs from f64 by more than rounding";
const EMPTY: &str = "footprints without a texel";

const HOLES: &str = "pixels of the plane without a fragment";
const FRAGMENTS: &str = "fragments per pixel";

const SIZE: [u32; 2] = [64, 48];

/// Each pixel's ray meets the plane at 88.5 to 89.5 degrees, so the horizon lies outside the picture.
const OVERDRAWN: Tilt = Tilt { half_view_degrees: 0.5, ..Tilt::of(89.0) };

/// The figure's views for the window: those extremes that a camera over the board of `plane-tilt` can show.
fn views() -> Vec<FigureView> {
    let grazing = "east_m=0.0, north_m=-31.0, altitude_m=0.5";
    let cameras = [
        ("tilt-89.999", format!("{grazing}, tilt_deg=89.999")),
        ("horizon", format!("{grazing}, tilt_deg=90.0")),
        // 50 pixels per texel of 1/16 m in a picture of 1080 rows.
        ("magnified", "east_m=0.0, north_m=0.0, altitude_m=1.2".to_owned()),
    ];
    let change = |camera| [format!("cameras.grazing={{{camera}}}")];
    cameras.map(|(name, camera)| FigureView::new(name, "plane-tilt/grazing", change(camera))).into()
}

/// Each method with each of its settings that may fail: the paper's filter with both forms of its axes and both
/// readings of its kernel, ours with every weight and with coarse maps of 8 bits, and published filters.
fn variants() -> Vec<(String, Method)> {
    let best = EllipseFilter::BEST;
    let bits_8 = |map: WeightMap| best.map(WeightMap { bits: 8, ..map });
    let as_printed = [
        (AS_PRINTED, EllipseFilter::PAPER),
        ("as printed, columns", EllipseFilter::PAPER.axes(Axes::Columns)),
        ("as printed, rows, diameter 1", EllipseFilter::PAPER.kernel(EllipseKernel::DIAMETER_1)),
        ("as printed, rows, V1", EllipseFilter::PAPER.edge(Edge::Exact)),
        ("as printed, rows, 2-D map of 64", EllipseFilter::PAPER.map(SQUARE_64)),
        ("as printed, rows, level by the minor axis", PAPER_BY_LEVEL),
        ("as printed, columns, level by the minor axis", PAPER_BY_LEVEL.axes(Axes::Columns)),
        ("corrected axes, k 0", PAPER_BY_LEVEL.axes(Axes::Corrected)),
        ("ellipse", best),
        ("ellipse, k 1/2", best.k(0.5)),
        ("ellipse, r^2 map of 128", best.map(SQUARED_128)),
        ("ellipse, radial map of 64, 8 bits", bits_8(RADIAL_64)),
        ("ellipse, quadrant map of 32, 8 bits", bits_8(QUADRANT_32)),
        ("ellipse, 2-D map of 64, 8 bits", bits_8(SQUARE_64)),
        ("ellipse, 2-D map of 4, 8 bits", bits_8(WeightMap { entries: 4, ..SQUARE_64 })),
    ];
    let baselines = [
        ("trilinear", FilterBaseline::Trilinear),
        ("anisotropic 16", FilterBaseline::Anisotropic(16)),
        ("Feline 16", FilterBaseline::Feline(16)),
        ("Mavridis 5", FilterBaseline::Mavridis(5)),
        ("pbrt EWA", FilterBaseline::Pbrt),
        ("stochastic 16", FilterBaseline::Stochastic(16)),
        ("summed area", FilterBaseline::SummedArea),
    ];
    let ellipses = as_printed.map(|(name, ellipse)| (name.to_string(), ellipse)).into_iter();
    let ellipses = ellipses.chain(other_weights()).map(|(name, ellipse)| (name, Method::Ellipse(ellipse)));
    let others = baselines.map(|(name, baseline)| (name, Method::Baseline(baseline)));
    let others = OBJECT_SPACE.into_iter().chain(others).map(|(name, method)| (name.to_string(), method));
    ellipses.chain(others).collect()
}

/// Variants with a reconstruction term of at least 1/2.
fn with_k() -> Vec<String> {
    let names = variants().into_iter().map(|(name, _)| name);
    names.filter(|name| name.starts_with(OURS)).collect()
}

fn plane_of(scene: &str) -> TiltedPlane {
    let turned = |tilt| Tilt { roll_degrees: 20.0, yaw_degrees: 35.0, ..Tilt::of(tilt) };
    match scene {
        "tilt-89.999" => turned(89.999).plane(SIZE[1]),
        "horizon" => Tilt { half_view_degrees: 20.0, ..turned(82.0) }.plane(SIZE[1]),
        // Pixel columns left of the middle have w < 0, except the last of these columns, where w = 0 at the pixel's
        // centre.
        "behind" => TiltedPlane([[1.0, 0.25, 3.0], [0.125, 1.0, 5.0], [0.25, 0.0, 0.125]]),
        "rank-1" => TiltedPlane([[3.0, 1.0, 0.3], [1.5, 0.5, 0.7], [0.0, 0.0, 1.0]]),
        "magnified" => Tilt { texels_per_pixel: 0.02, ..turned(30.0) }.plane(SIZE[1]),
        "ratio-10000" => {
            let (sin, cos) = 0.6f64.sin_cos();
            TiltedPlane([[1000.0 * cos, -0.1 * sin, 0.3], [1000.0 * sin, 0.1 * cos, 0.7], [0.0, 0.0, 1.0]])
        }
        "overdraw-100" => OVERDRAWN.plane(SIZE[1]),
        "far" => Tilt { texels_per_pixel: 1e5, ..turned(60.0) }.plane(SIZE[1]),
        other => panic!("{other}: not a scene of this figure"),
    }
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let mut lab = Lab::new(&bench.gpu(&[])?, Pattern::PinkNoise, SIZE)?;
    lab.max_per_pixel = 5000.0;
    if cell.scene == "overdraw-100" {
        lab.camera_px = OVERDRAWN.focal_px(SIZE[1]);
    }
    let plane = plane_of(&cell.scene).rounded();
    let truth = lab.coarse_truth(&plane, GAUSSIAN);
    let worst = own_errors(&truth)?.max;
    let mut rows =
        vec![Row::number(FLOOR, NMSE, "", truth.own_nmse()), Row::number(FLOOR, WORST, "of white", worst)];
    for (name, method) in variants() {
        let name = &*name;
        let shown = lab.show(&lab.pass(&method)?, &plane, 0)?;
        rows.extend(match method {
            Method::ObjectSpace(spacing) => fragment_rows(&lab, name, spacing, &plane, &shown),
            _ => filter_rows(&lab, name, &method, &plane)?,
        });
        let found = errors(&shown.picture, &truth)?;
        rows.push(Row::number(name, NMSE, "", found.nmse));
        rows.push(Row::number(name, WORST, "of white", found.max));
    }
    Ok(rows)
}

/// True if a value is not finite or out of range. The sum of a sampler's weights may exceed 1 by 1/256.
fn broken<'a>(mut colour: impl Iterator<Item = &'a f32>) -> bool {
    !colour.all(|value| (-1.0 / 256.0..=1.0 + 1.0 / 256.0).contains(value))
}

fn agreement_rows(name: &str, found: &Agreement) -> [Row; 2] {
    let first = found.unexplained.first().cloned().unwrap_or_else(|| "none".into());
    [
        Row::number(name, UNEXPLAINED, "pixels", found.unexplained.len() as f64),
        Row::new(name, FIRST, "", Value::Text(first)),
    ]
}

fn filter_rows(lab: &Lab, name: &str, method: &Method, plane: &TiltedPlane) -> anyhow::Result<Vec<Row>> {
    let dumped = lab.dumped(method, plane)?;
    let seen = || dumped.iter().filter(|pixel| pixel.pixel.is_some());
    let count = seen().filter(|pixel| broken(pixel.colour.iter())).count();
    let mut rows = vec![Row::number(name, BROKEN, "pixels", count as f64)];
    if !method.subtracts() {
        rows.extend(agreement_rows(name, &lab.agreement(&dumped, method, plane)));
    }
    if matches!(method, Method::Ellipse(_)) {
        let count = seen().filter(|pixel| pixel.empty).count();
        rows.push(Row::number(name, EMPTY, "pixels", count as f64));
    }
    Ok(rows)
}

fn fragment_rows(lab: &Lab, name: &str, spacing: f32, plane: &TiltedPlane, shown: &LabPicture) -> Vec<Row> {
    let means = lab.fragments(plane, spacing);
    let count = shown.picture.rgba.iter().filter(|pixel| broken(pixel.iter())).count();
    let hole = |(n, mean): &(usize, &Mean)| {
        let at = [0, 1].map(|c| [n % SIZE[0] as usize, n / SIZE[0] as usize][c] as f64 + 0.5);
        let [x, y] = [0, 1].map(|c| at[c] - f64::from(SIZE[c]) / 2.0);
        mean.fragments == 0 && plane.texels(x, y).is_some()
    };
    let holes = means.iter().enumerate().filter(hole).count();
    let (found, _) = compare_fragments(&shown.picture.rgba, &means);
    let mut rows = vec![
        Row::number(name, BROKEN, "pixels", count as f64),
        Row::number(name, HOLES, "pixels", holes as f64),
        // A fragment fetches four texels.
        Row::number(name, FRAGMENTS, "fragments", shown.fetched / 4.0),
    ];
    rows.extend(agreement_rows(name, &found));
    rows
}
