//! Chooses the filter of a surface with `filter = "auto"`, or the method of its relief. The surface's bound selects the
//! setting from the Pareto front of time and error, measured on this device. The front is kept in the user's cache
//! folder, one file for a scene, size and pose. The front is measured again on another device, with another driver, by
//! another commit of the program, and after a file that the scene names has changed.

use super::sections::LANGUAGES;
use super::trade;
use crate::figure::{Bench, Effort, Machine, TimedSetting, Trade};
use crate::file;
use crate::math::camera::Pose;
use crate::paper::texture_mapping::config::ReliefKeys;
use crate::paper::virtual_texture::config::owner;
use crate::paper::virtual_texture::trade::{ErrorMeasure, Knob, TradeKernel, TradeSweep};
use crate::picture::write::write_bytes;
use crate::scene::{FilterBound, Scene, SceneError};
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use xxhash_rust::xxh3::xxh3_64;

/// What is rendered, and where fronts are kept.
pub struct Place<'a> {
    pub pose: Pose,
    /// Pixels.
    pub size: [u32; 2],
    /// Part of a device's name, or its index.
    pub device: Option<&'a str>,
    /// `None`: the front is not kept.
    pub cache: Option<PathBuf>,
}

/// A scene whose filter was chosen.
pub struct Chosen {
    /// The scene, with the filter or the relief's method in place of `"auto"`.
    pub scene: Scene,
    /// Which filter was chosen, and from which front.
    pub words: String,
}

/// Limit of a front's file in bytes; larger than any front.
const MAX_BYTES: u64 = 1 << 24;

/// The surface whose filter is `"auto"`, and its bound.
pub fn wanted(scene: &Scene) -> Option<(&str, FilterBound)> {
    scene.surfaces.values().find_map(|surface| Some((&*surface.name, surface.auto?)))
}

/// Replaces the filter `"auto"` of [`wanted`]. If no front is kept, the front is measured. `progress` receives the
/// number of measured settings and the number of all settings.
///
/// # Errors
/// No filter of the front satisfies the bound, or [`TradeSweep::run`] fails.
pub fn choose(
    scene: &Scene,
    (surface, bound): (&str, FilterBound),
    place: &Place<'_>,
    progress: impl Fn(usize, usize),
) -> anyhow::Result<Chosen> {
    let relief = ["surface", surface, "relief"];
    let base = scene.with(&[match scene.has(&relief) {
        true => {
            let keys: ReliefKeys = scene.read(&relief)?;
            format!("surface.{surface}.relief.method={}", keys.method.name())
        }
        // The sweep starts from one sample per pixel, which works with every border.
        false => format!("surface.{surface}.filter={{max_anisotropy=1}}"),
    }])?;
    let bench = Bench::new(Effort::Quick, place.device.map(str::to_owned), PathBuf::new());
    let machine = Machine::here(bench.gpu(&[])?.physical());
    let kept = place.cache.as_ref().map(|folder| folder.join(file_name(&base, place)));
    let (front, from) = match kept.as_deref().and_then(|path| read(path, &machine)) {
        Some(front) => (front, "measured before"),
        None => {
            tracing::info!("surface.{surface}.filter: measuring filters on {}", machine.device);
            let Place { pose, size, .. } = *place;
            let sweep = TradeSweep {
                scene: &base,
                pose,
                size,
                knobs: &Knob::OF_FILTER,
                measure: ErrorMeasure::Nmse,
                kernel: TradeKernel::Gaussian,
            };
            let front = match owner(&base)? {
                Some(_) => sweep.run(&bench, progress)?,
                None => trade::run(&sweep, Some(surface), &bench, progress)?,
            };
            kept.iter().for_each(|path| keep(path, &front));
            (front, "measured now")
        }
    };
    let found = select(scene, surface, bound, &front)?;
    let words = format!("surface.{surface}.filter: {}, {from}", describe(found));
    Ok(Chosen { scene: base.with(&found.changes)?, words })
}

/// The setting of the front that satisfies the bound best.
///
/// # Errors
/// [`SceneError`] at the bound if no setting satisfies the bound.
fn select<'a>(
    scene: &Scene,
    surface: &str,
    bound: FilterBound,
    front: &'a Trade,
) -> Result<&'a TimedSetting, SceneError> {
    let members = front.front();
    let (found, key, nearest) = match bound {
        FilterBound::MaxError(error) => (front.cheapest(error), "max_error", members.first()),
        FilterBound::MaxMs(ms) => (front.most_accurate(ms), "max_ms", members.last()),
    };
    found.ok_or_else(|| {
        let nearest = nearest.map_or_else(String::new, |nearest| describe(nearest));
        scene.fault(
            &["surface", surface, key],
            format!("no filter satisfies this bound; the nearest is {nearest}"),
        )
    })
}

fn describe(setting: &TimedSetting) -> String {
    format!("{} ({:.2} ms, NMSE {:.2e})", setting.name, setting.ms.median, setting.error)
}

/// The file's name: a hash of the scene, the files that it names, the pose and the size. [`read`] compares the machine.
fn file_name(base: &Scene, Place { pose, size, .. }: &Place<'_>) -> String {
    let (folder, text) = base.to_parts(LANGUAGES);
    let mut files = Vec::new();
    let document: toml::Table = text.parse().expect("a scene is TOML");
    document.values().for_each(|value| collect_files(value, &folder, &mut files));
    format!("{:016x}.json", xxh3_64(format!("{folder:?} {pose:?} {size:?} {files:?} {text}").as_bytes()))
}

/// Collects length and time of the last change of each file that a value names: another file of the same name needs
/// another front.
fn collect_files(value: &toml::Value, folder: &Path, files: &mut Vec<(u64, Option<SystemTime>)>) {
    match value {
        toml::Value::String(name) => {
            let found = std::fs::metadata(folder.join(name)).ok().filter(|found| found.is_file());
            files.extend(found.map(|found| (found.len(), found.modified().ok())));
        }
        toml::Value::Table(table) => table.values().for_each(|value| collect_files(value, folder, files)),
        toml::Value::Array(values) => values.iter().for_each(|value| collect_files(value, folder, files)),
        _ => {}
    }
}

/// A kept front of the same machine and program.
fn read(path: &Path, machine: &Machine) -> Option<Trade> {
    let front = Trade::parse(&file::read_text(path, MAX_BYTES).ok()?).ok()?;
    machine.is_same(&front.machine).then_some(front)
}

/// A front that cannot be kept is measured again next time.
fn keep(path: &Path, front: &Trade) {
    let folder = path.parent().expect("a file in the cache folder");
    let written = std::fs::create_dir_all(folder)
        .map_err(anyhow::Error::from)
        .and_then(|()| Ok(write_bytes(path, front.json())?));
    if let Err(error) = written {
        tracing::warn!("the measured filters are not kept: {error}");
    }
}
