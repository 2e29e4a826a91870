//! tm.extremes: planes at which filters break.

use super::lab::{GAUSSIAN, Lab, errors};
use super::methods::{OURS, PAPER_BY_LEVEL, RADIAL_64};
use crate::figure::claim::{Bound::Above, Bound::Equal, Claim, Places, Test, each, every, one};
use crate::figure::{Bench, Cell, Figure, Plot, Row, Value};
use crate::paper::texture_mapping::baselines::Baseline;
use crate::paper::texture_mapping::footprint::{Axes, Determinant};
use crate::paper::texture_mapping::method::{Ellipse, Method};
use crate::paper::texture_mapping::plane::{Plane, Tilt};
use crate::paper::texture_mapping::weight_map::WeightMap;
use crate::reference::pattern::Pattern;

pub const EXTREMES: Figure = Figure {
    id: "tm.extremes",
    title: "Filters at the extremes",
    about: "1/f noise, 64 x 48 pixels, on planes at which filters break: `tilt-89.999`; `horizon`, in the middle of the picture; `behind`, the \
            camera's own plane cuts the picture's edge (w changes its sign); `rank-1`, a Jacobian without an inverse; `magnified`, 50 \
            pixels a texel; `ratio-10000`, axes of 1000 and 0.1 texels; `far`, 10^5 texels a pixel. Counted: pixels that are not finite or \
            leave 0 to 1, and footprints in which no texel has a weight (of ellipses; they show the nearest texel). The paper as \
            printed has no reconstruction term and a determinant that cancels in f32; every other method's pixels are also compared \
            with its own f64 reference. The truth is the f64 supersample.",
    scenes: &["tilt-89.999", "horizon", "behind", "rank-1", "magnified", "ratio-10000", "far"],
    variants: || variants().into_iter().map(|(name, _)| name.to_string()).collect(),
    sweep: None,
    measure,
    plots: &[Plot::bars(NMSE).log_y(), Plot::bars(EMPTY)],
    claims: &[
        Claim::ours(
            "finite",
            "No method has a pixel that is not finite or leaves 0 to 1.",
            &[Test::value(every(BROKEN), Equal(0.0))],
        ),
        Claim::ours(
            "no-empty-footprint",
            "With a reconstruction term of at least 1/2 no footprint is without a texel.",
            &[Test::value(each(EMPTY, with_k), Equal(0.0))],
        ),
        Claim::ours(
            "reference",
            "Every pixel is the f64 reference's up to the rounding of f32: coordinates, levels, counts of texels, values.",
            &[Test::value(every(UNEXPLAINED), Equal(0.0))],
        ),
        Claim::ours(
            "paper-empty",
            "As printed, without a reconstruction term, magnified footprints are without a texel.",
            &[Test::value(one(EMPTY, AS_PRINTED), Above(0.0))],
        )
        .at(Places::scenes(&["magnified"])),
    ],
};

const AS_PRINTED: &str = "as printed, rows";

const NMSE: &str = "NMSE";
const WORST: &str = "worst pixel";
const BROKEN: &str = "pixels not finite or out of range";
const UNEXPLAINED: &str = "pixels that differ from f64 by more than rounding";
const FIRST: &str = "the first of them";
const EMPTY: &str = "footprints without a texel";

const SIZE: [u32; 2] = [64, 48];

fn variants() -> Vec<(&'static str, Method)> {
    let ellipses = [
        (AS_PRINTED, Ellipse::PAPER),
        ("as printed, rows, level by the minor axis", PAPER_BY_LEVEL),
        ("corrected axes, k 0", PAPER_BY_LEVEL.axes(Axes::Corrected)),
        ("ellipse", Ellipse::BEST),
        ("ellipse, k 1/2", Ellipse::BEST.k(0.5)),
        ("ellipse, radial map of 64, 8 bits", Ellipse::BEST.map(WeightMap { bits: 8, ..RADIAL_64 })),
    ];
    let baselines = [
        ("trilinear", Baseline::Trilinear),
        ("anisotropic 16", Baseline::Anisotropic(16)),
        ("Feline 16", Baseline::Feline(16)),
        ("Mavridis 5", Baseline::Mavridis(5)),
        ("pbrt EWA", Baseline::Pbrt),
        ("stochastic 16", Baseline::Stochastic(16)),
        ("summed area", Baseline::SummedArea),
    ];
    let ellipses = ellipses.map(|(name, ellipse)| (name, Method::Ellipse(ellipse)));
    ellipses.into_iter().chain(baselines.map(|(name, baseline)| (name, Method::Baseline(baseline)))).collect()
}

/// Those with a reconstruction term of at least 1/2.
fn with_k() -> Vec<String> {
    let names = variants().into_iter().map(|(name, _)| name.to_string());
    names.filter(|name| name.starts_with(OURS)).collect()
}

fn plane_of(scene: &str) -> Plane {
    let turned = |tilt| Tilt { roll_degrees: 20.0, yaw_degrees: 35.0, ..Tilt::of(tilt) };
    match scene {
        "tilt-89.999" => turned(89.999).plane(SIZE[1]),
        "horizon" => Tilt { half_view_degrees: 20.0, ..turned(82.0) }.plane(SIZE[1]),
        // Columns left of the middle have w < 0, and one of them w = 0 at its centre.
        "behind" => Plane([[1.0, 0.25, 3.0], [0.125, 1.0, 5.0], [0.25, 0.0, 0.125]]),
        "rank-1" => Plane([[3.0, 1.0, 0.3], [1.5, 0.5, 0.7], [0.0, 0.0, 1.0]]),
        "magnified" => Tilt { texels_per_pixel: 0.02, ..turned(30.0) }.plane(SIZE[1]),
        "ratio-10000" => {
            let (sin, cos) = 0.6f64.sin_cos();
            Plane([[1000.0 * cos, -0.1 * sin, 0.3], [1000.0 * sin, 0.1 * cos, 0.7], [0.0, 0.0, 1.0]])
        }
        "far" => Tilt { texels_per_pixel: 1e5, ..turned(60.0) }.plane(SIZE[1]),
        other => panic!("{other}: no scene of this figure"),
    }
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let lab = Lab::new(&bench.gpu(&[])?, Pattern::PinkNoise, SIZE)?;
    let plane = plane_of(&cell.scene).rounded();
    let truth = lab.coarse_truth(&plane, GAUSSIAN);
    let mut rows = Vec::new();
    for (name, method) in variants() {
        let dumped = lab.dumped(&method, &plane)?;
        let seen = || dumped.iter().filter(|pixel| pixel.pixel.is_some());
        // A sampler's weights may exceed 1 together by a step of 1/256.
        let fine = |value: &f32| (-1.0 / 256.0..=1.0 + 1.0 / 256.0).contains(value);
        let broken = seen().filter(|pixel| !pixel.colour.iter().all(fine)).count();
        let number = |quantity, unit, number| Row::new(name, quantity, unit, Value::Number(number));
        rows.push(number(BROKEN, "pixels", broken as f64));
        if !subtracts(&method) {
            let found = lab.agreement(&dumped, &method, &plane);
            rows.push(number(UNEXPLAINED, "pixels", found.unexplained.len() as f64));
            let first = found.unexplained.first().cloned().unwrap_or_else(|| "none".into());
            rows.push(Row::new(name, FIRST, "", Value::Text(first)));
        }
        if matches!(method, Method::Ellipse(_)) {
            rows.push(number(EMPTY, "pixels", seen().filter(|pixel| pixel.empty).count() as f64));
        }
        let shown = lab.show(&lab.pass(&method)?, &plane, 0)?;
        let found = errors(&shown.picture, &truth)?;
        rows.push(number(NMSE, "", found.nmse));
        rows.push(number(WORST, "of white", found.worst));
    }
    Ok(rows)
}

/// In f32 the subtracted determinant of a long footprint is noise: no reference says what comes of it.
fn subtracts(method: &Method) -> bool {
    matches!(method, Method::Ellipse(ellipse) if ellipse.footprint.determinant == Determinant::Subtracting)
}
