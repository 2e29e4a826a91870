//! Horizontal bars, one for each variant, so that long names are readable and twenty bars fit. A logarithmic
//! axis has marks in place of bars, because bar lengths would have no meaning.

use super::scale::Scale;
use super::svg::{Anchor, Svg, WIDTH, cut_apart, shortened, width_of};
use super::{Chart, Point};
use crate::figure::words::{human, tick};

/// Heights of a row, of a group's name, and of a bar.
const ROW: f64 = 24.0;
const HEAD: f64 = 22.0;
const BAR: f64 = 13.0;

/// One variant's value.
pub struct Bar {
    pub name: String,
    /// CSS class from `Figure::highlight`, with a leading space.
    pub highlight: &'static str,
    pub value: Result<Point, String>,
}

/// The bars of one cell.
pub struct Group {
    /// Shown above the bars if there are several groups.
    pub name: String,
    pub bars: Vec<Bar>,
}

/// `floor`: name and value of a line across the chart.
pub fn draw(chart: &Chart, groups: &[Group], floor: Option<(&str, f64)>) -> Option<String> {
    let bars: Vec<&Bar> = groups.iter().flat_map(|group| &group.bars).collect();
    let head = if groups.len() > 1 { HEAD } else { 0.0 };
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
    let bottom = top + bars.len() as f64 * ROW + groups.len() as f64 * head;
    for value in scale.with_room(&scale.ticks(5), 34.0) {
        let x = scale.at(value);
        svg.line([x, top], [x, bottom], "rule");
        svg.text([x, bottom + 16.0], Anchor::Middle, "tick", &tick(value));
    }
    svg.line([left, top], [left, bottom], "axis");
    let names: Vec<&str> = bars.iter().map(|bar| &*bar.name).collect();
    let mut cut = cut_apart(&names, left - 6.0).into_iter();
    let mut y = top;
    for group in groups {
        if head > 0.0 {
            svg.text([left + 4.0, y + 0.7 * HEAD], Anchor::Start, "faint", &group.name);
        }
        y += head;
        for (bar, name) in group.bars.iter().zip(&mut cut) {
            let class = format!("name{}", bar.highlight);
            svg.text([left - 6.0, y + 0.5 * ROW + 4.5], Anchor::End, &class, &name);
            one(&mut svg, chart, &scale, bar, [left, y + 0.5 * ROW]);
            y += ROW;
        }
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
    let (x, tooltip) = (scale.at(point.y), point.described(&bar.name, &chart.unit));
    let class = format!("bar{}", bar.highlight);
    match chart.log {
        true => svg.mark([x, y], 0, &class, &tooltip),
        false => svg.bar([left, y - BAR / 2.0], [x - left, BAR], &class, &tooltip),
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
