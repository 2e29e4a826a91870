//! Paper 1 on the device, compared with the reference: lists are equal as sets, texels are verified, caches degrade and
//! recover. Validation and synchronisation validation are on in every test; any message fails it.

mod counts;
mod ellipse;
mod ellipse_settings;
mod extremes;
mod filters;
mod fused;
mod limb;
mod lists;
mod masks;
mod paths;
mod prepass;
mod read_back;
mod streaming;
mod texel_filters;
mod texels;
mod truth;
mod variants;

use ortelius::frame::Run;
use ortelius::math::camera::Pose;
use ortelius::model::mesh;
use ortelius::paper::virtual_texture::config::{one_sample_scene, open_texture, owner, source_mesh};
use ortelius::paper::virtual_texture::{VirtualTexture, VirtualTextureSettings, all_needs};
use ortelius::picture::PixelFormat;
use ortelius::scene::{SHIPPED, Scene};
use ortelius::texture::source::TileSource;
use ortelius::vk::{Gpu, GpuOptions, Watched};
use std::sync::Arc;

/// A session with one landscape.
type TextureSession = Run<VirtualTexture>;

/// A device with the features of all variants.
fn device() -> Watched {
    Watched::open(&GpuOptions { needs: &all_needs(), ..GpuOptions::default() })
}

/// A shipped scene's renderer at test size, with changed settings and possibly another texture.
fn open_with(
    gpu: &Gpu,
    scene: &Scene,
    size: [u32; 2],
    source: Arc<dyn TileSource>,
    change: impl FnOnce(&mut VirtualTextureSettings),
) -> TextureSession {
    let mut settings = VirtualTextureSettings::of_scene(scene, PixelFormat::Srgb8).unwrap();
    settings.size = size;
    settings.streaming.gpu_tiles = 64;
    settings.streaming.deterministic = true;
    change(&mut settings);
    let mesh = mesh::gpu_mesh(&source_mesh(scene).unwrap());
    VirtualTexture::run(gpu.clone(), source, &mesh, settings).unwrap()
}

fn open(
    gpu: &Gpu,
    scene: &Scene,
    size: [u32; 2],
    change: impl FnOnce(&mut VirtualTextureSettings),
) -> TextureSession {
    open_with(gpu, scene, size, open_texture(scene).unwrap(), change)
}

/// A shipped scene with one sample per pixel; tests of filters set another number.
fn scene(name: &str) -> Scene {
    one_sample_scene(name).unwrap()
}

/// A scene with another tile border.
fn bordered(name: &str, border: u32) -> Scene {
    scene(name).with(&[format!("surface.land.texture.border={border}")]).unwrap()
}

fn pose(scene: &Scene, camera: &str) -> Pose {
    scene.camera(camera).unwrap().pose()
}

/// The shipped scenes that have a landscape.
fn landscapes() -> impl Iterator<Item = &'static str> {
    let is_one = |name: &&str| owner(&scene(name)).unwrap().is_some_and(|surface| surface.grid().is_some());
    SHIPPED.into_iter().map(|(name, _)| name).filter(is_one)
}
