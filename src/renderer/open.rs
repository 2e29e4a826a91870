//! Creates the techniques of a scene.

use super::plain::{PlainSurface, PlainSurfaces, upload};
use super::surface::{carries_virtual, check, is_lit, plain_filter, plain_texture, relief};
use super::{Carrier, RenderError, Renderer, Surfaces, sections};
use crate::frame::{PerFrame, Run, Shape, Target};
use crate::model::mesh::{SourceMesh, gpu_mesh};
use crate::paper::progressive_mesh::governor::Budget;
use crate::paper::progressive_mesh::{self, LoadedMesh, ProgressiveMeshes, Textured};
use crate::paper::texture_mapping::config::ReliefKeys;
use crate::paper::texture_mapping::relief::Relief;
use crate::paper::texture_mapping::relief::surface::ReliefSurface;
use crate::paper::virtual_texture::config::{check_opened, open_texture, owner};
use crate::paper::virtual_texture::{self, VirtualTexture};
use crate::picture;
use crate::scene::{Scene, Surface};
use crate::texture::source::TileSource;
use crate::vk::{self, Feature, Gpu, GpuOptions, Image, Need, PhysicalDevice};
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Options for opening a scene.
#[derive(Clone, Copy, Debug)]
pub struct Options<'a> {
    pub target: picture::PixelFormat,
    /// Pixels; `None` uses the scene's size.
    pub size: Option<[u32; 2]>,
    /// Part of a device's name, or its index.
    pub device: Option<&'a str>,
    pub validate: bool,
    /// Budgets count tiles and faces instead of time, so that every run renders the same frames.
    pub deterministic: bool,
    /// Once the flag is true, opening ends with [`RenderError::Stopped`] and builds nothing further.
    pub stop: Option<&'a AtomicBool>,
}

impl Default for Options<'_> {
    /// An sRGB picture, on the first usable device.
    fn default() -> Self {
        let target = picture::PixelFormat::Srgb8;
        Options { target, size: None, device: None, validate: false, deterministic: false, stop: None }
    }
}

/// The host data of a scene, before a device is opened.
pub(super) struct HostScene<'a> {
    scene: &'a Scene,
    models: Vec<LoadedMesh>,
    pub(super) meshes: progressive_mesh::ProgressiveMeshSettings,
    texture: Option<(virtual_texture::VirtualTextureSettings, Arc<dyn TileSource>)>,
    /// The surface whose table contains the virtual texture.
    owner: Option<&'a Surface>,
    stop: Option<&'a AtomicBool>,
}

impl Renderer {
    /// Opens a device with the features that the scene needs, and the scene on it.
    ///
    /// # Errors
    /// [`RenderError`] names the key, the file, or the missing device feature.
    pub fn open(scene: &Scene, options: &Options<'_>) -> Result<Renderer, RenderError> {
        sections::check(scene)?;
        let mut loaded = HostScene::of(scene, options)?;
        let gpu = gpu(options, |device| {
            loaded.fall_back(&device.name, |feature| device.features.contains(&feature));
            loaded.needs()
        })?;
        loaded.renderer(gpu, options)
    }

    /// Opens the scene on a device that is already open; `options.device` is ignored.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn on(gpu: &Gpu, scene: &Scene, options: &Options<'_>) -> Result<Renderer, RenderError> {
        sections::check(scene)?;
        let mut loaded = HostScene::of(scene, options)?;
        loaded.fall_back(&gpu.physical().name, |feature| gpu.has(feature));
        gpu.require(&loaded.needs())?;
        loaded.renderer(gpu.clone(), options)
    }
}

/// Settings of progressive meshes.
pub(super) fn mesh_settings(
    scene: &Scene,
    options: &Options<'_>,
) -> Result<progressive_mesh::ProgressiveMeshSettings, RenderError> {
    let mut settings = progressive_mesh::ProgressiveMeshSettings::of_scene(scene, options.target)?;
    settings.size = options.size.unwrap_or(settings.size);
    if options.deterministic {
        settings.budget = untimed(settings.budget, RenderError::MeasuredBudget)?;
    }
    Ok(settings)
}

/// The settings for a device that may have no timestamps.
pub(super) fn clocked(
    gpu: &Gpu,
    settings: progressive_mesh::ProgressiveMeshSettings,
) -> Result<progressive_mesh::ProgressiveMeshSettings, RenderError> {
    match gpu.keeps_time() {
        true => Ok(settings),
        false => Ok(progressive_mesh::ProgressiveMeshSettings {
            budget: untimed(settings.budget, RenderError::NoClock)?,
            ..settings
        }),
    }
}

impl<'a> HostScene<'a> {
    fn renderer(mut self, gpu: Gpu, options: &Options<'_>) -> Result<Renderer, RenderError> {
        self.meshes = clocked(&gpu, self.meshes)?;
        let view = &self.scene.view;
        let size = options.size.unwrap_or([view.width, view.height]);
        let target = Target::new(&gpu, size, options.target)?;
        let surfaces = self.surfaces(&gpu, &target)?;
        Ok(Run::new(gpu, surfaces, target))
    }

    fn of(scene: &'a Scene, options: &Options<'a>) -> Result<HostScene<'a>, RenderError> {
        let owner = owner(scene)?;
        scene.surfaces.values().try_for_each(|surface| check(scene, surface, owner))?;
        let texture = owner.map(|_| texture(scene, options, open_texture(scene)?)).transpose()?;
        HostScene::with(scene, options, texture)
    }

    /// Loads the rest of the scene; its virtual texture is already open.
    pub(super) fn with(
        scene: &'a Scene,
        options: &Options<'a>,
        texture: Option<(virtual_texture::VirtualTextureSettings, Arc<dyn TileSource>)>,
    ) -> Result<HostScene<'a>, RenderError> {
        let owner = owner(scene)?;
        scene.surfaces.values().try_for_each(|surface| check(scene, surface, owner))?;
        let meshes = mesh_settings(scene, options)?;
        let mut models = progressive_mesh::load(scene)?;
        for model in &mut models {
            let surface = &scene.surfaces[&model.name];
            model.textured = surface.texture.as_ref().map(|_| Textured { lit: is_lit(surface, owner) });
        }
        Ok(HostScene { scene, models, meshes, texture, owner, stop: options.stop })
    }

    /// Replaces variants that the scene does not name and the device cannot run, with a warning.
    fn fall_back(&mut self, device: &str, has: impl Fn(Feature) -> bool) {
        let (settings, scene) = (self.texture.as_mut().map(|(settings, _)| settings), self.scene);
        if let Some(words) = settings.and_then(|settings| fall_back(scene, settings, has)) {
            tracing::warn!("{device}: {words}");
        }
    }

    pub(super) fn needs(&self) -> Vec<Need> {
        let texture = self.texture.iter();
        let texture =
            texture.flat_map(|(settings, source)| virtual_texture::needs(&settings.config, source.format()));
        texture.collect()
    }

    fn surfaces(self, gpu: &Gpu, target: &Target) -> Result<Surfaces, RenderError> {
        let mut surfaces = self.others(gpu, target)?;
        let shapes = surfaces.carriers.iter().filter_map(|carrier| carrier.shape.clone()).collect();
        let lit = surfaces.light(self.scene);
        if let Some((settings, source)) = self.texture {
            let mut texture = VirtualTexture::new(gpu, source, shapes, settings, (target, lit))?;
            texture.sun = surfaces.sun;
            surfaces.texture = Some(texture);
        }
        Ok(surfaces)
    }

    /// Creates everything except the virtual texture.
    pub(super) fn others(&self, gpu: &Gpu, target: &Target) -> Result<Surfaces, RenderError> {
        let (carriers, plain, scene) = (self.carriers(gpu)?, self.plain(gpu)?, self.scene);
        Ok(Surfaces {
            meshes: match self.models.is_empty() {
                true => None,
                false => Some(ProgressiveMeshes::new(gpu, &self.models, self.meshes)?),
            },
            plain: match plain.is_empty() {
                true => None,
                false => Some(PlainSurfaces::new(gpu, plain, target, scene.light_colours())?),
            },
            texture: None,
            carriers,
            background: scene.view.background.map(|channel| channel as f32),
            sun: scene.sun(),
            frozen: None,
            frames: PerFrame::default(),
        })
    }

    /// The surfaces with the virtual texture. The surface whose table contains the texture comes first.
    fn carriers(&self, gpu: &Gpu) -> Result<Vec<Carrier>, RenderError> {
        let Some((settings, _)) = &self.texture else { return Ok(Vec::new()) };
        let carries = |surface: &&Surface| carries_virtual(surface, self.owner);
        let mut surfaces: Vec<&Surface> = self.scene.surfaces.values().filter(carries).collect();
        surfaces.sort_by_key(|surface| surface.texture.as_ref() != Some(&surface.name));
        let carrier = |surface: &Surface| {
            let lit = is_lit(surface, self.owner);
            let depth_alone = settings.config.draws_depth_alone();
            let shape = surface.grid().map(|grid| shape(gpu, &grid, depth_alone, lit)).transpose()?;
            Ok(Carrier { name: surface.name.clone(), shape, lit })
        };
        surfaces.into_iter().map(carrier).collect()
    }

    /// The surfaces with a plain texture, and the surfaces without any texture that are not progressive meshes.
    fn plain(&self, gpu: &Gpu) -> Result<Vec<PlainSurface>, RenderError> {
        let mut images: HashMap<Option<&str>, Arc<Image>> = HashMap::new();
        let mut plain = Vec::new();
        let go_on = || match self.stop {
            Some(stop) if stop.load(Ordering::SeqCst) => Err(RenderError::Stopped),
            _ => Ok(()),
        };
        for surface in self.scene.surfaces.values() {
            let grid = surface.grid();
            if carries_virtual(surface, self.owner) || grid.is_none() && surface.texture.is_none() {
                continue;
            }
            let from = surface.texture.as_deref();
            let texture = match images.get(&from) {
                Some(image) => image.clone(),
                None => upload(gpu, from.unwrap_or(&surface.name), &plain_texture(self.scene, from)?)?,
            };
            images.insert(from, texture.clone());
            let shape = grid.map(|grid| shape(gpu, &grid, false, is_lit(surface, self.owner))).transpose()?;
            let filter = plain_filter(self.scene, surface)?;
            let relief = relief(self.scene, surface)?;
            let build = |(keys, relief, size_m): (ReliefKeys, Relief, f64)| {
                ReliefSurface::new(gpu, &relief, keys.filter(), size_m, go_on)
            };
            let relief = relief.map(build).transpose()?;
            plain.push(PlainSurface { name: surface.name.clone(), filter, shape, texture, relief });
        }
        Ok(plain)
    }
}

pub(super) fn fall_back(
    scene: &Scene,
    settings: &mut virtual_texture::VirtualTextureSettings,
    has: impl Fn(Feature) -> bool,
) -> Option<String> {
    settings.config.fall_back(|key| scene.has(&["variant", key]), has)
}

/// The settings of the scene's virtual texture with the tiles of `source`.
pub(super) fn texture(
    scene: &Scene,
    options: &Options<'_>,
    source: Arc<dyn TileSource>,
) -> Result<(virtual_texture::VirtualTextureSettings, Arc<dyn TileSource>), RenderError> {
    let mut settings = virtual_texture::VirtualTextureSettings::of_scene(scene, options.target)?;
    check_opened(scene, &settings.config, &source.pyramid())?;
    settings.size = options.size.unwrap_or(settings.size);
    settings.streaming.deterministic = options.deterministic;
    Ok((settings, source))
}

fn shape(gpu: &Gpu, grid: &SourceMesh, depth_alone: bool, lit: bool) -> Result<Shape, RenderError> {
    let mesh = gpu_mesh(grid);
    let shape = match depth_alone {
        true => Shape::with_depth_alone(gpu, &mesh)?,
        false => Shape::new(gpu, &mesh)?,
    };
    Ok(if lit { shape.lit(gpu, &mesh)? } else { shape })
}

fn gpu(options: &Options<'_>, needs: impl FnOnce(&PhysicalDevice) -> Vec<Need>) -> vk::Result<Gpu> {
    let Options { device, validate, .. } = *options;
    let gpu = Gpu::for_device(&GpuOptions { device, validate, ..GpuOptions::default() }, needs)?;
    tracing::info!("{}, {}", gpu.physical().name, gpu.physical().driver);
    gpu.require_drawing()?;
    Ok(gpu)
}

/// The governor's budget without its limit on time. Returns `refused` if the budget states only a time, and warns if a
/// stated time is ignored.
fn untimed(stated: Option<Budget>, refused: RenderError) -> Result<Option<Budget>, RenderError> {
    let Some(budget) = stated else { return Ok(None) };
    if budget.frame_faces.is_none() {
        return Err(refused);
    }
    if let Some(warning) = dropped(&budget, &refused) {
        tracing::warn!("{warning}");
    }
    Ok(Some(Budget { frame_ms: None, ..budget }))
}

/// The warning that `frame_ms` is ignored and only `frame_faces` limits a frame.
fn dropped(budget: &Budget, refused: &RenderError) -> Option<String> {
    let why = match refused {
        RenderError::NoClock => "this device has no timestamps",
        _ => "--deterministic excludes measured times",
    };
    budget
        .frame_ms
        .map(|_| format!("governor.frame_ms is ignored: {why}; only governor.frame_faces limits a frame"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_timestamps_a_budget_only_in_milliseconds_is_refused() {
        let of = |frame_ms, frame_faces| Some(Budget { frame_ms, frame_faces });
        let refused = untimed(of(Some(5.0), None), RenderError::NoClock).unwrap_err().to_string();
        assert!(refused.contains("governor.frame_faces"), "{refused}");
        assert_eq!(untimed(of(Some(5.0), Some(9)), RenderError::NoClock).unwrap(), of(None, Some(9)));
        assert_eq!(untimed(None, RenderError::NoClock).unwrap(), None);
        let warning = |frame_ms, refused| dropped(&of(frame_ms, Some(9)).unwrap(), &refused);
        assert!(warning(Some(5.0), RenderError::NoClock).unwrap().contains("no timestamps"));
        assert!(warning(Some(5.0), RenderError::MeasuredBudget).unwrap().contains("--deterministic"));
        assert_eq!(warning(None, RenderError::NoClock), None);
    }
}
