//! A line for each variant along a sweep or a series, with the spread at each point.

use super::scale::Scale;
use super::scatter;
use super::svg::{Anchor, HUES, Svg, WIDTH, cut_apart, width_of, wrapped};
use super::{Chart, Point};
use crate::figure::words::tick;

/// Height of the plotted field.
const FIELD: f64 = 230.0;

/// One variant's values, in order of x.
pub struct Line {
    pub name: String,
    /// CSS class from `Figure::highlight`, with a leading space.
    pub highlight: &'static str,
    pub points: Vec<(f64, Point)>,
}

/// A chart's horizontal axis.
pub struct Along {
    pub name: String,
    pub log: bool,
    /// The values to label; `None` labels round values.
    pub at: Option<Vec<f64>>,
}

/// The plotted field with its scales.
pub struct Field {
    pub x: Scale,
    pub y: Scale,
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
}

impl Field {
    /// Draws a field of this height for these points, with its title, axes and grid lines.
    pub fn draw(
        svg: &mut Svg,
        chart: &Chart,
        along: &Along,
        points: &[(f64, Point)],
        height: f64,
    ) -> Option<Field> {
        let heights: Vec<f64> = points.iter().flat_map(|(_, p)| [p.low, p.y, p.high]).collect();
        let top = chart.head(svg);
        let axis = wrapped(&chart.axis(), WIDTH);
        let top = svg.lines([0.0, top + 8.0], Anchor::Start, "faint", &axis) - 6.0;
        let bottom = top + height;
        let y = Scale::around(&heights, chart.log, [bottom, top])?;
        let ticks = y.with_room(&y.ticks(6), 18.0);
        let left = ticks.iter().map(|value| width_of(&tick(*value))).fold(0.0, f64::max) + 8.0;
        let right = WIDTH - 10.0;
        let places: Vec<f64> = points.iter().map(|(x, _)| *x).collect();
        let x = Scale::along(&places, along.log, [left, right])?;
        for value in ticks {
            let at = y.at(value);
            svg.line([left, at], [right, at], "rule");
            svg.text([left - 6.0, at + 4.0], Anchor::End, "tick", &tick(value));
        }
        let named = along.at.clone().unwrap_or_else(|| x.ticks(6));
        let apart = named.iter().map(|value| width_of(&tick(*value))).fold(34.0, f64::max) + 6.0;
        for value in x.with_room(&named, apart) {
            let (at, text) = (x.at(value), tick(value));
            svg.line([at, bottom], [at, bottom + 4.0], "axis");
            let inside = at.min(WIDTH - width_of(&text) / 2.0);
            svg.text([inside, bottom + 18.0], Anchor::Middle, "tick", &text);
        }
        svg.line([left, bottom], [right, bottom], "axis");
        svg.text([(left + right) / 2.0, bottom + 36.0], Anchor::Middle, "faint", &along.name);
        Some(Field { x, y, left, right, top, bottom })
    }

    /// The position of a point; `None` if an axis cannot show it.
    pub fn place(&self, (x, point): &(f64, Point)) -> Option<[f64; 2]> {
        (self.x.shows(*x) && self.y.shows(point.y)).then(|| [self.x.at(*x), self.y.at(point.y)])
    }
}

/// `floor` is drawn as a limit line.
pub fn draw(chart: &Chart, along: &Along, lines: &[Line], floor: Option<&Line>) -> Option<String> {
    let all: Vec<(f64, Point)> =
        lines.iter().chain(floor).flat_map(|line| line.points.iter().copied()).collect();
    let mut svg = Svg::default();
    let field = Field::draw(&mut svg, chart, along, &all, FIELD)?;
    if let Some(floor) = floor {
        draw_floor(&mut svg, &field, floor);
    }
    for (number, line) in lines.iter().enumerate() {
        draw_line(&mut svg, chart, [&field.x, &field.y], number, line);
    }
    let Field { left, right, top, bottom, .. } = field;
    scatter::label(&mut svg, single(lines, &field).into_iter(), [left, right], [top, bottom]);
    let end = legend(&mut svg, lines, bottom + 56.0);
    Some(svg.inline(end, &chart.title))
}

/// CSS classes of line number `number` (its hue and dashes), and of its marks.
fn classes(number: usize, highlight: &str) -> (String, String) {
    let (hue, round) = (number % HUES, number / HUES);
    (format!("curve s{hue} dash{round}{highlight}"), format!("f{hue}"))
}

pub fn draw_floor(svg: &mut Svg, field: &Field, floor: &Line) {
    let mut points: Vec<[f64; 2]> = floor.points.iter().filter_map(|point| field.place(point)).collect();
    let (Some(&[_, first]), Some(&[_, last])) = (points.first(), points.last()) else { return };
    // The line spans the whole field.
    points.insert(0, [field.left, first]);
    points.push([field.right, last]);
    svg.polyline(&points, "floor");
    svg.text([field.right, last - 5.0], Anchor::End, "floor", &floor.name);
}

fn draw_line(svg: &mut Svg, chart: &Chart, [scale_x, scale_y]: [&Scale; 2], number: usize, line: &Line) {
    let (curve, fill) = classes(number, line.highlight);
    let shown = || line.points.iter().filter(|(x, p)| scale_x.shows(*x) && scale_y.shows(p.y));
    let points: Vec<[f64; 2]> = shown().map(|(x, p)| [scale_x.at(*x), scale_y.at(p.y)]).collect();
    svg.polyline(&points, &curve);
    let whisker = format!("whisker s{}", number % HUES);
    let mut last = f64::NEG_INFINITY;
    for ((x, point), &[at, y]) in shown().zip(&points) {
        if point.low < point.high {
            let (low, high) = (scale_y.at(point.low), scale_y.at(point.high));
            svg.line([at, low], [at, high], &whisker);
            for end in [low, high] {
                svg.line([at - 3.0, end], [at + 3.0, end], &whisker);
            }
        }
        // Marks that would touch are left out; the curve continues without them.
        if (at - last).abs() >= 9.0 {
            last = at;
            let tooltip = format!("{} at {}", point.described(&line.name, &chart.unit), tick(*x));
            svg.mark([at, y], number, &fill, &tooltip);
        }
    }
}

/// Labels (name and position) of the lines that have a single point, because such a line has no visible curve. Points
/// that lie on another line (the front of all points) come first, so their labels take precedence.
fn single<'a>(lines: &'a [Line], field: &Field) -> Vec<(&'a str, [f64; 2])> {
    let on_a_curve =
        |at: &(f64, Point)| lines.iter().any(|line| line.points.len() > 1 && line.points.contains(at));
    let alone = |line: &'a Line| match &line.points[..] {
        [at] => Some((!on_a_curve(at), &*line.name, field.place(at)?)),
        _ => None,
    };
    let mut found: Vec<_> = lines.iter().filter_map(alone).collect();
    found.sort_by_key(|(off, ..)| *off);
    found.into_iter().map(|(_, name, at)| (name, at)).collect()
}

/// Draws the names of the lines in as many rows as needed; returns the bottom.
fn legend(svg: &mut Svg, lines: &[Line], top: f64) -> f64 {
    let (mut x, mut y) = (0.0, top);
    let names: Vec<&str> = lines.iter().map(|line| &*line.name).collect();
    let names = cut_apart(&names, WIDTH - 40.0);
    for (number, (line, name)) in lines.iter().zip(names).enumerate() {
        let room = 30.0 + width_of(&name) + 8.0;
        if x > 0.0 && x + room > WIDTH {
            (x, y) = (0.0, y + 19.0);
        }
        let (curve, fill) = classes(number, line.highlight);
        svg.line([x, y], [x + 24.0, y], &curve);
        svg.mark([x + 12.0, y], number, &fill, &line.name);
        svg.text([x + 30.0, y + 4.5], Anchor::Start, &format!("name{}", line.highlight), &name);
        x += room;
    }
    y + 12.0
}

/// A chart with logarithmic axes, each of these points as a line of its own, and `front` as the last line.
#[cfg(test)]
pub fn points_and_front(
    points: &[(&str, [f64; 2])],
    (name, front): (&str, &[[f64; 2]]),
) -> (Chart, Along, Vec<Line>) {
    let line = |name: &str, points: &[[f64; 2]]| Line {
        name: name.into(),
        highlight: "",
        points: points.iter().map(|&[x, y]| (x, Point { y, low: y, high: y })).collect(),
    };
    let [title, below, quantity] = [""; 3].map(String::from);
    let chart = Chart { title, below, quantity, unit: String::new(), log: true };
    let lines = points.iter().map(|(name, at)| line(name, &[*at])).chain([line(name, front)]);
    (chart, Along { name: String::new(), log: true, at: None }, lines.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_one_point_are_labelled_those_on_a_curve_first() {
        let labels = |points: &[(&str, [f64; 2])]| {
            let front = [[1.0, 1.0], [10.0, 0.1], [100.0, 0.01]];
            let (chart, along, lines) = points_and_front(points, ("front of all", &front));
            let svg = draw(&chart, &along, &lines, None).unwrap();
            let is_label = |name: &str| svg.contains(&format!("class=\"faint\">{name}<"));
            (points.iter().map(|(name, _)| is_label(name)).collect::<Vec<_>>(), is_label("front of all"))
        };
        assert_eq!(labels(&[("a", [1.0, 1.0]), ("b", [10.0, 0.5])]), (vec![true, true], false));
        // Six points are in one place, which has room for four names at most.
        let crowd: Vec<String> = (0..6).map(|n| format!("method {n}")).collect();
        let (shown, _) = labels(&crowd.iter().map(|name| (&**name, [10.0, 0.1])).collect::<Vec<_>>());
        assert!(shown.contains(&true) && shown.contains(&false), "{shown:?}");
        // Only the last point is exactly on the front, so its label takes precedence.
        let off = |n: usize| [10.0, if n == 5 { 0.1 } else { 0.1001 }];
        let (shown, _) =
            labels(&crowd.iter().enumerate().map(|(n, name)| (&**name, off(n))).collect::<Vec<_>>());
        assert!(shown[5] && shown.contains(&false), "{shown:?}");
    }
}
