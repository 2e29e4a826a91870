//! Playback of a scene's path in the window: play, pause and scrub.

use ortelius::scene::Scene;
use ortelius::scene::camera::Camera;
use ortelius::scene::path::{CameraPath, FRAMES_PER_SECOND, Motion};

/// The selected path, and the position on it.
#[derive(Default)]
pub struct Player {
    chosen: Option<(String, CameraPath)>,
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
        Some(Camera::from_pose(&path.pose_at(self.frame), like))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn player() -> Player {
        let player = Player::new(&Scene::embedded("globe").unwrap());
        assert_eq!(player.place(), Some((0.0, 300.0)));
        player
    }

    #[test]
    fn the_camera_moves_between_frames_too_and_stands_still_while_paused() {
        let mut player = player();
        player.advance(1.0);
        assert_eq!(player.place(), Some((0.0, 300.0)), "not playing yet");
        player.play();
        let mut heights = vec![player.camera().unwrap().altitude_m];
        for _ in 0..8 {
            // A quarter of a frame.
            player.advance(0.25 / f64::from(FRAMES_PER_SECOND));
            heights.push(player.camera().unwrap().altitude_m);
        }
        assert!(heights.windows(2).all(|pair| pair[1] < pair[0]), "{heights:?}");
        player.pause();
        let stands = player.camera();
        player.advance(1.0);
        assert!(player.camera() == stands && !player.is_playing());
        player.pause();
        player.advance(1.0);
        assert!(player.camera() != stands && player.is_playing());
    }

    #[test]
    fn a_path_is_scrubbed_to_a_frame_and_rests_there() {
        let mut player = player();
        let start = player.camera();
        player.play();
        player.seek(150.0);
        let middle = player.camera();
        player.advance(1.0);
        assert!(player.camera() == middle && middle != start && !player.is_playing());
        player.seek(300.0);
        player.play();
        assert_eq!(player.camera(), start, "from the end, it plays from the start");
        player.advance(1e3);
        assert!(!player.is_playing());
        assert_eq!(player.place(), Some((300.0, 300.0)));
    }
}
