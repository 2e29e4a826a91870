//! Vulkan's nouns, and the only `unsafe` of the crate.
//!
//! Wrappers own their handle and an `Arc` of the device. `Drop` hands handle and memory to a queue that is
//! emptied when the GPU has passed every frame that could name them. Images live in GENERAL. A [`Frame`] is a
//! short list of passes, each with label, one global barrier and two timestamps.

mod buffer;
mod command;
mod device;
mod error;
mod features;
mod frame;
mod image;
mod instance;
mod message;
mod pipeline;
mod query;
mod render;
pub mod self_test;
mod semaphore;
pub mod shader;
mod watched;

pub use buffer::{Buffer, BufferUse};
pub use command::{Cmd, Resource, TexelCopy};
pub use device::{Gpu, GpuOptions};
pub use error::Error;
pub use features::{Feature, Need};
pub use frame::{FRAMES_IN_FLIGHT, Frame, PassTime, Ticket};
pub use image::{Filter, Format, Image, ImageInfo, Sampler, SamplerInfo, View};
pub use instance::{Instance, PhysicalDevice, Survey, driver_folders};
pub use message::{Message, Severity};
pub use pipeline::{ComputePipeline, Depth, GraphicsInfo, GraphicsPipeline};
pub use query::{ShaderCounts, ShaderQuery, StreamCount, StreamQuery};
pub use render::{Clear, ColorTarget, DepthTarget, Geometry, Render, Slice, TransformFeedback};
pub use semaphore::Semaphore;
pub use watched::Watched;

pub(crate) use error::Check;

pub type Result<T> = std::result::Result<T, Error>;
