//! Test pictures, and writers of their files.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::Path;
use tiff::TiffResult;
use tiff::encoder::colortype::{ColorType, Gray8, RGB8};
use tiff::encoder::{Compression, ImageEncoder, TiffEncoder, TiffKindStandard};
use tiff::tags::{ExtraSamples, Tag};

/// RGBA8, northernmost row first.
#[derive(Clone, PartialEq, Eq)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub rgba: Vec<u8>,
}

impl Picture {
    pub fn texel(&self, x: usize, y: usize) -> [u8; 4] {
        let at = (y * self.width + x) * 4;
        [self.rgba[at], self.rgba[at + 1], self.rgba[at + 2], self.rgba[at + 3]]
    }

    /// Without alpha.
    pub fn rgb(&self) -> Vec<u8> {
        self.rgba.chunks_exact(4).flat_map(|texel| &texel[..3]).copied().collect()
    }
}

/// No two neighbours are equal, there is no symmetry, and all bytes are used.
pub fn dotted(width: usize, height: usize) -> Picture {
    let texel = |index: usize| {
        let (x, y) = ((index % width) as u32, (index / width) as u32);
        let mixed = (x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA6B)).wrapping_mul(0x2C1B_3C6D);
        [(x * 255 / width as u32) as u8, (mixed >> 24) as u8, (mixed >> 16) as u8 / 3, (mixed >> 8) as u8 | 1]
    };
    Picture { width, height, rgba: (0..width * height).flat_map(texel).collect() }
}

pub fn write_png(path: &Path, picture: &Picture) {
    let file = BufWriter::new(File::create(path).unwrap());
    let mut encoder = png::Encoder::new(file, picture.width as u32, picture.height as u32);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.write_header().unwrap().write_image_data(&picture.rgba).unwrap();
}

type Image<'a, C> = ImageEncoder<'a, BufWriter<File>, C, TiffKindStandard>;

fn write_tiff<C: ColorType<Inner = u8>>(
    path: &Path,
    picture: &Picture,
    compression: Compression,
    prepare: impl FnOnce(&mut Image<'_, C>) -> TiffResult<()>,
    samples: &[u8],
) {
    let file = BufWriter::new(File::create(path).unwrap());
    let mut encoder = TiffEncoder::new(file).unwrap().with_compression(compression);
    let mut image = encoder.new_image(picture.width as u32, picture.height as u32).unwrap();
    prepare(&mut image).unwrap();
    image.write_data(samples).unwrap();
}

/// RGB in strips.
pub fn write_tiff_strips(path: &Path, picture: &Picture, compression: Compression, rows_per_strip: u32) {
    let prepare = |image: &mut Image<'_, RGB8>| image.rows_per_strip(rows_per_strip);
    write_tiff(path, picture, compression, prepare, &picture.rgb());
}

/// Tags of a GeoTIFF: its scale in degrees a texel, and its north-western corner in degrees.
pub fn geo_tags(scale: [f64; 2], [west, north]: [f64; 2]) -> Vec<(Tag, Vec<f64>)> {
    vec![
        (Tag::ModelPixelScaleTag, vec![scale[0], scale[1], 0.0]),
        (Tag::ModelTiepointTag, vec![0.0, 0.0, 0.0, west, north, 0.0]),
    ]
}

/// RGB and a fourth band of the stated kind.
pub fn write_tiff_alpha(path: &Path, picture: &Picture, kind: ExtraSamples) {
    let prepare = |image: &mut Image<'_, RGB8>| image.extra_samples(&[kind]);
    write_tiff(path, picture, Compression::Uncompressed, prepare, &picture.rgba);
}

/// The red band as grey, and alpha.
pub fn write_tiff_grey_alpha(path: &Path, picture: &Picture, kind: ExtraSamples) {
    let samples: Vec<u8> = picture.rgba.chunks_exact(4).flat_map(|texel| [texel[0], texel[3]]).collect();
    let prepare = |image: &mut Image<'_, Gray8>| image.extra_samples(&[kind]);
    write_tiff(path, picture, Compression::Uncompressed, prepare, &samples);
}

/// RGB in one strip, with tags of doubles and of shorts.
pub fn write_tiff_tagged(
    path: &Path,
    picture: &Picture,
    doubles: &[(Tag, Vec<f64>)],
    shorts: &[(Tag, Vec<u16>)],
) {
    let prepare = |image: &mut Image<'_, RGB8>| {
        let tags = image.encoder();
        doubles.iter().try_for_each(|(tag, numbers)| tags.write_tag(*tag, &numbers[..]))?;
        shorts.iter().try_for_each(|(tag, numbers)| tags.write_tag(*tag, &numbers[..]))
    };
    write_tiff(path, picture, Compression::Uncompressed, prepare, &picture.rgb());
}

/// RGB in strips of 64 rows, one strip in memory at a time.
pub fn write_tall_tiff(path: &Path, width: u32, height: u32) {
    let file = BufWriter::new(File::create(path).unwrap());
    let mut encoder = TiffEncoder::new_big(file).unwrap();
    let mut image = encoder.new_image::<RGB8>(width, height).unwrap();
    image.rows_per_strip(64).unwrap();
    let mut row = 0;
    while row < height {
        let rows = 64.min(height - row);
        let samples: Vec<u8> = (row..row + rows)
            .flat_map(|y| (0..width).flat_map(move |x| [(x >> 3) as u8, (y >> 7) as u8, (x ^ y) as u8]))
            .collect();
        image.write_strip(&samples).unwrap();
        row += rows;
    }
    image.finish().unwrap();
}

/// RGB in square tiles, uncompressed, written by hand: TIFF 6.0 (section 15, tiled images), or BigTIFF.
pub fn write_tiff_tiles(path: &Path, picture: &Picture, big: bool, side: usize) {
    let (columns, rows) = (picture.width.div_ceil(side), picture.height.div_ceil(side));
    let mut file = Vec::new();
    file.extend(if big { &b"II\x2b\0\x08\0\0\0"[..] } else { &b"II\x2a\0"[..] });
    let pointer_at = file.len();
    let word_bytes = if big { 8 } else { 4 };
    file.resize(pointer_at + word_bytes, 0);
    let word = |number: usize| (number as u64).to_le_bytes()[..word_bytes].to_vec();
    let mut offsets = Vec::new();
    for tile in 0..columns * rows {
        offsets.push(file.len());
        for y in 0..side {
            for x in 0..side {
                let (x, y) = (tile % columns * side + x, tile / columns * side + y);
                // Padding must be ignored: grey 77.
                let inside = x < picture.width && y < picture.height;
                let texel = if inside { picture.texel(x, y) } else { [77; 4] };
                file.extend(&texel[..3]);
            }
        }
    }
    let lengths = vec![side * side * 3; columns * rows];
    let mut array = |numbers: &[usize]| {
        let at = file.len();
        numbers.iter().for_each(|&number| file.extend(word(number)));
        at
    };
    let (offsets_at, lengths_at) = (array(&offsets), array(&lengths));
    let (bits_at, count) = (file.len(), columns * rows);
    file.extend([8, 0, 8, 0, 8, 0, 0, 0]);
    let directory_at = file.len();
    file[pointer_at..pointer_at + word_bytes].copy_from_slice(&word(directory_at));
    // Type 3: 16 bits, 4: 32, 16: 64. Values that fit into the entry are stored in it.
    let long = if big { 16 } else { 4 };
    let bits = if big { 8 | 8 << 16 | 8 << 32 } else { bits_at };
    let array_value = |at: usize, first: usize| if count == 1 { first } else { at };
    let entries: [(u16, u16, usize, usize); 11] = [
        (256, 3, 1, picture.width),
        (257, 3, 1, picture.height),
        (258, 3, 3, bits),
        (259, 3, 1, 1),
        (262, 3, 1, 2),
        (277, 3, 1, 3),
        (284, 3, 1, 1),
        (322, 3, 1, side),
        (323, 3, 1, side),
        (324, long, count, array_value(offsets_at, offsets[0])),
        (325, long, count, array_value(lengths_at, lengths[0])),
    ];
    file.extend(&(entries.len() as u64).to_le_bytes()[..if big { 8 } else { 2 }]);
    for (tag, kind, count, value) in entries {
        file.extend(tag.to_le_bytes());
        file.extend(kind.to_le_bytes());
        file.extend(word(count));
        file.extend(word(value));
    }
    file.extend(word(0));
    fs::write(path, file).unwrap();
}
