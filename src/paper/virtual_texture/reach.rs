//! The reach: the neighbours of a pixel's tile from which its filter also reads texels (not in the paper). Beyond a
//! tile's border the filter looks up single texels or samples through the page table. So these tiles must be listed.
//! Stage 1 stores the reach in the highest four bits of the request image's first word, and every method adds the tiles
//! to its list.
//!
//! No filter reaches further than half a tile, so each axis has at most one neighbour. Columns and rows have two bits
//! each: 0 for none, 1 for the next tile, 2 for the previous one.

use crate::math::pyramid::Pyramid;

/// The reach is in the highest four bits of the word.
const SHIFT: u32 = 28;

/// Splits the first word of a stored request into its value and the reach. All ones is the background, without reach.
pub fn split(word: u32) -> (u32, u32) {
    if word == u32::MAX { (word, 0) } else { (word & ((1 << SHIFT) - 1), word >> SHIFT) }
}

/// The triples of a pixel's neighbouring tiles, with (i, j) in level 0's grid. Columns wrap; beyond a pole lies the
/// same row, half a turn away.
pub fn neighbours(pyramid: &Pyramid, [q, i, j]: [u32; 3], reach: u32) -> impl Iterator<Item = [u32; 3]> {
    let step = |bits: u32| [0, 1, -1][bits as usize];
    let (across, down) = (step(reach & 3), step(reach >> 2));
    let places = [(across, 0), (0, down), (across, down)];
    let kept = [across != 0, down != 0, across != 0 && down != 0];
    let [columns, rows] = if reach == 0 { [1; 2] } else { pyramid.tile_grid(q).map(|side| side as i32) };
    places.into_iter().zip(kept).filter(|(_, kept)| *kept).map(move |((across, down), _)| {
        let (row, column) = ((i >> q) as i32 + down, (j >> q) as i32 + across);
        let (row, turn) = match (0..rows).contains(&row) {
            true => (row, 0),
            false => (row - down, columns / 2),
        };
        [q, (row as u32) << q, ((column + turn).rem_euclid(columns) as u32) << q]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_background_has_no_reach_and_no_triple_is_taken_for_it() {
        assert_eq!(split(u32::MAX), (u32::MAX, 0));
        assert_eq!(split(10 << SHIFT | 3), (3, 10));
        assert_eq!(split(3), (3, 0));
    }

    #[test]
    fn neighbours_wrap_at_the_antimeridian_and_turn_at_a_pole() {
        // 16 x 8 tiles at level 0, 8 x 4 at level 1.
        let pyramid = Pyramid::new(8, 7, 4, 2, None).unwrap();
        let of = |triple, reach| neighbours(&pyramid, triple, reach).collect::<Vec<_>>();
        assert_eq!(of([0, 3, 5], 0), [[0; 3]; 0]);
        assert_eq!(of([0, 3, 5], 1), [[0, 3, 6]]);
        assert_eq!(of([0, 3, 0], 2), [[0, 3, 15]]);
        assert_eq!(of([0, 3, 15], 1 | 1 << 2), [[0, 3, 0], [0, 4, 15], [0, 4, 0]]);
        assert_eq!(of([0, 0, 5], 2 << 2), [[0, 0, 13]]);
        assert_eq!(of([0, 7, 5], 2 | 1 << 2), [[0, 7, 4], [0, 7, 13], [0, 7, 12]]);
        // A tile of level 1 covers several cells of level 0; the first cell names it.
        assert_eq!(of([1, 5, 7], 1), [[1, 4, 8]]);
        assert_eq!(of([1, 7, 15], 1 | 1 << 2), [[1, 6, 0], [1, 6, 6], [1, 6, 8]]);
    }
}
