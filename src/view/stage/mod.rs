//! The scene in the window: its variants, manual changes to its settings, and one or two renderers. A change that a
//! renderer cannot make in place is prepared on a thread; until it is ready, the window shows the old picture.

mod change;
#[cfg(test)]
mod tests;

pub use change::FinishedChange;
pub use ortelius::frame::HISTORY;

use super::job::JobProgress;
use super::open_view::OpenView;
use super::variants::Variant;
use change::PendingChange;
use ortelius::frame::{FRAME_SECONDS, Technique};
use ortelius::picture::PixelFormat;
use ortelius::renderer::{Kept, Options, RenderError, Renderer};
use ortelius::scene::Scene;
use ortelius::vk::Gpu;

/// One scene on one device.
pub struct Stage {
    gpu: Gpu,
    /// At least one view.
    pub views: Vec<OpenView>,
    deterministic: bool,
    shown: ShownVariants,
    /// The last request. It differs from `shown` while a scene is opened.
    wanted: ShownVariants,
    opening: Option<PendingChange>,
    /// The scene of the shown variant.
    pub scene: Scene,
    pub renderer: Renderer,
    pub second: Option<Second>,
    /// The next opening of a scene waits until a message arrives or the sender is dropped.
    #[cfg(test)]
    gate: Option<std::sync::mpsc::Receiver<()>>,
}

/// The variant on the right.
pub struct Second {
    pub variant: usize,
    scene: Scene,
    pub renderer: Renderer,
}

/// Which variants are shown, with which settings.
#[derive(Clone, Debug, Default, PartialEq)]
struct ShownVariants {
    view: usize,
    /// Indices of the variants on the left and on the right; `None` without a right side.
    left: usize,
    right: Option<usize>,
    /// The changes of the selected Pareto point. They override the changes of the variants.
    front: Vec<String>,
    /// Manual changes as (key, value). They override the changes of the variants and of the Pareto point.
    changes: Vec<(String, String)>,
}

impl Stage {
    /// A stage with one view.
    #[cfg(test)]
    pub fn new(
        gpu: &Gpu,
        base: Scene,
        variants: Vec<Variant>,
        size: [u32; 2],
        deterministic: bool,
        progress: &JobProgress,
    ) -> anyhow::Result<Stage> {
        let camera = *base.camera(&base.view.camera)?;
        let view = OpenView::new(String::new(), base, camera, variants);
        Stage::of(gpu, vec![view], size, deterministic, progress)
    }

    /// Opens the first view.
    ///
    /// # Errors
    /// As [`open`].
    pub fn of(
        gpu: &Gpu,
        views: Vec<OpenView>,
        size: [u32; 2],
        deterministic: bool,
        progress: &JobProgress,
    ) -> anyhow::Result<Stage> {
        let first = views.first().expect("there is at least one view");
        let scene = first.scene.with(&first.variants[0].changes)?;
        let renderer = open(gpu, &scene, size, deterministic, progress)?;
        Ok(Stage {
            gpu: gpu.clone(),
            views,
            deterministic,
            shown: ShownVariants::default(),
            wanted: ShownVariants::default(),
            opening: None,
            scene,
            renderer,
            second: None,
            #[cfg(test)]
            gate: None,
        })
    }

    /// Index of the shown view, and of the view that was requested last.
    pub fn view(&self) -> [usize; 2] {
        [self.shown.view, self.wanted.view]
    }

    /// The variants of the view that was requested last.
    pub fn variants(&self) -> &[Variant] {
        &self.views[self.wanted.view].variants
    }

    /// Requests a view. The new view shows its variants with the current names, or its first variant if it lacks a
    /// name. Manual changes and the Pareto point stay if it is a view of the same scene. On an error, the current
    /// view stays.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn show_view(&mut self, view: usize) -> anyhow::Result<Option<Kept>> {
        let (before, next) = (&self.views[self.wanted.view], &self.views[view]);
        let same = |variant: usize| next.variant(&before.variants[variant].name).unwrap_or(0);
        let choice = ShownVariants {
            view,
            left: same(self.wanted.left),
            right: self.wanted.right.map(same),
            ..ShownVariants::default()
        };
        let choice = match before.scene.name == next.scene.name {
            true => ShownVariants {
                front: self.wanted.front.clone(),
                changes: self.wanted.changes.clone(),
                ..choice
            },
            false => choice,
        };
        self.request(|wanted| *wanted = choice)
    }

    /// Index of the shown variant.
    pub fn variant(&self) -> usize {
        self.shown.left
    }

    /// Indices of the variants that were requested last.
    pub fn wanted(&self) -> (usize, Option<usize>) {
        (self.wanted.left, self.wanted.right)
    }

    /// The changes of the selected Pareto point.
    pub fn front(&self) -> &[String] {
        &self.shown.front
    }

    /// Requests a variant. On an error, the current variant stays.
    ///
    /// `None`: the change is prepared on a thread, and [`Stage::take_opened`] shows it. The same holds for
    /// the other requests.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn show(&mut self, variant: usize) -> anyhow::Result<Option<Kept>> {
        self.request(|wanted| wanted.left = variant)
    }

    /// The index of the variant after `variant`.
    pub fn next(&self, variant: usize) -> usize {
        (variant + 1) % self.variants().len()
    }

    /// Requests the next variant on the right. If a variant is already on the right, closes it instead.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn toggle_second(&mut self) -> anyhow::Result<Option<Kept>> {
        let next = self.next(self.wanted.left);
        self.request(|wanted| wanted.right = if wanted.right.is_none() { Some(next) } else { None })
    }

    /// Requests a variant on the right. On an error, nothing changes.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn show_beside(&mut self, variant: usize) -> anyhow::Result<Option<Kept>> {
        self.request(|wanted| wanted.right = Some(variant))
    }

    /// Replaces the selected Pareto point. On an error, the current point stays.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn take_setting(&mut self, changes: &[String]) -> anyhow::Result<Option<Kept>> {
        self.request(|wanted| wanted.front = changes.to_vec())
    }

    /// Sets a key of the scene to a TOML value, in every variant. On an error, the old value stays.
    ///
    /// # Errors
    /// The scene does not allow this value; or as [`Renderer::open`].
    pub fn set(&mut self, key: &str, value: &str) -> anyhow::Result<Option<Kept>> {
        self.request(|wanted| {
            wanted.changes.retain(|(changed, _)| changed != key);
            wanted.changes.push((key.to_owned(), value.to_owned()));
        })
    }

    /// Drops a manual change: the key has the value of the scene, the variant or the Pareto point again.
    ///
    /// # Errors
    /// As [`Stage::set`].
    pub fn reset(&mut self, key: &str) -> anyhow::Result<Option<Kept>> {
        self.request(|wanted| wanted.changes.retain(|(changed, _)| changed != key))
    }

    fn request(&mut self, change: impl FnOnce(&mut ShownVariants)) -> anyhow::Result<Option<Kept>> {
        let before = self.wanted.clone();
        change(&mut self.wanted);
        let done = self.pursue();
        if done.is_err() {
            self.wanted = before;
            // The left side may have changed before the right side failed.
            self.pursue()?;
        }
        done
    }

    /// True while a thread prepares a change.
    pub fn is_opening(&self) -> bool {
        self.opening.is_some()
    }

    /// Ends simulated disk delays and stops the change in preparation, so that the stage can be dropped soon.
    pub fn end_waits(&mut self) {
        let second = self.second.as_ref().map(|second| &second.renderer);
        std::iter::once(&self.renderer).chain(second).for_each(|renderer| renderer.technique.end_waits()());
        self.opening = None;
    }

    pub fn deterministic(&self) -> bool {
        self.deterministic
    }

    /// Sets the frame size to `size` pixels.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        let second = self.second.as_mut().map(|second| &mut second.renderer);
        std::iter::once(&mut self.renderer).chain(second).try_for_each(|renderer| renderer.resize(size))
    }

    /// Lifts or restores the time budgets of both renderers' streaming.
    pub fn lift_budgets(&mut self, lifted: bool) {
        let second = self.second.as_mut().map(|second| &mut second.renderer);
        std::iter::once(&mut self.renderer)
            .chain(second)
            .for_each(|renderer| renderer.technique.lift_budgets(lifted));
    }

    /// Sets the time since the previous frame of both renderers. A deterministic window has a fixed time.
    pub fn set_frame_seconds(&mut self, seconds: f64) {
        let seconds = if self.deterministic { FRAME_SECONDS } else { seconds };
        let second = self.second.as_mut().map(|second| &mut second.renderer);
        std::iter::once(&mut self.renderer)
            .chain(second)
            .for_each(|renderer| renderer.frame_seconds = seconds);
    }

    /// True if the last pictures of both renderers are complete.
    pub fn settled(&self) -> bool {
        self.renderer.settled() && self.second.as_ref().is_none_or(|second| second.renderer.settled())
    }
}

/// A new renderer of `size` pixels.
///
/// # Errors
/// As [`Renderer::open`]; [`Stopped`](super::job::Stopped).
pub fn open(
    gpu: &Gpu,
    scene: &Scene,
    size: [u32; 2],
    deterministic: bool,
    progress: &JobProgress,
) -> anyhow::Result<Renderer> {
    let stop = Some(progress.stopped());
    let opened = Renderer::on(gpu, scene, &Options { stop, ..options(size, deterministic) });
    if let Err(RenderError::Stopped) = opened {
        progress.check()?;
    }
    Ok(opened?)
}

fn options(size: [u32; 2], deterministic: bool) -> Options<'static> {
    Options { target: PixelFormat::Srgb8, size: Some(size), deterministic, ..Options::default() }
}
