//! The scene in the window: its variants, manual changes to its settings, and one or two renderers. A change that a
//! renderer cannot make in place is prepared on a thread; until it is ready, the window shows the old picture.

use super::job::{Job, JobProgress};
use super::variants::Variant;
use super::views::OpenView;
use anyhow::Context;
pub use ortelius::frame::HISTORY;
use ortelius::frame::Technique;
use ortelius::picture::PixelFormat;
use ortelius::renderer::{Kept, LoadedSwitch, Options, RenderError, Renderer, Switch};
use ortelius::scene::Scene;
use ortelius::vk::Gpu;

/// One scene on one device.
pub struct Stage {
    gpu: Gpu,
    /// At least one.
    pub views: Vec<OpenView>,
    deterministic: bool,
    shown: Choice,
    /// The last request. It differs from `shown` while a scene is opened.
    wanted: Choice,
    opening: Option<Opening>,
    /// The scene of the shown variant.
    pub scene: Scene,
    pub renderer: Renderer,
    pub second: Option<Second>,
    /// The next opening waits for a message or the sender's end.
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
struct Choice {
    view: usize,
    /// The view's variants.
    left: usize,
    right: Option<usize>,
    /// The changes of the selected Pareto point. They override those of the variants.
    front: Vec<String>,
    /// Manual changes as (key, value). They override those of the variants and of the Pareto point.
    changes: Vec<(String, String)>,
}

/// How one side of the window gets another scene.
enum Plan {
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
struct Opening {
    choice: Choice,
    /// Both sides are opened again, whatever they show.
    is_reload: bool,
    job: Job<Vec<Side<Ready>>>,
}

/// A change whose preparation has ended.
pub struct Opened {
    pub is_reload: bool,
    /// Its variant on the left.
    pub variant: usize,
    /// `None` if a later request has taken the change back.
    pub kept: anyhow::Result<Option<Kept>>,
}

impl Stage {
    /// One view.
    #[cfg(test)]
    fn new(
        gpu: &Gpu,
        base: Scene,
        variants: Vec<Variant>,
        size: [u32; 2],
        deterministic: bool,
    ) -> anyhow::Result<Stage> {
        let camera = *base.camera(&base.view.camera)?;
        Stage::of(gpu, vec![OpenView::new(String::new(), base, camera, variants)], size, deterministic)
    }

    /// Opens the first view.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn of(gpu: &Gpu, views: Vec<OpenView>, size: [u32; 2], deterministic: bool) -> anyhow::Result<Stage> {
        let first = views.first().expect("there is at least one view");
        let scene = first.scene.with(&first.variants[0].changes)?;
        let renderer = open(gpu, &scene, size, deterministic)?;
        Ok(Stage {
            gpu: gpu.clone(),
            views,
            deterministic,
            shown: Choice::default(),
            wanted: Choice::default(),
            opening: None,
            scene,
            renderer,
            second: None,
            #[cfg(test)]
            gate: None,
        })
    }

    /// Index of the shown view, and of the one that was requested last.
    pub fn view(&self) -> [usize; 2] {
        [self.shown.view, self.wanted.view]
    }

    /// The variants of the view that was requested last.
    pub fn variants(&self) -> &[Variant] {
        &self.views[self.wanted.view].variants
    }

    /// Requests a view, with the variants of the same names. Manual changes and the Pareto point stay if it is a view of
    /// the same scene. On an error, the current view stays.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn show_view(&mut self, view: usize) -> anyhow::Result<Option<Kept>> {
        let (before, next) = (&self.views[self.wanted.view], &self.views[view]);
        let same = |variant: usize| next.variant(&before.variants[variant].name).unwrap_or(0);
        let choice = Choice {
            view,
            left: same(self.wanted.left),
            right: self.wanted.right.map(same),
            ..Choice::default()
        };
        let choice = match before.scene.name == next.scene.name {
            true => {
                Choice { front: self.wanted.front.clone(), changes: self.wanted.changes.clone(), ..choice }
            }
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

    /// Requests a variant. On an error, the current one stays.
    ///
    /// `None`: the change is prepared on a thread, and [`Stage::take_opened`] shows it. So do the other requests.
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

    /// Requests the next variant on the right, or closes the one on the right.
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

    /// Replaces the selected Pareto point. On an error, the current one stays.
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

    fn request(&mut self, change: impl FnOnce(&mut Choice)) -> anyhow::Result<Option<Kept>> {
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

    /// Makes the wanted change: at once if both sides change in place, otherwise on a thread. A request that arrives
    /// while the thread works begins when it has ended.
    fn pursue(&mut self) -> anyhow::Result<Option<Kept>> {
        let plans = self.plan(&self.wanted)?;
        let in_place = |plan: &Plan| match plan {
            Plan::Stays => true,
            Plan::Switches(switch) => switch.kept() == Kept::Everything,
            Plan::Opens => false,
        };
        if plans.iter().all(|(_, plan)| in_place(plan)) {
            let load = |(scene, plan): Side<Plan>| Ok((scene, self.load(plan)?));
            let sides = plans.into_iter().map(load).collect::<anyhow::Result<_>>()?;
            return self.install(self.wanted.clone(), sides).map(Some);
        }
        if self.opening.is_none() {
            self.open(plans, false)?;
        }
        Ok(None)
    }

    /// What loads at once.
    fn load(&self, plan: Plan) -> anyhow::Result<Ready> {
        match plan {
            Plan::Stays => Ok(Ready::Nothing),
            Plan::Switches(switch) => Ok(Ready::Switch(Box::new(switch.load()?))),
            Plan::Opens => unreachable!("a scene is opened on a thread"),
        }
    }

    /// The left side of a choice, and the right side if it has one.
    fn plan(&self, choice: &Choice) -> anyhow::Result<Vec<Side<Plan>>> {
        let second = self.second.as_ref().map(|second| (&second.scene, &second.renderer));
        let sides = [(Some(choice.left), Some((&self.scene, &self.renderer))), (choice.right, second)];
        let sides = sides.into_iter().filter_map(|(variant, shown)| Some((variant?, shown)));
        let plan = |(variant, shown): (usize, Option<(&Scene, &Renderer)>)| {
            let name = || format!("variant {}", self.views[choice.view].variants[variant].name);
            let scene = self.scene_of(choice, variant).with_context(name)?;
            let options = options(self.renderer.size(), self.deterministic);
            let plan = match shown {
                None => Plan::Opens,
                Some((now, _)) if *now == scene => Plan::Stays,
                Some((now, renderer)) => {
                    let switch = renderer.plan_switch(now, &scene, &options).with_context(name)?;
                    switch.map_or(Plan::Opens, |switch| Plan::Switches(Box::new(switch)))
                }
            };
            Ok((scene, plan))
        };
        sides.map(plan).collect()
    }

    /// The scene of a variant with the selected Pareto point and the manual changes.
    fn scene_of(&self, choice: &Choice, variant: usize) -> anyhow::Result<Scene> {
        let by_hand = choice.changes.iter().map(|(key, value)| format!("{key}={value}"));
        let view = &self.views[choice.view];
        let changes: Vec<String> =
            view.variants[variant].changes.iter().chain(&choice.front).cloned().chain(by_hand).collect();
        Ok(view.scene.with(&changes)?)
    }

    /// Starts the thread that prepares the wanted change.
    fn open(&mut self, plans: Vec<Side<Plan>>, is_reload: bool) -> anyhow::Result<()> {
        let (gpu, size, deterministic) = (self.gpu.clone(), self.renderer.size(), self.deterministic);
        let choice = self.wanted.clone();
        let variants = [Some(choice.left), choice.right].into_iter().flatten();
        let names: Vec<String> = variants.map(|variant| self.variants()[variant].name.clone()).collect();
        #[cfg(test)]
        let gate = self.gate.take();
        let prepare = move |progress: &JobProgress| {
            #[cfg(test)]
            gate.iter().for_each(|gate| gate.recv().unwrap_or_default());
            let side = |((scene, plan), name): (Side<Plan>, &String)| -> anyhow::Result<_> {
                progress.check()?;
                let ready = match plan {
                    Plan::Stays => Ok(Ready::Nothing),
                    Plan::Switches(switch) => switch.load().map(Box::new).map(Ready::Switch),
                    Plan::Opens => open(&gpu, &scene, size, deterministic).map(Box::new).map(Ready::Renderer),
                };
                Ok((scene, ready.with_context(|| format!("variant {name}"))?))
            };
            plans.into_iter().zip(&names).map(side).collect()
        };
        let job = Job::start("opening", 1, prepare)?;
        self.opening = Some(Opening { choice, is_reload, job });
        Ok(())
    }

    /// Shows a choice, whose sides are ready.
    fn install(&mut self, choice: Choice, sides: Vec<Side<Ready>>) -> anyhow::Result<Kept> {
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
        self.shown = Choice { right, ..choice };
        Ok(kept)
    }

    /// Shows what a thread has prepared, once; then begins with a request that arrived meanwhile. After an error, the
    /// old picture stays, and what is wanted is what is shown.
    pub fn take_opened(&mut self) -> Option<Opened> {
        let has_ended = |opening: &mut Opening| opening.job.has_ended();
        let Opening { choice, is_reload, job } = self.opening.take_if(has_ended)?;
        let kept = job.wait().and_then(|sides| match is_reload || !self.is_shown(&self.wanted) {
            true => self.install(choice.clone(), sides).map(Some),
            false => Ok(None),
        });
        let opened = |kept| Some(Opened { is_reload, variant: choice.left, kept });
        if kept.is_err() && self.wanted == choice {
            self.wanted = self.shown.clone();
        }
        // What is shown cannot be opened again: trying once more would not end.
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

    /// True if the window shows a choice, down to its settings.
    fn is_shown(&self, choice: &Choice) -> bool {
        let stays = |sides: Vec<Side<Plan>>| sides.iter().all(|(_, plan)| matches!(plan, Plan::Stays));
        choice.right.is_some() == self.second.is_some() && self.plan(choice).is_ok_and(stays)
    }

    /// Opens both sides again, for example for new shaders. Requires that nothing is being opened. On an error, both
    /// stay.
    ///
    /// # Errors
    /// No thread.
    pub fn reopen(&mut self) -> anyhow::Result<()> {
        assert!(self.opening.is_none(), "one scene is opened at a time");
        let second = self.second.as_ref().map(|second| second.scene.clone());
        let scenes = std::iter::once(self.scene.clone()).chain(second);
        self.open(scenes.map(|scene| (scene, Plan::Opens)).collect(), true)
    }

    /// True while a thread prepares a change.
    pub fn is_opening(&self) -> bool {
        self.opening.is_some()
    }

    /// Ends what is under way, so that the stage can be dropped soon.
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

    /// True if the last pictures of both renderers are complete.
    pub fn settled(&self) -> bool {
        self.renderer.settled() && self.second.as_ref().is_none_or(|second| second.renderer.settled())
    }
}

/// A new renderer of `size` pixels.
///
/// # Errors
/// As [`Renderer::open`].
pub fn open(gpu: &Gpu, scene: &Scene, size: [u32; 2], deterministic: bool) -> Result<Renderer, RenderError> {
    Renderer::on(gpu, scene, &options(size, deterministic))
}

fn options(size: [u32; 2], deterministic: bool) -> Options<'static> {
    Options { target: PixelFormat::Srgb8, size: Some(size), deterministic, ..Options::default() }
}

/// Resizes a renderer that was opened for another size of the window.
fn fit(renderer: &mut Renderer, size: [u32; 2]) -> Result<(), RenderError> {
    if renderer.size() == size { Ok(()) } else { renderer.resize(size) }
}

/// Gives a renderer what it needs for another scene; `None` if it needs nothing. On an error, it stays as it was.
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

#[cfg(test)]
mod tests {
    use super::super::variants::own_variants;
    use super::*;
    use ortelius::frame::Records;
    use ortelius::vk::{Feature, GpuOptions, Watched};

    /// The variants that show the same picture.
    fn methods(scene: &Scene) -> Vec<Variant> {
        let is_method = |variant: &Variant| !variant.changes.iter().any(|change| change.contains(".filter="));
        own_variants(scene).into_iter().filter(is_method).collect()
    }

    /// Waits for the thread that prepares a change.
    fn opened(stage: &mut Stage) -> anyhow::Result<Option<Kept>> {
        loop {
            match stage.take_opened() {
                Some(opened) => return opened.kept,
                None => std::thread::yield_now(),
            }
        }
    }

    const BORDER: &str = "surface.land.texture.border";

    #[test]
    fn the_old_picture_stays_until_the_new_scene_is_open_and_later_requests_wait_or_take_it_back() {
        let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
        let base = Scene::embedded("globe").unwrap();
        let (pose, variants) = (base.pose(0).unwrap(), methods(&base));
        let mut stage = Stage::new(&gpu, base, variants, [32, 18], true).unwrap();
        let has = |stage: &Stage, table: [&str; 2], key: &str, value: i64| {
            let at = match table {
                ["variant", _] => stage.scene.value(&["variant", key]),
                _ => stage.scene.value(&["surface", "land", "texture", key]),
            };
            at.and_then(|at| at.as_integer()) == Some(value)
        };
        let (texture, variant) = (["texture", ""], ["variant", ""]);
        let gated = |stage: &mut Stage| {
            let (go, gate) = std::sync::mpsc::channel();
            stage.gate = Some(gate);
            go
        };
        // Frames continue, and a request that needs the new scene waits.
        let go = gated(&mut stage);
        let before = stage.scene.clone();
        assert_eq!(stage.set(BORDER, "8").unwrap(), None);
        stage.renderer.settle(&pose).unwrap();
        stage.resize([48, 27]).unwrap();
        assert_eq!(stage.set("variant.level_bias", "1").unwrap(), None);
        assert!(stage.take_opened().is_none() && stage.is_opening() && stage.scene == before);
        go.send(()).unwrap();
        assert_eq!(opened(&mut stage).unwrap(), Some(Kept::Nothing));
        assert!(has(&stage, texture, "border", 8) && has(&stage, variant, "level_bias", 1));
        assert!(!stage.is_opening() && stage.renderer.size() == [48, 27]);
        stage.renderer.settle(&pose).unwrap();
        let picture = stage.renderer.picture_bytes().unwrap();

        // A request that is taken back shows nothing.
        let go = gated(&mut stage);
        assert_eq!(stage.set(BORDER, "4").unwrap(), None);
        assert_eq!(stage.set(BORDER, "8").unwrap(), Some(Kept::Everything));
        go.send(()).unwrap();
        assert_eq!(opened(&mut stage).unwrap(), None);
        let go = gated(&mut stage);
        assert_eq!(stage.toggle_second().unwrap(), None);
        assert_eq!(stage.toggle_second().unwrap(), Some(Kept::Everything));
        drop(go);
        assert_eq!(opened(&mut stage).unwrap(), None);
        assert!(stage.second.is_none() && has(&stage, texture, "border", 8));

        // A scene that cannot be opened leaves the picture; the next change does not ask for it again.
        let nowhere = "{kind='virtual', source='file', path='/nowhere.tiles'}";
        assert_eq!(stage.set("surface.land.texture", nowhere).unwrap(), None);
        let words = format!("{:#}", opened(&mut stage).unwrap_err());
        assert!(words.contains("/nowhere.tiles"), "{words}");
        assert_eq!(stage.set("variant.level_bias", "1").unwrap(), Some(Kept::Everything));
        stage.renderer.settle(&pose).unwrap();
        assert!(picture == stage.renderer.picture_bytes().unwrap());
    }

    #[test]
    fn a_change_in_place_is_made_while_shaders_are_reloaded_and_stays_afterwards() {
        let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
        let base = Scene::embedded("globe").unwrap();
        let variants = methods(&base);
        let mut stage = Stage::new(&gpu, base, variants, [32, 18], true).unwrap();
        let (go, gate) = std::sync::mpsc::channel();
        stage.gate = Some(gate);
        stage.reopen().unwrap();
        assert_eq!(stage.show(1).unwrap(), Some(Kept::Everything));
        let shown = stage.scene.clone();
        go.send(()).unwrap();
        assert_eq!(opened(&mut stage).unwrap(), Some(Kept::Nothing));
        assert_eq!((&stage.scene, stage.variant(), stage.is_opening()), (&shown, 1, false));
    }

    #[test]
    fn a_setting_holds_for_every_variant_and_a_wrong_one_changes_nothing() {
        let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
        let base = Scene::embedded("globe").unwrap();
        let variants = methods(&base);
        let mut stage = Stage::new(&gpu, base, variants, [32, 18], true).unwrap();
        let bias = |stage: &Stage| {
            let texture = stage.renderer.technique.texture.as_ref().unwrap();
            texture.settings.streaming.level_bias
        };
        assert_eq!(stage.toggle_second().unwrap(), None);
        assert_eq!(opened(&mut stage).unwrap(), Some(Kept::Everything), "the left side stays");
        assert_eq!(stage.set("variant.level_bias", "2").unwrap(), Some(Kept::Everything));
        assert_eq!((bias(&stage), stage.variant()), (2, 0));
        stage.show(1).unwrap();
        assert_eq!((bias(&stage), stage.variant()), (2, 1));
        let before = stage.scene.clone();
        for (key, value) in [("variant.level_bias", "-1"), ("variant.dedup", "none"), ("cache.tiles", "3")] {
            let refused = stage.set(key, value).unwrap_err().to_string();
            assert!(!refused.is_empty());
            assert_eq!((&stage.scene, stage.variant()), (&before, 1), "{key} = {value}");
        }
        stage.set("variant.level_bias", "0").unwrap();
        assert_eq!(bias(&stage), 0);
        let pose = stage.scene.pose(0).unwrap();
        stage.resize([20, 30]).unwrap();
        stage.renderer.settle(&pose).unwrap();
        let second = &mut stage.second.as_mut().unwrap().renderer;
        second.settle(&pose).unwrap();
        let (first, second) = (stage.renderer.picture_bytes().unwrap(), second.picture_bytes().unwrap());
        assert!(first == second, "both variants must render the same picture");
    }

    #[test]
    fn another_variant_finds_the_caches_full() {
        let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
        // Not `globe`: at this size, its resident mip tail would hold everything, and no tile would be loaded.
        let base = Scene::embedded("earth").unwrap();
        let pose = base.pose(0).unwrap();
        let variants = methods(&base);
        let mut stage = Stage::new(&gpu, base, variants, [64, 36], true).unwrap();
        let loads = |stage: &mut Stage| -> usize {
            stage.renderer.keep(Records::all());
            stage.renderer.settle(&pose).unwrap();
            stage.renderer.drain().unwrap();
            let records = stage.renderer.records.iter().filter_map(|record| record.texture.as_ref());
            records.map(|record| record.streaming.loads).sum()
        };
        assert!(loads(&mut stage) > 0);
        let first = stage.renderer.picture_bytes().unwrap();
        stage.show(1).unwrap();
        assert_eq!(loads(&mut stage), 0, "variant {}", stage.variants()[1].name);
        assert!(first == stage.renderer.picture_bytes().unwrap());
        stage.set("surface.land.filter.max_anisotropy", "4").unwrap();
        let fresh = open(&gpu, &stage.scene, [64, 36], true).unwrap();
        let old = std::mem::replace(&mut stage.renderer, fresh);
        assert!(loads(&mut stage) > 0, "a new renderer has empty caches");
        let opened = stage.renderer.picture_bytes().unwrap();
        stage.renderer = old;
        stage.renderer.settle(&pose).unwrap();
        assert!(
            opened == stage.renderer.picture_bytes().unwrap(),
            "a reconfigured renderer must equal a new one"
        );
    }

    #[test]
    fn settings_change_in_place_and_show_the_picture_of_a_scene_that_was_just_opened() {
        let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
        let base = Scene::embedded("earth").unwrap();
        let mesh = "surface.bunny={geometry={kind='progressive-mesh', source='sphere', size_m=9e4, latitude_deg=46.5, \
                    longitude_deg=9.5}}";
        let base = base.with(&[mesh.to_owned()]).unwrap();
        let pose = base.pose(0).unwrap();
        let variants = methods(&base);
        let mut stage = Stage::new(&gpu, base, variants, [64, 36], false).unwrap();
        let loads = |renderer: &mut Renderer| -> usize {
            renderer.keep(Records::all());
            renderer.settle(&pose).unwrap();
            renderer.drain().unwrap();
            let records = renderer.records.iter().filter_map(|record| record.texture.as_ref());
            records.map(|record| record.streaming.loads).sum()
        };
        assert!(loads(&mut stage.renderer) > 0);
        stage.show_beside(1).unwrap();
        opened(&mut stage).unwrap();
        assert!(loads(&mut stage.second.as_mut().unwrap().renderer) > 0, "it has caches of its own");
        let changes = [
            ("variant.level_bias", "1", Kept::Everything),
            ("variant.level_bias", "0", Kept::Everything),
            ("cache.gpu_tiles", "100", Kept::Everything),
            ("cache.host_tiles", "500", Kept::Everything),
            ("cache.host_tiles", "250", Kept::Everything),
            ("cache.prefetch_frames", "4", Kept::Everything),
            ("cache.upload_tiles_per_frame", "3", Kept::Everything),
            ("variant.dedup", "test-or", Kept::Everything),
            ("surface.land.filter.max_anisotropy", "4", Kept::Everything),
            ("surface.bunny.geometry.error_pixels", "6.0", Kept::Everything),
            ("surface.bunny.geometry.size_m", "6e4", Kept::Tiles),
            ("surface.land.lit", "true", Kept::Tiles),
            ("surface.land.texture.border", "8", Kept::Nothing),
            ("governor.frame_faces", "100", Kept::Everything),
        ];
        for (key, value, kept) in changes {
            let at_once = stage.set(key, value).unwrap();
            let made = at_once.or_else(|| opened(&mut stage).unwrap());
            assert_eq!(made, Some(kept), "{key} = {value}");
            assert_eq!(at_once.is_some(), kept == Kept::Everything, "{key} = {value}");
            let mut fresh = open(&gpu, &stage.scene, [64, 36], false).unwrap();
            fresh.settle(&pose).unwrap();
            let expected = fresh.picture_bytes().unwrap();
            let second = &mut stage.second.as_mut().unwrap().renderer;
            for (side, renderer) in [("left", &mut stage.renderer), ("right", second)] {
                let loaded = loads(renderer);
                match key {
                    // These settings make tiles visible that were not visible before.
                    "variant.level_bias" | "surface.land.filter.max_anisotropy" => {}
                    _ => assert_eq!(
                        loaded > 0,
                        kept == Kept::Nothing,
                        "{side}: {key} = {value}: {loaded} loads"
                    ),
                }
                // The governor's picture depends on its frames.
                let same = renderer.picture_bytes().unwrap() == expected;
                assert!(same || stage.scene.has(&["governor"]), "{side}: {key} = {value}");
            }
        }
    }
}
