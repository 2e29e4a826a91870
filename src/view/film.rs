//! A path as numbered pictures, and the report with which `ortelius render -o NAME.{frame}.png` makes them again.

use super::stage::Stage;
use anyhow::Context;
use ortelius::frame::Records;
use ortelius::math::camera::Pose;
use ortelius::renderer::Renderer;
use ortelius::renderer::report::{Report, RunSection};
use std::path::{Path, PathBuf};

/// A recording under way. It has a renderer of its own, so that it does not hang on what the window showed before.
pub struct Film {
    pub renderer: Renderer,
    run: RunSection,
    poses: Vec<Pose>,
    next: usize,
    folder: PathBuf,
}

impl Film {
    /// # Errors
    /// A folder that cannot be made; as [`Renderer::open`].
    pub fn new(stage: &Stage, path: &str, folder: &Path) -> anyhow::Result<Film> {
        let way = stage.scene.path(path)?;
        let folder = folder.join(format!("ortelius-{}-{path}", stage.scene.name));
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        // Budgets in tiles: a frame of a film shows the same on every machine.
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

    /// (frames written, all frames)
    pub fn progress(&self) -> (usize, usize) {
        (self.next, self.poses.len())
    }

    /// Writes the frame that was just rendered; behind the last one, the report. Returns the folder once all is
    /// written.
    ///
    /// # Errors
    /// The disk, with the path; device lost.
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
        Ok(Some(&self.folder))
    }
}
