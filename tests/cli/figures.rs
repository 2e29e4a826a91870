//! The commands `list`, `reproduce`, `merge` and `page`. The tests in tests/figure check their measurements, with
//! made-up figures.

use super::interrupt::{interrupt, last_line};
use super::*;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

#[test]
fn the_list_has_every_figure_with_its_claims() {
    let folder = folder();
    let ran = run(&folder, &["list", "--json"]);
    let list: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
    assert_eq!((&list["format"], &list["version"]), (&"ortelius-figures".into(), &2.into()));
    let figures = list["figures"].as_array().unwrap();
    let known: Vec<&str> = ortelius::renderer::figures::FAMILIES
        .iter()
        .flat_map(|(_, figures)| figures.iter().map(|f| f.id))
        .collect();
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
fn the_list_accepts_figures_and_families_as_reproduce_does() {
    let folder = folder();
    let listed = |arguments: &[&str]| -> Vec<String> {
        let ran = run(&folder, &[&["list", "--json"], arguments].concat());
        let list: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
        let figures = list["figures"].as_array().unwrap();
        figures.iter().map(|figure| figure["id"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(listed(&["pm.order"]), ["pm.order"]);
    assert_eq!(listed(&["pm.order", "vt.dedup"]), ["vt.dedup", "pm.order"]);
    let pm = listed(&["pm"]);
    assert!(pm.len() > 5 && pm.iter().all(|id| id.starts_with("pm.")), "{pm:?}");
    let words = String::from_utf8(run(&folder, &["list", "pm.order"]).stdout).unwrap();
    assert!(words.starts_with("pm: 1 figure\n") && !words.contains("vt"), "{words}");
    // A named figure is listed in full; without names, figures are listed in full only with --verbose.
    let claim = ortelius::renderer::figures::FAMILIES[0].1[0].claims[0].text;
    let whole = |arguments: &[&str]| {
        let words = String::from_utf8(run(&folder, &[&["list"], arguments].concat()).stdout).unwrap();
        words.contains(claim) && words.contains("A quick run leaves out ")
    };
    let id = ortelius::renderer::figures::FAMILIES[0].1[0].id;
    assert_eq!([whole(&[id]), whole(&["-v"]), whole(&[]), whole(&["pm.order"])], [true, true, false, false]);
    let words = |id| String::from_utf8(run(&folder, &["list", id]).stdout).unwrap();
    assert!(words("vt.address").contains("`ortelius view vt.address` shows globe/africa; earth/oblique."));
    assert!(words("pm.build").contains("figure pm.build has no picture: it times the building"));
    let (code, line) = failure(&mut ortelius(&folder, &["list", "pm.ordre"]));
    assert_eq!(code, 2, "{line}");
    holds(&line, &["\"pm.ordre\"", "nearest is pm.order"]);
}

#[test]
fn unknown_figures_and_parts_are_usage_errors_and_nothing_is_written() {
    let folder = folder();
    for (arguments, words) in [
        (
            &["reproduce", "vt.feedbak"][..],
            &["\"vt.feedbak\"", "nearest is vt.feedback", "ortelius list"][..],
        ),
        (&["reproduce", "vtx"], &["\"vtx\"", "nearest is vt"]),
        (&["reproduce", "vt", "--device", "no such device"], &["\"no such device\"", "available: "]),
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
fn unreadable_results_are_reported_before_any_measurement() {
    let folder = folder();
    write(&folder, "old.json", "{\"format\": \"ortelius results 0\"}");
    for (arguments, words) in [
        (&["reproduce", "vt", "--against", "none.json"][..], &["--against none.json", "No such file"][..]),
        (&["reproduce", "vt", "--against", "old.json"], &["--against old.json", "\"ortelius results 0\""]),
        (&["merge", "nowhere", "-o", "merged"], &["nowhere holds no result", "reproduce"]),
        (&["reproduce", "vt", "-o", "old.json/out"], &["-o old.json/out: old.json is not a folder"]),
        (&["reproduce", "vt", "-o", "/proc/out"], &["-o /proc/out: cannot write in /proc", "another path"]),
        (&["merge", "nowhere", "-o", "/proc/out"], &["-o /proc/out: cannot write in /proc"]),
    ] {
        let (code, line) = failure(&mut ortelius(&folder, arguments));
        assert_eq!(code, 1, "{line}");
        holds(&line, words);
    }
    assert_eq!(names(&folder), ["old.json"]);
}

/// Timeout of every wait. No machine needs this long.
const PATIENCE: Duration = Duration::from_secs(600);

/// The measuring child of a run, once it exists.
fn worker(run: &Child, folder: &Path) -> String {
    let started = Instant::now();
    let children = format!("/proc/{0}/task/{0}/children", run.id());
    while !folder.join("out/cells/under-way.json").exists() {
        assert!(started.elapsed() < PATIENCE, "no cell is measured");
        std::thread::sleep(Duration::from_millis(1));
    }
    let found = std::fs::read_to_string(children).unwrap();
    assert_eq!(found.split_whitespace().count(), 1, "{found:?}");
    found.trim().to_string()
}

/// Uses the shell's own `kill`: a minimal system has no other.
pub fn signal(name: &str, process: &str) {
    let kill = format!("kill {name} {process}");
    assert!(std::process::Command::new("sh").args(["-c", &kill]).status().unwrap().success());
}

/// SIGABRT simulates a driver crash (Rust's runtime ignores the first external segmentation fault). Measures
/// two of the six cells of vt.address: both scenes at 360 rows.
#[test]
fn a_driver_that_crashes_costs_one_cell_and_a_run_that_is_killed_leaves_no_worker() {
    let folder = folder();
    let reproduce = ["reproduce", "vt.address", "--partition", "1/3", "-o", "out"];
    let start = |arguments: &[&str]| {
        ortelius(&folder, arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
    };
    assert_worker_ends_with_its_parent(&folder, start(&reproduce));

    // Absent if the process was killed between two cells.
    std::fs::remove_file(folder.path().join("out/cells/under-way.json")).ok();
    let stopped = start(&[&reproduce[..], &["--force"]].concat());
    let child = worker(&stopped, folder.path());
    interrupt(&format!("{} {child}", stopped.id()));
    holds(&last_line(stopped), &["ortelius: stopped; ", "--resume to keep the measured cells"]);

    // Absent if the process was killed between two cells.
    std::fs::remove_file(folder.path().join("out/cells/under-way.json")).ok();
    let crashed = start(&[&reproduce[..], &["--force"]].concat());
    signal("-ABRT", &worker(&crashed, folder.path()));
    let ended = crashed.wait_with_output().unwrap();
    let words = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(1), "{words}");
    holds(
        &words,
        &["vt.address globe/africa at 360: the driver crashed (signal: 6", "1 of 2 cells failed, first "],
    );
    let summary: serde_json::Value = serde_json::from_str(&read(&folder, "out/summary.json")).unwrap();
    assert_eq!((&summary["format"], &summary["version"]), (&"ortelius-summary".into(), &1.into()));
    assert_eq!(summary["vt.address"][0]["verdict"], "not-measured");
    holds(&summary["vt.address"][0]["why"].to_string(), &["1 crashed the driver"]);

    let resumed = run(&folder, &[&reproduce[..], &["--resume"]].concat());
    let words = String::from_utf8(resumed.stderr).unwrap();
    assert_eq!(resumed.status.code(), Some(0), "{words}");
    holds(
        &words,
        &[
            "the driver crashed (signal: 6",
            "in an earlier run",
            "0 cells measured, 2 kept",
            "resuming: out holds 2",
        ],
    );
    let manifest: serde_json::Value = serde_json::from_str(&read(&folder, "out/manifest.json")).unwrap();
    assert_eq!(manifest["programs"].as_array().unwrap().len(), 1);
    assert_eq!(manifest["command"].as_array().unwrap().last().unwrap(), "--resume");

    let (code, line) = failure(&mut ortelius(&folder, &reproduce));
    assert_eq!(code, 2, "{line}");
    holds(&line, &["out holds 2 cells of these figures", "--resume", "--force"]);
    assert_merge_counts_the_claims_that_are_not_measured(&folder);
}

fn assert_worker_ends_with_its_parent(folder: &TempDir, mut parent: Child) {
    let worker = worker(&parent, folder.path());
    parent.kill().unwrap();
    parent.wait().unwrap();
    let started = Instant::now();
    // The process is a zombie if nobody reaps it.
    let lives =
        || std::fs::read_to_string(format!("/proc/{worker}/status")).is_ok_and(|s| !s.contains("(zombie)"));
    while lives() {
        assert!(started.elapsed() < PATIENCE, "the worker {worker} outlives its parent");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// `out` holds two of the six cells of vt.address, and one of the two crashed. So every claim lacks a number.
fn assert_merge_counts_the_claims_that_are_not_measured(folder: &TempDir) {
    let merge = ["merge", "out", "-o", "out", "--junit", "verdicts.xml", "--fail-on"];
    let merged = run(folder, &[&merge[..], &["not-reproduced"]].concat());
    assert_eq!(merged.status.code(), Some(0));
    holds(&String::from_utf8(merged.stdout).unwrap(), &["3 claims: 3 not measured"]);
    holds(&read(folder, "verdicts.xml"), &["tests=\"3\" failures=\"0\" skipped=\"3\"", "name=\"globe-500\""]);
    let merged = run(folder, &[&merge[..], &["not-reproduced,not-measured"]].concat());
    assert_eq!(merged.status.code(), Some(1));
    let words = String::from_utf8(merged.stderr).unwrap();
    holds(&words, &["--fail-on: 3 claims not measured, first vt.address own-level-exact"]);
    let (code, line) = failure(&mut ortelius(folder, &[&merge[..], &["changed"]].concat()));
    assert_eq!(code, 2, "{line}");
    holds(&line, &["--fail-on changed needs", "--against"]);
}

#[test]
fn stored_results_become_a_page_next_to_them_or_at_the_given_path() {
    let folder = folder();
    let stored = Path::new(env!("CARGO_MANIFEST_DIR")).join("results/h100.json");
    std::fs::copy(stored, folder.path().join("h100.json")).unwrap();
    assert!(run(&folder, &["page", "h100.json"]).status.success());
    assert!(run(&folder, &["page", "h100.json", "-o", "other.html"]).status.success());
    assert_eq!(read(&folder, "h100.html"), read(&folder, "other.html"));
    holds(&read(&folder, "h100.html"), &["NVIDIA H100", "vt.dedup", "Glossary"]);
    write(&folder, "scene.json", "{}");
    for (file, words) in
        [("nowhere.json", ["nowhere.json", "No such file"]), ("scene.json", ["scene.json", "results"])]
    {
        let (code, line) = failure(&mut ortelius(&folder, &["page", file]));
        assert_eq!(code, 1);
        holds(&line, &words);
    }
    assert!(!folder.path().join("scene.html").exists());
    // Formats 1 and 2 have no rounds.
    let earlier = read(&folder, "h100.json").replacen("\"version\": 5", "\"version\": 2", 1);
    write(&folder, "earlier.json", &earlier);
    let (code, line) = failure(&mut ortelius(&folder, &["page", "earlier.json", "--json", "again.json"]));
    assert_eq!(code, 1);
    holds(&line, &["earlier.json", "the times of single rounds"]);
    assert!(!folder.path().join("again.json").exists());
}

#[test]
fn stored_results_are_judged_again() {
    let folder = folder();
    let stored = Path::new(env!("CARGO_MANIFEST_DIR")).join("results/lavapipe-2-cores-tm.json");
    let text = std::fs::read_to_string(stored).unwrap();
    let (as_ever, other) = ("\"verdict\": \"reproduced\"", "\"verdict\": \"not-reproduced\"");
    write(&folder, "changed.json", &text.replacen(as_ever, other, 1));
    let ran = run(&folder, &["page", "changed.json", "--json", "again.json"]);
    assert!(ran.status.success());
    holds(&String::from_utf8(ran.stderr).unwrap(), &["not reproduced -> reproduced"]);
    assert_eq!(read(&folder, "again.json"), text);
}
