//! JPEG. It has no random access, so the whole picture is decoded into memory, up to a limit. The decoder
//! is built without SIMD, so that every machine bakes the same bytes.

use super::{RowReader, Samples, check_size, check_upright};
use crate::file;
use crate::texture::bake::error::SourceError;
use std::fs::File;
use std::path::{Path, PathBuf};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// 2^27 texels decode to 384 MiB; a progressive file's coefficients need twice that.
const MAX_TEXELS: u64 = 1 << 27;
const MAX_FILE_BYTES: u64 = 1 << 30;

pub struct Jpeg {
    path: PathBuf,
    size: [u32; 2],
    file_bytes: u64,
    /// Decoded when the first row is read.
    picture: Option<Vec<u8>>,
    next: usize,
}

impl Jpeg {
    pub fn open(path: &Path, file: File) -> Result<Self, SourceError> {
        let failed = |source| SourceError::Open { path: path.to_path_buf(), source };
        let file_bytes = file.metadata().map_err(failed)?.len();
        let unsupported = |reason: String| Err(SourceError::Unsupported { path: path.to_path_buf(), reason });
        if file_bytes > MAX_FILE_BYTES {
            return unsupported(format!(
                "a JPEG must be decoded as a whole, and {file_bytes} bytes are too many; convert it to TIFF"
            ));
        }
        let file = read(path)?;
        let mut decoder = decoder(&file);
        decoder.decode_headers().map_err(|error| damaged(path, error.to_string()))?;
        let Some(info) = decoder.info() else {
            return Err(damaged(path, "it has no frame header".into()));
        };
        let size = [u32::from(info.width), u32::from(info.height)];
        check_size(path, size)?;
        check_upright(path, decoder.exif().map(|exif| &exif[..]))?;
        if u64::from(size[0]) * u64::from(size[1]) > MAX_TEXELS {
            return unsupported(format!(
                "a JPEG must be decoded as a whole, and {} x {} texels are more than 2^27; convert it to TIFF",
                size[0], size[1]
            ));
        }
        Ok(Self { path: path.to_path_buf(), size, file_bytes, picture: None, next: 0 })
    }

    fn decode(&self) -> Result<Vec<u8>, SourceError> {
        let file = read(&self.path)?;
        // The decoder fills missing data with grey. A complete file ends with the marker EOI, possibly
        // followed by padding.
        let content = file.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
        if !file[..content].ends_with(&[0xFF, 0xD9]) {
            return Err(damaged(&self.path, "the file ends early (no end marker)".into()));
        }
        let picture = decoder(&file).decode().map_err(|error| damaged(&self.path, error.to_string()))?;
        let expected = self.size[0] as usize * self.size[1] as usize * 3;
        if picture.len() != expected {
            let reason = format!("{} bytes instead of {expected} after decoding", picture.len());
            return Err(damaged(&self.path, reason));
        }
        Ok(picture)
    }
}

fn read(path: &Path) -> Result<Vec<u8>, SourceError> {
    file::read(path, MAX_FILE_BYTES).map_err(|source| SourceError::Open { path: path.to_path_buf(), source })
}

fn decoder(file: &[u8]) -> JpegDecoder<ZCursor<&[u8]>> {
    let options = DecoderOptions::new_safe()
        .set_strict_mode(true)
        .set_max_width(1 << 16)
        .set_max_height(1 << 16)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    JpegDecoder::new_with_options(ZCursor::new(file), options)
}

fn damaged(path: &Path, reason: String) -> SourceError {
    // The decoder ends its messages with a line break.
    SourceError::Damaged { path: path.to_path_buf(), reason: reason.trim_end().to_string() }
}

impl RowReader for Jpeg {
    fn size(&self) -> [u32; 2] {
        self.size
    }

    fn memory_bytes(&self) -> u64 {
        // RGB, and 16-bit coefficients of up to 4 components.
        let texels = u64::from(self.size[0]) * u64::from(self.size[1]);
        self.file_bytes + texels * (3 + 8)
    }

    fn next_row(&mut self, rgba: &mut [u8]) -> Result<(), SourceError> {
        let picture = match self.picture.take() {
            Some(picture) => picture,
            None => self.decode()?,
        };
        let row_bytes = self.size[0] as usize * 3;
        Samples::Rgb.to_rgba(&picture[self.next * row_bytes..][..row_bytes], rgba);
        self.picture = Some(picture);
        self.next += 1;
        Ok(())
    }

    fn skip(&mut self, rows: u32) -> Result<(), SourceError> {
        self.next += rows as usize;
        Ok(())
    }
}
