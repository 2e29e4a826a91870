//! TIFF and BigTIFF in strips or tiles: one row of them is in memory at a time.

use super::{Rows, Samples, check_size};
use crate::texture::bake::error::SourceError;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use tiff::decoder::{Decoder, Limits};
use tiff::tags::{CompressionMethod, Tag};
use tiff::{ColorType, TiffError};

/// One strip, or one row of tiles, may take this much memory, decoded.
const MOST_BAND_BYTES: u64 = 1 << 30;
/// The tables of where strips or tiles lie.
const MOST_TABLE_BYTES: usize = 256 << 20;
/// Memory for a strip's or tile's two table entries while they are parsed and kept.
const TABLE_BYTES_PER_CHUNK: u64 = 160;

pub struct Tiff {
    path: PathBuf,
    decoder: Decoder<BufReader<File>>,
    size: [u32; 2],
    samples: Samples,
    /// Size of a strip or tile, the padding of the last ones included.
    chunk: [u32; 2],
    /// The rows of the chunks in memory, and which row of chunks they are.
    band: Vec<u8>,
    band_index: Option<u32>,
    chunk_bytes: Vec<u8>,
    next: u32,
}

impl Tiff {
    pub fn open(path: &Path) -> Result<Self, SourceError> {
        let file =
            File::open(path).map_err(|source| SourceError::Open { path: path.to_path_buf(), source })?;
        let mut limits = Limits::default();
        limits.decoding_buffer_size = MOST_BAND_BYTES as usize;
        limits.intermediate_buffer_size = MOST_BAND_BYTES as usize;
        limits.ifd_value_size = MOST_TABLE_BYTES;
        let wrong = |error| fault(path, error);
        let mut decoder = Decoder::new(BufReader::new(file)).map_err(wrong)?.with_limits(limits);
        let size: [u32; 2] = decoder.dimensions().map_err(wrong)?.into();
        check_size(path, size)?;
        let samples = check_kind(path, &mut decoder)?;
        let chunk: [u32; 2] = decoder.chunk_dimensions().into();
        if chunk.contains(&0) {
            return Err(damaged(path, format!("strips or tiles of {} x {} texels", chunk[0], chunk[1])));
        }
        let chunk = [chunk[0], chunk[1].min(size[1])];
        let tiff = Self {
            path: path.to_path_buf(),
            decoder,
            size,
            samples,
            chunk,
            band: Vec::new(),
            band_index: None,
            chunk_bytes: Vec::new(),
            next: 0,
        };
        if tiff.band_bytes() > MOST_BAND_BYTES {
            let reason = format!(
                "a strip or a row of tiles is {} texels high and decodes to {} bytes (at most \
                 {MOST_BAND_BYTES}); rewrite it with smaller strips or tiles",
                chunk[1],
                tiff.band_bytes()
            );
            return Err(SourceError::Unsupported { path: path.to_path_buf(), reason });
        }
        Ok(tiff)
    }

    fn row_bytes(&self) -> usize {
        self.size[0] as usize * self.samples.count()
    }

    fn band_bytes(&self) -> u64 {
        self.row_bytes() as u64 * u64::from(self.chunk[1])
    }

    /// Decodes one row of strips or tiles.
    fn read_band(&mut self, index: u32) -> Result<(), SourceError> {
        let row_bytes = self.row_bytes();
        let rows = self.chunk[1].min(self.size[1] - index * self.chunk[1]) as usize;
        self.band.resize(rows * row_bytes, 0);
        let columns = self.size[0].div_ceil(self.chunk[0]);
        for column in 0..columns {
            let chunk = index * columns + column;
            let (width, height) = self.decoder.chunk_data_dimensions(chunk);
            let left = column as usize * self.chunk[0] as usize * self.samples.count();
            let width_bytes = width as usize * self.samples.count();
            if height as usize != rows || left + width_bytes > row_bytes {
                let reason = format!("strip or tile {chunk} has {width} x {height} texels");
                return Err(damaged(&self.path, reason));
            }
            if columns == 1 {
                let decoded = self.decoder.read_chunk_bytes(chunk, &mut self.band);
                decoded.map_err(|error| fault(&self.path, error))?;
                break;
            }
            self.chunk_bytes.resize(width_bytes * rows, 0);
            let decoded = self.decoder.read_chunk_bytes(chunk, &mut self.chunk_bytes);
            decoded.map_err(|error| fault(&self.path, error))?;
            for (row, samples) in self.chunk_bytes.chunks_exact(width_bytes).enumerate() {
                self.band[row * row_bytes + left..][..width_bytes].copy_from_slice(samples);
            }
        }
        self.band_index = Some(index);
        Ok(())
    }
}

/// Everything that would be read wrongly is refused here, by name.
fn check_kind(path: &Path, decoder: &mut Decoder<BufReader<File>>) -> Result<Samples, SourceError> {
    let unsupported = |reason: String| SourceError::Unsupported { path: path.to_path_buf(), reason };
    let colour = decoder.colortype().map_err(|error| fault(path, error))?;
    let samples = match colour {
        ColorType::Gray(8) => Samples::Grey,
        ColorType::GrayA(8) => Samples::GreyAlpha,
        ColorType::RGB(8) => Samples::Rgb,
        ColorType::RGBA(8) => Samples::Rgba,
        other => {
            return Err(unsupported(format!(
                "{other:?} texels; convert it to 8-bit grey, RGB or RGBA first"
            )));
        }
    };
    let mut tag = |tag| decoder.find_tag_unsigned::<u16>(tag).map_err(|error| fault(path, error));
    let compression = tag(Tag::Compression)?.unwrap_or(1);
    let known = [
        CompressionMethod::None,
        CompressionMethod::LZW,
        CompressionMethod::Deflate,
        CompressionMethod::OldDeflate,
        CompressionMethod::PackBits,
    ];
    if !known.iter().any(|method| method.to_u16() == compression) {
        return Err(unsupported(format!(
            "compression {compression}; rewrite it with none, LZW, Deflate or PackBits"
        )));
    }
    if tag(Tag::PlanarConfiguration)?.unwrap_or(1) != 1 {
        return Err(unsupported("separate colour planes; rewrite it with interleaved samples".into()));
    }
    if tag(Tag::Orientation)?.unwrap_or(1) != 1 {
        return Err(unsupported("rows that do not run from the top left; rotate it first".into()));
    }
    let formats =
        decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat).map_err(|error| fault(path, error))?;
    if formats.is_some_and(|formats| formats.iter().any(|&format| format != 1)) {
        return Err(unsupported("signed or floating-point samples".into()));
    }
    Ok(samples)
}

fn damaged(path: &Path, reason: String) -> SourceError {
    SourceError::Damaged { path: path.to_path_buf(), reason }
}

fn fault(path: &Path, error: TiffError) -> SourceError {
    match error {
        TiffError::IoError(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
            damaged(path, "the file ends early".into())
        }
        TiffError::UnsupportedError(error) => {
            SourceError::Unsupported { path: path.to_path_buf(), reason: error.to_string() }
        }
        other => damaged(path, other.to_string()),
    }
}

impl Rows for Tiff {
    fn size(&self) -> [u32; 2] {
        self.size
    }

    fn memory_bytes(&self) -> u64 {
        let chunk_bytes = u64::from(self.chunk[0]) * u64::from(self.chunk[1]) * self.samples.count() as u64;
        let chunks =
            u64::from(self.size[0].div_ceil(self.chunk[0])) * u64::from(self.size[1].div_ceil(self.chunk[1]));
        self.band_bytes() + 2 * chunk_bytes + chunks * TABLE_BYTES_PER_CHUNK
    }

    fn next_row(&mut self, rgba: &mut [u8]) -> Result<(), SourceError> {
        let band = self.next / self.chunk[1];
        if self.band_index != Some(band) {
            self.read_band(band)?;
        }
        let start = (self.next % self.chunk[1]) as usize * self.row_bytes();
        self.samples.to_rgba(&self.band[start..start + self.row_bytes()], rgba);
        self.next += 1;
        Ok(())
    }

    fn skip(&mut self, rows: u32) -> Result<(), SourceError> {
        self.next += rows;
        Ok(())
    }
}
