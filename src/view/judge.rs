//! Two slow comparisons of the shown picture, drawn over the picture in false colours: the error against the f64
//! reference, and FLIP between two variants. A thread computes them from a copy of a settled picture while frames
//! continue.

use super::stage::Stage;
use egui::{Color32, ColorImage, Context, TextureHandle, TextureOptions};
use ortelius::frame::{PerFrame, View};
use ortelius::math::camera::Pose;
use ortelius::picture::write::Srgb8Picture;
use ortelius::picture::{Picture, flip, map, srgb};
use ortelius::renderer::truth::SceneTruth;
use ortelius::scene::Scene;
use ortelius::texture::source::TileSource;
use ortelius::vk::{Buffer, BufferUse, Frame, Gpu, Image, Result, TexelCopy};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Redraw interval while a map is computed.
pub const REFRESH: Duration = Duration::from_millis(150);

/// Block side of the first pass, in pixels. Each further pass halves it.
const FIRST_BLOCK: u32 = 16;

/// Rays along each axis of a relief's pixel: in the passes over blocks, then in two more passes over all pixels.
const RAYS: [u32; 3] = [1, 4, 12];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// Largest error of the three channels in linear light. The reference is the f64 mean over the pixel's
    /// area.
    Error,
    /// FLIP between the left and the right variant.
    Flip,
}

/// What a map shows. A new subject restarts the computation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Subject {
    pub question: Question,
    pub pose: Pose,
    pub size: [u32; 2],
    /// Increases with each change to the scene or its variants.
    pub edition: u64,
}

#[derive(Default)]
pub struct Judge {
    /// Copies of settled pictures that the GPU may still be writing, with their subjects.
    copies: PerFrame<Option<(Subject, Vec<Buffer>)>>,
    arrived: Option<(Subject, Vec<Buffer>)>,
    /// The running or the last computation.
    work: Option<(Subject, Arc<Work>)>,
    texture: Option<TextureHandle>,
}

/// State shared by the thread and the window.
struct Work {
    size: [u32; 2],
    stopped: AtomicBool,
    map: Mutex<Map>,
}

/// The errors computed so far.
struct Map {
    /// `None` before the pixel is computed, and where the reference sees no surface.
    errors: Vec<Option<f32>>,
    /// Pixels covered in the current pass. Early passes fill whole blocks.
    done: usize,
    /// Rays for each pixel in the current pass; `None` without reliefs.
    rays: Option<u32>,
    changed: bool,
    ended: bool,
    failed: Option<String>,
}

impl Map {
    fn new([width, height]: [u32; 2]) -> Map {
        let errors = vec![None; (width * height) as usize];
        Map { errors, done: 0, rays: None, changed: true, ended: false, failed: None }
    }
}

/// The thread's own copy of the reference's inputs.
struct Reference {
    scene: Scene,
    tiles: Option<Arc<dyn TileSource>>,
}

impl Reference {
    fn of(stage: &Stage) -> Reference {
        let texture = stage.renderer.technique.texture.as_ref();
        Reference { scene: stage.scene.clone(), tiles: texture.map(|texture| texture.source.clone()) }
    }
}

impl Judge {
    /// Reads the copies made two frames ago. Copies this frame's pictures if `subject` is new.
    ///
    /// # Errors
    /// Out of memory.
    pub fn step(
        &mut self,
        gpu: &Gpu,
        frame: &mut Frame<'_>,
        view: &View,
        pictures: [&Image; 2],
        subject: Option<Subject>,
    ) -> Result<()> {
        if let Some((of, buffers)) = self.copies[view.slot()].take()
            && subject == Some(of)
            && !self.is_about(&of)
        {
            self.arrived = Some((of, buffers));
        }
        let Some(subject) = subject.filter(|subject| !self.is_about(subject)) else { return Ok(()) };
        let bytes = 4 * u64::from(view.size[0]) * u64::from(view.size[1]);
        let copy = TexelCopy { offset: 0, mip: 0, layer: 0, at: [0; 2], size: view.size };
        let buffers = pictures.map(|_| gpu.buffer("judged picture", bytes, BufferUse::Readback));
        let buffers = buffers.into_iter().collect::<Result<Vec<_>>>()?;
        frame.pass("copy for the judge", |cmd| {
            for (picture, buffer) in pictures.into_iter().zip(&buffers) {
                cmd.copy_from_image(picture, buffer, &[copy]);
            }
        })?;
        self.copies[view.slot()] = Some((subject, buffers));
        Ok(())
    }

    /// Starts the computation once a copy has arrived.
    pub fn start_arrived(&mut self, stage: &Stage) {
        if let Some((of, buffers)) = self.arrived.take() {
            self.start(of, &buffers, Reference::of(stage));
        }
    }

    /// True if the map of `subject` is computed or in progress.
    pub fn is_about(&self, subject: &Subject) -> bool {
        self.work.as_ref().is_some_and(|(of, _)| of == subject)
    }

    fn start(&mut self, subject: Subject, copies: &[Buffer], reference: Reference) {
        self.stop();
        let [width, height] = subject.size;
        let pictures = copies.iter().map(|copy| Srgb8Picture { width, height, rgba: copy.mapped().to_vec() });
        let pictures: Vec<Srgb8Picture> = pictures.collect();
        let map = Mutex::new(Map::new(subject.size));
        let work = Arc::new(Work { size: subject.size, stopped: AtomicBool::new(false), map });
        let theirs = work.clone();
        let judge = move || match subject.question {
            Question::Flip => theirs.flip(&pictures),
            Question::Error => theirs.errors(&reference, &subject.pose, &pictures[0]),
        };
        if let Err(error) = std::thread::Builder::new().name("judge".to_owned()).spawn(judge) {
            work.end(Some(error.to_string()));
        }
        self.work = Some((subject, work));
    }

    /// Discards the map. The thread notices and ends.
    pub fn stop(&mut self) {
        if let Some((_, work)) = self.work.take() {
            work.stopped.store(true, Ordering::Relaxed);
        }
        self.texture = None;
    }

    /// True if a thread is computing.
    pub fn is_at_work(&self) -> bool {
        self.work.as_ref().is_some_and(|(_, work)| !work.map().ended)
    }

    /// The current map if it shows `subject`, and a line that describes it.
    pub fn show(&mut self, context: &Context, subject: &Subject) -> Option<(TextureHandle, String)> {
        let (_, work) = self.work.as_ref().filter(|(of, _)| of == subject)?;
        let mut map = work.map();
        let text = map.describe(subject.question);
        if std::mem::take(&mut map.changed) || self.texture.is_none() {
            let colours = map::Colours::new();
            let rgb = |[r, g, b]: [u8; 3]| Color32::from_rgb(r, g, b);
            let colour = |error: &Option<f32>| match error {
                Some(error) => rgb(colours.of(f64::from(*error))),
                None => Color32::TRANSPARENT,
            };
            let size = work.size.map(|side| side as usize);
            let image = ColorImage::new(size, map.errors.iter().map(colour).collect());
            self.texture = Some(context.load_texture("judgement", image, TextureOptions::NEAREST));
        }
        Some((self.texture.clone()?, text))
    }
}

impl Drop for Judge {
    fn drop(&mut self) {
        self.stop();
    }
}

impl Map {
    fn describe(&self, question: Question) -> String {
        if let Some(why) = &self.failed {
            return why.clone();
        }
        let known: Vec<f64> = self.errors.iter().flatten().map(|&error| f64::from(error)).collect();
        let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
        let max = known.iter().copied().fold(0.0, f64::max);
        let what = match question {
            Question::Error => "error against the reference, linear light",
            Question::Flip => "FLIP, left against right",
        };
        let rays = self.rays.map_or(String::new(), |rays| format!(", {rays} rays a pixel"));
        let share = 100 * self.done / self.errors.len().max(1);
        let progress = if self.ended { String::new() } else { format!(", {share} % of this pass") };
        format!(
            "{what}: mean {mean:.5}, largest {max:.4}{rays}{progress}; colours: black is 0, dark is 1e-5, light \
             is 1 (logarithmic)"
        )
    }
}

impl Work {
    fn map(&self) -> std::sync::MutexGuard<'_, Map> {
        self.map.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn end(&self, failed: Option<String>) {
        let mut map = self.map();
        (map.ended, map.changed, map.failed) = (true, true, failed);
    }

    fn flip(&self, pictures: &[Srgb8Picture]) {
        let [left, right] = [0, 1].map(|n| Picture::from(&pictures[n]));
        let found = flip::flip(&left, &right);
        let mut map = self.map();
        if let Ok(found) = &found {
            map.errors = found.values.iter().copied().map(Some).collect();
        }
        drop(map);
        self.end(found.err().map(|error| error.to_string()));
    }

    /// Computes every 16th pixel of every 16th row first, then halves the spacing in each pass. Then takes more rays
    /// for each pixel of a relief.
    fn errors(&self, reference: &Reference, pose: &Pose, shown: &Srgb8Picture) {
        let [width, height] = self.size;
        let truth = match SceneTruth::new(&reference.scene, reference.tiles.as_deref(), pose, self.size) {
            Ok(truth) => truth,
            Err(why) => return self.end(Some(why)),
        };
        let blocks = (0..=FIRST_BLOCK.ilog2()).rev().map(|log2| (1 << log2, RAYS[0]));
        let finer = RAYS[1..].iter().filter(|_| truth.has_reliefs()).map(|rays| (1, *rays));
        for (block, rays) in blocks.chain(finer) {
            self.map().rays = truth.has_reliefs().then_some(rays * rays);
            for y in (0..height).step_by(block as usize) {
                if self.stopped.load(Ordering::Relaxed) {
                    return;
                }
                let is_known = |x: u32| rays == RAYS[0] && [x, y].iter().all(|at| at % (2 * block) == 0);
                let is_new = |x: &u32| block == FIRST_BLOCK || !is_known(*x);
                let columns = (0..width).step_by(block as usize).filter(is_new);
                let error = |x| truth.pixel(x, y, rays).map(|truth| error(truth, shown, [x, y]));
                let found: Vec<(u32, Option<f32>)> = columns.map(|x| (x, error(x))).collect();
                self.fill(&found, y, block);
            }
        }
        self.end(truth.check_read().err());
    }

    /// Stores the errors of one row of blocks.
    fn fill(&self, found: &[(u32, Option<f32>)], top: u32, block: u32) {
        let [width, height] = self.size;
        let mut map = self.map();
        for &(left, error) in found {
            for y in top..(top + block).min(height) {
                for x in left..(left + block).min(width) {
                    map.errors[(y * width + x) as usize] = error;
                }
            }
        }
        map.done = (((top + block).min(height)) * width) as usize;
        map.changed = true;
    }
}

/// The largest error of the three channels, in linear light.
fn error(truth: [f64; 4], shown: &Srgb8Picture, [x, y]: [u32; 2]) -> f32 {
    let at = 4 * (y * shown.width + x) as usize;
    let apart = |channel: usize| (srgb::to_linear_f64(shown.rgba[at + channel]) - truth[channel]).abs();
    (0..3).map(apart).fold(0.0, f64::max) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::job::JobProgress;
    use ortelius::vk::{Feature, GpuOptions, Watched};

    fn work(size: [u32; 2]) -> Work {
        Work { size, stopped: AtomicBool::new(false), map: Mutex::new(Map::new(size)) }
    }

    /// The errors of a picture against the scene's reference. The picture is this reference with one wrong pixel.
    fn errors(scene: &Scene) -> (Vec<Option<f32>>, usize) {
        let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
        let (pose, size) = (scene.pose(0).unwrap(), [37, 21]);
        let stage = Stage::new(&gpu, scene.clone(), Vec::new(), size, true, &JobProgress::default()).unwrap();
        let reference = Reference::of(&stage);
        let truth = SceneTruth::new(scene, reference.tiles.as_deref(), &pose, size).unwrap();
        let background = [0.0, 0.0, 0.0, 1.0];
        let truth = |n: u32| truth.pixel(n % 37, n / 37, RAYS[2]);
        let pixel = |n: u32| truth(n).unwrap_or(background).map(|channel| channel as f32);
        let picture = Picture::new(37, 21, (0..37 * 21).map(pixel).collect());
        let mut shown = Srgb8Picture::from(&picture);
        let wrong = (381..37 * 21).find(|n| truth(*n as u32).is_some()).unwrap();
        shown.rgba[4 * wrong] ^= 0x80;
        let work = work(size);
        work.errors(&reference, &pose, &shown);
        let map = work.map();
        assert!(map.ended && map.failed.is_none(), "{:?}", map.failed);
        (map.errors.clone(), wrong)
    }

    #[test]
    fn the_reference_itself_has_no_error_and_one_wrong_pixel_is_found_at_its_place() {
        for name in ["globe", "plane-tilt", "relief-brick", "bunny"] {
            let scene = Scene::embedded(name).unwrap();
            let (errors, wrong) = errors(&scene);
            for (n, error) in errors.iter().enumerate() {
                // Half a code near white is 0.0045 of linear light.
                let Some(error) = error else { continue };
                assert_eq!(*error > 0.0046, n == wrong, "{}: pixel {n}: {error}", scene.name);
            }
        }
    }

    /// The median error of a renderer's picture. The reference shows the same scene with the changes `other`.
    fn median_error(gpu: &Gpu, scene: &Scene, other: &[String]) -> f32 {
        let (pose, size) = (scene.pose(0).unwrap(), [96, 54]);
        let mut stage =
            Stage::new(gpu, scene.clone(), Vec::new(), size, true, &JobProgress::default()).unwrap();
        stage.renderer.settle(&pose).unwrap();
        let rgba = stage.renderer.picture_bytes().unwrap();
        let shown = Srgb8Picture { width: size[0], height: size[1], rgba };
        let (reference, other) = (Reference::of(&stage), scene.with(other).unwrap());
        let truth = SceneTruth::new(&other, reference.tiles.as_deref(), &pose, size).unwrap();
        let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
        let mut errors: Vec<f32> =
            pixels.filter_map(|[x, y]| Some(error(truth.pixel(x, y, RAYS[1])?, &shown, [x, y]))).collect();
        errors.sort_by(f32::total_cmp);
        errors[errors.len() / 2]
    }

    #[test]
    fn renderer_and_reference_agree_on_light_meshes_and_textures_of_every_kind() {
        let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
        let scene = |name: &str, changes: &[&str]| {
            let changes: Vec<String> = changes.iter().map(|change| (*change).to_owned()).collect();
            Scene::embedded(name).unwrap().with(&changes).unwrap()
        };
        let plain = "surface.land.texture={kind='plain', source='earth'}";
        let scenes = [
            scene("globe", &["surface.land.lit=true"]),
            scene("globe", &[plain, "surface.land.filter={}"]),
            scene("globe", &[plain, "surface.land.filter={kind='ellipse', max_anisotropy=8}"]),
            scene("globe", &["surface.land.texture.format=bc1", "surface.land.lit=true"]),
            scene("relief-brick", &[]),
            scene("relief-rock", &[]),
            scene("bunny", &[]),
            scene("herd", &[]),
        ];
        for (n, scene) in scenes.iter().enumerate() {
            let own = median_error(&gpu, scene, &[]);
            // Most pixels of the herd lie on edges.
            assert!(own < 0.03, "scene {n}, {}: {own}", scene.name);
            // Without the sun, the reference is a different picture.
            let dark = median_error(&gpu, scene, &["sun.colour=[0.0, 0.0, 0.0]".to_owned()]);
            assert!(dark > 2.0 * own, "scene {n}, {}: {own}, without the sun {dark}", scene.name);
        }
        let own = median_error(&gpu, &scenes[4], &[]);
        let flat = median_error(&gpu, &scenes[4], &["surface.floor.relief.depth_m=1e-6".to_owned()]);
        assert!(flat > 2.0 * own, "{}: {own}, without the relief {flat}", scenes[4].name);
    }

    #[test]
    fn a_relief_agrees_better_with_more_rays() {
        let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
        let (scene, size) = (Scene::embedded("relief-brick").unwrap(), [96, 54]);
        let pose = scene.pose(0).unwrap();
        let mut stage =
            Stage::new(&gpu, scene.clone(), Vec::new(), size, true, &JobProgress::default()).unwrap();
        stage.renderer.settle(&pose).unwrap();
        let rgba = stage.renderer.picture_bytes().unwrap();
        let shown = Srgb8Picture { width: size[0], height: size[1], rgba };
        let truth = SceneTruth::new(&scene, None, &pose, size).unwrap();
        let mean = |rays: u32| {
            let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
            let errors = pixels.filter_map(|[x, y]| Some(error(truth.pixel(x, y, rays)?, &shown, [x, y])));
            let errors: Vec<f32> = errors.collect();
            errors.iter().sum::<f32>() / errors.len() as f32
        };
        let [one, several, many] = RAYS.map(mean);
        assert!(one > several && several > many, "{one} {several} {many}");
    }

    #[test]
    fn flip_is_0_for_equal_pictures_and_not_for_different_ones() {
        let picture = Srgb8Picture { width: 9, height: 5, rgba: [90, 120, 30, 255].repeat(45) };
        let equal = work([9, 5]);
        equal.flip(&[picture.clone(), picture.clone()]);
        assert!(equal.map().errors.iter().all(|error| *error == Some(0.0)) && equal.map().ended);
        let mut other = picture.clone();
        other.rgba[4 * 22] = 250;
        let apart = work([9, 5]);
        apart.flip(&[other, picture]);
        assert!(apart.map().errors[22].unwrap() > 0.1);
    }
}
