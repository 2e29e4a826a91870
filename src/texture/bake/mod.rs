//! Baking converts a picture, or a synthetic source, to a `.tiles` file.
//!
//! 1. *bands*: level 0 (the picture, enlarged to powers of two; `resample`) goes into a scratch file by
//!    bands of rows;
//! 2. *levels*: each coarser texel is the mean, in linear light, of the four stored 8-bit texels of the next finer
//!    level. This also holds in the resident levels, so anyone can check it from the finished file;
//! 3. *tiles*: each stored tile (border, second picture) is put together from the scratch file, encoded, and
//!    written at its fixed place in OUT.partial;
//! 4. index and header, fsync, rename, fsync of the folder; scratch and journal are deleted.
//!
//! Synthetic sources need only steps 3 and 4. A `journal` records every finished job; after a kill, the same
//! command does the missing jobs. The output depends only on source and settings: neither kills nor the number of
//! threads change a byte.

mod encode;
mod error;
mod input;
mod journal;
mod plan;
mod resample;
mod resume;
mod scratch;
mod source;
mod work;

pub use encode::{bc1 as encode_bc1, bc1_tile as encode_bc1_tile};
pub use error::{BakeError, SourceError};
pub use input::open as open_picture;
pub use plan::BakePlan;
pub use source::SourceName;

use crate::texture::source::TileFormat;
use source::Source;
use std::path::{Path, PathBuf};

/// Source, output and parameters of a bake.
#[derive(Clone, Debug)]
pub struct BakeSettings {
    pub source: SourceName,
    pub output: PathBuf,
    /// Texels, a power of two in 16 ..= 1024.
    pub tile_side: u32,
    /// Texels; a multiple of 4 for BC1.
    pub border_texels: u32,
    pub format: TileFormat,
    /// Number of coarsest levels that are always in video memory (the paper's L'). `None` selects the smallest
    /// possible number.
    pub resident_levels: Option<u32>,
    /// Replaces an existing output and discards unfinished work of another bake. Unfinished work of the same
    /// source and settings is still resumed, because the result is the same.
    pub force: bool,
}

/// Receives the progress of a bake, from several threads.
pub trait BakeProgress: Sync {
    /// A phase begins: its name, and its total work in bytes.
    fn begin(&self, phase: &'static str, total_bytes: u64);
    /// More bytes are done.
    fn advance(&self, bytes: u64);
}

/// Shows no progress.
impl BakeProgress for () {
    fn begin(&self, _phase: &'static str, _total_bytes: u64) {}
    fn advance(&self, _bytes: u64) {}
}

/// Opens the source and computes the cost of a bake. Writes nothing.
///
/// # Errors
/// [`BakeError`]: the source is not usable, or the settings do not fit it.
pub fn plan(settings: &BakeSettings) -> Result<BakePlan, BakeError> {
    BakePlan::new(settings, &Source::open(&settings.source)?)
}

/// Bakes, or resumes an interrupted bake.
///
/// # Errors
/// [`BakeError`]. After a damaged source nothing remains. After a full disk or a kill, OUT.partial,
/// OUT.scratch and OUT.journal remain, and the same call resumes.
pub fn bake(settings: &BakeSettings, progress: &dyn BakeProgress) -> Result<BakePlan, BakeError> {
    let source = Source::open(&settings.source)?;
    let plan = BakePlan::new(settings, &source)?;
    let files = Files::of(&settings.output)?;
    work::run(settings, &plan, source, &files, progress)?;
    Ok(plan)
}

/// The output, and the temporary files beside it.
struct Files {
    output: PathBuf,
    partial: PathBuf,
    scratch: PathBuf,
    journal: PathBuf,
    folder: PathBuf,
}

impl Files {
    fn of(output: &Path) -> Result<Self, BakeError> {
        let refused = |reason: &str| BakeError::Output { path: output.to_path_buf(), reason: reason.into() };
        let Some(name) = output.file_name() else {
            return Err(refused("it is not a file name"));
        };
        if output.is_dir() {
            return Err(refused("it is a folder"));
        }
        // The rename would replace a link, a device or a pipe instead of its target.
        if output.is_symlink() {
            return match output.canonicalize() {
                Ok(place) => Files::of(&place),
                Err(_) => Err(refused("it is a dangling link")),
            };
        }
        if output.exists() && !output.is_file() {
            return Err(refused("it is not a regular file; choose another name"));
        }
        let folder = match output.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
            _ => PathBuf::from("."),
        };
        if !folder.is_dir() {
            return Err(refused("its folder does not exist; create it first"));
        }
        let beside = |suffix: &str| {
            let mut name = name.to_os_string();
            name.push(suffix);
            folder.join(name)
        };
        Ok(Self {
            output: output.to_path_buf(),
            partial: beside(".partial"),
            scratch: beside(".scratch"),
            journal: beside(".journal"),
            folder,
        })
    }
}
