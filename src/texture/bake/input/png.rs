//! PNG, one row at a time. An interlaced file cannot be streamed; it is decoded whole, up to a limit.

use super::{MAX_SIDE, RowReader, Samples, check_size, check_upright, read_fault};
use crate::texture::bake::error::SourceError;
use png::{BitDepth, ColorType, Decoder, DecodingError, Limits, Reader, Transformations};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Decoded size limit of an interlaced picture.
const MAX_INTERLACED_BYTES: u64 = 512 << 20;
/// The decoder's own buffers: a few rows of at most 4 bytes per texel, and the inflate window.
const DECODER_BYTES: u64 = 8 << 20;

pub struct Png {
    path: PathBuf,
    reader: Reader<BufReader<File>>,
    samples: Samples,
    /// All rows of an interlaced picture.
    whole: Option<Vec<u8>>,
    row_bytes: usize,
    next: usize,
}

impl Png {
    pub fn open(path: &Path, file: File) -> Result<Self, SourceError> {
        let limits = Limits { bytes: 16 * MAX_SIDE as usize };
        let mut decoder = Decoder::new_with_limits(BufReader::new(file), limits);
        decoder.set_ignore_text_chunk(true);
        decoder.set_ignore_iccp_chunk(true);
        // Expands palettes to RGB, fewer than 8 bits to 8, and a transparent colour to alpha.
        decoder.set_transformations(Transformations::EXPAND);
        let reader = decoder.read_info().map_err(|error| fault(path, error))?;
        let info = reader.info();
        check_size(path, [info.width, info.height])?;
        let unsupported = |reason: String| Err(SourceError::Unsupported { path: path.to_path_buf(), reason });
        let (colour, depth) = reader.output_color_type();
        let samples = match (colour, depth) {
            (ColorType::Grayscale, BitDepth::Eight) => Samples::Grey,
            (ColorType::GrayscaleAlpha, BitDepth::Eight) => Samples::GreyAlpha,
            (ColorType::Rgb, BitDepth::Eight) => Samples::Rgb,
            (ColorType::Rgba, BitDepth::Eight) => Samples::Rgba,
            (_, BitDepth::Sixteen) => {
                return unsupported("16 bits per sample: magick IN -depth 8 OUT".into());
            }
            other => return unsupported(format!("{other:?} samples")),
        };
        let row_bytes = info.width as usize * samples.count();
        let (interlaced, whole_bytes) = (info.interlaced, row_bytes as u64 * u64::from(info.height));
        if interlaced && whole_bytes > MAX_INTERLACED_BYTES {
            return unsupported(format!(
                "interlaced, so it must be decoded as a whole, to {whole_bytes} bytes (at most \
                 {MAX_INTERLACED_BYTES}); save it without interlacing"
            ));
        }
        let mut png = Self { path: path.to_path_buf(), reader, samples, whole: None, row_bytes, next: 0 };
        if interlaced {
            let mut whole = vec![0; whole_bytes as usize];
            png.reader.next_frame(&mut whole).map_err(|error| fault(path, error))?;
            png.whole = Some(whole);
            png.finish()?;
        }
        check_upright(path, png.reader.info().exif_metadata.as_deref())?;
        Ok(png)
    }

    /// Reads the rest, which proves that the file is complete. EXIF data may follow the picture.
    fn finish(&mut self) -> Result<(), SourceError> {
        self.reader.finish().map_err(|error| fault(&self.path, error))?;
        check_upright(&self.path, self.reader.info().exif_metadata.as_deref())
    }
}

pub(super) fn fault(path: &Path, error: DecodingError) -> SourceError {
    match error {
        DecodingError::IoError(error) => read_fault(path, error),
        other => SourceError::Damaged { path: path.to_path_buf(), reason: other.to_string() },
    }
}

impl RowReader for Png {
    fn size(&self) -> [u32; 2] {
        let info = self.reader.info();
        [info.width, info.height]
    }

    fn memory_bytes(&self) -> u64 {
        let whole = self.whole.as_ref().map_or(0, |whole| whole.len() as u64);
        whole + DECODER_BYTES + 8 * self.row_bytes as u64
    }

    fn next_row(&mut self, rgba: &mut [u8]) -> Result<(), SourceError> {
        let start = self.next * self.row_bytes;
        self.next += 1;
        if let Some(whole) = &self.whole {
            self.samples.to_rgba(&whole[start..start + self.row_bytes], rgba);
            return Ok(());
        }
        match self.reader.next_row() {
            Ok(Some(row)) => self.samples.to_rgba(row.data(), rgba),
            Ok(None) => {
                let reason = format!("it ends after {} rows", self.next - 1);
                return Err(SourceError::Damaged { path: self.path.clone(), reason });
            }
            Err(error) => return Err(fault(&self.path, error)),
        }
        if self.next == self.reader.info().height as usize {
            self.finish()?;
        }
        Ok(())
    }

    fn skip(&mut self, rows: u32) -> Result<(), SourceError> {
        if self.whole.is_some() {
            self.next += rows as usize;
            return Ok(());
        }
        let mut row = vec![0; self.size()[0] as usize * 4];
        (0..rows).try_for_each(|_| self.next_row(&mut row))
    }
}
