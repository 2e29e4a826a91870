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

/// A pixel's footprint: the parallelogram's sides, the images of a step to the right and of one down, in texels of
/// level 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parallelogram {
    pub r1: [f64; 2],
    pub r2: [f64; 2],
}

impl Parallelogram {
    /// Lengths of the longer and of the shorter side.
    pub fn lengths(&self) -> [f64; 2] {
        let [a, b] = [self.r1, self.r2].map(|[s, t]| s.hypot(t));
        [a.max(b), a.min(b)]
    }

    fn longer(&self) -> [f64; 2] {
        let [a, b] = [self.r1, self.r2].map(|[s, t]| s.hypot(t));
        if a > b { self.r1 } else { self.r2 }
    }
}

/// nA = min(ceil(longest / shortest), most): the samples of an anisotropic filter (EXT_texture_filter_anisotropic).
pub fn sample_count(longest: f64, shortest: f64, most: u32) -> u32 {
    match longest > 0.0 {
        true => (longest / shortest).ceil().min(f64::from(most)) as u32,
        false => 1,
    }
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

    /// The mean of `count` trilinear samples at equal distances along the longer side of `footprint`, the pixel's
    /// centre (s, t) in their middle; each is as wide as its share of that side.
    pub fn along(&self, footprint: &Parallelogram, count: u32, s: f64, t: f64) -> [f64; 4] {
        let count = f64::from(count);
        let lambda = (footprint.lengths()[0] / count).log2();
        let mut sum = [0.0; 4];
        for n in 0..count as u32 {
            let part = (f64::from(n) + 0.5) / count - 0.5;
            let [s, t] = self.moved(footprint.longer(), part, [s, t]);
            add(&mut sum, self.trilinear(lambda, s, t));
        }
        sum.map(|channel| channel / count)
    }

    /// The mean over the whole footprint: what a pixel is to show. Samples lie an eighth of the shorter side apart
    /// both ways and are a quarter of it wide; a side more than 32 times as long as the other counts as 32 times.
    pub fn area(&self, footprint: &Parallelogram, s: f64, t: f64) -> [f64; 4] {
        let [longest, shortest] = footprint.lengths();
        let width = shortest.max(longest / 32.0);
        let steps =
            |[s, t]: [f64; 2]| if width > 0.0 { (8.0 * s.hypot(t) / width).ceil().max(1.0) } else { 1.0 };
        let (columns, rows) = (steps(footprint.r1), steps(footprint.r2));
        let lambda = (width / 4.0).log2();
        let mut sum = [0.0; 4];
        for row in 0..rows as u32 {
            let from = self.moved(footprint.r2, (f64::from(row) + 0.5) / rows - 0.5, [s, t]);
            for column in 0..columns as u32 {
                let [s, t] = self.moved(footprint.r1, (f64::from(column) + 0.5) / columns - 0.5, from);
                add(&mut sum, self.trilinear(lambda, s, t));
            }
        }
        sum.map(|channel| channel / (columns * rows))
    }

    /// (s, t), moved by a part of a side.
    fn moved(&self, side: [f64; 2], part: f64, [s, t]: [f64; 2]) -> [f64; 2] {
        let [width, height] = self.level_size(0).map(f64::from);
        [s + part * side[0] / width, t + part * side[1] / height]
    }
}

fn add(sum: &mut [f64; 4], value: [f64; 4]) {
    for (sum, value) in sum.iter_mut().zip(value) {
        *sum += value;
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
    fn samples_along_a_footprint_lie_where_its_longer_side_does_and_share_its_level() {
        let texture = telling(Edges::Planet);
        // 4 texels long, 1 wide: 4 samples of level 0, from the middle 1.5 and 0.5 texels to either side.
        let along_s = Parallelogram { r1: [4.0, 0.0], r2: [0.0, 1.0] };
        assert_eq!(sample_count(4.0, 1.0, 16), 4);
        assert_eq!(texture.along(&along_s, 4, 8.0 / 16.0, 4.5 / 8.0), [7.5, 4.0, 0.0, 1.0]);
        // Two of them are 2 texels wide each: level 1.
        assert_eq!(texture.along(&along_s, 2, 8.0 / 16.0, 4.0 / 8.0)[2], 1.0);
        // Each column shows itself and no other: the place of the samples.
        let comb =
            |level: u32, column: u32, _| [f64::from(u8::from(level == 0 && column == 6)), 0.0, 0.0, 1.0];
        let comb = Texture { width_log2: 4, height_log2: 3, edges: Edges::Planet, texel: comb };
        assert_eq!(comb.along(&along_s, 4, 8.0 / 16.0, 0.5), [0.25, 0.0, 0.0, 1.0]);
        let along_t = Parallelogram { r1: [0.0, 4.0], r2: [1.0, 0.0] };
        assert_eq!(comb.along(&along_t, 4, 6.5 / 16.0, 0.5), [1.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn samples_are_counted_up_to_the_most_and_a_point_has_one() {
        assert_eq!([1.0, 1.1, 2.0, 7.9, 99.0].map(|long| sample_count(long, 1.0, 8)), [1, 2, 2, 8, 8]);
        assert_eq!((sample_count(3.0, 0.0, 8), sample_count(0.0, 0.0, 8)), (8, 1));
    }

    #[test]
    fn the_area_of_a_footprint_is_the_mean_of_what_lies_in_it() {
        // Columns alternate between 0 and 1, and every coarser level says nothing true.
        let stripes = |level: u32, column: u32, _| {
            [if level == 0 { f64::from(column % 2) } else { 9.0 }, 0.0, 0.0, 1.0]
        };
        let stripes = Texture { width_log2: 6, height_log2: 6, edges: Edges::Planet, texel: stripes };
        let square = Parallelogram { r1: [4.0, 0.0], r2: [0.0, 4.0] };
        // Samples are one texel wide: level 0 alone. The middle of two stripes.
        assert!((stripes.area(&square, 0.5, 0.5)[0] - 0.5).abs() < 1e-12);
        // A footprint as narrow as half a texel, inside of one.
        let narrow = Parallelogram { r1: [0.0, 0.5], r2: [0.01, 0.0] };
        assert!(stripes.area(&narrow, 1.5 / 64.0, 0.5)[0] > 0.99);
        assert!(stripes.area(&narrow, 2.5 / 64.0, 0.5)[0] < 0.01);
        let point = Parallelogram { r1: [0.0; 2], r2: [0.0; 2] };
        assert_eq!(stripes.area(&point, 1.5 / 64.0, 0.5 / 64.0)[0], 1.0);
    }

    #[test]
    fn srgb_has_its_published_values() {
        assert_eq!((srgb8_to_linear(0), srgb8_to_linear(255)), (0.0, 1.0));
        // Mid grey 118 is 18.1 % in linear light.
        assert!((srgb8_to_linear(118) - 0.181164).abs() < 1e-6, "{}", srgb8_to_linear(118));
        assert!((srgb8_to_linear(10) - 10.0 / 255.0 / 12.92).abs() < 1e-18);
    }
}
