//! Playback of a scene's path in the window: play, pause and scrub.

use super::encode::FRAMES_PER_SECOND;
use ortelius::scene::Scene;
use ortelius::scene::camera::Camera;
use ortelius::scene::path::{Motion, Path};

/// The selected path, and the position on it.
#[derive(Default)]
pub struct Player {
    chosen: Option<(String, Path)>,
    frame: f64,
    playing: bool,
}

impl Player {
    /// Starts with the path of `[view]`, or else with the scene's first path.
    pub fn new(scene: &Scene) -> Player {
        let name = scene.view.path.as_ref().or(scene.paths.keys().next());
        let chosen = name.and_then(|name| Some((name.clone(), scene.paths.get(name)?.clone())));
        Player { chosen, frame: 0.0, playing: false }
    }

    pub fn choose(&mut self, scene: &Scene, name: &str) {
        let chosen = scene.paths.get(name).map(|path| (name.to_owned(), path.clone()));
        *self = Player { chosen, ..Player::default() };
    }

    pub fn path(&self) -> Option<&String> {
        self.chosen.as_ref().map(|(name, _)| name)
    }

    pub fn is_playing(&self) -> bool {
        self.playing
    }

    /// The current frame and the last frame of the selected path.
    pub fn place(&self) -> Option<(f64, f64)> {
        self.chosen.as_ref().map(|(_, path)| (self.frame, f64::from(path.frames)))
    }

    /// Plays from the current position; from the start if the end is reached.
    pub fn play(&mut self) {
        self.playing = self.chosen.is_some();
        if self.place().is_some_and(|(frame, frames)| frame >= frames) {
            self.frame = 0.0;
        }
    }

    /// Toggles between playback and pause.
    pub fn pause(&mut self) {
        self.playing = !self.playing && self.chosen.is_some();
    }

    pub fn stop(&mut self) {
        self.playing = false;
    }

    /// Jumps to a frame and pauses there.
    pub fn seek(&mut self, frame: f64) {
        (self.frame, self.playing) = (frame, false);
    }

    pub fn advance(&mut self, seconds: f64) {
        let Some((_, frames)) = self.place().filter(|_| self.playing) else { return };
        self.frame = (self.frame + seconds * f64::from(FRAMES_PER_SECOND)).min(frames);
        self.playing = self.frame < frames;
    }

    /// The camera at the current position; `None` without a path.
    pub fn camera(&self) -> Option<Camera> {
        let (_, path) = self.chosen.as_ref()?;
        let like = match &path.motion {
            Motion::Orbit { start, .. } | Motion::Pan { start, .. } | Motion::Dive { start, .. } => start,
            Motion::Teleport { stops } => stops.first()?,
        };
        Some(Camera::of_pose(&path.pose(self.frame as u32), like))
    }
}
