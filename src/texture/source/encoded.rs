//! A generated texture whose tiles are encoded to BC1 when read: an eighth of the memory.

use super::{TileError, TileFormat, TileSource};
use crate::math::pyramid::{Pyramid, TileId};
use crate::texture::bake::encode_bc1_tile;
use std::sync::Arc;

/// Encodes RGBA8 tiles of another source as BC1. Resident levels stay RGBA8; the tile pool encodes the parts that it
/// uploads.
pub struct Encoded(Arc<dyn TileSource>);

impl Encoded {
    /// `source` has RGBA8 tiles whose stored sides are multiples of 4.
    pub fn new(source: Arc<dyn TileSource>) -> Encoded {
        assert_eq!(source.format(), TileFormat::Rgba8, "{}", source.describe());
        let sides = source.pyramid().stored_sides();
        assert!(sides.iter().all(|side| side.is_multiple_of(4)), "sides of {sides:?} in blocks of 4");
        Encoded(source)
    }
}

impl TileSource for Encoded {
    fn describe(&self) -> String {
        format!("{}, as bc1", self.0.describe())
    }

    fn pyramid(&self) -> Pyramid {
        self.0.pyramid()
    }

    fn format(&self) -> TileFormat {
        TileFormat::Bc1
    }

    fn read_tile(&self, tile: TileId, bytes: &mut [u8]) -> Result<(), TileError> {
        let pyramid = self.pyramid();
        let mut rgba = vec![0; pyramid.tile_bytes_rgba8()];
        self.0.read_tile(tile, &mut rgba)?;
        encode_bc1_tile(&pyramid, &rgba, bytes);
        Ok(())
    }

    fn read_resident_level(&self, level: u32) -> Result<Vec<u8>, TileError> {
        self.0.read_resident_level(level)
    }
}

#[cfg(test)]
mod tests {
    use super::super::ruler::Ruler;
    use super::*;
    use crate::texture::bake::encode_bc1;

    #[test]
    fn both_pictures_of_a_tile_are_encoded_one_after_the_other() {
        let pyramid = Pyramid::new(8, 7, 5, 4, None).unwrap();
        let ruler = Arc::new(Ruler::new(pyramid));
        let encoded = Encoded::new(ruler.clone());
        assert_eq!((encoded.format(), encoded.pyramid()), (TileFormat::Bc1, pyramid));
        let tile = TileId { level: 1, row: 1, column: 2 };
        let mut rgba = vec![0; TileFormat::Rgba8.tile_bytes(&pyramid)];
        ruler.read_tile(tile, &mut rgba).unwrap();
        let mut bytes = vec![0; TileFormat::Bc1.tile_bytes(&pyramid)];
        encoded.read_tile(tile, &mut bytes).unwrap();
        // 40 x 40 and 20 x 20 texels in blocks of 16 texels and 8 bytes.
        assert_eq!(bytes.len(), 800 + 200);
        let mut expected = [vec![0; 800], vec![0; 200]];
        encode_bc1(&rgba[..6400], 40, &mut expected[0]);
        encode_bc1(&rgba[6400..], 20, &mut expected[1]);
        assert_eq!(bytes, expected.concat());
        assert_eq!(encoded.read_resident_level(3).unwrap(), ruler.read_resident_level(3).unwrap());
    }

    #[test]
    #[should_panic(expected = "blocks of 4")]
    fn a_border_that_cuts_a_block_panics() {
        Encoded::new(Arc::new(Ruler::new(Pyramid::new(8, 7, 5, 2, None).unwrap())));
    }
}
