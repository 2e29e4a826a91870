//! Marking in the fragment shader that textures: the list beside stage 1's own triples, and the picture beside the paper's.

use crate::{Device, open, pose, scene};
use ortelius::math::pyramid::TileId;
use ortelius::paper::virtual_texture::{Compaction, Dedup, Keying, reference};
use ortelius::renderer::{Renderer, Settings};
use ortelius::scene::SHIPPED;
use ortelius::scene::mesh::{SourceMesh, gpu_mesh};
use std::collections::BTreeSet;

fn fuse(settings: &mut Settings, dedup: Dedup) {
    settings.config.dedup = dedup;
    settings.config.keying = Keying::Native;
    settings.config.compact = Compaction::Append;
}

/// The last frame's tiles, and those that its pixels ask for.
fn listed_and_seen(renderer: &mut Renderer) -> (BTreeSet<TileId>, BTreeSet<TileId>) {
    renderer.drain().unwrap();
    let seen = reference::visible_tiles(&renderer.u1().unwrap(), &renderer.source.pyramid());
    let record = renderer.records.last().unwrap();
    assert_eq!(record.triples, record.visible.len(), "a tile seen twice is listed once");
    (record.visible.iter().copied().collect(), seen)
}

#[test]
fn behind_depth_alone_the_list_is_the_reference_set_and_without_it_a_superset() {
    let gpu = Device::open();
    for (name, _) in SHIPPED {
        let scene = scene(name);
        let mut exact = open(&gpu, &scene, [250, 141], |s| fuse(s, Dedup::FusedExact));
        let mut superset = open(&gpu, &scene, [250, 141], |s| fuse(s, Dedup::Fused));
        for camera in scene.cameras.keys() {
            let pose = pose(&scene, camera);
            exact.frame(&pose).unwrap();
            superset.frame(&pose).unwrap();
            let (listed, seen) = listed_and_seen(&mut exact);
            assert_eq!(listed, seen, "{name}, {camera}");
            let (listed, seen) = listed_and_seen(&mut superset);
            assert!(listed.is_superset(&seen), "{name}, {camera}");
            println!("{name}, {camera}: {} tiles, {} too many", seen.len(), listed.len() - seen.len());
        }
    }
}

/// Two planes, the lower one drawn first and hidden by the upper one, 100 m above it.
fn hidden_plane(scene: &ortelius::scene::Scene) -> SourceMesh {
    let lower = scene.source_mesh().unwrap();
    let mut both = lower.clone();
    let first = both.positions.len() as u32;
    both.positions.extend(lower.positions.iter().map(|p| *p + 100.0 * glam::DVec3::Z));
    // The upper plane shows the texture's first quarter alone.
    both.coordinates.extend(lower.coordinates.iter().map(|st| *st * 0.25));
    both.triangles.extend(lower.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
    both
}

#[test]
fn what_is_hidden_is_marked_only_without_depth_alone() {
    let gpu = Device::open();
    let scene = scene("plane");
    let mesh = gpu_mesh(&hidden_plane(&scene)).unwrap();
    let pose = pose(&scene, "nadir");
    let mut extra = Vec::new();
    for dedup in [Dedup::FusedExact, Dedup::Fused] {
        let mut settings = Settings::of_scene(&scene, ortelius::renderer::Target::Srgb8);
        settings.size = [320, 180];
        settings.streaming.gpu_tiles = 64;
        fuse(&mut settings, dedup);
        let source = scene.open_texture().unwrap();
        let mut renderer = Renderer::new(gpu.clone(), source, &mesh, settings).unwrap();
        renderer.frame(&pose).unwrap();
        let (listed, seen) = listed_and_seen(&mut renderer);
        assert!(listed.is_superset(&seen));
        extra.push(listed.len() - seen.len());
    }
    println!("{extra:?} too many");
    assert_eq!(extra[0], 0);
    assert!(extra[1] > 0, "the scene hides nothing: it proves nothing");
}

#[test]
fn the_settled_picture_is_the_papers_bit_for_bit() {
    let gpu = Device::open();
    for (name, camera) in [("earth", "oblique"), ("globe", "africa"), ("ruler", "antimeridian")] {
        let scene = scene(name);
        let pose = pose(&scene, camera);
        let picture = |change: &dyn Fn(&mut Settings)| {
            let mut renderer = open(&gpu, &scene, [320, 180], |settings| {
                settings.streaming.gpu_tiles = 192;
                change(settings);
            });
            renderer.settle(&pose).unwrap();
            assert_eq!(renderer.bias(), 0);
            renderer.picture_bytes().unwrap()
        };
        let paper = picture(&|_| ());
        for dedup in [Dedup::FusedExact, Dedup::Fused] {
            let fused = picture(&|settings| fuse(settings, dedup));
            let differing = paper.iter().zip(&fused).filter(|(a, b)| a != b).count();
            assert_eq!(differing, 0, "{name}, {camera}, {}: bytes of {}", dedup.name(), paper.len());
        }
    }
}

#[test]
fn a_list_that_overflows_is_compacted_again_and_a_fused_frame_has_no_u1() {
    let gpu = Device::open();
    let scene = scene("earth");
    let mut renderer = open(&gpu, &scene, [320, 180], |settings| {
        fuse(settings, Dedup::FusedExact);
        settings.config.list_capacity = 4;
    });
    renderer.frame(&pose(&scene, "oblique")).unwrap();
    let (listed, seen) = listed_and_seen(&mut renderer);
    assert!(renderer.records[0].overflowed && listed.len() > 4);
    assert_eq!(listed, seen);
    assert!(renderer.memory().iter().all(|(name, _)| *name != "U1"));
    assert_eq!(renderer.pipeline.passes(), ["upload", "fused", "compact", "read-back"]);
}

#[test]
fn the_papers_keying_is_refused_with_the_way_out() {
    let scene = scene("earth");
    let mut settings = Settings::of_scene(&scene, ortelius::renderer::Target::Srgb8);
    fuse(&mut settings, Dedup::Fused);
    settings.config.keying = Keying::Paper;
    let pyramid = scene.texture.pyramid().unwrap().unwrap();
    let line = settings.config.check(&pyramid).unwrap_err().to_string();
    assert!(line.contains("\"fused\"") && line.contains("variant.keying = \"native\""), "{line}");
}
