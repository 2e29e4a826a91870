//! A figure's numbers as tables, one a quantity: scenes and values of the sweep against variants.

use crate::figure::words::human;
use crate::figure::{CellRows, Figure, FigureResult, Outcome, Row, Value, plot};
use serde::Serialize;

/// One quantity's table.
#[derive(Serialize)]
pub struct TableView {
    quantity: String,
    unit: String,
    /// Shown at once, or behind a click.
    open: bool,
    head: Vec<String>,
    rows: Vec<RowView>,
    /// Reasons of what is missing, by their numbers from 1.
    notes: Vec<String>,
}

#[derive(Serialize)]
struct RowView {
    name: String,
    entries: Vec<Entry>,
}

#[derive(Clone, Default, Serialize)]
struct Entry {
    text: String,
    /// p5 to p95.
    spread: Option<String>,
    /// Number of a note.
    note: Option<usize>,
    /// Not a number: stands left and may wrap.
    words: bool,
}

/// More entries than these are shown behind a click.
const AT_ONCE: usize = 24;

/// All quantities in order of their first appearance; those that are only curves are left to the plots.
pub fn of(figure: &Figure, result: &FigureResult) -> Vec<TableView> {
    let measured: Vec<(&CellRows, &[Row])> = result
        .cells
        .iter()
        .filter_map(|cell| match &cell.outcome {
            Outcome::Rows(rows) => Some((cell, &rows[..])),
            Outcome::Failed(_) | Outcome::Crashed(_) | Outcome::Absent => None,
        })
        .collect();
    let mut quantities: Vec<&str> = Vec::new();
    for row in measured.iter().flat_map(|(_, rows)| *rows) {
        if !matches!(row.value, Value::Series(_) | Value::Spreads(_)) && !quantities.contains(&&*row.quantity)
        {
            quantities.push(&row.quantity);
        }
    }
    quantities.into_iter().map(|quantity| table(figure, &measured, quantity)).collect()
}

fn table(figure: &Figure, measured: &[(&CellRows, &[Row])], quantity: &str) -> TableView {
    let find = |rows: &'_ [Row], variant: &str| {
        rows.iter()
            .find(|row| row.quantity == quantity && row.variant == variant)
            .map(|row| row.value.clone())
    };
    let cells: Vec<&CellRows> = measured.iter().map(|(cell, _)| *cell).collect();
    let variants = plot::variants(figure, &cells, quantity, None);
    let used: Vec<_> =
        measured.iter().filter(|(_, rows)| rows.iter().any(|r| r.quantity == quantity)).collect();
    let mut notes = Vec::new();
    let grid: Vec<Vec<Entry>> = used
        .iter()
        .map(|(_, rows)| variants.iter().map(|variant| entry(find(rows, variant), &mut notes)).collect())
        .collect();
    let cells: Vec<String> = used.iter().map(|(cell, _)| cell.cell.to_string()).collect();
    // The longer side goes down the page.
    let (first, head, names, grid) = match variants.len() > cells.len() {
        true => ("variant", cells, variants, transposed(&grid)),
        false => ("scene", variants, cells, grid),
    };
    let mut rows = measured.iter().flat_map(|(_, rows)| *rows);
    let unit = rows.find(|row| row.quantity == quantity && !row.unit.is_empty());
    TableView {
        quantity: quantity.to_string(),
        unit: unit.map(|row| row.unit.clone()).unwrap_or_default(),
        open: grid.iter().map(Vec::len).sum::<usize>() <= AT_ONCE,
        head: [vec![first.to_string()], head].concat(),
        rows: names.into_iter().zip(grid).map(|(name, entries)| RowView { name, entries }).collect(),
        notes,
    }
}

fn transposed(grid: &[Vec<Entry>]) -> Vec<Vec<Entry>> {
    let columns = grid.first().map_or(0, Vec::len);
    (0..columns).map(|column| grid.iter().map(|row| row[column].clone()).collect()).collect()
}

fn entry(value: Option<Value>, notes: &mut Vec<String>) -> Entry {
    match value {
        None => Entry::default(),
        Some(Value::Number(number)) => Entry { text: human(number), ..Entry::default() },
        Some(Value::Summary(s)) => {
            let spread = Some(format!("{} to {}", human(s.p5), human(s.p95)));
            Entry { text: human(s.median), spread, ..Entry::default() }
        }
        Some(Value::Series(points)) => Entry { text: format!("{} points", points.len()), ..Entry::default() },
        Some(Value::Spreads(points)) => {
            Entry { text: format!("{} points", points.len()), ..Entry::default() }
        }
        Some(Value::Text(text)) => Entry { text, words: true, ..Entry::default() },
        Some(Value::Missing(why)) => {
            let known = notes.iter().position(|note| *note == why);
            let note = known.unwrap_or_else(|| {
                notes.push(why);
                notes.len() - 1
            });
            Entry { text: "not here".into(), note: Some(note + 1), ..Entry::default() }
        }
    }
}
