//! Runs that are killed, resumed, shared and merged.

use super::family::{BARS, DIES, FAILS, LARGE, LEAVES, MEASURES, SLOW, SWEPT};
use super::*;
use ortelius::figure::{CellOutcome, Verdict, merge, outlive};
use std::cell::RefCell;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Environment variable with the folder of the child process.
const FOLDER: &str = "ORTELIUS_TEST_FOLDER";

/// `a_run_that_is_killed_resumes_without_loss` starts this test as the run that is killed. If it is run directly, it
/// measures into a folder of its own.
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

/// Starts `a_run_measures_every_cell_once` in a process of its own, which measures at most `max` cells.
fn measuring(folder: &Path, max: usize) -> Child {
    Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "runs::a_run_measures_every_cell_once"])
        .env(FOLDER, folder)
        .env(MEASURES, max.to_string())
        .stdout(Stdio::null())
        .spawn()
        .unwrap()
}

#[test]
fn a_run_that_is_killed_resumes_without_loss() {
    let (undisturbed, killed) = (folder(), folder());
    run(&a_run(&[&SLOW], undisturbed.path())).unwrap();
    // All files are readable at any time: nothing is half-written.
    let stored = || Store::at(killed.path()).all(&[&SLOW]).unwrap().len();
    // Six processes measure at most three of the 24 cells each. Each process is killed during these cells or after
    // them.
    for kill in 0..6 {
        let before = stored();
        let mut child = measuring(killed.path(), 3);
        while stored() == before {
            assert_eq!(child.try_wait().unwrap(), None, "it waits to be killed");
            std::thread::sleep(Duration::from_micros(200));
        }
        std::thread::sleep(Duration::from_micros(300 * kill));
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(stored() > before && stored() <= before + 3);
    }
    assert!(measuring(killed.path(), 24).wait().unwrap().success());
    assert_eq!(rows(killed.path()), rows(undisturbed.path()));
    let (left, right) = (report(&[&SLOW], killed.path()), report(&[&SLOW], undisturbed.path()));
    assert_eq!(left, right);
    for name in ["results.json", "made.slow.csv", "made.slow.json", "summary.json"] {
        assert_eq!(read(killed.path(), name), read(undisturbed.path(), name), "{name}");
    }
}

/// Environment variable with the first cell of the child process below, and `+` for a resumed run.
const FROM: &str = "ORTELIUS_TEST_FROM";

/// If it is run directly, this test does nothing. `outlived` starts it as the worker that crashes.
#[test]
fn a_worker_measures_from_its_cell_on() {
    let (Some(folder), Some(from)) = (std::env::var_os(FOLDER), std::env::var_os(FROM)) else { return };
    let from = from.into_string().unwrap();
    let mut worker = a_run(&[&DIES, &BARS], Path::new(&folder));
    (worker.from, worker.resume) = (from.trim_end_matches('+').parse().unwrap(), from.ends_with('+'));
    let tally = run(&worker).unwrap();
    assert_eq!(tally.measured + tally.kept, 4);
}

/// The crashed cells in the order reported, and the number of workers.
fn outlived(folder: &Path, resume: &str) -> (Vec<String>, usize) {
    let (reported, workers) = (RefCell::new(Vec::new()), std::cell::Cell::new(0));
    let worker = |from: usize| {
        workers.set(workers.get() + 1);
        let mut child = Command::new(std::env::current_exe().unwrap());
        child.args(["--exact", "runs::a_worker_measures_from_its_cell_on"]).stdout(Stdio::null());
        child.stderr(Stdio::null()).env(FOLDER, folder).env(FROM, format!("{from}{resume}")).status()
    };
    let report = |result: &CellResult| {
        let CellOutcome::Crashed(how) = &result.outcome else { panic!("{result:?}") };
        reported.borrow_mut().push(format!("{} {}: {how}", result.figure, result.cell));
    };
    let status = outlive(folder, worker, report).unwrap();
    assert!(status.success(), "{status}");
    (reported.into_inner(), workers.get())
}

#[test]
fn a_crash_of_the_driver_costs_one_cell_which_is_not_tried_again() {
    let folder = folder();
    let (reported, workers) = outlived(folder.path(), "");
    assert_eq!((reported.len(), workers), (1, 2), "{reported:?}");
    assert!(reported[0].starts_with("made.dies globe: the driver crashed (signal: 6"), "{reported:?}");
    let results = report(&[&DIES, &BARS], folder.path());
    let finding = &results.figures[0].claims[0].finding;
    assert_eq!(finding.verdict, Verdict::NotMeasured);
    assert_eq!(finding.why, "missing cells: 1 crashed the driver");
    assert_eq!(results.figures[1].claims[0].finding.verdict, Verdict::Reproduced);
    assert!(read(folder.path(), "made.dies.csv").contains("failed: the driver crashed (signal: 6"));
    assert!(read(folder.path(), "index.html").contains("the driver crashed (signal: 6"));
    // A resumed run has nothing left to do; a new run crashes again.
    assert_eq!(outlived(folder.path(), "+"), (Vec::new(), 1));
    assert_eq!(outlived(folder.path(), "").1, 2);
}

#[test]
fn a_worker_that_is_asked_to_end_is_not_started_again() {
    let folder = folder();
    let mut workers = 0;
    let worker = |_| {
        workers += 1;
        Command::new("sh").args(["-c", "kill -TERM $$"]).status()
    };
    let status = outlive(folder.path(), worker, |result| panic!("{result:?}")).unwrap();
    assert_eq!((status.code(), workers), (None, 1));
    let status = outlive(
        folder.path(),
        |_| Command::new("sh").args(["-c", "exit 1"]).status(),
        |result| panic!("{result:?}"),
    );
    assert_eq!(status.unwrap().code(), Some(1), "it has no cell under way");
}

fn rows(folder: &Path) -> Vec<(Cell, CellOutcome)> {
    Store::at(folder).all(&[&SLOW]).unwrap().into_iter().map(|result| (result.cell, result.outcome)).collect()
}

#[test]
fn without_resume_everything_is_measured_again() {
    let folder = folder();
    let all = a_run(&[&BARS, &SWEPT], folder.path());
    assert_eq!((run(&all).unwrap().measured, run(&all).unwrap().measured), (7, 7));
}

#[test]
fn results_of_another_effort_commit_or_device_are_not_mixed() {
    let folder = folder();
    let first = a_run(&[&SWEPT], folder.path());
    run(&first).unwrap();
    let other = |change: fn(&mut FigureRun)| {
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
        (
            other(|run| run.program = "build 2".into()),
            "another build of the program (build 1; this run: build 2)",
        ),
        (other(|run| run.machine.driver = "2.0".into()), "another device (made-up device, made-up 1.0"),
        (other(|run| run.machine.cores = 64), "64 cores"),
    ] {
        assert!(line.contains(what) && line.contains("-o"), "{line}");
    }
    // A machine on another date is the same machine.
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
fn a_failing_cell_stops_nothing_and_reproduces_no_claim() {
    let folder = folder();
    let tally = run(&a_run(&[&FAILS, &BARS], folder.path())).unwrap();
    let reported: Vec<_> = tally.failures.iter().map(|f| (&*f.cell.scene, &*f.error)).collect();
    let expected = [("earth", "the disk is on fire"), ("globe", "a bug of this program: left 1 right 2")];
    assert_eq!((tally.measured, &reported[..]), (4, &expected[..]));
    let results = report(&[&FAILS, &BARS], folder.path());
    let finding = &results.figures[0].claims[0].finding;
    assert_eq!(finding.verdict, Verdict::NotMeasured);
    assert_eq!(finding.why, "missing cells: 2 failed");
    assert_eq!(results.figures[1].claims[0].finding.verdict, Verdict::Reproduced);
    // A failed cell is tried again.
    let mut again = a_run(&[&FAILS, &BARS], folder.path());
    again.resume = true;
    let tally = run(&again).unwrap();
    assert_eq!((tally.measured, tally.kept, tally.failures.len()), (2, 2, 2));
}

#[test]
fn a_scene_that_is_left_out_fails_no_cell_and_leaves_its_claim_unmeasured() {
    let folder = folder();
    let tally = run(&a_run(&[&LEAVES], folder.path())).unwrap();
    assert_eq!((tally.measured, tally.failures.len()), (2, 0));
    assert_eq!(tally.left_out, ["made.leaves globe: the globe is not fetched"]);
    let results = report(&[&LEAVES], folder.path());
    let finding = &results.figures[0].claims[0].finding;
    assert_eq!(finding.verdict, Verdict::NotMeasured);
    assert_eq!(finding.why, "missing cells: 1 left out (the globe is not fetched)");
    assert_eq!(Results::parse(&read(folder.path(), "results.json")).unwrap(), results);
    assert!(
        read(folder.path(), "made.leaves.csv")
            .contains("globe,,,,,,,,,,,,left out: the globe is not fetched")
    );
    assert!(read(folder.path(), "index.html").contains("globe was left out: the globe is not fetched"));
    // A resumed run tries the cell that was left out again.
    let mut again = a_run(&[&LEAVES], folder.path());
    again.resume = true;
    let tally = run(&again).unwrap();
    assert_eq!((tally.measured, tally.kept, tally.left_out.len()), (0, 2, 1));
}

#[test]
fn a_quick_run_is_judged_without_the_scenes_of_full_runs_and_names_them() {
    let [whole, globe] = [0, 1];
    let judged = |effort| {
        let folder = folder();
        let tally = run(&FigureRun { effort, ..a_run(&[&LARGE], folder.path()) }).unwrap();
        let cells = Store::at(folder.path()).all(&[&LARGE]).unwrap();
        let results = Results::gather(&[&LARGE], effort, &cells);
        assert_eq!(results.judged_again(&[&LARGE]).unwrap(), results);
        let finding = |at: usize| results.figures[0].claims[at].finding.clone();
        (tally.left_out.len(), [whole, globe].map(|at| (finding(at).verdict, finding(at).why)))
    };
    let (left_out, claims) = judged(Effort::Quick);
    assert_eq!(left_out, 0);
    assert_eq!(claims[whole], (Verdict::Reproduced, "2 of 2 equal to 1 (not in quick runs: globe)".into()));
    let why = "no size was measured (not in quick runs: globe)";
    assert_eq!(claims[globe], (Verdict::NotMeasured, why.into()));
    // In a full run, a scene that is not fetched leaves both claims unmeasured.
    let (left_out, claims) = judged(Effort::Full);
    assert_eq!(left_out, 1);
    for (verdict, why) in claims {
        assert_eq!(verdict, Verdict::NotMeasured);
        assert_eq!(why, "missing cells: 1 left out (the globe is not fetched)");
    }
    assert!(LARGE.quick_leaves_out().ends_with(", and scene globe"), "{}", LARGE.quick_leaves_out());
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

/// Measures each of `of` parts in its own folder. `change` changes the machine of a part.
fn parts(figures: &[&'static Figure], of: usize, change: fn(usize, &mut Machine)) -> Vec<TempDir> {
    let part = |index| {
        let folder = folder();
        let mut part = a_run(figures, folder.path());
        part.partition = Partition { index, of };
        change(index, &mut part.machine);
        run(&part).unwrap();
        folder
    };
    (1..=of).map(part).collect()
}

fn paths(folders: &[TempDir]) -> Vec<&Path> {
    folders.iter().map(TempDir::path).collect()
}

#[test]
fn merged_parts_equal_the_undivided_run_byte_for_byte() {
    let figures: [&'static Figure; 3] = [&SWEPT, &BARS, &SLOW];
    let (whole, merged) = (folder(), folder());
    reported(&figures, whole.path());
    let parts = parts(&figures, 3, |_, _| {});
    // Parts may be given in any order, and repeatedly.
    let mut sources = paths(&parts);
    sources.reverse();
    for _ in 0..2 {
        assert_eq!(merge(&sources, merged.path(), &figures).unwrap(), Effort::Quick);
    }
    report(&figures, merged.path());
    let names =
        std::fs::read_dir(&whole).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    // The manifest contains seconds.
    let names: Vec<String> = names.filter(|name| name.contains('.') && name != "manifest.json").collect();
    assert!(names.len() > 10, "{names:?}");
    for name in names {
        assert_eq!(read(whole.path(), &name), read(merged.path(), &name), "{name}");
    }
    for picture in std::fs::read_dir(whole.path().join("pictures")).unwrap() {
        let picture = picture.unwrap();
        let copy = std::fs::read(merged.path().join("pictures").join(picture.file_name())).unwrap();
        assert_eq!(std::fs::read(picture.path()).unwrap(), copy);
    }
}

#[test]
fn parts_of_several_machines_merge_and_the_claims_say_so() {
    let merged = folder();
    let parts = parts(&[&SWEPT], 2, |index, machine| {
        if index == 2 {
            (machine.device, machine.device_kind) = ("a GPU".into(), "discrete".into());
        }
    });
    merge(&paths(&parts), merged.path(), &[&SWEPT]).unwrap();
    let results = report(&[&SWEPT], merged.path());
    let devices: Vec<&str> = results.machines.iter().map(|machine| &*machine.device).collect();
    assert_eq!(devices, ["made-up device", "a GPU"]);
    let finding = &results.figures[0].claims[0].finding;
    assert_eq!(finding.verdict, Verdict::Reproduced);
    assert!(finding.why.contains("cells of 2 machines"), "{}", finding.why);
    let page = read(merged.path(), "index.html");
    assert!(page.contains("made-up device (cpu)") && page.contains("a GPU (discrete)"));
    let csv = read(merged.path(), "made.swept.csv");
    assert!(csv.contains(",made-up device\n") && csv.contains(",a GPU\n"));
}

#[test]
fn incompatible_folders_are_not_merged() {
    let merged = folder();
    let refused = |sources: &[&Path]| {
        let line = merge(sources, merged.path(), &[&SWEPT, &FAILS]).unwrap_err().to_string();
        assert_eq!(std::fs::read_dir(&merged).unwrap().count(), 0, "nothing is copied");
        line
    };
    let commits = parts(&[&SWEPT], 2, |index, machine| machine.commit = format!("commit{index}"));
    let line = refused(&paths(&commits));
    assert!(line.contains("cannot be merged: their commit differs"), "{line}");
    let empty = folder();
    let line = refused(&[commits[0].path(), empty.path()]);
    assert!(line.contains("holds no result"), "{line}");
    // The same cell was measured twice, on different machines.
    let twice = [folder(), folder()];
    for (folder, cores) in twice.iter().zip([2, 4]) {
        let mut again = a_run(&[&SWEPT], folder.path());
        again.machine.cores = cores;
        run(&again).unwrap();
    }
    let line = refused(&paths(&twice));
    assert!(line.contains("made.swept earth/oblique at 1 was measured in"), "{line}");
}

#[test]
fn a_measured_cell_replaces_one_that_failed_on_another_machine() {
    let (failed, merged) = (folder(), folder());
    run(&a_run(&[&FAILS], failed.path())).unwrap();
    let mended = folder();
    let store = Store::create(mended.path()).unwrap();
    let mut result = Store::at(failed.path()).all(&[&FAILS]).unwrap().remove(0);
    assert!(matches!(result.outcome, CellOutcome::Failed(_)));
    result.outcome = CellOutcome::Rows(Vec::new());
    store.put(&result).unwrap();
    for sources in [[failed.path(), mended.path()], [mended.path(), failed.path()]] {
        merge(&sources, merged.path(), &[&FAILS]).unwrap();
        let first = Store::at(merged.path()).all(&[&FAILS]).unwrap().remove(0);
        assert_eq!(first.outcome, CellOutcome::Rows(Vec::new()));
    }
}

#[test]
fn a_folder_takes_one_run_at_a_time() {
    let folder = folder();
    let store = Store::create(folder.path()).unwrap();
    let lock = store.lock().unwrap();
    let Err(busy) = store.lock() else { panic!("two runs in one folder") };
    assert!(busy.to_string().contains("another run is writing to it"), "{busy}");
    drop(lock);
    // A process that another test is starting holds all open files until it executes.
    while store.lock().is_err() {
        std::thread::sleep(Duration::from_millis(1));
    }
}
