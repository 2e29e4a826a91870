//! Contents of a report.

use super::family::{BARS, FAILS, MANY, SWEPT};
use super::*;
use ortelius::figure::{CellOutcome, Verdict, merge};
use std::path::PathBuf;

#[test]
fn results_are_read_back_bit_for_bit() {
    let folder = folder();
    let results = reported(&[&SWEPT, &BARS], folder.path());
    let again = Results::parse(&read(folder.path(), "results.json")).unwrap();
    // Compared as text, because NaN != NaN.
    assert_eq!(format!("{again:?}"), format!("{results:?}"));
    assert!(format!("{again:?}").contains("Number(NaN)") && format!("{again:?}").contains("Number(inf)"));
}

#[test]
fn every_claim_has_its_verdict_with_numbers_in_the_summary() {
    let folder = folder();
    reported(&[&SWEPT, &BARS], folder.path());
    let summary: serde_json::Value = serde_json::from_str(&read(folder.path(), "summary.json")).unwrap();
    let claims = summary["made.swept"].as_array().unwrap();
    let verdicts: Vec<_> = claims.iter().map(|claim| claim["verdict"].as_str().unwrap()).collect();
    assert_eq!(verdicts, ["reproduced", "in-part", "not-reproduced", "not-measurable"]);
    assert_eq!(
        claims[0]["numbers"],
        "size, double over single: earth/oblique at 1: 2x, earth/oblique at 2.5: 2x, earth/oblique at 1000000: 2x, globe at 1: \
         2x, globe at 2.5: 2x, globe at 1000000: 2x"
    );
    assert_eq!(claims[0]["from"], "paper, section 1");
    assert_eq!(summary["made.bars"][0]["why"], "1 of 1 above 1");
}

#[test]
fn rows_are_lines_of_the_csv() {
    let folder = folder();
    reported(&[&SWEPT, &BARS], folder.path());
    let text = read(folder.path(), "made.bars.csv");
    for line in [
        "figure,scene,x,variant,quantity,unit,value,p5,p95,min,max,count,at,text,device",
        "made.bars,plane,,absent,time,ms,,,,,,,,missing: no geometry shader,made-up device",
        "made.bars,plane,,worded,time,ms,,,,,,,,too small to tell,made-up device",
        "made.bars,plane,,slow,error,,0.5,,,,,,10,,made-up device",
    ] {
        assert!(text.lines().any(|found| found == line), "no {line:?} in {text}");
    }
    let columns = |line: &str| line.split(',').count();
    assert!(text.lines().all(|line| columns(line) == 15), "{text}");
    let swept = read(folder.path(), "made.swept.csv");
    assert!(
        swept.contains("made.swept,globe,2.5,single,size,texels,0.8333333333333334,,,,,,,,made-up device\n")
    );
    assert!(swept.contains("single,distance,texels,inf,") && swept.contains("double,distance,texels,NaN,"));
}

#[test]
fn the_manifest_has_the_checksum_of_every_file() {
    let folder = folder();
    reported(&[&SWEPT, &BARS], folder.path());
    let manifest: serde_json::Value = serde_json::from_str(&read(folder.path(), "manifest.json")).unwrap();
    let files = manifest["files"].as_object().unwrap();
    for name in ["results.json", "summary.json", "made.swept.csv", "made.swept.json", "made.bars.csv"] {
        let sum = xxhash_rust::xxh3::xxh3_64(read(folder.path(), name).as_bytes());
        assert_eq!(files[name], format!("{sum:016x}"), "{name}");
    }
    assert_eq!(manifest["machines"][0]["processor"], "made-up processor");
    assert!(manifest["seconds"]["made.swept"]["earth/oblique at 2.5"].as_f64().unwrap() >= 0.0);
}

#[test]
fn a_claim_with_missing_cells_is_not_measured() {
    let folder = folder();
    let mut part = a_run(&[&SWEPT], folder.path());
    part.partition = Partition { index: 2, of: 2 };
    run(&part).unwrap();
    let results = report(&[&SWEPT, &BARS], folder.path());
    let claims = &results.figures[0].claims;
    assert_eq!(claims[0].finding.verdict, Verdict::NotMeasured);
    assert_eq!(claims[0].finding.why, "missing cells: 3 left out");
    // A claim that fails in all measured cells is also not measured, because it may hold in the missing ones.
    assert_eq!(claims[2].finding.verdict, Verdict::NotMeasured);
    assert_eq!(results.figures[1].claims[0].finding.why, "no cell was measured");
    let absent = results.figures[0].cells.iter().filter(|cell| cell.outcome == CellOutcome::Absent).count();
    assert_eq!(absent, 3);
}

#[test]
fn the_page_has_every_claim_verdict_and_plot_and_is_self_contained() {
    let folder = folder();
    let results = reported(&[&SWEPT, &BARS, &MANY, &FAILS], folder.path());
    let page = read(folder.path(), "index.html");
    for (figure, claim) in results.claims() {
        let text =
            claim.text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;");
        let badge = format!("{}</span> {text} <span", claim.finding.verdict.name());
        assert!(page.contains(&badge), "{} {}: no {badge:?}", figure.id, claim.id);
    }
    for verdict in [
        "2 reproduced",
        "1 in part",
        "2 not reproduced",
        "1 not measurable on this device",
        "1 not measured",
        "2 cells failed",
    ] {
        assert!(page.contains(&format!(">{verdict}</span>")), "no {verdict:?}");
    }
    assert!(page.contains(
        "Quick run, without three fifths of the runs of each timed pass, and side, texels: 2, 3, 4."
    ));
    assert!(page.contains("the disk is on fire") && page.contains("do not predict GPU rankings"));
    for part in ["\"bar cited\"", "\"bar ours\"", "<th class=\"cited\">slow", "<th class=\"ours\">fast"] {
        assert!(page.contains(part), "no {part}");
    }
    // 16 plots. SWEPT: one in each of two scenes. BARS: bars and a series. MANY, in each of two scenes: a sweep, and
    // bars for each of 5 values.
    let files =
        std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let plots: Vec<String> = files.filter(|name| name.ends_with(".svg")).collect();
    assert_eq!((plots.len(), page.matches("<svg ").count()), (16, 16), "{plots:?}");
    for plot in plots {
        let text = read(folder.path(), &plot);
        assert!(
            text.contains("<style>") && text.contains("made-up device") && !text.contains("NaN"),
            "{plot}"
        );
    }
    // Both pictures are embedded, links are relative, and nothing is fetched.
    assert_eq!(page.matches("src=\"data:image/png;base64,").count(), 2);
    assert_eq!(page.matches("src=").count(), 2);
    assert!(!page.contains("http-equiv") && !page.contains("@import") && !page.contains("<script"));
    let outside = page.matches("http").count() - page.matches("xmlns=\"http://www.w3.org/2000/svg\"").count();
    assert_eq!(outside, 0, "the page names other places");
}

#[test]
fn equal_results_give_equal_bytes() {
    let (one, other) = (folder(), folder());
    for folder in [&one, &other] {
        reported(&[&SWEPT, &BARS, &MANY], folder.path());
    }
    for name in ["index.html", "results.json", "made.swept.csv", "made.many-dedup-globe.svg"] {
        assert_eq!(read(one.path(), name), read(other.path(), name), "{name}");
    }
}

#[test]
fn a_plot_shows_spread_floor_unit_and_missing_variants() {
    let folder = folder();
    reported(&[&BARS], folder.path());
    let bars = read(folder.path(), "made.bars-time-plane.svg");
    for part in [
        "median of 3, p5 to p95 · made-up device",
        "time, ms",
        "empty pass: 0.1",
        "missing: no geometry shader",
    ] {
        assert!(bars.contains(part), "no {part:?} in {bars}");
    }
    assert_eq!(bars.matches("<rect").count(), 3, "paper, and a bar for each of two variants");
    assert!(bars.contains("slow: 4 (3.1 to 5.35) ms"));
    let series = read(folder.path(), "made.bars-error-plane.svg");
    assert!(series.contains("error (logarithmic)") && series.contains("time since the cut, ms"));
    assert_eq!(series.matches("<polyline").count(), 2);
}

/// A folder's JSON files with their text, without pictures and lists.
fn json_files(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(json_files(&path));
        } else if path.extension().is_some_and(|ending| ending == "json") {
            found.push((path.clone(), std::fs::read_to_string(path).unwrap()));
        }
    }
    found
}

/// Strips the first lines, which are the header.
fn without_header(text: &str) -> String {
    let head: Vec<&str> = text.lines().take(3).collect();
    assert!(
        head[1].starts_with("  \"format\": \"ortelius-") && head[2].starts_with("  \"version\": "),
        "{text}"
    );
    text.replacen(&format!("{}\n{}\n", head[1], head[2]), "", 1)
}

#[test]
fn every_file_has_a_header_and_files_without_one_are_read_as_version_1() {
    let (folder, merged) = (folder(), super::folder());
    let results = reported(&[&SWEPT, &BARS], folder.path());
    let files = json_files(folder.path());
    let cells = |folder: &Path| Store::at(folder).all(&[&SWEPT, &BARS]);
    let before = format!("{:?}", cells(folder.path()).unwrap());
    assert!(files.len() > 10, "cells, figures, results, summary, manifest");
    for (path, text) in &files {
        std::fs::write(path, without_header(text)).unwrap();
    }
    assert_eq!(format!("{:?}", cells(folder.path()).unwrap()), before);
    merge(&[folder.path()], merged.path(), &[&SWEPT, &BARS]).unwrap();
    assert_eq!(format!("{:?}", cells(merged.path()).unwrap()), before);
    let mut resumed = a_run(&[&SWEPT, &BARS], folder.path());
    resumed.resume = true;
    assert_eq!(run(&resumed).unwrap().measured, 0, "all cells are kept");
    let read = Results::parse(&read(folder.path(), "results.json")).unwrap();
    assert_eq!(format!("{:?}", read.figures), format!("{:?}", results.figures));
}

#[test]
fn a_newer_cell_is_rejected_with_both_versions() {
    let folder = folder();
    reported(&[&BARS], folder.path());
    for (path, text) in json_files(&folder.path().join("cells")) {
        std::fs::write(path, text.replacen("\"version\": 1", "\"version\": 2", 1)).unwrap();
    }
    let line = Store::at(folder.path()).all(&[&BARS]).unwrap_err().to_string();
    let words = "format \"ortelius-cell\" version 2; this program reads format \"ortelius-cell\" version 1";
    assert!(line.contains(words), "{line}");
}

#[test]
fn verdicts_are_cases_of_junit() {
    let folder = folder();
    let text = reported(&[&SWEPT, &FAILS], folder.path()).junit();
    for part in [
        "<testsuite name=\"made.swept\" tests=\"4\" failures=\"2\" skipped=\"1\">",
        "<testcase classname=\"made.swept\" name=\"doubles\"><system-out>reproduced: size, double over single",
        "<failure message=\"not reproduced: 0 of 6 below 0\"/>",
        "<skipped message=\"not measured: missing cells: 2 failed\"/>",
    ] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
}
