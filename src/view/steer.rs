//! Moves the camera: by input, along a path, above the ground.

use super::control::{self, Pane};
use super::live::{ECHO, Live};

impl Live {
    pub(super) fn move_eye(&mut self, seconds: f64) {
        let context = self.input.egui_ctx().clone();
        let before = self.eye.camera;
        self.eye.advance(seconds);
        let pane = Pane {
            size: self.stage.renderer.size(),
            pixels_per_point: context.pixels_per_point(),
            divider: self.stage.second.as_ref().map(|_| self.divider),
        };
        let was = (self.eye.camera, self.eye.is_under_way());
        let divider = control::steer(&context, &mut self.eye, &mut self.hold, &pane, seconds);
        if (self.eye.camera, self.eye.is_under_way()) != was {
            self.player.stop();
        }
        self.divider = divider.unwrap_or(self.divider);
        if self.player.is_playing() {
            self.player.advance(seconds);
            self.follow_path();
        } else {
            self.eye.rise_above(self.ground.height_m(&self.eye.camera));
        }
        if self.eye.camera != before {
            self.ground.begin();
        }
        if self.eye.camera != before || divider.is_some() {
            self.echo = ECHO;
        }
    }

    pub(super) fn follow_path(&mut self) {
        if let Some(camera) = self.player.camera() {
            self.eye.set(camera);
        }
    }
}
