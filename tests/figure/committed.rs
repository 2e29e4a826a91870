//! This program can read every file of results/, and has every figure and claim that these files name.

use ortelius::figure::{CellOutcome, Results, Verdict, choose, page_of_results};
use ortelius::renderer::figures::FAMILIES;
use std::path::{Path, PathBuf};

/// Why a file must not be in results/.
fn objection(text: &str) -> Option<String> {
    let results = match Results::parse(text) {
        Ok(results) => results,
        Err(error) => return Some(error.to_string()),
    };
    if results.machines.is_empty() {
        return Some("no machine".into());
    }
    for result in &results.figures {
        let Ok(figures) = choose(&FAMILIES, std::slice::from_ref(&result.id)) else {
            return Some(format!("{}: no such figure", result.id));
        };
        let known = |id: &String| figures[0].claims.iter().any(|claim| claim.id == id);
        if let Some(claim) = result.claims.iter().find(|claim| !known(&claim.id)) {
            return Some(format!("{}: no such claim {}", result.id, claim.id));
        }
        let failed = result
            .cells
            .iter()
            .find(|cell| !matches!(cell.outcome, CellOutcome::Rows(_) | CellOutcome::LeftOut(_)));
        if let Some(cell) = failed {
            return Some(format!("{} {}: not measured", result.id, cell.cell));
        }
    }
    (results.figures.is_empty()).then(|| "no figure".into())
}

pub fn files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("results");
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.extension().is_some_and(|extension| extension == "json")).collect()
}

#[test]
fn every_file_of_results_is_readable_and_gives_a_page() {
    let known = choose(&FAMILIES, &[]).unwrap();
    for file in files() {
        let text = std::fs::read_to_string(&file).unwrap();
        assert_eq!(objection(&text), None, "{}", file.display());
        let results = Results::parse(&text).unwrap();
        let (page, unknown) = page_of_results(&results, &known).unwrap();
        assert_eq!(unknown, Vec::<String>::new(), "{}", file.display());
        for figure in &results.figures {
            assert!(page.contains(&format!("<section id=\"{}\"", figure.id)), "{}", figure.id);
        }
        assert!(!page.contains("<img") && page.contains("<svg"), "{}", file.display());
        let remark = page.contains("follow the rules of an earlier version");
        assert_eq!(remark, !results.has_rounds(), "{}", file.display());
    }
}

/// The first claim whose words or verdict differ from today's claim and judge.
fn outdated(results: &Results) -> Option<String> {
    let judged = results.judged_again(&choose(&FAMILIES, &[]).unwrap())?;
    let claims = |results: &Results| -> Vec<String> {
        results.claims().map(|(figure, claim)| format!("{} {claim:?}", figure.id)).collect()
    };
    let (stored, today) = (claims(results), claims(&judged));
    let differs = stored.iter().zip(&today).find(|(stored, today)| stored != today);
    match differs {
        Some((stored, today)) => Some(format!("stored: {stored}; today: {today}")),
        None => {
            (stored.len() != today.len()).then(|| format!("{} claims; today {}", stored.len(), today.len()))
        }
    }
}

#[test]
fn stored_claims_are_worded_and_judged_as_today() {
    for file in files() {
        let results = Results::parse(&std::fs::read_to_string(&file).unwrap()).unwrap();
        assert_eq!(
            outdated(&results),
            None,
            "{0}: `ortelius page {0} --json {0}` judges it again",
            file.display()
        );
    }
}

#[test]
fn another_text_verdict_or_number_of_claims_is_outdated_and_judged_again() {
    let of = |name: &str| files().into_iter().find(|file| file.ends_with(name)).unwrap();
    let read = |name: &str| Results::parse(&std::fs::read_to_string(of(name)).unwrap()).unwrap();
    let stored = read("lavapipe-2-cores-tm.json");
    for change in [
        (|results| results.figures[0].claims[0].text += " always") as fn(&mut Results),
        |results| results.figures[0].claims[0].finding.verdict = Verdict::NotMeasurable,
        |results| drop(results.figures.last_mut().unwrap().claims.pop()),
    ] {
        let mut changed = stored.clone();
        change(&mut changed);
        assert!(outdated(&changed).is_some());
        let judged = changed.judged_again(&choose(&FAMILIES, &[]).unwrap()).unwrap();
        assert_eq!(judged.text(), stored.text());
    }
    // A cell that is no longer stored leaves its claims unmeasured.
    let mut fewer = stored.clone();
    fewer.figures[0].cells.remove(0);
    assert!(outdated(&fewer).is_some_and(|why| why.contains("missing cells: 1 left out")));
    // Formats 1 and 2 have no rounds.
    let earlier = stored.text().replacen("\"version\": 5", "\"version\": 2", 1);
    assert!(Results::parse(&earlier).unwrap().judged_again(&[]).is_none());
}

#[test]
fn an_unknown_figure_is_left_out_of_the_page_and_named() {
    let text = std::fs::read_to_string(&files()[0]).unwrap();
    let mut results = Results::parse(&text).unwrap();
    results.figures[0].id = "vt.of-another-program".into();
    let (page, unknown) = page_of_results(&results, &choose(&FAMILIES, &[]).unwrap()).unwrap();
    assert_eq!(unknown, ["vt.of-another-program"]);
    assert!(!page.contains("vt.of-another-program"));
}

#[test]
fn unreadable_foreign_or_incomplete_results_are_rejected() {
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
    let rejected = |text: &str, word: &str| {
        let objection = objection(text).unwrap();
        assert!(objection.contains(word), "{objection}");
    };
    rejected("{}", "not results of `ortelius reproduce`");
    rejected(&text("vt.no-such-figure", claim, rows), "no such figure");
    rejected(&text(id, "no-such-claim", rows), "no such claim");
    rejected(&text(id, claim, r#""failed": "why""#), "not measured");
    rejected(&text(id, claim, rows).replace("results 1", "results 0"), "has format");
}
