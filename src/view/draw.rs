//! What a frame shows: the layout of the panels, the passes of the overlays, the picture.

use super::action::{Action, CompareMode};
use super::eye;
use super::job::Job;
use super::judge::{Question, Subject};
use super::levels::Levels;
use super::live::{ECHO, LaidOut, Live};
use super::overlay::Overlay;
use super::probe::{LaidOpen, ProbedPixel};
use super::screen::{Arrangement, Pictures};
use super::shown::PanelInput;
use super::stage::Second;
use egui::{FullOutput, Pos2, RawInput, ViewportId};
use glam::DVec2;
use ortelius::math::camera::Pose;
use ortelius::paper::progressive_mesh::faces::Faces;
use ortelius::renderer::relief_steps::ReliefSteps;
use ortelius::scene::camera::Camera;
use std::time::{Duration, Instant};

impl Live {
    /// Passes the input to the panels. Returns their output and the requested actions.
    pub(super) fn lay_out(&mut self, raw: RawInput) -> (FullOutput, Vec<Action>) {
        let begin = Instant::now();
        let context = self.input.egui_ctx().clone();
        let judged = self.subject().and_then(|subject| self.judge.show(&context, &subject));
        let shown = PanelInput {
            stage: &self.stage,
            camera: &self.eye.camera,
            player: &self.player,
            film: self.film.as_ref().map(Job::progress),
            comparison: self.comparison,
            judged,
            trade: self.trade.as_ref(),
            overlay: self.overlay,
            found: self.probe.found.as_ref().filter(|_| self.magnifies),
            outline: self.outline(context.pixels_per_point()),
            labels: &self.labels.found,
            resources: &self.resources,
        };
        let panels = &mut self.panels;
        let mut actions = Vec::new();
        let has_events = !raw.events.is_empty();
        // egui may run the layout twice. The last run counts.
        let mut output = context.run_ui(raw, |ui| actions = panels.show(ui, &shown));
        let scrolls = context.input(|input| input.smooth_scroll_delta != egui::Vec2::ZERO);
        let repaint =
            output.viewport_output.get(&ViewportId::ROOT).map_or(Duration::MAX, |out| out.repaint_delay);
        let had_input = has_events || scrolls;
        self.laid_out = Some(LaidOut { at: Instant::now(), repaint, had_input, frames: 0 });
        self.textures.append(std::mem::take(&mut output.textures_delta));
        let platform = std::mem::take(&mut output.platform_output);
        self.input.handle_platform_output(&self.window, platform);
        self.cost.layout = begin.elapsed();
        (output, actions)
    }

    /// The values of the magnified pixel.
    pub(super) fn found(&self) -> Option<&ProbedPixel> {
        self.probe.found.as_ref().filter(|_| self.magnifies)
    }

    /// The outline of the frozen camera's view, in points of the window.
    fn outline(&self, pixels_per_point: f32) -> Vec<Option<Pos2>> {
        let Some(frozen) = &self.frozen else { return Vec::new() };
        let edge = eye::outline(frozen, &self.eye.camera, self.stage.renderer.size());
        let points = |at: DVec2| Pos2::new(at.x as f32, at.y as f32) / pixels_per_point;
        edge.into_iter().map(|at| at.map(points)).collect()
    }

    /// What the judge computes for the current comparison or overlay.
    pub(super) fn subject(&self) -> Option<Subject> {
        let question = match self.comparison {
            CompareMode::Flip if self.stage.second.is_some() => Question::Flip,
            _ if self.overlay == Some(Overlay::Error) => Question::Error,
            _ => return None,
        };
        let (pose, size) = (self.eye.camera.pose(), self.stage.renderer.size());
        Some(Subject { question, pose, size, edition: self.edition })
    }

    /// Draws the picture and the panels. Without `output`, the panels keep their last layout. Returns false if no image
    /// was available.
    pub(super) fn draw(&mut self, output: Option<FullOutput>) -> anyhow::Result<bool> {
        let window: [u32; 2] = self.window.inner_size().into();
        let acquiring = Instant::now();
        let acquired = self.screen.acquire(window)?;
        self.cost.display = acquiring.elapsed();
        let Some(number) = acquired else {
            (self.echo, self.laid_out) = (ECHO, None);
            return Ok(false);
        };
        if self.measure.as_ref().is_some_and(|measure| measure.response.is_some()) {
            self.screen.read_next(&self.stage.renderer.gpu)?;
        }
        let size = self.screen.swapchain.size();
        if self.stage.renderer.size() != size {
            self.stage.resize(size)?;
        }
        let points = self.input.egui_ctx().pixels_per_point();
        match output {
            Some(output) => {
                let begin = Instant::now();
                let (context, points) = (self.input.egui_ctx(), output.pixels_per_point);
                let shown = (&self.textures, output.shapes);
                self.screen.painter.prepare(context, shown, size, points)?;
                self.cost.triangles = begin.elapsed();
            }
            None if self.screen.painter.fits(size) => {
                self.laid_out.iter_mut().for_each(|laid_out| laid_out.frames += 1);
            }
            None => self.laid_out = None,
        }
        let arrangement = self.arrangement(size, points);
        self.render(number, &arrangement)?;
        self.screen.painter.drawn(&std::mem::take(&mut self.textures));
        let presenting = Instant::now();
        let is_presented = self.screen.swapchain.present(number, window)?;
        self.cost.display += presenting.elapsed();
        if !is_presented {
            self.screen.swapchain.resize(window)?;
            self.echo = ECHO;
        }
        Ok(true)
    }

    /// Creates the passes that the overlay or the magnifier needs, and drops those that are no longer needed.
    fn prepare_overlays(&mut self, is_still: bool) -> anyhow::Result<()> {
        let renderer = &self.stage.renderer;
        let (gpu, target) = (&renderer.gpu, renderer.target());
        let wanted = self.overlay.is_some() || self.magnifies;
        let texture = renderer.technique.texture.as_ref().filter(|_| wanted);
        self.levels = match (texture, self.levels.take().filter(|levels| levels.fits(target))) {
            (Some(texture), None) => Some(Levels::new(gpu, texture, target)?),
            (texture, levels) => texture.and(levels),
        };
        let shows_faces = self.magnifies || self.overlay.is_some_and(Overlay::is_of_meshes);
        let meshes = renderer.technique.meshes.as_ref().filter(|_| wanted && shows_faces);
        self.faces = match (meshes, self.faces.take().filter(|faces| faces.fits(target))) {
            (Some(meshes), None) => Some(Faces::new(gpu, meshes, target)?),
            (meshes, faces) => meshes.and(faces),
        };
        if let Some(faces) = &mut self.faces {
            // In motion, levels change in each frame, and all faces must be counted again after each change. So the
            // magnifier shows misses only at rest.
            faces.counts_misses = self.overlay == Some(Overlay::Misses) || self.magnifies && is_still;
        }
        let reliefs = self.overlay == Some(Overlay::Steps) && wanted;
        let plain = renderer.technique.plain.as_ref().filter(|_| reliefs);
        self.steps = match (plain, self.steps.take().filter(|steps| steps.fits(target))) {
            (Some(plain), None) => Some(ReliefSteps::new(gpu, plain, target)?),
            (plain, steps) => plain.and(steps),
        };
        Ok(())
    }

    /// The pose of the next frame, and the judge's subject if that frame's picture is complete.
    fn next_pose(&mut self) -> (Pose, Option<Subject>) {
        let pose: Pose = self.eye.camera.pose();
        // The last frame reports whether its picture is complete. That holds for this frame only if the pose
        // is the same.
        let is_still = self.last_pose == Some(pose);
        self.stage.lift_budgets(is_still);
        let subject = self.subject().filter(|_| is_still && self.stage.settled());
        self.last_pose = Some(pose);
        (pose, subject)
    }

    fn render(&mut self, number: usize, arrangement: &Arrangement) -> anyhow::Result<()> {
        let is_still = self.last_pose == Some(self.eye.camera.pose());
        self.prepare_overlays(is_still)?;
        let (pose, subject) = self.next_pose();
        self.judge.start_arrived(&self.stage);
        let frozen = self.frozen.as_ref().map(Camera::pose);
        self.stage.renderer.technique.frozen = frozen;
        let mut second = None;
        if let Some(Second { renderer, .. }) = &mut self.stage.second {
            renderer.technique.frozen = frozen;
            renderer.frame(&pose)?;
            second = Some(renderer.target().color.clone());
        }
        let renderer = &mut self.stage.renderer;
        renderer.gpu.list_resources(self.panels.shows_passes());
        let resources = &mut self.resources;
        let (steps, labels) = (&self.steps, &mut self.labels);
        let (screen, levels, faces, probe) = (&self.screen, &self.levels, &mut self.faces, &mut self.probe);
        let (gpu, overlay, judge) = (renderer.gpu.clone(), self.overlay, &mut self.judge);
        let [acquired, drawn] = screen.swapchain.semaphores(number);
        renderer.frame_with(&pose, &[acquired], &[drawn], |frame, view, surfaces, target| {
            let levels = levels.as_ref().zip(surfaces.texture.as_ref());
            if let Some((levels, texture)) = levels {
                levels.draw(frame, texture, view)?;
            }
            let levels = levels.map(|(levels, _)| levels);
            let named = levels.filter(|_| overlay == Some(Overlay::Levels));
            labels.step(&gpu, frame, view, (named.map(|levels| &levels.shown.image), arrangement.split))?;
            if let Some((faces, meshes)) = faces.as_mut().zip(surfaces.meshes.as_ref()) {
                faces.record(&gpu, frame, meshes, view)?;
            }
            let has_misses = faces.as_ref().is_some_and(|faces| faces.counts_misses);
            let faces = faces.as_ref().map(|faces| &faces.image);
            if let Some(steps) = steps {
                steps.record(frame, surfaces, view)?;
            }
            let pictures = Pictures {
                left: &target.color,
                right: second.as_ref().unwrap_or(&target.color),
                words: match overlay {
                    Some(overlay) if overlay.is_of_meshes() => faces,
                    Some(Overlay::Steps) => steps.as_ref().map(|steps| &steps.image),
                    _ => levels.map(|levels| &levels.shown.image),
                },
            };
            judge.step(&gpu, frame, view, [pictures.left, pictures.right], subject)?;
            let at = arrangement.magnified;
            let is_right = at.is_some_and(|at| at[0] >= arrangement.split as i32);
            let picture = if is_right { pictures.right } else { pictures.left };
            let laid_open = LaidOpen { levels, faces, has_misses };
            probe.step(&gpu, frame, view, (target, picture, laid_open), at)?;
            screen.record(frame, number, pictures, arrangement)?;
            *resources = frame.resources().to_vec();
            Ok(())
        })?;
        Ok(())
    }

    fn arrangement(&self, size: [u32; 2], points: f32) -> Arrangement {
        let compares = self.stage.second.is_some();
        let pointer = self.input.egui_ctx().pointer_latest_pos();
        let magnified = pointer.map(|at| [at.x, at.y].map(|at| (at * points) as i32));
        Arrangement {
            split: if compares { (self.divider * size[0] as f32) as u32 } else { size[0] + 1 },
            gain: if compares && self.comparison == CompareMode::Difference { 8.0 } else { 0.0 },
            magnified: magnified.filter(|_| self.magnifies),
            overlay: self.overlay.map_or(0, Overlay::number),
        }
    }
}
