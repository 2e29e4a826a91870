//! Source pictures, read in bands of rows from the north.
//!
//! Pictures are 8-bit grey or RGB, with or without alpha. Colours are taken as sRGB (profiles and gamma chunks are
//! ignored), alpha as linear. A TIFF with georeferencing must cover the whole Earth.

mod geo;
mod jpeg;
mod png;
mod tiff;

use super::error::SourceError;
use crate::file;
use image::metadata::Orientation;
use std::io::{self, Read, Seek};
use std::path::Path;

/// Maximum side of a source: a pyramid has at most 2^20 texels per side.
pub const MAX_SIDE: u32 = 1 << 20;

/// A picture that is read row by row.
pub trait RowReader {
    /// Width and height in texels.
    fn size(&self) -> [u32; 2];

    /// Peak memory of reading in bytes, without the caller's rows.
    fn memory_bytes(&self) -> u64;

    /// The next row, as RGBA8, width x 4 bytes.
    ///
    /// # Errors
    /// [`SourceError::Damaged`] if the file ends early or does not decode.
    fn next_row(&mut self, rgba: &mut [u8]) -> Result<(), SourceError>;

    /// Skips rows.
    ///
    /// # Errors
    /// As [`Self::next_row`].
    fn skip(&mut self, rows: u32) -> Result<(), SourceError>;
}

/// Identifies a picture by its first bytes (not its name), opens it, and checks the whole header.
///
/// # Errors
/// [`SourceError`] names the path and what is not supported.
pub fn open(path: &Path) -> Result<Box<dyn RowReader>, SourceError> {
    let open_error = |source| SourceError::Open { path: path.to_path_buf(), source };
    let mut file = file::open(path).map_err(open_error)?;
    let mut start = Vec::new();
    file.by_ref().take(8).read_to_end(&mut start).map_err(open_error)?;
    file.rewind().map_err(open_error)?;
    if start == b"\x89PNG\r\n\x1a\n" {
        return Ok(Box::new(png::Png::open(path, file)?));
    }
    if start.starts_with(&[0xFF, 0xD8, 0xFF]) {
        return Ok(Box::new(jpeg::Jpeg::open(path, file)?));
    }
    // Byte order II or MM, then 42 for TIFF or 43 for BigTIFF.
    if [b"II\x2a\0", b"II\x2b\0", b"MM\0\x2a", b"MM\0\x2b"].iter().any(|magic| start.starts_with(*magic)) {
        return Ok(Box::new(tiff::Tiff::open(path, file)?));
    }
    Err(SourceError::Kind { path: path.to_path_buf() })
}

/// Layout of the samples of one texel in a decoded row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Samples {
    Grey,
    GreyAlpha,
    Rgb,
    Rgba,
}

impl Samples {
    fn count(self) -> usize {
        match self {
            Self::Grey => 1,
            Self::GreyAlpha => 2,
            Self::Rgb => 3,
            Self::Rgba => 4,
        }
    }

    fn to_rgba(self, samples: &[u8], rgba: &mut [u8]) {
        assert_eq!(samples.len() * 4, rgba.len() * self.count(), "{self:?}");
        let texels = rgba.as_chunks_mut::<4>().0.iter_mut();
        for (texel, samples) in texels.zip(samples.chunks_exact(self.count())) {
            *texel = match *samples {
                [grey] => [grey, grey, grey, 255],
                [grey, alpha] => [grey, grey, grey, alpha],
                [r, g, b] => [r, g, b, 255],
                [r, g, b, alpha] => [r, g, b, alpha],
                _ => unreachable!("{self:?}"),
            };
        }
    }
}

fn check_size(path: &Path, [width, height]: [u32; 2]) -> Result<(), SourceError> {
    if (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height) {
        return Ok(());
    }
    let reason = format!("{width} x {height} texels are outside 1 ..= {MAX_SIDE} per side");
    Err(SourceError::Unsupported { path: path.to_path_buf(), reason })
}

/// Refuses a picture that its EXIF data rotates or mirrors.
fn check_upright(path: &Path, exif: Option<&[u8]>) -> Result<(), SourceError> {
    match exif.and_then(Orientation::from_exif_chunk) {
        None | Some(Orientation::NoTransforms) => Ok(()),
        Some(_) => {
            let reason = "its EXIF data rotates or mirrors it; run `magick IN -auto-orient OUT` first".into();
            Err(SourceError::Unsupported { path: path.to_path_buf(), reason })
        }
    }
}

/// An I/O error while a decoder reads. Only the end of the file, an error of the decoder itself and EINVAL (a seek to a
/// damaged offset) prove damage. The system's other errors may be temporary.
fn read_fault(path: &Path, source: io::Error) -> SourceError {
    let path = path.to_path_buf();
    match source.raw_os_error() {
        Some(code) if code != libc::EINVAL => SourceError::Read { path, source },
        _ if source.kind() == io::ErrorKind::UnexpectedEof => {
            SourceError::Damaged { path, reason: "the file ends early".into() }
        }
        _ => SourceError::Damaged { path, reason: source.to_string() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::png::DecodingError;
    use ::tiff::TiffError;

    #[test]
    fn only_proven_damage_is_permanent() {
        let path = Path::new("a");
        let lasts = |error: &dyn Fn() -> io::Error| {
            let of_png = png::fault(path, DecodingError::IoError(error()));
            let of_tiff = tiff::fault(path, TiffError::IoError(error()));
            assert_eq!(of_png.to_string(), of_tiff.to_string());
            assert_eq!(of_png.is_permanent(), of_tiff.is_permanent());
            of_png.is_permanent()
        };
        for code in [libc::EIO, libc::ESTALE, libc::ENOMEM, libc::ETIMEDOUT, libc::EACCES] {
            assert!(!lasts(&|| io::Error::from_raw_os_error(code)), "{code}");
        }
        assert!(lasts(&|| io::Error::from_raw_os_error(libc::EINVAL)));
        assert!(lasts(&|| io::ErrorKind::UnexpectedEof.into()));
        assert!(lasts(&|| io::Error::other("not a deflate stream")));
        assert!(png::fault(path, DecodingError::LimitsExceeded).is_permanent());
    }
}
