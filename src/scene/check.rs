//! The ranges of a scene's numbers, and which keys go with which `kind`.

use super::Scene;
use super::camera::{Camera, Ground, Place};
use super::choice::{Compaction, Listing};
use super::error::list;
use super::file::{CameraFile, MeshFile, MeshKind, PathFile, PathKind, SceneFile, SourceKind, TextureFile};
use super::path::{self, Motion};
use super::progressive_mesh::{GovernorSettings, check_surface};
use super::settings::{Cache, MeshSpec, Texture, TextureSource, Variant, View};
use crate::math::pyramid::PyramidError;
use crate::texture::source::{TileFormat, disk::Disk};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// A value that does not do, by its key.
pub(super) struct Fault {
    pub key: Vec<String>,
    pub what: String,
}

impl Fault {
    pub fn new(key: &[&str], what: impl Into<String>) -> Fault {
        Fault { key: key.iter().map(|&part| part.to_owned()).collect(), what: what.into() }
    }
}

/// Checks every number, and what depends on a `kind`. `folder`: what a relative path starts from, by its key.
pub(super) fn check(
    file: SceneFile,
    name: String,
    folder: &dyn Fn(&[&str]) -> PathBuf,
) -> Result<Scene, Fault> {
    let landscape = landscape(&file)?;
    let ground = match &file.mesh {
        Some(MeshFile { kind: MeshKind::Earth, .. }) => Ground::Planet,
        _ => Ground::Plane,
    };
    let mut cameras = BTreeMap::new();
    for (name, camera) in &file.cameras {
        check_name(&["cameras", name])?;
        cameras.insert(name.clone(), check_camera(name, camera, ground)?);
    }
    let mut paths = BTreeMap::new();
    for (name, path) in &file.paths {
        check_name(&["paths", name])?;
        paths.insert(name.clone(), check_path(name, path, &cameras)?);
    }
    check_view(&file.view, &cameras, &paths)?;
    let mut progressive_meshes = BTreeMap::new();
    for (name, surface) in &file.progressive_mesh {
        check_name(&["progressive_mesh", name])?;
        let folder = folder(&["progressive_mesh", name, "source"]);
        progressive_meshes.insert(name.clone(), check_surface(name, surface, &paths, &folder)?);
    }
    check_governor(file.governor.as_ref())?;
    let (cache, disk, variant) =
        (file.cache.unwrap_or_default(), file.disk.unwrap_or_default(), file.variant.unwrap_or_default());
    check_cache(&cache)?;
    check_disk(&disk)?;
    check_variant(&variant)?;
    let (texture, mesh) = match landscape {
        true => {
            let texture = file.texture.map(|texture| check_texture(texture, &folder(&["texture", "path"])));
            (texture.transpose()?, file.mesh.as_ref().map(check_mesh).transpose()?)
        }
        false => (None, None),
    };
    Ok(Scene {
        name,
        texture,
        cache,
        disk,
        mesh,
        progressive_meshes,
        governor: file.governor,
        view: file.view,
        cameras,
        paths,
        variant,
    })
}

fn check_governor(governor: Option<&GovernorSettings>) -> Result<(), Fault> {
    let Some(&GovernorSettings { frame_ms, frame_faces }) = governor else { return Ok(()) };
    if frame_ms.is_none() && frame_faces.is_none() {
        return Err(Fault::new(&["governor"], "a governor needs a budget: frame_ms, frame_faces, or both"));
    }
    frame_ms.map(|ms| within(&["governor", "frame_ms"], ms, 1e-3..=1e6)).transpose()?;
    frame_faces.map(|faces| within(&["governor", "frame_faces"], faces, 1..=u32::MAX)).transpose()?;
    Ok(())
}

/// Whether a scene has paper 1's landscape; else it has paper 2's surfaces.
fn landscape(file: &SceneFile) -> Result<bool, Fault> {
    let surfaces = !file.progressive_mesh.is_empty();
    match (&file.texture, &file.mesh) {
        // Said at once: the missing half of the landscape would be refused as well.
        (texture, mesh) if surfaces && (texture.is_some() || mesh.is_some()) => {
            let what = "a scene shows a textured landscape or progressive meshes, not both, and this one has \
                        [progressive_mesh]; make a scene of its own for the landscape";
            Err(Fault::new(if texture.is_some() { &["texture"] } else { &["mesh"] }, what))
        }
        (Some(_), Some(_)) => match &file.governor {
            Some(_) => {
                Err(Fault::new(&["governor"], "a governor steers the error of progressive meshes alone"))
            }
            None => Ok(true),
        },
        (Some(_), None) => Err(Fault::new(&["texture"], "a texture needs a [mesh] that it covers")),
        (None, Some(_)) => Err(Fault::new(&["mesh"], "a landscape's mesh needs a [texture]")),
        (None, None) if surfaces => {
            let kind = "a scene without a texture";
            absent(&["cache"], &file.cache, kind)?;
            absent(&["disk"], &file.disk, kind)?;
            absent(&["variant"], &file.variant, kind)?;
            Ok(false)
        }
        (None, None) => {
            let what = "nothing to see: a scene has [texture] and [mesh], or a [progressive_mesh.NAME]";
            Err(Fault::new(&["view"], what))
        }
    }
}

pub(super) fn within<T: PartialOrd + std::fmt::Display>(
    key: &[&str],
    value: T,
    range: RangeInclusive<T>,
) -> Result<T, Fault> {
    // NaN is in no range.
    if range.contains(&value) {
        return Ok(value);
    }
    Err(Fault::new(key, format!("{value} is outside {} ..= {}", range.start(), range.end())))
}

fn check_name(key: &[&str; 2]) -> Result<(), Fault> {
    let name = key[1];
    if !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c)) {
        return Ok(());
    }
    Err(Fault::new(key, format!("{name:?} is no name: letters, digits, _ and - only")))
}

/// A value that this kind of thing needs.
pub(super) fn needed<T: Copy>(key: &[&str], value: Option<T>, kind: &str) -> Result<T, Fault> {
    value.ok_or_else(|| {
        let what = format!("{kind} needs {}", key[key.len() - 1]);
        Fault::new(key, what)
    })
}

/// A value that this kind of thing does not know.
pub(super) fn absent<T>(key: &[&str], value: &Option<T>, kind: &str) -> Result<(), Fault> {
    match value {
        Some(_) => Err(Fault::new(key, format!("{kind} has no {}", key[key.len() - 1]))),
        None => Ok(()),
    }
}

fn check_format(format: Option<TileFormat>, border: u32, source: &TextureSource) -> Result<(), Fault> {
    let fault = |key, what: &str| Err(Fault::new(&["texture", key], what));
    match (source, format) {
        (TextureSource::File(_), Some(_)) => {
            fault("format", "a file has its own format; bake it with --format")
        }
        (TextureSource::Ruler, Some(TileFormat::Bc1)) => {
            fault("format", "the ruler is exact texel by texel, which bc1 is not; choose \"rgba8\"")
        }
        (_, Some(TileFormat::Bc1)) if !border.is_multiple_of(4) => fault(
            "border",
            "bc1 works in blocks of 4 texels on both stored levels: the border must be a multiple of 4",
        ),
        _ => Ok(()),
    }
}

fn check_texture(file: TextureFile, folder: &Path) -> Result<Texture, Fault> {
    let source = match (file.source, file.path) {
        (SourceKind::File, Some(path)) => TextureSource::File(folder.join(path)),
        (SourceKind::File, None) => {
            return Err(Fault::new(&["texture", "path"], "the source \"file\" needs a path"));
        }
        (_, Some(_)) => {
            return Err(Fault::new(&["texture", "path"], "only the source \"file\" has a path"));
        }
        (SourceKind::Earth, None) => TextureSource::Earth,
        (SourceKind::Ruler, None) => TextureSource::Ruler,
    };
    let size_log2 = match (file.width_log2, file.height_log2) {
        (Some(width_log2), Some(height_log2)) => Some([width_log2, height_log2]),
        (None, None) if matches!(source, TextureSource::File(_)) => None,
        (None, _) => return Err(Fault::new(&["texture", "width_log2"], "width_log2 is missing")),
        (_, None) => return Err(Fault::new(&["texture", "height_log2"], "height_log2 is missing")),
    };
    if !file.tile_size.is_power_of_two() {
        let what = format!("a tile of {} texels is no power of two", file.tile_size);
        return Err(Fault::new(&["texture", "tile_size"], what));
    }
    within(&["texture", "tile_size"], file.tile_size, 16..=1024)?;
    check_format(file.format, file.border, &source)?;
    let texture = Texture {
        source,
        size_log2,
        tile_size: file.tile_size,
        border: file.border,
        resident_levels: file.resident_levels,
        format: file.format.unwrap_or_default(),
    };
    texture.pyramid().map_err(|error| {
        let key = match error {
            PyramidError::Size(..) => "width_log2",
            PyramidError::Tile(_) => "tile_size",
            PyramidError::Border(_) => "border",
            PyramidError::Resident { .. } => "resident_levels",
        };
        Fault::new(&["texture", key], error.to_string())
    })?;
    Ok(texture)
}

fn check_mesh(file: &MeshFile) -> Result<MeshSpec, Fault> {
    // 8192 squared is the most that `mesh` builds.
    let columns = |least| within(&["mesh", "columns"], file.columns, least..=8192);
    let rows = |least| within(&["mesh", "rows"], file.rows, least..=8192);
    let side = |name, side_m: Option<f64>| {
        let side_m = needed(&["mesh", name], side_m, "a plane")?;
        within(&["mesh", name], side_m, 1e-3..=1e9)
    };
    match file.kind {
        MeshKind::Earth => {
            absent(&["mesh", "width_m"], &file.width_m, "the earth")?;
            absent(&["mesh", "height_m"], &file.height_m, "the earth")?;
            Ok(MeshSpec::Earth { columns: columns(3)?, rows: rows(2)? })
        }
        MeshKind::Plane => Ok(MeshSpec::Plane {
            width_m: side("width_m", file.width_m)?,
            height_m: side("height_m", file.height_m)?,
            columns: columns(1)?,
            rows: rows(1)?,
        }),
    }
}

fn check_camera(name: &str, file: &CameraFile, ground: Ground) -> Result<Camera, Fault> {
    let number = |key: &str, value: f64, range| within(&["cameras", name, key], value, range);
    let place = match ground {
        Ground::Planet => {
            let kind = "a camera over the earth";
            absent(&["cameras", name, "east_m"], &file.east_m, kind)?;
            absent(&["cameras", name, "north_m"], &file.north_m, kind)?;
            let latitude_deg = needed(&["cameras", name, "latitude_deg"], file.latitude_deg, kind)?;
            let longitude_deg = needed(&["cameras", name, "longitude_deg"], file.longitude_deg, kind)?;
            Place::Planet {
                latitude_deg: number("latitude_deg", latitude_deg, -90.0..=90.0)?,
                longitude_deg: number("longitude_deg", longitude_deg, -360.0..=360.0)?,
            }
        }
        Ground::Plane => {
            let kind = "a camera over a plane";
            absent(&["cameras", name, "latitude_deg"], &file.latitude_deg, kind)?;
            absent(&["cameras", name, "longitude_deg"], &file.longitude_deg, kind)?;
            let east_m = needed(&["cameras", name, "east_m"], file.east_m, kind)?;
            let north_m = needed(&["cameras", name, "north_m"], file.north_m, kind)?;
            Place::Plane {
                east_m: number("east_m", east_m, -1e9..=1e9)?,
                north_m: number("north_m", north_m, -1e9..=1e9)?,
            }
        }
    };
    Ok(Camera {
        place,
        altitude_m: number("altitude_m", file.altitude_m, ALTITUDES_M)?,
        heading_deg: number("heading_deg", file.heading_deg, -360.0..=360.0)?,
        tilt_deg: number("tilt_deg", file.tilt_deg, 0.0..=180.0)?,
        // Above 178 the near plane would cut into the ground at the picture's corners.
        vertical_fov_deg: number("vertical_fov_deg", file.vertical_fov_deg, 1e-3..=170.0)?,
        magnification: number("magnification", file.magnification, 1.0..=1e6)?,
    })
}

const ALTITUDES_M: RangeInclusive<f64> = 1e-3..=1e9;

fn check_path(name: &str, file: &PathFile, cameras: &BTreeMap<String, Camera>) -> Result<path::Path, Fault> {
    let key = |key| ["paths", name, key];
    let find = |key: &[&str], camera: &str| {
        cameras.get(camera).copied().ok_or_else(|| {
            Fault::new(key, format!("no camera {camera:?}; there are {}", list(cameras.keys())))
        })
    };
    let kind = match file.kind {
        PathKind::Orbit => "an orbit",
        PathKind::Pan => "a pan",
        PathKind::Dive => "a dive",
        PathKind::Teleport => "a teleport",
    };
    let number = |name: &'static str, value: Option<f64>, wanted: bool, range| {
        if wanted {
            within(&key(name), needed(&key(name), value, kind)?, range)
        } else {
            absent(&key(name), &value, kind).map(|()| 0.0)
        }
    };
    let is = |wanted: &[PathKind]| wanted.iter().any(|wanted| *wanted as u8 == file.kind as u8);
    let degrees = number("degrees", file.degrees, is(&[PathKind::Orbit]), -36_000.0..=36_000.0)?;
    let heading_deg = number("heading_deg", file.heading_deg, is(&[PathKind::Pan]), -360.0..=360.0)?;
    let distance_m = number("distance_m", file.distance_m, is(&[PathKind::Pan]), -1e9..=1e9)?;
    let to_altitude_m = number("to_altitude_m", file.to_altitude_m, is(&[PathKind::Dive]), ALTITUDES_M)?;
    let start = || {
        absent(&key("cameras"), &file.cameras, kind)?;
        find(&key("camera"), needed(&key("camera"), file.camera.as_deref(), kind)?)
    };
    let motion = match file.kind {
        PathKind::Orbit => Motion::Orbit { start: start()?, degrees },
        PathKind::Pan => Motion::Pan { start: start()?, heading_deg, distance_m },
        PathKind::Dive => Motion::Dive { start: start()?, to_altitude_m },
        PathKind::Teleport => {
            absent(&key("camera"), &file.camera, kind)?;
            let stops = needed(&key("cameras"), file.cameras.as_ref(), kind)?;
            if stops.is_empty() {
                return Err(Fault::new(&key("cameras"), "a teleport needs at least one camera"));
            }
            let stops = stops.iter().map(|stop| find(&key("cameras"), stop)).collect::<Result<_, _>>()?;
            Motion::Teleport { stops }
        }
    };
    let frames = within(&key("frames"), file.frames, 1..=1_000_000)?;
    let path = path::Path { frames, motion };
    path.check().map_err(|error| Fault::new(&key("camera"), error.to_string()))?;
    Ok(path)
}

fn check_view(
    view: &View,
    cameras: &BTreeMap<String, Camera>,
    paths: &BTreeMap<String, path::Path>,
) -> Result<(), Fault> {
    within(&["view", "width"], view.width, 1..=16_384)?;
    within(&["view", "height"], view.height, 1..=16_384)?;
    if !cameras.contains_key(&view.camera) {
        let what = format!("no camera {:?}; there are {}", view.camera, list(cameras.keys()));
        return Err(Fault::new(&["view", "camera"], what));
    }
    match &view.path {
        Some(path) if !paths.contains_key(path) => {
            let what = format!("no path {path:?}; there are {}", list(paths.keys()));
            Err(Fault::new(&["view", "path"], what))
        }
        _ => Ok(()),
    }
}

fn check_cache(cache: &Cache) -> Result<(), Fault> {
    within(&["cache", "gpu_tiles"], cache.gpu_tiles, 1..=1 << 16)?;
    within(&["cache", "host_tiles"], cache.host_tiles, 1..=1 << 20)?;
    within(&["cache", "upload_budget_ms"], cache.upload_budget_ms, 1e-3..=1e6)?;
    within(&["cache", "load_budget_ms"], cache.load_budget_ms, 1e-3..=1e6)?;
    within(&["cache", "upload_tiles_per_frame"], cache.upload_tiles_per_frame, 1..=1 << 16)?;
    within(&["cache", "load_tiles_per_frame"], cache.load_tiles_per_frame, 1..=1 << 16)?;
    within(&["cache", "fade_in_frames"], cache.fade_in_frames, 0..=1000)?;
    within(&["cache", "prefetch_frames"], cache.prefetch_frames, 0..=1000)?;
    within(&["cache", "retry_after_ms"], cache.retry_after_ms, 0.0..=1e9)?;
    Ok(())
}

fn check_disk(disk: &Disk) -> Result<(), Fault> {
    // A minute is as long as a frame waits for anything at all.
    within(&["disk", "delay_ms"], disk.delay_ms, 0.0..=60e3)?;
    within(&["disk", "fails_from_s"], disk.fails_from_s, 0.0..=1e6)?;
    within(&["disk", "fails_for_s"], disk.fails_for_s, 0.0..=1e6)?;
    within(&["disk", "fails_share"], disk.fails_share, 0.0..=1.0)?;
    Ok(())
}

fn check_variant(variant: &Variant) -> Result<(), Fault> {
    within(&["variant", "feedback_log2"], variant.feedback_log2, 0..=8)?;
    within(&["variant", "block_log2"], variant.block_log2, 0..=4)?;
    within(&["variant", "compact_block_log2"], variant.compact_block_log2, 0..=2)?;
    within(&["variant", "max_anisotropy"], variant.max_anisotropy, 1..=16)?;
    within(&["variant", "samples"], variant.samples, 1..=64)?;
    within(&["variant", "level_bias"], variant.level_bias, 0..=20)?;
    within(&["variant", "list_capacity"], variant.list_capacity, 1..=1 << 26)?;
    let appends = variant.list == Listing::Device && variant.compact == Compaction::FusedAppend;
    if appends && !variant.dedup.fused() {
        return Err(Fault::new(&["variant", "compact"], Compaction::FUSED_APPEND_ALONE));
    }
    Ok(())
}
