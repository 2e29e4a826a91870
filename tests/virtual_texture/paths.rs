//! Moving cameras: small caches, prefetched tiles, a failing disk.

use crate::TextureSession;
use crate::scene;
use crate::streaming::Broken;
use crate::{device, open, open_with};
use ortelius::paper::virtual_texture::config::open_texture;
use ortelius::scene::Scene;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

const PATHS: [&str; 6] = ["orbit", "pan", "dive", "pole-crossing", "antimeridian-crossing", "teleport"];

/// The earth's mesh and paths with the ruler's texels, in tiles of 128. At 160 x 90 pixels, as many tiles are visible
/// as with tiles of 512 at 640 x 360.
fn earth_of_ruler() -> Scene {
    let changes =
        ["surface.land.texture.source=ruler", "surface.land.texture.tile_size=128"].map(str::to_owned);
    scene("earth").with(&changes).unwrap()
}

const SIZE: [u32; 2] = [160, 90];

/// Renders every 24th frame of a path (240 frames; teleport 150); returns the largest visible set.
fn go(renderer: &mut TextureSession, scene: &Scene, path: &str) -> usize {
    let path = scene.path(path).unwrap();
    let first = renderer.records.len();
    for frame in (0..path.frames).step_by(24) {
        renderer.frame(&path.pose(frame)).unwrap();
    }
    renderer.drain().unwrap();
    renderer.records[first..].iter().map(|record| record.visible.len()).max().unwrap()
}

#[test]
fn with_half_of_the_needed_cache_a_path_is_coarser_and_settles() {
    let gpu = device();
    let scene = earth_of_ruler();
    let mut roomy = open(&gpu, &scene, SIZE, |_| ());
    for path in PATHS {
        let largest = go(&mut roomy, &scene, path);
        assert!(largest >= 2, "{path}: {largest} tiles");
        let mut halved = open(&gpu, &scene, SIZE, |settings| {
            settings.streaming.gpu_tiles = largest as u32 / 2;
            settings.streaming.host_tiles = largest as u32;
        });
        go(&mut halved, &scene, path);
        assert!(halved.records.iter().any(|record| record.streaming.oversubscribed), "{path}: all tiles fit");
        let last = scene.path(path).unwrap().pose(u32::MAX);
        let frames = halved.settle(&last).unwrap();
        // A frame uploads 8 tiles, and there are at most 64.
        assert!(frames <= 16, "{path}: {frames} frames to rest");
        // The check runs on one path only, because its shader is compiled on first use.
        if path == "pole-crossing" {
            let verdicts = halved.ruler_verdicts().unwrap();
            assert_eq!((verdicts.wrong, verdicts.not_resident), (0, 0), "{path}: coarser, but whole");
        }
        let picture = halved.picture_bytes().unwrap();
        let rested = halved.records.len();
        for _ in 0..3 {
            halved.frame(&last).unwrap();
            assert!(halved.picture_bytes().unwrap() == picture, "{path}: the picture is not at rest");
        }
        let copies: usize = halved.records[rested..].iter().map(|record| record.streaming.uploads).sum();
        assert_eq!(copies, 0, "{path}");
    }
}

#[test]
fn prefetching_halves_the_misses_and_leaves_the_settled_picture_unchanged() {
    let gpu = device();
    let scene = earth_of_ruler();
    let path = scene.path("pan").unwrap();
    let run = |prefetch_frames| {
        let mut renderer =
            open(&gpu, &scene, SIZE, |settings| settings.streaming.prefetch_frames = prefetch_frames);
        renderer.settle(&path.pose(0)).unwrap();
        let start = renderer.records.len();
        for frame in (2..60).step_by(2) {
            renderer.frame(&path.pose(frame)).unwrap();
        }
        renderer.drain().unwrap();
        let misses: usize = renderer.records[start..].iter().map(|record| record.streaming.misses).sum();
        let expected: usize = renderer
            .records
            .windows(9)
            .map(|r| r[0].expected.iter().filter(|tile| r[8].visible.binary_search(tile).is_ok()).count())
            .sum();
        renderer.settle(&path.pose(58)).unwrap();
        (misses, expected, renderer.picture_bytes().unwrap())
    };
    let (without, nothing, picture) = run(0);
    let (with, expected, same) = run(8);
    assert_eq!(nothing, 0);
    assert!(expected > 0, "some expected tiles were visible 8 frames later");
    assert!(2 * with <= without, "{with} misses with prefetch, {without} without");
    assert!(same == picture);
}

#[test]
fn frames_go_on_while_the_disk_is_down_and_the_picture_recovers() {
    let gpu = device();
    let scene = earth_of_ruler();
    let pose = scene.camera("headline").unwrap().pose();
    let mut healthy = open(&gpu, &scene, SIZE, |_| ());
    healthy.settle(&pose).unwrap();
    let picture = healthy.picture_bytes().unwrap();
    drop(healthy);
    let is_down = Arc::new(AtomicBool::new(true));
    let asked = is_down.clone();
    let is_broken = move |_| asked.load(Ordering::Relaxed);
    let disk = Arc::new(Broken { whole: open_texture(&scene).unwrap(), is_broken });
    let mut renderer = open_with(&gpu, &scene, SIZE, disk, |settings| {
        settings.streaming.deterministic = false;
        settings.streaming.retry_after_ms = 50.0;
    });
    let mut failed_tiles = || {
        renderer.frame(&pose).unwrap();
        renderer.drain().unwrap();
        renderer.records.last().unwrap().streaming.failed_tiles
    };
    while failed_tiles() == 0 {}
    (0..3).for_each(|_| assert!(failed_tiles() > 0, "nothing can be read"));
    is_down.store(false, Ordering::Relaxed);
    while failed_tiles() > 0 {}
    renderer.settle(&pose).unwrap();
    let loads: usize = renderer.records.iter().map(|record| record.streaming.loads).sum();
    assert!(loads > 0);
    assert!(renderer.picture_bytes().unwrap() == picture);
}
