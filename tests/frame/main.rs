//! The frame loop: after a resize or a switch of variants between frames, the picture equals that of a process that
//! draws nothing else. Validation and synchronisation validation are on; any message fails the test.

use ortelius::frame::{self, FrameSlot, Progress, Run, STALL, Stalled, Technique, View};
use ortelius::math::camera::Pose;
use ortelius::model::mesh::{Mesh, gpu_mesh};
use ortelius::paper::progressive_mesh::{self, LoadedMesh, ProgressiveMeshes, load};
use ortelius::paper::virtual_texture::config::{Filter, open_texture, source_mesh};
use ortelius::paper::virtual_texture::{
    self, Compaction, Config, Dedup, Filtering, Interpolation, Listing, ONE_SAMPLE, TileAddress,
    VirtualTexture, VirtualTextureError, VirtualTextureSettings, all_needs,
};
use ortelius::picture::PixelFormat;
use ortelius::scene::Scene;
use ortelius::texture::source::TileSource;
use ortelius::vk::{Frame, Gpu, GpuOptions, Need, PassTime, Watched};
use std::collections::VecDeque;
use std::process::Command;
use std::sync::Arc;
use std::time::Duration;

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
    settings: VirtualTextureSettings,
    pose: Pose,
}

impl Landscape {
    fn new() -> Landscape {
        let scene = Scene::embedded("ruler").unwrap();
        let mut settings = VirtualTextureSettings::of_scene(&scene, PixelFormat::Srgb8).unwrap();
        settings.streaming.deterministic = true;
        settings.streaming.gpu_tiles = 96;
        settings.streaming.load_tiles_per_frame = 64;
        settings.streaming.upload_tiles_per_frame = 64;
        Landscape {
            source: open_texture(&scene).unwrap(),
            mesh: gpu_mesh(&source_mesh(&scene).unwrap()),
            settings,
            pose: scene.camera("corner-oblique").unwrap().pose(),
        }
    }

    fn run(&self, gpu: &Gpu, size: [u32; 2], config: Config) -> Run<VirtualTexture> {
        let settings = VirtualTextureSettings { size, config, ..self.settings.clone() };
        VirtualTexture::run(gpu.clone(), self.source.clone(), &self.mesh, settings).unwrap()
    }
}

/// Two numbers that select a case. Their meaning depends on the test: the indices of a size and of a variant, or the
/// minimum number of frames to draw.
type Case = [u64; 2];

const CASE: &str = "ORTELIUS_TEST_CASE";
const PICTURE: &str = "ORTELIUS_TEST_PICTURE";

/// The picture of a new process: this binary, which runs `test` with `case` in its environment.
fn of_a_new_process(test: &str, case: Case) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("picture");
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", test]).env(CASE, format!("{} {}", case[0], case[1])).env(PICTURE, &picture);
    let ran = command.output().unwrap();
    let said = [ran.stdout, ran.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert!(ran.status.success() && said.contains("1 passed"), "{case:?}: {said}");
    std::fs::read(&picture).unwrap()
}

/// True in a process of [`of_a_new_process`]: its case is drawn and saved.
fn drew_a_case(draw: impl Fn(Case) -> Vec<u8>) -> bool {
    let Ok(case) = std::env::var(CASE) else { return false };
    let numbers: Vec<u64> = case.split(' ').map(|number| number.parse().unwrap()).collect();
    let bytes = draw(numbers.try_into().unwrap());
    std::fs::write(std::env::var_os(PICTURE).unwrap(), bytes).unwrap();
    true
}

/// Picture number `pictures` of a run that settles first. The number matters because it is the seed of the noise; all
/// frames of the settling picture count as one.
fn settled(mut run: Run<VirtualTexture>, pose: &Pose, pictures: u64) -> Vec<u8> {
    run.settle(pose).unwrap();
    (1..pictures).for_each(|_| run.frame(pose).unwrap());
    run.picture_bytes().unwrap()
}

#[test]
fn twenty_resizes_give_the_pictures_of_new_processes_without_leaks() {
    let gpu = device();
    let landscape = Landscape::new();
    let exact = Config { dedup: Dedup::FusedExact, compact: Compaction::Append, ..ONE_SAMPLE };
    let draw = |[n, config]: Case| {
        let run = landscape.run(&gpu, SIZES[n as usize], [ONE_SAMPLE, exact][config as usize]);
        settled(run, &landscape.pose, 1)
    };
    if drew_a_case(draw) {
        return;
    }
    for (number, config) in [ONE_SAMPLE, exact].into_iter().enumerate() {
        let mut run = landscape.run(&gpu, SIZES[0], config);
        run.settle(&landscape.pose).unwrap();
        run.drain().unwrap();
        let before = allocated(&gpu);
        for (n, size) in SIZES.into_iter().enumerate() {
            run.resize(size).unwrap();
            assert!(!run.settled(), "nothing of {size:?} is drawn yet");
            run.settle(&landscape.pose).unwrap();
            let test = "twenty_resizes_give_the_pictures_of_new_processes_without_leaks";
            let new = of_a_new_process(test, [n as u64, number as u64]);
            assert!(run.picture_bytes().unwrap() == new, "{:?}, {size:?}", config.dedup);
        }
        assert_eq!(allocated(&gpu), before, "{:?}: allocations after and before", config.dedup);
    }
}

#[test]
fn meshes_are_resized_too() {
    let gpu = device();
    // A larger picture wants other levels. Without this, they would follow over several frames.
    let at_once = "surface.bunny.geometry.pixels_per_second=1e6".to_owned();
    let scene = Scene::load_with("bunny", &[at_once]).unwrap();
    let models: Vec<LoadedMesh> = load(&scene).unwrap();
    let pose = scene.camera("near").unwrap().pose();
    let run = |size| {
        let own = progressive_mesh::ProgressiveMeshSettings::of_scene(&scene, PixelFormat::Srgb8).unwrap();
        ProgressiveMeshes::run(
            gpu.clone(),
            &models,
            progressive_mesh::ProgressiveMeshSettings { size, ..own },
        )
        .unwrap()
    };
    let draw = |[n, _]: Case| {
        let mut new = run(SIZES[n as usize]);
        new.frame(&pose).unwrap();
        new.picture_bytes().unwrap()
    };
    if drew_a_case(draw) {
        return;
    }
    let mut resized = run(SIZES[0]);
    for (n, size) in SIZES.into_iter().enumerate() {
        resized.resize(size).unwrap();
        resized.frame(&pose).unwrap();
        let new = of_a_new_process("meshes_are_resized_too", [n as u64, 0]);
        assert!(resized.picture_bytes().unwrap() == new, "{size:?}");
    }
}

/// Configurations that contain each variant of each setting at least once. Consecutive ones differ in many
/// settings.
fn variants(landscape: &Landscape) -> Vec<Config> {
    let base = Config { feedback_log2: 2, ..ONE_SAMPLE };
    let mut variants = vec![base];
    for (n, &dedup) in Dedup::ALL.iter().enumerate() {
        let address = if n % 2 == 0 { TileAddress::OwnLevel } else { TileAddress::Level0 };
        let of = |&compact: &Compaction| Config { dedup, compact, address, ..base };
        let fits = |config: &Config| config.check(&landscape.source.pyramid()).is_ok();
        let mut compactions = Compaction::ALL.iter().cycle().skip(n).take(Compaction::ALL.len()).map(of);
        let own_level = Config { dedup, compact: Compaction::Append, address: TileAddress::OwnLevel, ..base };
        variants.push(compactions.find(fits).unwrap_or(own_level));
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

fn switch(
    technique: &mut VirtualTexture,
    gpu: &Gpu,
    config: Config,
    target: &frame::Target,
) -> Result<(), virtual_texture::VirtualTextureError> {
    let settings = VirtualTextureSettings { config, ..technique.settings.clone() };
    technique.reconfigure(gpu, settings, (target, None))
}

#[test]
fn one_run_switches_to_every_variant_and_keeps_the_caches() {
    let gpu = device();
    let landscape = Landscape::new();
    let (size, pose) = ([160, 90], landscape.pose);
    let variants = variants(&landscape);
    let draw =
        |[n, pictures]: Case| settled(landscape.run(&gpu, size, variants[n as usize]), &pose, pictures);
    if drew_a_case(draw) {
        return;
    }
    for &dedup in Dedup::ALL {
        assert!(variants.iter().any(|config| config.dedup == dedup), "{dedup:?}");
    }
    for &compact in Compaction::ALL {
        assert!(variants.iter().any(|config| config.compact == compact), "{compact:?}");
    }
    let mut run = landscape.run(&gpu, size, variants[0]);
    run.settle(&pose).unwrap();
    run.drain().unwrap();
    let before = allocated(&gpu);
    for (n, &config) in variants.iter().enumerate() {
        run.records.take();
        run.reconfigure(|technique, gpu, target| switch(technique, gpu, config, target)).unwrap();
        run.settle(&pose).unwrap();
        let pictures = if config.filter.kind.is_random() { n as u64 + 2 } else { 1 };
        let test = "one_run_switches_to_every_variant_and_keeps_the_caches";
        let new = of_a_new_process(test, [n as u64, pictures]);
        assert!(run.picture_bytes().unwrap() == new, "{config:?}");
        assert_eq!(run.technique.passes().len(), run.records.last().unwrap().passes.len(), "{config:?}");
        // A list longer than the visible set may upload more tiles.
        if config.dedup != Dedup::Fused && !config.filter.kind.is_of_paper_3() {
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
    let mut run = landscape.run(&gpu, [64, 36], ONE_SAMPLE);
    run.settle(&landscape.pose).unwrap();
    let before = run.picture_bytes().unwrap();
    // Level-0 tile addresses have several bits for each tile.
    let wrong = Config { dedup: Dedup::Bitset, compact: Compaction::Append, ..ONE_SAMPLE };
    let error = run.reconfigure(|technique, gpu, target| switch(technique, gpu, wrong, target));
    let error = error.unwrap_err().to_string();
    assert!(error.contains("own-level"), "{error}");
    run.settle(&landscape.pose).unwrap();
    assert!(run.picture_bytes().unwrap() == before);
    assert_eq!(run.technique.settings.config, ONE_SAMPLE);
}

#[test]
fn frames_wait_for_semaphores_and_signal_them() {
    let gpu = device();
    let landscape = Landscape::new();
    let [mut first, mut second] = [(); 2].map(|()| landscape.run(&gpu, [64, 36], ONE_SAMPLE));
    for _ in 0..4 {
        let semaphore = gpu.semaphore("first is drawn").unwrap();
        first.frame_with(&landscape.pose, &[], &[&semaphore], |_, _, _, _| Ok(())).unwrap();
        second.frame_with(&landscape.pose, &[&semaphore], &[], |_, _, _, _| Ok(())).unwrap();
        first.drain().unwrap();
        second.drain().unwrap();
    }
    assert!(first.picture_bytes().unwrap() == second.picture_bytes().unwrap());
}

/// Draws nothing. Each frame reports the next entry of this list as its progress.
struct Reports(VecDeque<Progress>);

impl Technique for Reports {
    type Record = ();
    type Error = VirtualTextureError;

    fn needs(&self) -> Vec<Need> {
        Vec::new()
    }

    fn passes(&self) -> Vec<&'static str> {
        Vec::new()
    }

    fn retire(&mut self, _: &Gpu, _: FrameSlot, _: Vec<PassTime>) -> Result<(), VirtualTextureError> {
        Ok(())
    }

    fn prepare(&mut self, _: &Gpu, _: &View) -> Result<(), VirtualTextureError> {
        self.0.pop_front();
        Ok(())
    }

    fn record(&mut self, _: &mut Frame<'_>, _: &View, _: &frame::Target) -> Result<(), VirtualTextureError> {
        Ok(())
    }

    fn resize(&mut self, _: &Gpu, _: &frame::Target) -> Result<(), VirtualTextureError> {
        Ok(())
    }

    fn progress(&self) -> Progress {
        self.0[0]
    }

    fn memory(&self) -> frame::Allocations {
        Vec::new()
    }
}

#[test]
fn settling_gives_up_when_nothing_arrives_for_the_stated_time_and_not_while_something_arrives() {
    let gpu = device();
    let pose = Landscape::new().pose;
    let settle = |stall: Option<Duration>, progress: &[Progress]| {
        let target = frame::Target::new(&gpu, [8, 8], PixelFormat::Srgb8).unwrap();
        // Each frame drops the previous entry.
        let reports = [&[Progress::Settled], progress].concat();
        let mut run = Run::new((*gpu).clone(), Reports(reports.into()), target);
        assert_eq!(run.stall, STALL);
        run.stall = stall.unwrap_or(STALL);
        run.settle(&pose)
    };
    let waiting = Progress::Waiting { pending: 3 };
    // With a limit of zero, the first frame without an arrival ends the settling.
    let ended = settle(Some(Duration::ZERO), &[Progress::Arriving, waiting, Progress::Settled]);
    assert!(matches!(ended, Err(VirtualTextureError::Stalled(Stalled { pending: 3, .. }))), "{ended:?}");
    let arriving = [Progress::Arriving, Progress::Arriving, Progress::Settled];
    assert_eq!(settle(Some(Duration::ZERO), &arriving).unwrap(), 3);
    assert_eq!(settle(None, &[Progress::Arriving, waiting, Progress::Settled]).unwrap(), 3);
    let stated = Stalled { pending: 3, waited: STALL }.to_string();
    assert!(stated.starts_with("3 visible tiles are missing, and none arrived for 60 s; "), "{stated}");
}

/// A run requests the features of [`virtual_texture::needs`].
#[test]
fn a_run_asks_for_the_features_of_its_variant() {
    let gpu = device();
    let landscape = Landscape::new();
    let needs = virtual_texture::needs(&ONE_SAMPLE, landscape.source.format());
    assert_eq!(landscape.run(&gpu, [8, 8], ONE_SAMPLE).technique.needs().len(), needs.len());
    assert!(!needs.is_empty());
}
