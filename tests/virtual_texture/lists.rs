//! Stages 1 to 3: the list equals the integer reference computed from the same request image.

use crate::TextureSession;
use crate::{device, landscapes, open, pose, scene};
use ortelius::frame::FrameSlot;
use ortelius::math::camera::Pose;
use ortelius::math::pyramid::{Pyramid, TileId};
use ortelius::paper::virtual_texture::compact::CompactPass;
use ortelius::paper::virtual_texture::dedup::DedupPass;
use ortelius::paper::virtual_texture::footprint::FootprintPass;
use ortelius::paper::virtual_texture::streaming::{TileAddress, distinct_tiles};
use ortelius::paper::virtual_texture::{Compaction, Config, RequestFormat, reference};
use ortelius::vk::Gpu;
use std::collections::BTreeSet;

/// Runs stages 2 and 3 of a variant on the request image of the renderer's last frame.
pub(crate) fn list(gpu: &Gpu, renderer: &TextureSession, config: &Config) -> Vec<[u32; 3]> {
    let pyramid = renderer.technique.source.pyramid();
    let stage1 = renderer.technique.stage1().unwrap();
    let dedup = DedupPass::new(gpu, &pyramid, config, stage1).unwrap();
    let compact = CompactPass::new(gpu, &pyramid, config).unwrap();
    run(gpu, stage1, config, &dedup, &compact)
}

/// Runs the passes once and returns the list.
pub(crate) fn run(
    gpu: &Gpu,
    stage1: &FootprintPass,
    config: &Config,
    dedup: &DedupPass,
    compact: &CompactPass,
) -> Vec<[u32; 3]> {
    let mut list = compact.list(gpu, u64::from(config.list_capacity)).unwrap();
    let mut frame = gpu.frame().unwrap();
    frame.pass("dedup", |cmd| dedup.run(cmd, &stage1.requests, FrameSlot::FIRST)).unwrap();
    frame.pass("compact", |cmd| list.compact(cmd, dedup.mask(FrameSlot::FIRST))).unwrap();
    frame.pass("read-back", |cmd| list.read_back(cmd)).unwrap();
    frame.submit().unwrap().wait().unwrap();
    compact.collect(gpu, dedup.mask(FrameSlot::FIRST), &mut list).unwrap().0
}

/// Compares a variant's list with the reference of the request image.
pub(crate) fn assert_equals_reference(
    renderer: &mut TextureSession,
    triples: &[[u32; 3]],
    address: TileAddress,
    what: &str,
) -> usize {
    let pyramid = renderer.technique.source.pyramid();
    let requests = renderer.requests().unwrap();
    assert_lists(&requests, &pyramid, triples, address, what)
}

pub(crate) fn assert_lists(
    requests: &[[u32; 3]],
    pyramid: &Pyramid,
    triples: &[[u32; 3]],
    address: TileAddress,
    what: &str,
) -> usize {
    let expected = reference::visible_tiles(requests, pyramid);
    let found: BTreeSet<TileId> =
        distinct_tiles(triples, address, pyramid.first_resident_level()).into_iter().collect();
    assert_eq!(found, expected, "{what}");
    // Compares the list itself, not only its tiles: each entry occurs once.
    let entries: BTreeSet<[u32; 3]> = triples.iter().copied().collect();
    assert_eq!(entries.len(), triples.len(), "{what}: duplicate entry");
    match address {
        TileAddress::Level0 => assert_eq!(entries, reference::distinct_triples(requests, pyramid), "{what}"),
        TileAddress::OwnLevel => {
            assert_eq!(triples.len(), expected.len(), "{what}: a tile seen twice is listed once")
        }
    }
    expected.len()
}

#[test]
fn every_camera_of_every_scene_lists_the_reference_set() {
    let gpu = device();
    for name in landscapes() {
        let scene = scene(name);
        let mut renderer = open(&gpu, &scene, [320, 180], |_| ());
        for camera in scene.cameras.keys() {
            renderer.frame(&pose(&scene, camera)).unwrap();
            renderer.drain().unwrap();
            let triples = list(&gpu, &renderer, &renderer.technique.settings.config.clone());
            let what = format!("{name}, {camera}");
            let tiles = assert_equals_reference(&mut renderer, &triples, TileAddress::Level0, &what);
            let record = renderer.records.last().unwrap();
            assert_eq!((record.triples, record.visible.len()), (triples.len(), tiles), "{what}");
            println!("{what}: {} triples, {tiles} tiles", triples.len());
        }
    }
}

#[test]
fn every_block_size_memo_and_tile_address_lists_the_reference_set_in_all_scenes() {
    let gpu = device();
    for name in landscapes() {
        let scene = scene(name);
        let mut renderer = open(&gpu, &scene, [250, 141], |_| ());
        renderer.frame(&pose(&scene, &scene.view.camera)).unwrap();
        renderer.drain().unwrap();
        for block_log2 in 0..=4 {
            for memo in [false, true] {
                for address in [TileAddress::Level0, TileAddress::OwnLevel] {
                    let compact_block_log2 = block_log2 % 3;
                    let config = Config {
                        block_log2,
                        memo,
                        address,
                        compact_block_log2,
                        ..renderer.technique.settings.config
                    };
                    let triples = list(&gpu, &renderer, &config);
                    assert_equals_reference(&mut renderer, &triples, address, &format!("{name}: {config:?}"));
                }
            }
        }
    }
}

#[test]
fn every_request_format_lists_the_reference_set() {
    let gpu = device();
    let scene = scene("earth");
    let mut sets = Vec::new();
    for &format in RequestFormat::ALL.iter().filter(|format| gpu.renders_to(format.image_format())) {
        let mut renderer =
            open(&gpu, &scene, [320, 180], |settings| settings.config.request_format = Some(format));
        renderer.frame(&pose(&scene, "oblique")).unwrap();
        renderer.drain().unwrap();
        let triples = list(&gpu, &renderer, &renderer.technique.settings.config.clone());
        assert_equals_reference(&mut renderer, &triples, TileAddress::Level0, format.name());
        sets.push(renderer.requests().unwrap());
    }
    // Every device renders to the packed format and to RGBA32UI; all formats hold the same triples.
    assert!(sets.len() >= 2);
    for other in &sets[1..] {
        let differing =
            sets[0].iter().zip(other).filter(|(a, b)| a[0] != b[0] || (a[0] != u32::MAX && a != b));
        assert_eq!(differing.count(), 0);
    }
}

#[test]
fn an_overflowing_list_is_run_again_and_loses_no_tile() {
    let gpu = device();
    let scene = scene("earth");
    for compact in [Compaction::TransformFeedback, Compaction::Append, Compaction::Ordered] {
        let mut renderer = open(&gpu, &scene, [320, 180], |settings| {
            settings.config = Config { list_capacity: 16, compact, ..settings.config };
        });
        for frame in 0..3 {
            renderer.frame(&pose(&scene, "oblique")).unwrap();
            renderer.drain().unwrap();
            let record = renderer.records.last().unwrap().clone();
            // Each frame in flight has its own list, and each list overflows once.
            assert_eq!(record.overflowed, frame < 2, "{compact:?}, frame {frame}");
            assert!(record.triples > 16);
            let pyramid = renderer.technique.source.pyramid();
            let expected = reference::visible_tiles(&renderer.requests().unwrap(), &pyramid);
            assert_eq!(record.visible.iter().copied().collect::<BTreeSet<_>>(), expected, "{compact:?}");
        }
    }
}

/// The host copies slightly more than the previous frame listed; a truncated copy must not lose tiles.
#[test]
fn a_list_longer_than_the_hosts_copy_is_read_again() {
    let gpu = device();
    let scene = scene("globe");
    let globe = pose(&scene, &scene.view.camera);
    let away = Pose { forward: -globe.forward, right: -globe.right, ..globe };
    for compact in [Compaction::TransformFeedback, Compaction::Append, Compaction::Ordered] {
        let mut renderer = open(&gpu, &scene, [320, 180], |settings| {
            settings.config = Config { address: TileAddress::Level0, compact, ..settings.config };
        });
        for (frame, pose) in [&away, &away, &globe, &globe, &away, &globe].into_iter().enumerate() {
            renderer.frame(pose).unwrap();
            renderer.drain().unwrap();
            let record = renderer.records.last().unwrap().clone();
            // More entries than the host copies after an empty frame.
            assert_eq!(
                record.triples > 1024,
                pose == &globe,
                "{compact:?}, frame {frame}: {}",
                record.triples
            );
            assert!(!record.overflowed, "{compact:?}, frame {frame}");
            let pyramid = renderer.technique.source.pyramid();
            let expected = reference::visible_tiles(&renderer.requests().unwrap(), &pyramid);
            assert_eq!(record.visible.iter().copied().collect::<BTreeSet<_>>(), expected, "{compact:?}");
        }
    }
}

#[test]
fn an_empty_frame_lists_no_tile() {
    let gpu = device();
    let scene = scene("globe");
    let mut renderer = open(&gpu, &scene, [64, 64], |_| ());
    let mut away = pose(&scene, &scene.view.camera);
    away.forward = -away.forward;
    away.right = -away.right;
    renderer.frame(&away).unwrap();
    renderer.drain().unwrap();
    assert!(renderer.requests().unwrap().iter().all(|triple| triple[0] == u32::MAX));
    assert_eq!(renderer.records.last().unwrap().triples, 0);
}

#[test]
fn a_picture_of_one_pixel_and_a_long_thin_one_list_the_reference_set() {
    let gpu = device();
    let scene = scene("earth");
    for size in [[1, 1], [4096, 16]] {
        let mut renderer = open(&gpu, &scene, size, |_| ());
        renderer.frame(&pose(&scene, "oblique")).unwrap();
        renderer.drain().unwrap();
        let triples = list(&gpu, &renderer, &renderer.technique.settings.config.clone());
        assert_equals_reference(&mut renderer, &triples, TileAddress::Level0, &format!("{size:?}"));
    }
}
