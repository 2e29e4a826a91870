//! `--records`: a header, and one line of JSON for each frame, written as soon as the frame has ended. If a run is
//! stopped, the lines of its finished frames remain.

use anyhow::Context;
use ortelius::frame::Records;
use ortelius::header::JsonFormat;
use ortelius::renderer::Record;
use ortelius::renderer::report::FrameReport;
use serde::Serialize;
use serde_json::json;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The format in the first line. The other lines are entries of the report's `frames`.
const FORMAT: JsonFormat = JsonFormat::new("ortelius-records", 1);

/// A file of JSON Lines.
pub struct Lines {
    path: PathBuf,
    /// The first error stops the writing.
    file: Arc<Mutex<io::Result<File>>>,
}

impl Lines {
    /// # Errors
    /// I/O errors, with the path.
    pub fn create(path: &Path) -> anyhow::Result<Lines> {
        let named = || path.display().to_string();
        let mut file = File::create(path).with_context(named)?;
        line(&FORMAT.head(json!({}))).and_then(|line| file.write_all(&line)).with_context(named)?;
        Ok(Lines { path: path.to_owned(), file: Arc::new(Mutex::new(Ok(file))) })
    }

    /// Returns `records`, extended so that each record is also written to the file.
    pub fn tap(&self, records: Records<Record>) -> Records<Record> {
        let file = self.file.clone();
        records.with_tap(move |record| {
            let mut file = lock(&file);
            let written = match &mut *file {
                Ok(file) => line(&FrameReport::from(record)).and_then(|line| file.write_all(&line)),
                Err(_) => return,
            };
            if let Err(error) = written {
                *file = Err(error);
            }
        })
    }

    /// # Errors
    /// A write error, with the path.
    pub fn finish(self) -> anyhow::Result<()> {
        let file = std::mem::replace(&mut *lock(&self.file), Err(io::ErrorKind::Other.into()));
        file.map(drop).with_context(|| self.path.display().to_string())
    }
}

/// A panic elsewhere leaves the file usable.
fn lock(file: &Mutex<io::Result<File>>) -> MutexGuard<'_, io::Result<File>> {
    file.lock().unwrap_or_else(PoisonError::into_inner)
}

fn line(content: &impl Serialize) -> io::Result<Vec<u8>> {
    let mut line = serde_json::to_vec(content)?;
    line.push(b'\n');
    Ok(line)
}
