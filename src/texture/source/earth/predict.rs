//! Smooth prediction of the four children of a texel.
//!
//! This is average interpolation. Along each axis, a quartic is chosen whose means over five texels equal these texels.
//! Its means over the two halves of the middle texel are the children (Donoho, "Smooth wavelet decompositions with
//! blocky coefficient kernels", 1993, degree 4; two axes as a tensor product). Repeated for ever finer levels, the
//! predicted values of linear light converge to a function with a continuous slope. With three texels (degree 2) the
//! limit has creases along rows and columns.

/// Texels that a prediction reads on each side.
pub const REACH: usize = 2;

/// Splits the middle one of five texels into halves: returns half the difference of their means. Before rounding it is
/// exact up to degree 4. Rounds towards zero, so that mirrored input gives mirrored output. The numerator is at most 25
/// times the texels' range of 2^24, which fits i32.
#[inline(always)]
fn slope<const N: usize>(before: [&[i32; N]; 2], after: [&[i32; N]; 2]) -> [i32; N] {
    let numerator = |n: usize| 22 * (after[0][n] - before[1][n]) - 3 * (after[1][n] - before[0][n]);
    std::array::from_fn(|n| numerator(n) / 128)
}

/// The predictions of a rectangle of texels of `N` channels.
pub struct Prediction<'a, const N: usize> {
    texels: &'a [[i32; N]],
    width: usize,
    /// East-west slopes, rows of `width - 2 REACH`.
    across: Vec<[i32; N]>,
}

impl<'a, const N: usize> Prediction<'a, N> {
    /// `texels`: rows of `width`.
    pub fn new(texels: &'a [[i32; N]], width: usize) -> Self {
        let mut across = Vec::with_capacity(texels.len());
        for row in texels.chunks_exact(width) {
            across.extend(row.array_windows().map(|[a, b, _, d, e]| slope([a, b], [d, e])));
        }
        Self { texels, width, across }
    }

    /// For the texels `x ..` of row `y`, both at least [`REACH`] from the rectangle's edge: the east-west,
    /// south-north and diagonal Haar coefficients from which [`children`] builds the children.
    pub fn row(&self, x: usize, y: usize, coefficients: &mut [[[i32; N]; 3]]) {
        let count = coefficients.len();
        let line = |shift: usize| &self.texels[(y + shift - REACH) * self.width + x..][..count];
        let inner = self.width - 2 * REACH;
        let across = |shift: usize| &self.across[(y + shift - REACH) * inner + x - REACH..][..count];
        let lines = [0, 1, 3, 4].map(line);
        let slopes = [0, 1, 2, 3, 4].map(across);
        for (index, three) in coefficients.iter_mut().enumerate() {
            let down = slope([&lines[0][index], &lines[1][index]], [&lines[2][index], &lines[3][index]]);
            let [a, b, _, d, e] = slopes.map(|line| &line[index]);
            *three = [slopes[2][index], down, slope([a, b], [d, e])];
        }
    }
}

/// North-west, north-east, south-west and south-east child. Their sum is four times the parent, for any
/// coefficients.
#[inline(always)]
pub fn children(parent: i32, [a, b, c]: [i32; 3]) -> [i32; 4] {
    [parent - a - b + c, parent + a - b - c, parent - a + b - c, parent + a + b + c]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of 128 x^4 over `from ..= from + length`; texels of the rectangle are one wide.
    fn quartic(from: f64, length: f64) -> f64 {
        let integral = |x: f64| 128.0 * x.powi(5) / 5.0;
        (integral(from + length) - integral(from)) / length
    }

    #[test]
    fn the_prediction_is_exact_for_a_quartic_on_either_axis() {
        // Halves of [0, 1]: means 1.6 and 49.6, so the coefficient is 24 up to the rounding of the texels.
        let expected = (quartic(0.5, 0.5) - quartic(0.0, 0.5)) / 2.0;
        let mean = |x: usize| quartic(x as f64 - 2.0, 1.0).round() as i32;
        let texels: Vec<[i32; 2]> = (0..25).map(|index| [mean(index % 5), mean(index / 5)]).collect();
        let mut found = [[[0; 2]; 3]];
        Prediction::new(&texels, 5).row(2, 2, &mut found);
        let [across, down, diagonal] = found[0];
        assert!((f64::from(across[0]) - expected).abs() <= 1.0, "{across:?}, not {expected}");
        assert_eq!((across[0], across[1], down[0], diagonal), (down[1], 0, 0, [0, 0]));
    }

    #[test]
    fn the_prediction_of_a_saddle_is_diagonal() {
        // 256 x y: children lie a quarter texel from the centre, so their values are +-16.
        let texels: Vec<[i32; 1]> = (0..25).map(|index| [256 * (index % 5 - 2) * (index / 5 - 2)]).collect();
        let mut found = [[[0]; 3]];
        Prediction::new(&texels, 5).row(2, 2, &mut found);
        assert_eq!(found, [[[0], [0], [16]]]);
        assert_eq!(children(0, [0, 0, 16]), [16, -16, -16, 16]);
    }
}
