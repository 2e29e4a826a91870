//! The ruler: every texel that texturing would filter is the one that the pixel's (s, t) and level require.

use crate::{bordered, device, open, pose, scene};
use ortelius::model::mesh;
use ortelius::paper::virtual_texture::config::{Filter, open_texture, source_mesh, texture};
use ortelius::paper::virtual_texture::{PAPER, VirtualTexture, VirtualTextureSettings};
use ortelius::picture::PixelFormat;

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
fn a_frame_without_its_tiles_is_found_wanting() {
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
        Filter { max_anisotropy, ..Filter::DEFAULT }.beyond(border, tile_size).is_some()
    };
    assert_eq!([of(9, 2, 16), of(10, 2, 16), of(16, 8, 16), of(16, 2, 32)], [false, true, true, false]);
}
