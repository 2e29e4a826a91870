//! Opens a model from a file or by name.

use super::error::{FilePosition, ModelError, ModelFault};
use super::names::wrong_size;
use super::raw::{MAX_ITEMS, Raw};
use super::{FETCHED, MeshReport, Model, NAMES, clean, fetched, glb, named, obj, ply};
use crate::file;
use flate2::read::MultiGzDecoder;
use std::io::Read;
use std::path::Path;

/// Files are read whole: a scan of 20 million faces takes about 1 GiB.
const MAX_BYTES: u64 = 2 << 30;
/// Limits for compressed files. Scans compress to about a quarter. A file is refused if it unpacks to more than 64
/// times its size and more than `FEWEST_UNPACKED_BYTES`, or to more than `MAX_BYTES`.
const FEWEST_UNPACKED_BYTES: u64 = 64 << 20;
const MAX_PACKING: u64 = 64;

impl Model {
    /// Opens a generated or downloaded model by its name in [`NAMES`] or [`FETCHED`]; [`named`] explains sizes
    /// after a name. Anything else is the path of a file; `./bunny` is the file `bunny`.
    ///
    /// # Errors
    /// As [`Self::load`]; [`ModelError::Size`] for an unsupported size of a generated model;
    /// [`ModelError::NotFetched`] for a name that has not been fetched; [`ModelError::Unknown`] lists the names.
    pub fn open(name_or_path: &str) -> Result<(Model, MeshReport), ModelError> {
        if let Some(model) = named(name_or_path) {
            let mut report = MeshReport {
                vertices: model.wedge_positions.len(),
                file_faces: model.faces.len(),
                ..MeshReport::default()
            };
            report.count(&model);
            return Ok((model, report));
        }
        if FETCHED.iter().any(|file| file.name == name_or_path) {
            let path = fetched(name_or_path);
            return match path {
                Some(path) => Self::load(&path),
                None => Err(ModelError::NotFetched { name: name_or_path.to_owned() }),
            };
        }
        let path = Path::new(name_or_path);
        if let Some(why) = wrong_size(name_or_path).filter(|_| !path.exists()) {
            return Err(ModelError::Size(why));
        }
        // A single word without extension that is not a file was meant as a name.
        if !path.exists() && path.components().count() <= 1 && path.extension().is_none() {
            let names = NAMES.into_iter().chain(FETCHED.iter().map(|file| file.name));
            let names = names.collect::<Vec<_>>().join(", ");
            return Err(ModelError::Unknown { name: name_or_path.to_owned(), names });
        }
        Self::load(path)
    }

    /// Reads and cleans a `.ply`, `.obj` or `.glb` file, optionally compressed as `.gz`. The model has faces.
    ///
    /// # Errors
    /// [`ModelError`]: what cannot be read, and where; also if cleaning removes all faces.
    pub fn load(path: &Path) -> Result<(Model, MeshReport), ModelError> {
        let failed = |source| ModelError::Read { path: path.to_owned(), source };
        // If a file is missing and of unknown type, the type is reported.
        let (_, packed) = kind(path)?;
        let mut file = file::open(path).map_err(failed)?;
        let length = file.metadata().map_err(failed)?.len();
        let mut bytes = Vec::new();
        let (max, what) = if packed {
            let max = (length.saturating_mul(MAX_PACKING)).clamp(FEWEST_UNPACKED_BYTES, MAX_BYTES);
            MultiGzDecoder::new(file).take(max + 1).read_to_end(&mut bytes).map_err(failed)?;
            (max, "unpacks to more")
        } else {
            file.by_ref().take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(failed)?;
            (MAX_BYTES, "has more")
        };
        if bytes.len() as u64 > max {
            return Err(ModelError::Large { path: path.to_owned(), what, max });
        }
        Self::from_bytes(path, &bytes)
    }

    /// Like [`Self::load`], from the file's (unpacked) content. `path` determines the type and appears in errors.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<(Model, MeshReport), ModelError> {
        let (read, _) = kind(path)?;
        let content = |ModelFault { place, what }| ModelError::Content { path: path.to_owned(), place, what };
        let raw = read(bytes).map_err(content)?;
        if raw.positions.len() > MAX_ITEMS {
            return Err(content(ModelFault::whole(format!("more than {MAX_ITEMS} vertices"))));
        }
        let (model, report) = clean(&raw);
        if model.faces.is_empty() {
            let why = if raw.faces.is_empty() {
                "it has no faces".to_owned()
            } else {
                format!("cleaning removed all faces: {}", report.changes().join("; "))
            };
            return Err(ModelError::Content { path: path.to_owned(), place: FilePosition::Whole, what: why });
        }
        Ok((model, report))
    }
}

type Reader = fn(&[u8]) -> Result<Raw, ModelFault>;

/// Reader by file name extension, and whether the file is compressed.
fn kind(path: &Path) -> Result<(Reader, bool), ModelError> {
    let unknown = || ModelError::Kind { path: path.to_owned() };
    let name = path.file_name().and_then(|name| name.to_str()).ok_or_else(unknown)?.to_ascii_lowercase();
    let (name, packed) = match name.strip_suffix(".gz") {
        Some(name) => (name, true),
        None => (name.as_str(), false),
    };
    let readers: [(&str, Reader); 3] = [(".ply", ply::read), (".obj", obj::read), (".glb", glb::read)];
    let reader = readers.into_iter().find(|(ending, _)| name.ends_with(ending));
    reader.map(|(_, reader)| (reader, packed)).ok_or_else(unknown)
}
