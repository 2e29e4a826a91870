//! The frame loop: after a resize or a switch of variants between frames, the picture equals that of a new run.
//! Validation and synchronisation validation are on; any message fails the test.

use ortelius::frame::{Run, Technique};
use ortelius::math::camera::Pose;
use ortelius::model::mesh::{Mesh, gpu_mesh};
use ortelius::paper::progressive_mesh::{self, Model, ProgressiveMeshes, load};
use ortelius::paper::virtual_texture::config::{Filter, open_texture, source_mesh};
use ortelius::paper::virtual_texture::{
    self, Compaction, Config, Dedup, Filtering, Interpolation, Listing, PAPER, Settings, TileAddress,
    VirtualTexture, all_needs,
};
use ortelius::picture::Target;
use ortelius::scene::Scene;
use ortelius::texture::source::TileSource;
use ortelius::vk::{Gpu, GpuOptions, Watched};
use std::sync::Arc;

/// Pixels: wide, high, odd, tiny, and back.
const SIZES: [[u32; 2]; 20] = [
    [160, 90],
    [90, 160],
    [1, 1],
    [161, 91],
    [320, 180],
    [17, 3],
    [160, 90],
    [64, 64],
    [200, 10],
    [10, 200],
    [255, 129],
    [256, 128],
    [2, 2],
    [128, 72],
    [160, 90],
    [33, 57],
    [100, 100],
    [320, 20],
    [48, 27],
    [160, 90],
];

fn device() -> Watched {
    Watched::open(&GpuOptions { needs: &all_needs(), ..GpuOptions::default() })
}

/// The current device allocations, without sizes: padding depends on the position of an allocation.
fn allocated(gpu: &Gpu) -> Vec<String> {
    gpu.allocations().unwrap().into_iter().map(|(name, _)| name).collect()
}

/// A landscape, and the inputs of its runs.
struct Landscape {
    source: Arc<dyn TileSource>,
    mesh: Mesh,
    settings: Settings,
    pose: Pose,
}

impl Landscape {
    fn new() -> Landscape {
        let scene = Scene::embedded("ruler").unwrap();
        let mut settings = Settings::of_scene(&scene, Target::Srgb8).unwrap();
        settings.streaming.deterministic = true;
        settings.streaming.gpu_tiles = 96;
        settings.streaming.load_tiles_per_frame = 64;
        settings.streaming.upload_tiles_per_frame = 64;
        Landscape {
            source: open_texture(&scene).unwrap(),
            mesh: gpu_mesh(&source_mesh(&scene).unwrap()).unwrap(),
            settings,
            pose: scene.camera("corner-oblique").unwrap().pose(),
        }
    }

    fn run(&self, gpu: &Gpu, size: [u32; 2], config: Config) -> Run<VirtualTexture> {
        let settings = Settings { size, config, ..self.settings.clone() };
        VirtualTexture::run(gpu.clone(), self.source.clone(), &self.mesh, settings).unwrap()
    }
}

/// The settled picture of a new run whose last frame has the same number as after `after` other frames, because
/// noise depends on it.
fn fresh(mut run: Run<VirtualTexture>, pose: &Pose, after: u64) -> Vec<u8> {
    let settled = run.settle(pose).unwrap();
    (settled..after).for_each(|_| run.frame(pose).unwrap());
    run.picture_bytes().unwrap()
}

#[test]
fn twenty_resizes_give_the_pictures_of_new_runs_without_leaks() {
    let gpu = device();
    let landscape = Landscape::new();
    for dedup in [Dedup::Geometry, Dedup::FusedExact] {
        let compact = if dedup.fused() { Compaction::Append } else { PAPER.compact };
        let config = Config { dedup, compact, ..PAPER };
        let mut run = landscape.run(&gpu, SIZES[0], config);
        run.settle(&landscape.pose).unwrap();
        run.drain().unwrap();
        let before = allocated(&gpu);
        for size in SIZES {
            run.resize(size).unwrap();
            assert!(!run.settled(), "nothing of {size:?} is drawn yet");
            run.settle(&landscape.pose).unwrap();
            let new = fresh(landscape.run(&gpu, size, config), &landscape.pose, 0);
            assert!(run.picture_bytes().unwrap() == new, "{dedup:?}, {size:?}");
        }
        assert_eq!(allocated(&gpu), before, "{dedup:?}: allocations after and before");
    }
}

#[test]
fn meshes_are_resized_too() {
    let gpu = device();
    let scene = Scene::embedded("bunny").unwrap();
    let models: Vec<Model> = load(&scene).unwrap();
    let pose = scene.camera("near").unwrap().pose();
    let run = |size| {
        let own = progressive_mesh::Settings::of_scene(&scene, Target::Srgb8).unwrap();
        ProgressiveMeshes::run(gpu.clone(), &models, progressive_mesh::Settings { size, ..own }).unwrap()
    };
    let mut resized = run(SIZES[0]);
    for size in SIZES {
        resized.resize(size).unwrap();
        resized.frame(&pose).unwrap();
        let mut new = run(size);
        new.frame(&pose).unwrap();
        assert!(resized.picture_bytes().unwrap() == new.picture_bytes().unwrap(), "{size:?}");
    }
}

/// Configurations that contain each variant of each setting at least once. Consecutive ones differ in many
/// settings.
fn variants(landscape: &Landscape) -> Vec<Config> {
    let base = Config { feedback_log2: 2, ..PAPER };
    let mut variants = vec![base];
    for (n, &dedup) in Dedup::ALL.iter().enumerate() {
        let address = if n % 2 == 0 { TileAddress::OwnLevel } else { TileAddress::Level0 };
        let of = |&compact: &Compaction| Config { dedup, compact, address, ..base };
        let fits = |config: &Config| config.check(&landscape.source.pyramid()).is_ok();
        let mut compactions = Compaction::ALL.iter().cycle().skip(n).take(Compaction::ALL.len()).map(of);
        let native = Config { dedup, compact: Compaction::Append, address: TileAddress::OwnLevel, ..base };
        variants.push(compactions.find(fits).unwrap_or(native));
    }
    variants.extend(Listing::ALL.iter().map(|&list| Config { list, ..base }));
    let filter = |kind| Filter { kind, samples: 2, ..base.filter };
    variants.extend(Filtering::ALL.iter().map(|&kind| Config { filter: filter(kind), ..base }));
    let literal = Filter { interpolation: Interpolation::Literal, ..base.filter };
    variants.push(Config { filter: literal, ..base });
    variants.push(Config { fade_in_frames: 3, ..base });
    variants.push(base);
    variants
}

#[test]
fn one_run_switches_to_every_variant_and_keeps_the_caches() {
    let gpu = device();
    let landscape = Landscape::new();
    let (size, pose) = ([160, 90], landscape.pose);
    let variants = variants(&landscape);
    for &dedup in Dedup::ALL {
        assert!(variants.iter().any(|config| config.dedup == dedup), "{dedup:?}");
    }
    for &compact in Compaction::ALL {
        assert!(variants.iter().any(|config| config.compact == compact), "{compact:?}");
    }
    let mut run = landscape.run(&gpu, size, variants[0]);
    let mut frames = run.settle(&pose).unwrap();
    run.drain().unwrap();
    let before = allocated(&gpu);
    for &config in &variants {
        run.records.take();
        run.reconfigure(|technique, gpu, target| technique.reconfigure(gpu, config, target)).unwrap();
        frames += run.settle(&pose).unwrap();
        let after = if config.filter.kind == Filtering::Stochastic { frames } else { 0 };
        let new = fresh(landscape.run(&gpu, size, config), &pose, after);
        assert!(run.picture_bytes().unwrap() == new, "{config:?}");
        assert_eq!(run.technique.passes().len(), run.records.last().unwrap().passes.len(), "{config:?}");
        // A list longer than the visible set may upload more tiles.
        if config.dedup != Dedup::Fused && config.filter.kind != Filtering::Ellipse {
            let uploads: usize = run.records.iter().map(|record| record.streaming.uploads).sum();
            assert_eq!(uploads, 0, "{config:?}: resident tiles were uploaded again");
        }
    }
    run.drain().unwrap();
    assert_eq!(allocated(&gpu), before, "allocations after and before");
}

#[test]
fn a_switch_that_fails_keeps_the_old_variant() {
    let gpu = device();
    let landscape = Landscape::new();
    let mut run = landscape.run(&gpu, [64, 36], PAPER);
    run.settle(&landscape.pose).unwrap();
    let before = run.picture_bytes().unwrap();
    // Level-0 tile addresses have several bits for each tile.
    let wrong = Config { dedup: Dedup::Bitset, compact: Compaction::Append, ..PAPER };
    let switch =
        |technique: &mut VirtualTexture, gpu: &Gpu, target: &_| technique.reconfigure(gpu, wrong, target);
    let error = run.reconfigure(switch).unwrap_err().to_string();
    assert!(error.contains("own-level"), "{error}");
    run.settle(&landscape.pose).unwrap();
    assert!(run.picture_bytes().unwrap() == before);
    assert_eq!(run.technique.settings.config, PAPER);
}

#[test]
fn frames_wait_for_semaphores_and_signal_them() {
    let gpu = device();
    let landscape = Landscape::new();
    let [mut first, mut second] = [(); 2].map(|()| landscape.run(&gpu, [64, 36], PAPER));
    for _ in 0..4 {
        let semaphore = gpu.semaphore("first is drawn").unwrap();
        first.frame_between(&landscape.pose, &[], &[&semaphore]).unwrap();
        second.frame_between(&landscape.pose, &[&semaphore], &[]).unwrap();
        first.drain().unwrap();
        second.drain().unwrap();
    }
    assert!(first.picture_bytes().unwrap() == second.picture_bytes().unwrap());
}

/// A run requests the features of [`virtual_texture::needs`].
#[test]
fn a_run_asks_for_the_features_of_its_variant() {
    let gpu = device();
    let landscape = Landscape::new();
    let needs = virtual_texture::needs(&PAPER, landscape.source.format());
    assert_eq!(landscape.run(&gpu, [8, 8], PAPER).technique.needs().len(), needs.len());
    assert!(!needs.is_empty());
}
