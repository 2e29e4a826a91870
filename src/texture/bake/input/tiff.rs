//! TIFF and BigTIFF in strips or tiles. One row of strips or tiles is in memory at a time.

use super::{RowReader, Samples, check_size, geo, read_fault};
use crate::texture::bake::error::SourceError;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use tiff::decoder::ifd::Value;
use tiff::decoder::{Decoder, Limits};
use tiff::tags::{CompressionMethod, Tag};
use tiff::{ColorType, TiffError};

/// Decoded size limit of one strip, or of one row of tiles.
const MAX_BAND_BYTES: u64 = 1 << 30;
/// Limit of the memory for the values of one tag: the largest are the tables of strip or tile offsets.
const MAX_TABLE_BYTES: usize = 256 << 20;
/// Values of ExtraSamples (TIFF 6.0, section 18), and a bit of NewSubfileType.
const PREMULTIPLIED_ALPHA: u16 = 1;
const UNASSOCIATED_ALPHA: u16 = 2;
const TRANSPARENCY_MASK: u32 = 4;
/// A value of PhotometricInterpretation (section 5), and of PlanarConfiguration (section 8).
const PALETTE: u16 = 3;
const SEPARATE_PLANES: u16 = 2;
/// Limit of images examined in one file: a picture, its mask, and smaller copies of both.
const MAX_IMAGES: usize = 64;
/// Memory for the two table entries of a strip or tile, parsed and kept.
const TABLE_BYTES_PER_CHUNK: u64 = 160;

pub struct Tiff {
    path: PathBuf,
    decoder: Decoder<BufReader<File>>,
    size: [u32; 2],
    samples: Samples,
    /// Planes: one, or one for each sample (band-interleaved).
    planes: u32,
    western_column: u32,
    /// Size of a strip or tile, including the padding of the last ones.
    chunk: [u32; 2],
    /// The decoded rows of the current chunks, and the index of that row of chunks.
    band: Vec<u8>,
    band_index: Option<u32>,
    chunk_bytes: Vec<u8>,
    next: u32,
}

impl Tiff {
    pub fn open(path: &Path, file: File) -> Result<Self, SourceError> {
        let mut limits = Limits::default();
        let wrong = |error| fault(path, error);
        let file_bytes = file.metadata().map_err(|error| read_fault(path, error))?.len();
        // The decoder reserves the memory for a tag's values before it reads them. In the file, each value has at
        // least one byte. The first directory's tables are read with the decoder's own limit, also 256 MiB.
        limits.decoding_buffer_size =
            (file_bytes as usize).saturating_mul(size_of::<Value>()).min(MAX_TABLE_BYTES);
        limits.ifd_value_size = MAX_TABLE_BYTES;
        limits.intermediate_buffer_size = MAX_BAND_BYTES as usize;
        let mut decoder = Decoder::new(BufReader::new(file)).map_err(wrong)?.with_limits(limits);
        let size: [u32; 2] = decoder.dimensions().map_err(wrong)?.into();
        check_size(path, size)?;
        let samples = check_kind(path, &mut decoder)?;
        let planar = decoder.find_tag_unsigned::<u16>(Tag::PlanarConfiguration).map_err(wrong)?;
        let planes = if planar == Some(SEPARATE_PLANES) { samples.count() as u32 } else { 1 };
        check_other_images(path, &mut decoder)?;
        let western_column = geo::western_column(&mut decoder, size)
            .map_err(wrong)?
            .map_err(|reason| SourceError::Unsupported { path: path.to_path_buf(), reason })?;
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
            planes,
            western_column,
            chunk,
            band: Vec::new(),
            band_index: None,
            chunk_bytes: Vec::new(),
            next: 0,
        };
        if tiff.band_bytes() > MAX_BAND_BYTES {
            let reason = format!(
                "a strip or a row of tiles is {} texels high and decodes to {} bytes (at most \
                 {MAX_BAND_BYTES}); rewrite it with smaller strips or tiles",
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
        let of_plane = columns * self.size[1].div_ceil(self.chunk[1]);
        let (count, in_chunk) = (self.samples.count(), self.samples.count() / self.planes as usize);
        for (plane, column) in (0..self.planes).flat_map(|plane| (0..columns).map(move |c| (plane, c))) {
            let chunk = plane * of_plane + index * columns + column;
            let (width, height) = self.decoder.chunk_data_dimensions(chunk);
            let left = column as usize * self.chunk[0] as usize * count + plane as usize;
            if height as usize != rows || left + (width as usize - 1) * count + in_chunk > row_bytes {
                let reason = format!("strip or tile {chunk} has {width} x {height} texels");
                return Err(damaged(&self.path, reason));
            }
            if columns * self.planes == 1 {
                let decoded = self.decoder.read_chunk_bytes(chunk, &mut self.band);
                decoded.map_err(|error| fault(&self.path, error))?;
                break;
            }
            self.chunk_bytes.resize(width as usize * in_chunk * rows, 0);
            let decoded = self.decoder.read_chunk_bytes(chunk, &mut self.chunk_bytes);
            decoded.map_err(|error| fault(&self.path, error))?;
            for (row, samples) in self.chunk_bytes.chunks_exact(width as usize * in_chunk).enumerate() {
                let row = &mut self.band[row * row_bytes + left..];
                match self.planes {
                    1 => row[..samples.len()].copy_from_slice(samples),
                    _ => row.iter_mut().step_by(count).zip(samples).for_each(|(to, from)| *to = *from),
                }
            }
        }
        self.band_index = Some(index);
        Ok(())
    }
}

/// Refuses, with a message, every kind of file that would be read wrongly.
fn check_kind(path: &Path, decoder: &mut Decoder<BufReader<File>>) -> Result<Samples, SourceError> {
    let unsupported = |reason: String| SourceError::Unsupported { path: path.to_path_buf(), reason };
    let mut tag = |tag| decoder.find_tag_unsigned::<u16>(tag).map_err(|error| fault(path, error));
    let compression = tag(Tag::Compression)?.unwrap_or(1);
    let known = [
        CompressionMethod::None,
        CompressionMethod::LZW,
        CompressionMethod::Deflate,
        CompressionMethod::OldDeflate,
        CompressionMethod::PackBits,
        CompressionMethod::ZSTD,
        CompressionMethod::WebP,
    ];
    // Checked before the colours, so that JPEG's YCbCr is reported as compression: one command converts both.
    if !known.iter().any(|method| method.to_u16() == compression) {
        let name = CompressionMethod::from_u16_exhaustive(compression);
        return Err(unsupported(format!(
            "compression {compression} ({name:?}), not LZW, Deflate, ZSTD, WebP or PackBits: gdal_translate -co \
             COMPRESS=DEFLATE IN OUT"
        )));
    }
    if tag(Tag::PhotometricInterpretation)? == Some(PALETTE) {
        return Err(unsupported("a palette: gdal_translate -expand rgb IN OUT".into()));
    }
    let colour = decoder.colortype().map_err(|error| fault(path, error))?;
    let samples = match colour {
        ColorType::Gray(8) => Samples::Grey,
        // The decoder's name for grey with any second band; `check_what_is_left_out` checks the band's kind.
        ColorType::GrayA(8) | ColorType::Multiband { bit_depth: 8, num_samples: 2 } => Samples::GreyAlpha,
        ColorType::RGB(8) => Samples::Rgb,
        ColorType::RGBA(8) => Samples::Rgba,
        other => {
            return Err(unsupported(format!(
                "{other:?} texels; make it 8-bit grey, RGB or RGBA: gdal_translate -ot Byte -scale IN OUT"
            )));
        }
    };
    let mut tag = |tag| decoder.find_tag_unsigned::<u16>(tag).map_err(|error| fault(path, error));
    if tag(Tag::Orientation)?.unwrap_or(1) != 1 {
        return Err(unsupported("its rows do not start at the top left: magick IN -auto-orient OUT".into()));
    }
    let formats =
        decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat).map_err(|error| fault(path, error))?;
    if formats.is_some_and(|formats| formats.iter().any(|&format| format != 1)) {
        return Err(unsupported(
            "signed or floating-point samples: gdal_translate -ot Byte -scale IN OUT".into(),
        ));
    }
    check_what_is_left_out(path, decoder)?;
    Ok(samples)
}

/// Refuses bands that are not plain alpha, a no-data value, and files with missing tiles.
fn check_what_is_left_out(path: &Path, decoder: &mut Decoder<BufReader<File>>) -> Result<(), SourceError> {
    let unsupported = |reason: String| SourceError::Unsupported { path: path.to_path_buf(), reason };
    let alpha =
        decoder.find_tag_unsigned_vec::<u16>(Tag::ExtraSamples).map_err(|error| fault(path, error))?;
    match alpha.as_deref() {
        None | Some([] | [UNASSOCIATED_ALPHA]) => {}
        Some([PREMULTIPLIED_ALPHA]) => {
            return Err(unsupported("premultiplied alpha; write it with unassociated alpha".into()));
        }
        Some(_) => {
            return Err(unsupported("a band that is not alpha: gdal_translate -b 1 -b 2 -b 3 IN OUT".into()));
        }
    }
    if decoder.find_tag(Tag::GdalNodata).map_err(|error| fault(path, error))?.is_some() {
        return Err(unsupported(
            "it has a no-data value: fill the gaps (gdal_fillnodata.py), then \
             gdal_translate -a_nodata none IN OUT"
                .into(),
        ));
    }
    for tag in [Tag::StripByteCounts, Tag::TileByteCounts] {
        let counts = decoder.find_tag_unsigned_vec::<u64>(tag).map_err(|error| fault(path, error))?;
        if counts.is_some_and(|counts| counts.contains(&0)) {
            return Err(unsupported(
                "some strips or tiles are missing: gdal_translate -co SPARSE_OK=FALSE IN OUT".into(),
            ));
        }
    }
    Ok(())
}

/// Refuses a mask. Other images of the file are smaller copies and are ignored.
fn check_other_images(path: &Path, decoder: &mut Decoder<BufReader<File>>) -> Result<(), SourceError> {
    let mut first_is_a_mask = || -> tiff::TiffResult<bool> {
        for _ in 0..MAX_IMAGES {
            if !decoder.more_images() {
                break;
            }
            decoder.next_image()?;
            let kind = decoder.find_tag_unsigned::<u32>(Tag::NewSubfileType)?.unwrap_or(0);
            if kind & TRANSPARENCY_MASK != 0 {
                return Ok(true);
            }
        }
        decoder.seek_to_image(0)?;
        Ok(false)
    };
    if first_is_a_mask().map_err(|error| fault(path, error))? {
        let reason = "it has a mask: gdal_translate -b 1 -b 2 -b 3 -b mask IN OUT".into();
        return Err(SourceError::Unsupported { path: path.to_path_buf(), reason });
    }
    Ok(())
}

fn damaged(path: &Path, reason: String) -> SourceError {
    SourceError::Damaged { path: path.to_path_buf(), reason }
}

pub(super) fn fault(path: &Path, error: TiffError) -> SourceError {
    match error {
        TiffError::IoError(error) => read_fault(path, error),
        TiffError::UnsupportedError(error) => {
            SourceError::Unsupported { path: path.to_path_buf(), reason: error.to_string() }
        }
        TiffError::LimitsExceeded => {
            let reason = "a tag has more values than the file has bytes, or more than 8 million (write larger tiles or \
                          strips), or a strip or tile has more than 1 GiB"
                .into();
            SourceError::Unsupported { path: path.to_path_buf(), reason }
        }
        other => damaged(path, other.to_string()),
    }
}

impl RowReader for Tiff {
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
        rgba.rotate_left(4 * self.western_column as usize);
        self.next += 1;
        Ok(())
    }

    fn skip(&mut self, rows: u32) -> Result<(), SourceError> {
        self.next += rows;
        Ok(())
    }
}
