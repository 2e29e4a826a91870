//! What stands under results/ is readable by this program, and of figures and claims that it has.

use ortelius::figure::{Outcome, Results, choose};
use ortelius::paper::FAMILIES;
use std::path::{Path, PathBuf};

/// Why a file of results cannot stand there.
fn objection(text: &str) -> Option<String> {
    let results = match Results::parse(text) {
        Ok(results) => results,
        Err(error) => return Some(error.to_string()),
    };
    if results.machines.is_empty() {
        return Some("of no machine".into());
    }
    for result in &results.figures {
        let Ok(figures) = choose(&FAMILIES, std::slice::from_ref(&result.id)) else {
            return Some(format!("{}: no such figure", result.id));
        };
        let known = |id: &String| figures[0].claims.iter().any(|claim| claim.id == id);
        if let Some(claim) = result.claims.iter().find(|claim| !known(&claim.id)) {
            return Some(format!("{}: no such claim {}", result.id, claim.id));
        }
        let failed = result.cells.iter().find(|cell| !matches!(cell.outcome, Outcome::Rows(_)));
        if let Some(cell) = failed {
            return Some(format!("{} {}: not measured", result.id, cell.cell));
        }
    }
    (results.figures.is_empty()).then(|| "no figure".into())
}

fn files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("results");
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.extension().is_some_and(|extension| extension == "json")).collect()
}

#[test]
fn every_file_of_results_is_read_and_has_its_page() {
    for file in files() {
        let text = std::fs::read_to_string(&file).unwrap();
        assert_eq!(objection(&text), None, "{}", file.display());
        assert!(file.with_extension("html").exists(), "{} has no page beside it", file.display());
    }
}

#[test]
fn what_is_unreadable_of_another_figure_or_half_measured_is_rejected() {
    let figure = choose(&FAMILIES, &[]).unwrap()[0];
    let text = |id: &str, claim: &str, outcome: &str| {
        format!(
            r#"{{"format": "ortelius results 1", "version": "0", "effort": "quick", "machines": [{}], "figures": [
            {{"id": "{id}", "title": "", "claims": [{{"id": "{claim}", "text": "", "from": "ours",
            "verdict": "reproduced", "numbers": "", "why": ""}}],
            "cells": [{{"scene": "s", "x": null, "machine": 0, "pictures": [], {outcome}}}]}}]}}"#,
            serde_json::to_string(&super::machine()).unwrap()
        )
    };
    let (id, claim, rows) = (figure.id, figure.claims[0].id, r#""rows": []"#);
    assert_eq!(objection(&text(id, claim, rows)), None);
    let told = |text: &str, word: &str| {
        let objection = objection(text).unwrap();
        assert!(objection.contains(word), "{objection}");
    };
    told("{}", "no results of this program");
    told(&text("vt.no-such-figure", claim, rows), "no such figure");
    told(&text(id, "no-such-claim", rows), "no such claim");
    told(&text(id, claim, r#""failed": "why""#), "not measured");
    told(&text(id, claim, rows).replace("results 1", "results 0"), "of format");
}
