//! Settings by time and error: a mark for each setting, and a line through the Pareto front.

use super::super::words::tick;
use super::scale::Scale;
use super::svg::{Anchor, Svg, WIDTH, width_of};
use super::{Chart, Point};

/// Height of the plotted field.
const FIELD: f64 = 300.0;

/// One setting.
pub struct Spot {
    /// Written next to the marks of the front.
    pub name: String,
    /// Tooltip.
    pub tooltip: String,
    /// Horizontal.
    pub time: Point,
    /// Vertical.
    pub error: f64,
    pub on_front: bool,
}

/// Draws `spots` on logarithmic axes. The spots of the front must be in the front's order. An error of 0 cannot be
/// shown on such an axis.
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
    // Marks of the front are drawn last, on top.
    for on_front in [false, true] {
        for spot in spots.iter().filter(|spot| spot.on_front == on_front).filter(shown) {
            let ([x, y], tooltip) = (place(spot), spot.time.described(&spot.tooltip, "ms"));
            if on_front {
                let [low, high] = [spot.time.low, spot.time.high].map(|time| along.at(time));
                svg.line([low, y], [high, y], "whisker s0");
            }
            svg.mark([x, y], usize::from(!on_front), if on_front { "f0" } else { "f7" }, &tooltip);
        }
    }
    let fronts = spots.iter().filter(|spot| spot.on_front).filter(shown);
    label(&mut svg, fronts.map(|spot| (&*spot.name, place(spot))), [left, right], [top, bottom]);
    Some(svg.inline(bottom + 46.0, &chart.title))
}

/// Height of a label.
const LABEL: f64 = 13.0;

/// Writes each name next to its mark if the name covers no mark and no other name; the first names take precedence.
/// Other names are only in the table or the legend.
pub fn label<'a>(
    svg: &mut Svg,
    named: impl Iterator<Item = (&'a str, [f64; 2])>,
    [left, right]: [f64; 2],
    [top, bottom]: [f64; 2],
) {
    let (names, places): (Vec<&str>, Vec<_>) = named.unzip();
    let mut taken: Vec<[f64; 4]> = places.iter().map(|[x, y]| [x - 4.0, y - 4.0, x + 4.0, y + 4.0]).collect();
    for (name, [x, y]) in names.into_iter().zip(places) {
        let width = width_of(name) * 0.85;
        let free = |[x0, y0, x1, y1]: [f64; 4]| {
            let apart = |t: &[f64; 4]| x1 <= t[0] || t[2] <= x0 || y1 <= t[1] || t[3] <= y0;
            left <= x0 && x1 <= right && top <= y0 && y1 <= bottom && taken.iter().all(apart)
        };
        let places = [(7.0, -5.0), (7.0, 13.0), (-7.0, 13.0), (-7.0, -5.0)].map(|(dx, dy)| {
            let (from, base) = (if dx > 0.0 { x + dx } else { x + dx - width }, y + dy);
            ([from, base - LABEL + 2.0, from + width, base + 2.0], [from, base])
        });
        let Some((area, at)) = places.into_iter().find(|(area, _)| free(*area)) else { continue };
        svg.text(at, Anchor::Start, "faint", name);
        taken.push(area);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_with_equal_starts_stay_distinct() {
        let spot = |minor: u32, at: f64| Spot {
            name: format!("ellipse with many words, minor {minor}"),
            tooltip: String::new(),
            time: Point { y: at, low: at, high: at },
            error: 1.0 / at,
            on_front: true,
        };
        let [title, below, quantity] = [""; 3].map(String::from);
        let chart = Chart { title, below, quantity, unit: String::new(), log: true };
        let svg = draw(&chart, "time", &[spot(1, 1.0), spot(2, 100.0)]).unwrap();
        for end in ["minor 1<", "minor 2<"] {
            assert!(svg.contains(end), "no {end} in {svg}");
        }
    }
}
