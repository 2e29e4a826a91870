//! Records a path as numbered pictures, with a report. `ortelius render REPORT -o NAME.{frame}.png`
//! reproduces them.

use super::encode;
use super::stage::Stage;
use anyhow::Context;
use ortelius::frame::Records;
use ortelius::math::camera::Pose;
use ortelius::renderer::Renderer;
use ortelius::renderer::report::{Report, RunSection};
use std::path::{Path, PathBuf};

/// A recording in progress. It has its own renderer, so the frames do not depend on what the window showed
/// before.
pub struct Film {
    pub renderer: Renderer,
    run: RunSection,
    poses: Vec<Pose>,
    next: usize,
    folder: PathBuf,
}

impl Film {
    /// # Errors
    /// The folder cannot be created; or as [`Renderer::open`].
    pub fn new(stage: &Stage, path: &str, folder: &Path) -> anyhow::Result<Film> {
        let way = stage.scene.path(path)?;
        let folder = folder.join(format!("ortelius-{}-{path}", stage.scene.name));
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        // Deterministic budgets count tiles instead of time, so the frames are the same on every machine.
        let mut renderer = stage.another(&stage.scene, true)?;
        renderer.keep(Records::last_ones(1));
        let run = RunSection {
            camera: None,
            path: Some(path.to_owned()),
            frames: Some(way.frames),
            size: stage.renderer.size(),
            deterministic: true,
            ..RunSection::settled(&stage.scene)
        };
        let poses = (0..way.frames).map(|frame| way.pose(frame)).collect();
        Ok(Film { renderer, run, poses, next: 0, folder })
    }

    /// The next frame's pose; `None` at the end.
    pub fn pose(&self) -> Option<Pose> {
        self.poses.get(self.next).copied()
    }

    /// Frames written, and all frames.
    pub fn progress(&self) -> (usize, usize) {
        (self.next, self.poses.len())
    }

    /// Writes the frame just rendered. After the last frame, also writes the report, the animation and the
    /// film, and returns the folder.
    ///
    /// # Errors
    /// A file cannot be written (the error names its path); device lost.
    pub fn write(&mut self) -> anyhow::Result<Option<&Path>> {
        self.renderer.picture()?.save(&self.folder.join(format!("{:05}.png", self.next)))?;
        self.next += 1;
        if self.next < self.poses.len() {
            return Ok(None);
        }
        let path = self.run.path.as_deref().unwrap_or_default();
        let mut report = Report::of(&self.renderer, &self.run.name, path, None);
        report.run = Some(self.run.clone());
        report.save(&self.folder.join("report.json"))?;
        encode::animation(&self.folder, self.poses.len() as u32)?;
        if !encode::film(&self.folder)? {
            tracing::info!("ffmpeg is not installed: wrote pictures and an animated PNG, but no film");
        }
        Ok(Some(&self.folder))
    }
}
