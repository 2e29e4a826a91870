//! The files of a report: the page, `results.json`, `summary.json`, `manifest.json`, and for each figure JSON, CSV and
//! plots.

use super::page::Beside;
use super::{CellResult, Changes, Figure, FigureResult, Machine, Results, Store, csv, json, page, plot};
use crate::header::JsonFormat;
use crate::picture::write::write_bytes;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use xxhash_rust::xxh3::xxh3_64;

/// `summary.json`: the claims of each figure under its id.
const SUMMARY: JsonFormat = JsonFormat::new("ortelius-summary", 1);
/// `FIGURE.json`
const FIGURE: JsonFormat = JsonFormat::new("ortelius-figure", 1);
/// `manifest.json`. Before format version 2, the key `version` held the program's version.
const MANIFEST: JsonFormat = JsonFormat::new("ortelius-manifest", 2);

/// Indented levels of the files: a measured row is one line.
const LEVELS: usize = 6;

/// What is needed to repeat a run, and the files that the run wrote.
#[derive(Serialize)]
struct Manifest<'a> {
    program_version: &'a str,
    command: &'a [String],
    effort: super::Effort,
    machines: &'a [Machine],
    /// Builds that measured cells; usually one build ([`super::program`]).
    programs: BTreeSet<&'a str>,
    /// Seconds for each figure and cell.
    seconds: BTreeMap<&'a str, BTreeMap<String, f64>>,
    /// XXH3 (64 bits, hexadecimal) of each file.
    files: BTreeMap<String, String>,
}

/// One figure with the context of its numbers.
#[derive(Serialize)]
struct FigureFile<'a> {
    effort: super::Effort,
    machines: &'a [Machine],
    #[serde(flatten)]
    figure: &'a FigureResult,
}

/// Writes the report of `results` for `figures` into the run's folder. `cells`: the stored cells;
/// `command`: the command line; `changes`: the comparison with other results, for the page.
///
/// # Errors
/// I/O errors; a picture that a cell names but that is missing.
pub fn write_outputs(
    store: &Store,
    figures: &[&Figure],
    results: &Results,
    cells: &[CellResult],
    command: &[String],
    changes: Option<&Changes>,
) -> anyhow::Result<()> {
    let mut files = BTreeMap::new();
    let mut put = |name: String, text: String| {
        files.insert(name.clone(), format!("{:016x}", xxh3_64(text.as_bytes())));
        write_bytes(&store.folder().join(name), &text)
    };
    let plots = page::plots(figures, results);
    for (figure, plots) in results.figures.iter().zip(&plots) {
        let file = FigureFile { effort: results.effort, machines: &results.machines, figure };
        put(format!("{}.json", figure.id), json::text(&FIGURE.head(file), LEVELS - 2))?;
        put(format!("{}.csv", figure.id), csv::text(figure, &results.machines))?;
        for drawn in plots {
            put(format!("{}.svg", drawn.name), plot::file(&drawn.svg))?;
        }
    }
    put("index.html".into(), page::html(figures, results, &plots, Beside::Run(store), changes)?)?;
    put("results.json".into(), results.text())?;
    let summary: BTreeMap<&str, _> = results.figures.iter().map(|f| (f.id.as_str(), &f.claims)).collect();
    put("summary.json".into(), json::text(&SUMMARY.head(summary), LEVELS))?;
    let mut seconds: BTreeMap<&str, BTreeMap<String, f64>> = BTreeMap::new();
    let mut programs = BTreeSet::new();
    for cell in cells.iter().filter(|cell| cell.effort == results.effort) {
        programs.insert(&*cell.program);
        seconds.entry(&cell.figure).or_default().insert(cell.cell.to_string(), cell.seconds);
    }
    let manifest = Manifest {
        program_version: &results.program_version,
        command,
        effort: results.effort,
        machines: &results.machines,
        programs,
        seconds,
        files,
    };
    let text = json::text(&MANIFEST.head(manifest), LEVELS);
    Ok(write_bytes(&store.folder().join("manifest.json"), &text)?)
}
