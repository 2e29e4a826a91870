//! The texel beyond a level's edge: one rule for the borders of every source.

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
