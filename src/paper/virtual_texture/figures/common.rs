//! Shared by this paper's figures: scenes by name, sessions on the run's device, single passes to be timed.

use crate::figure::{Bench, Contender};
use crate::frame::Run;
use crate::math::camera::Pose;
use crate::model::mesh;
use crate::paper::virtual_texture::config::{open_texture, papers_scene, source_mesh};
use crate::paper::virtual_texture::{VirtualTexture, VirtualTextureSettings, needs};
use crate::picture::PixelFormat;
use crate::scene::Scene;
use crate::scene::path::Path;
use crate::vk::{Frame, Gpu};
use anyhow::Context;

/// A border that contains the paper's 16 samples. As in the paper, a pixel then needs the tile of its triple alone: no
/// sample lies in a neighbouring tile.
const PAPERS_BORDER: &str = "surface.land.texture.border=16";

/// A shipped scene with the paper's filter, in tiles with a border of 16 texels, and one of the scene's cameras
/// (`earth/oblique`) or paths (`earth/pan`).
pub struct SceneView {
    pub scene: Scene,
    /// The camera's pose, or the path's first one.
    pub pose: Pose,
    pub path: Option<Path>,
}

/// A session with the camera of a view.
pub struct Opened {
    pub session: Run<VirtualTexture>,
    pub scene: Scene,
    pub pose: Pose,
    pub path: Option<Path>,
}

impl SceneView {
    /// # Errors
    /// No shipped scene, path or camera has this name.
    pub fn find(name: &str) -> anyhow::Result<SceneView> {
        let (scene, eye) = name.split_once('/').with_context(|| format!("{name:?}: not SCENE/CAMERA"))?;
        let scene = papers_scene(scene)?.with(&[PAPERS_BORDER.into()])?;
        let path = scene.paths.get(eye).cloned();
        let pose = match &path {
            Some(path) => path.pose(0),
            None => scene.camera(eye)?.pose(),
        };
        Ok(SceneView { scene, pose, path })
    }

    /// A session of `size` pixels on a device of its own; `change` edits the settings last. No frame is drawn yet: use
    /// [`Opened::look`] if only lists are needed, [`Opened::settle`] for pictures.
    ///
    /// # Errors
    /// The device lacks a feature; the texture cannot be opened.
    pub fn open(
        self,
        bench: &Bench,
        size: [u32; 2],
        change: impl FnOnce(&mut VirtualTextureSettings),
    ) -> anyhow::Result<Opened> {
        let SceneView { scene, pose, path } = self;
        let mut settings = VirtualTextureSettings::of_scene(&scene, PixelFormat::Srgb8)?;
        settings.size = size;
        change(&mut settings);
        let source = open_texture(&scene)?;
        let gpu = bench.gpu(&needs(&settings.config, source.format()))?;
        let mesh = mesh::gpu_mesh(&source_mesh(&scene)?);
        Ok(Opened { session: VirtualTexture::run(gpu, source, &mesh, settings)?, scene, pose, path })
    }
}

impl Opened {
    /// Draws one frame and waits for it. The request image and the lists are then those of the pose, but the tiles may
    /// not be resident yet.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn look(&mut self) -> anyhow::Result<()> {
        self.session.frame(&self.pose)?;
        Ok(self.session.drain()?)
    }

    /// Draws frames until every visible tile is resident; returns their number.
    ///
    /// # Errors
    /// As [`Run<VirtualTexture>::settle`].
    pub fn settle(&mut self) -> anyhow::Result<u64> {
        let frames = self.session.settle(&self.pose)?;
        self.session.drain()?;
        Ok(frames)
    }
}

/// Size of a 16:9 picture with this many rows, a value of a sweep.
pub fn pixels_of(rows: f64) -> [u32; 2] {
    [(rows * 16.0 / 9.0).round() as u32, rows as u32]
}

/// A contender whose frame has only the passes that `record` adds.
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
