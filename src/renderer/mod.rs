//! A scene becomes passes: the device features, memory and passes of what it shows, and of nothing else.
//!
//! A scene with a texture is paper 1's, with progressive meshes paper 2's; the work is done by that paper's session.

pub mod report;
pub mod sections;

use crate::math::camera::Pose;
use crate::model::mesh::{MeshError, gpu_mesh};
use crate::paper::progressive_mesh::session as surfaces;
use crate::paper::progressive_mesh::{self, governor::Budget};
use crate::paper::virtual_texture::config::{TextureError, check_opened, open_texture, owner, source_mesh};
use crate::paper::virtual_texture::session as landscape;
use crate::paper::virtual_texture::{Unfit, session::SessionError};
use crate::picture::Target;
use crate::scene::{Scene, SceneError};
use crate::vk::{self, Gpu, GpuOptions, Need};
use thiserror::Error;

/// What can stop a picture.
#[derive(Debug, Error)]
pub enum RenderError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error("scene {0}: {1}")]
    Mixed(String, &'static str),
    #[error(transparent)]
    Texture(#[from] TextureError),
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error(transparent)]
    Unfit(#[from] Unfit),
    #[error(transparent)]
    Landscape(#[from] SessionError),
    #[error(transparent)]
    Load(#[from] surfaces::LoadError),
    #[error(transparent)]
    Surfaces(#[from] surfaces::SurfaceError),
    #[error(
        "--deterministic: governor.frame_ms follows measured times, which no two runs have alike; set governor.frame_faces, a \
         budget in faces"
    )]
    MeasuredBudget,
    #[error(transparent)]
    Vulkan(#[from] vk::Error),
}

impl RenderError {
    /// The program's exit code where it is not the common 1.
    pub fn exit_code(&self) -> Option<u8> {
        match self {
            RenderError::Texture(error) => error.exit_code(),
            RenderError::Landscape(error) => error.exit_code(),
            RenderError::Surfaces(surfaces::SurfaceError::Vulkan(error)) | RenderError::Vulkan(error) => {
                Some(error.exit_code())
            }
            _ => None,
        }
    }
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
pub enum Renderer {
    /// Paper 1.
    Landscape(Box<landscape::Session>),
    /// Paper 2.
    Surfaces(Box<surfaces::Session>),
}

impl Renderer {
    /// Opens a device with what the scene needs, and the scene on it.
    ///
    /// # Errors
    /// [`RenderError`] names the key, the file, or what the device lacks.
    pub fn open(scene: &Scene, options: &Options<'_>) -> Result<Renderer, RenderError> {
        sections::check(scene)?;
        let meshes = progressive_mesh::config::names(scene).count();
        match (owner(scene)?, scene.surfaces.len() - meshes) {
            (Some(_), 1) if meshes == 0 => open_landscape(scene, options),
            (None, 0) => open_surfaces(scene, options),
            _ => Err(RenderError::Mixed(
                scene.name.clone(),
                "only one surface with a virtual texture, or progressive meshes without textures, are drawn",
            )),
        }
    }

    pub fn gpu(&self) -> &Gpu {
        match self {
            Renderer::Landscape(session) => &session.gpu,
            Renderer::Surfaces(session) => &session.gpu,
        }
    }

    /// Pixels.
    pub fn size(&self) -> [u32; 2] {
        match self {
            Renderer::Landscape(session) => session.settings.size,
            Renderer::Surfaces(session) => session.settings.size,
        }
    }

    pub fn target(&self) -> Target {
        match self {
            Renderer::Landscape(session) => session.settings.target,
            Renderer::Surfaces(session) => session.settings.target,
        }
    }

    /// Paper 1's session, where the scene has a texture.
    pub fn landscape(&mut self) -> Option<&mut landscape::Session> {
        match self {
            Renderer::Landscape(session) => Some(session),
            Renderer::Surfaces(_) => None,
        }
    }

    /// One frame from `pose`.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn frame(&mut self, pose: &Pose) -> Result<(), RenderError> {
        match self {
            Renderer::Landscape(session) => Ok(session.frame(pose)?),
            Renderer::Surfaces(session) => Ok(session.frame(pose)?),
        }
    }

    /// Frames from one pose until nothing is missing; returns how many it took. Progressive meshes are at their level at
    /// once: one.
    ///
    /// # Errors
    /// As [`Renderer::frame`]; tiles that never arrive.
    pub fn settle(&mut self, pose: &Pose) -> Result<u64, RenderError> {
        match self {
            Renderer::Landscape(session) => Ok(session.settle(pose)?),
            Renderer::Surfaces(session) => {
                session.frame(pose)?;
                Ok(1)
            }
        }
    }

    /// Waits for every frame in flight, so that the report holds all of them.
    ///
    /// # Errors
    /// Device lost.
    pub fn drain(&mut self) -> Result<(), RenderError> {
        match self {
            Renderer::Landscape(session) => Ok(session.drain()?),
            Renderer::Surfaces(session) => Ok(session.drain()?),
        }
    }

    /// The last frame's picture, rows from the top: sRGB bytes or f32 of linear light, RGBA.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn picture_bytes(&mut self) -> Result<Vec<u8>, RenderError> {
        match self {
            Renderer::Landscape(session) => Ok(session.picture_bytes()?),
            Renderer::Surfaces(session) => Ok(session.picture_bytes()?),
        }
    }

    /// Device features that the scene asked for.
    pub fn needs(&self) -> Vec<Need> {
        match self {
            Renderer::Landscape(session) => {
                landscape::needs(&session.settings.config, session.source.format())
            }
            Renderer::Surfaces(session) => surfaces::needs(&session.settings),
        }
    }

    /// Names of a frame's passes, in order.
    pub fn passes(&self) -> Vec<String> {
        match self {
            Renderer::Landscape(session) => session.pipeline.passes().into_iter().map(Into::into).collect(),
            Renderer::Surfaces(session) => session.passes().into_iter().map(Into::into).collect(),
        }
    }

    /// What each instance of a progressive mesh takes of its own, a line for each surface.
    pub fn instances(&self) -> Vec<String> {
        match self {
            Renderer::Landscape(_) => Vec::new(),
            Renderer::Surfaces(session) => {
                session.surfaces.iter().map(surfaces::Surface::of_an_instance).collect()
            }
        }
    }

    /// (name, bytes) of all that the scene made in video memory.
    pub fn memory(&self) -> Vec<(String, u64)> {
        match self {
            Renderer::Landscape(session) => {
                session.memory().into_iter().map(|(name, bytes)| (name.to_owned(), bytes)).collect()
            }
            Renderer::Surfaces(session) => session.memory(),
        }
    }
}

fn gpu(options: &Options<'_>, needs: &[Need]) -> vk::Result<Gpu> {
    let Options { device, validate, .. } = *options;
    let gpu = Gpu::new(&GpuOptions { device, validate, needs, ..GpuOptions::default() })?;
    tracing::info!("{}, {}", gpu.physical().name, gpu.physical().driver);
    Ok(gpu)
}

fn open_landscape(scene: &Scene, options: &Options<'_>) -> Result<Renderer, RenderError> {
    let source = open_texture(scene)?;
    let mut settings = landscape::Settings::of_scene(scene, options.target)?;
    check_opened(scene, &settings.config, &source.pyramid())?;
    settings.size = options.size.unwrap_or(settings.size);
    settings.streaming.deterministic = options.deterministic;
    let gpu = gpu(options, &landscape::needs(&settings.config, source.format()))?;
    let mesh = gpu_mesh(&source_mesh(scene)?)?;
    Ok(Renderer::Landscape(Box::new(landscape::Session::new(gpu, source, &mesh, settings)?)))
}

fn open_surfaces(scene: &Scene, options: &Options<'_>) -> Result<Renderer, RenderError> {
    let mut settings = surfaces::Settings {
        size: options.size.unwrap_or([scene.view.width, scene.view.height]),
        ..surfaces::Settings::of_scene(scene, options.target)?
    };
    settings.budget = budget(settings.budget, options.deterministic)?;
    let models = surfaces::load(scene)?;
    let gpu = gpu(options, &surfaces::needs(&settings))?;
    Ok(Renderer::Surfaces(Box::new(surfaces::Session::new(gpu, &models, settings)?)))
}

/// The governor's budget: without the time, where frames must be the same on every run.
fn budget(stated: Option<Budget>, deterministic: bool) -> Result<Option<Budget>, RenderError> {
    match stated {
        Some(Budget { frame_faces: None, .. }) if deterministic => Err(RenderError::MeasuredBudget),
        Some(budget) if deterministic => Ok(Some(Budget { frame_ms: None, ..budget })),
        _ => Ok(stated),
    }
}
