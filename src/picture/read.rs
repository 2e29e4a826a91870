//! Reads picture files of both formats as linear light.

use super::Picture;
use super::write::{FileError, read_exr, read_png};
use std::io;
use std::path::Path;

/// Reads a `.png` (sRGB; its alpha is linear) or an `.exr` (channels R, G, B and perhaps A, already linear).
///
/// # Errors
/// [`FileError::Read`], also for another file name extension and for an EXR without these channels.
pub fn read(path: &Path) -> Result<Picture, FileError> {
    let failed =
        |what: String| FileError::Read { path: path.display().to_string(), source: io::Error::other(what) };
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("png") => Ok(Picture::from(&read_png(path)?)),
        Some("exr") => {
            let planes = read_exr(path)?;
            let found = planes.channels.keys().cloned().collect::<Vec<_>>().join(", ");
            planes
                .picture()
                .ok_or_else(|| failed(format!("it has the channels {found}; a picture needs R, G and B")))
        }
        _ => Err(failed("the file name of a picture must end in .png or .exr".into())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::write::{Planes, Srgb8Picture, write_exr, write_png};

    #[test]
    fn both_formats_return_the_same_picture() {
        let folder = tempfile::tempdir().unwrap();
        let [png, exr] = ["a.png", "a.exr"].map(|name| folder.path().join(name));
        write_png(&png, &Srgb8Picture { width: 2, height: 1, rgba: vec![0, 10, 188, 255, 255, 1, 2, 51] })
            .unwrap();
        let picture = read(&png).unwrap();
        assert_eq!(Srgb8Picture::from(&picture), read_png(&png).unwrap());
        assert_eq!(picture.at(1, 0)[3], 0.2);
        // 10/255/12.92: the linear segment of the curve. 188 is the code of one half.
        assert!((picture.at(0, 0)[1] - 0.003_035_27).abs() < 1e-8);
        assert!((picture.at(0, 0)[2] - 0.5).abs() < 0.003);
        write_exr(&exr, &Planes::from(&picture)).unwrap();
        assert_eq!(read(&exr).unwrap(), picture);
    }

    #[test]
    fn a_file_that_is_not_a_picture_is_reported_with_the_reason() {
        let folder = tempfile::tempdir().unwrap();
        let exr = folder.path().join("footprint.exr");
        write_exr(&exr, &Planes { width: 1, height: 1, channels: [("s".to_owned(), vec![0.5])].into() })
            .unwrap();
        let said = read(&exr).unwrap_err().to_string();
        assert!(said.contains("footprint.exr: it has the channels s; a picture needs R, G and B"), "{said}");
        let said = read(Path::new("a.jpg")).unwrap_err().to_string();
        assert!(said.contains("a.jpg: the file name of a picture must end in .png or .exr"), "{said}");
    }
}
