//! `ortelius reproduce`: measures figures on this machine and gives a verdict for each claim. The command only watches a
//! child process that does the work ([`outlive`]).

use super::Usage;
use super::device::DeviceArgs;
use super::outputs::check_folder;
use super::report::{ReportArgs, WORKER};
use anyhow::{Context, bail};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use ortelius::figure::{
    Cell, CellResult, Effort, Figure, Machine, Outcome, Partition, Progress, Run, Store, Tally, choose, load,
    outlive, program,
};
use ortelius::paper::FAMILIES;
use ortelius::vk::Gpu;
use std::ffi::OsString;
use std::io::Read;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

#[derive(Args)]
pub struct ReproduceArgs {
    /// Figures (vt.dedup) or families (vt); all without one. `ortelius list` shows them
    #[arg(value_name = "FIGURE|FAMILY")]
    figures: Vec<String>,
    /// At most 720 rows of pixels, 12 runs of each time (the default)
    #[arg(long, conflicts_with = "full")]
    quick: bool,
    /// At least 30 runs of each time; hours on a software device
    #[arg(long)]
    full: bool,
    /// The report's folder, made if absent
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    output: PathBuf,
    /// Measure every N-th cell only, beginning with the I-th; `ortelius merge` joins the parts
    #[arg(long, value_name = "I/N", value_parser = parse_partition)]
    partition: Option<Partition>,
    /// Keep what DIR has of the same commit, effort and device, and measure the rest
    #[arg(long, conflicts_with = "force")]
    resume: bool,
    /// Measure again what DIR has
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    report: ReportArgs,
    /// Measure in this very process, from this cell on (what the child does); the last argument
    #[arg(long, hide = true, value_name = "CELL")]
    worker: Option<usize>,
    #[command(flatten)]
    device: DeviceArgs,
}

fn parse_partition(text: &str) -> Result<Partition, String> {
    let parsed = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    match parsed {
        Some((index, of)) if (1..=of).contains(&index) => Ok(Partition { index, of }),
        _ => Err("a part is I/N with 1 <= I <= N, as in 2/8".into()),
    }
}

/// `line`: the program's arguments, from which a child makes the same `args`.
pub fn run(args: &ReproduceArgs, line: &[OsString]) -> anyhow::Result<()> {
    let figures = choose(&FAMILIES, &args.figures).map_err(|unknown| Usage(unknown.to_string()))?;
    check_folder(&args.output)?;
    match args.worker {
        None => {
            args.report.check()?;
            check_stored(args, &figures)?;
            watch(args, line)
        }
        Some(from) => {
            end_with_parent();
            measure(args, &figures, from)
        }
    }
}

/// Cells that were measured are neither kept nor measured again by mistake.
fn check_stored(args: &ReproduceArgs, figures: &[&'static Figure]) -> anyhow::Result<()> {
    let stored = Store::at(&args.output).all(figures)?.len();
    if stored > 0 && !args.resume && !args.force {
        bail!(Usage(format!(
            "{} holds {stored} cells of these figures; --resume keeps them and measures the rest, --force measures all again",
            args.output.display()
        )));
    }
    Ok(())
}

/// The load from which on other programs are worth a word: half a core.
const DISTURBED: f64 = 0.5;

fn warn_of_load() {
    if let Some(load) = load().filter(|load| *load > DISTURBED) {
        tracing::warn!(
            "the machine is busy: {load} processes ran or waited in the last minute, and disturb the times"
        );
    }
}

/// Restarts children until one ends by itself. That child has reported its error; its exit code becomes ours.
fn watch(args: &ReproduceArgs, line: &[OsString]) -> anyhow::Result<()> {
    let program = std::env::current_exe().context("own program not found")?;
    let worker = |from: usize| {
        let mut command = Command::new(&program);
        command.args(line).args([WORKER, &from.to_string()]);
        // The pipe stays open as long as this process lives.
        let mut child = command.stdin(Stdio::piped()).spawn()?;
        let stdin = child.stdin.take();
        let status = child.wait();
        drop(stdin);
        status
    };
    let told = |result: &CellResult| tracing::warn!("{}", told_crash(result));
    let status = outlive(&args.output, worker, told)?;
    match status.code() {
        Some(0) => Ok(()),
        Some(code) => std::process::exit(code),
        None => bail!("stopped ({status}); --resume goes on"),
    }
}

/// Ends this process when its parent is killed, which closes the pipe. An orphan would disturb the next run's times.
fn end_with_parent() {
    std::thread::spawn(|| {
        let mut stdin = std::io::stdin().lock();
        // Nothing is ever written into it: read returns at the end only.
        while stdin.read(&mut [0]).is_ok_and(|bytes| bytes > 0) {}
        std::process::abort();
    });
}

fn told_crash(result: &CellResult) -> String {
    match &result.outcome {
        Outcome::Crashed(how) => format!("{} {}: {how}", result.figure, result.cell),
        other => unreachable!("a cell that crashed has {other:?}"),
    }
}

fn measure(args: &ReproduceArgs, figures: &[&'static Figure], from: usize) -> anyhow::Result<()> {
    let known = choose(&FAMILIES, &[]).expect("no name is unknown");
    let checked = args.report.check()?;
    let machine = Machine::here(Gpu::new(&args.device.options())?.physical());
    tracing::info!("{}, {}; {}, {} cores", machine.device, machine.driver, machine.processor, machine.cores);
    if from == 0 {
        warn_of_load();
    }
    let _lock = Store::create(&args.output)?.lock()?;
    let run = Run {
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
    let bar = Bar::new();
    let tally = run.run(&known, &bar);
    bar.0.finish_and_clear();
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
            "{folder} also holds {others} cells of other figures: `ortelius merge {folder} -o {folder}` shows all"
        );
    }
    conclude(args, &tally)?;
    failed.map_or(Ok(()), |failed| bail!(failed))
}

fn conclude(args: &ReproduceArgs, tally: &Tally) -> anyhow::Result<()> {
    let folder = args.output.display();
    let kept = if tally.kept > 0 { format!(", {} kept", tally.kept) } else { String::new() };
    tracing::info!("{} cells measured{kept}; the report is {folder}/index.html", tally.measured);
    match &tally.failures[..] {
        [] => Ok(()),
        [first, ..] => bail!(
            "{} of {} cells failed, first {} {}: {}",
            tally.failures.len(),
            tally.measured,
            first.figure,
            first.cell,
            first.error
        ),
    }
}

/// A progress bar on stderr; without a terminal, a line for each cell.
struct Bar(ProgressBar);

impl Bar {
    fn new() -> Bar {
        let bar = ProgressBar::no_length();
        let template = "{pos}/{len} {wide_bar} {msg} {elapsed}, about {eta} left";
        // The template is ours; a wrong one shows the default style.
        bar.set_style(
            ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()),
        );
        Bar(bar)
    }
}

impl Progress for Bar {
    fn begins(&self, figure: &str, cell: &Cell, number: usize, count: usize) {
        self.0.set_length(count as u64);
        self.0.set_position(number as u64 - 1);
        self.0.set_message(format!("{figure} {cell}"));
        self.0.enable_steady_tick(Duration::from_millis(500));
    }

    fn skipped(&self, result: &CellResult) {
        let line = told_crash(result);
        self.0.suspend(|| {
            tracing::warn!(
                "{line}, in an earlier run; not measurable on this device (without --resume: tried again)"
            );
        });
    }

    fn ended(&self, result: &CellResult) {
        let (figure, cell, seconds) = (&result.figure, &result.cell, result.seconds);
        let line = match &result.outcome {
            Outcome::Failed(error) => format!("{figure} {cell}: failed after {seconds:.1} s: {error}"),
            _ => format!("{figure} {cell}: {seconds:.1} s"),
        };
        let failed = matches!(result.outcome, Outcome::Failed(_));
        // Outside `suspend`, which holds the bar's lock.
        let hidden = self.0.is_hidden();
        self.0.suspend(|| match (failed, hidden) {
            (true, _) => tracing::warn!("{line}"),
            (false, true) => tracing::info!("{line}"),
            (false, false) => {}
        });
    }
}
