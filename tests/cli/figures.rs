//! `list`, `reproduce` and `merge` from outside; what they measure is tested with made-up figures in tests/figure.

use super::*;

#[test]
fn the_list_has_every_figure_with_its_claims() {
    let folder = folder();
    let ran = run(&folder, &["list", "--json"]);
    let list: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
    let figures = list.as_array().unwrap();
    let known: Vec<&str> =
        ortelius::paper::FAMILIES.iter().flat_map(|(_, figures)| figures.iter().map(|f| f.id)).collect();
    let ids: Vec<&str> = figures.iter().map(|figure| figure["id"].as_str().unwrap()).collect();
    assert_eq!(ids, known);
    for figure in figures {
        assert!(!figure["claims"].as_array().unwrap().is_empty(), "{figure}");
        assert!(figure["claims"][0]["from"].as_str().is_some() && figure["scenes"][0].as_str().is_some());
    }
    let words = String::from_utf8(run(&folder, &["list"]).stdout).unwrap();
    assert!(ids.iter().all(|id| words.contains(id)), "{words}");
}

#[test]
fn the_list_takes_figures_and_families_as_reproduce_does() {
    let folder = folder();
    let listed = |arguments: &[&str]| -> Vec<String> {
        let ran = run(&folder, &[&["list", "--json"], arguments].concat());
        let list: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
        list.as_array().unwrap().iter().map(|figure| figure["id"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(listed(&["pm.order"]), ["pm.order"]);
    assert_eq!(listed(&["pm.order", "vt.dedup"]), ["vt.dedup", "pm.order"]);
    let pm = listed(&["pm"]);
    assert!(pm.len() > 5 && pm.iter().all(|id| id.starts_with("pm.")), "{pm:?}");
    let words = String::from_utf8(run(&folder, &["list", "pm.order"]).stdout).unwrap();
    assert!(words.starts_with("pm: 1 figures") && !words.contains("vt"), "{words}");
    let (code, line) = failure(&mut ortelius(&folder, &["list", "pm.ordre"]));
    assert_eq!(code, 2, "{line}");
    holds(&line, &["\"pm.ordre\"", "nearest is pm.order"]);
}

#[test]
fn figures_and_parts_that_there_are_not_are_usage_and_nothing_is_written() {
    let folder = folder();
    for (arguments, words) in [
        (
            &["reproduce", "vt.feedbak"][..],
            &["\"vt.feedbak\"", "nearest is vt.feedback", "ortelius list"][..],
        ),
        (&["reproduce", "tv"], &["\"tv\"", "nearest is vt"]),
        (&["reproduce", "vt", "--device", "no such device"], &["\"no such device\"", "there are: "]),
    ] {
        let (code, line) = failure(&mut ortelius(&folder, arguments));
        assert_eq!(code, 2, "{line}");
        holds(&line, words);
    }
    for arguments in [
        &["reproduce", "vt", "--partition", "0/2"][..],
        &["reproduce", "vt", "--partition", "3/2"],
        &["reproduce", "vt", "--partition", "2"],
        &["reproduce", "vt", "--quick", "--full"],
        &["merge", "a"],
        &["merge", "-o", "a"],
    ] {
        let ran = run(&folder, arguments);
        assert_eq!((ran.status.code(), ran.stdout.len()), (Some(2), 0), "{arguments:?}");
    }
    assert_eq!(names(&folder), [""; 0]);
}

#[test]
fn what_is_no_result_is_named_before_anything_is_measured() {
    let folder = folder();
    write(&folder, "old.json", "{\"format\": \"ortelius results 0\"}");
    for (arguments, words) in [
        (&["reproduce", "vt", "--against", "none.json"][..], &["--against none.json", "No such file"][..]),
        (&["reproduce", "vt", "--against", "old.json"], &["--against old.json", "\"ortelius results 0\""]),
        (&["merge", "nowhere", "-o", "merged"], &["nowhere holds no result", "reproduce"]),
        (&["reproduce", "vt", "-o", "old.json/out"], &["old.json/out", "Not a directory"]),
    ] {
        let (code, line) = failure(&mut ortelius(&folder, arguments));
        assert_eq!(code, 1, "{line}");
        holds(&line, words);
    }
    assert_eq!(names(&folder), ["old.json"]);
}
