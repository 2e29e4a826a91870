//! A scene becomes passes: the device features, memory and passes of what it shows, and of nothing else.
//!
//! A scene with a texture is paper 1's, with progressive meshes paper 2's; the work is done by that paper's session.

pub mod report;

mod plain;
mod technique;

pub use technique::{Carrier, Record, Surfaces};

use crate::frame::{PerFrame, Run, Shape, Stalled};
use crate::model::mesh::{MeshError, gpu_mesh};
use crate::paper::progressive_mesh::governor::Budget;
use crate::paper::progressive_mesh::{self, LoadError, ProgressiveMeshes, SurfaceError};
use crate::paper::virtual_texture::{self, Unfit, VirtualTexture, VirtualTextureError};
use crate::picture::Target;
use crate::scene::{Scene, TextureError};
use crate::vk::{self, Gpu, GpuOptions, Need};
use glam::DVec3;
use thiserror::Error;

/// What can stop a picture.
#[derive(Debug, Error)]
pub enum RenderError {
    #[error(transparent)]
    Texture(#[from] TextureError),
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error(transparent)]
    Unfit(#[from] Unfit),
    #[error(transparent)]
    VirtualTexture(#[from] VirtualTextureError),
    #[error(transparent)]
    Load(#[from] LoadError),
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    #[error(transparent)]
    Stalled(#[from] Stalled),
    #[error(
        "--deterministic: governor.frame_ms follows measured times, which no two runs have alike; set governor.frame_faces, a \
         budget in faces"
    )]
    MeasuredBudget,
    #[error(transparent)]
    Vulkan(#[from] vk::Error),
}

/// How a scene is to be opened.
#[derive(Clone, Copy, Debug)]
pub struct Options<'a> {
    pub target: Target,
    /// Pixels; the scene's own otherwise.
    pub size: Option<[u32; 2]>,
    /// Part of a device's name, or its index.
    pub device: Option<&'a str>,
    pub validate: bool,
    /// Budgets count tiles and faces instead of time: the same frames on every run.
    pub deterministic: bool,
}

/// A scene on a device.
pub type Renderer = Run<Surfaces>;

/// Opens a device with what the scene needs, and the scene on it.
///
/// # Errors
/// [`RenderError`] names the key, the file, or what the device lacks.
pub fn open(scene: &Scene, options: &Options<'_>) -> Result<Renderer, RenderError> {
    let size = options.size.unwrap_or([scene.view.width, scene.view.height]);
    let mut meshes =
        progressive_mesh::Settings { size, ..progressive_mesh::Settings::of_scene(scene, options.target) };
    meshes.budget = budget(scene, options.deterministic)?;
    let models = progressive_mesh::load(scene)?;
    let texture = texture(scene, options, size)?;
    let mut needs = progressive_mesh::needs(&meshes);
    if let Some((settings, source)) = &texture {
        needs.extend(virtual_texture::needs(&settings.config, source.format()));
    }
    let gpu = gpu(options, &needs)?;
    let target = crate::frame::Target::new(&gpu, size, options.target)?;
    let mut surfaces = Surfaces {
        meshes: None,
        plain: None,
        texture: None,
        carriers: Vec::new(),
        background: [0.0; 3],
        sun: DVec3::ZERO,
        frames: PerFrame::default(),
    };
    if !models.is_empty() {
        surfaces.meshes = Some(ProgressiveMeshes::new(&gpu, &models, meshes)?);
        surfaces.background = [0.02, 0.03, 0.05];
    }
    if let Some((settings, source)) = texture {
        let mesh = gpu_mesh(&scene.source_mesh()?)?;
        let shape = match settings.config.draws_depth_alone() {
            true => Shape::with_depth_alone(&gpu, &mesh)?,
            false => Shape::new(&gpu, &mesh)?,
        };
        surfaces.carriers.push(Carrier { name: "land".into(), shape: Some(shape.clone()) });
        surfaces.texture = Some(VirtualTexture::new(&gpu, source, vec![shape], settings, &target)?);
    }
    Ok(Run::new(gpu, surfaces, target))
}

/// What the scene's virtual texture asks for, and where its tiles come from.
fn texture(
    scene: &Scene,
    options: &Options<'_>,
    size: [u32; 2],
) -> Result<
    Option<(virtual_texture::Settings, std::sync::Arc<dyn crate::texture::source::TileSource>)>,
    RenderError,
> {
    if scene.texture.is_none() {
        return Ok(None);
    }
    let source = scene.open_texture()?;
    let mut settings = virtual_texture::Settings::of_scene(scene, options.target);
    settings.config.check(&source.pyramid())?;
    settings.size = size;
    settings.streaming.deterministic = options.deterministic;
    Ok(Some((settings, source)))
}

fn gpu(options: &Options<'_>, needs: &[Need]) -> vk::Result<Gpu> {
    let Options { device, validate, .. } = *options;
    let gpu = Gpu::new(&GpuOptions { device, validate, needs, ..GpuOptions::default() })?;
    tracing::info!("{}, {}", gpu.physical().name, gpu.physical().driver);
    Ok(gpu)
}

/// The governor's budget: without the time, where frames must be the same on every run.
fn budget(scene: &Scene, deterministic: bool) -> Result<Option<Budget>, RenderError> {
    let Some(governor) = scene.governor else { return Ok(None) };
    let frame_faces = governor.frame_faces;
    match (deterministic, frame_faces) {
        (true, None) => Err(RenderError::MeasuredBudget),
        (true, Some(_)) => Ok(Some(Budget { frame_ms: None, frame_faces })),
        (false, _) => Ok(Some(Budget { frame_ms: governor.frame_ms, frame_faces })),
    }
}
