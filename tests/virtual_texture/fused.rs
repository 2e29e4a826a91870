//! Draws that texture and also find the tiles, by marks in the tile mask or by triples in the request image: the list
//! is compared with stage 1's triples, and the picture with that of the paper's variant.

use crate::TextureSession;
use crate::lists::assert_lists;
use crate::{device, landscapes, open, pose, scene};
use ortelius::frame::{DrawList, FrameSlot, Shape, Technique, View};
use ortelius::math::camera::Pose;
use ortelius::math::pyramid::TileId;
use ortelius::model::mesh::{SourceMesh, gpu_mesh};
use ortelius::paper::virtual_texture::config::{open_texture, source_mesh};
use ortelius::paper::virtual_texture::method::ListAndDraw;
use ortelius::paper::virtual_texture::{
    Compaction, Config, Dedup, Listing, RequestDraw, TileAddress, reference,
};
use ortelius::paper::virtual_texture::{VirtualTexture, VirtualTextureSettings};
use ortelius::scene::Scene;
use ortelius::vk::Gpu;
use std::collections::BTreeSet;
use std::rc::Rc;

fn fuse(settings: &mut VirtualTextureSettings, dedup: Dedup) {
    settings.config.dedup = dedup;
    settings.config.address = TileAddress::OwnLevel;
    settings.config.compact = Compaction::Append;
}

/// The texturing draw stores the triples.
fn store_triples(settings: &mut VirtualTextureSettings) {
    fuse(settings, Dedup::Runs);
    settings.config.request_draw = RequestDraw::Texturing;
}

/// The last frame's listed tiles, and the tiles that its pixels request.
fn listed_and_seen(renderer: &mut TextureSession) -> (BTreeSet<TileId>, BTreeSet<TileId>) {
    renderer.drain().unwrap();
    let seen = reference::visible_tiles(&renderer.requests().unwrap(), &renderer.technique.source.pyramid());
    let record = renderer.records.last().unwrap();
    assert_eq!(record.triples, record.visible.len(), "a tile seen twice is listed once");
    (record.visible.iter().copied().collect(), seen)
}

/// The scene's mesh with the buffers for depth-only drawing.
fn shape(gpu: &Gpu, scene: &Scene) -> Rc<Shape> {
    let mesh = gpu_mesh(&source_mesh(scene).unwrap());
    Rc::new(Shape::with_depth_alone(gpu, &mesh).unwrap())
}

/// A variant that finds the tiles while it draws with a renderer's resident tiles.
struct Beside {
    config: Config,
    shape: Rc<Shape>,
    method: ListAndDraw,
}

impl Beside {
    fn new(gpu: &Gpu, renderer: &TextureSession, shape: &Rc<Shape>, config: Config) -> Beside {
        let (pyramid, resident) = (renderer.technique.source.pyramid(), &renderer.technique.resident);
        let method = ListAndDraw::new(gpu, &pyramid, &config, resident, renderer.target(), None).unwrap();
        Beside { config, shape: shape.clone(), method }
    }

    /// Draws `pose` and returns the visible-tile list.
    fn list(&mut self, gpu: &Gpu, renderer: &TextureSession, pose: &Pose) -> Vec<[u32; 3]> {
        let (resident, target) = (&renderer.technique.resident, renderer.target());
        let seen = DrawList::new([&*self.shape], View::new(pose, target.size()), 0);
        let mut frame = gpu.frame().unwrap();
        self.method.record(&mut frame, resident, &seen, target).unwrap();
        frame.submit().unwrap().wait().unwrap();
        self.method.collect(gpu, FrameSlot::FIRST).unwrap().0
    }

    /// Lists `pose`, which the renderer drew last, and compares the list with the renderer's request image. Returns the
    /// number of surplus triples.
    fn check(&mut self, gpu: &Gpu, renderer: &mut TextureSession, pose: &Pose, what: &str) -> usize {
        let triples = self.list(gpu, renderer, pose);
        let (requests, pyramid, address) =
            (renderer.requests().unwrap(), renderer.technique.source.pyramid(), self.config.address);
        let what = format!("{what}: {:?}", self.config);
        if self.config.dedup != Dedup::Fused {
            assert_lists(&requests, &pyramid, &triples, address, &what);
            return 0;
        }
        let entries: BTreeSet<[u32; 3]> = triples.iter().copied().collect();
        assert_eq!(entries.len(), triples.len(), "{what}: duplicate entry");
        let seen = match address {
            TileAddress::Level0 => reference::distinct_triples(&requests, &pyramid),
            TileAddress::OwnLevel => {
                let tiles = reference::visible_tiles(&requests, &pyramid);
                tiles.into_iter().map(|tile| [tile.level, tile.row, tile.column]).collect()
            }
        };
        assert!(entries.is_superset(&seen), "{what}");
        entries.len() - seen.len()
    }
}

const FUSED: [Dedup; 2] = [Dedup::FusedExact, Dedup::Fused];
const ADDRESSES: [TileAddress; 2] = [TileAddress::Level0, TileAddress::OwnLevel];

#[test]
fn after_a_depth_pass_the_list_is_the_reference_set_and_without_it_a_superset() {
    let gpu = device();
    for name in landscapes() {
        let scene = scene(name);
        let mut renderer = open(&gpu, &scene, [250, 141], |_| ());
        let config = renderer.technique.settings.config;
        let of = |dedup, address| Config { dedup, address, compact: Compaction::FusedAppend, ..config };
        let fused = FUSED.into_iter().flat_map(|dedup| ADDRESSES.map(|address| of(dedup, address)));
        let stores = |address| Config { request_draw: RequestDraw::Texturing, address, ..config };
        let configs = fused.chain(ADDRESSES.map(stores));
        let surface = shape(&gpu, &scene);
        let mut variants: Vec<Beside> =
            configs.map(|config| Beside::new(&gpu, &renderer, &surface, config)).collect();
        for camera in scene.cameras.keys() {
            let (pose, what) = (pose(&scene, camera), format!("{name}, {camera}"));
            renderer.frame(&pose).unwrap();
            renderer.drain().unwrap();
            let mut extra = variants.iter_mut().map(|v| v.check(&gpu, &mut renderer, &pose, &what));
            println!("{what}: surplus {:?}", extra.by_ref().collect::<Vec<_>>());
        }
    }
}

#[test]
fn every_compaction_after_a_fused_draw_lists_with_either_tile_address() {
    let gpu = device();
    let scene = scene("earth");
    let pose = pose(&scene, "oblique");
    let mut renderer = open(&gpu, &scene, [250, 141], |_| ());
    renderer.frame(&pose).unwrap();
    renderer.drain().unwrap();
    let (pyramid, surface) = (renderer.technique.source.pyramid(), shape(&gpu, &scene));
    let mut ran = 0;
    for &compact in Compaction::ALL {
        for (dedup, address) in FUSED.into_iter().flat_map(|dedup| ADDRESSES.map(|address| (dedup, address)))
        {
            let config = Config { dedup, address, compact, ..renderer.technique.settings.config };
            if config.check(&pyramid).is_err() {
                assert_eq!(compact, Compaction::TransformFeedback);
                continue;
            }
            Beside::new(&gpu, &renderer, &surface, config).check(
                &gpu,
                &mut renderer,
                &pose,
                "earth, oblique",
            );
            ran += 1;
        }
    }
    assert_eq!(ran, 4 * (Compaction::ALL.len() - 1));
}

/// Two planes: the lower one is drawn first and is hidden by the upper one, 100 m above it.
fn hidden_plane(scene: &Scene) -> SourceMesh {
    let lower = source_mesh(scene).unwrap();
    let mut both = lower.clone();
    let first = both.positions.len() as u32;
    both.positions.extend(lower.positions.iter().map(|p| *p + 100.0 * glam::DVec3::Z));
    // The upper plane has only the first quarter of the texture.
    both.coordinates.extend(lower.coordinates.iter().map(|st| *st * 0.25));
    both.triangles.extend(lower.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
    both
}

#[test]
fn hidden_tiles_are_listed_only_by_a_fused_draw_without_a_depth_pass() {
    let gpu = device();
    let scene = scene("plane");
    let mesh = gpu_mesh(&hidden_plane(&scene));
    let pose = pose(&scene, "nadir");
    let mut extra = Vec::new();
    let exact = |settings: &mut _| fuse(settings, Dedup::FusedExact);
    let superset = |settings: &mut _| fuse(settings, Dedup::Fused);
    let variants: [&dyn Fn(&mut VirtualTextureSettings); 3] = [&exact, &store_triples, &superset];
    for change in variants {
        let mut settings =
            VirtualTextureSettings::of_scene(&scene, ortelius::picture::PixelFormat::Srgb8).unwrap();
        settings.size = [320, 180];
        settings.streaming.gpu_tiles = 64;
        change(&mut settings);
        let source = open_texture(&scene).unwrap();
        let mut renderer = VirtualTexture::run(gpu.clone(), source, &mesh, settings).unwrap();
        renderer.frame(&pose).unwrap();
        let (listed, seen) = listed_and_seen(&mut renderer);
        assert!(listed.is_superset(&seen));
        extra.push(listed.len() - seen.len());
    }
    println!("{extra:?} surplus tiles");
    assert_eq!(extra[..2], [0, 0]);
    assert!(extra[2] > 0, "the scene hides nothing, so the test proves nothing");
}

#[test]
fn the_settled_picture_is_the_papers_bit_for_bit() {
    let gpu = device();
    for (name, camera) in [("earth", "oblique"), ("globe", "africa"), ("ruler", "antimeridian")] {
        let scene = scene(name);
        let pose = pose(&scene, camera);
        let picture = |change: &dyn Fn(&mut VirtualTextureSettings)| {
            let mut renderer = open(&gpu, &scene, [320, 180], |settings| {
                settings.streaming.gpu_tiles = 192;
                change(settings);
            });
            renderer.settle(&pose).unwrap();
            assert_eq!(renderer.technique.bias(), 0);
            renderer.picture_bytes().unwrap()
        };
        let paper = picture(&|_| ());
        let [exact, superset] = FUSED.map(|dedup| picture(&move |settings| fuse(settings, dedup)));
        let stores = picture(&store_triples);
        for (what, other) in [("fused-exact", exact), ("fused", superset), ("triples stored", stores)] {
            let differing = paper.iter().zip(&other).filter(|(a, b)| a != b).count();
            assert_eq!(differing, 0, "{name}, {camera}, {what}: bytes of {}", paper.len());
        }
    }
}

#[test]
fn every_list_can_be_made_from_the_triples_of_the_texturing_draw() {
    let gpu = device();
    let scene = scene("earth");
    for &list in Listing::ALL {
        let mut renderer = open(&gpu, &scene, [320, 180], |settings| {
            store_triples(settings);
            // Feedback of every pixel.
            (settings.config.list, settings.config.feedback_log2) = (list, 0);
        });
        renderer.frame(&pose(&scene, "oblique")).unwrap();
        let (listed, seen) = listed_and_seen(&mut renderer);
        assert!(seen.len() > 4);
        assert_eq!(listed, seen, "{list:?}");
        let passes = renderer.technique.passes();
        assert_eq!(passes[..2], ["upload", "fused"], "{list:?}: one draw");
        assert!(!passes.contains(&"footprint") && !passes.contains(&"texturing"), "{passes:?}");
    }
}

#[test]
fn an_overflowing_list_is_compacted_again_and_a_fused_frame_has_no_request_image() {
    let gpu = device();
    let scene = scene("earth");
    let passes: [&[&str]; 2] =
        [&["upload", "fused", "compact", "read-back"], &["upload", "fused", "read-back"]];
    for (compact, passes) in [Compaction::Append, Compaction::FusedAppend].into_iter().zip(passes) {
        let mut renderer = open(&gpu, &scene, [320, 180], |settings| {
            fuse(settings, Dedup::FusedExact);
            (settings.config.compact, settings.config.list_capacity) = (compact, 4);
        });
        // Each of the two frames in flight overflows once; the third frame has room.
        for overflows in [true, true, false] {
            renderer.frame(&pose(&scene, "oblique")).unwrap();
            let (listed, seen) = listed_and_seen(&mut renderer);
            assert_eq!(renderer.records.last().unwrap().overflowed, overflows, "{compact:?}");
            assert!(listed.len() > 4);
            assert_eq!(listed, seen, "{compact:?}");
        }
        assert!(renderer.memory().iter().all(|(name, _)| name != "request image"));
        // Depth-only draws have their own buffers: 74,886 positions of 24 bytes, and an index for each corner.
        let mesh = |dedup| {
            let renderer = open(&gpu, &scene, [320, 180], |settings| fuse(settings, dedup));
            renderer.memory().iter().find(|(name, _)| name == "mesh").unwrap().1
        };
        assert_eq!(mesh(Dedup::FusedExact), mesh(Dedup::Fused) + 74_886 * 24 + 149_768 * 12);
        assert_eq!(renderer.technique.passes(), passes);
    }
}
