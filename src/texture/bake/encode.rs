//! RGBA8 pictures as BC1.

use crate::math::pyramid::Pyramid;
use texpresso::{Algorithm, COLOUR_WEIGHTS_UNIFORM, Format, Params};

/// Range fit with equal weights takes 18 ms for a tile of 520 x 520 texels. Its RMS error is 3.8, 1.9 and 2.3 codes of
/// 255 (Himalaya, Sahara, Alaska; one or two octaves finer than the imagery). Cluster fit takes 480-760 ms and has
/// errors of 3.0, 1.6 and 1.9 codes: a fifth less error in thirty times the time (hours for 2^16 x 2^15 texels).
const PARAMS: Params =
    Params { algorithm: Algorithm::RangeFit, weights: COLOUR_WEIGHTS_UNIFORM, weigh_colour_by_alpha: false };

/// Encodes both pictures of a stored tile.
pub fn bc1_tile(pyramid: &Pyramid, rgba: &[u8], blocks: &mut [u8]) {
    let [fine, coarse] = pyramid.stored_sides().map(|side| side as usize);
    let (fine_rgba, coarse_rgba) = rgba.split_at(4 * fine * fine);
    let (fine_blocks, coarse_blocks) = blocks.split_at_mut(fine * fine / 2);
    bc1(fine_rgba, fine, fine_blocks);
    bc1(coarse_rgba, coarse, coarse_blocks);
}

/// Encodes a square of `side x side` texels (a multiple of 4) into `blocks`, rows of blocks from the north.
/// Alpha is ignored: every texel is opaque.
///
/// Runs on the calling thread: a tile is already one parallel job, and nested parallel loops would let one
/// thread hold many tiles.
pub fn bc1(rgba: &[u8], side: usize, blocks: &mut [u8]) {
    assert!(side.is_multiple_of(4), "side {side}");
    assert_eq!(rgba.len(), side * side * 4);
    assert_eq!(blocks.len() * 8, rgba.len());
    let texels = rgba.as_chunks::<4>().0;
    for (index, block) in blocks.as_chunks_mut::<8>().0.iter_mut().enumerate() {
        let (left, top) = (index % (side / 4) * 4, index / (side / 4) * 4);
        let square = std::array::from_fn(|texel| {
            let [r, g, b, _] = texels[(top + texel / 4) * side + left + texel % 4];
            [r, g, b, 255]
        });
        Format::Bc1.compress_block_masked(square, 0xFFFF, PARAMS, block);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Decodes BC1 by its definition (Direct3D 11 functional specification, 19.5.10): two 5:6:5 colours and 2
    /// bits per texel.
    fn decode(blocks: &[u8], side: usize) -> Vec<u8> {
        let mut rgba = vec![0; side * side * 4];
        for (index, block) in blocks.chunks_exact(8).enumerate() {
            let ends = [0, 2].map(|at| u16::from_le_bytes([block[at], block[at + 1]]));
            let colours = ends.map(|end| {
                [(end >> 11, 31), (end >> 5 & 63, 63), (end & 31, 31)]
                    .map(|(value, max)| f64::from(value) / f64::from(max) * 255.0)
            });
            let indices = u32::from_le_bytes([block[4], block[5], block[6], block[7]]);
            for texel in 0..16 {
                let weight = if ends[0] > ends[1] {
                    [0.0, 1.0, 1.0 / 3.0, 2.0 / 3.0][(indices >> (2 * texel) & 3) as usize]
                } else {
                    [0.0, 1.0, 0.5, f64::NAN][(indices >> (2 * texel) & 3) as usize]
                };
                assert!(!weight.is_nan(), "a transparent texel in block {index}");
                let (x, y) = (index % (side / 4) * 4 + texel % 4, index / (side / 4) * 4 + texel / 4);
                for channel in 0..3 {
                    let value = colours[0][channel] * (1.0 - weight) + colours[1][channel] * weight;
                    rgba[(y * side + x) * 4 + channel] = value.round() as u8;
                }
                rgba[(y * side + x) * 4 + 3] = 255;
            }
        }
        rgba
    }

    #[test]
    fn blocks_of_two_colours_decode_within_565_precision_and_in_place() {
        let side = 20;
        let rgba: Vec<u8> = (0..side * side)
            .flat_map(|index: usize| {
                let (x, y) = (index % side, index / side);
                // The encoder must ignore alpha.
                let shade = if (x + y) % 2 == 0 { 40 } else { 8 * (x / 4 * 5 + y / 4) as u8 + 8 };
                [shade, shade / 2 + 20, 255 - shade, 0]
            })
            .collect();
        let mut blocks = vec![0; side * side / 2];
        bc1(&rgba, side, &mut blocks);
        let worst = |other: &[u8]| {
            let texels = std::iter::zip(rgba.chunks_exact(4), other.chunks_exact(4));
            texels.flat_map(|(a, b)| [0, 1, 2].map(|at| a[at].abs_diff(b[at]))).max().unwrap()
        };
        // Half a step of 5 bits is 4.1.
        assert!(worst(&decode(&blocks, side)) <= 5, "{}", worst(&decode(&blocks, side)));
        // Neighbour test: blocks in another order must fail.
        blocks.rotate_left(8);
        assert!(worst(&decode(&blocks, side)) > 5);
    }
}
