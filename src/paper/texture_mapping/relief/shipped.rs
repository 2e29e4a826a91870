//! Colours and heights from pictures: the reliefs of the scenes `relief-brick` and `relief-rock`.

use super::Relief;
use crate::reference::filter::{luminance, srgb8_to_linear};
use std::io::Cursor;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Two square pictures of one surface. Opposite edges match, so it repeats.
pub struct Shipped {
    /// A JPEG.
    colours: &'static [u8],
    /// A grey PNG whose side is a power of two.
    heights: &'static [u8],
}

/// Origin: scenes/brick-wall.NOTICE.
pub const BRICK_WALL: Shipped = Shipped {
    colours: include_bytes!("../../../../scenes/brick-wall.jpg"),
    heights: include_bytes!("../../../../scenes/brick-wall-heights.png"),
};

/// Origin: scenes/cliff.NOTICE. The heights are coarser than the colours, because the map of 128 x 128 texels is built
/// four times faster than a map of 256 x 256 texels.
pub const CLIFF: Shipped = Shipped {
    colours: include_bytes!("../../../../scenes/cliff.jpg"),
    heights: include_bytes!("../../../../scenes/cliff-heights.png"),
};

impl Shipped {
    /// Texels along a side, and sRGB colours, row by row.
    pub fn picture(&self) -> (usize, Vec<[u8; 3]>) {
        // Scalar code only, so that the bytes are the same on every machine.
        let options = DecoderOptions::new_safe()
            .set_use_unsafe(false)
            .set_strict_mode(true)
            .jpeg_set_out_colorspace(ColorSpace::RGB);
        let bytes = JpegDecoder::new_with_options(ZCursor::new(self.colours), options).decode();
        let bytes = bytes.expect("the shipped pictures are decoded by a test");
        let texels: Vec<[u8; 3]> = bytes.chunks_exact(3).map(|rgb| [rgb[0], rgb[1], rgb[2]]).collect();
        (texels.len().isqrt(), texels)
    }

    /// The mean luminance of the picture, in linear light, over each of `side` x `side` squares. `side` must divide the
    /// picture's side.
    pub fn luminance(&self, side: usize) -> Vec<f32> {
        let (texels, picture) = self.picture();
        assert_eq!(texels % side, 0, "a side of {texels} texels is not a multiple of {side}");
        let across = texels / side;
        let of = |at: usize| {
            let [column, row] = [at % side, at / side].map(|c| c * across);
            let inside = (0..across * across).map(|n| (row + n / across) * texels + column + n % across);
            let sum: f64 = inside.map(|texel| luminance(picture[texel].map(srgb8_to_linear))).sum();
            (sum / (across * across) as f64) as f32
        };
        (0..side * side).map(of).collect()
    }

    /// The relief, with a depth of a quarter of its side.
    pub fn relief(&self) -> Relief {
        let (side, heights) = self.grey().expect("the shipped pictures are decoded by a test");
        Relief { side, depth: side as f32 / 4.0, heights }
    }

    fn grey(&self) -> Result<(usize, Vec<u8>), png::DecodingError> {
        let mut reader = png::Decoder::new(Cursor::new(self.heights)).read_info()?;
        let side = reader.info().width as usize;
        let mut heights = vec![0; side * side];
        reader.next_frame(&mut heights)?;
        Ok((side, heights))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn the_shipped_pictures_decode_and_reach_both_ends_of_their_depth() {
        for (shipped, sides) in [(BRICK_WALL, [256, 256]), (CLIFF, [512, 128])] {
            let reader = png::Decoder::new(Cursor::new(shipped.heights)).read_info().unwrap();
            assert_eq!(reader.info().color_type, png::ColorType::Grayscale);
            let ((side, colours), relief) = (shipped.picture(), shipped.relief());
            assert_eq!(([side, relief.side], colours.len()), (sides, side * side));
            let heights = relief.heights;
            assert_eq!((heights.iter().min(), heights.iter().max()), (Some(&0), Some(&255)));
            let different = colours.into_iter().collect::<BTreeSet<_>>().len();
            assert!(different > 1000, "{different} colours");
        }
    }

    #[test]
    fn luminances_of_squares_are_means_of_those_of_texels() {
        let [fine, coarse] = [512, 128].map(|side| CLIFF.luminance(side));
        let of_square = (0..16).map(|n| fine[(4 * 7 + n / 4) * 512 + 4 * 9 + n % 4]).sum::<f32>() / 16.0;
        assert!((coarse[7 * 128 + 9] - of_square).abs() < 1e-6, "{of_square}");
        assert!(coarse.iter().all(|value| (0.0..=1.0).contains(value)));
    }

    #[test]
    fn opposite_edges_match() {
        for shipped in [BRICK_WALL, CLIFF] {
            let relief = shipped.relief();
            let side = relief.side as i64;
            // The mean step from a column to the next.
            let step = |column: i64| {
                let steps = (0..side).map(|y| (relief.texel(column, y) - relief.texel(column + 1, y)).abs());
                steps.sum::<f32>() / side as f32
            };
            let largest = (0..side - 1).map(step).fold(0.0, f32::max);
            assert!(step(side - 1) <= largest, "{} across the edge, {largest} inside", step(side - 1));
        }
    }
}
