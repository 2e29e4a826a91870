//! Ortelius: a research renderer on raw Vulkan. It rebuilds the pipelines of three papers. Each has modern variants and
//! a slow reference in f64 or integers. The cost and the error of every choice are measured.
//!
//! # The papers
//!
//! Each step of a paper is one file or folder, named after the step. The module of each paper lists its steps and its
//! errata.
//!
//! - [`paper::virtual_texture`]: super-large textures; the visible tiles are determined entirely on the GPU.
//! - [`paper::progressive_mesh`]: progressive meshes whose index order suits the vertex cache at every level of
//!   detail.
//! - [`paper::texture_mapping`]: texture filters that weight the texels of a pixel's ellipse, compared with
//!   established filters.
//!
//! # Use as a library
//!
//! A [`Scene`] is read from a file or by the name of a shipped scene. A [`Renderer`] opens it on a device (a [`Gpu`])
//! with only the features, memory and passes that the scene needs.
//!
//! ```
//! use ortelius::{Options, Renderer, Scene};
//! use std::path::Path;
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let scene = Scene::embedded("earth")?;
//!     let options = Options { size: Some([96, 54]), ..Options::default() };
//!     let mut renderer = Renderer::open(&scene, &options)?;
//!     let frames = renderer.settle(&scene.camera("oblique")?.pose())?;
//!     println!("settled after {frames} frames");
//! #   let folder = tempfile::tempdir()?;
//! #   std::env::set_current_dir(&folder)?;
//!     renderer.picture()?.save(Path::new("alps.png"))?;
//!     renderer.report(&scene, "oblique")?.save(Path::new("alps.json"))?;
//!     Ok(())
//! }
//! ```
//!
//! [`Renderer::frame`] renders one frame from a [`Pose`], [`Renderer::settle`] renders until nothing is missing, and
//! [`Renderer::resize`] changes the picture's size between frames. Pictures are available as [`Srgb8Picture`]s, as
//! linear [`Picture`]s, or as bytes ([`Renderer::picture_bytes`]); a [`Report`] holds the measurements of the last 120
//! frames. Everything else is internal and may change; it is public only for the command line and the tests, and hidden
//! here.

#![deny(unsafe_code)]

// A module may use the modules listed above it, but not those below.

// floor 0: plain data, no GPU
#[doc(hidden)]
pub mod file;
#[doc(hidden)]
pub mod header;
#[doc(hidden)]
pub mod math;
#[doc(hidden)]
pub mod picture;
#[doc(hidden)]
pub mod stats;
// floor 1: models, reference code, textures and Vulkan; independent of each other
#[doc(hidden)]
pub mod model;
#[doc(hidden)]
pub mod reference;
#[doc(hidden)]
pub mod texture;
#[allow(unsafe_code)]
#[doc(hidden)]
pub mod vk;
// floor 2: scenes, the frame loop, figures
#[doc(hidden)]
pub mod figure;
#[doc(hidden)]
pub mod frame;
#[doc(hidden)]
pub mod scene;
// floor 3: the papers, independent of each other
pub mod paper;
// floor 4: scenes to passes
#[doc(hidden)]
pub mod renderer;

pub use frame::View;
pub use math::camera::Pose;
pub use picture::write::{FileError, Srgb8Picture};
pub use picture::{Picture, PixelFormat};
pub use renderer::report::Report;
pub use renderer::{Options, RenderError, Renderer};
pub use scene::{Scene, SceneError};
pub use vk::Gpu;

/// Compiles the README's example, which is not run because it writes into the working directory. The crate's
/// documentation above has the same example, and runs it.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
