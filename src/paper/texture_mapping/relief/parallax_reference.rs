//! The methods of [`super::parallax`] in f64: each pixel's colour, and the range in which f32 must find it.
//!
//! In f32, the point where a ray enters the top plane has an error. `slack` is the bound of this error. The entry of
//! a point is where the ray through the point enters the top plane. The hit of a ray that enters at s is the first
//! point whose entry is at least s. So hits grow with s, and the hit in f32 lies between the exact hits of `s - slack`
//! and `s + slack`. Where the slack decides whether a texel counts, the range contains all outcomes.
//!
//! The reference visits every texel. For descents of more than [`MAX_DESCENT`] texels, the GPU skips hidden texels by
//! longer strides.

use super::Relief;
use super::parallax::{ParallaxFilter, ParallaxView};
use rayon::prelude::*;

/// Longest descent in texels for which the GPU visits every texel: `MAX_STRIDES` of relief_width.glsl.
pub const MAX_DESCENT: f64 = 1024.0;

/// A filtered pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct RayPixel {
    pub colour: f64,
    /// Least and greatest colour in f32.
    pub range: [f64; 2],
    /// Least and greatest number of visited texels in f32.
    pub texels: [u32; 2],
}

/// The picture that `method` draws, row by row. `colours` has one colour for each texel of the relief.
pub fn pixels(
    relief: &Relief,
    colours: &[f32],
    view: &ParallaxView,
    method: ParallaxFilter,
) -> Vec<RayPixel> {
    let cotangent = view.cotangent();
    let descent = f64::from(relief.depth) * cotangent;
    assert!(descent <= MAX_DESCENT, "a descent of {descent} texels; at most {MAX_DESCENT} are supported");
    let extent = f64::from(view.columns) * view.pixel + descent + 2.0;
    // A position has an error of half an ulp. Interpolating a height and multiplying it by the cotangent takes at most
    // six roundings.
    let slack = f64::from(f32::EPSILON) * (extent + 6.0 * descent);
    let of = |slack| Lines { relief, colours, cotangent, slack };
    let (exact, rounded) = (of(0.0), of(slack));
    let pixel = |at: u32| {
        let corner = [at % view.columns, at / view.columns].map(|c| f64::from(c) * view.pixel);
        let [exact, Possible { range: [low, high], texels }] =
            [&exact, &rounded].map(|lines| lines.footprint(corner, view.pixel, method));
        // Each texel adds a rounding error to the sums.
        let sums = f64::from(f32::EPSILON) * f64::from(texels[1] + 4);
        RayPixel { colour: exact.range[0], range: [low - sums, high + sums], texels }
    };
    (0..view.columns * view.columns).into_par_iter().map(pixel).collect()
}

/// A relief cut along the view direction.
struct Lines<'a> {
    relief: &'a Relief,
    colours: &'a [f32],
    cotangent: f64,
    /// Error of an entry, in texels.
    slack: f64,
}

/// The colours and texel counts that a pixel may have in f32.
struct Possible {
    range: [f64; 2],
    texels: [u32; 2],
}

/// The texels of a footprint.
#[derive(Default)]
struct Sum {
    colour: f64,
    weight: f64,
    /// Colours of texels for which rounding decides whether they count.
    doubtful: Vec<f64>,
    texels: [u32; 2],
}

impl Lines<'_> {
    /// Height and colour in column x, interpolated between two rows.
    fn texel(&self, x: i64, y: f64) -> [f64; 2] {
        let (row, share) = (y.floor() as i64, y - y.floor());
        let side = self.relief.side as i64;
        let at = |row: i64| {
            let colour = self.colours[(row.rem_euclid(side) * side + x.rem_euclid(side)) as usize];
            [self.relief.texel(x, row), colour].map(f64::from)
        };
        let (near, far) = (at(row), at(row + 1));
        [0, 1].map(|n| near[n] * (1.0 - share) + far[n] * share)
    }

    /// The x at which the ray that shows the surface in column x enters the top plane.
    fn entry(&self, x: i64, y: f64) -> f64 {
        x as f64 - (f64::from(self.relief.depth) - self.texel(x, y)[0]) * self.cotangent
    }

    /// The x at which the ray that enters at s meets the surface.
    fn hit(&self, s: f64, y: f64) -> f64 {
        let mut x = s.floor() as i64;
        while self.entry(x + 1, y) < s {
            x += 1;
        }
        let [from, to] = [self.entry(x, y), self.entry(x + 1, y)];
        x as f64 + if to > from { ((s - from) / (to - from)).clamp(0.0, 1.0) } else { 1.0 }
    }

    /// Least and greatest hit in f32.
    fn hits(&self, s: f64, y: f64) -> [f64; 2] {
        [self.hit(s - self.slack, y) - self.slack, self.hit(s + self.slack, y) + self.slack]
    }

    /// Where the ray that enters at s meets a horizontal plane as high as the surface at s: least and greatest x in
    /// f32.
    fn offset(&self, s: f64, y: f64) -> [f64; 2] {
        let (x, share) = (s.floor() as i64, s - s.floor());
        let height = self.texel(x, y)[0] * (1.0 - share) + self.texel(x + 1, y)[0] * share;
        let x = s + (f64::from(self.relief.depth) - height) * self.cotangent;
        [x - self.slack, x + self.slack]
    }

    /// Least and greatest colour between two positions.
    fn between([from, to]: [f64; 2], colour: impl Fn(i64) -> f64) -> [f64; 2] {
        let at = |x: f64| {
            let share = x - x.floor();
            colour(x.floor() as i64) * (1.0 - share) + colour(x.floor() as i64 + 1) * share
        };
        let texels = (from.ceil() as i64..=to.floor() as i64).map(&colour);
        hull(texels.chain([at(from), at(to)]))
    }

    fn footprint(&self, [left, top]: [f64; 2], side: f64, method: ParallaxFilter) -> Possible {
        let middle = top + 0.5 * side;
        let centre = match method {
            ParallaxFilter::Offset => self.offset(left + 0.5 * side, middle),
            _ => self.hits(left + 0.5 * side, middle),
        };
        // Two lines per texel.
        let rows = ((2.0 * side) as u32).max(1);
        let lines = (0..rows).map(|n| top + (f64::from(n) + 0.5) * side / f64::from(rows));
        let mut sum = Sum::default();
        let ends = match method {
            ParallaxFilter::Projected => return self.projected([left, left + side], lines),
            ParallaxFilter::Point => None,
            ParallaxFilter::Offset | ParallaxFilter::Unperturbed => {
                Some([-0.5, 0.5].map(|half| centre.map(|c| c + half * side)))
            }
            ParallaxFilter::Whole | ParallaxFilter::Visible => {
                Some([left, left + side].map(|s| self.hits(s, middle)))
            }
        };
        if let Some(ends) = ends {
            lines.for_each(|y| self.add(&mut sum, ends, y, method == ParallaxFilter::Visible));
        }
        // If no texel counts, the pixel shows the colour at the centre ray's hit.
        let instead = Lines::between(centre, |x| self.texel(x, middle)[1]);
        sum.possible(instead)
    }

    /// Adds the texels with a <= x < b. If `visible`, adds only texels that nothing hides.
    fn add(&self, sum: &mut Sum, [a, b]: [[f64; 2]; 2], y: f64, visible: bool) {
        let first = a[0].ceil() as i64;
        // Texels farther away than a ray's whole descent hide nothing.
        let reach = (f64::from(self.relief.depth) * self.cotangent).ceil() as i64 + 1;
        let mut highest = (first - reach..first).map(|x| self.entry(x, y)).fold(f64::MIN, f64::max);
        for x in (first..).take_while(|&x| (x as f64) < b[1]) {
            let (at, own) = (x as f64, self.entry(x, y));
            let inside = a[1] <= at && at < b[0];
            // How far the texel is from being hidden: the difference of two entries, each of which may err by the
            // slack.
            let shown = if visible { own - highest } else { f64::INFINITY };
            highest = highest.max(own);
            let colour = self.texel(x, y)[1];
            if inside && shown >= 2.0 * self.slack {
                sum.colour += colour;
                sum.weight += 1.0;
            } else if shown >= -2.0 * self.slack {
                sum.doubtful.push(colour);
            }
            sum.texels = [sum.texels[0] + u32::from(inside), sum.texels[1] + 1];
        }
    }

    /// Each segment between texels, with the colour in the middle of its visible part, weighted by the part's width.
    fn projected(&self, [a, b]: [f64; 2], lines: impl Iterator<Item = f64>) -> Possible {
        let (mut colour, mut weight, mut texels) = (0.0, 0.0, [0; 2]);
        for y in lines {
            let first = a.floor() as i64;
            let (mut x, mut seen) = (first, a.max(self.entry(first, y)));
            while seen < b {
                let [from, to] = [self.entry(x, y), self.entry(x + 1, y)];
                let end = to.min(b);
                if end > seen {
                    let share = (0.5 * (seen + end) - from) / (to - from);
                    let [near, far] = [x, x + 1].map(|x| self.texel(x, y)[1]);
                    colour += (near * (1.0 - share) + far * share) * (end - seen);
                    weight += end - seen;
                    seen = end;
                }
                x += 1;
            }
            let visited = self.hits(b, y).map(|hit| (hit.ceil() as i64 - first) as u32);
            texels = [0, 1].map(|n| texels[n] + visited[n]);
        }
        // If entries err by the slack, each end of a visible part moves by at most the slack. The position of the
        // part's middle within the segment then changes by at most four slacks divided by the segment's length. The
        // part is not longer than the segment. So the part adds at most six slacks to the error of the sum of colours,
        // and at most two slacks to the error of the sum of weights.
        let error = 8.0 * self.slack * f64::from(texels[1]) / weight;
        Possible { range: [-error, error].map(|error| colour / weight + error), texels }
    }
}

impl Sum {
    /// The range of means over the texels that certainly count and any subset of the doubtful texels. `instead` is the
    /// range of colours for a pixel in which no texel counts.
    fn possible(mut self, instead: [f64; 2]) -> Possible {
        if self.weight == 0.0 {
            // A pixel without texels visits the two texels at the centre ray's hit instead.
            let min = self.texels[0] + if self.doubtful.is_empty() { 2 } else { 0 };
            let range = hull(self.doubtful.into_iter().chain(instead));
            return Possible { range, texels: [min, self.texels[1] + 2] };
        }
        self.doubtful.sort_by(f64::total_cmp);
        let mean = |doubtful: &mut dyn Iterator<Item = &f64>, better: fn(f64, f64) -> bool| {
            let (mut colour, mut weight) = (self.colour, self.weight);
            for &own in doubtful {
                if !better(own, colour / weight) {
                    break;
                }
                colour += own;
                weight += 1.0;
            }
            colour / weight
        };
        let min = mean(&mut self.doubtful.iter(), |own, mean| own < mean);
        let greatest = mean(&mut self.doubtful.iter().rev(), |own, mean| own > mean);
        Possible { range: [min, greatest], texels: self.texels }
    }
}

fn hull(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
}
