//! The difference of two pictures of one mesh, at different levels of detail.

use super::pop::INVISIBLE;
use crate::figure::prelude::*;

pub const VISIBLE: &str = "pixels that differ visibly";
pub const INSIDE: &str = "pixels inside the outline that differ visibly";
pub const WIDEST: &str = "widest visible difference";
pub const EXCESS: &str = "excess of the widest visible difference";
pub const BEYOND: &str = "pixels that differ beyond the wanted error";
pub const WIDEST_BEYOND: &str = "widest difference beyond the wanted error";
pub const RMS: &str = "root mean square of the difference";
const WORST: &str = "largest difference of a pixel";

/// A picture.
pub struct Shot {
    /// In pixels.
    pub width: usize,
    /// An sRGB byte for each pixel. The first pixel shows the background.
    pub levels: Vec<u8>,
    /// True for pixels whose samples all show the mesh.
    pub inside: Vec<bool>,
}

impl Shot {
    fn covers(&self, pixel: usize) -> bool {
        self.levels[pixel] != self.levels[0]
    }

    /// For each pixel of `other`, by how much its level is outside the range of those levels in this picture that a
    /// movement by less than `reach` pixels brings into the pixel.
    fn beyond(&self, other: &Shot, reach: f64) -> Vec<u8> {
        let (width, height) = (self.width as i64, (self.levels.len() / self.width) as i64);
        let far = reach.ceil() as i64;
        let gap = |side: i64| (side.abs() - 1).max(0) as f64;
        let steps = || (-far..=far).flat_map(move |x| (-far..=far).map(move |y| [x, y]));
        let near: Vec<[i64; 2]> = steps().filter(|[x, y]| gap(*x).hypot(gap(*y)) < reach).collect();
        let off = |pixel: usize| {
            let [column, row] = [pixel as i64 % width, pixel as i64 / width];
            let (mut least, mut greatest) = (u8::MAX, 0);
            for [x, y] in near.iter().map(|[x, y]| [column + x, row + y]) {
                if (0..width).contains(&x) && (0..height).contains(&y) {
                    let level = self.levels[(y * width + x) as usize];
                    (least, greatest) = (least.min(level), greatest.max(level));
                }
            }
            let level = other.levels[pixel];
            least.saturating_sub(level).max(level.saturating_sub(greatest))
        };
        (0..self.levels.len()).map(off).collect()
    }
}

/// The difference of two pictures. Shares are percentages of the pixels that either covers.
#[derive(Debug, PartialEq)]
pub struct LevelDifference {
    visible: f64,
    inside: f64,
    /// Side of the largest square of pixels that all differ visibly.
    widest: f64,
    /// The share of pixels that differ visibly beyond the wanted error, in either direction.
    beyond: f64,
    /// As [`Self::widest`], of these pixels.
    widest_beyond: f64,
    rms: f64,
    worst: f64,
}

impl LevelDifference {
    /// `wanted` is the wanted error in pixels.
    pub fn between(one: &Shot, other: &Shot, wanted: f64) -> LevelDifference {
        let change = |pixel: usize| one.levels[pixel].abs_diff(other.levels[pixel]);
        let pixels = 0..one.levels.len();
        let covered: Vec<usize> =
            pixels.clone().filter(|&pixel| one.covers(pixel) || other.covers(pixel)).collect();
        let count = covered.len() as f64;
        let visible: Vec<bool> = pixels.map(|pixel| change(pixel) > INVISIBLE).collect();
        let both = one.beyond(other, wanted).into_iter().zip(other.beyond(one, wanted));
        let beyond: Vec<bool> = both.map(|(x, y)| x.max(y) > INVISIBLE).collect();
        let share = |is: &dyn Fn(usize) -> bool| {
            100.0 * covered.iter().filter(|&&pixel| is(pixel)).count() as f64 / count
        };
        LevelDifference {
            visible: share(&|pixel| visible[pixel]),
            inside: share(&|pixel| visible[pixel] && one.inside[pixel] && other.inside[pixel]),
            widest: widest(&visible, one.width) as f64,
            beyond: share(&|pixel| beyond[pixel]),
            widest_beyond: widest(&beyond, one.width) as f64,
            rms: (covered.iter().map(|&pixel| f64::from(change(pixel)).powi(2)).sum::<f64>() / count).sqrt(),
            worst: covered.iter().map(|&pixel| change(pixel)).max().map_or(0.0, f64::from),
        }
    }

    pub fn rows(&self, variant: &str, wanted: f64) -> Vec<Row> {
        let numbers = [
            (VISIBLE, "% of the covered", self.visible),
            (INSIDE, "% of the covered", self.inside),
            (WIDEST, "pixels", self.widest),
            (EXCESS, "pixels", self.widest - wanted),
            (BEYOND, "% of the covered", self.beyond),
            (WIDEST_BEYOND, "wanted errors", self.widest_beyond / wanted),
            (RMS, "levels of 255", self.rms),
            (WORST, "levels of 255", self.worst),
        ];
        numbers.map(|(quantity, unit, value)| Row::number(variant, quantity, unit, value)).into()
    }
}

/// Side of the largest square in which the mask is true everywhere.
fn widest(mask: &[bool], width: usize) -> usize {
    // For each pixel, the side of the largest square that ends at this pixel (its last row and column).
    let mut sides = vec![0; mask.len()];
    for at in 0..mask.len() {
        if mask[at] {
            let inner = at >= width && at % width > 0;
            let min = |sides: &[usize]| sides[at - 1].min(sides[at - width]).min(sides[at - width - 1]);
            sides[at] = 1 + if inner { min(&sides) } else { 0 };
        }
    }
    sides.into_iter().max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_widest_difference_is_the_side_of_a_square() {
        let mask = |text: &str| text.bytes().map(|byte| byte == b'#').collect::<Vec<_>>();
        assert_eq!(widest(&mask("...........####.....####.....####..."), 9), 3);
        assert_eq!(widest(&mask("#########"), 3), 3);
        assert_eq!(widest(&mask("#########"), 9), 1);
        assert_eq!(widest(&mask("........."), 3), 0);
    }

    #[test]
    fn a_pixel_counts_if_it_differs_by_more_than_eight_levels_and_inside_if_all_its_samples_are_covered() {
        let shot = |levels: [u8; 4], inside: [bool; 4]| Shot {
            width: 2,
            levels: levels.into(),
            inside: inside.into(),
        };
        let one = shot([7, 100, 100, 7], [false, true, true, false]);
        let other = shot([7, 109, 92, 7], [false, true, true, false]);
        let found = LevelDifference::between(&one, &other, 1.0);
        assert_eq!((found.visible, found.inside, found.widest, found.worst), (50.0, 50.0, 1.0, 9.0));
        assert_eq!(found.rms, 72.5_f64.sqrt());
        let edge = shot([7, 109, 92, 7], [false, false, true, false]);
        assert_eq!(LevelDifference::between(&one, &edge, 1.0).inside, 0.0);
    }

    #[test]
    fn a_moved_picture_differs_beyond_smaller_movements_only_and_a_new_level_beyond_all() {
        let shot = |levels: Vec<u8>| Shot { width: 12, inside: vec![true; levels.len()], levels };
        // A ramp, which rises by 20 levels with each column, and a spot.
        let ramp = |moved: usize, spot: u8| {
            let level = |at: usize| 10 + 20 * ((at % 12 + 12 - moved) % 12) as u8;
            shot((0..72).map(|at| if at == 40 { spot } else { level(at) }).collect())
        };
        let beyond = |moved: usize, spot: [u8; 2], reach: f64| {
            let [one, other] = [ramp(0, spot[0]), ramp(moved, spot[1])];
            // The columns that a movement by 3 pixels leaves alone.
            let inner = |found: Vec<u8>| {
                (0..72).filter(|at| (3..9).contains(&(at % 12))).map(|at| found[at]).collect()
            };
            let [there, back]: [Vec<u8>; 2] =
                [inner(one.beyond(&other, reach)), inner(other.beyond(&one, reach))];
            [there, back].map(|found| found.into_iter().max().unwrap())
        };
        assert_eq!(beyond(0, [90, 90], 0.5), [0, 0]);
        assert_eq!(beyond(1, [90, 70], 1.0), [0, 0]);
        assert_eq!(beyond(3, [90, 30], 3.0), [0, 0]);
        assert_eq!(beyond(3, [90, 30], 2.0), [20, 20]);
        // The spot is brighter than all pixels of the other picture.
        let [there, back] = beyond(0, [90, 255], 3.0);
        assert_eq!((there, back), (255 - 150, 0));
        // Either direction counts. The first column has the background's level, 66 pixels are covered.
        for spots in [[90, 255], [255, 90]] {
            let found = LevelDifference::between(&ramp(0, spots[0]), &ramp(0, spots[1]), 2.0);
            assert_eq!((found.beyond, found.widest_beyond), (100.0 / 66.0, 1.0));
            let row = found.rows("x", 2.0).into_iter().find(|row| row.quantity == WIDEST_BEYOND).unwrap();
            assert_eq!(row.value.number(), Some(0.5));
        }
    }
}
