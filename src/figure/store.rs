//! A run's folder. Each cell has a file in `cells/FIGURE/`, written atomically, so a run may be killed at
//! any moment. Pictures are in `pictures/` and are written before the cell that names them.

use super::{Cell, Effort, Figure, Machine, Row, Value, json};
use crate::file::{self, MAX_RESULTS_BYTES};
use crate::header::{JsonFormat, WrongFormat};
use crate::picture::write::{FileError, write_bytes};
use serde::{Deserialize, Serialize};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// `cells/FIGURE/SCENE.json`. The first files had no header.
const FORMAT: JsonFormat = JsonFormat::new("ortelius-cell", 1);

/// The stored measurement of one cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellResult {
    pub figure: String,
    #[serde(flatten)]
    pub cell: Cell,
    pub effort: Effort,
    pub machine: Machine,
    /// The build that measured the cell ([`super::program`]).
    #[serde(default)]
    pub program: String,
    pub seconds: f64,
    /// Files in `pictures/`.
    pub pictures: Vec<String>,
    #[serde(flatten)]
    pub outcome: CellOutcome,
}

/// How the measurement of a cell ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CellOutcome {
    Rows(Vec<Row>),
    /// Why this run leaves the scene out ([`LeftOut`]).
    #[serde(rename = "left-out")]
    LeftOut(String),
    /// The error message.
    Failed(String),
    /// How the process died while measuring. A resumed run does not measure the cell again.
    Crashed(String),
    /// Not measured yet, or measured elsewhere.
    Absent,
}

/// The error of [`Figure::measure`] for a scene that this run leaves out. The text is the reason: the scene's model is
/// not fetched.
#[derive(Debug, Error)]
#[error("{0}")]
pub struct LeftOut(pub String);

impl CellOutcome {
    /// The rows of a figure, or why they cannot be used.
    pub(super) fn of(measured: anyhow::Result<Vec<Row>>) -> (CellOutcome, Option<anyhow::Error>) {
        match measured {
            Ok(rows) => (CellOutcome::of_rows(rows), None),
            Err(error) => match error.downcast::<LeftOut>() {
                Ok(LeftOut(why)) => (CellOutcome::LeftOut(why), None),
                // The message includes its causes, on one line.
                Err(error) => (CellOutcome::Failed(format!("{error:#}").replace('\n', "; ")), Some(error)),
            },
        }
    }

    /// Failed if a repeated measurement or a series is not finite, or if a row occurs twice.
    fn of_rows(rows: Vec<Row>) -> CellOutcome {
        for (at, row) in rows.iter().enumerate() {
            let name = format!("{}, {}", row.variant, row.quantity);
            let finite = match &row.value {
                Value::Summary(s) => [s.min, s.p5, s.median, s.p95, s.max].iter().all(|v| v.is_finite()),
                Value::Series(points) => points.iter().flatten().all(|v| v.is_finite()),
                Value::Spreads(points) => {
                    points.iter().all(|(x, s)| [*x, s.min, s.max].iter().all(|v| v.is_finite()))
                }
                Value::Number(_) | Value::Text(_) | Value::Missing(_) => true,
            };
            if !finite {
                return CellOutcome::Failed(format!("{name}: not finite: {:?}", row.value));
            }
            let same = |other: &&Row| other.variant == row.variant && other.quantity == row.quantity;
            if rows[..at].iter().any(|other| same(&other)) {
                return CellOutcome::Failed(format!("{name}: measured twice in one cell"));
            }
        }
        CellOutcome::Rows(rows)
    }
}

/// A folder that cannot be read or written.
#[derive(Debug, Error)]
pub enum StoreError {
    #[error("{path}: {source}")]
    Folder { path: String, source: std::io::Error },
    #[error(
        "{path}: not a result of this program ({what}); remove the file and measure the cell again with --resume"
    )]
    Damaged { path: String, what: String },
    #[error("{path}: {error}; name another folder with -o, or use the program that wrote it")]
    Format { path: String, error: WrongFormat },
    #[error("{folder}: another run is writing to it; wait until it ends, or name another folder with -o")]
    Busy { folder: String },
    #[error(transparent)]
    Write(#[from] FileError),
}

/// Excludes other runs from a folder: two runs would disturb each other's times and mix their cells.
/// Released when the process ends.
pub struct Lock(#[expect(dead_code)] File);

/// The folder of a run.
pub struct Store {
    folder: PathBuf,
}

impl Store {
    /// Creates missing folders.
    ///
    /// # Errors
    /// [`StoreError::Folder`].
    pub fn create(folder: &Path) -> Result<Store, StoreError> {
        let store = Store { folder: folder.to_path_buf() };
        for path in [store.cells(), store.pictures()] {
            std::fs::create_dir_all(&path)
                .map_err(|source| StoreError::Folder { path: path.display().to_string(), source })?;
        }
        Ok(store)
    }

    /// # Errors
    /// [`StoreError::Busy`] while another process holds the lock; I/O errors.
    pub fn lock(&self) -> Result<Lock, StoreError> {
        let path = self.cells().join("lock");
        let folder = |source| StoreError::Folder { path: path.display().to_string(), source };
        let file = File::create(&path).map_err(folder)?;
        match file.try_lock() {
            Ok(()) => Ok(Lock(file)),
            Err(TryLockError::WouldBlock) => {
                Err(StoreError::Busy { folder: self.folder.display().to_string() })
            }
            Err(TryLockError::Error(source)) => Err(folder(source)),
        }
    }

    /// An existing folder; creates nothing.
    pub fn at(folder: &Path) -> Store {
        Store { folder: folder.to_path_buf() }
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn cells(&self) -> PathBuf {
        self.folder.join("cells")
    }

    pub fn pictures(&self) -> PathBuf {
        self.folder.join("pictures")
    }

    /// `cells/vt.dedup/earth-oblique@3.json`
    fn file(&self, figure: &str, cell: &Cell) -> PathBuf {
        let scene: String =
            cell.scene.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
        let x = cell.x.map(|x| format!("@{x}")).unwrap_or_default();
        self.cells().join(figure).join(format!("{scene}{x}.json"))
    }

    /// # Errors
    /// I/O errors. No partial file is left.
    pub fn put(&self, result: &CellResult) -> Result<(), StoreError> {
        let path = self.file(&result.figure, &result.cell);
        let folder = path.parent().expect("a cell's file lies in its figure's folder");
        std::fs::create_dir_all(folder)
            .map_err(|source| StoreError::Folder { path: folder.display().to_string(), source })?;
        let text = json::text(&FORMAT.head(result), 2);
        Ok(write_bytes(&path, &text)?)
    }

    /// `cells/under-way.json` exists while a cell is measured.
    fn under_way_file(&self) -> PathBuf {
        self.cells().join("under-way.json")
    }

    /// Records that measuring cell `number` of a run starts; `result` has no outcome yet.
    ///
    /// # Errors
    /// I/O errors.
    pub(super) fn begin(&self, number: usize, result: &CellResult) -> Result<(), StoreError> {
        let text = json::text(&(number, result), 2);
        Ok(write_bytes(&self.under_way_file(), &text)?)
    }

    /// The cell that was being measured when the process ended, with its number in the run.
    ///
    /// # Errors
    /// The file cannot be read or has another format.
    pub(super) fn under_way(&self) -> Result<Option<(usize, CellResult)>, StoreError> {
        use std::io::ErrorKind::{NotADirectory, NotFound};
        let path = self.under_way_file();
        let shown = || path.display().to_string();
        match file::read_text(&path, MAX_RESULTS_BYTES) {
            Ok(text) => serde_json::from_str(&text)
                .map(Some)
                .map_err(|error| StoreError::Damaged { path: shown(), what: error.to_string() }),
            Err(error) if [NotADirectory, NotFound].contains(&error.kind()) => Ok(None),
            Err(source) => Err(StoreError::Folder { path: shown(), source }),
        }
    }

    /// Records that no cell is being measured.
    ///
    /// # Errors
    /// I/O errors. A missing file or folder is no error.
    pub(super) fn end(&self) -> Result<(), StoreError> {
        use std::io::ErrorKind::{NotADirectory, NotFound};
        let path = self.under_way_file();
        match std::fs::remove_file(&path) {
            Err(source) if ![NotFound, NotADirectory].contains(&source.kind()) => {
                Err(StoreError::Folder { path: path.display().to_string(), source })
            }
            _ => Ok(()),
        }
    }

    /// A cell's stored result.
    ///
    /// # Errors
    /// The file cannot be read, or is not a result of this cell.
    pub fn get(&self, figure: &str, cell: &Cell) -> Result<Option<CellResult>, StoreError> {
        let path = self.file(figure, cell);
        let shown = || path.display().to_string();
        let text = match file::read_text(&path, MAX_RESULTS_BYTES) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(StoreError::Folder { path: shown(), source }),
        };
        let damaged = |what: String| StoreError::Damaged { path: shown(), what };
        FORMAT.check(&text).map_err(|error| match error {
            WrongFormat::Other { .. } => StoreError::Format { path: shown(), error },
            WrongFormat::Json(error) => damaged(error.to_string()),
        })?;
        let result: CellResult = serde_json::from_str(&text).map_err(|error| damaged(error.to_string()))?;
        if result.figure != figure || result.cell != *cell {
            let what = format!("it belongs to {} {}", result.figure, result.cell);
            return Err(damaged(what));
        }
        Ok(Some(result))
    }

    /// All stored results of `figures`, in their order, for any effort.
    ///
    /// # Errors
    /// As [`Store::get`].
    pub fn all(&self, figures: &[&Figure]) -> Result<Vec<CellResult>, StoreError> {
        let mut found = Vec::new();
        for figure in figures {
            let mut cells = figure.cells(Effort::Quick);
            let full = figure.cells(Effort::Full);
            cells.extend(full.into_iter().filter(|cell| !figure.cells(Effort::Quick).contains(cell)));
            for cell in cells {
                found.extend(self.get(figure.id, &cell)?);
            }
        }
        Ok(found)
    }
}
