//! The texel beyond a level's edge: one rule for the borders of every source.

use crate::math::pyramid::{Pyramid, TileId};

/// The true column and row of the texel at `(x, y)` in a level of `width x height` texels. Columns wrap at
/// the antimeridian; a row beyond a pole is the mirrored row, half a turn away. `y` must lie within one
/// height of the level.
pub fn true_texel([width, height]: [u32; 2], x: i64, y: i64) -> [u32; 2] {
    let rows = i64::from(height);
    assert!((-rows..2 * rows).contains(&y), "row {y} is more than one height outside a level of {rows} rows");
    let (row, turned) = if y < 0 {
        (-1 - y, true)
    } else if y >= rows {
        (2 * rows - 1 - y, true)
    } else {
        (y, false)
    };
    let half_turn = if turned { i64::from(width / 2) } else { 0 };
    let column = (x + half_turn).rem_euclid(i64::from(width));
    // Both are inside the level now, so they fit u32.
    [column as u32, row as u32]
}

/// One of the two pictures of a stored tile: `side x side` RGBA8 texels of a level from `origin`, which may
/// lie outside the level.
pub struct Square<'a> {
    pub origin: [i64; 2],
    pub side: usize,
    pub bytes: &'a mut [u8],
}

impl<'a> Square<'a> {
    /// The picture of the tile's own level, and the one of the next coarser level.
    ///
    /// # Panics
    /// If the pyramid has no such tile, or `bytes` is not exactly one RGBA8 tile.
    pub fn both(pyramid: &Pyramid, tile: TileId, bytes: &'a mut [u8]) -> [Square<'a>; 2] {
        assert_eq!(bytes.len(), pyramid.tile_bytes_rgba8(), "{tile:?} of {pyramid:?}");
        assert!(pyramid.contains(tile), "{tile:?} of {pyramid:?}");
        let [fine_side, coarse_side] = pyramid.stored_sides().map(|side| side as usize);
        let [size, border] = [pyramid.tile_size(), pyramid.border_texels()].map(i64::from);
        let origin = [tile.column, tile.row].map(|index| i64::from(index) * size - border);
        let (fine, coarse) = bytes.split_at_mut(fine_side * fine_side * 4);
        [
            Square { origin, side: fine_side, bytes: fine },
            Square { origin: origin.map(|at| at >> 1), side: coarse_side, bytes: coarse },
        ]
    }

    /// Copies texels of a stored level of `size` texels. Alpha is 255.
    pub fn copy(self, level: &[[u8; 3]], size: [u32; 2]) {
        self.fill(size, |[x, y]| {
            let [r, g, b] = level[y as usize * size[0] as usize + x as usize];
            [r, g, b, 255]
        });
    }

    /// Writes every texel; `texel` gets its true column and row in the level of `size` texels.
    pub fn fill(self, size: [u32; 2], texel: impl Fn([u32; 2]) -> [u8; 4]) {
        let [left, top] = self.origin;
        for (y, line) in self.bytes.chunks_exact_mut(self.side * 4).enumerate() {
            for (x, bytes) in line.chunks_exact_mut(4).enumerate() {
                bytes.copy_from_slice(&texel(true_texel(size, left + x as i64, top + y as i64)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_wrap_and_rows_mirror_half_a_turn_away() {
        assert_eq!(true_texel([8, 4], 3, 2), [3, 2]);
        assert_eq!(true_texel([8, 4], -1, 2), [7, 2]);
        assert_eq!(true_texel([8, 4], 8, 0), [0, 0]);
        assert_eq!(true_texel([8, 4], 1, -1), [5, 0]);
        assert_eq!(true_texel([8, 4], 6, -2), [2, 1]);
        assert_eq!(true_texel([8, 4], 1, 4), [5, 3]);
        assert_eq!(true_texel([8, 4], -1, 5), [3, 2]);
    }
}
