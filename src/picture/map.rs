//! Error maps: false colours on one logarithmic scale for all maps, so that maps can be compared by eye.

use super::error::{Difference, PixelError};
use super::write::Srgb8Picture;

/// The scale ends at an error of 1 and starts this many powers of ten below.
const DECADES: u32 = 5;
/// An error of exactly 0.
const EQUAL: [u8; 3] = [0; 3];
/// A value that is not finite in at least one of the pictures: a colour outside the scale.
const NOT_FINITE: [u8; 3] = [0, 255, 255];
const PAPER: [u8; 3] = [40; 3];
const INK: [u8; 3] = [230; 3];
/// Skips the darkest eighth of the colours, which looks black.
const FIRST_COLOUR: f64 = 32.0;
/// Pixels between two maps.
const GAP: u32 = 8;
/// Minimum width (for the labels) and height of the legend.
const LEGEND: [u32; 2] = [260, 30];

/// Maps of several comparisons of one size, side by side above one legend. A black pixel has no error. Errors from 1e-5
/// to 1 have colours from dark to light (magma); smaller errors have the colour of 1e-5, larger ones that of 1. Cyan
/// marks values that are not finite.
pub fn error_maps(size: [u32; 2], differences: &[&Difference]) -> Srgb8Picture {
    let [width, height] = size;
    let count = differences.len() as u32;
    let whole = [LEGEND[0].max(count * width + GAP * count.saturating_sub(1)), height + LEGEND[1]];
    let colours = Colours::new();
    let mut canvas = Canvas::new(whole);
    for (n, difference) in differences.iter().enumerate() {
        for PixelError { x, y, value } in difference.pixels() {
            canvas.set([n as u32 * (width + GAP) + x, y], colours.of(value));
        }
    }
    legend(&mut canvas, &colours, height);
    Srgb8Picture { width: whole[0], height: whole[1], rgba: canvas.rgba }
}

/// The scale: black for 0, magma from dark to light for 1e-5 to 1, cyan for values that are not finite.
pub struct Colours(Vec<u8>);

impl Default for Colours {
    fn default() -> Colours {
        Colours::new()
    }
}

impl Colours {
    pub fn new() -> Colours {
        Colours(nv_flip::magma_lut().to_vec())
    }

    /// sRGB of an error.
    pub fn of(&self, error: f64) -> [u8; 3] {
        if error == 0.0 {
            return EQUAL;
        }
        if !error.is_finite() {
            return NOT_FINITE;
        }
        let part = (error.log10() / f64::from(DECADES) + 1.0).clamp(0.0, 1.0);
        let at = 3 * (FIRST_COLOUR + part * (255.0 - FIRST_COLOUR)).round() as usize;
        [self.0[at], self.0[at + 1], self.0[at + 2]]
    }
}

/// Draws a box labelled "0", the scale with a label at each power of ten, and a box for non-finite values.
fn legend(canvas: &mut Canvas, colours: &Colours, top: u32) {
    let (bar_top, text_top) = (top + 5, top + 18);
    let [left, right] = [30, canvas.size[0] - 40];
    let steps = right - left;
    canvas.fill([6, bar_top], [18, 10], EQUAL);
    canvas.text([12, text_top], "0");
    for step in 0..=steps {
        let decades = f64::from(step) / f64::from(steps) * f64::from(DECADES) - f64::from(DECADES);
        canvas.fill([left + step, bar_top], [1, 10], colours.of(10f64.powf(decades)));
    }
    for (n, label) in (0..).zip(["1e-5", "1e-4", ".001", ".01", ".1", "1"]) {
        let at = left + steps * n / DECADES;
        canvas.fill([at, bar_top + 10], [1, 2], INK);
        canvas.text([at - 4, text_top], label);
    }
    canvas.fill([right + 12, bar_top], [22, 10], NOT_FINITE);
    canvas.text([right + 12, text_top], "NaN");
}

struct Canvas {
    size: [u32; 2],
    rgba: Vec<u8>,
}

impl Canvas {
    fn new(size: [u32; 2]) -> Canvas {
        let [r, g, b] = PAPER;
        Canvas { size, rgba: [r, g, b, 255].repeat(size[0] as usize * size[1] as usize) }
    }

    fn set(&mut self, [x, y]: [u32; 2], colour: [u8; 3]) {
        assert!(x < self.size[0] && y < self.size[1], "({x}, {y}) of {:?}", self.size);
        let at = 4 * (y as usize * self.size[0] as usize + x as usize);
        self.rgba[at..at + 3].copy_from_slice(&colour);
    }

    fn fill(&mut self, [left, top]: [u32; 2], [width, height]: [u32; 2], colour: [u8; 3]) {
        for (y, x) in (top..top + height).flat_map(|y| (left..left + width).map(move |x| (y, x))) {
            self.set([x, y], colour);
        }
    }

    /// Draws text in glyphs of 3 x 5 dots, each of 2 x 2 pixels.
    fn text(&mut self, [left, top]: [u32; 2], text: &str) {
        for (n, letter) in (0..).zip(text.chars()) {
            for (row, dots) in (0..).zip(glyph(letter)) {
                for column in (0..3).filter(|column| dots >> (2 - column) & 1 == 1) {
                    self.fill([left + 8 * n + 2 * column, top + 2 * row], [2, 2], INK);
                }
            }
        }
    }
}

/// The legend's glyphs, rows from the top.
fn glyph(letter: char) -> [u8; 5] {
    match letter {
        '0' => [0b111, 0b101, 0b101, 0b101, 0b111],
        '1' => [0b010, 0b110, 0b010, 0b010, 0b111],
        '4' => [0b101, 0b101, 0b111, 0b001, 0b001],
        '5' => [0b111, 0b100, 0b111, 0b001, 0b111],
        'e' => [0b000, 0b111, 0b111, 0b100, 0b111],
        '-' => [0b000, 0b000, 0b111, 0b000, 0b000],
        '.' => [0b000, 0b000, 0b000, 0b000, 0b010],
        'N' => [0b101, 0b111, 0b111, 0b101, 0b101],
        'a' => [0b000, 0b011, 0b101, 0b101, 0b011],
        other => panic!("the legend has no letter {other:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::{Picture, error::compare};

    fn pixel(map: &Srgb8Picture, x: u32, y: u32) -> [u8; 3] {
        let at = 4 * (y * map.width + x) as usize;
        [map.rgba[at], map.rgba[at + 1], map.rgba[at + 2]]
    }

    #[test]
    fn equal_is_black_larger_is_lighter_and_not_finite_is_cyan() {
        let truth = Picture::filled(6, 2, [0.5, 0.5, 0.5, 1.0]);
        let mut picture = truth.clone();
        for (x, error) in [(1, 1e-4), (2, 1e-2), (3, 0.4), (4, 40.0), (5, f32::NAN)] {
            picture.rgba[x][0] += error;
        }
        let difference = compare(&picture, &truth).unwrap();
        let map = error_maps([6, 2], &[&difference, &difference]);
        assert_eq!((map.width, map.height), (260, 32));
        let light = |x| pixel(&map, x, 0).iter().map(|&c| u32::from(c)).sum::<u32>();
        assert_eq!(pixel(&map, 0, 0), EQUAL);
        assert!((1..=4).all(|x| light(x) > light(x - 1)), "{:?}", [0, 1, 2, 3, 4].map(light));
        assert_eq!(pixel(&map, 5, 0), NOT_FINITE);
        // Side by side, with background between.
        assert_eq!((pixel(&map, 6, 0), pixel(&map, 14 + 3, 0)), (PAPER, pixel(&map, 3, 0)));
    }

    #[test]
    fn wide_maps_keep_their_width() {
        let truth = Picture::filled(300, 4, [0.5; 4]);
        let difference = compare(&truth, &truth).unwrap();
        assert_eq!(error_maps([300, 4], &[&difference, &difference]).width, 608);
    }
}
