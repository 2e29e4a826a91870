//! `ortelius reproduce`: measures figures on this machine and gives a verdict for each claim. The command itself only
//! supervises a child process that does the work ([`outlive`]).

use super::Usage;
use super::device::DeviceArgs;
use super::exit::{DEVICE_LOST, exit_code};
use super::interrupt;
use super::outputs::check_folder;
use super::progress::ProgressLine;
use super::report::{ReportArgs, WORKER};
use anyhow::{Context, anyhow, bail};
use clap::Args;
use ortelius::figure::{
    Cell, CellOutcome, CellResult, Effort, Failure, Figure, FigureRun, Machine, Partition, RunProgress,
    Store, Tally, choose, load, outlive, program,
};
use ortelius::picture::write::abandon;
use ortelius::renderer::figures::FAMILIES;
use ortelius::vk::Gpu;
use std::ffi::OsString;
use std::io::Read;
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::{Command, Stdio};

#[derive(Args)]
pub struct ReproduceArgs {
    /// Figures (vt.dedup) or families (vt), as listed by `ortelius list`; default: all
    #[arg(value_name = "FIGURE|FAMILY")]
    figures: Vec<String>,
    /// A quick run (the default). Most pictures have at most 720 rows of pixels. Most times are measured in 12 runs,
    /// some in 6
    #[arg(long, conflicts_with = "full")]
    quick: bool,
    /// Most times are measured in at least 30 runs, some in 6. This takes hours on a software device
    #[arg(long)]
    full: bool,
    /// The report's folder, created if absent
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    output: PathBuf,
    /// Measure only part I of N parts, for example 2/8. `ortelius merge` joins the parts
    #[arg(long, value_name = "I/N", value_parser = parse_partition)]
    partition: Option<Partition>,
    /// Keep the cells in DIR and measure the rest. (A cell is a scene at one value of the sweep.) Failed and left-out
    /// cells are measured again. All cells in DIR must be of the same commit, build, effort and device
    #[arg(long, conflicts_with = "force")]
    resume: bool,
    /// Measure the cells in DIR again
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    report: ReportArgs,
    /// Measure in this process, starting with this cell (used for the child); must be the last argument
    #[arg(long, hide = true, value_name = "CELL")]
    worker: Option<usize>,
    #[command(flatten)]
    device: DeviceArgs,
}

fn parse_partition(text: &str) -> Result<Partition, String> {
    let parsed = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    match parsed {
        Some((index, of)) if (1..=of).contains(&index) => Ok(Partition { index, of }),
        _ => Err("expected I/N with 1 <= I <= N, for example 2/8".into()),
    }
}

/// What to do after a stop. `ortelius demo` always resumes, and has no option --resume.
const fn advice(resumes: bool) -> &'static str {
    match resumes {
        true => "run the same command again; it keeps the measured cells",
        false => "run the same command with --resume to keep the measured cells",
    }
}

/// `line`: the program's arguments, from which a child parses the same `args`.
pub fn run(args: &ReproduceArgs, line: &[OsString]) -> anyhow::Result<()> {
    let figures = choose(&FAMILIES, &args.figures).map_err(|unknown| Usage(unknown.to_string()))?;
    check_folder(&args.output)?;
    match args.worker {
        None => {
            args.report.check()?;
            check_stored(args, &figures)?;
            interrupt::watch(Some(advice(args.resume)))?;
            watch(args, line)
        }
        Some(from) => {
            interrupt::watch(None)?;
            end_with_parent();
            measure(args, &figures, from)
        }
    }
}

/// Requires a choice between keeping and repeating cells that were already measured.
fn check_stored(args: &ReproduceArgs, figures: &[&'static Figure]) -> anyhow::Result<()> {
    let stored = Store::at(&args.output).all(figures)?.len();
    if stored > 0 && !args.resume && !args.force {
        bail!(Usage(format!(
            "{} holds {stored} cells of these figures; --resume keeps them and measures the rest; --force measures all again",
            args.output.display()
        )));
    }
    if stored > 0 && args.resume {
        tracing::info!("resuming: {} holds {stored} cells of these figures", args.output.display());
    }
    Ok(())
}

/// Load of other programs above which a warning is printed: half a core.
const DISTURBED: f64 = 0.5;

/// The warning about a load of the machine; `None` below the limit or if the load is unknown.
fn warning(load: Option<f64>) -> Option<String> {
    let load = load.filter(|load| *load > DISTURBED)?;
    Some(format!(
        "the machine is busy: {load} processes ran or waited in the last minute; this disturbs the times"
    ))
}

/// Starts a new child after each crash, until a child ends without crashing. If this child failed, it has already
/// printed the error. Its exit code becomes the exit code of this process.
fn watch(args: &ReproduceArgs, line: &[OsString]) -> anyhow::Result<()> {
    let program = std::env::current_exe().context("cannot find this program's own file")?;
    let worker = |from: usize| {
        let mut command = Command::new(&program);
        command.args(line).args([WORKER, &from.to_string()]);
        // The pipe stays open for as long as this process lives.
        let mut child = command.stdin(Stdio::piped()).spawn()?;
        let stdin = child.stdin.take();
        let status = child.wait();
        drop(stdin);
        status
    };
    let report = |result: &CellResult| tracing::warn!("{}", describe_crash(result));
    let status = outlive(&args.output, worker, report)?;
    match (status.code(), status.signal()) {
        (Some(0), _) => Ok(()),
        (Some(code), _) => std::process::exit(code),
        // Ctrl-C reaches the child and this process. It may reach this process later.
        (None, Some(signal)) if interrupt::SIGNALS.contains(&signal) => {
            interrupt::stop(signal, Some(advice(args.resume)))
        }
        _ => bail!("stopped ({status}); {}", advice(args.resume)),
    }
}

/// Ends this process when its parent dies, which closes the pipe. An orphan would disturb the next run's times.
fn end_with_parent() {
    std::thread::spawn(|| {
        let mut stdin = std::io::stdin().lock();
        // The pipe never carries data, so read returns only at its end.
        while stdin.read(&mut [0]).is_ok_and(|bytes| bytes > 0) {}
        let _held = abandon();
        std::process::abort();
    });
}

fn describe_crash(result: &CellResult) -> String {
    match &result.outcome {
        CellOutcome::Crashed(how) => format!("{} {}: {how}", result.figure, result.cell),
        other => unreachable!("a crashed cell has the outcome {other:?}"),
    }
}

fn measure(args: &ReproduceArgs, figures: &[&'static Figure], from: usize) -> anyhow::Result<()> {
    let known = choose(&FAMILIES, &[]).expect("no name is unknown");
    let checked = args.report.check()?;
    let machine = {
        let gpu = Gpu::new(&args.device.options())?;
        gpu.require_drawing()?;
        Machine::here(gpu.physical())
    };
    tracing::info!("{}, {}; {}, {} cores", machine.device, machine.driver, machine.processor, machine.cores);
    if let Some(warning) = warning(load()).filter(|_| from == 0) {
        tracing::warn!("{warning}");
    }
    let _lock = Store::create(&args.output)?.lock()?;
    let run = FigureRun {
        figures,
        folder: &args.output,
        effort: if args.full { Effort::Full } else { Effort::Quick },
        device: args.device.device.clone(),
        machine,
        validate: args.device.validate,
        partition: args.partition.unwrap_or(Partition::WHOLE),
        resume: args.resume,
        program: program(),
        from,
    };
    let bar = ProgressLine::counting("cells");
    bar.phase("", None);
    let tally = run.run(&known, &bar);
    drop(bar);
    let tally = tally?;
    let store = Store::at(&args.output);
    // Only the requested figures; `merge` shows everything in the folder.
    let failed = checked.report(&store, figures, run.effort)?;
    let stored = store.all(&known)?;
    let asked = |cell: &&CellResult| figures.iter().any(|figure| figure.id == cell.figure);
    let others = stored.len() - stored.iter().filter(asked).count();
    if others > 0 {
        let folder = args.output.display();
        tracing::info!(
            "{folder} also holds {others} cells of other figures: to see all, run `ortelius merge {folder} -o {folder}`"
        );
    }
    conclude(args, tally)?;
    failed.map_or(Ok(()), |failed| bail!(failed))
}

fn conclude(args: &ReproduceArgs, mut tally: Tally) -> anyhow::Result<()> {
    let folder = args.output.display();
    let kept = if tally.kept > 0 { format!(", {} kept", tally.kept) } else { String::new() };
    let left_out = match &tally.left_out[..] {
        [] => String::new(),
        [first, ..] => format!(", {} left out, first {first}", tally.left_out.len()),
    };
    tracing::info!("{} cells measured{kept}{left_out}; the report is {folder}/index.html", tally.measured);
    if tally.failures.is_empty() {
        return Ok(());
    }
    let count = tally.failures.len();
    // A lost device has its own exit code, so it is reported even if it is not the first failure.
    let lost = |failure: &Failure| failure.cause.as_ref().is_some_and(|e| exit_code(e) == DEVICE_LOST);
    let lost = tally.failures.iter().position(lost);
    let Failure { figure, cell, error, cause } = tally.failures.swap_remove(lost.unwrap_or(0));
    let which = if lost.is_some() { "the device was lost in" } else { "first" };
    let line = format!("{count} of {} cells failed, {which} {figure} {cell}: {error}", tally.measured);
    Err(match cause {
        Some(cause) => cause.context(line),
        None => anyhow!(line),
    })
}

impl RunProgress for ProgressLine {
    fn begins(&self, figure: &str, cell: &Cell, number: usize, count: usize) {
        self.message(format!("{figure} {cell}"));
        self.set(number - 1, count);
    }

    fn skipped(&self, result: &CellResult) {
        let line = describe_crash(result);
        self.above(|| {
            tracing::warn!(
                "{line}, in an earlier run; not measurable on this device (to retry, reproduce {} with --force)",
                result.figure
            );
        });
    }

    fn ended(&self, result: &CellResult) {
        let (figure, cell, seconds) = (&result.figure, &result.cell, result.seconds);
        let line = match &result.outcome {
            CellOutcome::Failed(error) => format!("{figure} {cell}: failed after {seconds:.1} s: {error}"),
            CellOutcome::LeftOut(why) => format!("{figure} {cell}: left out: {why}"),
            _ => format!("{figure} {cell}: {seconds:.1} s"),
        };
        let failed = matches!(result.outcome, CellOutcome::Failed(_));
        // Must be read before the call of `above`, which holds the bar's lock while it prints.
        let hidden = self.is_hidden();
        self.above(|| match (failed, hidden) {
            (true, _) => tracing::warn!("{line}"),
            (false, true) => tracing::info!("{line}"),
            (false, false) => {}
        });
    }
}

#[cfg(test)]
mod tests {
    use super::{DISTURBED, warning};

    #[test]
    fn only_a_load_above_the_limit_gives_a_warning() {
        assert_eq!([None, Some(0.0), Some(DISTURBED)].map(warning), [None, None, None]);
        assert!(
            warning(Some(1.25)).is_some_and(|line| line.starts_with("the machine is busy: 1.25 processes"))
        );
    }
}
