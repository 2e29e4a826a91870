//! The open window, frame by frame: input, panels, actions, picture.

use super::ViewOptions;
use super::action::{Action, CompareMode};
use super::bookmarks::Bookmarks;
use super::control::{self, Hold};
use super::eye::Eye;
use super::ground::GroundHeights;
use super::job::{self, Job};
use super::judge::{self, Judge};
use super::labels::Labels;
use super::levels::Levels;
use super::measure::Measurement;
use super::overlay::Overlay;
use super::panels::Panels;
use super::path::Player;
use super::probe::Probe;
use super::reload::Reload;
use super::screen::Screen;
use super::shown::Front;
use super::stage::Stage;
use super::timed::FrameCost;
use egui::{TexturesDelta, ViewportId};
use ortelius::math::camera::Pose;
use ortelius::paper::progressive_mesh::faces::Faces;
use ortelius::renderer::relief_steps::ReliefSteps;
use ortelius::scene::camera::Camera;
use ortelius::vk::shader::Replaced;
use ortelius::vk::{Gpu, PassResources};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::event::WindowEvent;
use winit::window::Window;

/// Frames drawn after the last change, so that the results of the frames in flight are shown too. The values that the
/// inspector and the labels show are read back two frames later, laid out in the third, and drawn in the fourth.
pub(super) const ECHO: u32 = 5;

/// While the picture changes, the panels are laid out again after 1 s, or after 100 ms if [`PANELS_FRAMES`] frames have
/// drawn the last layout. On slow devices, where a frame takes longer than 100 ms, the count avoids a layout in every
/// frame.
const PANELS_AGE: [Duration; 2] = [Duration::from_millis(100), Duration::from_secs(1)];
const PANELS_FRAMES: u32 = 3;

/// Longest time step of the camera, even if a frame took longer.
const LONGEST_FRAME_S: f64 = 0.1;

pub struct Live {
    pub(super) stage: Stage,
    /// Index of the view whose camera, path and bookmarks are in use.
    pub(super) view: usize,
    pub(super) change: LastChange,
    pub(super) film: Option<Job<PathBuf>>,
    pub(super) shot: Option<Job<PathBuf>>,
    pub(super) screen: Screen,
    pub(super) input: egui_winit::State,
    /// Changes to the panels' textures that no frame has uploaded yet.
    pub(super) textures: TexturesDelta,
    pub(super) eye: Eye,
    pub(super) hold: Option<Hold>,
    pub(super) player: Player,
    pub(super) panels: Panels,
    /// The resources of each pass of the last frame, while a panel lists the passes.
    pub(super) resources: Vec<PassResources>,
    pub(super) bookmarks: Bookmarks,
    pub(super) magnifies: bool,
    pub(super) comparison: CompareMode,
    pub(super) trade: Option<Front>,
    pub(super) judge: Judge,
    /// Increases with each change that alters the picture of a fixed pose.
    pub(super) edition: u64,
    /// The pose of the last frame.
    pub(super) last_pose: Option<Pose>,
    pub(super) ground: GroundHeights,
    pub(super) measure: Option<Measurement>,
    /// The parts of this frame's time.
    pub(super) cost: FrameCost,
    /// Close the window once the path is recorded.
    pub(super) records_alone: bool,
    pub(super) overlay: Option<Overlay>,
    pub(super) probe: Probe,
    pub(super) labels: Labels,
    pub(super) levels: Option<Levels>,
    pub(super) faces: Option<Faces>,
    pub(super) steps: Option<ReliefSteps>,
    pub(super) reload: Reload,
    /// The camera that streaming and culling keep after the key F. The picture is drawn from another camera.
    pub(super) frozen: Option<Camera>,
    /// Position of the divider, as a share of the width.
    pub(super) divider: f32,
    pub(super) folder: PathBuf,
    pub(super) last_frame: Instant,
    /// Frames still to draw without further changes.
    pub(super) echo: u32,
    /// The last layout of the panels; `None`: the next frame lays them out.
    pub(super) laid_out: Option<LaidOut>,
    pub(super) window: Arc<Window>,
}

/// The last change to the stage: of a variant, a view, a setting or the shaders.
#[derive(Default)]
pub(super) struct LastChange {
    /// The text of the status line once the change is shown.
    pub(super) what: String,
    /// True if the change came from Space, which skips variants that cannot be opened.
    pub(super) skips: bool,
    /// Set while a thread opens the scene with recompiled shaders: the previous shaders, and the number of recompiled
    /// shaders that differ from those of the build.
    pub(super) replaced: Option<(Replaced, usize)>,
}

/// A layout of the panels. Later frames draw it again until [`Live::needs_layout`] returns true.
pub(super) struct LaidOut {
    pub(super) at: Instant,
    /// Delay until the panels need a redraw.
    pub(super) repaint: Duration,
    /// True if the layout had input. The next frame is then laid out too, to complete the effects of the input.
    pub(super) had_input: bool,
    /// Number of later frames that have drawn this layout.
    pub(super) frames: u32,
}

impl Live {
    /// # Errors
    /// The device cannot present to the window; a file of bookmarks or a path is wrong.
    pub fn new(gpu: &Gpu, window: Arc<Window>, opening: &ViewOptions, stage: Stage) -> anyhow::Result<Live> {
        let size: [u32; 2] = window.inner_size().into();
        let modes = (opening.present.clone(), opening.measure.is_some());
        let screen = Screen::new(gpu, gpu.surface(&window)?, size, modes)?;
        let context = egui::Context::default();
        // Nothing fades in: a change is complete in one frame, and equal input gives equal pictures.
        context.all_styles_mut(|style| style.animation_time = 0.0);
        let factor = Some(window.scale_factor() as f32);
        let input = egui_winit::State::new(context, ViewportId::ROOT, &*window, factor, None, None);
        let measure = |steps| Measurement::new(&stage.scene, steps, opening.times.clone());
        let measure = opening.measure.map(measure).transpose()?;
        let (bookmarks, read) = Bookmarks::open(&stage.scene);
        let mut panels = Panels::new(opening.panels);
        if let Err(error) = read {
            tracing::warn!("{error:#}");
            panels.show_message(format!("{error:#}"), true);
        }
        Ok(Live {
            ground: GroundHeights::of(&stage.scene),
            measure,
            cost: FrameCost::default(),
            records_alone: false,
            player: stage.views[0].player(),
            eye: Eye::new(stage.views[0].camera),
            stage,
            view: 0,
            change: LastChange::default(),
            film: None,
            shot: None,
            screen,
            input,
            textures: TexturesDelta::default(),
            hold: None,
            panels,
            resources: Vec::new(),
            bookmarks,
            magnifies: false,
            comparison: CompareMode::Pictures,
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
        // Flight needs only the press and the release of a key. Only a text field uses key repeats.
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
            false => self.laid_out.as_ref()?.repaint,
        };
        self.last_frame.checked_add(delay)
    }

    /// When [`Live::take_results`] must be called again; `None` if no job is under way.
    pub fn results_due(&self) -> Option<Instant> {
        (self.jobs() > 0).then(|| Instant::now() + job::POLL_INTERVAL)
    }

    /// Screenshots, recordings, openings and compilations under way.
    pub(super) fn jobs(&self) -> usize {
        let jobs =
            [self.film.is_some(), self.shot.is_some(), self.stage.is_opening(), self.reload.is_under_way()];
        jobs.into_iter().filter(|is_under_way| *is_under_way).count()
    }

    /// True if this frame must lay out the panels: there is input, an element follows the picture, egui requests a
    /// layout, the last layout is old, or no frame may follow for some time.
    fn needs_layout(&self) -> bool {
        let Some(laid_out) = &self.laid_out else { return true };
        let age = laid_out.at.elapsed();
        let has_input = laid_out.had_input || !self.input.egui_input().events.is_empty();
        let follows =
            self.magnifies || self.frozen.is_some() || self.overlay.is_some() || self.judge.is_at_work();
        let response = self.measure.as_ref().and_then(|measure| measure.response.as_ref());
        let is_old = match response {
            // The next key is pressed at rest. Panels that show the time of each frame would never come to rest.
            Some(response) => response.has_event() || self.panels.has_message(),
            None => {
                let [often, at_least] = PANELS_AGE;
                age >= at_least || (age >= often && laid_out.frames >= PANELS_FRAMES)
            }
        };
        has_input || follows || age >= laid_out.repaint || is_old || !self.is_busy()
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
        let waited = self.stage.renderer.gpu.waited();
        let begin = |measure: &mut Measurement| measure.begin(&mut self.player, waited);
        if let Some(open) = self.measure.as_mut().and_then(begin) {
            if self.panels.open != open {
                (self.panels.open, self.laid_out) = (open, None);
            }
            self.follow_path();
        }
        let seconds = self.last_frame.elapsed().as_secs_f64().min(LONGEST_FRAME_S);
        self.last_frame = Instant::now();
        self.echo = self.echo.saturating_sub(1);
        let mut done = Vec::new();
        let mut output = None;
        let mut actions = Vec::new();
        if self.needs_layout() {
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
        self.stage.set_frame_seconds(seconds);
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
        Ok(!self.measure.as_ref().is_some_and(Measurement::has_ended))
    }
}
