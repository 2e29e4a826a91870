//! The report's `run`: the data needed to render the picture again, on any machine with the same files.

use crate::file;
use crate::header::{JsonFormat, WrongFormat};
use crate::renderer::sections::LANGUAGES;
use crate::scene::{Scene, SceneError};
use serde::{Deserialize, Serialize};
use std::path::Path;
use thiserror::Error;

/// A render report. Version 3 added `run`. Since version 4, memory and passes have names instead of the paper's
/// letters, and the two frames that `plain` compares take one sample per pixel.
pub const FORMAT: JsonFormat =
    JsonFormat { name: "ortelius-render-report", version: 5, oldest: 3, first_name: None };

/// A run of `ortelius render`. File paths are absolute, or relative to `folder`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunSection {
    /// The scene's name.
    pub name: String,
    /// Base folder of relative paths in the scene.
    pub folder: String,
    /// The whole scene as TOML, with its overrides.
    pub scene: String,
    /// The camera or the path that was rendered.
    pub camera: Option<String>,
    pub path: Option<String>,
    /// Number of frames before settling; null: all frames of the path, or 0 without a path.
    pub frames: Option<u32>,
    /// True if frames continue until nothing is missing, even if `frames` is stated.
    pub settle: bool,
    /// True if every frame of the sequence settles before the next.
    #[serde(default)]
    pub settle_each: bool,
    pub deterministic: bool,
    /// Pixels.
    pub size: [u32; 2],
    /// True if the picture was 32-bit linear light (EXR) instead of sRGB bytes.
    pub linear: bool,
}

/// A file that is not a report of a run.
#[derive(Debug, Error)]
pub enum ReportError {
    #[error("{path}: cannot read the report: {source}")]
    Read { path: String, source: std::io::Error },
    #[error("{path}: not a render report: {error}")]
    Format { path: String, error: WrongFormat },
    #[error("{path}: this report cannot be rendered again; another program rendered its frames")]
    NoRun { path: String },
}

/// Upper bound of a report of a million frames.
const MAX_BYTES: u64 = 1 << 32;

impl RunSection {
    /// The settled picture of a scene, from its own camera or along its own path.
    pub fn settled(scene: &Scene) -> RunSection {
        let (folder, text) = scene.to_parts(LANGUAGES);
        let path = scene.view.path.clone();
        RunSection {
            name: scene.name.clone(),
            folder: folder.to_string_lossy().into_owned(),
            scene: text,
            camera: path.is_none().then(|| scene.view.camera.clone()),
            path,
            frames: None,
            settle: false,
            settle_each: false,
            deterministic: false,
            size: [scene.view.width, scene.view.height],
            linear: false,
        }
    }

    /// Reads the run from a report file.
    ///
    /// # Errors
    /// [`ReportError`] names the file.
    pub fn read(path: &Path) -> Result<RunSection, ReportError> {
        #[derive(Deserialize)]
        struct OfReport {
            run: Option<RunSection>,
        }
        let shown = || path.display().to_string();
        let format = |error| ReportError::Format { path: shown(), error };
        let text =
            file::read_text(path, MAX_BYTES).map_err(|source| ReportError::Read { path: shown(), source })?;
        FORMAT.check(&text).map_err(format)?;
        let report: OfReport = serde_json::from_str(&text).map_err(|error| format(error.into()))?;
        report.run.ok_or_else(|| ReportError::NoRun { path: shown() })
    }

    /// The scene of the run. `report` is the file's name, for messages.
    ///
    /// # Errors
    /// [`SceneError`] if this program did not write the text.
    pub fn scene(&self, report: &str) -> Result<Scene, SceneError> {
        let shown = format!("{report}: run.scene");
        Scene::from_parts(&shown, &self.name, Path::new(&self.folder), self.scene.clone())
    }
}
