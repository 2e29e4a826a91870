//! From a scene to its techniques.

use super::plain::{ALBEDO, PlainSurface, PlainSurfaces, upload};
use super::{Carrier, RenderError, Renderer, Surfaces, sections};
use crate::frame::{PerFrame, Run, Shape, Target};
use crate::model::mesh::{SourceMesh, gpu_mesh};
use crate::paper::progressive_mesh::governor::Budget;
use crate::paper::progressive_mesh::{self, Model, ProgressiveMeshes, Textured};
use crate::paper::virtual_texture::config::{Filter, check_opened, open_texture, owner};
use crate::paper::virtual_texture::{self, VirtualTexture};
use crate::picture;
use crate::scene::{Plain, PlainSource, Scene, Surface};
use crate::texture::plain::PlainTexture;
use crate::texture::source::TileSource;
use crate::vk::{self, Gpu, GpuOptions, Image, Need};
use std::collections::HashMap;
use std::sync::Arc;

/// How a scene is to be opened.
#[derive(Clone, Copy, Debug)]
pub struct Options<'a> {
    pub target: picture::Target,
    /// Pixels; the scene's own otherwise.
    pub size: Option<[u32; 2]>,
    /// Part of a device's name, or its index.
    pub device: Option<&'a str>,
    pub validate: bool,
    /// Budgets count tiles and faces instead of time: the same frames on every run.
    pub deterministic: bool,
}

impl Default for Options<'_> {
    /// A picture for the screen, on the first usable device.
    fn default() -> Self {
        let target = picture::Target::Srgb8;
        Options { target, size: None, device: None, validate: false, deterministic: false }
    }
}

/// What the host has of a scene before a device is opened.
struct Loaded<'a> {
    scene: &'a Scene,
    models: Vec<Model>,
    meshes: progressive_mesh::Settings,
    texture: Option<(virtual_texture::Settings, Arc<dyn TileSource>)>,
    /// The surface in whose table the virtual texture is.
    owner: Option<&'a Surface>,
}

impl Renderer {
    /// Opens a device with what the scene needs, and the scene on it.
    ///
    /// # Errors
    /// [`RenderError`] names the key, the file, or what the device lacks.
    pub fn open(scene: &Scene, options: &Options<'_>) -> Result<Renderer, RenderError> {
        sections::check(scene)?;
        let loaded = Loaded::of(scene, options)?;
        let gpu = gpu(options, &loaded.needs())?;
        loaded.renderer(gpu, options)
    }

    /// The scene on a device that is open already: `options` names another one in vain.
    ///
    /// # Errors
    /// As [`Renderer::open`].
    pub fn on(gpu: &Gpu, scene: &Scene, options: &Options<'_>) -> Result<Renderer, RenderError> {
        sections::check(scene)?;
        let loaded = Loaded::of(scene, options)?;
        gpu.require(&loaded.needs())?;
        loaded.renderer(gpu.clone(), options)
    }
}

impl<'a> Loaded<'a> {
    fn renderer(self, gpu: Gpu, options: &Options<'_>) -> Result<Renderer, RenderError> {
        let view = &self.scene.view;
        let size = options.size.unwrap_or([view.width, view.height]);
        let target = Target::new(&gpu, size, options.target)?;
        let surfaces = self.surfaces(&gpu, &target)?;
        Ok(Run::new(gpu, surfaces, target))
    }

    fn of(scene: &'a Scene, options: &Options<'_>) -> Result<Loaded<'a>, RenderError> {
        let owner = owner(scene)?;
        scene.surfaces.values().try_for_each(|surface| check(scene, surface, owner))?;
        let mut meshes = progressive_mesh::Settings::of_scene(scene, options.target)?;
        meshes.size = options.size.unwrap_or(meshes.size);
        meshes.budget = budget(meshes.budget, options.deterministic)?;
        let mut models = progressive_mesh::load(scene)?;
        for model in &mut models {
            let surface = &scene.surfaces[&model.name];
            model.textured = surface.texture.as_ref().map(|_| Textured { lit: is_lit(surface, owner) });
        }
        let texture = owner.map(|_| texture(scene, options)).transpose()?;
        Ok(Loaded { scene, models, meshes, texture, owner })
    }

    fn needs(&self) -> Vec<Need> {
        let texture = self.texture.iter();
        let texture =
            texture.flat_map(|(settings, source)| virtual_texture::needs(&settings.config, source.format()));
        progressive_mesh::needs(&self.meshes).into_iter().chain(texture).collect()
    }

    fn surfaces(self, gpu: &Gpu, target: &Target) -> Result<Surfaces, RenderError> {
        let (carriers, plain) = (self.carriers(gpu)?, self.plain(gpu)?);
        let Loaded { scene, models, meshes, texture, .. } = self;
        let shapes: Vec<Shape> = carriers.iter().filter_map(|carrier| carrier.shape.clone()).collect();
        let lit = carriers.iter().any(|carrier| carrier.lit).then(|| scene.light_colours());
        let texture = texture.map(|(settings, source)| {
            VirtualTexture::new(gpu, source, shapes, settings, (target, lit)).map(|mut texture| {
                texture.sun = scene.sun();
                texture
            })
        });
        Ok(Surfaces {
            meshes: match models.is_empty() {
                true => None,
                false => Some(ProgressiveMeshes::new(gpu, &models, meshes)?),
            },
            plain: match plain.is_empty() {
                true => None,
                false => Some(PlainSurfaces::new(gpu, plain, target, scene.light_colours())?),
            },
            texture: texture.transpose()?,
            carriers,
            background: scene.view.background.map(|channel| channel as f32),
            sun: scene.sun(),
            frames: PerFrame::default(),
        })
    }

    /// The surfaces that show the virtual texture, the one that has it in its table first.
    fn carriers(&self, gpu: &Gpu) -> Result<Vec<Carrier>, RenderError> {
        let Some((settings, _)) = &self.texture else { return Ok(Vec::new()) };
        let carries = |surface: &&Surface| carries_virtual(surface, self.owner);
        let mut surfaces: Vec<&Surface> = self.scene.surfaces.values().filter(carries).collect();
        surfaces.sort_by_key(|surface| surface.texture.as_ref() != Some(&surface.name));
        let carrier = |surface: &Surface| {
            let lit = is_lit(surface, self.owner);
            let depth_alone = settings.config.draws_depth_alone();
            let grid = surface.grid().transpose()?;
            let shape = grid.map(|grid| shape(gpu, &grid, depth_alone, lit)).transpose()?;
            Ok(Carrier { name: surface.name.clone(), shape, lit })
        };
        surfaces.into_iter().map(carrier).collect()
    }

    /// The surfaces with a plain texture, and the grids with none.
    fn plain(&self, gpu: &Gpu) -> Result<Vec<PlainSurface>, RenderError> {
        let mut images: HashMap<Option<&str>, Arc<Image>> = HashMap::new();
        let mut plain = Vec::new();
        for surface in self.scene.surfaces.values() {
            let grid = surface.grid().transpose()?;
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
            plain.push(PlainSurface { name: surface.name.clone(), shape, texture });
        }
        Ok(plain)
    }
}

/// Whether a surface shows the virtual texture that `owner` has in its table.
fn carries_virtual(surface: &Surface, owner: Option<&Surface>) -> bool {
    owner.is_some_and(|owner| surface.texture.as_ref() == Some(&owner.name))
}

/// Whether the sun shades it: what has a virtual texture only where the scene says so.
fn is_lit(surface: &Surface, owner: Option<&Surface>) -> bool {
    surface.lit.unwrap_or(!carries_virtual(surface, owner))
}

/// Refuses what a surface states and no technique would do.
fn check(scene: &Scene, surface: &Surface, owner: Option<&Surface>) -> Result<(), RenderError> {
    let key = |key| ["surface", &surface.name, key];
    let fault = |at, what: &str| Err(scene.fault(&key(at), what).into());
    let is_mesh = surface.grid().is_none();
    if is_mesh && surface.texture.is_none() && surface.lit == Some(false) {
        return fault("lit", "a progressive mesh without a texture is always lit; leave lit out");
    }
    if !scene.has(&key("filter")) {
        return Ok(());
    }
    let is_owner = owner.is_some_and(|owner| owner.name == surface.name);
    if carries_virtual(surface, owner) && !is_owner {
        return fault(
            "filter",
            "a shared texture has one filter: state it at the surface that has the texture",
        );
    }
    let filter: Filter = scene.read(&key("filter"))?;
    if !is_owner && filter != Filter::DEFAULT {
        let what = "a plain texture is filtered by the sampler, trilinear; leave the filter out, or choose a virtual \
                    texture";
        return fault("filter", what);
    }
    Ok(())
}

/// What the scene's virtual texture asks for, and where its tiles come from.
fn texture(
    scene: &Scene,
    options: &Options<'_>,
) -> Result<(virtual_texture::Settings, Arc<dyn TileSource>), RenderError> {
    let source = open_texture(scene)?;
    let mut settings = virtual_texture::Settings::of_scene(scene, options.target)?;
    check_opened(scene, &settings.config, &source.pyramid())?;
    settings.size = options.size.unwrap_or(settings.size);
    settings.streaming.deterministic = options.deterministic;
    Ok((settings, source))
}

/// The plain texture in the table of the surface `of`; without one, a grey.
fn plain_texture(scene: &Scene, of: Option<&str>) -> Result<PlainTexture, RenderError> {
    let Some(of) = of else { return Ok(PlainTexture::grey(ALBEDO)) };
    let plain: Plain = scene.read(&["surface", of, "texture"])?;
    let texture = match (plain.source, &plain.path) {
        (PlainSource::File, Some(path)) => PlainTexture::open(path),
        _ => PlainTexture::earth(),
    };
    let place = || scene.place(&["surface", of, "texture", "path"]);
    texture.map_err(|error| RenderError::Plain { place: place(), error })
}

fn shape(gpu: &Gpu, grid: &SourceMesh, depth_alone: bool, lit: bool) -> Result<Shape, RenderError> {
    let mesh = gpu_mesh(grid)?;
    let shape = match depth_alone {
        true => Shape::with_depth_alone(gpu, &mesh)?,
        false => Shape::new(gpu, &mesh)?,
    };
    Ok(if lit { shape.lit(gpu, &mesh)? } else { shape })
}

fn gpu(options: &Options<'_>, needs: &[Need]) -> vk::Result<Gpu> {
    let Options { device, validate, .. } = *options;
    let gpu = Gpu::new(&GpuOptions { device, validate, needs, ..GpuOptions::default() })?;
    tracing::info!("{}, {}", gpu.physical().name, gpu.physical().driver);
    Ok(gpu)
}

/// The governor's budget: without the time, where frames must be the same on every run.
fn budget(stated: Option<Budget>, deterministic: bool) -> Result<Option<Budget>, RenderError> {
    match stated {
        Some(Budget { frame_faces: None, .. }) if deterministic => Err(RenderError::MeasuredBudget),
        Some(budget) if deterministic => Ok(Some(Budget { frame_ms: None, ..budget })),
        _ => Ok(stated),
    }
}
