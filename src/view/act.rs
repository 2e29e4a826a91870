//! Executes the window's actions.

use super::action::Action;
use super::film;
use super::inspector;
use super::job::{Job, Stopped};
use super::live::{ECHO, Live};
use super::overlay::Overlay;
use super::shot;
use super::stage::FinishedChange;
use anyhow::{Context, anyhow, bail};
use ortelius::renderer::Kept;
use ortelius::scene::camera::Camera;
use ortelius::vk::renderdoc;
use ortelius::vk::shader::Replaced;
use std::io::Write;
use winit::window::Fullscreen;

impl Live {
    pub(super) fn show_message(&mut self, text: String) {
        tracing::info!("{text}");
        self.panels.show_message(text, false);
        self.echo = ECHO;
    }

    /// Reports the jobs that have ended. Returns false if the window must close.
    ///
    /// # Errors
    /// A recording without interaction failed; stdout cannot be written.
    pub fn take_results(&mut self) -> anyhow::Result<bool> {
        if let Err(error) = self.take_opened().and_then(|()| self.take_shaders()) {
            self.report(&error);
        }
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

    /// Stops the jobs and reports their results. Waits for the steps under way, but not for slow tiles.
    ///
    /// # Errors
    /// The recording failed, and the window was opened only to record.
    pub fn end_jobs(&mut self) -> anyhow::Result<()> {
        // Hides the window at once, because ending takes time: a scene that is being opened must be complete before it
        // can be dropped.
        self.window.set_visible(false);
        self.stage.end_waits();
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
            | Action::NextView
            | Action::PreviousView
            | Action::View(_)
            | Action::Show(_)
            | Action::ShowBeside(_)
            | Action::Compare
            | Action::Trade(_)
            | Action::Set(..)
            | Action::Reset(_) => self.change(action)?,
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
        self.change.skips = matches!(action, Action::NextVariant);
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
            Action::Compare => (self.stage.toggle_second()?, self.variants()),
            Action::ShowBeside(variant) => (self.stage.show_beside(variant)?, self.variants()),
            Action::Show(variant) => (self.stage.show(variant)?, self.variants()),
            Action::View(view) => self.show_view(view)?,
            Action::NextView => self.show_view(self.view_after(1))?,
            Action::PreviousView => self.show_view(self.view_after(-1))?,
            _ => {
                let (wanted, _) = self.stage.wanted();
                (self.show_from(self.stage.next(wanted))?, self.variants())
            }
        };
        self.change.what = what;
        self.tell_change(kept);
        Ok(())
    }

    /// Reports the result of the last change.
    fn tell_change(&mut self, kept: Option<Kept>) {
        let what = &self.change.what;
        let text = match kept {
            Some(Kept::Everything) => what.clone(),
            Some(Kept::Tiles) => format!("{what} (meshes were loaded again)"),
            Some(Kept::Nothing) => format!("{what} (the scene was opened again; its caches are empty)"),
            None => format!("opening {what}"),
        };
        if kept.is_some() {
            self.edition += 1;
            (self.levels, self.faces, self.steps) = (None, None, None);
        }
        self.follow_view();
        self.show_message(text);
    }

    /// Shows a change or new shaders that a thread has prepared. After an error, the old picture stays.
    pub(super) fn take_opened(&mut self) -> anyhow::Result<()> {
        let Some(FinishedChange { is_reload, variant, kept }) = self.stage.take_opened() else {
            return Ok(());
        };
        self.echo = ECHO;
        self.follow_view();
        let replaced = self.change.replaced.take_if(|_| is_reload);
        match (kept, replaced) {
            (Ok(_), Some((_, count))) => {
                self.edition += 1;
                (self.levels, self.faces, self.steps) = (None, None, None);
                self.show_message(format!("{count} shaders differ from the built ones"));
            }
            (Err(error), Some((before, _))) => {
                self.restore_shaders(before)?;
                return Err(error);
            }
            (Ok(Some(_)), None) if self.stage.is_opening() => self.tell_change(None),
            (Ok(Some(kept)), None) => self.tell_change(Some(kept)),
            (Ok(None), None) => {}
            (Err(error), None) => {
                let next = self.stage.next(variant);
                if self.change.skips && next != self.stage.variant() {
                    tracing::warn!("{error:#}");
                    let kept = self.show_from(next)?;
                    self.change.what = self.variants();
                    self.tell_change(kept);
                    return Ok(());
                }
                let front = self.stage.front();
                self.trade.iter_mut().for_each(|trade| trade.select(front));
                return Err(error);
            }
        }
        Ok(())
    }

    /// Installs recompiled shaders and opens the scene with them on a thread. If that fails, the old shaders stay.
    pub(super) fn take_shaders(&mut self) -> anyhow::Result<()> {
        // Shaders belong to the device. So they are not replaced while a scene is being opened. Otherwise one scene
        // would get old and new shaders.
        if self.stage.is_opening() {
            return Ok(());
        }
        let Some(compiled) = self.reload.poll() else { return Ok(()) };
        self.echo = ECHO;
        let (words, gpu) = (compiled?, self.stage.renderer.gpu.clone());
        let count = words.len();
        let before = gpu.replace_shaders(words);
        let begun = self.screen.rebuild(&gpu).map_err(Into::into).and_then(|()| self.stage.reopen());
        if let Err(error) = begun {
            self.restore_shaders(before)?;
            return Err(error);
        }
        self.change.replaced = Some((before, count));
        self.show_message("opening the scene with the new shaders".to_owned());
        Ok(())
    }

    fn restore_shaders(&mut self, before: Replaced) -> anyhow::Result<()> {
        let gpu = self.stage.renderer.gpu.clone();
        gpu.replace_shaders(before);
        Ok(self.screen.rebuild(&gpu)?)
    }

    /// Requests the first variant from `next` on that fits the scene. Variants that do not fit are skipped with a
    /// warning.
    fn show_from(&mut self, mut next: usize) -> anyhow::Result<Option<Kept>> {
        for _ in 1..self.stage.variants().len() {
            match self.stage.show(next) {
                Err(error) if next != self.stage.variant() => tracing::warn!("{error:#}"),
                shown => return shown,
            }
            next = self.stage.next(next);
        }
        self.stage.show(next)
    }

    /// The variants that were requested last.
    fn variants(&self) -> String {
        let name = |variant: usize| &self.stage.variants()[variant].name;
        match self.stage.wanted() {
            (left, Some(right)) => format!("variant: {} | {}", name(left), name(right)),
            (left, None) => format!("variant: {}", name(left)),
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
        // Linux reports the resident set in kB of 1024 bytes.
        let status = std::fs::read_to_string("/proc/self/status").ok();
        let resident = status
            .and_then(|status| status.split("VmRSS:").nth(1)?.split_whitespace().next()?.parse::<u64>().ok());
        let resident = resident.map_or("unknown".to_owned(), |kb| (1024 * kb).to_string());
        let (count, jobs) = (held.len(), self.jobs());
        Ok(format!(
            "memory: device {device} bytes in {count} allocations, resident {resident} bytes; {compiled} pipelines \
             compiled; {jobs} jobs under way"
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
