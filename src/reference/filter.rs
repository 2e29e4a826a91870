//! Texture filtering in f64 and linear light, from the definition: bilinear between the four nearest texel
//! centres of a level, linear between two levels (Williams, "Pyramidal Parametrics", 1983).

/// What lies beyond the texture's edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edges {
    /// Columns wrap at the antimeridian; beyond a pole comes the mirrored row half a turn away.
    Planet,
    /// The edge's own texel.
    Clamp,
}

/// A texture of `2^width_log2 x 2^height_log2` texels and all its coarser levels, as a function.
pub struct Texture<F: Fn(u32, u32, u32) -> [f64; 4]> {
    pub width_log2: u32,
    pub height_log2: u32,
    pub edges: Edges,
    /// `(level, column, row)` to linear red, green, blue, alpha.
    pub texel: F,
}

impl<F: Fn(u32, u32, u32) -> [f64; 4]> Texture<F> {
    /// L: the index of the level of one texel.
    pub fn coarsest_level(&self) -> u32 {
        self.width_log2.max(self.height_log2)
    }

    /// Width and height of a level in texels.
    pub fn level_size(&self, level: u32) -> [u32; 2] {
        [self.width_log2, self.height_log2].map(|side_log2| 1 << side_log2.saturating_sub(level))
    }

    /// The texel at a column and row that may lie outside the level.
    pub fn texel_at(&self, level: u32, column: i64, row: i64) -> [f64; 4] {
        let [width, height] = self.level_size(level).map(i64::from);
        let (column, row) = match self.edges {
            Edges::Clamp => (column.clamp(0, width - 1), row.clamp(0, height - 1)),
            Edges::Planet => {
                // Down one meridian and up the opposite one: 2 x height rows are a full turn.
                let turn = row.rem_euclid(2 * height);
                if turn < height {
                    (column.rem_euclid(width), turn)
                } else {
                    ((column + width / 2).rem_euclid(width), 2 * height - 1 - turn)
                }
            }
        };
        (self.texel)(level, column as u32, row as u32)
    }

    /// The value of one level at (s, t), between the four nearest texel centres.
    pub fn bilinear(&self, level: u32, s: f64, t: f64) -> [f64; 4] {
        let [width, height] = self.level_size(level).map(f64::from);
        let (x, y) = (s * width - 0.5, t * height - 0.5);
        let (column, row) = (x.floor() as i64, y.floor() as i64);
        let (right, down) = (x - x.floor(), y - y.floor());
        let corner = |i: i64, j: i64| self.texel_at(level, column + i, row + j);
        let upper = mix(corner(0, 0), corner(1, 0), right);
        let lower = mix(corner(0, 1), corner(1, 1), right);
        mix(upper, lower, down)
    }

    /// The value at (s, t) and a level of detail `lambda`: below 0 level 0, above L level L.
    pub fn trilinear(&self, lambda: f64, s: f64, t: f64) -> [f64; 4] {
        let coarsest = self.coarsest_level();
        let lambda = lambda.clamp(0.0, f64::from(coarsest));
        let level = lambda.floor();
        let (finer, coarser) = (level as u32, (level as u32 + 1).min(coarsest));
        mix(self.bilinear(finer, s, t), self.bilinear(coarser, s, t), lambda - level)
    }
}

fn mix(a: [f64; 4], b: [f64; 4], part: f64) -> [f64; 4] {
    std::array::from_fn(|i| a[i] * (1.0 - part) + b[i] * part)
}

/// Linear light, 0 ..= 1, of an sRGB byte (IEC 61966-2-1).
pub fn srgb8_to_linear(byte: u8) -> f64 {
    let value = f64::from(byte) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each texel tells its own level, column and row.
    fn telling(edges: Edges) -> Texture<impl Fn(u32, u32, u32) -> [f64; 4]> {
        let texel = |level, column, row| [f64::from(column), f64::from(row), f64::from(level), 1.0];
        Texture { width_log2: 4, height_log2: 3, edges, texel }
    }

    #[test]
    fn a_texels_centre_shows_the_texel_itself() {
        let texture = telling(Edges::Planet);
        assert_eq!(texture.bilinear(0, 5.5 / 16.0, 2.5 / 8.0), [5.0, 2.0, 0.0, 1.0]);
        assert_eq!(texture.bilinear(1, 5.5 / 8.0, 2.5 / 4.0), [5.0, 2.0, 1.0, 1.0]);
    }

    #[test]
    fn between_centres_the_four_nearest_are_mixed() {
        let texture = telling(Edges::Clamp);
        assert_eq!(texture.bilinear(0, 6.0 / 16.0, 2.75 / 8.0), [5.5, 2.25, 0.0, 1.0]);
    }

    #[test]
    fn columns_wrap_and_poles_mirror_half_a_turn_away() {
        let texture = telling(Edges::Planet);
        // Halfway between column 15 and column 0.
        assert_eq!(texture.bilinear(0, 0.0, 0.5 / 8.0)[0], 7.5);
        assert_eq!(texture.bilinear(0, 1.0, 0.5 / 8.0)[0], 7.5);
        assert_eq!(texture.texel_at(0, 3, -1), [11.0, 0.0, 0.0, 1.0]);
        assert_eq!(texture.texel_at(0, 12, 8), [4.0, 7.0, 0.0, 1.0]);
        assert_eq!(texture.texel_at(4, 0, -1), [0.0, 0.0, 4.0, 1.0], "the level of one texel");
        assert_eq!(telling(Edges::Clamp).texel_at(0, -1, 8), [0.0, 7.0, 0.0, 1.0]);
    }

    #[test]
    fn levels_are_mixed_by_the_fraction_and_end_at_both_sides() {
        let texture = telling(Edges::Planet);
        let level = |lambda| texture.trilinear(lambda, 0.3, 0.7)[2];
        assert_eq!((level(1.25), level(-3.0), level(99.0), level(4.0)), (1.25, 0.0, 4.0, 4.0));
        assert_eq!(level(f64::NEG_INFINITY), 0.0);
    }

    #[test]
    fn srgb_has_its_published_values() {
        assert_eq!((srgb8_to_linear(0), srgb8_to_linear(255)), (0.0, 1.0));
        // Mid grey 118 is 18.1 % in linear light.
        assert!((srgb8_to_linear(118) - 0.181164).abs() < 1e-6, "{}", srgb8_to_linear(118));
        assert!((srgb8_to_linear(10) - 10.0 / 255.0 / 12.92).abs() < 1e-18);
    }
}
