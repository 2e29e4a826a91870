//! `ortelius reproduce`: figures measured on this machine, with a verdict for each claim.

use super::Usage;
use super::device::DeviceArgs;
use super::report::{report, stored};
use anyhow::bail;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use ortelius::figure::{
    Cell, CellResult, Effort, Figure, Machine, Outcome, Partition, Progress, Run, Store, Tally, choose,
};
use ortelius::paper::FAMILIES;
use ortelius::vk::Gpu;
use std::path::PathBuf;
use std::time::Duration;

#[derive(Args)]
pub struct ReproduceArgs {
    /// Figures (vt.dedup) or families (vt); all without one. `ortelius list` shows them
    #[arg(value_name = "FIGURE|FAMILY")]
    figures: Vec<String>,
    /// At most 720 rows of pixels, 10 runs of each time (the default)
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
    #[arg(long)]
    resume: bool,
    /// Show what changed against stored results (a report's results.json)
    #[arg(long, value_name = "RESULTS.json")]
    against: Option<PathBuf>,
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

pub fn run(args: &ReproduceArgs) -> anyhow::Result<()> {
    let figures = choose(&FAMILIES, &args.figures).map_err(|unknown| Usage(unknown.to_string()))?;
    let known = choose(&FAMILIES, &[]).expect("no name is unknown");
    let against = stored(args.against.as_deref())?;
    let machine = Machine::here(Gpu::new(&args.device.options())?.physical());
    tracing::info!("{}, {}; {}, {} cores", machine.device, machine.driver, machine.processor, machine.cores);
    let run = Run {
        figures: &figures,
        folder: &args.output,
        effort: if args.full { Effort::Full } else { Effort::Quick },
        device: args.device.device.clone(),
        machine,
        validate: args.device.validate,
        partition: args.partition.unwrap_or(Partition::WHOLE),
        resume: args.resume,
    };
    let bar = Bar::new();
    let tally = run.run(&known, &bar);
    bar.0.finish_and_clear();
    let tally = tally?;
    let store = Store::at(&args.output);
    let cells = store.all(&known)?;
    let shown = |figure: &&'static Figure| {
        let asked = figures.iter().any(|asked| asked.id == figure.id);
        asked || cells.iter().any(|cell| cell.figure == figure.id)
    };
    let shown: Vec<&Figure> = known.iter().copied().filter(shown).collect();
    report(&store, &shown, run.effort, against.as_ref())?;
    conclude(args, &tally)
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

/// A bar on stderr; where that is no terminal, a line a cell.
struct Bar(ProgressBar);

impl Bar {
    fn new() -> Bar {
        let bar = ProgressBar::no_length();
        let template = "{pos}/{len} {wide_bar} {msg} {elapsed}";
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

    fn ended(&self, result: &CellResult) {
        let (figure, cell, seconds) = (&result.figure, &result.cell, result.seconds);
        let line = match &result.outcome {
            Outcome::Failed(error) => format!("{figure} {cell}: failed after {seconds:.1} s: {error}"),
            _ => format!("{figure} {cell}: {seconds:.1} s"),
        };
        let failed = matches!(result.outcome, Outcome::Failed(_));
        // Asked outside: what is suspended holds the bar's lock.
        let hidden = self.0.is_hidden();
        self.0.suspend(|| match (failed, hidden) {
            (true, _) => tracing::warn!("{line}"),
            (false, true) => tracing::info!("{line}"),
            (false, false) => {}
        });
    }
}
