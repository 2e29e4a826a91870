//! The numbering of levels and tiles (paper 1, section 2).
//!
//! Level 0 is the source texture of `2^m x 2^n` texels; level `L = max(m, n)` is one texel. Levels `0 ..=
//! L-L'` are split into tiles of `2^k x 2^k` texels and streamed (the paper's `G2`). The coarsest `L'` levels
//! always stay in video memory (`G1`). Row 0 is the north edge, column 0 is longitude -180.

use thiserror::Error;

/// One tile: level, row and column in the level's own grid (the paper's `q`, `i'`, `j'`).
/// Ordered by level, then row, then column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TileId {
    pub level: u32,
    pub row: u32,
    pub column: u32,
}

impl TileId {
    /// The tile of the next coarser level that covers this one.
    pub fn parent(self) -> TileId {
        self.ancestor(1)
    }

    /// The tile `levels` levels coarser that covers this one.
    pub fn ancestor(self, levels: u32) -> TileId {
        TileId { level: self.level + levels, row: self.row >> levels, column: self.column >> levels }
    }
}

/// "level 3, row 5, column 7"
impl std::fmt::Display for TileId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "level {}, row {}, column {}", self.level, self.row, self.column)
    }
}

/// Invalid parameters of a pyramid.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum PyramidError {
    #[error("a texture of 2^{0} x 2^{1} texels is outside 2^1 .. 2^20 a side")]
    Size(u32, u32),
    #[error(
        "a tile of 2^{0} texels a side is outside 2^4 .. 2^{max}, for a texture of 2^{1} x 2^{2} texels",
        max = (.1).min(.2).min(&10)
    )]
    Tile(u32, u32, u32),
    #[error("a border of {0} texels is wider than half a tile")]
    Border(u32),
    #[error(
        "{resident} resident levels are outside {min} ..= {max}: a streamed level must consist of whole tiles"
    )]
    Resident { resident: u32, min: u32, max: u32 },
}

/// Sizes of one tiled texture with all its levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pyramid {
    width_log2: u32,
    height_log2: u32,
    tile_log2: u32,
    border_texels: u32,
    resident_levels: u32,
}

impl Pyramid {
    /// A texture of `2^width_log2 x 2^height_log2` texels in tiles of `2^tile_log2` (payload) with
    /// `border_texels` on each side. `resident_levels` is the paper's L'. `None` takes the smallest value for
    /// which every streamed level consists of whole tiles.
    ///
    /// # Errors
    /// [`PyramidError`] names the value that is out of range and the range.
    pub fn new(
        width_log2: u32,
        height_log2: u32,
        tile_log2: u32,
        border_texels: u32,
        resident_levels: Option<u32>,
    ) -> Result<Self, PyramidError> {
        let narrow = width_log2.min(height_log2);
        if narrow < 1 || width_log2.max(height_log2) > 20 {
            return Err(PyramidError::Size(width_log2, height_log2));
        }
        if !(4..=10).contains(&tile_log2) || tile_log2 > narrow {
            return Err(PyramidError::Tile(tile_log2, width_log2, height_log2));
        }
        if border_texels > 1 << (tile_log2 - 1) {
            return Err(PyramidError::Border(border_texels));
        }
        let coarsest = width_log2.max(height_log2);
        let min = coarsest - (narrow - tile_log2);
        let resident = resident_levels.unwrap_or(min);
        if !(min..=coarsest).contains(&resident) {
            return Err(PyramidError::Resident { resident, min, max: coarsest });
        }
        Ok(Self { width_log2, height_log2, tile_log2, border_texels, resident_levels: resident })
    }

    /// m: level 0 is `2^m` texels wide.
    pub fn width_log2(&self) -> u32 {
        self.width_log2
    }

    /// n: level 0 is `2^n` texels high.
    pub fn height_log2(&self) -> u32 {
        self.height_log2
    }

    /// k: a tile's payload is `2^k x 2^k` texels.
    pub fn tile_log2(&self) -> u32 {
        self.tile_log2
    }

    /// A tile's payload side in texels, without border.
    pub fn tile_size(&self) -> u32 {
        1 << self.tile_log2
    }

    /// b: texels of the neighbours stored on each side of a tile. The stored picture of the next coarser level has
    /// half this border. If b is odd, that is (b + 1)/2 texels before the payload and (b - 1)/2 after it.
    pub fn border_texels(&self) -> u32 {
        self.border_texels
    }

    /// L: the index of the coarsest level, one texel.
    pub fn coarsest_level(&self) -> u32 {
        self.width_log2.max(self.height_log2)
    }

    /// L': the number of coarsest levels that are always resident (`G1`).
    pub fn resident_levels(&self) -> u32 {
        self.resident_levels
    }

    /// L-L'+1: the finest level of `G1`, and one more than the coarsest streamed level.
    pub fn first_resident_level(&self) -> u32 {
        self.coarsest_level() - self.resident_levels + 1
    }

    /// Width and height of a level in texels.
    pub fn level_size(&self, level: u32) -> [u32; 2] {
        assert!(level <= self.coarsest_level(), "level {level} of {self:?}");
        [((1u32 << self.width_log2) >> level).max(1), ((1u32 << self.height_log2) >> level).max(1)]
    }

    /// Columns and rows of tiles of a streamed level (the paper's `wT^s`, `hT^s`).
    pub fn tile_grid(&self, level: u32) -> [u32; 2] {
        assert!(level < self.first_resident_level(), "level {level} of {self:?} has no tiles");
        self.level_size(level).map(|side| side >> self.tile_log2)
    }

    /// All tiles of all streamed levels.
    pub fn tile_count(&self) -> u64 {
        (0..self.first_resident_level())
            .map(|level| self.tile_grid(level).map(u64::from))
            .map(|[columns, rows]| columns * rows)
            .sum()
    }

    /// A tile's index in the order level, row, column: `0 .. tile_count()`.
    pub fn tile_index(&self, tile: TileId) -> u64 {
        let [columns, rows] = self.tile_grid(tile.level);
        assert!(tile.column < columns && tile.row < rows, "{tile:?} outside {columns} x {rows} tiles");
        let finer: u64 = (0..tile.level)
            .map(|level| self.tile_grid(level).map(u64::from))
            .map(|[columns, rows]| columns * rows)
            .sum();
        finer + u64::from(tile.row) * u64::from(columns) + u64::from(tile.column)
    }

    /// True if the tile exists in this pyramid.
    pub fn contains(&self, tile: TileId) -> bool {
        tile.level < self.first_resident_level() && {
            let [columns, rows] = self.tile_grid(tile.level);
            tile.column < columns && tile.row < rows
        }
    }

    /// Sides in texels of the two pictures stored for a tile, border included: its own level, and the next
    /// coarser one. The second is exactly half the first, so both fit the two mip levels of one image.
    pub fn stored_sides(&self) -> [u32; 2] {
        let side = self.tile_size() + 2 * self.border_texels;
        [side, side / 2]
    }

    /// Bytes of one stored tile in RGBA8: both pictures, rows tightly packed, own level first.
    pub fn tile_bytes_rgba8(&self) -> usize {
        self.stored_sides().iter().map(|&side| side as usize * side as usize * 4).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_texture_has_512_x_256_tiles_and_nine_streamed_levels() {
        let pyramid = Pyramid::new(18, 17, 9, 4, None).unwrap();
        assert_eq!(pyramid.coarsest_level(), 18);
        assert_eq!(pyramid.resident_levels(), 10);
        assert_eq!(pyramid.tile_grid(0), [512, 256]);
        assert_eq!(pyramid.tile_grid(8), [2, 1]);
        assert_eq!(pyramid.level_size(9), [512, 256]);
        assert_eq!(pyramid.level_size(18), [1, 1]);
        // The paper's count is 174,763: it includes the half-empty tile of level 9, which is resident here.
        assert_eq!(pyramid.tile_count(), 174_762);
        assert_eq!(pyramid.stored_sides(), [520, 260]);
    }

    #[test]
    fn every_tile_has_its_own_index_in_order() {
        let pyramid = Pyramid::new(7, 6, 4, 2, None).unwrap();
        let mut expected = 0;
        for level in 0..pyramid.first_resident_level() {
            let [columns, rows] = pyramid.tile_grid(level);
            for row in 0..rows {
                for column in 0..columns {
                    assert_eq!(pyramid.tile_index(TileId { level, row, column }), expected);
                    expected += 1;
                }
            }
        }
        assert_eq!(expected, pyramid.tile_count());
    }

    #[test]
    fn a_streamed_level_with_partial_tiles_is_refused() {
        let error = Pyramid::new(18, 17, 9, 4, Some(9)).unwrap_err();
        assert_eq!(error, PyramidError::Resident { resident: 9, min: 10, max: 18 });
    }
}
