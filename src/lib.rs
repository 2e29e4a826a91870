//! Ortelius: a research renderer on raw Vulkan. It rebuilds the pipelines of papers, each beside its modern variants and
//! a slow, exact reference, and measures what every choice costs and what error it makes.
//!
//! # The papers
//!
//! The question "how does the paper do step Y" is answered by one file, named after the step; the module of each paper
//! lists them, with the errata.
//!
//! - [`paper::virtual_texture`]: super-large textures, whose visible tiles are found wholly on the GPU.
//! - [`paper::progressive_mesh`]: progressive meshes whose index buffer suits the vertex cache at every level of detail.
//! - The third paper, on texture mapping, is not rebuilt yet; its exact filters are the reference of the first one.
//!
//! # Use as a library
//!
//! A [`Scene`] is read from a file or by the name of a shipped one; a [`Renderer`] opens it on a device, a [`Gpu`], with
//! the features, memory and passes that the scene names and no others.
//!
//! ```
//! use ortelius::{Options, Renderer, Scene};
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let scene = Scene::embedded("earth")?;
//!     let options = Options { size: Some([96, 54]), ..Options::default() };
//!     let mut renderer = Renderer::open(&scene, &options)?;
//!     let frames = renderer.settle(&scene.camera("oblique")?.pose())?;
//!     println!("settled after {frames} frames");
//!     let folder = std::env::temp_dir();
//!     renderer.picture()?.save(&folder.join("alps.png"))?;
//!     renderer.report(&scene, "oblique")?.save(&folder.join("alps.json"))?;
//!     Ok(())
//! }
//! ```
//!
//! [`Renderer::frame`] renders one frame from a [`Pose`], [`Renderer::settle`] until nothing is missing, and
//! [`Renderer::resize`] changes the picture's size between frames. Pictures come as [`Srgb8Picture`]s, as linear
//! [`Picture`]s, or as bytes ([`Renderer::picture_bytes`]); a [`Report`] holds what was measured. Everything else is
//! internal: public for the command line and the tests, hidden here, and free to change.

#![deny(unsafe_code)]

// A module may use those of the floors above it in this list, never those below.

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
// floor 1: worlds that do not know each other
#[doc(hidden)]
pub mod model;
#[doc(hidden)]
pub mod reference;
#[doc(hidden)]
pub mod texture;
#[allow(unsafe_code)]
#[doc(hidden)]
pub mod vk;
// floor 2: what is shown, how frames are made, what is measured
#[doc(hidden)]
pub mod figure;
#[doc(hidden)]
pub mod frame;
#[doc(hidden)]
pub mod scene;
// floor 3: the papers; none names another
pub mod paper;
// floor 4: a scene becomes passes
#[doc(hidden)]
pub mod renderer;

pub use frame::View;
pub use math::camera::Pose;
pub use picture::write::{FileError, Srgb8Picture};
pub use picture::{Picture, Target};
pub use renderer::report::Report;
pub use renderer::{Options, RenderError, Renderer};
pub use scene::{Scene, SceneError};
pub use vk::Gpu;

/// The README's example compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
