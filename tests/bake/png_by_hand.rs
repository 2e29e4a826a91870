//! Writes PNG files that the `png` encoder cannot write (interlaced, palettes), in uncompressed deflate blocks. Source:
//! the PNG specification, third edition.

use std::fs;
use std::path::Path;

/// Samples of one texel: grey 1, palette index 1, grey and alpha 2, RGB 3, RGBA 4; 8 bits each.
pub struct Raw<'a> {
    pub width: usize,
    pub height: usize,
    /// 0 grey, 2 RGB, 3 palette, 4 grey and alpha, 6 RGBA.
    pub colour_type: u8,
    pub interlaced: bool,
    pub palette: &'a [[u8; 3]],
    pub samples: &'a [u8],
}

/// Start and step of Adam7's passes, in columns and rows (section 8).
const PASSES: [[usize; 4]; 7] =
    [[0, 0, 8, 8], [4, 0, 8, 8], [0, 4, 4, 8], [2, 0, 4, 4], [0, 2, 2, 4], [1, 0, 2, 2], [0, 1, 1, 2]];

pub fn write(path: &Path, raw: &Raw) {
    let count = raw.samples.len() / (raw.width * raw.height);
    let passes = if raw.interlaced { &PASSES[..] } else { &[[0, 0, 1, 1]] };
    let mut scanlines = Vec::new();
    for &[left, top, right, down] in passes {
        for y in (top..raw.height).step_by(down) {
            if left < raw.width {
                // Filter type 0: none.
                scanlines.push(0);
            }
            for x in (left..raw.width).step_by(right) {
                scanlines.extend(&raw.samples[(y * raw.width + x) * count..][..count]);
            }
        }
    }
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut header = Vec::new();
    header.extend((raw.width as u32).to_be_bytes());
    header.extend((raw.height as u32).to_be_bytes());
    header.extend([8, raw.colour_type, 0, 0, u8::from(raw.interlaced)]);
    chunk(&mut file, b"IHDR", &header);
    if !raw.palette.is_empty() {
        chunk(&mut file, b"PLTE", raw.palette.as_flattened());
    }
    chunk(&mut file, b"IDAT", &stored(&scanlines));
    chunk(&mut file, b"IEND", &[]);
    fs::write(path, file).unwrap();
}

/// Adds a chunk: its length, kind, content and CRC.
pub fn chunk(file: &mut Vec<u8>, kind: &[u8; 4], content: &[u8]) {
    file.extend((content.len() as u32).to_be_bytes());
    let start = file.len();
    file.extend(kind);
    file.extend(content);
    let mut crc = u32::MAX;
    for &byte in &file[start..] {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 };
        }
    }
    file.extend((!crc).to_be_bytes());
}

/// A zlib stream of stored blocks.
fn stored(content: &[u8]) -> Vec<u8> {
    let mut stream = vec![0x78, 0x01];
    let mut blocks = content.chunks(65_535).peekable();
    while let Some(block) = blocks.next() {
        stream.push(u8::from(blocks.peek().is_none()));
        stream.extend((block.len() as u16).to_le_bytes());
        stream.extend((!(block.len() as u16)).to_le_bytes());
        stream.extend(block);
    }
    let (mut low, mut high) = (1u32, 0u32);
    for &byte in content {
        low = (low + u32::from(byte)) % 65_521;
        high = (high + low) % 65_521;
    }
    stream.extend((high << 16 | low).to_be_bytes());
    stream
}
