//! tm.23: object-space texturing against filters in the screen plane, by object area and tilt.

use super::methods::{OBJECT_SPACE, PAPER_BY_LEVEL, THESIS};
use super::shown::{ellipse_and_trilinear, tilted_boards};
use crate::figure::prelude::*;
use crate::paper::texture_mapping::baselines::FilterBaseline;
use crate::paper::texture_mapping::method::{EllipseFilter, Method};
use crate::paper::texture_mapping::object_space::pass::{ObjectSpaceBuffers, Stages};
use crate::paper::texture_mapping::object_space::{TexturedPolygons, TexturedTriangle};
use crate::paper::texture_mapping::pass::{FilterPass, Targets, Uploaded, push};
use crate::paper::texture_mapping::plane::TiltedPlane;
use crate::paper::texture_mapping::texels::GreyMipmap;
use crate::reference::pattern::Pattern;
use crate::vk::Gpu;
use crate::vk::shader::PlanePush;

pub const OBJECT_SPACE_TEXTURING: Figure = Figure {
    id: "tm.23",
    title: "Object-space texturing: time by object area and tilt",
    about: "Figure 23 of the thesis: object-space texturing is on average up to 30 % faster than anisotropic filtering \
            in the screen plane. Its time depends on neither the screen area nor the tilt, and grows with the \
            polygons' area. The object is a square of 1/f noise. At a tilt of 0 each of its texels covers one pixel. \
            It tilts back about its lower edge, which lies on the projection plane; the field of view is 6 degrees. \
            The sides are 128 (`area 1`) and 256 pixels (`area 4`) in quick runs on a software device, otherwise 512 \
            and 1024. `paper's EWA` is the thesis's filter: formula (4) with the axes from the rows of the Jacobian, \
            at the level that the minor axis selects. It runs only for the screen pixels that the square covers. A \
            fragment in object space fetches 4 texels and issues at most 4 atomics for depth and 16 for sums. Atomics \
            are counted in a separate run. The time includes all stages. A plot shows the time of `paper's EWA` \
            divided by each method's time; a line marks the thesis's 1.3.",
    scenes: &[SMALL, LARGE],
    variants: || variants().into_iter().chain([THESIS.into()]).collect(),
    paper: &[SPACING_1],
    ours: &["ellipse"],
    full_only: &[],
    sweep: Some(Sweep {
        name: "tilt, degrees",
        quick: &[0.0, 45.0, 75.0, 85.0, 89.0],
        full: &[0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 80.0, 85.0, 87.0, 89.0],
    }),
    show: Show::views(|| tilted_boards(&[0.0, 45.0, 75.0, 85.0, 89.0])).variants(ellipse_and_trilinear),
    measure,
    plots: &[
        Plot::sweep(TIME).log_y().floor("empty pass"),
        Plot::sweep(GAIN).log_y().floor(THESIS),
        Plot::sweep(TEXELS).log_y(),
        Plot::sweep(ATOMICS).log_y(),
        Plot::sweep(PER_PIXEL).log_y(),
    ],
    claims: &[
        Claim::paper_timed(
            "claim 1, figures 19 to 23",
            "30-percent",
            "In some views object-space texturing is 30 % faster than the thesis's anisotropic filter (the thesis: \
            \"on average up to 30 %\").",
            &[Test::ratio_of(TIME, [PAPERS_EWA, SPACING_1], AtLeast(THESIS_GAIN))],
        )
        .somewhere(),
        Claim::paper(
            "claim 1",
            "independent",
            "At every tilt and screen area, the number of fragments equals the object's area in pixels. Edges \
             may add or remove 3 %.",
            &[Test::value(one(PER_AREA, SPACING_1), Within(0.97, 1.03, Better::Neither))],
        ),
        Claim::paper_timed(
            "claim 1",
            "time-independent",
            "From one tilt to the next, the time of object-space texturing changes at most by a factor of \
             1.25.",
            &[Test::steps(one(TIME, SPACING_1), Within(0.8, 1.25, Better::Neither))],
        ),
        Claim::paper(
            "claim 1",
            "area",
            "An object of 4 times the area fetches 4 times as many texels.",
            &[Test::ratio(
                one(TEXELS, SPACING_1).scene(LARGE),
                one(TEXELS, SPACING_1).scene(SMALL),
                Within(3.9, 4.1, Better::Neither),
            )],
        ),
        Claim::ours(
            "no-holes",
            "Object-space texturing covers every pixel that the filter in the screen plane covers.",
            &[Test::value(each(HOLES, spacings), Equal(0.0))],
        ),
        Claim::ours(
            "overdraw",
            "At 89 degrees, where the projected square is smallest, a pixel is the mean of more than 50 fragments.",
            &[Test::value(one(PER_PIXEL, SPACING_1), Above(50.0))],
        )
        .at(Places::ALL.x(89.0, 89.0)),
    ],
};

const SMALL: &str = "area 1";
const LARGE: &str = "area 4";

const SPACING_1: &str = OBJECT_SPACE[0].0;
const PAPERS_EWA: &str = "paper's EWA";

/// "On average up to 30 % faster" than the thesis's anisotropic filter.
const THESIS_GAIN: f64 = 1.3;

const TIME: &str = "texturing";
const GAIN: &str = "time of the paper's EWA over the method's";
const TEXELS: &str = "texels fetched";
const ATOMICS: &str = "atomics";
const PER_AREA: &str = "fragments per pixel of the object";
const PER_PIXEL: &str = "fragments per pixel of the screen";
const HOLES: &str = "pixels without a fragment";

/// Texels along the texture's side.
const SIDE: u32 = 1024;

fn spacings() -> Vec<String> {
    OBJECT_SPACE.map(|(name, _)| name.to_string()).to_vec()
}

fn filters() -> [(&'static str, Method); 4] {
    [
        (PAPERS_EWA, Method::Ellipse(PAPER_BY_LEVEL)),
        ("ellipse", Method::Ellipse(EllipseFilter::BEST)),
        ("anisotropic 16", Method::Baseline(FilterBaseline::Anisotropic(16))),
        ("trilinear", Method::Baseline(FilterBaseline::Trilinear)),
    ]
}

fn variants() -> Vec<String> {
    spacings().into_iter().chain(filters().map(|(name, _)| name.to_string())).collect()
}

/// A square of `side` pixels that is tilted back about its lower edge, as polygons and as a bounded plane.
struct Square {
    side: f64,
    camera: f64,
    /// Maps (across, down, 1) on the square to (x w, y w, w) on the screen.
    to_screen: [[f64; 3]; 3],
}

impl Square {
    fn new(side: f64, tilt_degrees: f64) -> Square {
        let (sin, cos) = tilt_degrees.to_radians().sin_cos();
        let camera = side / 2.0 / 3f64.to_radians().tan();
        // w is 1 at the lower edge and grows upwards.
        let (slope, half) = (sin / camera, side / 2.0);
        let to_screen = [[1.0, 0.0, -half], [0.0, cos, -half * cos], [0.0, -slope, 1.0 + slope * side]];
        Square { side, camera, to_screen }
    }

    fn polygons(&self) -> TexturedPolygons {
        let corner = |across: f64, down: f64| {
            let [x, y, w] = self.to_screen.map(|[a, b, c]| a * across * self.side + b * down * self.side + c);
            let texels = [across * self.side, down * self.side];
            ([x, y, self.camera * (1.0 - w)].map(|c| c as f32), texels.map(|c| c as f32))
        };
        let [a, b, c, d] = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
        let triangle = |three: [([f32; 3], [f32; 2]); 3]| TexturedTriangle {
            corners: three.map(|(corner, _)| corner),
            texels: three.map(|(_, texels)| texels),
        };
        TexturedPolygons {
            triangles: vec![triangle([a, b, c]), triangle([a, c, d])],
            camera_px: self.camera as f32,
        }
    }

    fn push(&self, size: [u32; 2]) -> PlanePush {
        let [[a, b, c], [d, e, f], [g, h, i]] = self.to_screen;
        let det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
        let adjugate = [
            [e * i - f * h, c * h - b * i, b * f - c * e],
            [f * g - d * i, a * i - c * g, c * d - a * f],
            [d * h - e * g, b * g - a * h, a * e - b * d],
        ];
        let plane = TiltedPlane(adjugate.map(|row| row.map(|entry| entry / det)));
        PlanePush { low: [0.0; 2], high: [self.side as f32; 2], ..push(&plane, size, 0) }
    }
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let gpu = bench.gpu(&[])?;
    let side = bench.timed_size(&gpu, 128, 512) * if cell.scene == LARGE { 2 } else { 1 };
    let square = Square::new(f64::from(side), cell.x.context("a sweep")?);
    let size = [side + 8; 2];
    let texels = GreyMipmap::new(SIDE, Pattern::PinkNoise.texels(SIDE));
    let texture = Uploaded::new(&gpu, "object space", &texels)?;
    let targets = Targets::new(&gpu, size, false)?;
    let (stages, counting) = (Stages::new(&gpu, false)?, Stages::new(&gpu, true)?);
    let polygons = square.polygons();
    let prepare = |(name, method): &(&'static str, Method)| {
        let Method::ObjectSpace(spacing) = *method else { unreachable!("{name}") };
        Ok((*name, ObjectSpaceBuffers::new(&gpu, &polygons, spacing, size, texels.coarsest())?))
    };
    let prepared = OBJECT_SPACE.iter().map(prepare).collect::<anyhow::Result<Vec<_>>>()?;
    let pass = |(name, method): (&'static str, Method)| {
        Ok((name, FilterPass::new(&gpu, &method, texels.coarsest(), false)?))
    };
    let passes = filters().map(pass).into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    let push = square.push(size);

    let mut rows = Vec::new();
    let mut covered: Vec<usize> = Vec::new();
    for (name, pass) in &passes {
        pass.run(&gpu, &texture, &targets, &push)?;
        let colours = targets.colours(&gpu)?;
        let fetched: f64 = colours.iter().map(|pixel| f64::from(pixel[3])).sum();
        rows.push(Row::number(*name, TEXELS, "texels", fetched));
        covered = (0..colours.len()).filter(|&n| colours[n][3] > 0.0).collect();
    }
    for (name, of) in &prepared {
        counting.run(&gpu, of, &texture, &targets)?;
        rows.extend(counted(&gpu, name, of, &covered, square.side)?);
    }
    let filtered = passes
        .iter()
        .map(|(name, pass)| Contender::new(*name, || Ok(pass.run(&gpu, &texture, &targets, &push)?)));
    let splatted = prepared
        .iter()
        .map(|(name, of)| Contender::new(*name, || Ok(stages.run(&gpu, of, &texture, &targets)?)));
    let timed = bench.interleave(&gpu, filtered.chain(splatted).collect())?;
    rows.extend(timed.iter().map(|timed| timed.row(TIME)));
    rows.push(Row::number(THESIS, GAIN, "", THESIS_GAIN));
    rows.extend(Timed::gains(&timed, PAPERS_EWA, GAIN));
    rows.extend(timed.iter().filter(|one| spacings().contains(&one.variant)).flat_map(|one| one.pass_rows()));
    Ok(rows)
}

fn counted(
    gpu: &Gpu,
    name: &str,
    of: &ObjectSpaceBuffers,
    covered: &[usize],
    side: f64,
) -> anyhow::Result<Vec<Row>> {
    let (counts, sums) = (of.counts(gpu)?, of.sums(gpu)?);
    let fragments = counts.fragments as f64;
    let holes = covered.iter().filter(|&&n| sums[n][0] == 0).count();
    Ok(vec![
        Row::number(name, TEXELS, "texels", 4.0 * fragments),
        Row::number(name, ATOMICS, "atomics", counts.atomics as f64),
        Row::number(name, PER_AREA, "fragments", fragments / (side * side)),
        Row::number(name, PER_PIXEL, "fragments", fragments / covered.len() as f64),
        Row::number(name, HOLES, "pixels", holes as f64),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At the projected corners of the polygons, the homography gives the corners' texels.
    #[test]
    fn the_plane_and_the_polygons_have_the_same_texels() {
        let square = Square::new(128.0, 70.0);
        let size = [136; 2];
        let push = square.push(size);
        let of = |row: [f32; 3], at: [f64; 2]| {
            f64::from(row[0]) * at[0] + f64::from(row[1]) * at[1] + f64::from(row[2])
        };
        for triangle in square.polygons().triangles {
            for (corner, texels) in triangle.corners.iter().zip(triangle.texels) {
                let w = 1.0 - f64::from(corner[2]) / square.camera;
                let at = [0, 1].map(|c| f64::from(corner[c]) / w);
                let denominator = of(push.w_row, at);
                assert!(denominator > 0.0 && w > 0.999, "{corner:?}");
                let found = [push.u_row, push.v_row].map(|row| of(row, at) / denominator);
                let off = (0..2).map(|n| (found[n] - f64::from(texels[n])).abs()).fold(0.0, f64::max);
                assert!(off < 1e-3, "{found:?}, not {texels:?}");
            }
        }
    }
}
