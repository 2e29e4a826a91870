//! R: records a path as numbered pictures, with a report. `ortelius render REPORT -o NAME.{frame}.png` reproduces the
//! pictures.

use super::encode;
use super::job::{Job, JobProgress};
use super::stage::{self, Stage};
use anyhow::Context;
use ortelius::frame::Records;
use ortelius::math::camera::Pose;
use ortelius::renderer::report::{Report, RunSection};
use ortelius::scene::Scene;
use ortelius::scene::path::FRAMES_PER_SECOND;
use ortelius::vk::Gpu;
use std::path::{Path, PathBuf};

/// A recording. It has its own renderer, so the frames do not depend on what the window shows.
struct Film {
    gpu: Gpu,
    scene: Scene,
    run: RunSection,
    poses: Vec<Pose>,
    folder: PathBuf,
}

/// Records `path` on a thread.
///
/// # Errors
/// The folder cannot be created; the scene has no such path; a thread cannot be created.
pub fn start(stage: &Stage, path: &str, folder: &Path) -> anyhow::Result<Job<PathBuf>> {
    let way = stage.scene.path(path)?;
    let folder = folder.join(format!("ortelius-{}-{path}", stage.scene.name));
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let run = RunSection {
        camera: None,
        path: Some(path.to_owned()),
        frames: Some(way.frames),
        size: stage.renderer.size(),
        deterministic: true,
        ..RunSection::settled(&stage.scene)
    };
    let poses: Vec<Pose> = (0..way.frames).map(|frame| way.pose(frame)).collect();
    let (gpu, scene, frames) = (stage.renderer.gpu.clone(), stage.scene.clone(), poses.len());
    let film = Film { gpu, scene, run, poses, folder };
    Ok(Job::start("recording", frames, move |progress| film.record(progress))?)
}

impl Film {
    /// Writes the pictures, the report, the animation and the film. Returns the folder.
    fn record(self, progress: &JobProgress) -> anyhow::Result<PathBuf> {
        let Film { gpu, scene, run, poses, folder } = self;
        // Deterministic budgets count tiles instead of time, so the frames are the same on every machine.
        let mut renderer = stage::open(&gpu, &scene, run.size, run.deterministic, progress)?;
        progress.at_stop(renderer.technique.end_waits());
        renderer.frame_seconds = 1.0 / f64::from(FRAMES_PER_SECOND);
        renderer.keep(Records::last_ones(1));
        for (n, pose) in poses.iter().enumerate() {
            progress.check()?;
            renderer.frame(pose)?;
            renderer.picture()?.save(&folder.join(format!("{n:05}.png")))?;
            progress.advance();
        }
        let path = run.path.clone().unwrap_or_default();
        let mut report = Report::of(&renderer, &run.name, &path, None);
        drop(renderer);
        report.run = Some(run);
        report.save(&folder.join("report.json"))?;
        encode::animation(&folder, poses.len() as u32)?;
        if !encode::film(&folder)? {
            tracing::info!("ffmpeg is not installed: wrote pictures and an animated PNG, but no film");
        }
        Ok(folder)
    }
}
