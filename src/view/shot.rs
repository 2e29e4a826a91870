//! F12: saves a picture, and a report that reproduces it bit for bit.

use super::stage::Stage;
use anyhow::Context;
use ortelius::frame::Technique;
use ortelius::math::camera::Pose;
use ortelius::renderer::Renderer;
use ortelius::renderer::report::{Report, RunSection};
use ortelius::scene::Scene;
use ortelius::scene::camera::Camera;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The name of the window's camera in the report's scene.
const NAME: &str = "window";

/// A screenshot in progress. It renders the view as `ortelius render` does: a new renderer that runs until no tile is
/// missing. The window's own picture may depend on its history: on tiles loaded for an earlier camera, or on times
/// measured by the governor.
pub struct Shot {
    renderer: Renderer,
    run: RunSection,
    pose: Pose,
    /// See [`Renderer::settle_once`].
    last_arrival: Instant,
    folder: PathBuf,
}

/// The scene with the window's camera as its view.
///
/// # Errors
/// The camera is outside the range that scenes allow.
fn with_camera(scene: &Scene, camera: &Camera) -> anyhow::Result<Scene> {
    Ok(scene.with(&[camera.to_change(NAME), format!("view.camera={NAME}")])?)
}

impl Shot {
    /// # Errors
    /// As [`Renderer::open`].
    pub fn new(stage: &Stage, camera: &Camera, folder: &Path) -> anyhow::Result<Shot> {
        let scene = with_camera(&stage.scene, camera)?;
        let deterministic = stage.deterministic();
        let run = RunSection {
            camera: Some(NAME.to_owned()),
            path: None,
            size: stage.renderer.size(),
            deterministic,
            ..RunSection::settled(&scene)
        };
        let mut renderer = stage.another(&scene, deterministic)?;
        renderer.technique.lift_budgets(true);
        let (pose, folder) = (camera.pose(), folder.to_owned());
        Ok(Shot { renderer, run, pose, last_arrival: Instant::now(), folder })
    }

    /// Renders one frame. Returns the picture's path once no tile is missing and the files are written.
    ///
    /// # Errors
    /// A file cannot be written (the error names its path); no tile arrives for a minute; device lost.
    pub fn step(&mut self) -> anyhow::Result<Option<PathBuf>> {
        if !self.renderer.settle_once(&self.pose, &mut self.last_arrival)? {
            return Ok(None);
        }
        self.renderer.drain()?;
        let picture = free_name(&self.folder, &self.run.name)?;
        self.renderer.picture()?.save(&picture)?;
        let mut report = Report::of(&self.renderer, &self.run.name, NAME, None);
        report.run = Some(self.run.clone());
        report.save(&picture.with_extension("json"))?;
        Ok(Some(picture))
    }
}

/// `FOLDER/ortelius-SCENE-NNN.png` with the first free number.
fn free_name(folder: &Path, scene: &str) -> anyhow::Result<PathBuf> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let name = |n: u32| folder.join(format!("ortelius-{scene}-{n:03}.png"));
    let free = |path: &PathBuf| !path.exists() && !path.with_extension("json").exists();
    (1..).map(name).find(free).context("all numbered names are taken")
}
