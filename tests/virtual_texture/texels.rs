//! The ruler: every texel that texturing would filter is the one that the pixel's (s, t) and level require. The
//! instrumented shader counts as many texels as the f64 reference.

use crate::truth::view_of;
use crate::{bordered, device, open, pose, scene};
use ortelius::model::mesh;
use ortelius::paper::texture_mapping::method::{EllipseFilter, PixelCentre};
use ortelius::paper::texture_mapping::reference::ellipse::{levels, weights};
use ortelius::paper::virtual_texture::config::{Filter, open_texture, source_mesh, texture};
use ortelius::paper::virtual_texture::reference::picture::sides;
use ortelius::paper::virtual_texture::{
    Compaction, Config, Dedup, Filtering, PAPER, TileAddress, VirtualTexture, VirtualTextureSettings,
    texels_per_pixel,
};
use ortelius::picture::PixelFormat;
use ortelius::reference::Sample;
use ortelius::reference::filter::sample_count;

#[test]
fn every_texel_of_every_camera_of_the_ruler_is_right() {
    let gpu = device();
    let scene = scene("ruler");
    let mut renderer = open(&gpu, &scene, [640, 360], |_| ());
    for camera in scene.cameras.keys() {
        let pose = pose(&scene, camera);
        renderer.settle(&pose).unwrap();
        let verdicts = renderer.ruler_verdicts().unwrap();
        println!("{camera}: {verdicts:?}");
        assert_eq!((verdicts.wrong, verdicts.not_resident), (0, 0), "{camera}: {verdicts:?}");
        assert!(verdicts.covered > 640 * 360 / 5, "{camera}: {verdicts:?}");
    }
}

/// Near miss that must be rejected: the same frame before its tiles have arrived.
#[test]
fn in_a_frame_without_its_tiles_no_pixel_is_resident() {
    let gpu = device();
    let scene = scene("ruler");
    let mut renderer = open(&gpu, &scene, [160, 90], |_| ());
    let pose = pose(&scene, "corner");
    renderer.frame(&pose).unwrap();
    let verdicts = renderer.ruler_verdicts().unwrap();
    assert_eq!(verdicts.not_resident, verdicts.covered);
    assert_eq!(verdicts.wrong, 0, "resident levels are always right");
}

/// Near miss of the check itself: with a texture other than the ruler almost all pixels are wrong.
#[test]
fn the_earth_is_no_ruler() {
    let gpu = device();
    let scene = scene("earth");
    let mut renderer = open(&gpu, &scene, [160, 90], |_| ());
    let pose = pose(&scene, "headline");
    renderer.settle(&pose).unwrap();
    let verdicts = renderer.ruler_verdicts().unwrap();
    assert!(verdicts.wrong * 1000 > verdicts.covered * 999, "{verdicts:?}");
}

#[test]
fn texels_stay_right_on_the_largest_texture_and_with_small_tiles() {
    let gpu = device();
    for (change, camera) in [
        (["surface.land.texture.width_log2=20", "surface.land.texture.height_log2=19"], "corner"),
        (["surface.land.texture.width_log2=20", "surface.land.texture.height_log2=19"], "antimeridian"),
        (["surface.land.texture.tile_size=64", "surface.land.texture.border=2"], "corner-oblique"),
        (["surface.land.texture.tile_size=1024", "surface.land.texture.border=8"], "south-pole"),
        (["surface.land.texture.width_log2=12", "surface.land.texture.height_log2=11"], "corner"),
    ] {
        let overrides = change.map(String::from);
        let scene = scene("ruler").with(&overrides).unwrap();
        // About 100 MB of tiles for each size.
        let gpu_tiles =
            100_000_000 / texture(&scene).unwrap().pyramid().unwrap().unwrap().tile_bytes_rgba8() as u32;
        let mut renderer =
            open(&gpu, &scene, [320, 180], |settings| settings.streaming.gpu_tiles = gpu_tiles.min(1000));
        let pose = pose(&scene, camera);
        renderer.settle(&pose).unwrap();
        let verdicts = renderer.ruler_verdicts().unwrap();
        println!("{change:?}, {camera}: {verdicts:?}, bias {}", renderer.technique.bias());
        assert_eq!((verdicts.wrong, verdicts.not_resident), (0, 0), "{change:?}: {verdicts:?}");
    }
}

#[test]
fn samples_beyond_the_border_need_two_texels_of_it_and_tiles_twice_as_wide() {
    let gpu = device();
    assert_eq!(PAPER.filter.max_anisotropy, 16);
    for (border, max_anisotropy, refused) in [(0, 1, false), (0, 16, true), (1, 2, true), (2, 16, false)] {
        let scene = bordered("earth", border);
        let mut settings = VirtualTextureSettings::of_scene(&scene, PixelFormat::Srgb8).unwrap();
        settings.size = [64, 36];
        settings.streaming.gpu_tiles = 8;
        settings.config.filter = Filter { max_anisotropy, ..Filter::DEFAULT };
        let mesh = mesh::gpu_mesh(&source_mesh(&scene).unwrap());
        let renderer = VirtualTexture::run(gpu.clone(), open_texture(&scene).unwrap(), &mesh, settings);
        assert_eq!(renderer.is_err(), refused, "NA = {max_anisotropy} with a border of {border}");
    }
    let of = |max_anisotropy, border, tile_size| {
        Filter { max_anisotropy, ..Filter::DEFAULT }.tile_fault(border, tile_size).is_some()
    };
    assert_eq!([of(9, 2, 16), of(10, 2, 16), of(16, 8, 16), of(16, 2, 32)], [false, true, true, false]);
}

/// The mean number of texels per covered pixel: counted by the shader, and by the f64 reference. The reference counts 4
/// texels for a bilinear sample, 8 for each of nA trilinear samples, 1 for each random texel, and for the ellipse all
/// texels with a weight.
fn counted(name: &str, camera: &str, filter: Filter, base: Config) -> [f64; 2] {
    let (gpu, scene, size) = (device(), bordered(name, 4), [160, 90]);
    let pose = pose(&scene, camera);
    let mut renderer = open(&gpu, &scene, size, |settings| {
        settings.streaming.gpu_tiles = 192;
        settings.config = Config { filter, ..base };
    });
    renderer.settle(&pose).unwrap();
    assert_eq!(renderer.technique.bias(), 0);
    let pyramid = renderer.technique.source.pyramid();
    let ellipse = EllipseFilter::BEST.max_ratio(filter.max_anisotropy as f32).minor_texels(2.0);
    let ellipse = ellipse.within(pyramid.tile_size() / 2);
    let of = |sample: &Sample| {
        let (footprint, size) = (sides(sample, &pyramid), pyramid.level_size(0).map(f64::from));
        let [longest, shortest] = footprint.lengths();
        let ([ux, vx], [uy, vy]) = (footprint.r1, footprint.r2);
        let (jacobian, centre) = ([[ux, uy], [vx, vy]], [sample.s * size[0], sample.t * size[1]]);
        let pixel = PixelCentre { place: [0; 2], centre, jacobian, determinant: ux * vy - uy * vx };
        let coarsest = pyramid.coarsest_level();
        match filter.kind {
            Filtering::Bilinear => 4.0,
            Filtering::Trilinear => f64::from(8 * sample_count(longest, shortest, filter.max_anisotropy)),
            Filtering::Stochastic | Filtering::StochasticEllipse => f64::from(filter.samples),
            Filtering::Feline | Filtering::Mavridis | Filtering::Pbrt => {
                panic!("{:?}: counted here by the shader alone", filter.kind)
            }
            Filtering::Ellipse => {
                weights(&ellipse, &pixel, coarsest, levels(&ellipse, &pixel, coarsest)[0]).len() as f64
            }
        }
    };
    let samples: Vec<f64> = view_of(&scene, &pose, size).samples().iter().flatten().map(of).collect();
    let fetched = renderer.texels_fetched(&filter).unwrap();
    let covered = fetched.iter().filter(|texels| **texels > 0).count();
    assert!(covered.abs_diff(samples.len()) < 160 * 90 / 100, "{covered} and {} pixels", samples.len());
    [texels_per_pixel(&fetched), samples.iter().sum::<f64>() / samples.len() as f64]
}

#[test]
fn the_shader_counts_the_texels_of_every_filter_as_the_reference_does() {
    let filter = |kind, max_anisotropy, samples| Filter { kind, max_anisotropy, samples, ..Filter::DEFAULT };
    let filters = [
        filter(Filtering::Bilinear, 1, 1),
        filter(Filtering::Trilinear, 1, 1),
        filter(Filtering::Stochastic, 1, 16),
        filter(Filtering::StochasticEllipse, 1, 12),
        filter(Filtering::Trilinear, 4, 1),
        filter(Filtering::Trilinear, 16, 1),
        filter(Filtering::Ellipse, 16, 1),
    ];
    let mut found = Vec::new();
    for filter in filters {
        let [shader, reference] = counted("plane", "tilted", filter, PAPER);
        println!("{:?}, NA {}: {shader} and {reference} texels", filter.kind, filter.max_anisotropy);
        // The first four filters have the same count in each pixel. For the others, the device's derivatives err by up
        // to 1/256. This can change nA by one, and an ellipse by the texels at its edge.
        let max = if filter.max_anisotropy == 1 { 0.0 } else { 0.005 * reference };
        assert!((shader - reference).abs() <= max, "{filter:?}: {shader} and {reference}");
        found.push(shader);
    }
    assert_eq!(found[..3], [4.0, 8.0, 16.0]);
    // Near misses that the comparison would reject.
    assert!(found.windows(2).all(|pair| (pair[0] - pair[1]).abs() > 0.01 * pair[0]), "{found:?}");
    // A fused draw has no request image. To count its texels, a request image is drawn first.
    let (dedup, compact, address) = (Dedup::FusedExact, Compaction::Append, TileAddress::OwnLevel);
    let fused = Config { dedup, compact, address, ..PAPER };
    let [fused, reference] = counted("earth", "oblique", filters[5], fused);
    assert!((fused - reference).abs() <= 0.005 * reference, "{fused} and {reference}");
}
