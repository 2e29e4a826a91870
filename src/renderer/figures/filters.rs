//! scene.filters: paper 3's ellipse on paper 1's tiles, in shipped scenes.

use crate::figure::claim::{Bound::AtMost, Bound::Below, Claim, Places, Test, one};
use crate::figure::{Bench, Cell, Contender, Figure, Plot, Row, Timed};
use crate::math::camera::Pose;
use crate::math::pyramid::Pyramid;
use crate::paper::texture_mapping::method::{Ellipse, PixelCentre};
use crate::paper::texture_mapping::reference::ellipse::{filtered, levels};
use crate::paper::virtual_texture::VirtualTextureSettings;
use crate::paper::virtual_texture::config::source_mesh;
use crate::paper::virtual_texture::reference::picture::{Texels, sides};
use crate::picture::error::{Difference, compare_where};
use crate::picture::write::Srgb8Picture;
use crate::picture::{Picture, PixelFormat};
use crate::reference::filter::{Edges, MipPyramid, srgb8_to_linear};
use crate::reference::supersample::{Density, Kernel, Truth, supersample};
use crate::reference::{ReferenceView, Sample, ellipsoid};
use crate::renderer::{Options, Renderer};
use crate::scene::Scene;
use crate::texture::source::TileSource;
use crate::vk::Gpu;
use anyhow::Context;
use glam::DVec4;
use std::collections::BTreeMap;
use std::sync::OnceLock;

pub const FILTERS: Figure = Figure {
    id: "scene.filters",
    title: "Filters of a virtual texture: error, tiles and time",
    about: "Paper 1 filters with up to 16 trilinear samples along the footprint (here 1, 4 or 16), paper 3 with the \
            texels of the footprint's ellipse. Both read texels beyond a tile's border from the neighbouring tile, so \
            the border does not change the picture. The ellipse has at least one, two or four texels along its minor \
            semi-axis. Each scene uses the fewest that give an NMSE of at most 1e-3, on the earth 2e-4. The truth is \
            the f64 mean of 4,232 stratified samples per pixel of the mesh, with two kernels: the ellipse's own, a \
            Gaussian with sigma 0.5 pixels cut at one pixel, and a box of one pixel. For `globe` the mesh is replaced by \
            the ellipsoid, which is less than a hundredth of a pixel away. The samples read the coarsest \
            level that has 8 texels across the shorter side of every footprint of a row; averaging and interpolating \
            its texels adds 2 % to the kernel's variance. \"One exact ellipse\" is the scene's filter in f64 with the \
            exact gradient: the error that an ellipse leaves on a curved surface. NMSE is of luminance, over the \
            pixels whose kernel lies wholly on the textured surface. Times are of a settled frame. Pictures have 96 x 54 (quick) or 320 x 180 \
            pixels, where passes of fixed cost outweigh the filter. The time of the pass that textures is therefore \
            also measured with 320 x 180 (quick) or 1280 x 720 pixels and divided by their number.",
    scenes: &["earth/oblique", "globe/africa", "plane/tilted"],
    variants: || {
        let shown = VARIANTS.iter().map(|(name, ..)| (*name).to_string());
        shown.chain([EXACT, FLOOR].map(str::to_owned)).collect()
    },
    measure,
    plots: &[
        Plot::bars(NMSE).log_y().floor(FLOOR),
        Plot::bars(BOX).log_y().floor(FLOOR),
        Plot::bars(TILES),
        Plot::bars(TIME).log_y().floor("empty pass"),
        Plot::bars(TEXTURING).log_y(),
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
        )
        .at(Places::scenes(&["earth/oblique", "plane/tilted"])),
        Claim::ours(
            "limb-of-the-globe",
            "Within 3 pixels of the globe's outline, the filter's NMSE is at most 4e-3, and at most 1.1 times that of one \
             f64 ellipse with the ellipsoid's exact gradient: the error is not the facets', but that of any one ellipse \
             where the surface curves away within a pixel.",
            &[
                Test::value(one(OUTLINE, OWN), AtMost(4e-3)),
                Test::ratio(one(OUTLINE, OWN), one(OUTLINE, EXACT), AtMost(1.1)),
            ],
        )
        .at(Places::scenes(&["globe/africa"])),
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
                Test::ratio(one(NMSE, TWO), one(NMSE, TRILINEAR), Below(1.0)),
                Test::ratio(one(NMSE, TWO), one(NMSE, SIXTEEN), Below(1.0)),
            ],
        ),
        Claim::ours(
            "nearer-to-a-box",
            "Against a box, too, the ellipse has a smaller NMSE than anisotropic 16.",
            &[Test::ratio(one(BOX, TWO), one(BOX, SIXTEEN), Below(1.0))],
        ),
    ],
    ..Figure::BASE
};

const TWO: &str = "ellipse, 2 texels";
const OWN: &str = "the scene's own";
const TRILINEAR: &str = "trilinear";
const SIXTEEN: &str = "anisotropic 16";
const EXACT: &str = "one exact ellipse";
const FLOOR: &str = "the truth's own error";

const NMSE: &str = "NMSE";
const BOX: &str = "NMSE against a box";
const OUTLINE: &str = "NMSE at the outline";
const WORST: &str = "worst pixel";
const TILES: &str = "visible tiles";
const TIME: &str = "frame";
const TEXTURING: &str = "texturing, per pixel of the picture";

/// Each variant's name, and its changes to the scene.
const VARIANTS: [(&str, &[&str]); 8] = [
    (TRILINEAR, &["surface.land.filter={max_anisotropy=1}"]),
    ("anisotropic 4", &["surface.land.filter={max_anisotropy=4}"]),
    (SIXTEEN, &["surface.land.filter={max_anisotropy=16}"]),
    ("ellipse, 1 texel", &[ELLIPSE, "surface.land.filter.minor_texels=1"]),
    (TWO, &[ELLIPSE]),
    ("ellipse, 4 texels", &[ELLIPSE, "surface.land.filter.minor_texels=4"]),
    ("ellipse, 2 texels, no border", &[ELLIPSE, "surface.land.texture.border=0"]),
    (OWN, &[]),
];

const ELLIPSE: &str = "surface.land.filter={kind='ellipse', max_anisotropy=16}";

/// Width of the outline band. At a sphere's limb, only footprints this close to the edge are cut off.
const OUTLINE_PIXELS: u32 = 3;

const KERNELS: [(&str, Kernel); 2] = [(NMSE, Kernel::GAUSSIAN), (BOX, Kernel::Box)];

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let (scene, camera) = cell.scene.split_once('/').context("SCENE/CAMERA")?;
    let scene = Scene::embedded(scene)?;
    let (pose, size) = (scene.camera(camera)?.pose(), bench.effort_of([96, 54], [320, 180]));
    let gpu = bench.gpu(&[])?;
    let mut shown = settled(&gpu, &scene, &pose, size, VARIANTS)?;
    let view =
        ReferenceView::new(&source_mesh(&scene)?, &pose.world_to_clip(size[0], size[1]), pose.eye, size);
    // Of the globe's mesh, 9,000 triangles would be tested for each sample.
    let surface: Box<Surface> = match scene.name.as_str() {
        "globe" => on_ellipsoid(&pose, size),
        _ => Box::new(|x, y| view.coordinate(x, y)),
    };
    let truths = KERNELS.map(|(quantity, kernel)| (quantity, truth(&shown[0].1, &view, &surface, kernel)));
    let own = &truths[0].1;
    let near = own.whole.iter().zip(outline(&view)).map(|(whole, near)| *whole && near).collect();
    let parts = [(NMSE, own.whole.clone()), (OUTLINE, near)];
    let mut rows: Vec<Row> =
        truths.iter().map(|(quantity, truth)| Row::number(FLOOR, *quantity, "", truth.own_nmse)).collect();
    let exact = exact_ellipses(&shown[0].1, &scene, &surface, size)?;
    rows.extend(errors(EXACT, &exact, own, &parts)?);
    for (name, renderer) in &mut shown {
        let picture = renderer.linear_picture()?;
        rows.extend(errors(name, &picture, own, &parts)?);
        let (quantity, truth) = &truths[1];
        rows.push(Row::number(*name, *quantity, "", error(&picture, truth, &truth.whole)?.nmse()));
        let worst = error(&picture, own, &own.whole)?.worst().map_or(0.0, |worst| worst.value);
        rows.push(Row::number(*name, WORST, "linear light", worst));
        let record = renderer.records.last().and_then(|record| record.texture.as_ref());
        let tiles = record.context("a settled frame has a record")?.visible.len();
        rows.push(Row::number(*name, TILES, "tiles", tiles as f64));
        let file =
            format!("scene.filters-{}-{}", cell.scene.replace('/', "-"), name.replace([' ', ',', '\''], "-"));
        bench.picture(&file, &Srgb8Picture::from(&picture))?;
    }
    let timed = bench.interleave(&gpu, contenders(&mut shown, &pose))?;
    rows.extend(timed.iter().map(|timed| timed.row(TIME)));
    drop(shown);
    rows.extend(texturing(bench, &gpu, &scene, &pose)?);
    Ok(rows)
}

/// The time of the pass that textures, where it outweighs passes of fixed cost.
fn texturing(bench: &mut Bench, gpu: &Gpu, scene: &Scene, pose: &Pose) -> anyhow::Result<Vec<Row>> {
    let size = bench.effort_of([320, 180], [1280, 720]);
    let compared = |(name, _): &(&str, &[&str])| [TRILINEAR, SIXTEEN, OWN].contains(name);
    let variants = VARIANTS.into_iter().filter(compared);
    let mut shown = settled(gpu, scene, pose, size, variants)?;
    let timed = bench.interleave(gpu, contenders(&mut shown, pose))?;
    let per_pixel = 1e6 / (f64::from(size[0]) * f64::from(size[1]));
    let row = |timed: &Timed| {
        let rounds: Vec<f64> = timed.pass_of_rounds("texturing")?.iter().map(|ms| ms * per_pixel).collect();
        Some(Row::of_rounds(&timed.variant, TEXTURING, "ns", Some(rounds)))
    };
    Ok(timed.iter().filter_map(row).collect())
}

/// One frame of each renderer.
fn contenders<'a>(shown: &'a mut [(&'static str, Renderer)], pose: &'a Pose) -> Vec<Contender<'a>> {
    let contender = |(name, renderer): &'a mut (&'static str, Renderer)| {
        let run = move || -> anyhow::Result<_> {
            renderer.frame(pose)?;
            renderer.drain()?;
            Ok(renderer.records.last().context("a drained frame has a record")?.passes.clone())
        };
        Contender { variant: name.to_string(), run: Box::new(run) }
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

/// The errors of a picture, each over its own pixels.
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

/// Texture coordinates at a position of the picture, in pixels from the upper left corner.
type Surface<'a> = dyn Fn(f64, f64) -> Option<[f64; 2]> + Sync + 'a;

fn on_ellipsoid(pose: &Pose, [width, height]: [u32; 2]) -> Box<Surface<'_>> {
    let to_world = pose.world_to_clip(width, height).inverse();
    Box::new(move |x, y| {
        let [x, y] = [2.0 * x / f64::from(width) - 1.0, 2.0 * y / f64::from(height) - 1.0];
        let near = to_world * DVec4::new(x, y, 1.0, 1.0);
        ellipsoid::coordinate(pose.eye.to_array(), (near.truncate() / near.w).to_array())
    })
}

/// The scene's filter in f64, with the exact gradient of the surface in each pixel's centre.
fn exact_ellipses(
    shown: &Renderer,
    scene: &Scene,
    surface: &Surface<'_>,
    size: [u32; 2],
) -> anyhow::Result<Picture> {
    let source =
        &*shown.technique.texture.as_ref().expect("the figure's scenes have a virtual texture").source;
    let (pyramid, texels) = (source.pyramid(), Texels::new(source));
    let [columns, rows] = pyramid.level_size(0).map(f64::from);
    let filter = VirtualTextureSettings::of_scene(scene, PixelFormat::Linear32)?.config.filter;
    let ellipse = Ellipse::BEST
        .most_ratio(filter.max_anisotropy as f32)
        .minor_texels(filter.minor_texels as f32)
        .within(pyramid.tile_size() / 2);
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

/// Luminance of linear light (ITU-R BT.709).
fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Each row of pixels has its own level: near a horizon, the foreground's level would need thousands of tiles.
fn truth(shown: &Renderer, view: &ReferenceView, surface: &Surface<'_>, kernel: Kernel) -> Truth {
    let source =
        &*shown.technique.texture.as_ref().expect("the figure's scenes have a virtual texture").source;
    let (samples, [width, height]) = (view.samples(), view.size());
    let mut levels: BTreeMap<u32, Level> = BTreeMap::new();
    let mut all = EMPTY;
    let (mut error, mut square) = (0.0, 0.0);
    for y in 0..height {
        // The kernels reach one pixel.
        let rows = y.saturating_sub(1) * width..(y + 2).min(height) * width;
        let level = finest_needed(&samples[rows.start as usize..rows.end as usize], &source.pyramid());
        let level = levels.entry(level).or_insert_with(|| Level::new(source, level));
        let row = truth_of_row(level, [width, y], surface, kernel);
        let squares: f64 = row.values.iter().map(|value| value * value).sum();
        error += row.own_nmse * squares;
        square += squares;
        all.values.extend(row.values);
        all.whole.extend(row.whole);
        all.most_samples = all.most_samples.max(row.most_samples);
        all.mean_samples += row.mean_samples / f64::from(height);
    }
    Truth { size: [width, height], own_nmse: if error == 0.0 { 0.0 } else { error / square }, ..all }
}

const EMPTY: Truth = Truth {
    size: [0, 0],
    values: Vec::new(),
    whole: Vec::new(),
    own_nmse: 0.0,
    most_samples: 0,
    mean_samples: 0.0,
};

fn truth_of_row(level: &Level<'_>, [columns, row]: [u32; 2], surface: &Surface<'_>, kernel: Kernel) -> Truth {
    let texture = level.texture();
    let [width, height] = level.source.pyramid().level_size(0).map(f64::from);
    let surface = |x: f64, y: f64| surface(x, y + f64::from(row)).map(|[s, t]| [s * width, t * height]);
    let texel = |[u, v]: [f64; 2]| texture.bilinear(level.level, u / width, v / height)[0];
    // Twice, for the two halves.
    let density = Density { per_texel: 0.0, least: 46, most: 46 };
    supersample([columns, 1], surface, texel, kernel, density)
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

/// True for pixels at most [`OUTLINE_PIXELS`] from a pixel beyond the surface.
fn outline(view: &ReferenceView) -> Vec<bool> {
    let (covered, [width, height]) = (view.samples(), view.size());
    let near = |at: u32, end: u32| at.saturating_sub(OUTLINE_PIXELS)..(at + OUTLINE_PIXELS + 1).min(end);
    let beyond = |x: u32, y: u32| covered[(y * width + x) as usize].is_none();
    let of = |n: u32| {
        let [x, y] = [n % width, n / width];
        near(y, height).any(|y| near(x, width).any(|x| beyond(x, y)))
    };
    (0..width * height).map(of).collect()
}

/// The coarsest streamed level at which the shorter side of every footprint has at least 8 texels; 0 if there is none.
fn finest_needed(samples: &[Option<Sample>], pyramid: &Pyramid) -> u32 {
    let shorter = |sample: &Sample| sides(sample, pyramid).lengths()[1];
    let least = samples.iter().flatten().map(shorter).fold(f64::INFINITY, f64::min);
    ((least / 8.0).log2().floor().max(0.0) as u32).min(pyramid.first_resident_level() - 1)
}

/// A level of a tile source as luminance. Tiles are read on demand, from any thread.
struct Level<'a> {
    source: &'a dyn TileSource,
    level: u32,
    tiles: Vec<OnceLock<Vec<f32>>>,
    linear: [f64; 256],
}

impl<'a> Level<'a> {
    fn new(source: &'a dyn TileSource, level: u32) -> Level<'a> {
        let [columns, rows] = source.pyramid().tile_grid(level);
        let tiles = (0..columns * rows).map(|_| OnceLock::new()).collect();
        Level { source, level, tiles, linear: std::array::from_fn(|code| srgb8_to_linear(code as u8)) }
    }

    fn texture(&self) -> MipPyramid<impl Fn(u32, u32, u32) -> [f64; 4] + '_> {
        let pyramid = self.source.pyramid();
        let (size, [columns, _]) = (pyramid.tile_size(), pyramid.tile_grid(self.level));
        MipPyramid {
            width_log2: pyramid.width_log2(),
            height_log2: pyramid.height_log2(),
            edges: Edges::Planet,
            texel: move |_, x, y| {
                let (row, column) = (y / size, x / size);
                let tile =
                    self.tiles[(row * columns + column) as usize].get_or_init(|| self.tile(row, column));
                [f64::from(tile[((y % size) * size + x % size) as usize]), 0.0, 0.0, 1.0]
            },
        }
    }

    /// The texels of a tile without its border.
    fn tile(&self, row: u32, column: u32) -> Vec<f32> {
        let pyramid = self.source.pyramid();
        let mut bytes = vec![0; self.source.format().tile_bytes(&pyramid)];
        let tile = crate::math::pyramid::TileId { level: self.level, row, column };
        self.source.read_tile(tile, &mut bytes).expect("shipped scenes make their tiles");
        let (size, border) = (pyramid.tile_size(), pyramid.border_texels());
        let stored = pyramid.stored_sides()[0];
        let texel = |n: u32| {
            let at = 4 * ((n / size + border) * stored + n % size + border) as usize;
            luminance([0, 1, 2].map(|c| self.linear[usize::from(bytes[at + c])])) as f32
        };
        (0..size * size).map(texel).collect()
    }
}
