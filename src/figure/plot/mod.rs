//! Plots as SVG text, for the page and as files; equal inputs give equal bytes.

mod bars;
mod families;
mod lines;
mod scale;
pub mod scatter;
mod svg;

pub use svg::{escaped, file};

use super::words::human;
use super::{Axis, CellOutcome, CellRows, Figure, FigureResult, Machine, Plot, Row, Value};
use crate::stats::Summary;
use bars::{Bar, Group};
use lines::{Along, Line};
use svg::{Anchor, Svg, WIDTH, wrapped};

/// A finished plot.
pub struct Drawn {
    /// File stem: `vt.dedup-dedup-earth-oblique`.
    pub name: String,
    /// Title: quantity and place.
    pub title: String,
    /// SVG for the page; [`file`] makes a stand-alone file of it.
    pub svg: String,
}

/// A measured value with its spread; without a spread, low and high equal the value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    pub y: f64,
    /// p5
    pub low: f64,
    /// p95
    pub high: f64,
}

/// The common parts of all charts.
pub struct Chart {
    pub title: String,
    /// Device and spread, below the title.
    pub below: String,
    pub quantity: String,
    pub unit: String,
    /// True for a logarithmic axis of the measured quantity.
    pub log: bool,
}

impl Chart {
    /// Draws the title and the line below; returns the bottom.
    fn head(&self, svg: &mut Svg) -> f64 {
        // Titles are bold and larger: a letter is up to 1.2 times as wide.
        let title = wrapped(&self.title, WIDTH / 1.2);
        let below = svg.lines([0.0, 14.0], Anchor::Start, "title", &title) + 1.0;
        svg.lines([0.0, below], Anchor::Start, "faint", &wrapped(&self.below, WIDTH)) - 5.0
    }

    /// "time, ms (logarithmic)"
    fn axis(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(", {}", self.unit) };
        format!("{}{unit}{}", self.quantity, if self.log { " (logarithmic)" } else { "" })
    }
}

impl Point {
    fn of_summary(s: &Summary) -> Point {
        Point { y: s.median, low: s.p5, high: s.p95 }
    }

    fn of(value: &Value) -> Option<Point> {
        match value {
            Value::Summary(s) => Some(Point::of_summary(s)),
            Value::Number(y) => Some(Point { y: *y, low: *y, high: *y }),
            Value::Series(_) | Value::Spreads(_) | Value::Text(_) | Value::Missing(_) => None,
        }
    }

    fn described(&self, name: &str, unit: &str) -> String {
        let spread = match self.low < self.high {
            true => format!(" ({} to {})", human(self.low), human(self.high)),
            false => String::new(),
        };
        format!("{name}: {}{spread} {unit}", human(self.y)).trim_end().to_string()
    }
}

/// Up to this number, bars of all cells share one chart.
const MAX_BARS: usize = 16;

/// All plots of a figure. Each [`Plot`] is drawn once for each scene, and once for each value of the sweep
/// unless the sweep is the axis. Up to `MAX_BARS` bars of all scenes and values share one chart. A plot
/// without numbers is left out.
pub fn draw(figure: &Figure, result: &FigureResult, machines: &[Machine]) -> Vec<Drawn> {
    let mut drawn = Vec::new();
    for plot in figure.plots {
        let all: Vec<&CellRows> = result.cells.iter().collect();
        let bars = all.iter().map(|cell| rows_of(cell, plot.quantity).count()).sum::<usize>();
        if plot.x == Axis::Variant && plot.floor.is_none() && all.len() > 1 && bars <= MAX_BARS {
            drawn.extend(grouped(figure, plot, &all, machines));
            continue;
        }
        for scene in figure.scenes {
            let cells: Vec<&CellRows> = result.cells.iter().filter(|c| c.cell.scene == *scene).collect();
            match plot.x {
                Axis::Sweep => drawn.extend(one(figure, plot, &cells, machines)),
                Axis::Variant | Axis::Series(_) => {
                    drawn.extend(cells.iter().filter_map(|cell| one(figure, plot, &[*cell], machines)));
                }
            }
        }
    }
    drawn
}

/// The bars of several cells in one chart.
fn grouped(figure: &Figure, plot: &Plot, cells: &[&CellRows], machines: &[Machine]) -> Option<Drawn> {
    let groups: Vec<Group> = cells.iter().map(|cell| group(figure, plot, cell)).collect();
    let groups: Vec<Group> = groups.into_iter().filter(|group| !group.bars.is_empty()).collect();
    let rows = || cells.iter().flat_map(|cell| rows_of(cell, plot.quantity));
    let chart = Chart {
        title: plot.quantity.to_string(),
        below: below(cells, plot.quantity, machines),
        quantity: plot.quantity.to_string(),
        unit: rows().find(|row| !row.unit.is_empty()).map(|row| row.unit.clone()).unwrap_or_default(),
        log: plot.log_y,
    };
    let svg = bars::draw(&chart, &groups, None)?;
    let name = format!("{}-{}", figure.id, plain(plot.quantity));
    Some(Drawn { name, title: chart.title, svg })
}

fn one(figure: &Figure, plot: &Plot, cells: &[&CellRows], machines: &[Machine]) -> Option<Drawn> {
    let rows = || cells.iter().flat_map(|cell| rows_of(cell, plot.quantity));
    // Missing values have no unit.
    let sample = rows().find(|row| !row.unit.is_empty()).or_else(|| rows().next())?;
    let first = cells.first()?;
    let x = first.cell.x.filter(|_| plot.x != Axis::Sweep);
    // The sweep's value is written beside the device: titles with both scene and sweep were too long.
    let swept = x.zip(figure.sweep.as_ref()).map(|(x, sweep)| format!("{}: {} · ", sweep.name, human(x)));
    let chart = Chart {
        title: format!("{}: {}", plot.quantity, first.cell.scene),
        below: swept.unwrap_or_default() + &below(cells, plot.quantity, machines),
        quantity: plot.quantity.to_string(),
        unit: sample.unit.clone(),
        log: plot.log_y,
    };
    let svg = match plot.x {
        Axis::Variant => draw_bars(figure, plot, &chart, first),
        Axis::Sweep => draw_sweep(figure, plot, &chart, cells),
        Axis::Series(name) => draw_series(figure, plot, &chart, first, name),
    }?;
    let x = x.map(|x| format!("@{x}")).unwrap_or_default();
    let name = format!("{}-{}-{}{x}", figure.id, plain(plot.quantity), plain(&first.cell.scene));
    Some(Drawn { name, title: chart.title, svg })
}

/// Letters and digits of a name, for a file name.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect()
}

/// The device, and the meaning of the spread bars.
fn below(cells: &[&CellRows], quantity: &str, machines: &[Machine]) -> String {
    let mut devices: Vec<&str> =
        cells.iter().filter_map(|cell| Some(&*machines[cell.machine?].device)).collect();
    devices.dedup();
    let counts = cells.iter().flat_map(|cell| rows_of(cell, quantity)).filter_map(|row| match &row.value {
        Value::Summary(summary) => Some(summary.count),
        Value::Spreads(points) => points.iter().map(|(_, summary)| summary.count).max(),
        _ => None,
    });
    let spread = counts.max().map(|count| format!("median of {count}, p5 to p95 · ")).unwrap_or_default();
    format!("{spread}{}", devices.join(", "))
}

fn rows_of<'a>(cell: &'a CellRows, quantity: &'a str) -> impl Iterator<Item = &'a Row> {
    let rows = match &cell.outcome {
        CellOutcome::Rows(rows) => &rows[..],
        _ => &[],
    };
    rows.iter().filter(move |row| row.quantity == quantity)
}

/// Variants in the figure's order, then other measured variants in order of appearance. `floor`, the variant that
/// `Plot::floor` draws as a line, is left out.
pub fn variants(figure: &Figure, cells: &[&CellRows], quantity: &str, floor: Option<&str>) -> Vec<String> {
    let measured: Vec<&str> =
        cells.iter().flat_map(|cell| rows_of(cell, quantity)).map(|row| &*row.variant).collect();
    let mut names: Vec<String> =
        (figure.variants)().into_iter().filter(|name| measured.contains(&&**name)).collect();
    for name in measured {
        if !names.iter().any(|known| known == name) {
            names.push(name.to_string());
        }
    }
    names.retain(|name| floor != Some(name));
    names
}

fn value_of<'a>(cell: &'a CellRows, quantity: &'a str, variant: &str) -> Option<&'a Value> {
    rows_of(cell, quantity).find(|row| row.variant == variant).map(|row| &row.value)
}

fn group(figure: &Figure, plot: &Plot, cell: &CellRows) -> Group {
    let bar = |name: String| {
        let value = value_of(cell, plot.quantity, &name).expect("a variant that was measured");
        let value = match (Point::of(value), value) {
            (Some(point), _) => Ok(point),
            (None, Value::Missing(why)) => Err(format!("missing: {why}")),
            (None, Value::Text(words)) => Err(words.clone()),
            (None, _) => Err("a series".into()),
        };
        Bar { highlight: figure.highlight(&name), name, value }
    };
    let names = variants(figure, &[cell], plot.quantity, plot.floor);
    let mut bars: Vec<Bar> = Vec::new();
    for bar in names.into_iter().map(bar) {
        match bars.last_mut() {
            // Adjacent variants that are missing for the same reason share one bar.
            Some(last) if bar.value.is_err() && last.value == bar.value => {
                last.name = format!("{}, {}", last.name, bar.name);
            }
            _ => bars.push(bar),
        }
    }
    Group { name: cell.cell.to_string(), bars }
}

fn draw_bars(figure: &Figure, plot: &Plot, chart: &Chart, cell: &CellRows) -> Option<String> {
    let floor = plot.floor.and_then(|name| Some((name, value_of(cell, plot.quantity, name)?.number()?)));
    bars::draw(chart, &[group(figure, plot, cell)], floor)
}

fn draw_sweep(figure: &Figure, plot: &Plot, chart: &Chart, cells: &[&CellRows]) -> Option<String> {
    let line = |name: &str| {
        let point = |cell: &&CellRows| Some((cell.cell.x?, Point::of(value_of(cell, plot.quantity, name)?)?));
        let points = cells.iter().filter_map(point).collect();
        Line { name: name.to_string(), highlight: figure.highlight(name), points }
    };
    let sweep = figure.sweep.as_ref()?;
    let at = cells.iter().filter_map(|cell| cell.cell.x).collect();
    let along = Along { name: axis_name(sweep.name, plot.log_x), log: plot.log_x, at: Some(at) };
    let names = variants(figure, cells, plot.quantity, plot.floor);
    let mut lines: Vec<Line> = names.iter().map(|name| line(name)).collect();
    lines.retain(|line| !line.points.is_empty());
    lines::draw(chart, &along, &lines, plot.floor.map(line).as_ref())
}

fn draw_series(figure: &Figure, plot: &Plot, chart: &Chart, cell: &CellRows, name: &str) -> Option<String> {
    let names = variants(figure, &[cell], plot.quantity, plot.floor);
    let series = |name: &str| match value_of(cell, plot.quantity, name) {
        Some(Value::Series(points)) => {
            Some(points.iter().map(|[x, y]| (*x, Point { y: *y, low: *y, high: *y })).collect::<Vec<_>>())
        }
        Some(Value::Spreads(points)) => {
            Some(points.iter().map(|(x, s)| (*x, Point::of_summary(s))).collect())
        }
        _ => None,
    };
    let line = |name: &String| {
        Some(Line { name: name.clone(), highlight: figure.highlight(name), points: series(name)? })
    };
    let lines: Vec<Line> = names.iter().filter_map(line).collect();
    let ends = lines.iter().flat_map(|line| line.points.iter().map(|(x, _)| *x));
    let ends: Vec<f64> =
        [ends.clone().reduce(f64::min), ends.reduce(f64::max)].into_iter().flatten().collect();
    // A floor is a series or one constant.
    let floor = plot.floor.and_then(|floor| {
        let number = || value_of(cell, plot.quantity, floor)?.number();
        let flat = |y| ends.iter().map(|&x| (x, Point { y, low: y, high: y })).collect();
        let points = series(floor).or_else(|| number().map(flat))?;
        Some(Line { name: floor.to_string(), highlight: "", points })
    });
    let along = Along { name: axis_name(name, plot.log_x), log: plot.log_x, at: None };
    match plot.families {
        Some(family) => families::draw(chart, &along, &lines, floor.as_ref(), (family, &(figure.variants)())),
        None => lines::draw(chart, &along, &lines, floor.as_ref()),
    }
}

fn axis_name(name: &str, log: bool) -> String {
    format!("{name}{}", if log { " (logarithmic)" } else { "" })
}
