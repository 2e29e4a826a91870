//! The JSON of `mesh build --report`.

use ortelius::figure::peak_memory;
use ortelius::header::JsonFormat;
use ortelius::model;
use ortelius::paper::progressive_mesh::file::Contents;
use ortelius::paper::progressive_mesh::simplify;
use ortelius::picture::write::{FileError, write_atomically};
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

const FORMAT: JsonFormat = JsonFormat::new("ortelius-mesh-build", 1);

/// A whole build: changes to the model, results, and cost.
#[derive(Serialize)]
pub struct BuildReport<'a> {
    cleaning: &'a model::MeshReport,
    simplifying: &'a simplify::SimplifyReport,
    levels: u32,
    file_bytes: u64,
    milliseconds: Steps,
    /// Peak resident memory of this process; `None` if the system does not report it.
    #[serde(rename = "most_memory_bytes")]
    peak_memory_bytes: Option<u64>,
}

/// Times of the steps of a build, in milliseconds.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Steps {
    load_and_clean: f64,
    simplify: f64,
    /// Until all faces are ordered. The file is encoded at the same time, as far as its levels are final.
    order: f64,
    /// Encoding the rest of the file, and writing it.
    write: f64,
}

/// A stopwatch for consecutive steps.
pub struct Laps(Instant);

impl Laps {
    pub fn start() -> Laps {
        Laps(Instant::now())
    }

    /// Milliseconds since the last call.
    pub fn lap(&mut self) -> f64 {
        let now = Instant::now();
        (now - std::mem::replace(&mut self.0, now)).as_secs_f64() * 1e3
    }
}

impl Steps {
    /// In order of execution.
    pub fn of([load_and_clean, simplify, order, write]: [f64; 4]) -> Steps {
        Steps { load_and_clean, simplify, order, write }
    }
}

impl<'a> BuildReport<'a> {
    /// Call at the end of a build, so that the peak memory is final.
    pub fn new(
        cleaning: &'a model::MeshReport,
        simplifying: &'a simplify::SimplifyReport,
        contents: &Contents,
        milliseconds: Steps,
    ) -> Self {
        BuildReport {
            cleaning,
            simplifying,
            levels: contents.whole.levels,
            file_bytes: contents.bytes,
            milliseconds,
            peak_memory_bytes: peak_memory(),
        }
    }

    /// # Errors
    /// [`FileError`] names the path.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        write_atomically(path, |out| {
            serde_json::to_writer_pretty(&mut *out, &FORMAT.head(self))?;
            writeln!(out)
        })
    }
}
