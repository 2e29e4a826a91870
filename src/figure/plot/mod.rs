//! Plots as SVG text, for the page and as files of their own; equal inputs give equal bytes.

mod bars;
mod lines;
mod scale;
pub mod scatter;
mod svg;

pub use svg::file;

use super::words::human;
use super::{Axis, CellRows, Figure, FigureResult, Machine, Outcome, Plot, Row, Value};
use crate::stats::Summary;
use bars::Bar;
use lines::{Along, Line};
use svg::{Anchor, Svg, WIDTH, shortened};

/// A finished plot.
pub struct Drawn {
    /// A file's stem: `vt.dedup-dedup-earth-oblique`.
    pub name: String,
    /// What it shows, and where.
    pub title: String,
    /// To stand in a page; [`file`] makes a file of it.
    pub svg: String,
}

/// A measured value with its spread; without one, low and high are the value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    pub y: f64,
    /// p5
    pub low: f64,
    /// p95
    pub high: f64,
}

/// What all charts say of themselves.
pub struct Chart {
    pub title: String,
    /// Device and spread, below the title.
    pub below: String,
    pub quantity: String,
    pub unit: String,
    /// The measured quantity's axis.
    pub log: bool,
}

impl Chart {
    /// Title and the line below; where they end.
    fn head(&self, svg: &mut Svg) -> f64 {
        svg.text([0.0, 14.0], Anchor::Start, "title", &shortened(&self.title, WIDTH));
        svg.text([0.0, 31.0], Anchor::Start, "faint", &shortened(&self.below, WIDTH * 1.08));
        42.0
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

    fn told(&self, name: &str, unit: &str) -> String {
        let spread = match self.low < self.high {
            true => format!(" ({} to {})", human(self.low), human(self.high)),
            false => String::new(),
        };
        format!("{name}: {}{spread} {unit}", human(self.y)).trim_end().to_string()
    }
}

/// All plots of a figure: for each of its [`Plot`]s one a scene, and one a value of the sweep where that is not the
/// axis. A plot without a number is left out.
pub fn draw(figure: &Figure, result: &FigureResult, machines: &[Machine]) -> Vec<Drawn> {
    let mut drawn = Vec::new();
    for plot in figure.plots {
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

fn one(figure: &Figure, plot: &Plot, cells: &[&CellRows], machines: &[Machine]) -> Option<Drawn> {
    let rows = || cells.iter().flat_map(|cell| rows_of(cell, plot.quantity));
    // What is missing has no unit.
    let sample = rows().find(|row| !row.unit.is_empty()).or_else(|| rows().next())?;
    let first = cells.first()?;
    let x = first.cell.x.filter(|_| plot.x != Axis::Sweep);
    // Beside the device: titles of both scene and sweep were cut.
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

/// Letters and digits of a name, for a file's.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect()
}

/// Device, and what the bars of spread are.
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
        Outcome::Rows(rows) => &rows[..],
        Outcome::Failed(_) | Outcome::Crashed(_) | Outcome::Absent => &[],
    };
    rows.iter().filter(move |row| row.quantity == quantity)
}

/// Variants in the figure's order, then those that it does not name, as they come; no floor among them.
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

fn draw_bars(figure: &Figure, plot: &Plot, chart: &Chart, cell: &CellRows) -> Option<String> {
    let bar = |name: String| {
        let value = value_of(cell, plot.quantity, &name).expect("a variant that was measured");
        let value = match (Point::of(value), value) {
            (Some(point), _) => Ok(point),
            (None, Value::Missing(why)) => Err(format!("not here: {why}")),
            (None, Value::Text(words)) => Err(words.clone()),
            (None, _) => Err("a series".into()),
        };
        Bar { name, value }
    };
    let names = variants(figure, &[cell], plot.quantity, plot.floor);
    let bars: Vec<Bar> = names.into_iter().map(bar).collect();
    let floor = plot.floor.and_then(|name| Some((name, value_of(cell, plot.quantity, name)?.number()?)));
    bars::draw(chart, &bars, floor)
}

fn draw_sweep(figure: &Figure, plot: &Plot, chart: &Chart, cells: &[&CellRows]) -> Option<String> {
    let line = |name: &str| {
        let point = |cell: &&CellRows| Some((cell.cell.x?, Point::of(value_of(cell, plot.quantity, name)?)?));
        Line { name: name.to_string(), points: cells.iter().filter_map(point).collect() }
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
    let lines: Vec<Line> =
        names.iter().filter_map(|name| Some(Line { name: name.clone(), points: series(name)? })).collect();
    let ends = lines.iter().flat_map(|line| line.points.iter().map(|(x, _)| *x));
    let ends: Vec<f64> =
        [ends.clone().reduce(f64::min), ends.reduce(f64::max)].into_iter().flatten().collect();
    // A floor may be a series itself, or one number all along.
    let floor = plot.floor.and_then(|floor| {
        let number = || value_of(cell, plot.quantity, floor)?.number();
        let flat = |y| ends.iter().map(|&x| (x, Point { y, low: y, high: y })).collect();
        Some(Line { name: floor.to_string(), points: series(floor).or_else(|| number().map(flat))? })
    });
    let along = Along { name: axis_name(name, plot.log_x), log: plot.log_x, at: None };
    lines::draw(chart, &along, &lines, floor.as_ref())
}

fn axis_name(name: &str, log: bool) -> String {
    format!("{name}{}", if log { " (logarithmic)" } else { "" })
}
