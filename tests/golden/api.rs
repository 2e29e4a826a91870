//! Renders a case. Only this file uses the renderer's API; if the API changes, the hashes stay.

use crate::cases::{Case, View};
use crate::store::{Entry, Hash, picture_here};
use ortelius::math::camera::Pose;
use ortelius::math::pyramid::TileId;
use ortelius::model::mesh::{Mesh, gpu_mesh};
use ortelius::paper::progressive_mesh::config::surface;
use ortelius::paper::progressive_mesh::stand::stands;
use ortelius::paper::progressive_mesh::{self, LoadedMesh, ProgressiveMeshes};
use ortelius::paper::virtual_texture::config::{one_sample_scene, open_texture, source_mesh};
use ortelius::paper::virtual_texture::{self, VirtualTexture, all_needs};
use ortelius::picture::PixelFormat;
use ortelius::renderer::{Options, Renderer};
use ortelius::scene::Scene;
use ortelius::texture::source::TileSource;
use ortelius::texture::source::cached::CachedSource;
use ortelius::vk::{Gpu, GpuOptions, Watched};
use std::collections::HashMap;
use std::sync::Arc;

const SIZE: [u32; 2] = [200, 113];

/// Frames for which a camera rests: more than any case needs to have all tiles. The number is fixed, because the
/// stochastic filter's noise depends on the frame's number.
const HELD_FRAMES: u32 = 9;

/// A device with the features of all variants. Any message of the validation layer fails the test.
pub fn device() -> Watched {
    Watched::open(&GpuOptions { needs: &all_needs(), ..GpuOptions::default() })
}

/// Device and driver with their versions.
pub fn driver(gpu: &Gpu) -> String {
    format!("{}, {}", gpu.physical().name, gpu.physical().driver)
}

/// Decoded tiles and ordered meshes, which take long to make and are shared by cases.
#[derive(Default)]
pub struct Shared {
    textured: HashMap<&'static str, (Arc<dyn TileSource>, Mesh)>,
    /// Only the last mesh, because the cases of an order are consecutive. Both scenes show the same model.
    mesh: Option<(String, LoadedMesh)>,
}

/// The case's scene with one sample per pixel and the case's changes. Each change gets the section of its key.
fn scene(case: &Case) -> Scene {
    let section = |change: &str| match change.split('=').next().unwrap() {
        "order" | "apply" | "geomorph" => format!("surface.{}.geometry", case.scene),
        "samples" | "interpolation" | "max_anisotropy" => "surface.land.filter".to_owned(),
        "upload_tiles_per_frame" | "fade_in_frames" | "prefetch_frames" => "cache".to_owned(),
        _ => "variant".to_owned(),
    };
    let key = |change: &str| match change.strip_prefix("filter=") {
        Some(kind) => format!("surface.land.filter.kind={kind}"),
        None => format!("{}.{change}", section(change)),
    };
    let mut changes: Vec<String> = case.changes.iter().map(|change| key(change)).collect();
    // Without geomorphing, the picture of a view does not depend on the views before it.
    if case.changes.iter().any(|change| change == "geomorph=false") {
        changes.push(format!("surface.{}.geometry.pixels_per_second=1e6", case.scene));
    }
    one_sample_scene(case.scene).unwrap().with(&changes).unwrap()
}

fn pose(scene: &Scene, view: &View) -> Pose {
    match view {
        View::Camera(camera) => scene.camera(camera).unwrap().pose(),
        View::Path(path, frame) => scene.path(path).unwrap().pose(*frame),
    }
}

/// Paper 1: the picture and the sorted tiles of each view, and the visible-tile list of the last view if its order is
/// deterministic.
pub fn virtual_texture(gpu: &Gpu, shared: &mut Shared, case: &Case) -> Vec<Entry> {
    let scene = scene(case);
    let mut settings = virtual_texture::VirtualTextureSettings::of_scene(&scene, PixelFormat::Srgb8).unwrap();
    settings.size = SIZE;
    settings.streaming.gpu_tiles = 64;
    settings.streaming.deterministic = true;
    if matches!(case.views[0], View::Camera(_)) {
        // All tiles of a picture arrive in one frame. Along a path the scene's own budgets apply.
        settings.streaming.load_tiles_per_frame = 64;
        settings.streaming.upload_tiles_per_frame = 64;
    }
    let open = || -> (Arc<dyn TileSource>, Mesh) {
        let source = CachedSource::new(open_texture(&scene).unwrap());
        (source, gpu_mesh(&source_mesh(&scene).unwrap()))
    };
    let (source, mesh) = shared.textured.entry(case.scene).or_insert_with(open);
    let mut session = VirtualTexture::run(gpu.clone(), source.clone(), mesh, settings).unwrap();
    let mut entries = Vec::new();
    for view in case.views {
        let (pose, name) = (pose(&scene, view), case.name(view));
        match view {
            View::Camera(_) => {
                (0..HELD_FRAMES).for_each(|_| session.frame(&pose).unwrap());
                assert!(session.settled(), "{name}: tiles are missing after {HELD_FRAMES} frames");
            }
            View::Path(..) => session.frame(&pose).unwrap(),
        }
        let picture = session.picture_bytes().unwrap();
        let mut tiles = session.records.last().unwrap().visible.clone();
        tiles.sort_by_key(|tile| (tile.level, tile.row, tile.column));
        let hashes = vec![(picture_here(), Hash::of_bytes(&picture)), ("tiles".to_owned(), of_tiles(&tiles))];
        entries.push(Entry { name, hashes });
    }
    if case.ordered() {
        let last = session.again(&pose(&scene, case.views.last().unwrap())).unwrap();
        let list = Hash::of_words(last.triples.into_iter().flatten());
        entries.last_mut().unwrap().hashes.push(("list".to_owned(), list));
    }
    entries
}

/// The picture of each view and its sorted tiles, if the scene has a virtual texture, with the scene's own caches and
/// filter.
pub fn shipped(gpu: &Gpu, case: &Case) -> Vec<Entry> {
    let scene = Scene::embedded(case.scene).unwrap();
    let options = Options { size: Some(SIZE), deterministic: true, ..Options::default() };
    let mut renderer = Renderer::on(gpu, &scene, &options).unwrap();
    let entry = |view: &View| {
        renderer.settle(&pose(&scene, view)).unwrap();
        renderer.drain().unwrap();
        let mut hashes = Vec::new();
        if let Some(record) = renderer.records.last().and_then(|record| record.texture.as_ref()) {
            let mut tiles = record.visible.clone();
            tiles.sort_by_key(|tile| (tile.level, tile.row, tile.column));
            hashes.push(("tiles".to_owned(), of_tiles(&tiles)));
        }
        hashes.push((picture_here(), Hash::of_bytes(&renderer.picture_bytes().unwrap())));
        Entry { name: case.name(view), hashes }
    };
    case.views.iter().map(entry).collect()
}

fn of_tiles(tiles: &[TileId]) -> Hash {
    Hash::of_words(tiles.iter().flat_map(|tile| [tile.level, tile.row, tile.column]))
}

/// Paper 2: the picture of each view, and the drawn index buffers of all instances if the host knows them.
pub fn progressive_mesh(gpu: &Gpu, shared: &mut Shared, case: &Case) -> Vec<Entry> {
    let scene = scene(case);
    let model = model(shared, case, &scene);
    let settings = progressive_mesh::ProgressiveMeshSettings {
        size: SIZE,
        ..progressive_mesh::ProgressiveMeshSettings::of_scene(&scene, PixelFormat::Srgb8).unwrap()
    };
    let mut session = ProgressiveMeshes::run(gpu.clone(), &[model], settings).unwrap();
    let mut entries = Vec::new();
    for view in case.views {
        session.frame(&pose(&scene, view)).unwrap();
        let picture = session.picture_bytes().unwrap();
        let mut hashes = vec![(picture_here(), Hash::of_bytes(&picture))];
        let surface = &session.technique.surfaces[0];
        let faces: Option<Vec<_>> =
            (0..surface.instances().count()).map(|instance| surface.faces(instance)).collect();
        if let Some(faces) = faces {
            let words = faces
                .iter()
                .flat_map(|faces| std::iter::once(faces.len() as u32).chain(faces.iter().copied().flatten()));
            hashes.push(("faces".to_owned(), Hash::of_words(words)));
        }
        entries.push(Entry { name: case.name(view), hashes });
    }
    entries
}

/// The case's surface. It reuses the last case's mesh if the order is the same.
fn model(shared: &mut Shared, case: &Case, scene: &Scene) -> LoadedMesh {
    let order = case.changes[0].clone();
    let name = scene.surfaces.keys().next().unwrap();
    let surface = surface(scene, name).unwrap();
    if shared.mesh.as_ref().is_none_or(|(known, _)| *known != order) {
        let loaded = progressive_mesh::load(scene).unwrap().remove(0);
        shared.mesh = Some((order, loaded));
    }
    let (_, known) = shared.mesh.as_ref().unwrap();
    assert_eq!(known.surface.source, surface.source, "both scenes show one model");
    let stands = stands(scene, &surface);
    LoadedMesh { name: name.clone(), surface, stands, ..known.clone() }
}
