//! A bar for each variant, one below the other, so that long names stand level and twenty fit. On a logarithmic axis,
//! where a length means nothing, a mark in place of the bar.

use super::scale::Scale;
use super::svg::{Anchor, Svg, WIDTH, shortened, told_apart, width_of};
use super::{Chart, Point};
use crate::figure::words::{human, tick};

/// A row's height; its bar's.
const ROW: f64 = 24.0;
const BAR: f64 = 13.0;

/// One variant's value.
pub struct Bar {
    pub name: String,
    pub value: Result<Point, String>,
}

/// `floor`: a name and a value, drawn as a line across.
pub fn draw(chart: &Chart, bars: &[Bar], floor: Option<(&str, f64)>) -> Option<String> {
    let widest = |texts: &mut dyn Iterator<Item = &str>| texts.map(width_of).fold(0.0, f64::max);
    let values: Vec<&Point> = bars.iter().filter_map(|bar| bar.value.as_ref().ok()).collect();
    let numbers: Vec<String> = values.iter().map(|point| human(point.y)).collect();
    let left = (widest(&mut bars.iter().map(|bar| &*bar.name)) + 10.0).min(200.0);
    let right = WIDTH - widest(&mut numbers.iter().map(|text| &**text)) - 12.0;
    let ends: Vec<f64> =
        values.iter().flat_map(|p| [p.low, p.y, p.high]).chain(floor.map(|(_, value)| value)).collect();
    let scale = Scale::covering(&ends, chart.log, [left, right])?;
    let mut svg = Svg::default();
    let top = chart.head(&mut svg) + if floor.is_some() { 18.0 } else { 4.0 };
    let bottom = top + bars.len() as f64 * ROW;
    for value in scale.with_room(&scale.ticks(5), 34.0) {
        let x = scale.at(value);
        svg.line([x, top], [x, bottom], "rule");
        svg.text([x, bottom + 16.0], Anchor::Middle, "tick", &tick(value));
    }
    svg.line([left, top], [left, bottom], "axis");
    let names: Vec<&str> = bars.iter().map(|bar| &*bar.name).collect();
    for (row, (bar, name)) in bars.iter().zip(told_apart(&names, left - 6.0)).enumerate() {
        let y = top + (row as f64 + 0.5) * ROW;
        svg.text([left - 6.0, y + 4.5], Anchor::End, "name", &name);
        one(&mut svg, chart, &scale, bar, [left, y]);
    }
    if let Some((name, value)) = floor.filter(|(_, value)| scale.shows(*value)) {
        let x = scale.at(value);
        svg.line([x, top - 3.0], [x, bottom], "floor");
        let (at, anchor) = if x > WIDTH / 2.0 { (x + 3.0, Anchor::End) } else { (x - 3.0, Anchor::Start) };
        svg.text([at, top - 7.0], anchor, "floor", &format!("{name}: {}", human(value)));
    }
    svg.text([(left + right) / 2.0, bottom + 34.0], Anchor::Middle, "faint", &chart.axis());
    Some(svg.inline(bottom + 44.0, &chart.title))
}

fn one(svg: &mut Svg, chart: &Chart, scale: &Scale, bar: &Bar, [left, y]: [f64; 2]) {
    let point = match &bar.value {
        Ok(point) if scale.shows(point.y) => point,
        Ok(point) => return svg.text([left + 12.0, y + 4.5], Anchor::Start, "absent", &human(point.y)),
        Err(why) => {
            let why = shortened(why, WIDTH - left - 12.0);
            return svg.text([left + 12.0, y + 4.5], Anchor::Start, "absent", &why);
        }
    };
    let (x, told) = (scale.at(point.y), point.told(&bar.name, &chart.unit));
    match chart.log {
        true => svg.mark([x, y], 0, "bar", &told),
        false => svg.bar([left, y - BAR / 2.0], [x - left, BAR], "bar", &told),
    }
    let high = scale.at(point.high.max(point.y));
    if point.low < point.high {
        let low = scale.at(point.low);
        svg.line([low, y], [high, y], "spread");
        for end in [low, high] {
            svg.line([end, y - 3.5], [end, y + 3.5], "spread");
        }
    }
    svg.text([high + 6.0, y + 4.5], Anchor::Start, "value", &human(point.y));
}
