//! A figure's rows as comma-separated values (RFC 4180). A row is one line; a series is one line per point.

use super::{CellOutcome, FigureResult, Machine, Row, Value};
use crate::stats::Summary;
use std::fmt::Write as _;

const HEAD: &str = "figure,scene,x,variant,quantity,unit,value,p5,p95,min,max,count,at,text,device";

/// All rows of `figure`. A cell that failed or is missing is one line with the reason in `text`.
pub fn text(figure: &FigureResult, machines: &[Machine]) -> String {
    let mut text = format!("{HEAD}\n");
    for cell in &figure.cells {
        let x = cell.cell.x.map(|x| x.to_string()).unwrap_or_default();
        let place = format!("{},{},{x}", field(&figure.id), field(&cell.cell.scene));
        let device = cell.machine.map(|at| field(&machines[at].device)).unwrap_or_default();
        match &cell.outcome {
            CellOutcome::Rows(rows) => rows.iter().for_each(|row| lines(&mut text, &place, row, &device)),
            CellOutcome::Failed(why) | CellOutcome::Crashed(why) => {
                text.push_str(&format!("{place},,,,,,,,,,,{},{device}\n", field(&format!("failed: {why}"))));
            }
            CellOutcome::LeftOut(why) => {
                text.push_str(&format!("{place},,,,,,,,,,,{},\n", field(&format!("left out: {why}"))));
            }
            CellOutcome::Absent => text.push_str(&format!("{place},,,,,,,,,,,not measured,\n")),
        }
    }
    text
}

fn lines(text: &mut String, place: &str, row: &Row, device: &str) {
    let name = [&row.variant, &row.quantity, &row.unit].map(|name| field(name)).join(",");
    let mut line = |rest: String| {
        writeln!(text, "{place},{name},{rest},{device}").expect("writing to a string cannot fail");
    };
    let spread = |s: &Summary| format!("{},{},{},{},{},{}", s.median, s.p5, s.p95, s.min, s.max, s.count);
    match &row.value {
        Value::Summary(s) => line(format!("{},,", spread(s))),
        Value::Spreads(points) => points.iter().for_each(|(x, s)| line(format!("{},{x},", spread(s)))),
        Value::Number(number) => line(format!("{number},,,,,,,")),
        Value::Series(points) => points.iter().for_each(|[x, y]| line(format!("{y},,,,,,{x},"))),
        Value::Text(words) => line(format!(",,,,,,,{}", field(words))),
        Value::Missing(why) => line(format!(",,,,,,,{}", field(&format!("missing: {why}")))),
    }
}

/// The text as a field of a line, quoted if necessary.
fn field(text: &str) -> String {
    match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_string(),
    }
}
