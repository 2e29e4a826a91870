//! From the text of a scene to a checked [`Scene`].
//!
//! The structs here are the file's own shape: flat tables, so that the parser knows the place of every
//! mistake (serde's tagged enums forget it). What depends on a `kind` is checked afterwards, by key, in `check`.

use super::check::check;
use super::error::{SceneError, list};
use super::overrides::{self, Change};
use super::progressive_mesh::{GovernorSettings, ProgressiveSurfaceFile};
use super::settings::{Cache, Variant, View};
use super::{SHIPPED, Scene};
use crate::texture::source::{TileFormat, disk::Disk};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    pub texture: Option<TextureFile>,
    pub cache: Option<Cache>,
    pub disk: Option<Disk>,
    pub mesh: Option<MeshFile>,
    #[serde(default)]
    pub progressive_mesh: BTreeMap<String, ProgressiveSurfaceFile>,
    pub governor: Option<GovernorSettings>,
    pub view: View,
    pub cameras: BTreeMap<String, CameraFile>,
    #[serde(default)]
    pub paths: BTreeMap<String, PathFile>,
    pub variant: Option<Variant>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum SourceKind {
    Earth,
    Ruler,
    File,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TextureFile {
    pub source: SourceKind,
    pub path: Option<PathBuf>,
    pub width_log2: Option<u32>,
    pub height_log2: Option<u32>,
    #[serde(default = "tile_size")]
    pub tile_size: u32,
    #[serde(default = "border")]
    pub border: u32,
    pub resident_levels: Option<u32>,
    pub format: Option<TileFormat>,
}

fn tile_size() -> u32 {
    512
}

fn border() -> u32 {
    4
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum MeshKind {
    Earth,
    Plane,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MeshFile {
    pub kind: MeshKind,
    pub columns: u32,
    pub rows: u32,
    pub width_m: Option<f64>,
    pub height_m: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CameraFile {
    pub latitude_deg: Option<f64>,
    pub longitude_deg: Option<f64>,
    pub east_m: Option<f64>,
    pub north_m: Option<f64>,
    pub altitude_m: f64,
    #[serde(default)]
    pub heading_deg: f64,
    #[serde(default)]
    pub tilt_deg: f64,
    #[serde(default = "vertical_fov_deg")]
    pub vertical_fov_deg: f64,
    #[serde(default = "magnification")]
    pub magnification: f64,
}

fn vertical_fov_deg() -> f64 {
    60.0
}

fn magnification() -> f64 {
    1.0
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum PathKind {
    Orbit,
    Pan,
    Dive,
    Teleport,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PathFile {
    pub kind: PathKind,
    pub frames: u32,
    pub camera: Option<String>,
    pub cameras: Option<Vec<String>>,
    pub degrees: Option<f64>,
    pub heading_deg: Option<f64>,
    pub distance_m: Option<f64>,
    pub to_altitude_m: Option<f64>,
}

/// The text of a scene and where it came from.
pub(super) struct Document {
    /// For messages.
    path: String,
    name: String,
    folder: PathBuf,
    text: String,
}

impl Document {
    pub fn read(path: &Path) -> Result<Document, SceneError> {
        let shown = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|source| SceneError::Read { path: shown.clone(), source })?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let start = error.utf8_error().valid_up_to();
            let text = String::from_utf8_lossy(error.as_bytes());
            // Everything before `start` is unchanged by the replacement.
            SceneError::at(&shown, &text, start..start, "this byte is not UTF-8, which TOML requires")
        })?;
        Ok(Document::of_text(path, text))
    }

    /// What the file at `path` holds, or would.
    pub fn of_text(path: &Path, text: String) -> Document {
        Document {
            path: path.display().to_string(),
            name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
            text,
        }
    }

    pub fn shipped(name: &str) -> Result<Document, SceneError> {
        let (_, text) = SHIPPED.iter().find(|(shipped, _)| *shipped == name).ok_or_else(|| {
            SceneError::Unknown { name: name.to_owned(), shipped: list(SHIPPED.map(|(name, _)| name)) }
        })?;
        Ok(Document {
            path: format!("scenes/{name}.toml"),
            name: name.to_owned(),
            folder: PathBuf::new(),
            text: (*text).to_owned(),
        })
    }

    /// Parses, applies the changes in order, checks.
    pub fn scene(self, overrides: &[String]) -> Result<Scene, SceneError> {
        let whole = 0..0;
        let mut file: SceneFile = toml::from_str(&self.text).map_err(|error| {
            let span = error.span().unwrap_or(whole.clone());
            SceneError::at(&self.path, &self.text, span, error.message())
        })?;
        let changes = overrides.iter().map(|text| Change::parse(text)).collect::<Result<Vec<_>, _>>()?;
        if !changes.is_empty() {
            let table: toml::Table = toml::from_str(&self.text).map_err(|error| {
                SceneError::at(&self.path, &self.text, error.span().unwrap_or(whole), error.message())
            })?;
            file = overrides::apply(table, &changes)?;
        }
        // What a change names is relative to the working directory.
        let folder = |key: &[&str]| {
            let key: Vec<String> = key.iter().map(|&part| part.to_owned()).collect();
            match changes.iter().any(|change| change.sets(&key)) {
                true => PathBuf::new(),
                false => self.folder.clone(),
            }
        };
        check(file, self.name.clone(), &folder).map_err(|fault| {
            match changes.iter().rfind(|change| change.sets(&fault.key)) {
                Some(change) => SceneError::Override { change: change.text.clone(), what: fault.what },
                None => {
                    let what = format!("{}: {}", fault.key.join("."), fault.what);
                    SceneError::at(&self.path, &self.text, locate(&self.text, &fault.key), &what)
                }
            }
        })
    }
}

/// The bytes of a key's value; of the innermost table around it where the key itself is not in the text.
fn locate(text: &str, key: &[String]) -> Range<usize> {
    // The text has been parsed before, so this cannot fail; if it did, the file's start is a fair place.
    let Ok(root) = toml::de::DeTable::parse(text) else { return 0..0 };
    let mut table = root.get_ref();
    let mut span = 0..0;
    for part in key {
        let Some(value) = table.get(part.as_str()) else { break };
        span = value.span();
        let Some(inner) = value.get_ref().as_table() else { break };
        table = inner;
    }
    span
}
