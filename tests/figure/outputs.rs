//! What a report says.

use super::family::{BARS, SWEPT};
use super::*;
use ortelius::figure::{Outcome, Verdict};

#[test]
fn results_come_back_from_their_file_to_the_last_bit() {
    let folder = folder();
    let results = reported(&[&SWEPT, &BARS], folder.path());
    let again: Results = serde_json::from_str(&read(folder.path(), "results.json")).unwrap();
    // NaN equals nothing: compared as text.
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
    assert_eq!(claims[0]["numbers"], "ratio 2 in 6 cells");
    assert_eq!(claims[0]["from"], "paper, section 1");
    assert_eq!(summary["made.bars"][0]["why"], "the bound is 1");
}

#[test]
fn rows_are_lines_of_the_csv() {
    let folder = folder();
    reported(&[&SWEPT, &BARS], folder.path());
    let text = read(folder.path(), "made.bars.csv");
    for line in [
        "figure,scene,x,variant,quantity,unit,value,p5,p95,min,max,count,at,text,device",
        "made.bars,plane,,absent,time,ms,,,,,,,,not here: no geometry shader,made-up device",
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
fn the_manifest_holds_the_sum_of_every_file() {
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
fn a_claim_on_a_part_of_the_cells_is_not_reproduced_yet() {
    let folder = folder();
    let mut part = a_run(&[&SWEPT], folder.path());
    part.partition = Partition { index: 2, of: 2 };
    run(&part).unwrap();
    let results = report(&[&SWEPT, &BARS], folder.path());
    let claims = &results.figures[0].claims;
    assert_eq!(claims[0].finding.verdict, Verdict::NotMeasurable);
    assert!(claims[0].finding.why.contains("3 of 6 cells were not measured"));
    // What is wrong already stays wrong.
    assert_eq!(claims[2].finding.verdict, Verdict::NotReproduced);
    assert_eq!(results.figures[1].claims[0].finding.why, "no cell was measured");
    let absent = results.figures[0].cells.iter().filter(|cell| cell.outcome == Outcome::Absent).count();
    assert_eq!(absent, 3);
}
