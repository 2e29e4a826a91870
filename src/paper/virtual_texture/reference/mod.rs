//! The paper's steps on the CPU, written from the paper: in integers if the result is an integer, otherwise in f64.
//! Plain and slow; shares no code with the shaders.

pub mod picture;
pub mod stage1;

use crate::math::pyramid::{Pyramid, TileId};
use std::collections::BTreeSet;

/// The visible tiles of a frame's request image: the reference for all variants of stages 2 and 3. `requests` holds
/// (q, i, j) for each pixel, with (i, j) in level 0's grid. Pixels of resident levels and of the background need no
/// tile.
pub fn visible_tiles(requests: &[[u32; 3]], pyramid: &Pyramid) -> BTreeSet<TileId> {
    let mut tiles = BTreeSet::new();
    for &[q, i, j] in requests {
        if q <= pyramid.coarsest_level() - pyramid.resident_levels() {
            // Section 3: i' = floor(i / 2^q), j' = floor(j / 2^q).
            tiles.insert(TileId { level: q, row: i / 2u32.pow(q), column: j / 2u32.pow(q) });
        }
    }
    tiles
}

/// The triples that stage 3 lists with level-0 tile addresses: each distinct (q, i, j) of `requests` once.
pub fn distinct_triples(requests: &[[u32; 3]], pyramid: &Pyramid) -> BTreeSet<[u32; 3]> {
    requests
        .iter()
        .filter(|[q, ..]| *q <= pyramid.coarsest_level() - pyramid.resident_levels())
        .copied()
        .collect()
}

/// The tiles of a streamed level that hold the texels from `first` to `last` (column, row). These texels may lie beyond
/// the texture's edges: columns wrap, and beyond a pole the rows of the opposite meridian follow.
pub fn tiles_of_texels(pyramid: &Pyramid, level: u32, first: [i64; 2], last: [i64; 2]) -> BTreeSet<TileId> {
    let [width, height] = pyramid.level_size(level).map(i64::from);
    let side = i64::from(pyramid.tile_size());
    let mut tiles = BTreeSet::new();
    for row in first[1].div_euclid(side)..=last[1].div_euclid(side) {
        for column in first[0].div_euclid(side)..=last[0].div_euclid(side) {
            let (x, y) = (column * side, row * side);
            let (x, y) = match y.rem_euclid(2 * height) {
                y if y < height => (x, y),
                y => (x + width / 2, 2 * height - 1 - y),
            };
            let (row, column) = ((y / side) as u32, (x.rem_euclid(width) / side) as u32);
            tiles.insert(TileId { level, row, column });
        }
    }
    tiles
}

/// The number of points that stage 2's geometry shader emits (section 2.2) for a request image with `width` pixels per
/// row: one per pixel of a streamed level. With `memo`, a pixel emits no point if its triple equals the last triple
/// that its block emitted.
pub fn emitted_points(
    requests: &[[u32; 3]],
    width: u32,
    pyramid: &Pyramid,
    [block_width, block_height]: [u32; 2],
    memo: bool,
) -> u64 {
    let height = requests.len() as u32 / width;
    let mut points = 0;
    for first_row in (0..height).step_by(block_height as usize) {
        for first_column in (0..width).step_by(block_width as usize) {
            let mut last = None;
            for row in first_row..(first_row + block_height).min(height) {
                for column in first_column..(first_column + block_width).min(width) {
                    let triple = requests[(row * width + column) as usize];
                    let streamed = triple[0] <= pyramid.coarsest_level() - pyramid.resident_levels();
                    if streamed && !(memo && last == Some(triple)) {
                        points += 1;
                        last = Some(triple);
                    }
                }
            }
        }
    }
    points
}

/// A pixel's texture coordinate and its derivatives, in units of the whole texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelDerivatives {
    pub s: f64,
    pub t: f64,
    pub dsdx: f64,
    pub dtdx: f64,
    pub dsdy: f64,
    pub dtdy: f64,
}

/// The result of section 2.1 for one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triple {
    /// e: the unclamped level; minus infinity if the footprint is a point, NaN if the footprint is not finite.
    pub e: f64,
    pub q: u32,
    pub i: u32,
    pub j: u32,
}

/// Stage 1's formula as printed. The paper leaves two cases open: here dmax = 0 gives level 0, and a footprint that
/// is not finite gives the first resident level (L - L' + 1).
pub fn triple(at: &PixelDerivatives, pyramid: &Pyramid, max_anisotropy: u32) -> Triple {
    let [w, h] = pyramid.level_size(0).map(f64::from);
    let [columns, rows] = pyramid.tile_grid(0).map(f64::from);
    let i = (rows * at.t).floor().max(0.0).min(rows - 1.0);
    let j = (columns * at.s).floor().max(0.0).min(columns - 1.0);
    let (s_x, s_y, t_x, t_y) = (w * at.dsdx, w * at.dsdy, h * at.dtdx, h * at.dtdy);
    let r1 = s_x * s_x + t_x * t_x;
    let r2 = s_y * s_y + t_y * t_y;
    let first_resident = f64::from(pyramid.coarsest_level() - pyramid.resident_levels() + 1);
    let (e, q) = if !(r1.is_finite() && r2.is_finite()) {
        (f64::NAN, first_resident)
    } else if r1.max(r2) == 0.0 {
        (f64::NEG_INFINITY, 0.0)
    } else {
        let (dmax2, dmin2) = (r1.max(r2), r1.min(r2));
        let n_a = (dmax2 / dmin2).sqrt().ceil().min(f64::from(max_anisotropy));
        let e = 0.5 * dmax2.log2() - n_a.log2();
        (e, e.floor().clamp(0.0, first_resident))
    };
    Triple { e, q: q as u32, i: i as u32, j: j as u32 }
}

/// How far a GPU may deviate from the reference at one pixel, in the units of [`PixelDerivatives`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Tolerance of s and of t.
    pub coordinate: [f64; 2],
    /// Tolerance of each derivative with respect to x and y: [ds, dt].
    pub derivative: [f64; 2],
}

/// Every triple that section 2.1 can give for a footprint within `tolerance` of `at`: inclusive intervals of q, i, j.
pub fn possible_triples(
    at: &PixelDerivatives,
    tolerance: &Tolerance,
    pyramid: &Pyramid,
    max_anisotropy: u32,
) -> [[u32; 2]; 3] {
    let moved = |sign: f64| PixelDerivatives {
        s: at.s + sign * tolerance.coordinate[0],
        t: at.t + sign * tolerance.coordinate[1],
        ..*at
    };
    let (low, high) =
        (triple(&moved(-1.0), pyramid, max_anisotropy), triple(&moved(1.0), pyramid, max_anisotropy));
    let [w, h] = pyramid.level_size(0).map(f64::from);
    // |r| changes by at most |(w ds, h dt)|. This bounds the lengths of both sides, and thus e.
    let reach = (w * tolerance.derivative[0]).hypot(h * tolerance.derivative[1]);
    let sides = [(w * at.dsdx).hypot(h * at.dtdx), (w * at.dsdy).hypot(h * at.dtdy)];
    let first_resident = pyramid.coarsest_level() - pyramid.resident_levels() + 1;
    if !(sides[0].is_finite() && sides[1].is_finite() && reach.is_finite()) {
        return [[0, first_resident], [low.i, high.i], [low.j, high.j]];
    }
    let [min, max] = [-reach, reach].map(|by| sides.map(|side| (side + by).max(0.0)));
    let [longest, shortest] = [f64::max, f64::min].map(|of| [min, max].map(|[a, b]| of(a, b)));
    // The sides may be equally long if their intervals overlap. Only then is nA = 1.
    let ratios = [(longest[0] / shortest[1]).max(1.0), longest[1] / shortest[0]];
    let [fewest, largest] = ratios.map(|ratio| ratio.ceil().min(f64::from(max_anisotropy)));
    let level = |length: f64, n_a: f64| {
        (length.log2() - n_a.log2()).floor().clamp(0.0, f64::from(first_resident)) as u32
    };
    let q = [level(longest[0], largest), level(longest[1], fewest)];
    [q, [low.i, high.i], [low.j, high.j]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pyramid() -> Pyramid {
        Pyramid::new(18, 17, 9, 4, None).expect("the paper's")
    }

    /// A square footprint in the texture's middle. Its side is `texels` texels of level 0.
    fn square(texels: f64) -> PixelDerivatives {
        let [w, h] = pyramid().level_size(0).map(f64::from);
        PixelDerivatives { s: 0.5, t: 0.5, dsdx: texels / w, dtdx: 0.0, dsdy: 0.0, dtdy: texels / h }
    }

    #[test]
    fn a_footprint_of_one_texel_requests_level_0_and_one_of_two_texels_level_1() {
        for (texels, q) in [(1.0, 0), (1.999, 0), (2.0, 1), (3.999, 1), (4.0, 2), (0.01, 0), (1e9, 9)] {
            assert_eq!(triple(&square(texels), &pyramid(), 1).q, q, "{texels} texels");
        }
    }

    #[test]
    fn anisotropy_lowers_the_level_by_log2_of_at_most_na() {
        let [w, h] = pyramid().level_size(0).map(f64::from);
        let long = PixelDerivatives { s: 0.5, t: 0.5, dsdx: 16.0 / w, dtdx: 0.0, dsdy: 0.0, dtdy: 1.0 / h };
        for (n_a, q) in [(1, 4), (2, 3), (4, 2), (8, 1), (16, 0), (64, 0)] {
            assert_eq!(triple(&long, &pyramid(), n_a).q, q, "NA = {n_a}");
        }
        assert_eq!(triple(&square(16.0), &pyramid(), 16).q, 4, "a square footprint has nA = 1");
    }

    #[test]
    fn a_footprint_of_0_gives_level_0_and_one_that_is_not_finite_the_first_resident_level() {
        assert_eq!(triple(&square(0.0), &pyramid(), 16).q, 0);
        for bad in [f64::NAN, f64::INFINITY] {
            assert_eq!(triple(&square(bad), &pyramid(), 16).q, 9);
        }
    }

    #[test]
    fn s_and_t_equal_to_one_are_the_last_tile() {
        let at = PixelDerivatives { s: 1.0, t: 1.0, ..square(1.0) };
        let found = triple(&at, &pyramid(), 1);
        assert_eq!((found.i, found.j), (255, 511));
    }

    #[test]
    fn a_tile_seen_at_two_of_its_cells_is_one_tile() {
        let requests = [[1, 4, 6], [1, 5, 7], [1, 6, 7], [9, 0, 0], [u32::MAX; 3]];
        assert_eq!(visible_tiles(&requests, &pyramid()).len(), 2);
        assert_eq!(distinct_triples(&requests, &pyramid()).len(), 3);
    }

    #[test]
    fn the_memo_skips_repetitions_within_a_block_only() {
        const A: [u32; 3] = [0, 1, 1];
        const B: [u32; 3] = [0, 1, 2];
        const RESIDENT: [u32; 3] = [9, 0, 0];
        // Two blocks of 2 x 2 side by side. Pixels of the resident tail emit no point and do not change the memo. With
        // the memo, the left block emits 1 point and the right block 3.
        let requests = [A, A, A, B, RESIDENT, A, B, A];
        let points = |block, memo| emitted_points(&requests, 4, &pyramid(), block, memo);
        assert_eq!((points([2, 2], false), points([2, 2], true)), (7, 4), "1 and 3");
        assert_eq!((points([1, 1], true), points([4, 2], true)), (7, 5));
        assert_eq!(points([4, 1], true), 2 + 3, "a row of RESIDENT A B A after a row of A A A B");
    }

    #[test]
    fn a_footprint_far_from_a_rounding_border_has_one_outcome_and_near_it_two() {
        let tolerance = Tolerance { coordinate: [1e-9; 2], derivative: [1e-10; 2] };
        let clear = PixelDerivatives { s: 0.501, t: 0.501, ..square(3.0) };
        assert_eq!(possible_triples(&clear, &tolerance, &pyramid(), 1), [[1, 1], [128, 128], [256, 256]]);
        let edge = PixelDerivatives { s: 0.5, t: 0.501, ..square(2.0) };
        assert_eq!(possible_triples(&edge, &tolerance, &pyramid(), 1), [[0, 1], [128, 128], [255, 256]]);
        // The sides of a square are equal, or rounding makes one longer: nA = 1 or 2.
        assert_eq!(possible_triples(&clear, &tolerance, &pyramid(), 16)[0], [0, 1]);
        let long = PixelDerivatives { dsdx: 2.5 * clear.dsdx, ..clear };
        assert_eq!(possible_triples(&long, &tolerance, &pyramid(), 16)[0], [1, 1], "nA = 3 of 7.5 texels");
    }
}
