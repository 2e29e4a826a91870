//! Pictures in the page, as PNG in base64. Pictures wider than [`WIDEST`] are reduced.

use crate::picture::srgb::{from_linear_f64, to_linear_f64};
use crate::picture::write::{Srgb8Picture, read_png};
use anyhow::Context;
use serde::Serialize;
use std::path::Path;

/// Largest width of a picture in a page, in pixels: at 16:9 a PNG rarely exceeds 0.3 MB.
const WIDEST: u32 = 480;

/// A picture in the page.
#[derive(Serialize)]
pub struct PagePicture {
    /// File name without its ending.
    name: String,
    /// Link to the full picture.
    file: String,
    width: u32,
    height: u32,
    base64: String,
}

/// # Errors
/// A file cannot be read.
pub fn shown(folder: &Path, file: &str) -> anyhow::Result<PagePicture> {
    let path = folder.join(file);
    let picture = read_png(&path)?;
    let factor = picture.width.div_ceil(WIDEST);
    let small = if factor > 1 { reduced(&picture, factor) } else { picture };
    let bytes =
        png_bytes(&small).with_context(|| format!("cannot encode {} as PNG for the page", path.display()))?;
    Ok(PagePicture {
        name: file.trim_end_matches(".png").to_string(),
        file: format!("pictures/{file}"),
        width: small.width,
        height: small.height,
        base64: base64(&bytes),
    })
}

/// Each pixel is the mean of `factor x factor` pixels in linear light; remainders at the edges are dropped.
fn reduced(picture: &Srgb8Picture, factor: u32) -> Srgb8Picture {
    let linear: Vec<f64> = (0..=255).map(to_linear_f64).collect();
    let (width, height) = ((picture.width / factor).max(1), (picture.height / factor).max(1));
    let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
    for y in 0..height {
        for x in 0..width {
            let mut sums = [0.0; 4];
            let mut count = 0.0;
            for from_y in (y * factor..(y + 1) * factor).filter(|&y| y < picture.height) {
                for from_x in x * factor..(x + 1) * factor {
                    let at = (from_y as usize * picture.width as usize + from_x as usize) * 4;
                    let pixel = &picture.rgba[at..at + 4];
                    (0..3).for_each(|c| sums[c] += linear[usize::from(pixel[c])]);
                    sums[3] += f64::from(pixel[3]);
                    count += 1.0;
                }
            }
            rgba.extend(sums[..3].iter().map(|sum| from_linear_f64(sum / count)));
            rgba.push((sums[3] / count).round() as u8);
        }
    }
    Srgb8Picture { width, height, rgba }
}

fn png_bytes(picture: &Srgb8Picture) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, picture.width, picture.height);
    // An opaque picture needs no alpha channel, which saves a quarter.
    let opaque = picture.rgba.iter().skip(3).step_by(4).all(|&alpha| alpha == 255);
    encoder.set_color(if opaque { png::ColorType::Rgb } else { png::ColorType::Rgba });
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_compression(png::Compression::High);
    let mut png = encoder.write_header()?;
    match opaque {
        true => {
            let rgb: Vec<u8> = picture.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
            png.write_image_data(&rgb)?;
        }
        false => png.write_image_data(&picture.rgba)?,
    }
    png.finish()?;
    Ok(bytes)
}

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let word =
            three.iter().fold(0u32, |word, &byte| word << 8 | u32::from(byte)) << (8 * (3 - three.len()));
        for place in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * place)) as usize & 63];
            text.push(if place <= three.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_matches_the_standard() {
        let words = ["", "f", "fo", "foo", "foob", "fooba", "foobar"];
        let coded = ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"];
        assert_eq!(words.map(|word| base64(word.as_bytes())), coded);
        assert_eq!(base64(&[255, 239, 190]), "/+++");
    }

    #[test]
    fn a_reduced_picture_keeps_its_mean_light() {
        // A black and white chessboard averages to half the light: 188 in sRGB, not 128.
        let pixel = |n: u32| if (n % 6 + n / 6).is_multiple_of(2) { [0, 0, 0, 255] } else { [255; 4] };
        let picture = Srgb8Picture { width: 6, height: 4, rgba: (0..24).flat_map(pixel).collect() };
        let small = reduced(&picture, 2);
        assert_eq!((small.width, small.height), (3, 2));
        assert!(small.rgba.chunks(4).all(|pixel| pixel == [188, 188, 188, 255]), "{:?}", small.rgba);
    }
}
