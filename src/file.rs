//! Input files. Only regular files are opened: a FIFO would block, and a device has no end.

use std::fs::{File, OpenOptions};
use std::io::{self, Read};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

/// Largest accepted file of results, Pareto fronts or bookmarks. The largest results of all figures have 2 MB.
pub const MAX_RESULTS_BYTES: u64 = 256 << 20;

/// A folder for files that the program can make again: `ortelius/NAME` below `XDG_CACHE_HOME`, else below
/// `HOME/.cache`. The variable `ORTELIUS_CACHE` names another folder instead of `ortelius`; if the variable is set but
/// empty, nothing is kept.
pub fn cache_folder(name: &str) -> Option<PathBuf> {
    let variable = |name| std::env::var_os(name).map(PathBuf::from);
    let absolute = |name| variable(name).filter(|path| path.is_absolute());
    let own = variable("ORTELIUS_CACHE").or_else(|| {
        let cache = absolute("XDG_CACHE_HOME").or_else(|| Some(absolute("HOME")?.join(".cache")))?;
        Some(cache.join("ortelius"))
    })?;
    (!own.as_os_str().is_empty()).then(|| own.join(name))
}

/// Opens a regular file for reading. The check is on the open file, so the file cannot be replaced between check
/// and reading. Opening never waits for the other end of a FIFO.
///
/// # Errors
/// I/O errors, and anything that is not a regular file.
pub fn open(path: &Path) -> io::Result<File> {
    let file = OpenOptions::new().read(true).custom_flags(libc::O_NONBLOCK).open(path)?;
    match file.metadata()?.is_file() {
        true => Ok(file),
        false => Err(io::Error::other("it is not a regular file")),
    }
}

/// Reads a regular file of at most `max` bytes.
///
/// # Errors
/// As [`open`], and a file longer than `max`.
pub fn read(path: &Path, max: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.take(max + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 <= max {
        true => Ok(bytes),
        false => Err(io::Error::other(format!("it has more than {max} bytes"))),
    }
}

/// Like [`read`], for UTF-8 text.
///
/// # Errors
/// As [`read`], and invalid UTF-8.
pub fn read_text(path: &Path, max: u64) -> io::Result<String> {
    String::from_utf8(read(path, max)?).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::fd::AsRawFd;

    #[test]
    fn only_regular_files_up_to_the_limit_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("text");
        std::fs::write(&path, "four").unwrap();
        assert_eq!(read_text(&path, 4).unwrap(), "four");
        assert_eq!(read(&path, 3).unwrap_err().to_string(), "it has more than 3 bytes");
        // The other end never writes, so reading the pipe would wait for ever.
        let (pipe, _other_end) = io::pipe().unwrap();
        let pipe = format!("/proc/self/fd/{}", pipe.as_raw_fd());
        for other in [folder.path(), Path::new("/dev/null"), Path::new(&pipe)] {
            let refused = open(other).unwrap_err().to_string();
            assert_eq!(refused, "it is not a regular file", "{}", other.display());
        }
    }
}
