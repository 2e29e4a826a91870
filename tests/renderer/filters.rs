//! Paper 3's ellipse on a plain texture, against its f64 reference.

use crate::scenes::{Parts, SIZE, VIEW};
use crate::{settled, silent};
use ortelius::math::weight_map::{MapShape, WeightMap};
use ortelius::paper::texture_mapping::method::{EllipseFilter, PixelCentre};
use ortelius::paper::texture_mapping::reference::ellipse::{filtered, levels};
use ortelius::picture::PixelFormat;
use ortelius::reference::filter::srgb8_to_linear;
use ortelius::reference::{ReferenceView, Sample};
use ortelius::scene::Scene;
use ortelius::texture::plain::PlainTexture;

const TEXT: &str = r#"
[surface.land]
geometry = { kind = "plane", width_m = 2000.0, height_m = 1000.0, columns = 16, rows = 8 }
filter = { kind = "ellipse", max_anisotropy = 16 }
[surface.land.texture]
kind = "plain"
path = "noise.png"
[sun]
azimuth_deg = 0.0
elevation_deg = 90.0
colour = [0.0, 0.0, 0.0]
sky = [1.0, 1.0, 1.0]
"#;

/// The scene with a texture of noise, and that texture.
fn scene(
    folder: &std::path::Path,
    [width, height]: [u32; 2],
    byte: impl Fn(u32) -> u8,
) -> (Scene, PlainTexture) {
    let path = folder.join("noise.png");
    let picture = image::RgbImage::from_fn(width, height, |x, y| {
        image::Rgb([0, 1, 2].map(|channel| byte(3 * (y * width + x) + channel)))
    });
    picture.save(&path).unwrap();
    let scene = Scene::from_text(&folder.join("plain.toml"), format!("{TEXT}{VIEW}")).unwrap();
    (scene, PlainTexture::open(&path).unwrap())
}

/// Byte `n` of the noise.
fn noise(n: u32) -> u8 {
    (n.wrapping_mul(2_654_435_761) >> 13) as u8
}

/// The colours that the ellipse may give a sample: one for each level that derivatives with an error of at most 1/256
/// can select.
fn possible(ellipse: &EllipseFilter, sample: &Sample, texture: &PlainTexture) -> Vec<[f64; 3]> {
    let [width, height] = texture.size.map(f64::from);
    let d = &sample.fine;
    let pixel = |by: f64| {
        let [[ux, uy], [vx, vy]] =
            [[d.dsdx, d.dsdy].map(|d| d * by * width), [d.dtdx, d.dtdy].map(|d| d * by * height)];
        let centre = [sample.s * width, sample.t * height];
        PixelCentre { place: [0; 2], centre, jacobian: [[ux, uy], [vx, vy]], determinant: ux * vy - uy * vx }
    };
    let coarsest = texture.levels.len() as u32 - 1;
    let [low, high] = [
        levels(ellipse, &pixel(255.0 / 256.0), coarsest)[0],
        levels(ellipse, &pixel(257.0 / 256.0), coarsest)[1],
    ];
    let colour = |level: u32| {
        let size = texture.size.map(|side| i64::from((side >> level).max(1)));
        [0, 1, 2].map(|channel| {
            let texel = |column: i64, row: i64| {
                let at = row.clamp(0, size[1] - 1) * size[0] + column.rem_euclid(size[0]);
                srgb8_to_linear(texture.levels[level as usize][4 * at as usize + channel])
            };
            filtered(ellipse, &pixel(1.0), [level, coarsest], texel).value
        })
    };
    (low..=high).map(colour).collect()
}

/// The number of covered pixels, and the number of covered pixels that are further than 5/256 from every colour that
/// `ellipse` allows.
fn beyond(scene: &Scene, texture: &PlainTexture, ellipse: &EllipseFilter) -> [usize; 2] {
    let mut renderer = settled(scene, PixelFormat::Linear32);
    let found = renderer.linear_picture().unwrap().rgba;
    silent(&renderer);
    let pose = scene.pose(0).unwrap();
    let grid = scene.surfaces["land"].grid().unwrap();
    let view = ReferenceView::new(&grid, &pose.world_to_clip(SIZE[0], SIZE[1]), pose.eye, SIZE);
    let mut counts = [0; 2];
    for (n, found) in found.iter().enumerate() {
        let (x, y) = (n as u32 % SIZE[0], n as u32 / SIZE[0]);
        let candidates = view.candidates(x, y, 1.0 / 128.0);
        let Some(sample) = view.sample(x, y) else { continue };
        if candidates.samples.len() != 1 || candidates.background {
            continue;
        }
        let error =
            |colour: &[f64; 3]| (0..3).map(|c| (f64::from(found[c]) - colour[c]).abs()).fold(0.0, f64::max);
        let min = possible(ellipse, &sample, texture).iter().map(error).fold(f64::INFINITY, f64::min);
        counts[0] += 1;
        counts[1] += usize::from(min > 5.0 / 256.0);
    }
    counts
}

#[test]
fn a_plain_texture_under_the_ellipse_is_the_f64_picture() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, texture) = scene(folder.path(), [1024, 512], noise);
    let own = EllipseFilter::BEST.max_ratio(16.0).minor_texels(2.0);
    let [covered, wrong] = beyond(&scene, &texture, &own);
    assert!(covered > 5000 && wrong == 0, "{wrong} of {covered}");
    // Near misses that must be rejected.
    for (other, min) in [(own.max_ratio(1.0), 500), (own.minor_texels(1.0), 10)] {
        let [_, wrong] = beyond(&scene, &texture, &other);
        assert!(wrong > min, "{other:?}: {wrong}");
    }
}

/// The maps are smooth: derivatives with an error of 1/256 move a texel by at most 1.5 / 256 of the ellipse's radius,
/// so by at most one entry of the two-dimensional maps. Coarse maps are compared in tests/virtual_texture, where the
/// device's derivatives are known.
#[test]
fn a_plain_texture_with_a_weight_map_is_the_f64_picture_with_that_map() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, texture) = scene(folder.path(), [1024, 512], noise);
    let own = EllipseFilter::BEST.max_ratio(16.0).minor_texels(2.0);
    let of = |shape, entries, linear| own.map(WeightMap { shape, entries, bits: 16, linear });
    for (keys, ellipse, near_miss) in [
        ("'square', map_entries=256", of(MapShape::Square, 256, false), own.minor_texels(1.0)),
        ("'quadrant', map_entries=256", of(MapShape::Quadrant, 256, false), own.minor_texels(1.0)),
        ("'radial', map_entries=4, map_linear=true", of(MapShape::Radial, 4, true), own.max_ratio(1.0)),
        ("'squared-radius', map_linear=true", of(MapShape::SquaredRadius, 64, true), own.max_ratio(1.0)),
    ] {
        let filter = format!("surface.land.filter={{kind='ellipse', max_anisotropy=16, weight_map={keys}}}");
        let scene = scene.with(&[filter]).unwrap();
        let [covered, wrong] = beyond(&scene, &texture, &ellipse);
        assert!(covered > 5000 && wrong == 0, "{keys}: {wrong} of {covered}");
        let [_, wrong] = beyond(&scene, &texture, &near_miss);
        assert!(wrong > 10, "{keys} as {near_miss:?}: {wrong}");
    }
}

/// Progressive meshes with a virtual and with a plain texture.
#[test]
fn a_weight_map_of_many_entries_shows_the_kernel_on_progressive_meshes() {
    let scene = Parts::new();
    let scene = scene.scene(&["land", "hill", "board"], "");
    let picture = |map: &str| {
        let filters = ["land", "board"].map(|name| format!("surface.{name}.filter={{kind='ellipse'{map}}}"));
        let mut renderer = settled(&scene.with(&filters).unwrap(), PixelFormat::Linear32);
        let found = renderer.linear_picture().unwrap().rgba;
        silent(&renderer);
        found
    };
    let kernel = picture("");
    let off = |map: &str| {
        let of = |(a, b): (&[f32; 4], &[f32; 4])| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
        picture(map).iter().zip(&kernel).map(of).collect::<Vec<_>>()
    };
    // Interpolated between entries 1.5 / 256 apart, exp(-2 r^2) has an error of at most h^2 / 8 x 4 = 1.7e-5, below the
    // first entry's middle of 2 (h / 2)^2 = 1.7e-5. 16 bits add 0.8e-5. The mean weight in the ellipse is 0.43, so a
    // mean of texels from 0 to 1 is off by at most 2 x 2.5e-5 / 0.43 = 1.2e-4.
    let worst =
        off(", weight_map='radial', map_entries=256, map_linear=true").into_iter().fold(0.0, f32::max);
    assert!(worst < 1.2e-4, "{worst}");
    // The near miss: four entries.
    let rough = off(", weight_map='radial', map_entries=4");
    assert!(rough.iter().filter(|off| **off > 1e-3).count() > 500);
}

/// Sides that are not powers of two, and rows beyond the texture's edge.
#[test]
fn a_constant_plain_texture_comes_out_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, _) = scene(folder.path(), [200, 77], |_| 119);
    for map in ["none", "square", "quadrant", "radial", "squared-radius"] {
        let scene = scene.with(&[format!("surface.land.filter.weight_map={map}")]).unwrap();
        let mut renderer = settled(&scene, PixelFormat::Linear32);
        let bytes = renderer.picture_bytes().unwrap();
        let mut colours: Vec<u32> =
            bytes.chunks_exact(16).map(|pixel| u32::from_le_bytes(pixel[..4].try_into().unwrap())).collect();
        colours.sort();
        colours.dedup();
        // The colours of the background and of the texture.
        assert_eq!(colours.len(), 2, "{map}: {colours:?}");
        silent(&renderer);
    }
}
