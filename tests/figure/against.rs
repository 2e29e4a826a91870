//! Comparison of two results.

use super::family::{BARS, SWEPT};
use super::*;
use ortelius::figure::{CellOutcome, Changes, Row, Value, Verdict};
use ortelius::stats::Summary;

/// Results of both figures, with the first cell of the bars changed.
fn changed(change: impl Fn(&mut Row)) -> [Results; 2] {
    let folder = folder();
    let before = reported(&[&SWEPT, &BARS], folder.path());
    let mut after = before.clone();
    let CellOutcome::Rows(rows) = &mut after.figures[1].cells[0].outcome else {
        panic!("the bars were measured")
    };
    rows.iter_mut().for_each(change);
    [before, after]
}

fn slow_times(row: &mut Row, factor: f64) {
    match &mut row.value {
        Value::Summary(s) if row.variant == "slow" => {
            (s.p5, s.median, s.p95) = (s.p5 * factor, s.median * factor, s.p95 * factor);
        }
        _ => {}
    }
}

#[test]
fn a_result_equals_itself_including_nan() {
    let [before, after] = changed(|_| {});
    let changes = Changes::between(&before, &after);
    assert_eq!((changes.claims.len(), changes.values.len(), changes.gone, changes.new), (0, 0, 0, 0));
    // The swept figure has 6 cells of 5 rows, the bars have 7 rows.
    assert_eq!(changes.common, 37);
}

#[test]
fn a_time_changed_only_if_the_spreads_are_disjoint() {
    // The time of `slow` has a p5 of 3.1 and a p95 of 5.35.
    let [before, after] = changed(|row| slow_times(row, 1.5));
    assert!(Changes::between(&before, &after).values.is_empty());
    for factor in [2.0, 0.5] {
        let [before, after] = changed(|row| slow_times(row, factor));
        let values = Changes::between(&before, &after).values;
        assert_eq!(values.len(), 1, "{values:?}");
        assert_eq!((&*values[0].what, values[0].ratio), ("plane, slow, time", Some(factor)));
    }
}

#[test]
fn a_curve_changed_if_the_spreads_of_one_point_are_disjoint() {
    let curve = |second: f64, at: f64| {
        let spread = |median: f64| Summary {
            count: 3,
            min: 0.8,
            p5: 0.9 * median,
            median,
            p95: 1.1 * median,
            max: 9.0,
        };
        let points = vec![(1.0, spread(1.0)), (at, spread(second))];
        let value = Value::Spreads(points);
        changed(move |row| row.value = value.clone())[1].clone()
    };
    let elsewhere = || {
        let spread = Summary::of(&[1.0]).unwrap();
        changed(move |row| row.value = Value::Spreads(vec![(7.0, spread)]))[1].clone()
    };
    let values = |after: Results| Changes::between(&curve(2.0, 2.0), &after).values.len();
    assert_eq!([values(curve(2.2, 2.0)), values(curve(3.0, 2.0))], [0, 7]);
    // Extra points at the end of a longer curve are not compared; a curve at other x is another curve.
    assert_eq!([values(curve(9.0, 2.5)), values(elsewhere())], [0, 7]);
    let text = serde_json::to_string(&curve(2.0, 2.0)).unwrap();
    assert_eq!(Results::parse(&text).unwrap().figures[1].cells[0], curve(2.0, 2.0).figures[1].cells[0]);
}

#[test]
fn exact_numbers_words_series_and_units_changed_if_unequal() {
    for (name, change) in [
        ("words", (|row| row.value = Value::Text("else".into())) as fn(&mut Row)),
        ("absent", |row| row.value = Value::Missing("why".into())),
        ("unit", |row| row.unit = "s".into()),
        ("a point", |row| match &mut row.value {
            Value::Series(points) => points[1][1] *= 1.0 + f64::EPSILON,
            other => *other = Value::Number(1.0),
        }),
    ] {
        let [before, after] = changed(change);
        assert_eq!(Changes::between(&before, &after).values.len(), 7, "{name}");
    }
    let [before, mut after] = changed(|_| {});
    let CellOutcome::Rows(rows) = &mut after.figures[0].cells[0].outcome else { panic!("measured") };
    rows[0].value = Value::Number(1.0 / 3.0 + 1e-16);
    assert_eq!(Changes::between(&before, &after).values.len(), 1);
}

#[test]
fn changed_verdicts_and_new_or_gone_values_are_on_stdout_and_in_the_page() {
    let [before, mut after] = changed(|row| slow_times(row, 3.0));
    after.figures[0].claims[0].finding.verdict = Verdict::NotReproduced;
    after.figures[0].cells[5].outcome = CellOutcome::Absent;
    let changes = Changes::between(&before, &after);
    assert_eq!((changes.gone, changes.new), (5, 0));
    let text = changes.lines(20).join("\n");
    for part in [
        "against made-up device, made-up processor, 2026-11-21, commit 0123456789ab (quick):",
        "verdict  made.swept doubles: reproduced -> not reproduced (size, double over single: earth/oblique at 1: 2x,",
        "value    made.bars plane, slow, time: 4 ms -> 12 ms (3x)",
        "1 of 32 common values changed beyond their spreads, 1 verdicts changed; \
         only in the stored results: 5, only in the new ones: 0",
    ] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
    assert!(changes.lines(0).join("\n").contains("1 more values changed: see the page"));
    let folder = folder();
    let store = Store::create(folder.path()).unwrap();
    after.figures.iter_mut().flat_map(|f| &mut f.cells).for_each(|cell| cell.pictures.clear());
    write_outputs(&store, &[&SWEPT, &BARS], &after, &[], &[], Some(&changes)).unwrap();
    let page = read(folder.path(), "index.html");
    for part in
        ["What changed", "reproduced → <b>not reproduced</b>", "<td>4 ms</td><td>12 ms</td><td>3x</td>"]
    {
        assert!(page.contains(part), "no {part:?}");
    }
}

#[test]
fn results_of_version_4_have_todays_names_and_equal_those_of_version_5() {
    let [mut today, mut old] = changed(|_| {});
    let name = |results: &mut Results, quantity: &str, variant: &str| {
        results.figures[0].id = "pm.shading".into();
        let CellOutcome::Rows(rows) = &mut results.figures[0].cells[0].outcome else { panic!("measured") };
        (rows[0].quantity, rows[0].variant) = (quantity.into(), variant.into());
    };
    name(&mut today, "faces", "the paper, as many faces as normal-aware");
    name(&mut old, "faces", "the paper, the faces of normal-aware");
    let (today, old) = (today.text(), old.text());
    let as_version = |text: &str, version: &str| {
        Results::parse(&text.replacen("\"version\": 5", &format!("\"version\": {version}"), 1)).unwrap()
    };
    let [today, old, unread] = [as_version(&today, "5"), as_version(&old, "4"), as_version(&old, "5")];
    let differences = |before: &Results| {
        let Changes { values, gone, new, .. } = Changes::between(before, &today);
        (values.len(), gone, new)
    };
    assert_eq!((old.format_version, differences(&old)), (4, (0, 0, 0)));
    // A file of version 5 is read as it is.
    assert_eq!(differences(&unread), (0, 1, 1));
}

#[test]
fn foreign_files_are_rejected() {
    for (text, words) in [
        ("{}", "not results of `ortelius reproduce`"),
        ("[1", "not results of `ortelius reproduce`"),
        (
            "{\"format\": \"ortelius-results\", \"version\": 6}",
            "the file has format \"ortelius-results\" version 6; this program reads format \"ortelius-results\" versions 1 to 5",
        ),
        (
            "{\"format\": \"ortelius results 7\"}",
            "the file has format \"ortelius results 7\"; this program reads",
        ),
    ] {
        let line = Results::parse(text).unwrap_err().to_string();
        assert!(line.contains(words), "{line}");
    }
}
