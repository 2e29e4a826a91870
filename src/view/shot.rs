//! F12: saves a picture, and a report that reproduces it bit for bit.

use super::job::{Job, JobProgress};
use super::stage::{self, Stage};
use anyhow::Context;
use ortelius::frame::{Records, Technique};
use ortelius::math::camera::Pose;
use ortelius::renderer::report::{Report, RunSection};
use ortelius::scene::Scene;
use ortelius::scene::camera::Camera;
use ortelius::vk::Gpu;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The name of the window's camera in the report's scene.
const NAME: &str = "window";

/// A screenshot. It renders the view as `ortelius render` does: a new renderer that runs until no tile is missing. The
/// window's own picture may depend on its history: on tiles loaded for an earlier camera, or on times measured by the
/// governor.
struct Shot {
    gpu: Gpu,
    scene: Scene,
    run: RunSection,
    pose: Pose,
    folder: PathBuf,
}

/// The scene with the window's camera as its view.
///
/// # Errors
/// The camera is outside the range that scenes allow.
fn with_camera(scene: &Scene, camera: &Camera) -> anyhow::Result<Scene> {
    Ok(scene.with(&[camera.to_change(NAME), format!("view.camera={NAME}")])?)
}

/// Takes the screenshot on a thread.
///
/// # Errors
/// The camera is outside the range that scenes allow; a thread cannot be created.
pub fn start(stage: &Stage, camera: &Camera, folder: &Path) -> anyhow::Result<Job<PathBuf>> {
    let scene = with_camera(&stage.scene, camera)?;
    let run = RunSection {
        camera: Some(NAME.to_owned()),
        path: None,
        size: stage.renderer.size(),
        deterministic: stage.deterministic(),
        ..RunSection::settled(&scene)
    };
    let (gpu, pose, folder) = (stage.renderer.gpu.clone(), camera.pose(), folder.to_owned());
    let shot = Shot { gpu, scene, run, pose, folder };
    Ok(Job::start("screenshot", 1, move |progress| shot.take(progress))?)
}

impl Shot {
    /// Writes the picture and the report. Returns the picture's path.
    fn take(self, progress: &JobProgress) -> anyhow::Result<PathBuf> {
        let Shot { gpu, scene, run, pose, folder } = self;
        let mut renderer = stage::open(&gpu, &scene, run.size, run.deterministic, progress)?;
        progress.at_stop(renderer.technique.end_waits());
        renderer.keep(Records::all());
        renderer.technique.lift_budgets(true);
        let mut last_arrival = Instant::now();
        while !renderer.settle_once(&pose, &mut last_arrival)? {
            progress.check()?;
        }
        renderer.drain()?;
        let picture = free_name(&folder, &run.name)?;
        renderer.picture()?.save(&picture)?;
        let mut report = Report::of(&renderer, &run.name, NAME, None);
        report.run = Some(run);
        report.save(&picture.with_extension("json"))?;
        Ok(picture)
    }
}

/// `FOLDER/ortelius-SCENE-NNN.png` with the first free number.
fn free_name(folder: &Path, scene: &str) -> anyhow::Result<PathBuf> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let name = |n: u32| folder.join(format!("ortelius-{scene}-{n:03}.png"));
    let free = |path: &PathBuf| !path.exists() && !path.with_extension("json").exists();
    (1..).map(name).find(free).context("all numbered names are taken")
}
