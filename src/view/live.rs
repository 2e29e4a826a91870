//! The open window, frame by frame: input, panels, actions, picture.

use super::Opening;
use super::action::Action;
use super::control::{self, Hold, Pane};
use super::eye::Eye;
use super::film::Film;
use super::panels::{Panels, Shown};
use super::path::Player;
use super::screen::{Arrangement, Screen};
use super::shot;
use super::stage::Stage;
use anyhow::anyhow;
use egui::{FullOutput, TexturesDelta, ViewportId};
use ortelius::math::camera::Pose;
use ortelius::scene::camera::Camera;
use ortelius::vk::Gpu;
use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::event::WindowEvent;
use winit::window::{Fullscreen, Window};

/// Frames that follow the last change, so that what the frames in flight found out is shown, too.
const ECHO: u32 = 3;

/// No step of the eye is longer than this, whatever a frame took.
const LONGEST_FRAME_S: f64 = 0.1;

pub struct Live {
    stage: Stage,
    film: Option<Film>,
    screen: Screen,
    input: egui_winit::State,
    /// Textures of the panels that no frame has uploaded yet.
    textures: TexturesDelta,
    eye: Eye,
    hold: Option<Hold>,
    player: Player,
    panels: Panels,
    bookmarks: [Option<Camera>; 9],
    magnifies: bool,
    difference: bool,
    /// Of the divider, as a share of the width.
    divider: f32,
    folder: PathBuf,
    last_frame: Instant,
    /// Frames that still follow although nothing changes.
    echo: u32,
    /// When the panels want to be drawn again.
    repaint: Duration,
    window: Arc<Window>,
}

impl Live {
    /// # Errors
    /// A window that the device cannot present to; whatever stops a renderer.
    pub fn new(gpu: &Gpu, window: Arc<Window>, opening: &Opening) -> anyhow::Result<Live> {
        let size: [u32; 2] = window.inner_size().into();
        let screen = Screen::new(gpu, gpu.surface(&window)?, size, opening.present)?;
        let variants = opening.variants.clone();
        let picture = screen.swapchain.size().map(|side| side.max(1));
        let stage = Stage::new(gpu, opening.scene.clone(), variants, picture, opening.deterministic)?;
        let context = egui::Context::default();
        let factor = Some(window.scale_factor() as f32);
        let input = egui_winit::State::new(context, ViewportId::ROOT, &*window, factor, None, None);
        let mut bookmarks = [None; 9];
        for (bookmark, camera) in bookmarks.iter_mut().zip(stage.scene.cameras.values()) {
            *bookmark = Some(*camera);
        }
        Ok(Live {
            player: Player::new(&stage.scene),
            stage,
            film: None,
            screen,
            input,
            textures: TexturesDelta::default(),
            eye: Eye::new(opening.camera),
            hold: None,
            panels: Panels::new(opening.panels),
            bookmarks,
            magnifies: false,
            difference: false,
            divider: 0.5,
            folder: opening.folder.clone(),
            last_frame: Instant::now(),
            echo: ECHO,
            repaint: Duration::MAX,
            window,
        })
    }

    /// Takes an event of the window's system.
    pub fn event(&mut self, event: &WindowEvent) {
        let response = self.input.on_window_event(&self.window, event);
        if response.repaint || matches!(event, WindowEvent::Resized(_) | WindowEvent::Occluded(false)) {
            self.echo = ECHO;
        }
    }

    pub fn redraw(&self) {
        self.window.request_redraw();
    }

    /// When the next frame is due; `None`: with the next event.
    pub fn wakes_in(&self) -> Option<Duration> {
        let moves = self.eye.is_under_way() || self.player.is_playing() || self.film.is_some();
        if self.is_hidden() {
            return None;
        }
        match moves || self.echo > 0 || !self.stage.settled() {
            true => Some(Duration::ZERO),
            false => Some(self.repaint).filter(|repaint| *repaint < Duration::from_secs(3600)),
        }
    }

    /// Minimised: there are no pixels to draw.
    fn is_hidden(&self) -> bool {
        let size = self.window.inner_size();
        size.width == 0 || size.height == 0 || self.window.is_minimized() == Some(true)
    }

    /// One frame. Returns whether the window stays open.
    ///
    /// # Errors
    /// Device lost, out of memory. What fails of an action is shown, and ends nothing.
    pub fn frame(&mut self) -> anyhow::Result<bool> {
        if self.is_hidden() {
            return Ok(true);
        }
        let seconds = self.last_frame.elapsed().as_secs_f64().min(LONGEST_FRAME_S);
        self.last_frame = Instant::now();
        self.echo = self.echo.saturating_sub(1);
        let (mut output, mut actions) = self.lay_out();
        self.textures.append(std::mem::take(&mut output.textures_delta));
        self.repaint =
            output.viewport_output.get(&ViewportId::ROOT).map_or(Duration::MAX, |out| out.repaint_delay);
        let platform = std::mem::take(&mut output.platform_output);
        self.input.handle_platform_output(&self.window, platform);
        actions.extend(control::actions(self.input.egui_ctx()));
        self.move_eye(seconds);
        for action in actions {
            if action == Action::Close {
                return Ok(false);
            }
            self.echo = ECHO;
            if let Err(error) = self.act(action) {
                tracing::warn!("{error:#}");
                self.panels.say(format!("{error:#}"), true);
            }
        }
        self.draw(output)?;
        Ok(true)
    }

    /// Input to panels; what they show, and what was asked for in them.
    fn lay_out(&mut self) -> (FullOutput, Vec<Action>) {
        let raw = self.input.take_egui_input(&self.window);
        let context = self.input.egui_ctx().clone();
        let shown = Shown {
            stage: &self.stage,
            camera: &self.eye.camera,
            player: &self.player,
            film: self.film.as_ref().map(Film::progress),
            difference: self.difference,
        };
        let panels = &mut self.panels;
        let mut actions = Vec::new();
        // egui may lay out twice: the last time counts.
        let output = context.run_ui(raw, |ui| actions = panels.show(ui, &shown));
        (output, actions)
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
        }
        if self.eye.camera != before || divider.is_some() {
            self.echo = ECHO;
        }
    }

    fn follow_path(&mut self) {
        if let Some(camera) = self.player.camera() {
            self.eye.set(camera);
        }
    }

    fn say(&mut self, text: String) {
        tracing::info!("{text}");
        self.panels.say(text, false);
    }

    fn act(&mut self, action: Action) -> anyhow::Result<()> {
        match action {
            Action::Close => {}
            Action::Help => self.panels.help = !self.panels.help,
            Action::Panels => self.panels.open = !self.panels.open,
            Action::Magnify => self.magnifies = !self.magnifies,
            Action::Difference => self.difference = !self.difference,
            Action::FullScreen => {
                let now = self.window.fullscreen().is_some();
                self.window.set_fullscreen((!now).then_some(Fullscreen::Borderless(None)));
            }
            Action::NextVariant | Action::Show(_) | Action::Compare | Action::Set(..) => {
                self.change(action)?;
            }
            Action::Screenshot => {
                let picture = shot::take(&self.stage, &self.eye.camera, &self.folder)?;
                self.print(&picture.display().to_string())?;
                self.say(format!("{} and its report", picture.display()));
            }
            Action::CopyCamera => {
                let text = self.eye.camera.to_toml("NAME");
                self.input.egui_ctx().copy_text(text.clone());
                self.print(&text)?;
                self.say("the camera is in the clipboard".to_owned());
            }
            Action::FlyTo(camera) => self.fly_to(camera),
            Action::Save(n) => {
                self.bookmarks[n] = Some(self.eye.camera);
                self.say(format!("bookmark {}", n + 1));
            }
            Action::Recall(n) => {
                let empty = || anyhow!("bookmark {0} is empty; Ctrl+{0} saves one", n + 1);
                let camera = self.bookmarks[n].ok_or_else(empty)?;
                self.fly_to(camera);
            }
            Action::Play | Action::Pause | Action::Seek(_) | Action::ChoosePath(_) | Action::Record => {
                self.act_on_path(action)?;
            }
        }
        Ok(())
    }

    fn fly_to(&mut self, camera: Camera) {
        self.player.stop();
        self.eye.fly_to(camera);
    }

    /// What opens renderers.
    fn change(&mut self, action: Action) -> anyhow::Result<()> {
        match action {
            Action::Show(variant) => self.stage.show(variant)?,
            Action::Compare => self.stage.toggle_second()?,
            Action::Set(key, value) => self.stage.set(&key, &value)?,
            // The next that this device and scene take.
            _ => {
                let mut next = self.stage.next(self.stage.variant);
                while let Err(error) = self.stage.show(next) {
                    tracing::warn!("{error:#}");
                    next = self.stage.next(next);
                }
            }
        }
        let text = match &self.stage.second {
            Some((second, _)) => format!("{} | {}", self.name(self.stage.variant), self.name(*second)),
            None => self.name(self.stage.variant).to_owned(),
        };
        self.say(format!("variant: {text}"));
        Ok(())
    }

    fn name(&self, variant: usize) -> &str {
        &self.stage.variants[variant].name
    }

    fn act_on_path(&mut self, action: Action) -> anyhow::Result<()> {
        let path = self.player.path().cloned();
        if path.is_none() && !matches!(action, Action::ChoosePath(_)) {
            return Err(anyhow!("scene {} has no path", self.stage.scene.name));
        }
        match action {
            Action::Play => self.player.play(),
            Action::Pause => self.player.pause(),
            Action::Seek(frame) => {
                self.player.seek(frame);
                self.follow_path();
            }
            Action::ChoosePath(name) => {
                self.player.choose(&self.stage.scene, &name);
                self.follow_path();
            }
            _ => {
                let film = Film::new(&self.stage, &path.unwrap_or_default(), &self.folder)?;
                self.film = Some(film);
            }
        }
        Ok(())
    }

    /// To stdout, which is for data. A closed pipe is no error.
    fn print(&self, text: &str) -> anyhow::Result<()> {
        match writeln!(std::io::stdout(), "{text}") {
            Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.into()),
            _ => Ok(()),
        }
    }

    fn draw(&mut self, output: FullOutput) -> anyhow::Result<()> {
        let window: [u32; 2] = self.window.inner_size().into();
        let Some(number) = self.screen.acquire(window)? else {
            self.echo = ECHO;
            return Ok(());
        };
        let size = self.screen.swapchain.size();
        if self.stage.renderer.size() != size {
            self.stage.resize(size)?;
        }
        let points = output.pixels_per_point;
        let primitives = self.input.egui_ctx().tessellate(output.shapes, points);
        let painting = self.screen.painter.prepare(&self.textures, &primitives, size, points)?;
        let arrangement = self.arrangement(size, points);
        self.render(number, &arrangement, &painting)?;
        self.screen.painter.free(&std::mem::take(&mut self.textures));
        if !self.screen.swapchain.present(number)? {
            self.screen.swapchain.resize(window)?;
            self.echo = ECHO;
        }
        self.write_film()
    }

    fn render(
        &mut self,
        number: usize,
        arrangement: &Arrangement,
        painting: &super::painter::Painting,
    ) -> anyhow::Result<()> {
        let pose: Pose = self.eye.camera.pose();
        let films = self.film.is_some();
        let (renderer, pose) = match &mut self.film {
            Some(film) => {
                let pose = film.pose().unwrap_or(pose);
                (&mut film.renderer, pose)
            }
            None => (&mut self.stage.renderer, pose),
        };
        let second = match &mut self.stage.second {
            Some((_, second)) if !films => {
                second.frame(&pose)?;
                Some(second.target().color.clone())
            }
            _ => None,
        };
        let screen = &self.screen;
        let [acquired, drawn] = screen.swapchain.semaphores(number);
        renderer.frame_with(&pose, &[acquired], &[drawn], |frame, target| {
            let right = second.as_ref().unwrap_or(&target.color);
            screen.record(frame, number, [&target.color, right], arrangement, painting)
        })?;
        Ok(())
    }

    fn arrangement(&self, size: [u32; 2], points: f32) -> Arrangement {
        let compares = self.stage.second.is_some() && self.film.is_none();
        let pointer = self.input.egui_ctx().pointer_latest_pos();
        let magnified = pointer.map(|at| [at.x, at.y].map(|at| (at * points) as i32));
        Arrangement {
            split: if compares { (self.divider * size[0] as f32) as u32 } else { size[0] + 1 },
            gain: if compares && self.difference { 8.0 } else { 0.0 },
            magnified: magnified.filter(|_| self.magnifies),
        }
    }

    fn write_film(&mut self) -> anyhow::Result<()> {
        let Some(film) = &mut self.film else { return Ok(()) };
        match film.write() {
            Ok(None) => {}
            Ok(Some(folder)) => {
                let folder = folder.display().to_string();
                self.film = None;
                self.print(&folder)?;
                self.say(format!("{folder}: pictures and their report"));
            }
            Err(error) => {
                self.film = None;
                self.panels.say(format!("{error:#}"), true);
            }
        }
        Ok(())
    }
}
