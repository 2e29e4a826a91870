//! The list made by the host, from the whole request image and from a subset of its pixels.

use crate::TextureSession;
use crate::{device, open, pose, scene};
use ortelius::frame::Technique;
use ortelius::math::pyramid::TileId;
use ortelius::paper::virtual_texture::feedback::{self, Feedback};
use ortelius::paper::virtual_texture::read_back::{HostCopy, HostList, HostPass};
use ortelius::paper::virtual_texture::{Listing, RequestFormat, TileAddress, reference};
use ortelius::vk::{FRAMES_IN_FLIGHT, Feature, Gpu, GpuOptions, Watched};
use std::collections::BTreeSet;

/// The host's copy of the request image of the renderer's last frame.
fn copied(gpu: &Gpu, renderer: &TextureSession) -> HostCopy {
    let stage1 = renderer.technique.stage1().unwrap();
    let copy = HostCopy::new(gpu, stage1.requests.info().size, stage1.format).unwrap();
    gpu.run_pass("copy request image", |cmd| copy.run(cmd, &stage1.requests)).unwrap();
    copy
}

/// The host's copies of the samples of several frames.
fn gathered(gpu: &Gpu, renderer: &TextureSession, n: u32, frames: std::ops::Range<u64>) -> Vec<Vec<u32>> {
    let stage1 = renderer.technique.stage1().unwrap();
    let gather = Feedback::new(gpu, stage1.format, n).unwrap();
    let samples = gather.samples(gpu, stage1.requests.info().size).unwrap();
    let take = |number| {
        let mut frame = gpu.frame().unwrap();
        frame.pass("gather", |cmd| gather.run(cmd, &stage1.requests, &samples, number)).unwrap();
        frame.pass("feedback read-back", |cmd| samples.read_back(cmd)).unwrap();
        frame.submit().unwrap().wait().unwrap();
        samples.words().to_vec()
    };
    frames.map(take).collect()
}

#[test]
fn the_host_lists_the_reference_set_from_every_format() {
    let gpu = device();
    for name in ["earth", "globe", "pole"] {
        let scene = scene(name);
        for &format in RequestFormat::ALL.iter().filter(|format| gpu.renders_to(format.image_format())) {
            let mut renderer =
                open(&gpu, &scene, [250, 141], |settings| settings.config.request_format = Some(format));
            renderer.frame(&pose(&scene, &scene.view.camera)).unwrap();
            let requests = renderer.requests().unwrap();
            let pyramid = renderer.technique.source.pyramid();
            let copy = copied(&gpu, &renderer);
            for pass in [HostPass::Hash, HostPass::Bitmap] {
                let list = |address| {
                    let list = HostList::new(pass, &pyramid, format, address).unwrap().list(&copy.words());
                    let entries: BTreeSet<[u32; 3]> = list.iter().copied().collect();
                    assert_eq!(entries.len(), list.len(), "{name}, {format:?}, {pass:?}: duplicate entry");
                    entries
                };
                assert_eq!(
                    list(TileAddress::Level0),
                    reference::distinct_triples(&requests, &pyramid),
                    "{name}"
                );
                let tile = |[level, row, column]: [u32; 3]| TileId { level, row, column };
                let own_level: BTreeSet<TileId> = list(TileAddress::OwnLevel).into_iter().map(tile).collect();
                assert_eq!(
                    own_level,
                    reference::visible_tiles(&requests, &pyramid),
                    "{name}, {format:?}, {pass:?}"
                );
            }
        }
    }
}

#[test]
fn a_cycle_of_samples_contains_each_pixel_once() {
    let gpu = device();
    let scene = scene("earth");
    // No block size above one pixel divides this size.
    let (width, height) = (125, 71);
    for format in [RequestFormat::Rgba32, RequestFormat::Packed] {
        let mut renderer =
            open(&gpu, &scene, [width, height], |settings| settings.config.request_format = Some(format));
        renderer.frame(&pose(&scene, "oblique")).unwrap();
        renderer.drain().unwrap();
        let copy = copied(&gpu, &renderer);
        let words = format.words();
        for n in [0, 1, 2, 5, 8] {
            let mut picture = vec![0; copy.words().len()];
            let mut outside = 0;
            let [columns, _] = feedback::blocks(n, [width, height]);
            let [wide, high] = feedback::block_log2(n);
            let frames = gathered(&gpu, &renderer, n, 0..feedback::cycle(n));
            for (number, samples) in frames.iter().enumerate() {
                let [x, y] = feedback::offset(n, number as u64);
                for (block, texel) in samples.chunks_exact(words).enumerate() {
                    let (column, row) = (block as u32 % columns, block as u32 / columns);
                    let [x, y] = [(column << wide) + x, (row << high) + y];
                    if x < width && y < height {
                        let at = words * (y * width + x) as usize;
                        picture[at..at + words].copy_from_slice(texel);
                    } else {
                        outside += 1;
                        assert!(texel.iter().all(|word| *word == u32::MAX), "n = {n}: {texel:?} outside");
                    }
                }
            }
            assert!(picture == *copy.words(), "n = {n}, {format:?}");
            let samples: usize = frames.iter().map(|samples| samples.len() / words).sum();
            assert_eq!(samples - outside, (width * height) as usize, "n = {n}");
        }
    }
}

#[test]
fn samples_list_only_visible_tiles_and_a_cycle_lists_all() {
    let gpu = device();
    for (name, camera) in [("earth", "oblique"), ("globe", "africa"), ("ruler", "corner-oblique")] {
        let scene = scene(name);
        let mut renderer = open(&gpu, &scene, [320, 180], |_| ());
        renderer.frame(&pose(&scene, camera)).unwrap();
        let pyramid = renderer.technique.source.pyramid();
        let exact = reference::visible_tiles(&renderer.requests().unwrap(), &pyramid);
        let format = renderer.technique.stage1().unwrap().format;
        let mut host = HostList::new(HostPass::Bitmap, &pyramid, format, TileAddress::OwnLevel).unwrap();
        for n in [2, 4, 6, 8] {
            let mut memory = feedback::SampleHistory::new(feedback::cycle(n));
            let mut remembered = Vec::new();
            // Samples from the middle of one cycle into the next.
            for samples in gathered(&gpu, &renderer, n, 3..3 + feedback::cycle(n)) {
                let triples = host.list(&samples);
                let tiles: Vec<TileId> =
                    triples.iter().map(|&[level, row, column]| TileId { level, row, column }).collect();
                assert!(tiles.iter().all(|tile| exact.contains(tile)), "{name}, n = {n}: {tiles:?}");
                remembered = memory.add(&tiles);
            }
            let expected: Vec<TileId> = exact.iter().copied().collect();
            assert_eq!(remembered, expected, "{name}, n = {n}");
        }
    }
}

#[test]
fn every_list_settles_to_the_same_picture_and_host_lists_need_no_device_feature() {
    let bare = Watched::open(&GpuOptions::default());
    assert!(!bare.has(Feature::GeometryShader) && !bare.has(Feature::TransformFeedback));
    let scene = scene("ruler");
    let pose = pose(&scene, "corner-oblique");
    let settled = |gpu: &Gpu, list| {
        let mut renderer = open(gpu, &scene, [160, 90], |settings| {
            settings.config.list = list;
            settings.config.feedback_log2 = 4;
        });
        let frames = renderer.settle(&pose).unwrap();
        let picture = renderer.picture_bytes().unwrap();
        let expected =
            reference::visible_tiles(&renderer.requests().unwrap(), &renderer.technique.source.pyramid());
        let record = renderer.records.last().unwrap();
        assert_eq!(record.visible, expected.into_iter().collect::<Vec<_>>(), "{list:?}");
        let verdicts = renderer.ruler_verdicts().unwrap();
        assert_eq!((verdicts.wrong, verdicts.not_resident), (0, 0), "{list:?}");
        let passes: Vec<_> = renderer.records[0].passes.iter().map(|pass| pass.label.clone()).collect();
        assert_eq!(passes, renderer.technique.passes(), "{list:?}");
        (frames, picture)
    };
    let (_, picture) = settled(&device(), Listing::Device);
    for &list in Listing::ALL.iter().filter(|list| **list != Listing::Device) {
        let (frames, on_the_host) = settled(&bare, list);
        assert!(on_the_host == picture, "{list:?}");
        // Settling waits for the whole cycle. Otherwise a tile of a single pixel might be missing.
        let cycle = if list == Listing::Feedback { 16 } else { 1 };
        assert!(frames >= cycle + FRAMES_IN_FLIGHT as u64, "{list:?}: {frames} frames");
    }
}

#[test]
fn a_tile_that_left_the_picture_is_remembered_for_a_cycle() {
    let gpu = device();
    let scene = scene("ruler");
    let mut renderer = open(&gpu, &scene, [160, 90], |settings| {
        settings.config.list = Listing::Feedback;
        settings.config.feedback_log2 = 2;
    });
    let poses = ["corner-oblique", "antimeridian"].map(|camera| pose(&scene, camera));
    for pose in [&poses[0]; 4].into_iter().chain([&poses[1]; 5]) {
        renderer.frame(pose).unwrap();
    }
    renderer.drain().unwrap();
    let seen = |frame: usize| renderer.records[frame].visible.iter().copied().collect::<BTreeSet<TileId>>();
    let (before, after) = (seen(3), seen(7));
    assert!(before.intersection(&after).count() < before.len(), "the pictures differ");
    assert!(seen(4).intersection(&before).count() > seen(7).intersection(&before).count());
    assert_eq!(seen(7), seen(8), "the old picture is forgotten, the new one known");
}
