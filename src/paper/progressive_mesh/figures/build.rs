//! pm.build: how long a build takes, and how much memory, against the size of the model.

use super::super::mesh::ProgressiveMesh;
use super::super::order::{OrderOptions, order};
use super::super::simplify::{SimplifyOptions, simplify};
use super::orders::judged;
use crate::figure::{
    Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Sweep, Table, Value, Verdict,
};
use crate::scene::model::{Model, fetched, named};
use crate::stats::Summary;
use anyhow::Context;
use std::path::Path;
use std::time::Instant;

pub const BUILD: Figure = Figure {
    id: "pm.build",
    title: "Time and memory of a build",
    about: "The optimizer runs once a model, and is not bound to real time (section 2). How long do its steps take, on \
            one core but for what the counting of levels would use, and how much memory: reading and cleaning a file, \
            simplifying to 64 faces, ordering (ours, at most 23 moved faces a split), writing the .pmesh file, and reading \
            it? `torus` is generated in about as many faces as the scan `dragon` has in its four resolutions; the dragon \
            is measured where `ortelius fetch` has fetched it. Memory is the most that the whole \
            process had resident meanwhile, the device's driver included: a bound from above.",
    scenes: &["torus", "dragon"],
    variants,
    sweep: Some(Sweep {
        name: "faces",
        quick: &[11_102.0, 47_794.0, 202_520.0],
        full: &[11_102.0, 47_794.0, 202_520.0, 871_414.0],
    }),
    measure,
    plots: &[
        Plot { quantity: TIME, x: Axis::Sweep, log_x: true, log_y: true, floor: None },
        Plot { quantity: MEMORY, x: Axis::Sweep, log_x: true, log_y: true, floor: None },
    ],
    claims: &[
        Claim {
            id: "linear",
            text: "A face costs at most twice as much time in the largest model as in the smallest.",
            from: Origin::Ours,
            check: linear,
        },
        Claim {
            id: "dragon",
            text: "The dragon of 871 414 faces is built in about 30 s (at most 36), with at most 2 GiB.",
            from: Origin::Ours,
            check: dragon,
        },
    ],
};

const TIME: &str = "time";
const MEMORY: &str = "most memory";
const FILE: &str = "file";
const WHOLE: &str = "whole build";
const LOAD: &str = "load and clean";
const STEPS: [&str; 5] = [LOAD, "simplify", "order", "write", "read again"];
/// What [`WHOLE`] consists of.
const OF_THE_BUILD: usize = 4;
/// The dragon's files by their faces.
const DRAGONS: [(f64, &str); 4] =
    [(11_102.0, "dragon_res4"), (47_794.0, "dragon_res3"), (202_520.0, "dragon_res2"), (871_414.0, "dragon")];
/// Models of more faces are built once when quick.
const FEW_FACES: f64 = 50_000.0;

fn variants() -> Vec<String> {
    STEPS.into_iter().chain([WHOLE]).map(String::from).collect()
}

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let faces = cell.x.context("the sweep has values")?;
    let load: Box<dyn Fn() -> anyhow::Result<Model>> = match &*cell.scene {
        "torus" => {
            // A torus of n rows has 4 n n faces.
            let name = format!("torus:{}", (faces / 4.0).sqrt().round());
            Box::new(move || named(&name).with_context(|| format!("no model {name}")))
        }
        _ => {
            let name = DRAGONS.iter().find(|(count, _)| *count == faces).context("a dragon")?.1;
            let Some(path) = fetched(name) else {
                let why = format!("{name} is not here: ortelius fetch {name}");
                return Ok(variants().iter().map(|v| missing(v, TIME, &why)).collect());
            };
            Box::new(move || Ok(Model::load(&path)?.0))
        }
    };
    let runs = if bench.effort == Effort::Quick && faces > FEW_FACES { 1 } else { 3 };
    let folder = tempfile::tempdir()?;
    let mut samples = vec![Vec::new(); STEPS.len()];
    let (mut memory, mut file_bytes) = (None, 0);
    for run in 0..runs {
        let before = if run == 0 { reset_peak() } else { None };
        let (times, bytes) = build(&load, &folder.path().join("a.pmesh"))?;
        // Of the first run: later ones have what the allocator kept beside.
        memory = memory.or(before.and_then(|_| peak()));
        file_bytes = bytes;
        samples.iter_mut().zip(times).for_each(|(samples, time)| samples.push(time));
    }
    let whole = (0..runs).map(|run| samples[..OF_THE_BUILD].iter().map(|step| step[run]).sum()).collect();
    let steps = STEPS.into_iter().chain([WHOLE]).zip(samples.into_iter().chain([whole]));
    let mut rows: Vec<Row> =
        steps.filter_map(|(step, times)| Some(time_row(step, Summary::of(&times)?))).collect();
    rows.push(match memory {
        Some(bytes) => Row::new(WHOLE, MEMORY, "MiB", Value::Number(bytes as f64 / f64::from(1 << 20))),
        None => missing(WHOLE, MEMORY, "this system does not tell a process its memory"),
    });
    rows.push(Row::new(WHOLE, FILE, "bytes", Value::Number(file_bytes as f64)));
    Ok(rows)
}

fn time_row(step: &str, times: Summary) -> Row {
    Row::new(step, TIME, "ms", Value::Summary(times))
}

fn missing(variant: &str, quantity: &str, why: &str) -> Row {
    Row::new(variant, quantity, "", Value::Missing(why.to_owned()))
}

/// Milliseconds of each of [`STEPS`], and the file's length.
fn build(load: &dyn Fn() -> anyhow::Result<Model>, path: &Path) -> anyhow::Result<([f64; 5], u64)> {
    let mut times = [0.0; 5];
    let mut start = Instant::now();
    let mut lap = |step: usize| {
        let now = Instant::now();
        times[step] = (now - std::mem::replace(&mut start, now)).as_secs_f64() * 1e3;
    };
    let model = load()?;
    lap(0);
    let simplified = simplify(&model, &SimplifyOptions::default(), &mut |_, _| {});
    lap(1);
    let mesh = order(&model, &simplified.collapses, &OrderOptions::BEST, &mut |_, _| {});
    lap(2);
    let contents = mesh.write(path)?;
    lap(3);
    let again = ProgressiveMesh::read(path)?;
    lap(4);
    anyhow::ensure!(again.mesh == mesh, "{}: read again it is another mesh", path.display());
    Ok((times, contents.bytes))
}

/// Forgets the most memory so far; bytes that are resident now. None where the system has no such thing.
fn reset_peak() -> Option<u64> {
    std::fs::write("/proc/self/clear_refs", "5").ok()?;
    peak()
}

/// The most bytes that this process had resident since [`reset_peak`].
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

fn linear(table: &Table) -> Finding {
    let each = |scene: &str| -> Option<(f64, f64)> {
        let of = |x: &f64| Some((*x, table.number(scene, Some(*x), WHOLE, TIME)? / x));
        let found: Vec<(f64, f64)> = DRAGONS.iter().filter_map(|(x, _)| of(x)).collect();
        let ((_, first), (_, last)) = (found.first()?, found.last()?);
        (found.len() > 1).then_some((1e3 * first, 1e3 * last))
    };
    let found: Vec<(&str, (f64, f64))> =
        BUILD.scenes.iter().filter_map(|&scene| Some((scene, each(scene)?))).collect();
    let numbers = found.iter().map(|(scene, (first, last))| {
        format!("{scene}: {first:.1} us a face in the smallest, {last:.1} us in the largest")
    });
    let met = (!found.is_empty()).then(|| found.iter().all(|(_, (first, last))| last <= &(2.0 * first)));
    judged(met, numbers.collect::<Vec<_>>().join("; "), "at most twice")
}

fn dragon(table: &Table) -> Finding {
    let of = |quantity| table.number("dragon", Some(871_414.0), WHOLE, quantity);
    let (Some(ms), Some(mib)) = (of(TIME), of(MEMORY)) else {
        let why = "needs the fetched dragon, and --full";
        return Finding::new(Verdict::NotMeasurable, "", why);
    };
    let numbers = format!("{:.1} s, {mib:.0} MiB", ms / 1e3);
    judged(Some(ms <= 36e3 && mib <= 2048.0), numbers, "36 s and 2048 MiB")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{Machine, Record};

    fn table(rows: &[(&str, f64, &str, f64)]) -> Table {
        let mut table: Table = super::super::tests::table("cpu", &[]);
        let _: &Machine = &table.machine;
        table.records.extend(rows.iter().map(|&(scene, x, quantity, number)| Record {
            scene: scene.into(),
            x: Some(x),
            row: Row::new(WHOLE, quantity, "", Value::Number(number)),
        }));
        table
    }

    #[test]
    fn a_model_whose_faces_cost_more_than_twice_refutes() {
        let found = |large| {
            let rows = [("torus", 11_102.0, TIME, 100.0), ("torus", 202_520.0, TIME, large)];
            linear(&table(&rows)).verdict
        };
        assert_eq!((found(3648.0), found(3649.0)), (Verdict::Reproduced, Verdict::NotReproduced));
        assert_eq!(linear(&table(&[])).verdict, Verdict::NotMeasurable);
        assert_eq!(linear(&table(&[("torus", 11_102.0, TIME, 1.0)])).verdict, Verdict::NotMeasurable);
    }

    #[test]
    fn the_dragon_is_judged_by_time_and_memory() {
        let found = |ms, mib| {
            let rows = [("dragon", 871_414.0, TIME, ms), ("dragon", 871_414.0, MEMORY, mib)];
            dragon(&table(&rows)).verdict
        };
        assert_eq!(found(36e3, 2048.0), Verdict::Reproduced);
        assert_eq!(
            (found(37e3, 100.0), found(1e3, 2049.0)),
            (Verdict::NotReproduced, Verdict::NotReproduced)
        );
        assert_eq!(dragon(&table(&[])).verdict, Verdict::NotMeasurable);
    }

    #[test]
    fn the_peak_sees_memory_that_is_gone() {
        // Where /proc is not as on Linux there is nothing to see, and the figure says so.
        let Some(before) = reset_peak() else { return };
        let bytes = 64 << 20;
        assert!(std::hint::black_box(vec![1_u8; bytes]).iter().all(|&byte| byte == 1));
        let grown = peak().unwrap() - before;
        // Other tests of this process may free memory meanwhile.
        assert!(grown >= bytes as u64 / 2, "{grown} bytes of {bytes}");
    }
}
