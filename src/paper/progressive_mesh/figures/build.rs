//! pm.build: build time and memory against the size of the model.

use super::super::choices::FaceOrder;
use super::super::mesh::ProgressiveMesh;
use super::scans;
use crate::figure::prelude::*;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

pub const BUILD: Figure = Figure {
    id: "pm.build",
    title: "Time and memory of a build",
    about: "The optimizer runs once per model and is not bound to real time (section 2). How long do the \
            steps of a build take, and how much memory? The steps are reading and cleaning a file, \
            simplifying to 64 faces, ordering (tail-23), writing the .pmesh file, and reading it. Each uses \
            one core, but most of the file is encoded on a second core during the ordering: the time of writing \
            is the rest. In full runs, the dragon is also built with the best settings (in-place-23, whose \
            order uses all cores) and with `--effort fast`. `torus` is generated with about as many faces as \
            the scan `dragon` has in its four resolutions; the dragon is measured if `ortelius fetch` has \
            downloaded it. Each build runs six times, each in its own process (`ortelius mesh build`). Memory \
            is the maximum resident memory of that process.",
    scenes: &["torus", "dragon"],
    variants,
    sweep: Some(Sweep {
        name: "faces",
        quick: &[11_102.0, 47_794.0],
        full: &[11_102.0, 47_794.0, 202_520.0, 871_414.0],
    }),
    show: Show::nothing("it times the building of .pmesh files", "bunny"),
    measure,
    plots: &[Plot::sweep(TIME).log_x().log_y(), Plot::sweep(MEMORY).log_x().log_y()],
    claims: &[
        Claim::ours_timed(
            "linear",
            "The build time per face is at most twice as large for the largest model as for the smallest.",
            &[Test::growth(one(TIME, WHOLE), 1.0, AtMost(2.0))],
        ),
        Claim::ours_timed(
            "dragon",
            "The dragon with 871 414 faces is built in at most 150 s with the best settings (target: 60 s), and in at \
             most 35 s with `--effort fast`; with at most 2 GiB.",
            &[
                Test::value(one(TIME, BEST), AtMost(150e3)),
                Test::value(one(TIME, FAST), AtMost(35e3)),
                Test::value(each(MEMORY, settings), AtMost(2048.0)),
            ],
        )
        .at(Places::scenes(&["dragon"]).x(871_414.0, 871_414.0)),
    ],
    ..Figure::BASE
};

const TIME: &str = "time";
const MEMORY: &str = "most memory";
const FILE: &str = "file";
const WHOLE: &str = "whole build";
const BEST: &str = "whole build, best settings";
const FAST: &str = "whole build, fast";
const LOAD: &str = "load and clean";
const STEPS: [&str; 5] = [LOAD, "simplify", "order", "write", "read again"];
/// Number of [`STEPS`] that [`WHOLE`] includes: all except the last.
const OF_THE_BUILD: usize = 4;
/// The builds: the name of each build's total time, and its options of `mesh build`. Only the dragon in full runs has
/// all builds.
const SETTINGS: [(&str, &[&str]); 3] = [
    (WHOLE, &[]),
    (BEST, &["--effort", "best", "--order", FaceOrder::InPlace23.name()]),
    (FAST, &["--effort", "fast"]),
];
/// The dragon's files by number of faces.
const DRAGONS: [(f64, &str); 4] =
    [(11_102.0, "dragon_res4"), (47_794.0, "dragon_res3"), (202_520.0, "dragon_res2"), (871_414.0, "dragon")];
/// Builds of each model: the smallest number with a 95 % confidence interval.
const RUNS: usize = 6;

fn variants() -> Vec<String> {
    STEPS.into_iter().map(String::from).chain(settings()).collect()
}

fn settings() -> Vec<String> {
    SETTINGS.map(|(name, _)| name.into()).into()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let faces = cell.x.context("the sweep has values")?;
    let model = match &*cell.scene {
        // A torus of n rows has 4 n n faces.
        "torus" => format!("torus:{}", (faces / 4.0).sqrt().round()),
        _ => {
            let name = DRAGONS.iter().find(|(count, _)| *count == faces).context("a dragon")?.1;
            scans::check_fetched(name)?;
            name.to_owned()
        }
    };
    let settings =
        if cell.scene == "torus" { &SETTINGS[..1] } else { bench.effort_of(&SETTINGS[..1], &SETTINGS[..]) };
    let folder = tempfile::tempdir()?;
    let mut rows = Vec::new();
    for &(name, options) in settings {
        let builds =
            (0..RUNS).map(|_| build(&model, options, folder.path())).collect::<Result<Vec<_>, _>>()?;
        rows.extend(rows_of(name, &builds));
    }
    Ok(rows)
}

/// The rows of some builds with the same settings. Only the default settings have rows of the steps.
fn rows_of(name: &str, builds: &[Build]) -> Vec<Row> {
    let times = |step: usize| builds.iter().map(|build| build.times[step]).collect::<Vec<f64>>();
    let whole: Vec<f64> = builds.iter().map(|build| build.times[..OF_THE_BUILD].iter().sum()).collect();
    let steps = STEPS.into_iter().enumerate().filter(|_| name == WHOLE);
    let samples = steps.map(|(step, label)| (label, times(step))).chain([(name, whole)]);
    let mut rows: Vec<Row> =
        samples.map(|(label, times)| Row::of_rounds(label, TIME, "ms", Some(times))).collect();
    let memory: Option<Vec<f64>> = builds.iter().map(|build| build.peak_memory).collect();
    rows.push(match memory {
        Some(memory) => Row::of_rounds(name, MEMORY, "MiB", Some(memory)),
        None => Row::missing(name, MEMORY, "this system does not report the memory of a process"),
    });
    rows.push(Row::number(name, FILE, "bytes", builds[0].file_bytes));
    rows
}

/// The cost of one build.
struct Build {
    /// Milliseconds of each of [`STEPS`].
    times: [f64; 5],
    /// Maximum resident memory in MiB; `None` if unknown.
    peak_memory: Option<f64>,
    file_bytes: f64,
}

/// Builds a model in a separate process (this program as `mesh build`), so that the memory of earlier
/// measurements is not counted.
fn build(model: &str, options: &[&str], folder: &Path) -> anyhow::Result<Build> {
    let (file, report) = (folder.join("a.pmesh"), folder.join("a.json"));
    let program = std::env::current_exe().context("own program not found")?;
    let mut command = Command::new(program);
    command.args(["mesh", "build", model]).args(options).arg("-o").arg(&file).arg("--report").arg(&report);
    let ran = command.stdin(Stdio::null()).output().context("the build process cannot be started")?;
    let said = String::from_utf8_lossy(&ran.stderr);
    anyhow::ensure!(ran.status.success(), "mesh build {model}: {}", said.lines().last().unwrap_or_default());
    let start = Instant::now();
    let read = ProgressiveMesh::read(&file)?;
    let again = start.elapsed().as_secs_f64() * 1e3;
    anyhow::ensure!(!read.contents.is_cut(), "{}: incomplete when read back", file.display());
    build_of_report(&serde_json::from_slice(&std::fs::read(&report)?)?, again)
        .with_context(|| format!("{}: not a report of mesh build", report.display()))
}

/// Reads a build's report, and adds the time to read its file.
fn build_of_report(report: &serde_json::Value, again: f64) -> Option<Build> {
    let step = |name: &str| report["milliseconds"][name].as_f64();
    Some(Build {
        times: [step("load_and_clean")?, step("simplify")?, step("order")?, step("write")?, again],
        peak_memory: report["most_memory_bytes"].as_f64().map(|bytes| bytes / f64::from(1 << 20)),
        file_bytes: report["file_bytes"].as_f64()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{Machine, Table, TableRecord, Verdict};

    #[test]
    fn a_report_without_a_step_is_no_build() {
        let whole = r#"{"milliseconds": {"load_and_clean": 1, "simplify": 2, "order": 3.5, "write": 4},
                        "most_memory_bytes": 3145728, "file_bytes": 99}"#;
        let build = |text: &str| build_of_report(&serde_json::from_str(text).unwrap(), 5.0);
        let found = build(whole).unwrap();
        assert_eq!(
            (found.times, found.peak_memory, found.file_bytes),
            ([1.0, 2.0, 3.5, 4.0, 5.0], Some(3.0), 99.0)
        );
        assert!(build(&whole.replace("3145728", "null")).unwrap().peak_memory.is_none());
        assert!(build(&whole.replace("order", "ordering")).is_none());
        // Only the default settings have rows of their steps.
        let rows = |name: &str| rows_of(name, &[build(whole).unwrap(), build(whole).unwrap()]);
        assert_eq!((rows(WHOLE).len(), rows(FAST).len()), (8, 3));
        let table = |rows: Vec<Row>| {
            let cell = |row| TableRecord { scene: "dragon".into(), x: Some(871_414.0), row };
            let machine = Machine { device_kind: "cpu".into(), ..Machine::default() };
            Table { machine, records: rows.into_iter().map(cell).collect(), lost: Vec::new() }
        };
        let verdict = |seconds: f64| {
            let slow = whole.replace("3.5", &format!("{}", 1e3 * seconds));
            let builds = [(); RUNS].map(|()| build(&slow).unwrap());
            let rows = SETTINGS.iter().flat_map(|(name, _)| rows_of(name, &builds)).collect();
            BUILD.claims[1].judge(&table(rows)).verdict
        };
        assert_eq!(verdict(34.0), Verdict::HoldsHere);
        assert_ne!(verdict(36.0), Verdict::HoldsHere);
    }
}
