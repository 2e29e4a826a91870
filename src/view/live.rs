//! The open window, frame by frame: input, panels, actions, picture.

use super::Opening;
use super::action::{Action, Comparison};
use super::bookmarks::Bookmarks;
use super::control::{self, Hold, Pane};
use super::eye::{self, Eye};
use super::job::{self, Job};
use super::judge::{self, Judge, Question, Subject};
use super::labels::Labels;
use super::levels::Levels;
use super::measure::{Measure, PanelsCost};
use super::overlay::Overlay;
use super::panels::Panels;
use super::path::Player;
use super::probe::{Found, LaidOpen, Probe};
use super::reload::{self, Reload};
use super::screen::{Arrangement, PANELS_PASS, Pictures, Screen};
use super::shown::{Front, Shown};
use super::stage::{Second, Stage};
use super::terrain::Terrain;
use egui::{FullOutput, Pos2, RawInput, TexturesDelta, ViewportId};
use glam::DVec2;
use ortelius::math::camera::Pose;
use ortelius::paper::progressive_mesh::faces::Faces;
use ortelius::renderer::relief_steps::ReliefSteps;
use ortelius::scene::camera::Camera;
use ortelius::vk::Gpu;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::event::WindowEvent;
use winit::window::Window;

/// Frames drawn after the last change, so that the results of the frames in flight are shown too. The values that the
/// inspector and the labels show are read back two frames later, laid out in the third, and drawn in the fourth.
pub(super) const ECHO: u32 = 5;

/// Age of the values in the panels at which they are laid out again while the picture changes. On a slow device this
/// may be each frame, so that some frames must draw the last layout first, unless the values are older than the
/// second age.
const PANELS_AGE: [Duration; 2] = [Duration::from_millis(100), Duration::from_millis(500)];
const PANELS_FRAMES: u32 = 3;

/// Longest time step of the camera, even if a frame took longer.
const LONGEST_FRAME_S: f64 = 0.1;

pub struct Live {
    pub(super) stage: Stage,
    pub(super) film: Option<Job>,
    pub(super) shot: Option<Job>,
    pub(super) screen: Screen,
    pub(super) input: egui_winit::State,
    /// Changes to the panels' textures that no frame has uploaded yet.
    textures: TexturesDelta,
    pub(super) eye: Eye,
    hold: Option<Hold>,
    pub(super) player: Player,
    pub(super) panels: Panels,
    pub(super) bookmarks: Bookmarks,
    pub(super) magnifies: bool,
    pub(super) comparison: Comparison,
    pub(super) trade: Option<Front>,
    judge: Judge,
    /// Increases with each change that alters the picture of a fixed pose.
    pub(super) edition: u64,
    /// The pose of the last frame.
    last_pose: Option<Pose>,
    terrain: Terrain,
    measure: Option<Measure>,
    /// Of this frame.
    panels_cost: PanelsCost,
    /// Close the window once the path is recorded.
    records_alone: bool,
    pub(super) overlay: Option<Overlay>,
    probe: Probe,
    labels: Labels,
    pub(super) levels: Option<Levels>,
    pub(super) faces: Option<Faces>,
    pub(super) steps: Option<ReliefSteps>,
    pub(super) reload: Reload,
    /// The camera that streaming and culling keep after F. The picture is drawn from another camera.
    pub(super) frozen: Option<Camera>,
    /// Position of the divider, as a share of the width.
    divider: f32,
    pub(super) folder: PathBuf,
    last_frame: Instant,
    /// Frames still to draw without further changes.
    pub(super) echo: u32,
    /// The last layout of the panels; `None`: the next frame lays them out.
    laid_out: Option<LaidOut>,
    pub(super) window: Arc<Window>,
}

/// A layout of the panels. Later frames draw it again until [`Live::is_layout_due`].
struct LaidOut {
    at: Instant,
    /// Delay until the panels need a redraw.
    repaint: Duration,
    /// It had input, whose effects end in the next layout.
    had_input: bool,
    /// Later frames that have drawn it.
    frames: u32,
}

impl Live {
    /// # Errors
    /// The device cannot present to the window; or as [`Stage::new`].
    pub fn new(gpu: &Gpu, window: Arc<Window>, opening: &Opening) -> anyhow::Result<Live> {
        let size: [u32; 2] = window.inner_size().into();
        let screen =
            Screen::new(gpu, gpu.surface(&window)?, size, (opening.present.clone(), opening.measure))?;
        let variants = opening.variants.clone();
        let picture = screen.swapchain.size().map(|side| side.max(1));
        let stage = Stage::new(gpu, opening.scene.clone(), variants, picture, opening.deterministic)?;
        let context = egui::Context::default();
        // Nothing fades in: a change is complete in one frame, and equal input gives equal pictures.
        context.all_styles_mut(|style| style.animation_time = 0.0);
        let factor = Some(window.scale_factor() as f32);
        let input = egui_winit::State::new(context, ViewportId::ROOT, &*window, factor, None, None);
        let measure = || Measure::new(&stage.scene, opening.times.clone());
        let measure = opening.measure.then(measure).transpose()?;
        let (bookmarks, read) = Bookmarks::open(&stage.scene);
        let mut panels = Panels::new(opening.panels);
        if let Err(error) = read {
            tracing::warn!("{error:#}");
            panels.say(format!("{error:#}"), true);
        }
        Ok(Live {
            terrain: Terrain::of(&stage.scene),
            measure,
            panels_cost: PanelsCost::default(),
            records_alone: false,
            player: Player::new(&stage.scene),
            stage,
            film: None,
            shot: None,
            screen,
            input,
            textures: TexturesDelta::default(),
            eye: Eye::new(opening.camera),
            hold: None,
            panels,
            bookmarks,
            magnifies: false,
            comparison: Comparison::Pictures,
            trade: opening.trade.as_ref().map(Front::of),
            judge: Judge::default(),
            edition: 0,
            last_pose: None,
            overlay: None,
            probe: Probe::default(),
            labels: Labels::default(),
            levels: None,
            faces: None,
            steps: None,
            reload: Reload::default(),
            frozen: None,
            divider: 0.5,
            folder: opening.folder.clone(),
            last_frame: Instant::now(),
            echo: ECHO,
            laid_out: None,
            window,
        })
    }

    /// Records the path and does nothing else.
    ///
    /// # Errors
    /// The scene has no path; the folder cannot be created.
    pub fn record(&mut self) -> anyhow::Result<()> {
        self.records_alone = true;
        self.act(Action::Record)
    }

    /// Handles a window event.
    pub fn event(&mut self, event: &WindowEvent) {
        let repeats = matches!(event, WindowEvent::KeyboardInput { event, .. } if event.repeat);
        // A held key flies. Only a text field has a use for its repetitions.
        if repeats && !self.input.egui_ctx().egui_wants_keyboard_input() {
            return;
        }
        let response = self.input.on_window_event(&self.window, event);
        if matches!(event, WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. }) {
            self.screen.note_resize();
            self.laid_out = None;
        }
        if response.repaint || matches!(event, WindowEvent::Resized(_) | WindowEvent::Occluded(false)) {
            self.echo = ECHO;
        }
    }

    pub fn redraw(&self) {
        self.window.request_redraw();
    }

    /// True if the next frame may differ from the last one without any event.
    fn is_busy(&self) -> bool {
        let moves = self.eye.is_under_way() || self.player.is_playing();
        let moves = moves || self.measure.is_some();
        let unjudged = self.subject().is_some_and(|subject| !self.judge.is_about(&subject));
        moves || self.echo > 0 || !self.stage.settled() || unjudged
    }

    /// When the next frame is due; `None` if only an event can cause one.
    pub fn frame_due(&self) -> Option<Instant> {
        if self.is_hidden() {
            return None;
        }
        let delay = match self.is_busy() || self.laid_out.as_ref().is_none_or(|laid_out| laid_out.frames > 0)
        {
            true => Duration::ZERO,
            false if self.judge.is_at_work() => judge::REFRESH,
            false if self.reload.is_under_way() => reload::LOOK_AGAIN,
            false => self.laid_out.as_ref()?.repaint,
        };
        self.last_frame.checked_add(delay)
    }

    /// When [`Live::take_results`] must be called again; `None` if no screenshot or recording is under way.
    pub fn results_due(&self) -> Option<Instant> {
        (self.film.is_some() || self.shot.is_some()).then(|| Instant::now() + job::LOOK_AGAIN)
    }

    /// Reports a screenshot or a recording that has ended. Returns false if the window must close.
    ///
    /// # Errors
    /// The error of a recording without interaction; stdout cannot be written.
    pub fn take_results(&mut self) -> anyhow::Result<bool> {
        match Job::take_ended(&mut self.shot) {
            Some(Ok(picture)) => {
                self.print(&picture.display().to_string())?;
                self.say(format!("{} and its report are saved", picture.display()));
            }
            Some(Err(error)) => self.report(&error),
            None => {}
        }
        match Job::take_ended(&mut self.film) {
            Some(Ok(folder)) => {
                self.print(&folder.display().to_string())?;
                self.say(format!("{}: pictures and a report", folder.display()));
            }
            Some(Err(error)) if self.records_alone => return Err(error),
            Some(Err(error)) => self.report(&error),
            None => {}
        }
        Ok(!self.records_alone || self.film.is_some())
    }

    /// Shows an error in the status line.
    fn report(&mut self, error: &anyhow::Error) {
        tracing::warn!("{error:#}");
        self.panels.say(format!("{error:#}"), true);
        self.echo = ECHO;
    }

    /// True if this frame must lay out the panels: for input, for something that follows the picture, because egui
    /// asked for it, because the values are old, or because no further frame is due.
    fn is_layout_due(&self) -> bool {
        let Some(laid_out) = &self.laid_out else { return true };
        let follows = self.magnifies || self.frozen.is_some() || self.overlay.is_some();
        let answers = self.measure.as_ref().is_some_and(|measure| measure.response.is_some());
        let has_input = laid_out.had_input || !self.input.egui_input().events.is_empty();
        let age = laid_out.at.elapsed();
        let [often, at_least] = PANELS_AGE;
        let is_old =
            age >= laid_out.repaint.min(at_least) || (age >= often && laid_out.frames >= PANELS_FRAMES);
        follows || answers || has_input || is_old || !self.is_busy() || self.judge.is_at_work()
    }

    /// True if the window is minimised or has no pixels.
    fn is_hidden(&self) -> bool {
        let size = self.window.inner_size();
        size.width == 0 || size.height == 0 || self.window.is_minimized() == Some(true)
    }

    /// Draws one frame. Returns false if the window must close.
    ///
    /// # Errors
    /// Device lost, out of memory. A failed action is reported in the window instead.
    pub fn frame(&mut self) -> anyhow::Result<bool> {
        if self.is_hidden() {
            return Ok(true);
        }
        if let Some(open) = self.measure.as_mut().and_then(|measure| measure.begin(&mut self.player)) {
            if self.panels.open != open {
                (self.panels.open, self.laid_out) = (open, None);
            }
            self.follow_path();
        }
        let seconds = self.last_frame.elapsed().as_secs_f64().min(LONGEST_FRAME_S);
        self.last_frame = Instant::now();
        self.echo = self.echo.saturating_sub(1);
        let mut done = vec![self.take_shaders()];
        let mut output = None;
        let mut actions = Vec::new();
        if self.is_layout_due() {
            let raw = self.take_input();
            // Keys act before the panels are laid out, so that the same frame shows the result.
            for action in control::actions(self.input.egui_ctx(), &raw.events) {
                if action == Action::Close {
                    return Ok(false);
                }
                self.echo = ECHO;
                done.push(self.act(action));
            }
            let (laid_out, asked) = self.lay_out(raw);
            (output, actions) = (Some(laid_out), asked);
        }
        self.move_eye(seconds);
        for action in actions {
            self.echo = ECHO;
            done.push(self.act(action));
        }
        for error in done.into_iter().filter_map(Result::err) {
            self.report(&error);
        }
        let drawn = self.draw(output)?;
        self.count_response()?;
        self.end_measured_frame(drawn)?;
        Ok(!self.measure.as_ref().is_some_and(Measure::has_ended))
    }

    /// Records the times of the frame, and prints a part of the report that is complete.
    fn end_measured_frame(&mut self, drawn: bool) -> anyhow::Result<()> {
        let cost = std::mem::take(&mut self.panels_cost);
        let Some(measure) = self.measure.as_mut().filter(|_| drawn) else { return Ok(()) };
        let renderer = &self.stage.renderer;
        let passes = renderer.records.last().map(|record| &record.passes);
        let pass = passes.and_then(|passes| passes.iter().find(|pass| pass.label == PANELS_PASS));
        let Some(part) = measure.end(cost, pass.and_then(|pass| pass.ns)) else { return Ok(()) };
        if measure.has_ended() {
            measure.save(&self.stage.scene, renderer.size(), renderer.gpu.physical())?;
        }
        self.print(&part)
    }

    /// The input since the last frame, and the keys that a measurement presses.
    fn take_input(&mut self) -> RawInput {
        let mut raw = self.input.take_egui_input(&self.window);
        if let Some(response) = self.measure.as_mut().and_then(|measure| measure.response.as_mut()) {
            raw.events.extend(response.events());
            if response.rests() {
                self.panels.hush();
            }
        }
        raw
    }

    /// Compares the presented picture with the one before, during the last part of a measurement.
    fn count_response(&mut self) -> anyhow::Result<()> {
        let Some(response) = self.measure.as_mut().and_then(|measure| measure.response.as_mut()) else {
            return Ok(());
        };
        if let Some(buffer) = self.screen.take_read() {
            self.stage.renderer.drain()?;
            response.see(&buffer.mapped(), self.stage.settled());
        }
        Ok(())
    }

    /// Passes the input to the panels. Returns their output and the requested actions.
    fn lay_out(&mut self, raw: RawInput) -> (FullOutput, Vec<Action>) {
        let begin = Instant::now();
        let context = self.input.egui_ctx().clone();
        let judged = self.subject().and_then(|subject| self.judge.show(&context, &subject));
        let shown = Shown {
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
        self.panels_cost.layout = begin.elapsed();
        (output, actions)
    }

    /// The values of the magnified pixel.
    pub(super) fn found(&self) -> Option<&Found> {
        self.probe.found.as_ref().filter(|_| self.magnifies)
    }

    /// The outline of the frozen camera's view, in points of the window.
    fn outline(&self, pixels_per_point: f32) -> Vec<Option<Pos2>> {
        let Some(frozen) = &self.frozen else { return Vec::new() };
        let edge = eye::outline(frozen, &self.eye.camera, self.stage.renderer.size());
        let points = |at: DVec2| Pos2::new(at.x as f32, at.y as f32) / pixels_per_point;
        edge.into_iter().map(|at| at.map(points)).collect()
    }

    fn move_eye(&mut self, seconds: f64) {
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
            self.eye.rise_above(self.terrain.height_m(&self.eye.camera));
        }
        if self.eye.camera != before {
            self.terrain.begin();
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

    /// What the judge computes for the current comparison or overlay.
    fn subject(&self) -> Option<Subject> {
        let question = match self.comparison {
            Comparison::Flip if self.stage.second.is_some() => Question::Flip,
            _ if self.overlay == Some(Overlay::Error) => Question::Error,
            _ => return None,
        };
        let (pose, size) = (self.eye.camera.pose(), self.stage.renderer.size());
        Some(Subject { question, pose, size, edition: self.edition })
    }

    /// Draws the picture and the panels, whose last layout stays if there is no `output`. Returns false if no image was
    /// available.
    fn draw(&mut self, output: Option<FullOutput>) -> anyhow::Result<bool> {
        let window: [u32; 2] = self.window.inner_size().into();
        let Some(number) = self.screen.acquire(window)? else {
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
                let primitives = self.input.egui_ctx().tessellate(output.shapes, output.pixels_per_point);
                self.screen.painter.prepare(&self.textures, &primitives, size, output.pixels_per_point)?;
                self.panels_cost.triangles = begin.elapsed();
            }
            None if self.screen.painter.fits(size) => {
                self.laid_out.iter_mut().for_each(|laid_out| laid_out.frames += 1);
            }
            None => self.laid_out = None,
        }
        let arrangement = self.arrangement(size, points);
        self.render(number, &arrangement)?;
        self.screen.painter.drawn(&std::mem::take(&mut self.textures));
        if !self.screen.swapchain.present(number, window)? {
            self.screen.swapchain.resize(window)?;
            self.echo = ECHO;
        }
        Ok(true)
    }

    /// Creates the passes that the overlay or the magnifier needs, and drops those that are no longer needed.
    fn prepare_overlays(&mut self) -> anyhow::Result<()> {
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
            faces.counts_misses = self.magnifies || self.overlay == Some(Overlay::Misses);
        }
        let reliefs = self.overlay == Some(Overlay::Steps) && wanted;
        let plain = renderer.technique.plain.as_ref().filter(|_| reliefs);
        self.steps = match (plain, self.steps.take().filter(|steps| steps.fits(target))) {
            (Some(plain), None) => Some(ReliefSteps::new(gpu, plain, target)?),
            (plain, steps) => plain.and(steps),
        };
        Ok(())
    }

    /// The pose of the next frame, and what its error is measured for if its picture is complete.
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
        self.prepare_overlays()?;
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
            let laid_open = LaidOpen { levels, faces };
            probe.step(&gpu, frame, view, (target, picture, laid_open), at)?;
            screen.record(frame, number, pictures, arrangement)
        })?;
        Ok(())
    }

    fn arrangement(&self, size: [u32; 2], points: f32) -> Arrangement {
        let compares = self.stage.second.is_some();
        let pointer = self.input.egui_ctx().pointer_latest_pos();
        let magnified = pointer.map(|at| [at.x, at.y].map(|at| (at * points) as i32));
        Arrangement {
            split: if compares { (self.divider * size[0] as f32) as u32 } else { size[0] + 1 },
            gain: if compares && self.comparison == Comparison::Difference { 8.0 } else { 0.0 },
            magnified: magnified.filter(|_| self.magnifies),
            overlay: self.overlay.map_or(0, Overlay::number),
        }
    }
}
