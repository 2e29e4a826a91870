//! Killed, resumed, shared, merged.

use super::family::{BARS, FAILS, SLOW, SWEPT};
use super::*;
use ortelius::figure::{Outcome, Verdict};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Names the folder of the child process.
const FOLDER: &str = "ORTELIUS_TEST_FOLDER";

/// By itself a run in a folder of its own; started by the test below, the run that is killed.
#[test]
fn a_run_measures_every_cell_once() {
    let own = folder();
    let given = std::env::var_os(FOLDER);
    let folder = given.as_deref().map_or(own.path(), Path::new);
    let mut resumed = a_run(&[&SLOW], folder);
    resumed.resume = true;
    let tally = run(&resumed).unwrap();
    assert_eq!(tally.measured + tally.kept, 24);
    assert_eq!(run(&resumed).unwrap().kept, 24, "a run that is resumed when it is done measures nothing");
}

#[test]
fn a_run_that_is_killed_resumes_without_loss() {
    let (undisturbed, killed) = (folder(), folder());
    run(&a_run(&[&SLOW], undisturbed.path())).unwrap();
    let mut kills = 0;
    // 24 cells of 10 ms and more: killed after 60, 75, 90 … ms.
    for patience in (60..).step_by(15).map(Duration::from_millis) {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "runs::a_run_measures_every_cell_once"])
            .env(FOLDER, killed.path())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let start = Instant::now();
        let mut ended = None;
        while ended.is_none() && start.elapsed() < patience {
            std::thread::sleep(Duration::from_millis(1));
            ended = child.try_wait().unwrap();
        }
        if let Some(status) = ended {
            assert!(status.success());
            break;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        kills += 1;
        // What is there can be read: nothing is half-written.
        Store::at(killed.path()).all(&[&SLOW]).unwrap();
    }
    assert!(kills > 0, "the child was never killed: lower the patience");
    assert_eq!(rows(killed.path()), rows(undisturbed.path()));
    let (left, right) = (report(&[&SLOW], killed.path()), report(&[&SLOW], undisturbed.path()));
    assert_eq!(left, right);
    for name in ["results.json", "made.slow.csv", "made.slow.json", "summary.json"] {
        assert_eq!(read(killed.path(), name), read(undisturbed.path(), name), "{name}");
    }
}

fn rows(folder: &Path) -> Vec<(Cell, Outcome)> {
    Store::at(folder).all(&[&SLOW]).unwrap().into_iter().map(|result| (result.cell, result.outcome)).collect()
}

#[test]
fn without_resume_everything_is_measured_anew() {
    let folder = folder();
    let all = a_run(&[&BARS, &SWEPT], folder.path());
    assert_eq!((run(&all).unwrap().measured, run(&all).unwrap().measured), (7, 7));
}

#[test]
fn results_of_another_effort_commit_or_device_are_not_mixed() {
    let folder = folder();
    let first = a_run(&[&SWEPT], folder.path());
    run(&first).unwrap();
    let other = |change: fn(&mut Run)| {
        let mut other = a_run(&[&SWEPT, &BARS], folder.path());
        other.resume = true;
        change(&mut other);
        run(&other).map(|_| ()).unwrap_err().to_string()
    };
    for (line, what) in [
        (other(|run| run.effort = Effort::Full), "another effort (quick; this run: full)"),
        (
            other(|run| run.machine.commit = "fedcba".into()),
            "another commit (0123456789abcdef; this run: fedcba)",
        ),
        (other(|run| run.machine.driver = "2.0".into()), "another device (made-up device, made-up 1.0"),
        (other(|run| run.machine.cores = 64), "64 cores"),
    ] {
        assert!(line.contains(what) && line.contains("-o"), "{line}");
    }
    // Another day is no other machine.
    let mut tomorrow = a_run(&[&SWEPT], folder.path());
    (tomorrow.resume, tomorrow.machine.date) = (true, "2026-11-22".into());
    assert_eq!(run(&tomorrow).unwrap().kept, 6);
}

#[test]
fn parts_are_disjoint_and_together_the_whole() {
    let folder = folder();
    let figures = [&SWEPT, &BARS, &SLOW];
    let whole = a_run(&figures, folder.path()).cells();
    for of in 1..=9 {
        let mut found = Vec::new();
        for index in 1..=of {
            let mut part = a_run(&figures, folder.path());
            part.partition = Partition { index, of };
            found.extend(part.cells().into_iter().map(|(figure, cell)| (figure.id, cell)));
        }
        assert_eq!(found.len(), whole.len());
        assert!(whole.iter().all(|(figure, cell)| found.contains(&(figure.id, cell.clone()))));
    }
}

#[test]
fn a_cell_that_fails_stops_nothing_and_makes_no_claim_true() {
    let folder = folder();
    let tally = run(&a_run(&[&FAILS, &BARS], folder.path())).unwrap();
    let told: Vec<_> = tally.failures.iter().map(|f| (&*f.cell.scene, &*f.error)).collect();
    let expected = [("earth", "the disk is on fire"), ("globe", "a bug of this program: left 1 right 2")];
    assert_eq!((tally.measured, &told[..]), (4, &expected[..]));
    let results = report(&[&FAILS, &BARS], folder.path());
    let finding = &results.figures[0].claims[0].finding;
    assert_eq!(finding.verdict, Verdict::NotMeasurable);
    assert_eq!(finding.why, "the bound is 1 (2 of 3 cells failed)");
    assert_eq!(results.figures[1].claims[0].finding.verdict, Verdict::Reproduced);
    // What failed is tried again.
    let mut again = a_run(&[&FAILS, &BARS], folder.path());
    again.resume = true;
    let tally = run(&again).unwrap();
    assert_eq!((tally.measured, tally.kept, tally.failures.len()), (2, 2, 2));
}

#[test]
fn a_damaged_result_is_named() {
    let folder = folder();
    run(&a_run(&[&BARS], folder.path())).unwrap();
    let file = folder.path().join("cells/made.bars/plane.json");
    std::fs::write(&file, &std::fs::read(&file).unwrap()[..100]).unwrap();
    let line = run(&a_run(&[&BARS], folder.path())).unwrap_err().to_string();
    assert!(line.contains("cells/made.bars/plane.json") && line.contains("remove the file"), "{line}");
}
