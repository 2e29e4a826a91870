//! scene.filters: paper 3's ellipse on paper 1's tiles, in shipped scenes.

use super::kernel_truth::{CoordinateMap, TexturedView};
use super::silhouettes::shows_one_piece;
use crate::figure::prelude::*;
use crate::math::camera::Pose;
use crate::model::mesh::SourceMesh;
use crate::paper::progressive_mesh;
use crate::paper::texture_mapping::method::{EllipseFilter, PixelCentre};
use crate::paper::texture_mapping::reference::ellipse::{filtered, levels};
use crate::paper::virtual_texture::reference::picture::SourceTexels;
use crate::paper::virtual_texture::texels_per_pixel;
use crate::picture::error::{Difference, compare_where};
use crate::picture::write::Srgb8Picture;
use crate::picture::{Picture, PixelFormat};
use crate::reference::filter::luminance;
use crate::reference::supersample::RADIUS_PX;
use crate::reference::supersample::{PixelKernel, Truth};
use crate::reference::{PixelTriangles, ReferenceView, ellipsoid};
use crate::renderer::truth::instances;
use crate::renderer::{Options, Renderer};
use crate::scene::Scene;
use crate::texture::source::TileSource;
use crate::vk::Gpu;
use glam::DVec4;
use std::sync::Arc;
use tempfile::TempDir;

pub const FILTERS: Figure = Figure {
    id: "scene.filters",
    title: "Filters of a virtual texture: error, tiles and time",
    about: "Paper 1 filters with up to 16 trilinear samples along the footprint (here 1, 4 or 16), paper 3 with the \
            texels of the footprint's ellipse. Three published filters are measured, too: Feline, the filter of \
            Mavridis and Papaioannou, and pbrt's EWA. The footprints of paper 3's filters are bounded at the limb of a \
            globe; `anisotropic 16, bounded limb` is paper 1's filter with this bound. All filters read texels beyond \
            a tile's border from the neighbouring tile, so the border does not change the picture. The ellipse has at \
            least one, two or four texels along its minor semi-axis. `no ramp`: texels that its edge cuts count as a \
            whole or not at all, so fewer texels are read. Scenes do not use it, because magnified texels have visible \
            edges. Of the other filters, each scene uses the fastest whose NMSE is at most 1e-3 (on the earth: 2e-4). \
            The truth is computed in f64 from the mesh: the mean of 4,232 stratified samples for each pixel (`valley`: \
            512), with two kernels: the ellipse's own, a Gaussian with sigma 0.5 pixels cut at one pixel, and a box of \
            one pixel. For `globe` the mesh is replaced by the ellipsoid, which is less than a hundredth of a pixel \
            away. For each pixel, the samples read one level: the coarsest in which the shorter side of every \
            footprint around the pixel still has 8 texels. Averaging and interpolating this level's texels adds 2 % to \
            the kernel's variance. \"One exact ellipse\" is the ellipse with two texels in f64 with the exact \
            gradient. It shows the error of using one ellipse per pixel on a curved surface. NMSE is of luminance, \
            over the pixels whose kernel lies wholly on one piece of the textured surface. A second NMSE is of the \
            pixels whose kernel is partly beyond the limb or the horizon; the truth is the mean of the part on the \
            surface. On `valley`, which is shown unlit, kernels at ridges show two pieces, one behind the other; the \
            NMSE with silhouettes counts these pixels, too. Times are of a settled frame. Pictures have 96 x 54 \
            (quick) or 320 x 180 pixels, where passes of fixed cost outweigh the filter. Therefore the texturing pass \
            is also timed at 320 x 180 (quick runs on a software device) or 1280 x 720 pixels, and its time is divided \
            by the number of pixels. Pictures of `valley` have 640 x 360 pixels, because in a smaller picture a pixel \
            would be larger than a slope. An instrumented shader counts the texels that the filter fetches per covered \
            pixel.",
    scenes: &["earth/oblique", "globe/africa", "plane/tilted", "valley/massif"],
    variants: || {
        let shown = VARIANTS.iter().map(|(name, ..)| (*name).to_string());
        shown.chain([EXACT, FLOOR].map(str::to_owned)).collect()
    },
    show: Show::scenes(&[]).variants(|| VARIANTS.map(|(name, changes)| Setting::new(name, changes.iter().copied())).into()),
    measure,
    plots: &[
        Plot::bars(NMSE).log_y().floor(FLOOR),
        Plot::bars(BOX).log_y().floor(FLOOR),
        Plot::bars(OUTLINE).log_y().floor(FLOOR),
        Plot::bars(CUT).log_y().floor(FLOOR),
        Plot::bars(SILHOUETTES).log_y().floor(FLOOR),
        Plot::bars(TILES),
        Plot::bars(TIME).log_y().floor("empty pass"),
        Plot::bars(TEXTURING).log_y(),
        Plot::bars(TEXELS).log_y(),
    ],
    claims: &[
        Claim::ours(
            "default",
            "The filter of the shipped scene has an NMSE of at most 1e-3.",
            &[Test::value(one(NMSE, OWN), AtMost(1e-3))],
        ),
        Claim::ours(
            "limb",
            "Within 3 pixels of the outline, the filter of the shipped scene has an NMSE of at most 1e-3.",
            &[Test::value(one(OUTLINE, OWN), AtMost(1e-3))],
        ),
        Claim::ours(
            "limb-of-the-globe",
            "Within 3 pixels of the globe's outline, the NMSE of the ellipse with 2 texels is at most 1.1 times that \
             of one f64 ellipse per pixel with the ellipsoid's exact gradient. So facets and f32 add little to the \
             error of an ellipse where the surface curves away within a pixel.",
            &[Test::ratio_of(OUTLINE, [TWO, EXACT], AtMost(1.1))],
        )
        .at(Places::scenes(&["globe/africa"])),
        Claim::ours(
            "limb-of-paper-1",
            "Where the globe's limb cuts a pixel's kernel, the bound at least halves the NMSE of paper 1's filter.",
            &[Test::ratio_of(CUT, [BOUNDED, SIXTEEN], AtMost(0.5))],
        )
        .at(Places::scenes(&["globe/africa"])),
        Claim::ours(
            "faster-on-the-earth",
            "Filters that are faster than that of the scene `earth` have an NMSE of more than 2e-4.",
            &[
                Test::value(one(NMSE, SIXTEEN), Above(2e-4)),
                Test::value(one(NMSE, ONE), Above(2e-4)),
            ],
        )
        .at(Places::scenes(&["earth/oblique"])),
        Claim::ours(
            "faster-on-the-globe",
            "Filters that are faster than that of the scene `globe` have an NMSE of more than 1e-3.",
            &[
                Test::value(one(NMSE, FOUR), Above(1e-3)),
                Test::value(one(NMSE, SIXTEEN), Above(1e-3)),
            ],
        )
        .at(Places::scenes(&["globe/africa"])),
        Claim::ours(
            "faster-in-the-valley",
            "Paper 1's filter, which is faster than that of the scene `valley`, has an NMSE of more than 1e-3.",
            &[Test::value(one(NMSE, SIXTEEN), Above(1e-3))],
        )
        .at(Places::scenes(&["valley/massif"])),
        Claim::ours(
            "faster-on-the-plane",
            "One trilinear sample, which is faster than the filter of the scene `plane`, has an NMSE of more than \
             1e-3.",
            &[Test::value(one(NMSE, TRILINEAR), Above(1e-3))],
        )
        .at(Places::scenes(&["plane/tilted"])),
        Claim::ours(
            "oblique",
            "The filter of the scene `earth` has an NMSE of at most 2e-4 on the oblique view.",
            &[Test::value(one(NMSE, OWN), AtMost(2e-4))],
        )
        .at(Places::scenes(&["earth/oblique"])),
        Claim::ours(
            "nearer",
            "Against its own kernel, the Gaussian, the ellipse has a smaller NMSE than one trilinear sample and than \
             anisotropic 16.",
            &[
                Test::ratio_of(NMSE, [TWO, TRILINEAR], Below(1.0)),
                Test::ratio_of(NMSE, [TWO, SIXTEEN], Below(1.0)),
            ],
        ),
        Claim::ours(
            "nearer-to-a-box",
            "Against a box, too, the ellipse has a smaller NMSE than anisotropic 16.",
            &[Test::ratio_of(BOX, [TWO, SIXTEEN], Below(1.0))],
        ),
    ],
    ..Figure::BASE
};

const ONE: &str = "ellipse, 1 texel";
const TWO: &str = "ellipse, 2 texels";
const OWN: &str = "the scene's own";
const TRILINEAR: &str = "trilinear";
const FOUR: &str = "anisotropic 4";
const SIXTEEN: &str = "anisotropic 16";
const BOUNDED: &str = "anisotropic 16, bounded limb";
const EXACT: &str = "one exact ellipse";
const FLOOR: &str = "the truth's own error";

const NMSE: &str = "NMSE";
const BOX: &str = "NMSE against a box";
const OUTLINE: &str = "NMSE at the outline";
const CUT: &str = "NMSE of pixels that the outline cuts";
const SILHOUETTES: &str = "NMSE with silhouettes";
const WORST: &str = "worst pixel";
const TILES: &str = "visible tiles";
const TIME: &str = "frame";
const TEXTURING: &str = "texturing, per pixel of the picture";
/// The texel counts that are reported beside [`TIME`] and [`TEXTURING`].
const TEXELS: &str = "texels fetched per pixel";
const TEXELS_OF_TEXTURING: &str = "texels fetched per pixel, larger picture";

/// Each variant's name, and its changes to the scene.
const VARIANTS: [(&str, &[&str]); 14] = [
    (TRILINEAR, &["surface.land.filter={max_anisotropy=1}"]),
    (FOUR, &["surface.land.filter={max_anisotropy=4}"]),
    (SIXTEEN, &["surface.land.filter={max_anisotropy=16}"]),
    (BOUNDED, &["surface.land.filter={max_anisotropy=16, limb='bounded'}"]),
    (ONE, &[ELLIPSE, "surface.land.filter.minor_texels=1"]),
    (
        "ellipse, 1 texel, no ramp",
        &[ELLIPSE, "surface.land.filter.minor_texels=1", "surface.land.filter.edge=none"],
    ),
    (TWO, &[ELLIPSE]),
    ("ellipse, 2 texels, no ramp", &[ELLIPSE, "surface.land.filter.edge=none"]),
    ("ellipse, 4 texels", &[ELLIPSE, "surface.land.filter.minor_texels=4"]),
    ("ellipse, 2 texels, no border", &[ELLIPSE, "surface.land.texture.border=0"]),
    ("Feline, 16 probes", &["surface.land.filter={kind='feline', max_anisotropy=16}"]),
    ("Mavridis, 4 taps", &["surface.land.filter={kind='mavridis', max_anisotropy=4}"]),
    ("pbrt's EWA", &["surface.land.filter={kind='pbrt'}"]),
    (OWN, &[]),
];

const ELLIPSE: &str = "surface.land.filter={kind='ellipse', max_anisotropy=16}";

/// Moves the herd of `valley` behind the camera.
const BEHIND: &str = "surface.herd.geometry.north_m=-45000.0";

/// Width of the outline band. On a sphere, only footprints this close to the limb reach beyond it.
const OUTLINE_PIXELS: u32 = 3;

const KERNELS: [(&str, PixelKernel); 2] = [(NMSE, PixelKernel::GAUSSIAN), (BOX, PixelKernel::Box)];

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (scene, camera) = cell.scene.split_once('/').context("SCENE/CAMERA")?;
    let scene = Scene::embedded(scene)?;
    // In a smaller picture, the pixels of `valley` are larger than its slopes.
    let (size, strata) = match scene.name.as_str() {
        "valley" => ([640, 360], 16),
        _ => (bench.effort_of([96, 54], [320, 180]), 46),
    };
    let pose = scene.camera(camera)?.pose();
    let gpu = bench.gpu(&[])?;
    let subject = Subject::new(scene, &pose, size)?;
    let mut shown = settled(&gpu, &subject.scene, &pose, size, VARIANTS)?;
    let view = ReferenceView::new(&subject.mesh, &pose.world_to_clip(size[0], size[1]), pose.eye, size);
    let dense = PixelTriangles::new(&view);
    // The truth needs the gradients of the curved surface, which differ from those of its facets.
    let surface: Box<CoordinateMap> = match subject.scene.name.as_str() {
        "globe" => on_ellipsoid(&pose, size),
        _ => Box::new(|x, y| dense.coordinate(x, y)),
    };
    let (source, samples) = (&*source_of(&shown[0].1), view.samples());
    let seen = TexturedView { source, size, samples: &samples, surface: &surface, strata };
    let truths = KERNELS.map(|(quantity, kernel)| (quantity, seen.truth(kernel)));
    let own = &truths[0].1;
    let is_inside: Vec<bool> = match subject.hides_itself() {
        true => shows_one_piece(&dense, &subject.mesh, size, RADIUS_PX),
        false => samples.iter().map(Option::is_some).collect(),
    };
    let counts: Vec<bool> =
        own.whole.iter().zip(&is_inside).map(|(whole, inside)| *whole && *inside).collect();
    let near = counts.iter().zip(outline(&is_inside, size)).map(|(counts, near)| *counts && near).collect();
    let silhouettes = subject.hides_itself().then(|| (SILHOUETTES, own.whole.clone()));
    let cut = own.whole.iter().zip(&samples).map(|(whole, sample)| !whole && sample.is_some()).collect();
    let parts = [(NMSE, counts.clone()), (OUTLINE, near), (CUT, cut)];
    let parts = Vec::from_iter(parts.into_iter().chain(silhouettes));
    let floor =
        |(quantity, counts): &(_, Vec<bool>)| Row::number(FLOOR, *quantity, "", own.own_nmse_where(counts));
    let mut rows: Vec<Row> = parts.iter().map(floor).collect();
    rows.push(Row::number(FLOOR, BOX, "", truths[1].1.own_nmse_where(&counts)));
    let exact = exact_ellipses(source, &surface, size)?;
    rows.extend(errors(EXACT, &exact, own, &parts)?);
    for (name, renderer) in &mut shown {
        let picture = renderer.linear_picture()?;
        rows.extend(errors(name, &picture, own, &parts)?);
        rows.push(Row::number(*name, BOX, "", error(&picture, &truths[1].1, &counts)?.nmse()));
        let worst = error(&picture, own, &counts)?.largest();
        rows.push(Row::number(*name, WORST, "linear light", worst));
        let record = renderer.records.last().and_then(|record| record.texture.as_ref());
        let tiles = record.context("a settled frame has a record")?.visible.len();
        rows.push(Row::number(*name, TILES, "tiles", tiles as f64));
        rows.push(texels(name, TEXELS, renderer)?);
        let file =
            format!("scene.filters-{}-{}", cell.scene.replace('/', "-"), name.replace([' ', ',', '\''], "-"));
        bench.picture(&file, &Srgb8Picture::from(&picture))?;
    }
    rows.extend(bench.times(&gpu, contenders(&mut shown, &pose), TIME)?);
    drop(shown);
    rows.extend(texturing(bench, &gpu, &subject.scene, &pose)?);
    Ok(rows)
}

/// What the figure shows of a scene.
struct Subject {
    scene: Scene,
    /// The surface with the virtual texture, in world space.
    mesh: SourceMesh,
    /// The temporary folder with the file of a progressive mesh.
    folder: Option<TempDir>,
}

impl Subject {
    /// For a mesh, the sun's light and the herd are left out, so that the picture and the truth differ only in the
    /// filtering of the texture.
    fn new(scene: Scene, pose: &Pose, size: [u32; 2]) -> anyhow::Result<Subject> {
        let land = scene.surfaces.get("land").context("the figure's scenes have a surface `land`")?;
        if let Some(mesh) = land.grid() {
            return Ok(Subject { scene, mesh, folder: None });
        }
        let models = progressive_mesh::load(&scene)?;
        let model = models.iter().find(|model| model.name == "land").context("`land` is a mesh")?;
        let (mesh, _) =
            instances(model, pose, size, model.surface.error_pixels).map_err(anyhow::Error::msg)?;
        // Each variant opens the scene. The mesh is read from a file, because building it again each time is slow.
        let folder = tempfile::tempdir()?;
        let file = folder.path().join("land.pmesh");
        model.mesh.write(&file)?;
        let source = format!("surface.land.geometry.source={:?}", file.display().to_string());
        let changes = ["surface.land.lit=false", BEHIND, &source].map(str::to_owned);
        let scene = scene.with(&changes)?;
        Ok(Subject { scene, mesh, folder: Some(folder) })
    }

    /// A sphere or a plane never has one visible part in front of another.
    fn hides_itself(&self) -> bool {
        self.folder.is_some()
    }
}

/// The time of the texturing pass, in pictures large enough that it outweighs the passes of fixed cost.
fn texturing(bench: &mut Bench, gpu: &Gpu, scene: &Scene, pose: &Pose) -> anyhow::Result<Vec<Row>> {
    let size = bench.timed_size(gpu, [320, 180], [1280, 720]);
    let compared = |(name, _): &(&str, &[&str])| [TRILINEAR, SIXTEEN, OWN].contains(name);
    let variants = VARIANTS.into_iter().filter(compared);
    let mut shown = settled(gpu, scene, pose, size, variants)?;
    let counts = shown.iter().map(|(name, renderer)| texels(name, TEXELS_OF_TEXTURING, renderer));
    let counts = counts.collect::<anyhow::Result<Vec<_>>>()?;
    let timed = bench.interleave(gpu, contenders(&mut shown, pose))?;
    let per_pixel = 1e6 / (f64::from(size[0]) * f64::from(size[1]));
    let row = |timed: &Timed| {
        let rounds: Vec<f64> = timed.pass_of_rounds("texturing")?.iter().map(|ms| ms * per_pixel).collect();
        Some(Row::of_rounds(&timed.variant, TEXTURING, "ns", Some(rounds)))
    };
    Ok(timed.iter().filter_map(row).chain(counts).collect())
}

/// The texels that a settled renderer's filter fetches per covered pixel.
fn texels(name: &str, quantity: &str, renderer: &Renderer) -> anyhow::Result<Row> {
    let texture =
        renderer.technique.texture.as_ref().context("the figure's scenes have a virtual texture")?;
    let filter = texture.settings.config.filter;
    let fetched = texture.texels_fetched(&renderer.gpu, renderer.target(), &filter)?;
    Ok(Row::number(name, quantity, "texels", texels_per_pixel(&fetched)))
}

/// One frame of each renderer.
fn contenders<'a>(shown: &'a mut [(&'static str, Renderer)], pose: &'a Pose) -> Vec<Contender<'a>> {
    let contender = |(name, renderer): &'a mut (&'static str, Renderer)| {
        Contender::new(*name, move || {
            renderer.frame(pose)?;
            renderer.drain()?;
            Ok(renderer.records.last().context("a drained frame has a record")?.passes.clone())
        })
    };
    shown.iter_mut().map(contender).collect()
}

/// The settled renderers of variants.
fn settled(
    gpu: &Gpu,
    scene: &Scene,
    pose: &Pose,
    size: [u32; 2],
    variants: impl IntoIterator<Item = (&'static str, &'static [&'static str])>,
) -> anyhow::Result<Vec<(&'static str, Renderer)>> {
    let open = |(name, changes): (&'static str, &[&str])| {
        let changes: Vec<String> = changes.iter().map(|change| (*change).to_string()).collect();
        let options = Options {
            target: PixelFormat::Linear32,
            size: Some(size),
            deterministic: true,
            ..Options::default()
        };
        let mut renderer = Renderer::on(gpu, &scene.with(&changes)?, &options)?;
        renderer.settle(pose)?;
        renderer.drain()?;
        Ok((name, renderer))
    };
    variants.into_iter().map(open).collect()
}

/// The errors of a picture over several sets of pixels, one error for each set.
fn errors(
    name: &str,
    picture: &Picture,
    truth: &Truth,
    parts: &[(&'static str, Vec<bool>)],
) -> anyhow::Result<Vec<Row>> {
    let of = |(quantity, counts): &(&'static str, Vec<bool>)| {
        Ok(Row::number(name, *quantity, "", error(picture, truth, counts)?.nmse()))
    };
    parts.iter().map(of).collect()
}

fn on_ellipsoid(pose: &Pose, [width, height]: [u32; 2]) -> Box<CoordinateMap<'_>> {
    let to_world = pose.world_to_clip(width, height).inverse();
    Box::new(move |x, y| {
        let [x, y] = [2.0 * x / f64::from(width) - 1.0, 2.0 * y / f64::from(height) - 1.0];
        let near = to_world * DVec4::new(x, y, 1.0, 1.0);
        ellipsoid::coordinate(pose.eye.to_array(), (near.truncate() / near.w).to_array())
    })
}

fn source_of(shown: &Renderer) -> Arc<dyn TileSource> {
    shown.technique.texture.as_ref().expect("the figure's scenes have a virtual texture").source.clone()
}

/// The ellipse with two texels in f64, with the exact gradient of the surface in each pixel's centre.
fn exact_ellipses(
    source: &dyn TileSource,
    surface: &CoordinateMap<'_>,
    size: [u32; 2],
) -> anyhow::Result<Picture> {
    let (pyramid, texels) = (source.pyramid(), SourceTexels::new(source));
    let [columns, rows] = pyramid.level_size(0).map(f64::from);
    let ellipse = EllipseFilter::BEST.max_ratio(16.0).minor_texels(2.0).within(pyramid.tile_size() / 2);
    let texture = texels.texture();
    let pixel = |x: f64, y: f64| -> Option<[f32; 4]> {
        const STEP: f64 = 1e-4;
        let gradient = |[dx, dy]: [f64; 2]| {
            let (before, after) = (surface(x - dx, y - dy)?, surface(x + dx, y + dy)?);
            let east = after[0] - before[0];
            // The shorter way around the planet.
            Some([columns * (east - east.round()), rows * (after[1] - before[1])].map(|d| d / (2.0 * STEP)))
        };
        let [s, t] = surface(x, y)?;
        let ([ux, vx], [uy, vy]) = (gradient([STEP, 0.0])?, gradient([0.0, STEP])?);
        let jacobian = [[ux, uy], [vx, vy]];
        let centre = [s * columns, t * rows];
        let pixel = PixelCentre { place: [0; 2], centre, jacobian, determinant: ux * vy - uy * vx };
        let coarsest = pyramid.coarsest_level();
        let [level, _] = levels(&ellipse, &pixel, coarsest);
        let colour = [0, 1, 2].map(|channel| {
            let texel = |column, row| texture.texel_at(level, column, row)[channel];
            filtered(&ellipse, &pixel, [level, coarsest], texel).value as f32
        });
        Some([colour[0], colour[1], colour[2], 1.0])
    };
    let centres = (0..size[0] * size[1]).map(|n| [n % size[0], n / size[0]].map(|at| f64::from(at) + 0.5));
    let rgba = centres.map(|[x, y]| pixel(x, y).unwrap_or([0.0; 4])).collect();
    texels.check()?;
    Ok(Picture::new(size[0], size[1], rgba))
}

/// The luminance error over the pixels for which `counts` is true.
fn error(picture: &Picture, truth: &Truth, counts: &[bool]) -> anyhow::Result<Difference> {
    let grey = |value: f64| [value as f32, value as f32, value as f32, 1.0];
    let [width, height] = truth.size;
    let exact = Picture::new(width, height, truth.values.iter().map(|&value| grey(value)).collect());
    let of = |[r, g, b, _]: &[f32; 4]| grey(luminance([r, g, b].map(|channel| f64::from(*channel))));
    let found = Picture::new(width, height, picture.rgba.iter().map(of).collect());
    Ok(compare_where(&found, &exact, |x, y| counts[(y * width + x) as usize])?)
}

/// True for pixels at most [`OUTLINE_PIXELS`] from a pixel that is not inside.
fn outline(is_inside: &[bool], [width, height]: [u32; 2]) -> Vec<bool> {
    let near = |at: u32, end: u32| at.saturating_sub(OUTLINE_PIXELS)..(at + OUTLINE_PIXELS + 1).min(end);
    let beyond = |x: u32, y: u32| !is_inside[(y * width + x) as usize];
    let of = |n: u32| {
        let [x, y] = [n % width, n / width];
        near(y, height).any(|y| near(x, width).any(|x| beyond(x, y)))
    };
    (0..width * height).map(of).collect()
}
