//! Stages 1 to 3: the list equals the integer reference that is computed from the same U1.

use crate::{Device, open, pose, scene};
use ortelius::math::pyramid::{Pyramid, TileId};
use ortelius::paper::virtual_texture::compact::CompactPass;
use ortelius::paper::virtual_texture::dedup::DedupPass;
use ortelius::paper::virtual_texture::streaming::{Keying, distinct_tiles};
use ortelius::paper::virtual_texture::{Compaction, Config, Dedup, Layout, U1Format, reference};
use ortelius::renderer::Renderer;
use ortelius::scene::SHIPPED;
use ortelius::vk::Gpu;
use std::collections::BTreeSet;

/// Runs stages 2 and 3 of a variant on the U1 that the renderer's last frame left.
fn list(gpu: &Gpu, renderer: &Renderer, config: &Config) -> Vec<[u32; 3]> {
    let pyramid = renderer.source.pyramid();
    let stage1 = renderer.pipeline.stage1().unwrap();
    let dedup = DedupPass::new(gpu, &pyramid, config, stage1).unwrap();
    let compact = CompactPass::new(gpu, &pyramid, config).unwrap();
    run(gpu, renderer, config, &dedup, &compact)
}

fn run(
    gpu: &Gpu,
    renderer: &Renderer,
    config: &Config,
    dedup: &DedupPass,
    compact: &CompactPass,
) -> Vec<[u32; 3]> {
    let stage1 = renderer.pipeline.stage1().unwrap();
    let marks = dedup.marks(gpu).unwrap();
    let mut list = compact.list(gpu, u64::from(config.list_capacity)).unwrap();
    let mut frame = gpu.frame().unwrap();
    frame.pass("dedup", |cmd| dedup.run(cmd, &stage1.u1, &marks)).unwrap();
    frame.pass("compact", |cmd| compact.run(cmd, &marks, &list)).unwrap();
    frame
        .pass("read-back", |cmd| {
            list.read_back(cmd);
            Ok(())
        })
        .unwrap();
    frame.submit().unwrap().wait().unwrap();
    compact.collect(gpu, &marks, &mut list).unwrap().0
}

/// What a variant's list must be, from U1 alone.
fn assert_equals_reference(
    renderer: &mut Renderer,
    triples: &[[u32; 3]],
    keying: Keying,
    what: &str,
) -> usize {
    let pyramid = renderer.source.pyramid();
    let u1 = renderer.u1().unwrap();
    let expected = reference::visible_tiles(&u1, &pyramid);
    let found: BTreeSet<TileId> =
        distinct_tiles(triples, keying, pyramid.first_resident_level()).into_iter().collect();
    assert_eq!(found, expected, "{what}");
    // Not only the tiles: the list itself, each entry once.
    let entries: BTreeSet<[u32; 3]> = triples.iter().copied().collect();
    assert_eq!(entries.len(), triples.len(), "{what}: an entry twice");
    match keying {
        Keying::Paper => assert_eq!(entries, reference::distinct_triples(&u1, &pyramid), "{what}"),
        Keying::Native => {
            assert_eq!(triples.len(), expected.len(), "{what}: a tile seen twice is listed once")
        }
    }
    expected.len()
}

#[test]
fn every_camera_of_every_scene_lists_the_reference_set() {
    let gpu = Device::open();
    for (name, _) in SHIPPED {
        let scene = scene(name);
        let mut renderer = open(&gpu, &scene, [320, 180], |_| ());
        for camera in scene.cameras.keys() {
            renderer.frame(&pose(&scene, camera)).unwrap();
            renderer.drain().unwrap();
            let triples = list(&gpu, &renderer, &renderer.settings.config.clone());
            let what = format!("{name}, {camera}");
            let tiles = assert_equals_reference(&mut renderer, &triples, Keying::Paper, &what);
            let record = renderer.records.last().unwrap();
            assert_eq!((record.triples, record.visible.len()), (triples.len(), tiles), "{what}");
            println!("{what}: {} triples, {tiles} tiles", triples.len());
        }
    }
}

#[test]
fn every_block_size_memo_and_keying_lists_the_reference_set_in_all_scenes() {
    let gpu = Device::open();
    for (name, _) in SHIPPED {
        let scene = scene(name);
        let mut renderer = open(&gpu, &scene, [250, 141], |_| ());
        renderer.frame(&pose(&scene, &scene.view.camera)).unwrap();
        renderer.drain().unwrap();
        for block_log2 in 0..=4 {
            for memo in [false, true] {
                for keying in [Keying::Paper, Keying::Native] {
                    let compact_block_log2 = block_log2 % 3;
                    let config =
                        Config { block_log2, memo, keying, compact_block_log2, ..renderer.settings.config };
                    let triples = list(&gpu, &renderer, &config);
                    assert_equals_reference(&mut renderer, &triples, keying, &format!("{name}: {config:?}"));
                }
            }
        }
    }
}

/// Every pair of stages 2 and 3 with both keyings, where the pair can be.
fn all_variants(renderer: &Renderer) -> Vec<Config> {
    let pyramid = renderer.source.pyramid();
    let mut configs = Vec::new();
    for dedup in Dedup::staged() {
        for &compact in Compaction::ALL {
            for keying in [Keying::Paper, Keying::Native] {
                let config = Config { dedup, compact, keying, ..renderer.settings.config };
                configs.extend(config.check(&pyramid).is_ok().then_some(config));
            }
        }
    }
    configs
}

/// Stages 2 and 3 of variants, made once for each pyramid and format of U1: a pipeline's first use compiles.
#[derive(Default)]
struct Passes(Vec<(Pyramid, U1Format, Config, DedupPass, CompactPass)>);

impl Passes {
    fn list(&mut self, gpu: &Gpu, renderer: &Renderer, config: &Config) -> Vec<[u32; 3]> {
        let (pyramid, stage1) = (renderer.source.pyramid(), renderer.pipeline.stage1().unwrap());
        let same = |known: &(Pyramid, U1Format, Config, _, _)| {
            (known.0, known.1, known.2) == (pyramid, stage1.format, Config { u1: None, ..*config })
        };
        let at = self.0.iter().position(same).unwrap_or_else(|| {
            let dedup = DedupPass::new(gpu, &pyramid, config, stage1).unwrap();
            let compact = CompactPass::new(gpu, &pyramid, config).unwrap();
            self.0.push((pyramid, stage1.format, Config { u1: None, ..*config }, dedup, compact));
            self.0.len() - 1
        });
        let (.., dedup, compact) = &self.0[at];
        run(gpu, renderer, config, dedup, compact)
    }
}

#[test]
fn every_pair_of_variants_lists_the_reference_set() {
    let gpu = Device::open();
    let scene = scene("earth");
    // 141 rows: the last groups reach over the picture's edge.
    let mut renderer = open(&gpu, &scene, [250, 141], |settings| settings.config.u1 = Some(U1Format::Packed));
    renderer.frame(&pose(&scene, "oblique")).unwrap();
    renderer.drain().unwrap();
    let configs = all_variants(&renderer);
    assert!(configs.len() > Dedup::ALL.len() * Compaction::ALL.len(), "{}", configs.len());
    for config in configs {
        let triples = list(&gpu, &renderer, &config);
        assert_equals_reference(&mut renderer, &triples, config.keying, &format!("{config:?}"));
        if config.compact == Compaction::Ordered {
            assert_is_in_order(&triples, config.dedup);
        }
    }
}

/// An ordered list follows the marks: U2's texels row by row, or the pyramid level by level.
fn assert_is_in_order(triples: &[[u32; 3]], dedup: Dedup) {
    let key = |&[q, i, j]: &[u32; 3]| if dedup.layout() == Layout::U2 { [i, j, q] } else { [q, i, j] };
    assert!(triples.iter().map(key).is_sorted(), "{dedup:?}");
}

#[test]
fn every_variant_of_either_stage_lists_the_reference_set_in_all_scenes_and_formats() {
    let gpu = Device::open();
    let mut passes = Passes::default();
    for (name, _) in SHIPPED {
        let scene = scene(name);
        for format in U1Format::ALL.into_iter().filter(|format| gpu.renders_to(format.image_format())) {
            let mut renderer = open(&gpu, &scene, [250, 141], |settings| settings.config.u1 = Some(format));
            renderer.frame(&pose(&scene, &scene.view.camera)).unwrap();
            renderer.drain().unwrap();
            for config in one_of_each(&renderer) {
                let triples = passes.list(&gpu, &renderer, &config);
                let what = format!("{name}: {config:?}");
                assert_equals_reference(&mut renderer, &triples, config.keying, &what);
            }
        }
    }
}

/// Each variant of stage 2, with both keyings where it can; the variants of stage 3 take turns beside it.
fn one_of_each(renderer: &Renderer) -> Vec<Config> {
    let all = all_variants(renderer);
    let turn = |n: usize, &dedup: &Dedup| {
        let of_dedup: Vec<&Config> = all.iter().filter(|config| config.dedup == dedup).collect();
        let keyed = |keying| of_dedup.iter().filter(move |config| config.keying == keying);
        let pick = |keying, n: usize| keyed(keying).nth(n % keyed(keying).count().max(1)).map(|c| **c);
        [pick(Keying::Paper, n), pick(Keying::Native, n + 2)]
    };
    Dedup::ALL.iter().enumerate().flat_map(|(n, dedup)| turn(n, dedup)).flatten().collect()
}

#[test]
fn every_format_of_u1_lists_the_reference_set() {
    let gpu = Device::open();
    let scene = scene("earth");
    let mut sets = Vec::new();
    for format in U1Format::ALL.into_iter().filter(|format| gpu.renders_to(format.image_format())) {
        let mut renderer = open(&gpu, &scene, [320, 180], |settings| settings.config.u1 = Some(format));
        renderer.frame(&pose(&scene, "oblique")).unwrap();
        renderer.drain().unwrap();
        let triples = list(&gpu, &renderer, &renderer.settings.config.clone());
        assert_equals_reference(&mut renderer, &triples, Keying::Paper, format.name());
        sets.push(renderer.u1().unwrap());
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
fn a_list_that_overflows_is_run_again_and_loses_no_tile() {
    let gpu = Device::open();
    let scene = scene("earth");
    let mut renderer = open(&gpu, &scene, [320, 180], |settings| settings.config.list_capacity = 16);
    for frame in 0..3 {
        renderer.frame(&pose(&scene, "oblique")).unwrap();
        renderer.drain().unwrap();
        let record = renderer.records.last().unwrap().clone();
        // Each frame in flight has its own list, and each learns once.
        assert_eq!(record.overflowed, frame < 2, "frame {frame}");
        assert!(record.triples > 16);
        let pyramid = renderer.source.pyramid();
        let expected = reference::visible_tiles(&renderer.u1().unwrap(), &pyramid);
        assert_eq!(record.visible.iter().copied().collect::<BTreeSet<_>>(), expected);
    }
}

#[test]
fn an_empty_frame_lists_no_tile() {
    let gpu = Device::open();
    let scene = scene("globe");
    let mut renderer = open(&gpu, &scene, [64, 64], |_| ());
    let mut away = pose(&scene, &scene.view.camera);
    away.forward = -away.forward;
    away.right = -away.right;
    renderer.frame(&away).unwrap();
    renderer.drain().unwrap();
    assert!(renderer.u1().unwrap().iter().all(|triple| triple[0] == u32::MAX));
    assert_eq!(renderer.records.last().unwrap().triples, 0);
}

#[test]
fn a_picture_of_one_pixel_and_a_long_thin_one_list_the_reference_set() {
    let gpu = Device::open();
    let scene = scene("earth");
    for size in [[1, 1], [4096, 16]] {
        let mut renderer = open(&gpu, &scene, size, |_| ());
        renderer.frame(&pose(&scene, "oblique")).unwrap();
        renderer.drain().unwrap();
        let triples = list(&gpu, &renderer, &renderer.settings.config.clone());
        assert_equals_reference(&mut renderer, &triples, Keying::Paper, &format!("{size:?}"));
    }
}
