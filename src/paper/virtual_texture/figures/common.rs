//! What this paper's figures share: a scene by its name, a session on the run's device, passes timed alone.

use crate::figure::{Bench, Contender};
use crate::frame::Run;
use crate::math::camera::Pose;
use crate::model::mesh;
use crate::paper::virtual_texture::config::{open_texture, source_mesh};
use crate::paper::virtual_texture::{Settings, VirtualTexture, needs};
use crate::picture::Target;
use crate::scene::Scene;
use crate::scene::path::Path;
use crate::vk::{Frame, Gpu};
use anyhow::Context;

/// A shipped scene and one of its cameras, `earth/oblique`, or paths, `earth/pan`.
pub struct Place {
    pub scene: Scene,
    /// The camera's, or the path's first.
    pub pose: Pose,
    pub path: Option<Path>,
}

/// A session that looks at a place.
pub struct Opened {
    pub session: Run<VirtualTexture>,
    pub scene: Scene,
    pub pose: Pose,
    pub path: Option<Path>,
}

impl Place {
    /// # Errors
    /// A name that no shipped scene, path or camera has.
    pub fn find(name: &str) -> anyhow::Result<Place> {
        let (scene, eye) = name.split_once('/').with_context(|| format!("{name:?} is no SCENE/CAMERA"))?;
        let scene = Scene::embedded(scene)?;
        let path = scene.paths.get(eye).cloned();
        let pose = match &path {
            Some(path) => path.pose(0),
            None => scene.camera(eye)?.pose(),
        };
        Ok(Place { scene, pose, path })
    }

    /// A session at `size` pixels, on a device of its own; `change` has the last word on the settings. No frame is
    /// drawn yet: [`Opened::look`] where only lists count, [`Opened::settle`] where pictures do.
    ///
    /// # Errors
    /// What the device lacks, a texture that cannot be opened.
    pub fn open(
        self,
        bench: &Bench,
        size: [u32; 2],
        change: impl FnOnce(&mut Settings),
    ) -> anyhow::Result<Opened> {
        let Place { scene, pose, path } = self;
        let mut settings = Settings::of_scene(&scene, Target::Srgb8)?;
        settings.size = size;
        change(&mut settings);
        let source = open_texture(&scene)?;
        let gpu = bench.gpu(&needs(&settings.config, source.format()))?;
        let mesh = mesh::gpu_mesh(&source_mesh(&scene)?)?;
        Ok(Opened { session: VirtualTexture::run(gpu, source, &mesh, settings)?, scene, pose, path })
    }
}

impl Opened {
    /// One frame, waited for: `U1` and the lists are those of the pose; what is resident is not.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn look(&mut self) -> anyhow::Result<()> {
        self.session.frame(&self.pose)?;
        Ok(self.session.drain()?)
    }

    /// Frames until every visible tile is resident; returns how many.
    ///
    /// # Errors
    /// As [`Run<VirtualTexture>::settle`].
    pub fn settle(&mut self) -> anyhow::Result<u64> {
        let frames = self.session.settle(&self.pose)?;
        self.session.drain()?;
        Ok(frames)
    }
}

/// Pixels of a 16:9 picture of so many rows: a sweep's value.
pub fn pixels_of(rows: f64) -> [u32; 2] {
    [(rows * 16.0 / 9.0).round() as u32, rows as u32]
}

/// A contender that is the passes which `record` puts into a frame of their own.
pub fn passes<'a>(
    gpu: &'a Gpu,
    variant: impl Into<String>,
    mut record: impl FnMut(&mut Frame<'_>) -> crate::vk::Result<()> + 'a,
) -> Contender<'a> {
    let run = move || {
        let mut frame = gpu.frame()?;
        record(&mut frame)?;
        Ok(frame.submit()?.wait()?)
    };
    Contender { variant: variant.into(), run: Box::new(run) }
}
