//! The event loop: opens the window once the loop runs, opens the scene on a thread, forwards events, and destroys
//! everything in order.

use super::job::{Job, JobProgress};
use super::live::Live;
use super::stage::Stage;
use super::{NoDisplay, ViewOptions};
use anyhow::{Context, bail};
use ortelius::vk::{Feature, Gpu, GpuOptions};
use raw_window_handle::HasDisplayHandle;
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::error::EventLoopError;
use winit::event::{ElementState, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{Key, NamedKey};
use winit::window::{Window, WindowId};

struct App {
    opening: ViewOptions,
    first: Option<FirstScene>,
    /// Must be dropped before the device.
    live: Option<Live>,
    gpu: Option<Gpu>,
    failed: Option<anyhow::Error>,
}

/// The window while its first scene is opened.
struct FirstScene {
    window: Arc<Window>,
    job: Job<Stage>,
    /// The events received so far. [`Live`] handles them once the scene is open.
    events: Vec<WindowEvent>,
}

/// Interval at which the opening of the first scene is checked.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// Runs until the window is closed.
///
/// # Errors
/// As [`super::open`].
pub fn run(opening: ViewOptions) -> anyhow::Result<()> {
    let events = event_loop()?;
    let mut app = App { opening, first: None, live: None, gpu: None, failed: None };
    events.run_app(&mut app).context("the window's event loop")?;
    if let Some(error) = app.failed {
        return Err(error);
    }
    // The window and everything made for it are destroyed: no device memory may remain allocated.
    app.live = None;
    let Some(gpu) = app.gpu else { return Ok(()) };
    if let Some((name, bytes)) = gpu.allocations()?.first() {
        bail!(
            "leak: {name} still holds {bytes} bytes of device memory after the window was closed; please report it"
        );
    }
    match gpu.messages().first() {
        Some(first) if app.opening.validate => {
            bail!("Vulkan's validation layer: {}: {}", first.id, first.text)
        }
        _ => Ok(()),
    }
}

/// winit panics if an X11 library is missing. This function returns the panic as an ordinary error.
fn event_loop() -> Result<EventLoop<()>, NoDisplay> {
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let opened = std::panic::catch_unwind(EventLoop::new);
    std::panic::set_hook(hook);
    match opened {
        Ok(opened) => opened.map_err(|error| NoDisplay(reason(&error))),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("winit panicked");
            Err(NoDisplay(text.trim_end_matches('.').to_owned()))
        }
    }
}

/// The cause in one line, without the location in winit's source.
fn reason(error: &EventLoopError) -> String {
    match error {
        EventLoopError::Os(error) => {
            error.to_string().rsplit(": ").next().unwrap_or_default().trim_end_matches('.').to_owned()
        }
        error => error.to_string(),
    }
}

impl App {
    fn start(&mut self, events: &ActiveEventLoop) -> anyhow::Result<()> {
        let [width, height] = self.opening.size;
        let attributes = Window::default_attributes()
            .with_title(format!("Ortelius: {}", self.opening.name))
            .with_inner_size(PhysicalSize::new(width, height));
        let window = events.create_window(attributes).map_err(|error| NoDisplay(error.to_string()))?;
        let window = Arc::new(window);
        let display = window.display_handle().map_err(|error| NoDisplay(error.to_string()))?;
        let gpu = Gpu::new(&GpuOptions {
            device: self.opening.device.as_deref(),
            validate: self.opening.validate,
            needs: &[],
            // The device has all features, so that switching variants does not reopen the device.
            wishes: &Feature::ALL,
            display: Some(display),
        })?;
        tracing::info!("{}, {}", gpu.physical().name, gpu.physical().driver);
        gpu.require_drawing()?;
        self.gpu = Some(gpu.clone());
        let size = <[u32; 2]>::from(window.inner_size()).map(|side| side.max(1));
        let (views, deterministic) = (self.opening.views.clone(), self.opening.deterministic);
        let open = move |progress: &JobProgress| Stage::of(&gpu, views, size, deterministic, progress);
        let job = Job::start("opening", 1, open)?;
        self.first = Some(FirstScene { window, job, events: Vec::new() });
        Ok(())
    }

    /// Shows the first scene once it is open.
    fn show_first(&mut self) -> anyhow::Result<()> {
        let Some(FirstScene { window, job, events }) = self.first.take_if(|first| first.job.has_ended())
        else {
            return Ok(());
        };
        let gpu = self.gpu.as_ref().expect("the first scene was opened on this device");
        let live = self.live.insert(Live::new(gpu, window, &self.opening, job.wait()?)?);
        events.iter().for_each(|event| live.event(event));
        if self.opening.record {
            live.record()?;
        }
        Ok(())
    }

    /// Leaves the event loop after an error, or when the user quits.
    fn after(&mut self, events: &ActiveEventLoop, done: anyhow::Result<bool>) {
        match done {
            Ok(true) => {}
            Ok(false) => self.close(events),
            Err(error) => {
                self.failed = Some(error);
                self.close(events);
            }
        }
    }

    fn close(&mut self, events: &ActiveEventLoop) {
        if let Some(first) = self.first.take() {
            first.window.set_visible(false);
            // The job is stopped; its thread ends soon.
            drop(first);
        }
        if let Some(mut live) = self.live.take()
            && let Err(error) = live.end_jobs()
        {
            self.failed.get_or_insert(error);
        }
        events.exit();
    }
}

/// True for the key that quits.
fn is_escape(event: &WindowEvent) -> bool {
    let WindowEvent::KeyboardInput { event, .. } = event else { return false };
    event.logical_key == Key::Named(NamedKey::Escape) && event.state == ElementState::Pressed
}

impl ApplicationHandler for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.live.is_none() && self.first.is_none() {
            let done = self.start(events).map(|()| true);
            self.after(events, done);
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        if let Some(first) = &mut self.first {
            let closes = event == WindowEvent::CloseRequested || is_escape(&event);
            first.events.push(event);
            return self.after(events, Ok(!closes));
        }
        let Some(live) = &mut self.live else { return };
        let done = match event {
            WindowEvent::CloseRequested => Ok(false),
            WindowEvent::RedrawRequested => live.frame(),
            event => {
                live.event(&event);
                Ok(true)
            }
        };
        self.after(events, done);
    }

    /// Redraws at once while the picture changes; otherwise sleeps until the next event or deadline.
    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        if let Err(error) = self.show_first() {
            return self.after(events, Err(error));
        }
        if self.first.is_some() {
            return events.set_control_flow(ControlFlow::WaitUntil(Instant::now() + POLL_INTERVAL));
        }
        let Some(live) = &mut self.live else { return };
        let done = live.take_results();
        let (frame, results) = (live.frame_due(), live.results_due());
        if frame.is_some_and(|due| due <= Instant::now()) {
            live.redraw();
            events.set_control_flow(ControlFlow::Poll);
        } else {
            let next = frame.into_iter().chain(results).min();
            events.set_control_flow(next.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
        }
        self.after(events, done);
    }
}
