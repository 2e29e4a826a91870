//! Horizontal bars, one for each variant, so that long names are readable and twenty bars fit. A logarithmic
//! axis has marks in place of bars, because bar lengths would have no meaning.

use super::scale::Scale;
use super::svg::{Anchor, LINE, Svg, WIDTH, width_of, wrapped};
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

impl Bar {
    /// Height of the row: the name and the reason for a missing value may need several lines.
    fn height(&self, [name, why]: [f64; 2]) -> f64 {
        let why = self.value.as_ref().map_or_else(|text| wrapped(text, why).len(), |_| 1);
        ROW + LINE * (wrapped(&self.name, name).len().max(why) - 1) as f64
    }
}

/// The base of the first line of a text whose middle is at `y`.
fn first_of(lines: &[String], y: f64) -> f64 {
    y + 4.5 - LINE / 2.0 * (lines.len() - 1) as f64
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
    let room = [left - 6.0, WIDTH - left - 12.0];
    let heights = bars.iter().map(|bar| bar.height(room)).sum::<f64>();
    let bottom = top + heights + groups.len() as f64 * head;
    let ticks = scale.ticks(5);
    let apart = ticks.iter().map(|value| width_of(&tick(*value))).fold(28.0, f64::max) + 6.0;
    for value in scale.with_room(&ticks, apart) {
        let x = scale.at(value);
        svg.line([x, top], [x, bottom], "rule");
        svg.text([x, bottom + 16.0], Anchor::Middle, "tick", &tick(value));
    }
    svg.line([left, top], [left, bottom], "axis");
    let mut y = top;
    for group in groups {
        if head > 0.0 {
            svg.text([left + 4.0, y + 0.7 * HEAD], Anchor::Start, "faint", &group.name);
        }
        y += head;
        for bar in &group.bars {
            let (class, height) = (format!("name{}", bar.highlight), bar.height(room));
            let name = wrapped(&bar.name, room[0]);
            svg.lines([left - 6.0, first_of(&name, y + 0.5 * height)], Anchor::End, &class, &name);
            one(&mut svg, chart, &scale, bar, [left, y + 0.5 * height]);
            y += height;
        }
    }
    if let Some((name, value)) = floor.filter(|(_, value)| scale.shows(*value)) {
        let x = scale.at(value);
        svg.line([x, top - 3.0], [x, bottom], "floor");
        let (at, anchor) = if x > WIDTH / 2.0 { (x + 3.0, Anchor::End) } else { (x - 3.0, Anchor::Start) };
        svg.text([at, top - 7.0], anchor, "floor", &format!("{name}: {}", human(value)));
    }
    let axis = wrapped(&chart.axis(), WIDTH);
    let end = svg.lines([WIDTH / 2.0, bottom + 34.0], Anchor::Middle, "faint", &axis);
    Some(svg.inline(end - 6.0, &chart.title))
}

fn one(svg: &mut Svg, chart: &Chart, scale: &Scale, bar: &Bar, [left, y]: [f64; 2]) {
    let point = match &bar.value {
        Ok(point) if scale.shows(point.y) => point,
        Ok(point) => return svg.text([left + 12.0, y + 4.5], Anchor::Start, "absent", &human(point.y)),
        Err(why) => {
            let why = wrapped(why, WIDTH - left - 12.0);
            svg.lines([left + 12.0, first_of(&why, y)], Anchor::Start, "absent", &why);
            return;
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
