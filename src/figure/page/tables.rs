//! A figure's numbers as tables, one for each quantity: scenes and values of the sweep against variants.

use crate::figure::words::human;
use crate::figure::{CellOutcome, CellRows, Figure, FigureResult, Row, Value, plot};
use crate::vk::Work;
use serde::Serialize;

/// One quantity's table.
#[derive(Serialize)]
pub struct TableView {
    quantity: String,
    unit: String,
    /// True if the table is open at first, false if a click opens it.
    open: bool,
    head: Vec<Name>,
    rows: Vec<RowView>,
    /// Reasons for missing values, numbered from 1.
    notes: Vec<String>,
}

#[derive(Serialize)]
struct RowView {
    name: Name,
    entries: Vec<Entry>,
}

/// The name of a variant or a cell.
#[derive(Clone, Serialize)]
struct Name {
    text: String,
    /// CSS class from `Figure::highlight`, with a leading space.
    highlight: &'static str,
}

#[derive(Clone, Default, Serialize)]
struct Entry {
    text: String,
    /// p5 to p95.
    spread: Option<String>,
    /// Counts of the work done in the measured time.
    work: Vec<String>,
    /// Number of a note.
    note: Option<usize>,
    /// True for text: aligned left, may wrap.
    words: bool,
}

/// Largest number of values in a table that is open at first.
const AT_ONCE: usize = 24;

/// All quantities in order of first appearance, except quantities that have only curves, which the plots show.
pub fn of(figure: &Figure, result: &FigureResult) -> Vec<TableView> {
    let measured: Vec<(&CellRows, &[Row])> = result
        .cells
        .iter()
        .filter_map(|cell| match &cell.outcome {
            CellOutcome::Rows(rows) => Some((cell, &rows[..])),
            _ => None,
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
        rows.iter().find(|row| row.quantity == quantity && row.variant == variant).cloned()
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
    let cells = used.iter().map(|(cell, _)| Name { text: cell.cell.to_string(), highlight: "" });
    let cells: Vec<Name> = cells.collect();
    let variants = variants.into_iter().map(|text| Name { highlight: figure.highlight(&text), text });
    let variants: Vec<Name> = variants.collect();
    // The longer side becomes the rows.
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
        head: [vec![Name { text: first.to_string(), highlight: "" }], head].concat(),
        rows: names.into_iter().zip(grid).map(|(name, entries)| RowView { name, entries }).collect(),
        notes,
    }
}

fn transposed(grid: &[Vec<Entry>]) -> Vec<Vec<Entry>> {
    let columns = grid.first().map_or(0, Vec::len);
    (0..columns).map(|column| grid.iter().map(|row| row[column].clone()).collect()).collect()
}

fn entry(row: Option<Row>, notes: &mut Vec<String>) -> Entry {
    let Some(Row { value, work, .. }) = row else { return Entry::default() };
    match value {
        Value::Number(number) => Entry { text: human(number), ..Entry::default() },
        Value::Summary(s) => {
            let spread = Some(format!("{} to {}", human(s.p5), human(s.p95)));
            let counts = work.iter().flat_map(Work::named).filter(|(_, count)| *count > 0);
            let work = counts.map(|(name, count)| format!("{name}: {}", human(count as f64))).collect();
            Entry { text: human(s.median), spread, work, ..Entry::default() }
        }
        Value::Series(points) => Entry { text: format!("{} points", points.len()), ..Entry::default() },
        Value::Spreads(points) => Entry { text: format!("{} points", points.len()), ..Entry::default() },
        Value::Text(text) => Entry { text, words: true, ..Entry::default() },
        Value::Missing(why) => {
            let known = notes.iter().position(|note| *note == why);
            let note = known.unwrap_or_else(|| {
                notes.push(why);
                notes.len() - 1
            });
            Entry { text: "missing".into(), note: Some(note + 1), ..Entry::default() }
        }
    }
}
