//! What `mesh build --report` writes.

use ortelius::figure::most_memory;
use ortelius::header::JsonFormat;
use ortelius::model;
use ortelius::paper::progressive_mesh::file::Contents;
use ortelius::paper::progressive_mesh::simplify;
use ortelius::picture::write::{FileError, write_whole};
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

const FORMAT: JsonFormat = JsonFormat::new("ortelius-mesh-build", 1);

/// All of a build: what was done to the model, what was reached, and what it took.
#[derive(Serialize)]
pub struct BuildReport<'a> {
    cleaning: &'a model::Report,
    simplifying: &'a simplify::Report,
    levels: u32,
    file_bytes: u64,
    milliseconds: Steps,
    /// That this process had resident at once; none where the system does not tell.
    most_memory_bytes: Option<u64>,
}

/// Times of a build's steps, in milliseconds.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Steps {
    load_and_clean: f64,
    simplify: f64,
    order: f64,
    write: f64,
}

/// A clock that tells one step after the other.
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
    /// In their order.
    pub fn of([load_and_clean, simplify, order, write]: [f64; 4]) -> Steps {
        Steps { load_and_clean, simplify, order, write }
    }
}

impl<'a> BuildReport<'a> {
    /// At the end of a build, when it has taken all the memory that it takes.
    pub fn new(
        cleaning: &'a model::Report,
        simplifying: &'a simplify::Report,
        contents: &Contents,
        milliseconds: Steps,
    ) -> Self {
        BuildReport {
            cleaning,
            simplifying,
            levels: contents.whole.levels,
            file_bytes: contents.bytes,
            milliseconds,
            most_memory_bytes: most_memory(),
        }
    }

    /// # Errors
    /// [`FileError`] names the path.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        write_whole(path, |out| {
            serde_json::to_writer_pretty(&mut *out, &FORMAT.head(self))?;
            writeln!(out)
        })
    }
}
