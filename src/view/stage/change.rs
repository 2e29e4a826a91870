//! A change of the window's scenes: planned for each side, prepared on a thread if it takes time, then installed.

use super::{Second, ShownVariants, Stage, open, options};
use crate::view::job::{Job, JobProgress};
use anyhow::Context;
use ortelius::renderer::{Kept, LoadedSwitch, RenderError, Renderer, Switch};
use ortelius::scene::Scene;

/// How one side of the window gets another scene.
enum SidePlan {
    Stays,
    Switches(Box<Switch>),
    Opens,
}

/// What one side needs for its scene.
enum Ready {
    Nothing,
    Switch(Box<LoadedSwitch>),
    Renderer(Box<Renderer>),
}

/// The scene of a side, and what it needs.
type Side<T> = (Scene, T);

/// A change that a thread prepares.
pub(super) struct PendingChange {
    choice: ShownVariants,
    /// Both sides are opened again, whatever they show.
    is_reload: bool,
    job: Job<Vec<Side<Ready>>>,
}

/// A change whose preparation has ended.
pub struct FinishedChange {
    pub is_reload: bool,
    /// The variant on the left.
    pub variant: usize,
    /// What the renderers keep; `None` if a later request has cancelled the change.
    pub kept: anyhow::Result<Option<Kept>>,
}

impl Stage {
    /// Makes the wanted change: at once if both sides change in place, otherwise on a thread. While the thread works,
    /// only requests that change in place are handled; the others wait until the thread has ended.
    pub(super) fn pursue(&mut self) -> anyhow::Result<Option<Kept>> {
        let plans = self.plan(&self.wanted)?;
        let in_place = |plan: &SidePlan| match plan {
            SidePlan::Stays => true,
            SidePlan::Switches(switch) => switch.kept() == Kept::Everything,
            SidePlan::Opens => false,
        };
        if plans.iter().all(|(_, plan)| in_place(plan)) {
            let load = |(scene, plan): Side<SidePlan>| Ok((scene, self.load(plan)?));
            let sides = plans.into_iter().map(load).collect::<anyhow::Result<_>>()?;
            return self.install(self.wanted.clone(), sides).map(Some);
        }
        if self.opening.is_none() {
            self.open(plans, false)?;
        }
        Ok(None)
    }

    /// Loads what a plan needs, without a thread.
    fn load(&self, plan: SidePlan) -> anyhow::Result<Ready> {
        match plan {
            SidePlan::Stays => Ok(Ready::Nothing),
            SidePlan::Switches(switch) => Ok(Ready::Switch(Box::new(switch.load(None)?))),
            SidePlan::Opens => unreachable!("a scene is opened on a thread"),
        }
    }

    /// Plans the left side of a choice, and the right side if the choice has one.
    fn plan(&self, choice: &ShownVariants) -> anyhow::Result<Vec<Side<SidePlan>>> {
        let second = self.second.as_ref().map(|second| (&second.scene, &second.renderer));
        let sides = [(Some(choice.left), Some((&self.scene, &self.renderer))), (choice.right, second)];
        let sides = sides.into_iter().filter_map(|(variant, shown)| Some((variant?, shown)));
        let plan = |(variant, shown): (usize, Option<(&Scene, &Renderer)>)| {
            let name = || format!("variant {}", self.views[choice.view].variants[variant].name);
            let scene = self.scene_of(choice, variant).with_context(name)?;
            let options = options(self.renderer.size(), self.deterministic);
            let plan = match shown {
                None => SidePlan::Opens,
                Some((now, _)) if *now == scene => SidePlan::Stays,
                Some((now, renderer)) => {
                    let switch = renderer.plan_switch(now, &scene, &options).with_context(name)?;
                    switch.map_or(SidePlan::Opens, |switch| SidePlan::Switches(Box::new(switch)))
                }
            };
            Ok((scene, plan))
        };
        sides.map(plan).collect()
    }

    /// The scene of a variant with the selected Pareto point and the manual changes.
    fn scene_of(&self, choice: &ShownVariants, variant: usize) -> anyhow::Result<Scene> {
        let by_hand = choice.changes.iter().map(|(key, value)| format!("{key}={value}"));
        let view = &self.views[choice.view];
        let changes: Vec<String> =
            view.variants[variant].changes.iter().chain(&choice.front).cloned().chain(by_hand).collect();
        Ok(view.scene.with(&changes)?)
    }

    /// Starts the thread that prepares the wanted change.
    fn open(&mut self, plans: Vec<Side<SidePlan>>, is_reload: bool) -> anyhow::Result<()> {
        let (gpu, size, deterministic) = (self.gpu.clone(), self.renderer.size(), self.deterministic);
        let choice = self.wanted.clone();
        let variants = [Some(choice.left), choice.right].into_iter().flatten();
        let names: Vec<String> = variants.map(|variant| self.variants()[variant].name.clone()).collect();
        #[cfg(test)]
        let gate = self.gate.take();
        let prepare = move |progress: &JobProgress| {
            #[cfg(test)]
            gate.iter().for_each(|gate| gate.recv().unwrap_or_default());
            let side = |((scene, plan), name): (Side<SidePlan>, &String)| -> anyhow::Result<_> {
                progress.check()?;
                let ready = match plan {
                    SidePlan::Stays => Ok(Ready::Nothing),
                    SidePlan::Switches(switch) => {
                        let loaded = switch.load(Some(progress.stopped()));
                        loaded.map(Box::new).map(Ready::Switch).map_err(Into::into)
                    }
                    SidePlan::Opens => {
                        let opened = open(&gpu, &scene, size, deterministic, progress);
                        opened.map(Box::new).map(Ready::Renderer)
                    }
                };
                Ok((scene, ready.with_context(|| format!("variant {name}"))?))
            };
            plans.into_iter().zip(&names).map(side).collect()
        };
        let job = Job::start("opening", 1, prepare)?;
        self.opening = Some(PendingChange { choice, is_reload, job });
        Ok(())
    }

    /// Shows a choice, whose sides are ready.
    fn install(&mut self, choice: ShownVariants, sides: Vec<Side<Ready>>) -> anyhow::Result<Kept> {
        let mut sides = sides.into_iter();
        let (scene, ready) = sides.next().expect("there is a left side");
        let mut kept = Kept::Everything;
        if let Some(now) = bring(&mut self.renderer, ready)? {
            (self.scene, kept) = (scene, now);
        }
        match (sides.next(), &mut self.second) {
            (None, second) => *second = None,
            (Some((scene, Ready::Renderer(mut renderer))), second) => {
                fit(&mut renderer, self.renderer.size())?;
                let variant = choice.right.expect("there is a right side");
                *second = Some(Second { variant, scene, renderer: *renderer });
            }
            (Some((scene, ready)), Some(second)) => {
                second.variant = choice.right.expect("there is a right side");
                if let Some(now) = bring(&mut second.renderer, ready)? {
                    (second.scene, kept) = (scene, kept.min(now));
                }
            }
            // The right side was closed while the thread prepared it.
            (Some(_), None) => {}
        }
        let right = self.second.as_ref().map(|second| second.variant);
        self.shown = ShownVariants { right, ..choice };
        Ok(kept)
    }

    /// Shows the prepared change once its thread has ended. Then starts the change that was requested meanwhile, if
    /// any. After an error, the old picture stays, and the shown choice becomes the wanted one.
    pub fn take_opened(&mut self) -> Option<FinishedChange> {
        let has_ended = |opening: &mut PendingChange| opening.job.has_ended();
        let PendingChange { choice, is_reload, job } = self.opening.take_if(has_ended)?;
        let kept = job.wait().and_then(|sides| match is_reload || !self.is_shown(&self.wanted) {
            true => self.install(choice.clone(), sides).map(Some),
            false => Ok(None),
        });
        let opened = |kept| Some(FinishedChange { is_reload, variant: choice.left, kept });
        if kept.is_err() && self.wanted == choice {
            self.wanted = self.shown.clone();
        }
        // The shown choice cannot be opened again. Another attempt would fail too, and so on without end.
        if kept.is_err() && choice == self.shown && self.wanted == self.shown {
            return opened(kept);
        }
        match self.pursue() {
            Err(error) => {
                self.wanted = self.shown.clone();
                opened(kept.and(Err(error)))
            }
            Ok(_) => opened(kept),
        }
    }

    /// True if the window already shows this choice with all of its settings.
    fn is_shown(&self, choice: &ShownVariants) -> bool {
        let stays =
            |sides: Vec<Side<SidePlan>>| sides.iter().all(|(_, plan)| matches!(plan, SidePlan::Stays));
        choice.right.is_some() == self.second.is_some() && self.plan(choice).is_ok_and(stays)
    }

    /// Opens both sides again, for example for new shaders. Requires that no scene is being opened. On an error, both
    /// sides stay as they are.
    ///
    /// # Errors
    /// A thread cannot be created.
    pub fn reopen(&mut self) -> anyhow::Result<()> {
        assert!(self.opening.is_none(), "one scene is opened at a time");
        let second = self.second.as_ref().map(|second| second.scene.clone());
        let scenes = std::iter::once(self.scene.clone()).chain(second);
        self.open(scenes.map(|scene| (scene, SidePlan::Opens)).collect(), true)
    }
}

/// Resizes a renderer that was opened for another size of the window.
fn fit(renderer: &mut Renderer, size: [u32; 2]) -> Result<(), RenderError> {
    if renderer.size() == size { Ok(()) } else { renderer.resize(size) }
}

/// Gives a renderer what it needs for another scene. Returns `None` if it needs nothing. On an error, the renderer
/// stays as it was.
fn bring(renderer: &mut Renderer, ready: Ready) -> Result<Option<Kept>, RenderError> {
    match ready {
        Ready::Nothing => Ok(None),
        Ready::Switch(switch) => renderer.switch(*switch).map(Some),
        Ready::Renderer(mut other) => {
            fit(&mut other, renderer.size())?;
            renderer.drain()?;
            *renderer = *other;
            Ok(Some(Kept::Nothing))
        }
    }
}
