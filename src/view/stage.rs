//! The scene in the window: its variants, manual changes to its settings, and one or two renderers.

use super::variants::{Variant, own_variants};
use anyhow::Context;
pub use ortelius::frame::HISTORY;
use ortelius::frame::Technique;
use ortelius::picture::PixelFormat;
use ortelius::renderer::{Kept, Options, RenderError, Renderer};
use ortelius::scene::Scene;
use ortelius::vk::Gpu;

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
    pub second: Option<Second>,
}

/// The variant on the right.
pub struct Second {
    pub variant: usize,
    scene: Scene,
    pub renderer: Renderer,
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
    pub fn show(&mut self, variant: usize) -> anyhow::Result<Kept> {
        let name = || format!("variant {}", self.variants[variant].name);
        let scene = self.scene_of(variant).with_context(name)?;
        let kept =
            switch(&mut self.renderer, [&self.scene, &scene], self.deterministic).with_context(name)?;
        (self.scene, self.variant) = (scene, variant);
        Ok(kept)
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
            None => self.show_beside(self.next(self.variant)).map(drop),
        }
    }

    /// Shows a variant on the right. On an error, nothing changes.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn show_beside(&mut self, variant: usize) -> anyhow::Result<Kept> {
        let name = || format!("variant {}", self.variants[variant].name);
        let scene = self.scene_of(variant).with_context(name)?;
        if let Some(second) = &mut self.second {
            let kept = switch(&mut second.renderer, [&second.scene, &scene], self.deterministic);
            let kept = kept.with_context(name)?;
            (second.scene, second.variant) = (scene, variant);
            return Ok(kept);
        }
        let renderer = self.open(&scene).with_context(name)?;
        self.second = Some(Second { variant, scene, renderer });
        Ok(Kept::Nothing)
    }

    /// Replaces the selected Pareto point. On an error, the current one stays.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn take_setting(&mut self, changes: &[String]) -> anyhow::Result<Kept> {
        self.attempt(|stage| stage.front = changes.to_vec())
    }

    /// Sets a key of the scene to a TOML value, in every variant. On an error, the old value stays.
    ///
    /// # Errors
    /// The scene does not allow this value; or as [`Renderer::open`].
    pub fn set(&mut self, key: &str, value: &str) -> anyhow::Result<Kept> {
        self.attempt(|stage| {
            stage.changes.retain(|(changed, _)| changed != key);
            stage.changes.push((key.to_owned(), value.to_owned()));
        })
    }

    /// Drops a manual change: the key has the value of the scene, the variant or the Pareto point again.
    ///
    /// # Errors
    /// As [`Stage::set`].
    pub fn reset(&mut self, key: &str) -> anyhow::Result<Kept> {
        self.attempt(|stage| stage.changes.retain(|(changed, _)| changed != key))
    }

    /// Changes the settings of both sides. On an error, both are as before. Returns what both have kept.
    fn attempt(&mut self, change: impl FnOnce(&mut Stage)) -> anyhow::Result<Kept> {
        let before = (self.front.clone(), self.changes.clone());
        change(self);
        let right = self.second.as_ref().map(|second| second.variant);
        let done = self.show(self.variant).and_then(|kept| {
            Ok(kept.min(right.map_or(Ok(Kept::Everything), |right| self.show_beside(right))?))
        });
        if done.is_err() {
            (self.front, self.changes) = before;
            // The left side may have changed before the right side failed.
            self.show(self.variant)?;
        }
        done
    }

    /// Reopens both renderers, for example for new shaders. On an error, both stay.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn reopen(&mut self) -> anyhow::Result<()> {
        let renderer = self.open(&self.scene)?;
        let second = self.second.as_ref().map(|second| self.open(&second.scene)).transpose()?;
        self.renderer.drain()?;
        self.renderer = renderer;
        if let Some((second, renderer)) = self.second.as_mut().zip(second) {
            second.renderer = renderer;
        }
        Ok(())
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

/// Switches a renderer from the scene that it shows to another. Opens a new renderer only if the present one cannot
/// show the other scene. On an error, nothing changes.
fn switch(
    renderer: &mut Renderer,
    [now, next]: [&Scene; 2],
    deterministic: bool,
) -> Result<Kept, RenderError> {
    if now == next {
        return Ok(Kept::Everything);
    }
    let (gpu, size) = (renderer.gpu.clone(), renderer.size());
    let kept = renderer.switch_scene(now, next, &options(size, deterministic))?;
    if kept == Kept::Nothing {
        let other = open(&gpu, next, size, deterministic)?;
        renderer.drain()?;
        *renderer = other;
    }
    Ok(kept)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ortelius::frame::Records;
    use ortelius::vk::{Feature, GpuOptions, Watched};

    /// The variants that show the same picture.
    fn methods(scene: &Scene) -> Vec<Variant> {
        let is_method = |variant: &Variant| !variant.changes.iter().any(|change| change.contains(".filter="));
        own_variants(scene).into_iter().filter(is_method).collect()
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
        assert_eq!(loads(&mut stage), 0, "variant {}", stage.variants[1].name);
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
            assert_eq!(stage.set(key, value).unwrap(), kept, "{key} = {value}");
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
