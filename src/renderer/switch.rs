//! Switches a renderer to another scene, and keeps what both scenes share.

use super::open::{HostScene, clocked, fall_back, mesh_settings, texture};
use super::surface::check;
use super::{Options, RenderError, Renderer, Surfaces, sections};
use crate::frame::{Target, Technique};
use crate::paper::progressive_mesh::config;
use crate::paper::virtual_texture;
use crate::paper::virtual_texture::config::owner;
use crate::scene::{Scene, SceneError, Surface};
use crate::texture::source::TileSource;
use crate::vk::Gpu;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// What a renderer keeps when it switches to another scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kept {
    /// Nothing: the other scene was opened in a new renderer.
    Nothing,
    /// The tiles of the virtual texture. Meshes and plain textures were created again.
    Tiles,
    /// Tiles, meshes, plain textures.
    Everything,
}

/// A switch of a renderer to another scene, in three steps. [`Renderer::plan_switch`] and [`Renderer::switch`] belong
/// to the renderer's thread; [`Switch::load`] may run on another thread while the renderer draws.
pub struct Switch {
    kept: Kept,
    next: Scene,
    options: Options<'static>,
    settings: Option<(virtual_texture::VirtualTextureSettings, Arc<dyn TileSource>)>,
    gpu: Gpu,
    target: Target,
}

/// A [`Switch`] whose meshes and plain textures are loaded.
pub struct LoadedSwitch {
    switch: Switch,
    /// Meshes, plain textures and shapes; `None` if they are kept.
    others: Option<Surfaces>,
}

impl Switch {
    /// Never [`Kept::Nothing`]. With [`Kept::Everything`], loading takes no time.
    pub fn kept(&self) -> Kept {
        self.kept
    }

    /// Loads the meshes and plain textures of the other scene, unless they are kept. `stop`: as [`Options::stop`].
    ///
    /// # Errors
    /// As [`Renderer::on`].
    pub fn load(self, stop: Option<&AtomicBool>) -> Result<LoadedSwitch, RenderError> {
        if self.kept == Kept::Everything {
            return Ok(LoadedSwitch { switch: self, others: None });
        }
        let options = Options { stop, ..self.options };
        let mut loaded = HostScene::with(&self.next, &options, self.settings.clone())?;
        self.gpu.require(&loaded.needs())?;
        loaded.meshes = clocked(&self.gpu, loaded.meshes)?;
        let others = Some(loaded.others(&self.gpu, &self.target)?);
        Ok(LoadedSwitch { others, switch: self })
    }
}

impl Renderer {
    /// Plans a switch from the shown scene `now` to `next` that keeps the renderer. This requires that both scenes have
    /// the same virtual texture on the same disk, or that neither has one. `None`: `next` must be opened in a new
    /// renderer. `options` are the options of [`Renderer::on`] with the current size.
    ///
    /// # Errors
    /// As [`Renderer::on`].
    pub fn plan_switch(
        &self,
        now: &Scene,
        next: &Scene,
        options: &Options<'static>,
    ) -> Result<Option<Switch>, RenderError> {
        sections::check(next)?;
        let owner = owner(next)?;
        let source = match (&self.technique.texture, owner) {
            (None, None) => None,
            (Some(texture), Some(owner)) if same_tiles(now, next, owner) => Some(texture.source.clone()),
            _ => return Ok(None),
        };
        let mut settings = source.map(|source| texture(next, options, source)).transpose()?;
        if let Some((settings, _)) = &mut settings {
            fall_back(next, settings, |feature| self.gpu.has(feature));
        }
        let shown = self.technique.texture.as_ref().zip(settings.as_ref());
        let shown = shown.map(|(texture, (next, _))| (&texture.settings, next));
        if shown.is_some_and(|(now, next)| !now.streaming.same_loader(&next.streaming)) {
            return Ok(None);
        }
        let draws = |settings: &virtual_texture::VirtualTextureSettings| settings.config.draws_depth_alone();
        let same_shapes = shown.is_none_or(|(now, next)| draws(now) == draws(next));
        let kept = match same_shapes && fixed(now, owner).is_some_and(|now| Some(now) == fixed(next, owner)) {
            true => Kept::Everything,
            false if settings.is_some() => Kept::Tiles,
            false => return Ok(None),
        };
        let (gpu, target) = (self.gpu.clone(), self.target().clone());
        Ok(Some(Switch { kept, next: next.clone(), options: *options, settings, gpu, target }))
    }

    /// Shows the other scene. Between the plan and this call, the renderer may be resized and may make a switch with
    /// [`Kept::Everything`].
    ///
    /// # Errors
    /// As [`Renderer::on`]; the renderer then shows what it showed before.
    pub fn switch(&mut self, LoadedSwitch { switch, others }: LoadedSwitch) -> Result<Kept, RenderError> {
        let Switch { kept, next, options, settings, .. } = switch;
        let mut settings = settings.map(|(settings, _)| settings);
        settings.iter_mut().for_each(|settings| settings.size = self.size());
        match others {
            None => self.change_in_place(&next, &options, settings)?,
            Some(others) => self.change_all_but_tiles(&next, others, settings)?,
        }
        Ok(kept)
    }

    fn change_in_place(
        &mut self,
        next: &Scene,
        options: &Options<'_>,
        settings: Option<virtual_texture::VirtualTextureSettings>,
    ) -> Result<(), RenderError> {
        let owner = owner(next)?;
        next.surfaces.values().try_for_each(|surface| check(next, surface, owner))?;
        let meshes = clocked(&self.gpu, mesh_settings(next, options)?)?;
        let error = |name: &str| Ok((name.to_owned(), config::surface(next, name)?.error_pixels));
        let errors = config::names(next).map(error).collect::<Result<HashMap<_, _>, SceneError>>()?;
        self.reconfigure(|surfaces, gpu, target| {
            let lit = surfaces.light(next);
            if let (Some(texture), Some(settings)) = (&mut surfaces.texture, settings) {
                texture.reconfigure(gpu, settings, (target, lit))?;
            }
            if let Some(shown) = &mut surfaces.meshes {
                shown.set_budget(meshes.budget);
                for surface in &mut shown.surfaces {
                    surface.set_error_pixels(errors[&surface.name]);
                }
            }
            Ok(())
        })
    }

    fn change_all_but_tiles(
        &mut self,
        next: &Scene,
        mut others: Surfaces,
        settings: Option<virtual_texture::VirtualTextureSettings>,
    ) -> Result<(), RenderError> {
        self.reconfigure(|surfaces, gpu, target| {
            let lit = others.light(next);
            others.resize(gpu, target)?;
            if let (Some(texture), Some(settings)) = (&mut surfaces.texture, settings) {
                texture.reconfigure(gpu, settings, (target, lit))?;
                texture.sun = others.sun;
            }
            others.texture = surfaces.texture.take();
            others.frozen = surfaces.frozen;
            *surfaces = others;
            Ok(())
        })
    }
}

/// True if the virtual texture of `owner` has the same tiles in both scenes, from the same simulated disk.
fn same_tiles(now: &Scene, next: &Scene, owner: &Surface) -> bool {
    let same = |table: &[&str]| now.value(table) == next.value(table);
    same(&["surface", &owner.name, "texture"]) && same(&["disk"])
}

/// The scene without the settings that change in place: the variant, the caches, the governor, the filter of the
/// surface `owner`, and the wanted error of meshes.
fn fixed(scene: &Scene, owner: Option<&Surface>) -> Option<toml::Table> {
    let mut table: toml::Table = scene.to_toml().parse().ok()?;
    for section in ["variant", "cache", "governor"] {
        table.remove(section);
    }
    for (name, surface) in table.get_mut("surface")?.as_table_mut()? {
        let surface = surface.as_table_mut()?;
        if owner.is_some_and(|owner| owner.name == *name) {
            surface.remove("filter");
        }
        if let Some(geometry) = surface.get_mut("geometry").and_then(toml::Value::as_table_mut) {
            geometry.remove("error_pixels");
        }
    }
    Some(table)
}
