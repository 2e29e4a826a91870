//! Figures of streaming along six paths over the earth: vt.cache, vt.prefetch, vt.budget, vt.pop, vt.disk.
//!
//! Lists and caches do not depend on the texels. So the `ruler`, whose tiles take a tenth of the time, replaces the
//! imagery where only lists and caches matter. Pyramid, mesh and paths stay the same. With tiles of 256 texels, 640 x
//! 360 pixels show as many tiles as 1280 x 720 pixels with the paper's tiles of 512. These figures have NA = 1,
//! one sample per pixel, and all except vt.pop also variants with the paper's NA = 16; vt.na has the values between.

mod budget;
mod cache;
mod disk;
mod halved;
mod pop;
mod prefetch;
mod traces;

pub use budget::BUDGET;
pub use cache::CACHE;
pub use disk::DISK;
pub use pop::POP;
pub use prefetch::PREFETCH;

use super::common::samples;
use crate::figure::prelude::*;
use crate::frame::Run;
use crate::math::camera::Pose;
use crate::math::pyramid::{Pyramid, TileId};
use crate::model::mesh;
use crate::paper::virtual_texture::config::{one_sample_scene, open_texture, source_mesh, texture};
use crate::paper::virtual_texture::{
    Compaction, Config, Dedup, PAPER, TextureFrameRecord, TileAddress, VirtualTexture,
    VirtualTextureSettings, needs,
};
use crate::picture::error::compare;
use crate::picture::map::error_maps;
use crate::picture::write::Srgb8Picture;
use crate::picture::{Picture, PixelFormat};
use crate::scene::Scene;
use crate::scene::path::CameraPath;
use crate::texture::source::cached::CachedSource;
use crate::texture::source::{TileError, TileSource};
use std::sync::Arc;

/// The six paths.
const PATHS: [&str; 6] = [
    "earth/orbit",
    "earth/pan",
    "earth/dive",
    "earth/pole-crossing",
    "earth/antimeridian-crossing",
    "earth/teleport",
];

/// Removes the headline's fourfold magnification. A dive then crosses three levels (with magnification it begins in
/// level 0), and a pan moves by a quarter of the pixels.
const UNMAGNIFIED: &str = "cameras.headline.magnification=1.0";

/// The ruler's tiles of 256 texels, with one sample per pixel.
const RULER: &[&str] = &[
    "surface.land.filter={max_anisotropy=1}",
    "surface.land.texture.source=ruler",
    "surface.land.texture.tile_size=256",
];

/// A cheap variant with an exact list; the figures do not depend on the variant.
const LISTS: Config =
    Config { dedup: Dedup::TestOr, compact: Compaction::Append, address: TileAddress::OwnLevel, ..PAPER };

/// A session on its own device; `change` edits the scene's settings last.
///
/// # Errors
/// The device lacks a feature.
fn session(
    bench: &Bench,
    scene: &Scene,
    source: Arc<dyn TileSource>,
    size: [u32; 2],
    change: impl FnOnce(&mut VirtualTextureSettings),
) -> anyhow::Result<Run<VirtualTexture>> {
    let mut settings = VirtualTextureSettings::of_scene(scene, PixelFormat::Linear32)?;
    settings.size = size;
    settings.config = Config { filter: settings.config.filter, ..LISTS };
    change(&mut settings);
    let gpu = bench.gpu(&needs(&settings.config, source.format()))?;
    let mesh = mesh::gpu_mesh(&source_mesh(scene)?);
    Ok(VirtualTexture::run(gpu, source, &mesh, settings)?)
}

/// Converts sRGB bytes to linear light.
fn linear(rgba: Vec<u8>, [width, height]: [u32; 2]) -> Picture {
    Picture::from(&Srgb8Picture { width, height, rgba })
}

/// Writes a picture and the map of its errors.
///
/// # Errors
/// The file cannot be written; the pictures differ in size.
fn show_beside(bench: &mut Bench, name: &str, shown: &Picture, truth: &Picture) -> anyhow::Result<()> {
    bench.picture(name, &Srgb8Picture::from(shown))?;
    let map = error_maps([truth.width, truth.height], &[&compare(shown, truth)?]);
    bench.picture(&format!("{name}-errors"), &map)
}

/// A scene with its texture in memory, and the settled picture of one of its cameras.
struct SettledView {
    scene: Scene,
    source: Arc<CachedSource>,
    pose: Pose,
    truth: Picture,
}

impl SettledView {
    /// The view `name`, such as `earth/oblique`, with NA = `na`.
    ///
    /// # Errors
    /// No shipped scene or camera has this name; the device lacks a feature; tiles do not arrive.
    fn of(bench: &Bench, name: &str, na: u32, size: [u32; 2]) -> anyhow::Result<SettledView> {
        let (scene, camera) = name.split_once('/').with_context(|| format!("{name:?}: not SCENE/CAMERA"))?;
        let scene = one_sample_scene(scene)?.with(&samples(na))?;
        let pose = scene.camera(camera)?.pose();
        let source = CachedSource::new(open_texture(&scene)?);
        let mut settled = session(bench, &scene, source.clone(), size, |_| ())?;
        settled.settle(&pose)?;
        let truth = settled.linear_picture()?;
        Ok(SettledView { scene, source, pose, truth })
    }
}

/// A path of a scene.
pub(super) struct Route {
    pub scene: Scene,
    pub path: CameraPath,
}

impl Route {
    /// The path `name`, such as `earth/pan`, with one sample per pixel, and with changed settings.
    ///
    /// # Errors
    /// No shipped scene or path has this name.
    pub fn find(name: &str, changes: &[String]) -> anyhow::Result<Route> {
        let (scene, path) = name.split_once('/').with_context(|| format!("{name:?}: not SCENE/PATH"))?;
        let scene = one_sample_scene(scene)?.with(changes)?;
        let path = scene.path(path)?.clone();
        Ok(Route { scene, path })
    }

    /// The path with the ruler's tiles of 256 texels, and changed settings.
    ///
    /// # Errors
    /// As [`Route::find`].
    fn of_ruler(name: &str, changes: &[String]) -> anyhow::Result<Route> {
        let ruler = RULER.iter().map(|change| (*change).to_owned());
        Route::find(name, &ruler.chain(changes.iter().cloned()).collect::<Vec<_>>())
    }

    pub fn pyramid(&self) -> anyhow::Result<Pyramid> {
        texture(&self.scene)?.pyramid()?.context("a synthetic texture states its size")
    }

    /// Every `step`-th frame of the path: its exact visible tiles before any bias, and the tiles expected
    /// `prefetch_frames` frames later. No tiles are streamed, because only the lists are needed.
    ///
    /// # Errors
    /// The device lacks a feature; device lost.
    pub fn records(
        &self,
        bench: &Bench,
        size: [u32; 2],
        step: u32,
        prefetch_frames: u32,
    ) -> anyhow::Result<Vec<TextureFrameRecord>> {
        let all_coarser = self.pyramid()?.first_resident_level();
        let mut session = session(bench, &self.scene, open_texture(&self.scene)?, size, |settings| {
            settings.streaming.level_bias = all_coarser;
            settings.streaming.gpu_tiles = 1;
            settings.streaming.host_tiles = 1;
            settings.streaming.prefetch_frames = prefetch_frames;
        })?;
        for frame in (0..self.path.frames).step_by(step as usize) {
            session.frame(&self.path.pose(frame))?;
        }
        session.drain()?;
        Ok(session.records.take())
    }
}

/// The picture's size, and the step between frames of a path.
fn extent(bench: &Bench) -> ([u32; 2], u32) {
    bench.effort_of(([640, 360], 2), ([1920, 1080], 1))
}

/// A source of zeros, for streaming recorded lists, where only the states of the tiles matter.
struct Blank(Pyramid);

impl Blank {
    /// A texture with the same grid of tiles, 16 x 16 texels each.
    fn like(pyramid: &Pyramid) -> Blank {
        let (tile_log2, finer) = (4, pyramid.tile_log2() - 4);
        let [width_log2, height_log2] = [pyramid.width_log2() - finer, pyramid.height_log2() - finer];
        let resident = pyramid.resident_levels() - finer;
        let blank = Pyramid::new(width_log2, height_log2, tile_log2, 0, Some(resident))
            .expect("a smaller tile makes a smaller texture of as many tiles");
        assert_eq!(blank.first_resident_level(), pyramid.first_resident_level());
        Blank(blank)
    }
}

impl TileSource for Blank {
    fn describe(&self) -> String {
        "blank".into()
    }
    fn pyramid(&self) -> Pyramid {
        self.0
    }
    fn read_tile(&self, _: TileId, bytes: &mut [u8]) -> Result<(), TileError> {
        bytes.fill(0);
        Ok(())
    }
    fn read_resident_level(&self, level: u32) -> Result<Vec<u8>, TileError> {
        let [width, height] = self.0.level_size(level);
        Ok(vec![0; 4 * width as usize * height as usize])
    }
}
