//! Creates the techniques of a scene.

use super::plain::{ALBEDO, PlainFilter, PlainSurface, PlainSurfaces, upload};
use super::{Carrier, RenderError, Renderer, Surfaces, sections};
use crate::frame::{PerFrame, Run, Shape, Target, Technique};
use crate::model::mesh::{SourceMesh, gpu_mesh};
use crate::paper::progressive_mesh::governor::Budget;
use crate::paper::progressive_mesh::{self, LoadedMesh, ProgressiveMeshes, Textured, config};
use crate::paper::texture_mapping::config::{ReliefKeys, ReliefMethod, side_of};
use crate::paper::texture_mapping::relief::shipped::{BRICK_WALL, CLIFF};
use crate::paper::texture_mapping::relief::surface::{MOST_WORK, ReliefSurface, work};
use crate::paper::texture_mapping::relief::{Relief, ReliefKind};
use crate::paper::virtual_texture::config::{Filter, check_opened, filter, open_texture, owner};
use crate::paper::virtual_texture::{self, VirtualTexture};
use crate::picture;
use crate::picture::srgb;
use crate::reference::pattern::Pattern;
use crate::scene::{Geometry, Plain, PlainSource, Scene, SceneError, Surface};
use crate::texture::plain::PlainTexture;
use crate::texture::source::TileSource;
use crate::vk::{self, Feature, Gpu, GpuOptions, Image, Need, PhysicalDevice};
use std::collections::HashMap;
use std::sync::Arc;

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
}

impl Default for Options<'_> {
    /// An sRGB picture, on the first usable device.
    fn default() -> Self {
        let target = picture::PixelFormat::Srgb8;
        Options { target, size: None, device: None, validate: false, deterministic: false }
    }
}

/// The host data of a scene, before a device is opened.
struct Loaded<'a> {
    scene: &'a Scene,
    models: Vec<LoadedMesh>,
    meshes: progressive_mesh::ProgressiveMeshSettings,
    texture: Option<(virtual_texture::VirtualTextureSettings, Arc<dyn TileSource>)>,
    /// The surface whose table contains the virtual texture.
    owner: Option<&'a Surface>,
}

impl Renderer {
    /// Opens a device with the features that the scene needs, and the scene on it.
    ///
    /// # Errors
    /// [`RenderError`] names the key, the file, or the missing device feature.
    pub fn open(scene: &Scene, options: &Options<'_>) -> Result<Renderer, RenderError> {
        sections::check(scene)?;
        let mut loaded = Loaded::of(scene, options)?;
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
        let mut loaded = Loaded::of(scene, options)?;
        loaded.fall_back(&gpu.physical().name, |feature| gpu.has(feature));
        gpu.require(&loaded.needs())?;
        loaded.renderer(gpu.clone(), options)
    }
}

/// What a renderer keeps when it switches to another scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kept {
    /// Nothing: the other scene was opened.
    Nothing,
    /// The tiles of the virtual texture. Meshes and plain textures were created again.
    Tiles,
    /// Tiles, meshes, plain textures.
    Everything,
}

/// A switch of a renderer to another scene, in three steps. [`Renderer::plan_switch`] and [`Renderer::switch`] belong to
/// the renderer's thread; [`Switch::load`] may run on another one while the renderer draws.
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
    /// Everything except the virtual texture; `None` if it is kept.
    others: Option<Surfaces>,
}

impl Switch {
    /// Never [`Kept::Nothing`]. With [`Kept::Everything`], loading takes no time.
    pub fn kept(&self) -> Kept {
        self.kept
    }

    /// Loads the meshes and plain textures of the other scene, unless they are kept.
    ///
    /// # Errors
    /// As [`Renderer::on`].
    pub fn load(self) -> Result<LoadedSwitch, RenderError> {
        if self.kept == Kept::Everything {
            return Ok(LoadedSwitch { switch: self, others: None });
        }
        let mut loaded = Loaded::with(&self.next, &self.options, self.settings.clone())?;
        self.gpu.require(&loaded.needs())?;
        loaded.meshes = clocked(&self.gpu, loaded.meshes)?;
        let others = Some(loaded.others(&self.gpu, &self.target)?);
        Ok(LoadedSwitch { others, switch: self })
    }
}

impl Renderer {
    /// Plans a switch from the shown scene `now` to `next` that keeps the renderer. This requires that both scenes have
    /// the same virtual texture on the same disk, or that neither has one. `None`: `next` must be opened. `options` are
    /// those of [`Renderer::on`] with the current size.
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

    /// Shows the other scene. The renderer may have been resized, and switched in place, since the plan.
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
                    surface.settings.error_pixels = errors[&surface.name];
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

/// Settings of progressive meshes.
fn mesh_settings(
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
fn clocked(
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

impl<'a> Loaded<'a> {
    fn renderer(mut self, gpu: Gpu, options: &Options<'_>) -> Result<Renderer, RenderError> {
        self.meshes = clocked(&gpu, self.meshes)?;
        let view = &self.scene.view;
        let size = options.size.unwrap_or([view.width, view.height]);
        let target = Target::new(&gpu, size, options.target)?;
        let surfaces = self.surfaces(&gpu, &target)?;
        Ok(Run::new(gpu, surfaces, target))
    }

    fn of(scene: &'a Scene, options: &Options<'_>) -> Result<Loaded<'a>, RenderError> {
        let owner = owner(scene)?;
        scene.surfaces.values().try_for_each(|surface| check(scene, surface, owner))?;
        let texture = owner.map(|_| texture(scene, options, open_texture(scene)?)).transpose()?;
        Loaded::with(scene, options, texture)
    }

    /// Loads the rest of the scene; its virtual texture is already open.
    fn with(
        scene: &'a Scene,
        options: &Options<'_>,
        texture: Option<(virtual_texture::VirtualTextureSettings, Arc<dyn TileSource>)>,
    ) -> Result<Loaded<'a>, RenderError> {
        let owner = owner(scene)?;
        scene.surfaces.values().try_for_each(|surface| check(scene, surface, owner))?;
        let meshes = mesh_settings(scene, options)?;
        let mut models = progressive_mesh::load(scene)?;
        for model in &mut models {
            let surface = &scene.surfaces[&model.name];
            model.textured = surface.texture.as_ref().map(|_| Textured { lit: is_lit(surface, owner) });
        }
        Ok(Loaded { scene, models, meshes, texture, owner })
    }

    /// Replaces variants that the scene does not name and the device cannot run, with a warning.
    fn fall_back(&mut self, device: &str, has: impl Fn(Feature) -> bool) {
        let (settings, scene) = (self.texture.as_mut().map(|(settings, _)| settings), self.scene);
        if let Some(words) = settings.and_then(|settings| fall_back(scene, settings, has)) {
            tracing::warn!("{device}: {words}");
        }
    }

    fn needs(&self) -> Vec<Need> {
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
    fn others(&self, gpu: &Gpu, target: &Target) -> Result<Surfaces, RenderError> {
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

    /// The surfaces with the virtual texture; the one whose table contains it comes first.
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

    /// The surfaces with a plain texture, and those without any texture that are not progressive meshes.
    fn plain(&self, gpu: &Gpu) -> Result<Vec<PlainSurface>, RenderError> {
        let mut images: HashMap<Option<&str>, Arc<Image>> = HashMap::new();
        let mut plain = Vec::new();
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
            let relief =
                relief.map(|(keys, relief, size_m)| ReliefSurface::new(gpu, &relief, keys.method, size_m));
            let relief = relief.transpose()?;
            plain.push(PlainSurface { name: surface.name.clone(), filter, shape, texture, relief });
        }
        Ok(plain)
    }
}

fn fall_back(
    scene: &Scene,
    settings: &mut virtual_texture::VirtualTextureSettings,
    has: impl Fn(Feature) -> bool,
) -> Option<String> {
    settings.config.fall_back(|key| scene.has(&["variant", key]), has)
}

/// True if a surface shows the virtual texture of `owner`.
pub(super) fn carries_virtual(surface: &Surface, owner: Option<&Surface>) -> bool {
    owner.is_some_and(|owner| surface.texture.as_ref() == Some(&owner.name))
}

/// True if the sun lights the surface. A surface with a virtual texture is lit only if the scene says so.
pub(super) fn is_lit(surface: &Surface, owner: Option<&Surface>) -> bool {
    surface.lit.unwrap_or(!carries_virtual(surface, owner))
}

/// Refuses settings of a surface that no technique would use.
fn check(scene: &Scene, surface: &Surface, owner: Option<&Surface>) -> Result<(), RenderError> {
    let key = |key| ["surface", &surface.name, key];
    let fault = |at, what: &str| Err(scene.fault(&key(at), what).into());
    let is_mesh = surface.grid().is_none();
    if is_mesh && surface.texture.is_none() && surface.lit == Some(false) {
        return fault("lit", "a progressive mesh without a texture is always lit; omit lit");
    }
    if scene.has(&key("relief")) && carries_virtual(surface, owner) {
        return fault("relief", "a relief needs a plain texture; this surface has a virtual one");
    }
    relief(scene, surface)?;
    if !scene.has(&key("filter")) {
        return Ok(());
    }
    let is_owner = owner.is_some_and(|owner| owner.name == surface.name);
    if carries_virtual(surface, owner) && !is_owner {
        return fault(
            "filter",
            "a shared texture has one filter; state it at the surface that owns the texture",
        );
    }
    let filter = filter(scene, surface)?;
    let by_sampler = [Filter::DEFAULT, Filter::ONE_SAMPLE].contains(&filter);
    let by_texels = filter.kind.is_of_paper_3() && filter.interpolation == Filter::DEFAULT.interpolation;
    if !is_owner && !by_sampler && !by_texels {
        let what = "a plain texture has the sampler's trilinear filter and those of paper 3, from kind = \"ellipse\" \
                    on, without interpolation; use one of these, or a virtual texture";
        return fault("filter", what);
    }
    Ok(())
}

/// The filter of a surface's plain texture; other settings were refused before.
fn plain_filter(scene: &Scene, surface: &Surface) -> Result<PlainFilter, RenderError> {
    if scene.has(&["surface", &surface.name, "relief"]) {
        let keys: ReliefKeys = scene.read(&["surface", &surface.name, "relief"])?;
        return Ok(PlainFilter::Relief(keys.method));
    }
    let filter = filter(scene, surface)?;
    Ok(if filter.kind.is_of_paper_3() { PlainFilter::Texels(filter) } else { PlainFilter::Trilinear })
}

/// A surface's relief, and the side of its plane.
pub(super) fn relief(
    scene: &Scene,
    surface: &Surface,
) -> Result<Option<(ReliefKeys, Relief, f64)>, RenderError> {
    let table = ["surface", &surface.name, "relief"];
    let Geometry::Plane(plane) = surface.geometry else { return Ok(None) };
    if !scene.has(&table) {
        return Ok(None);
    }
    let keys: ReliefKeys = scene.read(&table)?;
    let at = |key| ["surface", &surface.name, "relief", key];
    let picture = keys.path.as_ref().map(|path| {
        let picture = PlainTexture::open(path);
        picture.map_err(|error| RenderError::Plain { place: scene.place(&at("path")), error })
    });
    let heights = |picture: PlainTexture| {
        (picture.size, picture.levels[0].chunks_exact(4).map(|texel| texel[0]).collect())
    };
    let relief = keys.relief(plane.width_m, picture.transpose()?.map(heights));
    let relief = relief.map_err(|what| scene.fault(&at("path"), &what))?;
    if keys.method == ReliefMethod::Trace && work(&relief) > MOST_WORK {
        let what = "building the distance map of so many texels, or of a relief this deep, takes minutes; use a \
                    picture of at most 512 x 512 texels, reduce the depth, or method = \"projected-width\"";
        return Err(scene.fault(&at("depth_m"), what).into());
    }
    Ok(Some((keys, relief, plane.width_m)))
}

/// The settings of the scene's virtual texture with the tiles of `source`.
fn texture(
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

/// The plain texture in the table of the surface `of`; grey if `of` is `None`.
pub(super) fn plain_texture(scene: &Scene, of: Option<&str>) -> Result<PlainTexture, RenderError> {
    let Some(of) = of else { return Ok(PlainTexture::grey(ALBEDO)) };
    let plain: Plain = scene.read(&["surface", of, "texture"])?;
    let texture = match (plain.source, &plain.path) {
        (PlainSource::File, path) => PlainTexture::open(path.as_ref().expect("checked")),
        (PlainSource::Earth, _) => PlainTexture::earth(),
        (PlainSource::Checker, _) => Ok(pattern(Pattern::Checker(32), [2048, 1024])),
        (PlainSource::ZonePlate, _) => Ok(pattern(Pattern::ZonePlate, [1024; 2])),
        (PlainSource::BrickWall, _) => Ok(colours(BRICK_WALL.picture())),
        (PlainSource::Cliff, _) => Ok(colours(CLIFF.picture())),
        (PlainSource::Bricks, _) => Ok(colours(generated(ReliefKind::Bricks))),
        (PlainSource::Rock, _) => Ok(colours(generated(ReliefKind::Rock))),
    };
    let place = || scene.place(&["surface", of, "texture", "path"]);
    texture.map_err(|error| RenderError::Plain { place: place(), error })
}

/// A test pattern, repeated along the longer side.
fn pattern(pattern: Pattern, [width, height]: [u32; 2]) -> PlainTexture {
    let bytes = pattern.texels(height);
    let grey = |linear: u8| {
        let byte = srgb::from_linear_f64(f64::from(linear) / 255.0);
        [byte, byte, byte, 255]
    };
    let places = (0..height).flat_map(|y| (0..width).map(move |x| y * height + x % height));
    PlainTexture::new([width, height], places.flat_map(|at| grey(bytes[at as usize])).collect())
}

/// Texels along a side of a generated relief, and its colours.
fn generated(kind: ReliefKind) -> (usize, Vec<[u8; 3]>) {
    (side_of(kind), kind.picture(side_of(kind)))
}

fn colours((side, colours): (usize, Vec<[u8; 3]>)) -> PlainTexture {
    PlainTexture::new([side as u32; 2], colours.into_iter().flat_map(|[r, g, b]| [r, g, b, 255]).collect())
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

/// The governor's budget without its time. Returns `refused` if only a time is stated, and warns if a time is dropped.
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

/// The warning that the time of a budget with faces has no effect.
fn dropped(budget: &Budget, refused: &RenderError) -> Option<String> {
    let why = match refused {
        RenderError::NoClock => "this device has no timestamps",
        _ => "--deterministic excludes measured times",
    };
    budget
        .frame_ms
        .map(|_| format!("governor.frame_ms is ignored: {why}; governor.frame_faces is the whole budget"))
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
