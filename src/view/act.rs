//! Executes the window's actions.

use super::action::Action;
use super::film;
use super::inspector;
use super::job::{Job, Stopped};
use super::live::{ECHO, Live};
use super::overlay::Overlay;
use super::shot;
use anyhow::{Context, anyhow, bail};
use ortelius::renderer::Kept;
use ortelius::scene::camera::Camera;
use ortelius::vk::renderdoc;
use std::io::Write;
use winit::window::Fullscreen;

impl Live {
    pub(super) fn show_message(&mut self, text: String) {
        tracing::info!("{text}");
        self.panels.show_message(text, false);
        self.echo = ECHO;
    }

    /// Reports a screenshot or a recording that has ended. Returns false if the window must close.
    ///
    /// # Errors
    /// The error of a recording without interaction; stdout cannot be written.
    pub fn take_results(&mut self) -> anyhow::Result<bool> {
        match Job::take_ended(&mut self.shot) {
            Some(Ok(picture)) => {
                self.print(&picture.display().to_string())?;
                self.show_message(format!("{} and its report are saved", picture.display()));
            }
            Some(Err(error)) => self.report(&error),
            None => {}
        }
        match Job::take_ended(&mut self.film) {
            Some(Ok(folder)) => {
                self.print(&folder.display().to_string())?;
                self.show_message(format!("{}: pictures and a report", folder.display()));
            }
            Some(Err(error)) if self.records_alone => return Err(error),
            Some(Err(error)) => self.report(&error),
            None => {}
        }
        Ok(!self.records_alone || self.film.is_some())
    }

    /// Stops the screenshot and the recording, and says what became of them. Waits for the step under way.
    ///
    /// # Errors
    /// The recording failed, and the window was opened for it alone.
    pub fn end_jobs(&mut self) -> anyhow::Result<()> {
        if let Some(shot) = self.shot.take() {
            match shot.stop() {
                Ok(picture) => self.print(&picture.display().to_string())?,
                Err(error) if error.is::<Stopped>() => {
                    tracing::warn!(
                        "the screenshot is not saved: the window was closed before it was complete"
                    );
                }
                Err(error) => tracing::warn!("{error:#}"),
            }
        }
        let Some(film) = self.film.take() else { return Ok(()) };
        let (done, all) = film.progress();
        match film.stop() {
            Ok(folder) => self.print(&folder.display().to_string())?,
            Err(error) if error.is::<Stopped>() => {
                tracing::warn!("the recording ends after {done} of {all} frames, without a report");
            }
            Err(error) if self.records_alone => return Err(error),
            Err(error) => tracing::warn!("{error:#}"),
        }
        Ok(())
    }

    /// Shows an error in the status line.
    pub(super) fn report(&mut self, error: &anyhow::Error) {
        tracing::warn!("{error:#}");
        self.panels.show_message(format!("{error:#}"), true);
        self.echo = ECHO;
    }

    pub(super) fn act(&mut self, action: Action) -> anyhow::Result<()> {
        match action {
            Action::Close => {}
            Action::Help => self.panels.help = !self.panels.help,
            Action::Panels => self.panels.open = !self.panels.open,
            Action::Profiler => self.panels.profiler = !self.panels.profiler,
            Action::Magnify => self.magnifies = !self.magnifies,
            Action::Comparison(comparison) => self.comparison = comparison,
            Action::NextComparison => self.comparison = self.comparison.next(),
            Action::NextOverlay => self.colour(Overlay::next(self.overlay, &self.stage)),
            Action::Overlay(overlay) => self.colour(overlay),
            Action::Freeze => {
                self.frozen = if self.frozen.is_some() { None } else { Some(self.eye.camera) };
            }
            Action::FullScreen => {
                let now = self.window.fullscreen().is_some();
                self.window.set_fullscreen((!now).then_some(Fullscreen::Borderless(None)));
            }
            Action::Capture
            | Action::Screenshot
            | Action::CopyCamera
            | Action::PrintPixel
            | Action::PrintMemory => self.hand_out(action)?,
            Action::Reload => self.reload.start()?,
            Action::NextVariant
            | Action::Show(_)
            | Action::ShowBeside(_)
            | Action::Compare
            | Action::Trade(_)
            | Action::Set(..)
            | Action::Reset(_) => {
                self.edition += 1;
                self.change(action)?;
            }
            Action::FlyTo(camera) => self.fly_to(camera),
            Action::Save(n) => {
                self.bookmarks.save(n, self.eye.camera)?;
                self.show_message(format!("bookmark {}", n + 1));
            }
            Action::Recall(n) => {
                let camera = self.bookmarks.get(n)?;
                self.fly_to(camera);
            }
            Action::Play | Action::Pause | Action::Seek(_) | Action::ChoosePath(_) | Action::Record => {
                self.act_on_path(action)?;
            }
        }
        Ok(())
    }

    fn colour(&mut self, overlay: Option<Overlay>) {
        self.overlay = overlay;
        self.show_message(format!("overlay: {}", overlay.map_or("none", |overlay| overlay.about()[0])));
    }

    /// Actions that write files, print lines, or start a capture.
    fn hand_out(&mut self, action: Action) -> anyhow::Result<()> {
        match action {
            Action::Screenshot if self.shot.is_some() => {
                bail!("the last screenshot still waits for its tiles")
            }
            Action::Screenshot => {
                self.shot = Some(shot::start(&self.stage, &self.eye.camera, &self.folder)?);
            }
            Action::CopyCamera => {
                let text = self.eye.camera.to_toml("NAME");
                self.input.egui_ctx().copy_text(text.clone());
                self.print(&text)?;
                self.show_message("camera copied to the clipboard".to_owned());
            }
            Action::PrintPixel => {
                let empty = || anyhow!("no pixel is magnified: press Z and point at one");
                let found = self.found().ok_or_else(empty)?;
                self.print(&inspector::line(&self.stage, found))?;
            }
            Action::PrintMemory => {
                let line = self.memory()?;
                self.print(&line)?;
            }
            Action::Capture => match renderdoc::capture_next_frame() {
                true => self.show_message("RenderDoc captures the next frame".to_owned()),
                false => bail!("RenderDoc is not loaded: start `ortelius view` from RenderDoc"),
            },
            other => unreachable!("{other:?} has no output"),
        }
        Ok(())
    }

    fn fly_to(&mut self, camera: Camera) {
        self.player.stop();
        self.eye.fly_to(camera);
    }

    /// Actions that open or reconfigure renderers.
    fn change(&mut self, action: Action) -> anyhow::Result<()> {
        (self.levels, self.faces, self.steps) = (None, None, None);
        let (kept, what) = match action {
            Action::Trade(at) => {
                let trade =
                    self.trade.as_mut().context("no sweep is loaded: start with --trade TRADE.json")?;
                let setting = &trade.front[at];
                let kept = self.stage.take_setting(&setting.changes)?;
                trade.at = Some(at);
                (kept, format!("setting: {}", setting.name))
            }
            Action::Set(key, value) => (self.stage.set(&key, &value)?, format!("{key} = {value}")),
            Action::Reset(key) => (self.stage.reset(&key)?, format!("{key}: the scene's own")),
            Action::Compare => {
                self.stage.toggle_second()?;
                (Kept::Everything, self.variants())
            }
            Action::ShowBeside(variant) => {
                self.stage.show_beside(variant)?;
                (Kept::Everything, self.variants())
            }
            Action::Show(variant) => (self.stage.show(variant)?, self.variants()),
            _ => (self.show_next()?, self.variants()),
        };
        self.show_message(match kept {
            Kept::Everything => what,
            Kept::Tiles => format!("{what} (meshes were loaded again)"),
            Kept::Nothing => format!("{what} (the scene was opened again; its caches are empty)"),
        });
        Ok(())
    }

    /// Installs recompiled shaders and rebuilds every pipeline. If that fails, the old shaders stay.
    pub(super) fn take_shaders(&mut self) -> anyhow::Result<()> {
        let Some(compiled) = self.reload.poll() else { return Ok(()) };
        self.echo = ECHO;
        let (words, gpu) = (compiled?, self.stage.renderer.gpu.clone());
        let count = words.len();
        self.edition += 1;
        let before = gpu.replace_shaders(words);
        let done = self.screen.rebuild(&gpu).map_err(Into::into).and_then(|()| self.stage.reopen());
        if let Err(error) = done {
            gpu.replace_shaders(before);
            self.screen.rebuild(&gpu)?;
            return Err(error);
        }
        (self.levels, self.faces, self.steps) = (None, None, None);
        self.show_message(format!("{count} shaders differ from the built ones"));
        Ok(())
    }

    /// Shows the next variant that opens on this device. Variants that fail to open are skipped with a
    /// warning.
    fn show_next(&mut self) -> anyhow::Result<Kept> {
        let mut next = self.stage.next(self.stage.variant);
        loop {
            match self.stage.show(next) {
                Err(error) if next != self.stage.variant => tracing::warn!("{error:#}"),
                shown => return shown,
            }
            next = self.stage.next(next);
        }
    }

    /// The shown variants.
    fn variants(&self) -> String {
        let name = |variant: usize| &self.stage.variants[variant].name;
        match &self.stage.second {
            Some(second) => format!("variant: {} | {}", name(self.stage.variant), name(second.variant)),
            None => format!("variant: {}", name(self.stage.variant)),
        }
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
            _ if self.film.is_some() => bail!("the last recording still goes on"),
            _ => self.film = Some(film::start(&self.stage, &path.unwrap_or_default(), &self.folder)?),
        }
        Ok(())
    }

    /// The device memory and the main memory in use, as one line.
    fn memory(&self) -> anyhow::Result<String> {
        let gpu = &self.stage.renderer.gpu;
        let (held, compiled) = (gpu.allocations()?, gpu.compiled_pipelines());
        let device: u64 = held.iter().map(|(_, bytes)| bytes).sum();
        // Linux reports counts of 4096-byte pages; the second count is the resident set.
        let pages = std::fs::read_to_string("/proc/self/statm").ok();
        let resident = pages.and_then(|pages| pages.split(' ').nth(1)?.parse::<u64>().ok());
        let resident = resident.map_or("unknown".to_owned(), |pages| (4096 * pages).to_string());
        let count = held.len();
        Ok(format!(
            "memory: device {device} bytes in {count} allocations, resident {resident} bytes; {compiled} pipelines \
             compiled"
        ))
    }

    /// Writes a line to stdout. A closed pipe is not an error.
    pub(super) fn print(&self, text: &str) -> anyhow::Result<()> {
        match writeln!(std::io::stdout(), "{text}") {
            Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.into()),
            _ => Ok(()),
        }
    }
}
