//! Two slow comparisons of the shown picture, drawn over it in false colours: the error against the f64
//! reference, and FLIP between two variants. A thread computes them from a copy of a settled picture while
//! frames continue.

use super::stage::Stage;
use egui::{Color32, ColorImage, Context, TextureHandle, TextureOptions};
use ortelius::frame::{PerFrame, View};
use ortelius::math::camera::Pose;
use ortelius::model::mesh::SourceMesh;
use ortelius::paper::virtual_texture::reference::picture::{Filter, Texels};
use ortelius::picture::write::Srgb8Picture;
use ortelius::picture::{Picture, flip, map, srgb};
use ortelius::reference;
use ortelius::scene::{Geometry, Surface};
use ortelius::texture::source::{TileFormat, TileSource};
use ortelius::vk::{Buffer, BufferUse, Frame, Gpu, Image, Result, TexelCopy};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Redraw interval while a map is computed.
pub const REFRESH: Duration = Duration::from_millis(150);

/// Block side of the first pass, in pixels. Each further pass halves it.
const FIRST_BLOCK: u32 = 16;

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
    changed: bool,
    ended: bool,
    failed: Option<String>,
}

/// Input of the reference: the texture, and the only mesh that uses it.
pub struct Ground {
    mesh: SourceMesh,
    source: Arc<dyn TileSource>,
}

impl Ground {
    /// The only surface that uses the virtual texture.
    ///
    /// # Errors
    /// Why the reference cannot render this scene.
    pub fn check(stage: &Stage) -> std::result::Result<&Surface, &'static str> {
        let technique = &stage.renderer.technique;
        let Some(texture) = &technique.texture else { return Err("the scene has no virtual texture") };
        let [carrier] = &technique.carriers[..] else { return Err("several surfaces use the texture") };
        if carrier.lit {
            return Err("the surface is lit, and the reference has no lighting");
        }
        if texture.source.format() != TileFormat::Rgba8 {
            return Err("the reference reads RGBA8 tiles, not block-compressed ones");
        }
        match &stage.scene.surfaces[&carrier.name] {
            Surface { geometry: Geometry::Other(_), .. } => {
                Err("the surface is not a grid, and the reference has no levels of detail")
            }
            surface => Ok(surface),
        }
    }

    pub fn of(stage: &Stage) -> Option<Ground> {
        let mesh = Ground::check(stage).ok()?.grid()?.ok()?;
        Some(Ground { mesh, source: stage.renderer.technique.texture.as_ref()?.source.clone() })
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
            Ok(())
        })?;
        self.copies[view.slot()] = Some((subject, buffers));
        Ok(())
    }

    /// Starts the computation once a copy has arrived.
    pub fn start_arrived(&mut self, stage: &Stage) {
        if let Some((of, buffers)) = self.arrived.take() {
            let ground = if of.question == Question::Error { Ground::of(stage) } else { None };
            self.start(of, &buffers, ground);
        }
    }

    /// True if the map of `subject` is computed or in progress.
    pub fn is_about(&self, subject: &Subject) -> bool {
        self.work.as_ref().is_some_and(|(of, _)| of == subject)
    }

    fn start(&mut self, subject: Subject, copies: &[Buffer], ground: Option<Ground>) {
        self.stop();
        let [width, height] = subject.size;
        let pictures = copies.iter().map(|copy| Srgb8Picture { width, height, rgba: copy.mapped().to_vec() });
        let pictures: Vec<Srgb8Picture> = pictures.collect();
        let map = Map {
            errors: vec![None; (width * height) as usize],
            done: 0,
            changed: true,
            ended: false,
            failed: None,
        };
        let work =
            Arc::new(Work { size: subject.size, stopped: AtomicBool::new(false), map: Mutex::new(map) });
        let theirs = work.clone();
        let judge = move || match (subject.question, ground) {
            (Question::Flip, _) => theirs.flip(&pictures),
            (Question::Error, Some(ground)) => theirs.errors(&ground, &subject.pose, &pictures[0]),
            (Question::Error, None) => theirs.end(Some("no reference".to_owned())),
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
        let most = known.iter().copied().fold(0.0, f64::max);
        let what = match question {
            Question::Error => "error against the reference, linear light",
            Question::Flip => "FLIP, left against right",
        };
        let share = 100 * self.done / self.errors.len().max(1);
        let progress = if self.ended { String::new() } else { format!(", {share} % of this pass") };
        format!(
            "{what}: mean {mean:.5}, largest {most:.4}{progress}; colours: black is 0, dark is 1e-5, light \
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

    /// Computes every 16th pixel of every 16th row first, then halves the spacing in each pass.
    fn errors(&self, ground: &Ground, pose: &Pose, shown: &Srgb8Picture) {
        let [width, height] = self.size;
        let view =
            reference::View::new(&ground.mesh, &pose.world_to_clip(width, height), pose.eye, self.size);
        let texels = Texels::new(&*ground.source);
        let mut block = FIRST_BLOCK;
        while block > 0 {
            for y in (0..height).step_by(block as usize) {
                if self.stopped.load(Ordering::Relaxed) {
                    return;
                }
                let is_new =
                    |x: &u32| block == FIRST_BLOCK || !([*x, y].iter().all(|at| at % (2 * block) == 0));
                let columns = (0..width).step_by(block as usize).filter(is_new);
                let found = columns.map(|x| {
                    let truth = view.sample(x, y).map(|sample| texels.pixel(&sample, Filter::Area));
                    (x, truth.map(|truth| error(truth, shown, [x, y])))
                });
                let found: Vec<(u32, Option<f32>)> = found.collect();
                self.fill(&found, y, block);
            }
            block /= 2;
        }
        self.end(texels.check().err().map(|error| error.to_string()));
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
    use ortelius::scene::Scene;
    use ortelius::vk::{Feature, GpuOptions, Watched};

    fn work(size: [u32; 2]) -> Work {
        let errors = vec![None; (size[0] * size[1]) as usize];
        let map = Map { errors, done: 0, changed: false, ended: false, failed: None };
        Work { size, stopped: AtomicBool::new(false), map: Mutex::new(map) }
    }

    #[test]
    fn the_reference_itself_has_no_error_and_one_wrong_pixel_is_found_at_its_place() {
        let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
        let base = Scene::embedded("globe").unwrap();
        let (pose, size) = (base.pose(0).unwrap(), [37, 21]);
        let stage = Stage::new(&gpu, base, Vec::new(), size, true).unwrap();
        let ground = Ground::of(&stage).unwrap();
        let view = reference::View::new(&ground.mesh, &pose.world_to_clip(37, 21), pose.eye, size);
        let truth = Texels::new(&*ground.source).picture(&view, Filter::Area).unwrap();
        let mut shown = Srgb8Picture::from(&truth);
        let wrong = 10 * 37 + 19;
        shown.rgba[4 * wrong] ^= 0x80;
        let work = work(size);
        work.errors(&ground, &pose, &shown);
        let map = work.map();
        assert!(map.ended && map.failed.is_none());
        for (n, error) in map.errors.iter().enumerate() {
            let seen = view.sample(n as u32 % 37, n as u32 / 37).is_some();
            assert_eq!(error.is_some(), seen, "pixel {n}");
            // Rounding to 8 bits costs half a code: 0.0045 in linear light near white.
            let Some(error) = error else { continue };
            assert_eq!(*error > 0.0046, n == wrong, "pixel {n}: {error}");
        }
    }

    #[test]
    fn flip_is_0_of_equal_pictures_alone() {
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
