//! The scene in the window: its variants, the settings changed by hand, and the renderers of what is compared.

use anyhow::Context;
use ortelius::frame::Records;
use ortelius::picture::Target;
use ortelius::renderer::sections::LANGUAGES;
use ortelius::renderer::{Options, RenderError, Renderer};
use ortelius::scene::{self, Kind, Scene};
use ortelius::vk::Gpu;

/// Frames whose times the panels show.
pub const HISTORY: usize = 120;

/// Settings that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    pub name: String,
    /// As for `-D`.
    pub changes: Vec<String>,
}

/// One scene on one device.
pub struct Stage {
    gpu: Gpu,
    /// Without variant and without changes.
    base: Scene,
    deterministic: bool,
    pub variants: Vec<Variant>,
    /// Number of the variant that is shown.
    pub variant: usize,
    /// Changed by hand, on top of every variant; as for `-D`, by key.
    changes: Vec<(String, String)>,
    /// What is shown.
    pub scene: Scene,
    pub renderer: Renderer,
    /// The variant beside it.
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
        let changes = Vec::new();
        let gpu = gpu.clone();
        Ok(Stage { gpu, base, deterministic, variants, variant: 0, changes, scene, renderer, second: None })
    }

    /// The scene of a variant, with the changes by hand.
    fn scene_of(&self, variant: usize) -> anyhow::Result<Scene> {
        let by_hand = self.changes.iter().map(|(key, value)| format!("{key}={value}"));
        let changes: Vec<String> = self.variants[variant].changes.iter().cloned().chain(by_hand).collect();
        Ok(self.base.with(&changes)?)
    }

    fn open(&self, scene: &Scene) -> anyhow::Result<Renderer> {
        Ok(open(&self.gpu, scene, self.renderer.size(), self.deterministic)?)
    }

    /// Shows a variant. What is shown stays where that fails.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn show(&mut self, variant: usize) -> anyhow::Result<()> {
        let name = || format!("variant {}", self.variants[variant].name);
        let scene = self.scene_of(variant).with_context(name)?;
        let renderer = self.open(&scene).with_context(name)?;
        self.renderer.drain()?;
        (self.scene, self.renderer, self.variant) = (scene, renderer, variant);
        Ok(())
    }

    /// The number of the variant behind `variant`.
    pub fn next(&self, variant: usize) -> usize {
        (variant + 1) % self.variants.len()
    }

    /// Opens the next variant beside the one that is shown, or closes it.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn toggle_second(&mut self) -> anyhow::Result<()> {
        if self.second.take().is_some() {
            return Ok(());
        }
        let next = self.next(self.variant);
        let name = || format!("variant {}", self.variants[next].name);
        let renderer = self.open(&self.scene_of(next).with_context(name)?).with_context(name)?;
        self.second = Some((next, renderer));
        Ok(())
    }

    /// Sets a key of the scene to a TOML value, in every variant. What is shown stays where that fails.
    ///
    /// # Errors
    /// A value that the scene cannot have; as [`Renderer::open`].
    pub fn set(&mut self, key: &str, value: &str) -> anyhow::Result<()> {
        let before = self.changes.clone();
        self.changes.retain(|(changed, _)| changed != key);
        self.changes.push((key.to_owned(), value.to_owned()));
        let second = self.second.as_ref().map(|(second, _)| *second);
        let done = self.show(self.variant).and_then(|()| match second {
            Some(second) => {
                let renderer = self.open(&self.scene_of(second)?)?;
                self.second = Some((second, renderer));
                Ok(())
            }
            None => Ok(()),
        });
        if done.is_err() {
            self.changes = before;
        }
        done
    }

    /// A renderer for the scene with more changes, on the same device.
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

    /// Frames are of `size` pixels from now on.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        let second = self.second.as_mut().map(|(_, renderer)| renderer);
        std::iter::once(&mut self.renderer).chain(second).try_for_each(|renderer| renderer.resize(size))
    }

    /// Whether the last pictures are complete.
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

/// The scene as it is, and every other value of the setting that its paper varies first: how visible tiles are found,
/// or who applies levels of detail.
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
