//! Settings by time and error: each a mark, the front a line through its own.

use super::super::words::tick;
use super::scale::Scale;
use super::svg::{Anchor, Svg, WIDTH, width_of};
use super::{Chart, Point};

/// Height of the plotted field.
const FIELD: f64 = 300.0;

/// One setting.
pub struct Spot {
    pub name: String,
    /// Across.
    pub time: Point,
    /// Upwards.
    pub error: f64,
    pub on_front: bool,
}

/// `spots` with logarithmic axes; those of the front in its order. An error of 0 has no place on such an axis.
pub fn draw(chart: &Chart, across: &str, spots: &[Spot]) -> Option<String> {
    let errors: Vec<f64> = spots.iter().map(|spot| spot.error).collect();
    let times: Vec<f64> = spots.iter().flat_map(|spot| [spot.time.low, spot.time.high]).collect();
    let mut svg = Svg::default();
    let top = chart.head(&mut svg);
    svg.text([0.0, top + 8.0], Anchor::Start, "faint", &chart.axis());
    let (top, bottom) = (top + 18.0, top + 18.0 + FIELD);
    let up = Scale::covering(&errors, true, [bottom, top])?;
    let ticks = up.with_room(&up.ticks(6), 18.0);
    let left = ticks.iter().map(|value| width_of(&tick(*value))).fold(0.0, f64::max) + 8.0;
    let right = WIDTH - 10.0;
    let along = Scale::along(&times, true, [left, right])?;
    for value in ticks {
        let y = up.at(value);
        svg.line([left, y], [right, y], "rule");
        svg.text([left - 6.0, y + 4.0], Anchor::End, "tick", &tick(value));
    }
    for value in along.with_room(&along.ticks(6), 40.0) {
        let (x, text) = (along.at(value), tick(value));
        svg.line([x, bottom], [x, bottom + 4.0], "axis");
        svg.text([x.min(WIDTH - width_of(&text) / 2.0), bottom + 18.0], Anchor::Middle, "tick", &text);
    }
    svg.line([left, bottom], [right, bottom], "axis");
    svg.text([(left + right) / 2.0, bottom + 36.0], Anchor::Middle, "faint", across);
    let place = |spot: &Spot| [along.at(spot.time.y), up.at(spot.error)];
    let shown = |spot: &&Spot| along.shows(spot.time.y) && up.shows(spot.error);
    let members: Vec<[f64; 2]> = spots.iter().filter(|s| s.on_front).filter(shown).map(place).collect();
    svg.polyline(&members, "curve s0");
    // The front's marks lie above the others.
    for on_front in [false, true] {
        for spot in spots.iter().filter(|spot| spot.on_front == on_front).filter(shown) {
            let ([x, y], told) = (place(spot), spot.time.told(&spot.name, "ms"));
            if on_front {
                let [low, high] = [spot.time.low, spot.time.high].map(|time| along.at(time));
                svg.line([low, y], [high, y], "whisker s0");
            }
            svg.mark([x, y], usize::from(!on_front), if on_front { "f0" } else { "f7" }, &told);
        }
    }
    Some(svg.inline(bottom + 46.0, &chart.title))
}
