//! The scene in the window: its variants, manual changes to its settings, and one or two renderers.

use anyhow::Context;
use ortelius::frame::Records;
use ortelius::picture::Target;
use ortelius::renderer::sections::LANGUAGES;
use ortelius::renderer::{Options, RenderError, Renderer};
use ortelius::scene::{self, Kind, Scene};
use ortelius::vk::Gpu;

/// Frames in the panels' history of frame times.
pub const HISTORY: usize = 120;

/// A named set of overrides.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    pub name: String,
    /// In the syntax of `-D`, as KEY=VALUE.
    pub changes: Vec<String>,
}

/// One scene on one device.
pub struct Stage {
    gpu: Gpu,
    /// The scene without any variant or change.
    base: Scene,
    deterministic: bool,
    pub variants: Vec<Variant>,
    /// Index of the shown variant.
    pub variant: usize,
    /// The changes of the selected Pareto point. They override those of the variant.
    front: Vec<String>,
    /// Manual changes as (key, value). They override those of the variant and of the Pareto point.
    changes: Vec<(String, String)>,
    /// The scene of the shown variant.
    pub scene: Scene,
    pub renderer: Renderer,
    /// The variant on the right, and its renderer.
    pub second: Option<(usize, Renderer)>,
}

impl Stage {
    /// # Errors
    /// As [`Renderer::open`].
    pub fn new(
        gpu: &Gpu,
        base: Scene,
        variants: Vec<Variant>,
        size: [u32; 2],
        deterministic: bool,
    ) -> anyhow::Result<Stage> {
        let variants = if variants.is_empty() { own_variants(&base) } else { variants };
        let scene = base.with(&variants[0].changes)?;
        let renderer = open(gpu, &scene, size, deterministic)?;
        let (front, changes) = (Vec::new(), Vec::new());
        let gpu = gpu.clone();
        Ok(Stage {
            gpu,
            base,
            deterministic,
            variants,
            variant: 0,
            front,
            changes,
            scene,
            renderer,
            second: None,
        })
    }

    /// The scene of a variant with the selected Pareto point and the manual changes.
    fn scene_of(&self, variant: usize) -> anyhow::Result<Scene> {
        let by_hand = self.changes.iter().map(|(key, value)| format!("{key}={value}"));
        let changes: Vec<String> =
            self.variants[variant].changes.iter().chain(&self.front).cloned().chain(by_hand).collect();
        Ok(self.base.with(&changes)?)
    }

    fn open(&self, scene: &Scene) -> anyhow::Result<Renderer> {
        Ok(open(&self.gpu, scene, self.renderer.size(), self.deterministic)?)
    }

    /// Shows a variant. On an error, the current one stays.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn show(&mut self, variant: usize) -> anyhow::Result<()> {
        let name = || format!("variant {}", self.variants[variant].name);
        let scene = self.scene_of(variant).with_context(name)?;
        if !self.renderer.go_on_with(&self.scene, &scene).with_context(name)? {
            let renderer = self.open(&scene).with_context(name)?;
            self.renderer.drain()?;
            self.renderer = renderer;
        }
        (self.scene, self.variant) = (scene, variant);
        Ok(())
    }

    /// The index of the variant after `variant`.
    pub fn next(&self, variant: usize) -> usize {
        (variant + 1) % self.variants.len()
    }

    /// Opens the next variant on the right, or closes the one on the right.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn toggle_second(&mut self) -> anyhow::Result<()> {
        match self.second.take() {
            Some(_) => Ok(()),
            None => self.show_beside(self.next(self.variant)),
        }
    }

    /// Opens a variant on the right.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn show_beside(&mut self, variant: usize) -> anyhow::Result<()> {
        let name = || format!("variant {}", self.variants[variant].name);
        let renderer = self.open(&self.scene_of(variant).with_context(name)?).with_context(name)?;
        self.second = Some((variant, renderer));
        Ok(())
    }

    /// Replaces the selected Pareto point. On an error, the current one stays.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn take_setting(&mut self, changes: &[String]) -> anyhow::Result<()> {
        let before = std::mem::replace(&mut self.front, changes.to_vec());
        self.take_changes().inspect_err(|_| self.front = before)
    }

    /// Sets a key of the scene to a TOML value, in every variant. On an error, the old value stays.
    ///
    /// # Errors
    /// The scene does not allow this value; or as [`Renderer::open`].
    pub fn set(&mut self, key: &str, value: &str) -> anyhow::Result<()> {
        self.change(|changes| {
            changes.retain(|(changed, _)| changed != key);
            changes.push((key.to_owned(), value.to_owned()));
        })
    }

    /// Drops a manual change: the key has the value of the scene, the variant or the front again.
    ///
    /// # Errors
    /// As [`Stage::set`].
    pub fn reset(&mut self, key: &str) -> anyhow::Result<()> {
        self.change(|changes| changes.retain(|(changed, _)| changed != key))
    }

    fn change(&mut self, change: impl FnOnce(&mut Vec<(String, String)>)) -> anyhow::Result<()> {
        let before = self.changes.clone();
        change(&mut self.changes);
        self.take_changes().inspect_err(|_| self.changes = before)
    }

    /// Reopens both renderers, for example for new shaders. On an error, both stay.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn reopen(&mut self) -> anyhow::Result<()> {
        let (renderer, second) = (self.open(&self.scene)?, self.second_again()?);
        self.renderer.drain()?;
        (self.renderer, self.second) = (renderer, second);
        Ok(())
    }

    /// A new renderer of the second variant with the current manual changes.
    fn second_again(&self) -> anyhow::Result<Option<(usize, Renderer)>> {
        let Some((second, _)) = self.second else { return Ok(None) };
        Ok(Some((second, self.open(&self.scene_of(second)?)?)))
    }

    fn take_changes(&mut self) -> anyhow::Result<()> {
        let second = self.second_again()?;
        self.show(self.variant)?;
        self.second = second;
        Ok(())
    }

    /// A new renderer for another scene, on the same device and of the same size.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn another(&self, scene: &Scene, deterministic: bool) -> Result<Renderer, RenderError> {
        let options = Options {
            target: Target::Srgb8,
            size: Some(self.renderer.size()),
            deterministic,
            ..Options::default()
        };
        Renderer::on(&self.gpu, scene, &options)
    }

    pub fn deterministic(&self) -> bool {
        self.deterministic
    }

    /// Sets the frame size to `size` pixels.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        let second = self.second.as_mut().map(|(_, renderer)| renderer);
        std::iter::once(&mut self.renderer).chain(second).try_for_each(|renderer| renderer.resize(size))
    }

    /// True if the last pictures of both renderers are complete.
    pub fn settled(&self) -> bool {
        self.renderer.settled() && self.second.as_ref().is_none_or(|(_, renderer)| renderer.settled())
    }
}

fn open(gpu: &Gpu, scene: &Scene, size: [u32; 2], deterministic: bool) -> Result<Renderer, RenderError> {
    let options = Options { target: Target::Srgb8, size: Some(size), deterministic, ..Options::default() };
    let mut renderer = Renderer::on(gpu, scene, &options)?;
    renderer.keep(Records::last_ones(HISTORY));
    Ok(renderer)
}

/// The scene's own variant, then one for each other value of the setting that its paper compares: the method
/// that lists visible tiles, or the processor that applies changes of the level of detail.
fn own_variants(scene: &Scene) -> Vec<Variant> {
    let own = Variant { name: "the scene's own".to_owned(), changes: Vec::new() };
    let keys = scene::keys(LANGUAGES);
    let is_virtual = |surface: &scene::Surface| scene.texture_kind(surface) == Some("virtual");
    let is_mesh =
        |name: &&String| scene.word(&["surface", name, "geometry", "kind"]) == Some("progressive-mesh");
    let (declared, key) = match scene.surfaces.values().any(is_virtual) {
        true => ("variant.dedup", "variant.dedup".to_owned()),
        false => match scene.surfaces.keys().find(is_mesh) {
            Some(name) => ("surface.NAME.geometry.apply", format!("surface.{name}.geometry.apply")),
            None => return vec![own],
        },
    };
    let declared = keys.iter().find(|at| at.dotted == declared).expect("the setting is declared");
    let Kind::Choice(values) = &declared.key.kind else { return vec![own] };
    let path: Vec<&str> = key.split('.').collect();
    let default = declared.key.default.as_ref().and_then(|default| default.as_str());
    let now = scene.word(&path).or(default);
    let others = values
        .iter()
        .filter(|(value, _)| Some(*value) != now)
        .map(|(value, _)| Variant { name: (*value).to_owned(), changes: vec![format!("{key}={value}")] });
    std::iter::once(own).chain(others).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ortelius::vk::{Feature, GpuOptions, Watched};

    #[test]
    fn a_setting_holds_for_every_variant_and_a_wrong_one_changes_nothing() {
        let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
        let base = Scene::embedded("globe").unwrap();
        let mut stage = Stage::new(&gpu, base, Vec::new(), [32, 18], true).unwrap();
        let bias = |stage: &Stage| {
            let texture = stage.renderer.technique.texture.as_ref().unwrap();
            texture.settings.streaming.level_bias
        };
        stage.toggle_second().unwrap();
        stage.set("variant.level_bias", "2").unwrap();
        assert_eq!((bias(&stage), stage.variant), (2, 0));
        stage.show(1).unwrap();
        assert_eq!((bias(&stage), stage.variant), (2, 1));
        let before = stage.scene.clone();
        for (key, value) in [("variant.level_bias", "-1"), ("variant.dedup", "none"), ("cache.tiles", "3")] {
            let refused = stage.set(key, value).unwrap_err().to_string();
            assert!(!refused.is_empty());
            assert_eq!((&stage.scene, stage.variant), (&before, 1), "{key} = {value}");
        }
        stage.set("variant.level_bias", "0").unwrap();
        assert_eq!(bias(&stage), 0);
        let pose = stage.scene.pose(0).unwrap();
        stage.resize([20, 30]).unwrap();
        stage.renderer.settle(&pose).unwrap();
        let (_, second) = stage.second.as_mut().unwrap();
        second.settle(&pose).unwrap();
        let (first, second) = (stage.renderer.picture_bytes().unwrap(), second.picture_bytes().unwrap());
        assert!(first == second, "both variants must render the same picture");
    }

    #[test]
    fn another_variant_finds_the_caches_full() {
        let gpu = Watched::open(&GpuOptions { wishes: &Feature::ALL, ..GpuOptions::default() });
        // At this size, the resident mip tail holds the whole globe.
        let base = Scene::embedded("earth").unwrap();
        let pose = base.pose(0).unwrap();
        let mut stage = Stage::new(&gpu, base, Vec::new(), [64, 36], true).unwrap();
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
        assert_eq!(loads(&mut stage), 0, "variant {}", stage.variants[1].name);
        assert!(first == stage.renderer.picture_bytes().unwrap());
        stage.set("surface.land.filter.max_anisotropy", "4").unwrap();
        let fresh = stage.another(&stage.scene, true).unwrap();
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
    fn shipped_scenes_have_the_variants_of_their_paper() {
        let names = |scene: &str| -> Vec<String> {
            let variants = own_variants(&Scene::embedded(scene).unwrap());
            variants.into_iter().map(|variant| variant.name).collect()
        };
        let globe = names("globe");
        assert!(globe.len() > 5 && globe.contains(&"fused".to_owned()), "{globe:?}");
        let herd = names("herd");
        assert!(herd.len() >= 2, "{herd:?}");
    }
}
