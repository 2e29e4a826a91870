//! Texture filtering by its definition, in f64 and linear light: bilinear between the four nearest texel
//! centres of a level, linear between two levels (L. Williams, "Pyramidal Parametrics",
//! SIGGRAPH 1983).

/// The largest error of a device's trilinear sample, relative to the contrast of the texels. Weights may have steps of
/// 1/256, the coarsest that Vulkan allows. A sample has one weight along each axis, and one between two levels. Each
/// weight errs by less than one step, whether it is rounded or truncated. A rounded and a truncated weight differ by at
/// most one step, so this is also the largest difference of two devices' samples at the same place.
pub const SAMPLER_ERROR: f64 = 3.0 / 256.0;

/// Addressing beyond the texture's edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edges {
    /// Columns wrap at the antimeridian. Rows beyond a pole continue down the opposite meridian: the mirrored
    /// row, half a turn away.
    Planet,
    /// Clamp to the texel at the edge.
    Clamp,
    /// Columns wrap; rows are clamped.
    Columns,
}

/// A pixel's footprint: the sides of the parallelogram that one step right and one step down map to, in
/// texels of level 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parallelogram {
    pub r1: [f64; 2],
    pub r2: [f64; 2],
}

impl Parallelogram {
    /// Lengths of the longer and the shorter side.
    pub fn lengths(&self) -> [f64; 2] {
        let [a, b] = [self.r1, self.r2].map(|[s, t]| s.hypot(t));
        [a.max(b), a.min(b)]
    }

    fn longer(&self) -> [f64; 2] {
        let [a, b] = [self.r1, self.r2].map(|[s, t]| s.hypot(t));
        if a > b { self.r1 } else { self.r2 }
    }
}

/// The sample count of an anisotropic filter, min(ceil(longest / shortest), max) (EXT_texture_filter_anisotropic). In
/// paper 1 the count is nA and the limit `max` is NA.
pub fn sample_count(longest: f64, shortest: f64, max: u32) -> u32 {
    match longest > 0.0 {
        true => (longest / shortest).ceil().min(f64::from(max)) as u32,
        false => 1,
    }
}

/// A texture of `2^width_log2 x 2^height_log2` texels with all its levels, given as a function.
pub struct MipPyramid<F: Fn(u32, u32, u32) -> [f64; 4]> {
    pub width_log2: u32,
    pub height_log2: u32,
    pub edges: Edges,
    /// `(level, column, row)` to linear red, green, blue, alpha.
    pub texel: F,
}

impl<F: Fn(u32, u32, u32) -> [f64; 4]> MipPyramid<F> {
    /// Index of the one-texel level (the paper's L).
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
            Edges::Columns => (column.rem_euclid(width), row.clamp(0, height - 1)),
            Edges::Planet => {
                // Down one meridian and up the opposite one: a full turn has 2 x height rows.
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

    /// The bilinear value of one level at (s, t).
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

    /// The trilinear value at (s, t) and level of detail `lambda`, clamped to 0 ..= L.
    pub fn trilinear(&self, lambda: f64, s: f64, t: f64) -> [f64; 4] {
        let coarsest = self.coarsest_level();
        let lambda = lambda.clamp(0.0, f64::from(coarsest));
        let level = lambda.floor();
        let (finer, coarser) = (level as u32, (level as u32 + 1).min(coarsest));
        mix(self.bilinear(finer, s, t), self.bilinear(coarser, s, t), lambda - level)
    }

    /// Mean of `count` trilinear samples, equally spaced along the longer side of `footprint` and centred on
    /// (s, t). Each sample is as wide as its share of that side.
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

    /// Mean over the whole footprint: the target value of a pixel.
    pub fn area(&self, footprint: &Parallelogram, s: f64, t: f64) -> [f64; 4] {
        self.mean(footprint, [s, t], 0.5, |_| 1.0)
    }

    /// Mean weighted by a Gaussian. `sigma` and `radius` are in pixels; a side of the footprint is one pixel long.
    pub fn gaussian(&self, footprint: &Parallelogram, s: f64, t: f64, sigma: f64, radius: f64) -> [f64; 4] {
        let weight = |[x, y]: [f64; 2]| {
            let square = x * x + y * y;
            if square > radius * radius { 0.0 } else { (-square / (2.0 * sigma * sigma)).exp() }
        };
        self.mean(footprint, [s, t], radius, weight)
    }

    /// Weighted mean over the parallelogram around `centre` that extends `reach` sides of the footprint in each
    /// direction. Samples are an eighth of the shorter side apart in both directions, and each sample is a quarter of
    /// the shorter side wide. The side ratio is limited to 32.
    fn mean(
        &self,
        footprint: &Parallelogram,
        centre: [f64; 2],
        reach: f64,
        weight: impl Fn([f64; 2]) -> f64,
    ) -> [f64; 4] {
        let [longest, shortest] = footprint.lengths();
        let width = shortest.max(longest / 32.0);
        let steps = |[s, t]: [f64; 2]| match width > 0.0 {
            true => (8.0 * s.hypot(t) / width * 2.0 * reach).ceil().max(1.0),
            false => 1.0,
        };
        let (columns, rows) = (steps(footprint.r1), steps(footprint.r2));
        let place = |n: u32, count: f64| (f64::from(n) + 0.5) / count * 2.0 * reach - reach;
        let lambda = (width / 4.0).log2();
        let (mut sum, mut weights) = ([0.0; 4], 0.0);
        for y in (0..rows as u32).map(|row| place(row, rows)) {
            let from = self.moved(footprint.r2, y, centre);
            for x in (0..columns as u32).map(|column| place(column, columns)) {
                let weight = weight([x, y]);
                if weight > 0.0 {
                    let [s, t] = self.moved(footprint.r1, x, from);
                    add(&mut sum, self.trilinear(lambda, s, t).map(|channel| weight * channel));
                    weights += weight;
                }
            }
        }
        sum.map(|channel| channel / weights)
    }

    /// (s, t), moved by a fraction of a side.
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
    srgb_to_linear(f64::from(byte) / 255.0)
}

/// Luminance of linear light (ITU-R BT.709).
pub fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Linear light of an encoded value, both 0.0 ..= 1.0.
pub fn srgb_to_linear(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A texture whose texels encode their own level, column and row.
    fn self_describing(edges: Edges) -> MipPyramid<impl Fn(u32, u32, u32) -> [f64; 4]> {
        let texel = |level, column, row| [f64::from(column), f64::from(row), f64::from(level), 1.0];
        MipPyramid { width_log2: 4, height_log2: 3, edges, texel }
    }

    #[test]
    fn a_texels_centre_shows_the_texel_itself() {
        let texture = self_describing(Edges::Planet);
        assert_eq!(texture.bilinear(0, 5.5 / 16.0, 2.5 / 8.0), [5.0, 2.0, 0.0, 1.0]);
        assert_eq!(texture.bilinear(1, 5.5 / 8.0, 2.5 / 4.0), [5.0, 2.0, 1.0, 1.0]);
    }

    #[test]
    fn between_centres_the_four_nearest_are_mixed() {
        let texture = self_describing(Edges::Clamp);
        assert_eq!(texture.bilinear(0, 6.0 / 16.0, 2.75 / 8.0), [5.5, 2.25, 0.0, 1.0]);
    }

    #[test]
    fn columns_wrap_and_poles_mirror_half_a_turn_away() {
        let texture = self_describing(Edges::Planet);
        // Halfway between column 15 and column 0.
        assert_eq!(texture.bilinear(0, 0.0, 0.5 / 8.0)[0], 7.5);
        assert_eq!(texture.bilinear(0, 1.0, 0.5 / 8.0)[0], 7.5);
        assert_eq!(texture.texel_at(0, 3, -1), [11.0, 0.0, 0.0, 1.0]);
        assert_eq!(texture.texel_at(0, 12, 8), [4.0, 7.0, 0.0, 1.0]);
        assert_eq!(texture.texel_at(4, 0, -1), [0.0, 0.0, 4.0, 1.0], "the level of one texel");
        assert_eq!(self_describing(Edges::Clamp).texel_at(0, -1, 8), [0.0, 7.0, 0.0, 1.0]);
        assert_eq!(self_describing(Edges::Columns).texel_at(0, -1, 8), [15.0, 7.0, 0.0, 1.0]);
    }

    #[test]
    fn lambda_mixes_two_levels_and_is_clamped() {
        let texture = self_describing(Edges::Planet);
        let level = |lambda| texture.trilinear(lambda, 0.3, 0.7)[2];
        assert_eq!((level(1.25), level(-3.0), level(99.0), level(4.0)), (1.25, 0.0, 4.0, 4.0));
        assert_eq!(level(f64::NEG_INFINITY), 0.0);
    }

    #[test]
    fn samples_along_a_footprint_follow_its_longer_side_and_share_its_level() {
        let texture = self_describing(Edges::Planet);
        // 4 texels long, 1 wide: 4 samples of level 0, at 1.5 and 0.5 texels on either side of the middle.
        let along_s = Parallelogram { r1: [4.0, 0.0], r2: [0.0, 1.0] };
        assert_eq!(sample_count(4.0, 1.0, 16), 4);
        assert_eq!(texture.along(&along_s, 4, 8.0 / 16.0, 4.5 / 8.0), [7.5, 4.0, 0.0, 1.0]);
        // With two samples, each is 2 texels wide: level 1.
        assert_eq!(texture.along(&along_s, 2, 8.0 / 16.0, 4.0 / 8.0)[2], 1.0);
        // Each column has its own value, which reveals the samples' positions.
        let comb =
            |level: u32, column: u32, _| [f64::from(u8::from(level == 0 && column == 6)), 0.0, 0.0, 1.0];
        let comb = MipPyramid { width_log2: 4, height_log2: 3, edges: Edges::Planet, texel: comb };
        assert_eq!(comb.along(&along_s, 4, 8.0 / 16.0, 0.5), [0.25, 0.0, 0.0, 1.0]);
        let along_t = Parallelogram { r1: [0.0, 4.0], r2: [1.0, 0.0] };
        assert_eq!(comb.along(&along_t, 4, 6.5 / 16.0, 0.5), [1.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn the_sample_count_is_limited_and_a_point_has_one() {
        assert_eq!([1.0, 1.1, 2.0, 7.9, 99.0].map(|long| sample_count(long, 1.0, 8)), [1, 2, 2, 8, 8]);
        assert_eq!((sample_count(3.0, 0.0, 8), sample_count(0.0, 0.0, 8)), (8, 1));
    }

    #[test]
    fn the_area_filter_is_the_mean_over_the_footprint() {
        // Columns alternate between 0 and 1; the coarser levels hold wrong values.
        let stripes = |level: u32, column: u32, _| {
            [if level == 0 { f64::from(column % 2) } else { 9.0 }, 0.0, 0.0, 1.0]
        };
        let stripes = MipPyramid { width_log2: 6, height_log2: 6, edges: Edges::Planet, texel: stripes };
        let square = Parallelogram { r1: [4.0, 0.0], r2: [0.0, 4.0] };
        // Samples are one texel wide, so only level 0 counts. (0.5, 0.5) is on the border between two stripes.
        assert!((stripes.area(&square, 0.5, 0.5)[0] - 0.5).abs() < 1e-12);
        // A footprint half a texel wide, inside one stripe.
        let narrow = Parallelogram { r1: [0.0, 0.5], r2: [0.01, 0.0] };
        assert!(stripes.area(&narrow, 1.5 / 64.0, 0.5)[0] > 0.99);
        assert!(stripes.area(&narrow, 2.5 / 64.0, 0.5)[0] < 0.01);
        let point = Parallelogram { r1: [0.0; 2], r2: [0.0; 2] };
        assert_eq!(stripes.area(&point, 1.5 / 64.0, 0.5 / 64.0)[0], 1.0);
    }

    #[test]
    fn the_gaussian_filter_damps_a_wave_as_its_transform_says() {
        let wave = |level: u32, column: u32, _| {
            let texels = (f64::from(column) + 0.5) * f64::from(1 << level);
            [1.0 + (std::f64::consts::TAU * texels / 32.0).cos(), 0.0, 0.0, 1.0]
        };
        let texture = MipPyramid { width_log2: 8, height_log2: 8, edges: Edges::Planet, texel: wave };
        let square = Parallelogram { r1: [8.0, 0.0], r2: [0.0, 8.0] };
        // Four pixels are one period. At the crest, a Gaussian of half a pixel leaves exp(-(pi / 4)^2 / 2) of the wave.
        let crest = texture.gaussian(&square, 32.0 / 256.0, 0.5, 0.5, 3.0)[0] - 1.0;
        let expected = (-0.5 * (std::f64::consts::FRAC_PI_4).powi(2)).exp();
        // Samples two texels wide and linear interpolation damp it by another 1 %.
        assert!((crest - expected).abs() < 0.02 * expected, "{crest} {expected}");
        assert!(texture.area(&square, 32.0 / 256.0, 0.5)[0] - 1.0 > 1.1 * crest);
        // Nothing beyond the radius counts.
        let point = texture.gaussian(&square, 32.0 / 256.0, 0.5, 0.5, 0.01)[0];
        assert!(point > 1.95, "{point}");
    }

    #[test]
    fn srgb_has_its_published_values() {
        assert_eq!((srgb8_to_linear(0), srgb8_to_linear(255)), (0.0, 1.0));
        // Mid grey 118 is 18.1 % in linear light.
        assert!((srgb8_to_linear(118) - 0.181164).abs() < 1e-6, "{}", srgb8_to_linear(118));
        assert!((srgb8_to_linear(10) - 10.0 / 255.0 / 12.92).abs() < 1e-18);
    }
}
