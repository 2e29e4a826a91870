//! `ortelius trade`: a scene's settings by time and error, and the one to choose.

use super::asked::parse_size;
use super::device::DeviceArgs;
use super::outputs::check_folder;
use super::{Usage, say};
use anyhow::{Context, anyhow, bail};
use clap::{Args, ValueEnum};
use ortelius::figure::{Bench, Effort, Same, Trade, Traded};
use ortelius::math::nearest::nearest;
use ortelius::paper::virtual_texture::figures::trade::{Knob, Measure, Sweep};
use ortelius::renderer::sections;
use ortelius::scene::{SHIPPED, write_changes};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

#[derive(Clone, Copy, ValueEnum)]
enum ErrorName {
    Nmse,
    Flip,
    Max,
}

#[derive(Args)]
pub struct TradeArgs {
    /// A scene file, or the name of a shipped scene
    scene: String,
    /// Normalised mean squared error, mean FLIP, or the largest error of a channel in linear light
    #[arg(long, value_enum, default_value = "nmse")]
    error: ErrorName,
    /// Look for the fastest setting with at most this error
    #[arg(long, value_name = "E", value_parser = parse_bound, conflicts_with = "max_ms", allow_negative_numbers = true)]
    max_error: Option<f64>,
    /// Look for the most accurate setting that takes at most so long
    #[arg(long, value_name = "T", value_parser = parse_bound, allow_negative_numbers = true)]
    max_ms: Option<f64>,
    /// Turn these alone, of level-bias, filter, anisotropy, border, list, stages, format, gpu-tiles, budgets; all
    /// otherwise
    #[arg(long, value_name = "KNOB,…", value_delimiter = ',', value_parser = parse_knob)]
    knobs: Vec<Knob>,
    /// A report (index.html, trade.svg, trade.json) into this folder, made if absent
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Say whether an earlier sweep (a report's trade.json) found the same front within noise
    #[arg(long, value_name = "TRADE.json")]
    against: Option<PathBuf>,
    /// Put the setting that was found into the scene file; its comments stay
    #[arg(long, conflicts_with = "overrides")]
    write: bool,
    /// 30 runs of each time at least instead of 10; six times as many where a median is not known by then
    #[arg(long)]
    full: bool,
    /// Print everything measured as JSON
    #[arg(long)]
    json: bool,
    /// Pixels, WIDTHxHEIGHT; the scene's own otherwise
    #[arg(long, value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Override a key of the scene: -D view.camera=low
    #[arg(short = 'D', value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    #[command(flatten)]
    device: DeviceArgs,
}

fn parse_bound(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(bound) if (0.0..f64::INFINITY).contains(&bound) => Ok(bound),
        _ => Err("a bound is a number from 0 up, as in 0.002".into()),
    }
}

fn parse_knob(text: &str) -> Result<Knob, String> {
    let names = Knob::ALL.map(Knob::name);
    Knob::ALL.into_iter().find(|knob| knob.name() == text).ok_or_else(|| {
        format!("no such knob; nearest is {}", nearest(text, names.into_iter()).unwrap_or_default())
    })
}

pub fn run(args: &TradeArgs) -> anyhow::Result<()> {
    check(args)?;
    let earlier = args.against.as_deref().map(earlier).transpose()?;
    if let Some(folder) = &args.output {
        check_folder(folder)?;
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    // What no part of the sweep reads is checked, too.
    sections::load(&args.scene, &args.overrides)?;
    let effort = if args.full { Effort::Full } else { Effort::Quick };
    let mut bench = Bench::new(effort, args.device.device.clone(), PathBuf::new());
    bench.validate = args.device.validate;
    let sweep = Sweep {
        scene: &args.scene,
        overrides: &args.overrides,
        size: args.size,
        knobs: if args.knobs.is_empty() { &Knob::ALL } else { &args.knobs },
        measure: match args.error {
            ErrorName::Nmse => Measure::Nmse,
            ErrorName::Flip => Measure::Flip,
            ErrorName::Max => Measure::Max,
        },
    };
    let trade = sweep.run(&bench, |done, all| tracing::info!("{done} of {all} settings"))?;
    if let Some(first) = bench.messages().first() {
        bail!("Vulkan's validation layer spoke, first {}: {}", first.id, first.text);
    }
    let (found, answer) = answer(args, &trade);
    if let Some(folder) = &args.output {
        trade.write(folder, &answer)?;
        tracing::info!("the report is {}/index.html", folder.display());
    }
    print(args, &trade)?;
    if let Some(earlier) = &earlier {
        let same = Same::of(earlier, &trade).map_err(|why| anyhow!("--against: {why}"))?;
        same.lines().iter().try_for_each(|line| tell(args, line))?;
    }
    let Some(found) = found else { bail!("{answer}") };
    if !args.json {
        say(&answer)?;
    }
    if args.write {
        write_changes(Path::new(&args.scene), &found.changes, sections::check)?;
        tracing::info!("{}: {}", args.scene, told_changes(found));
    }
    Ok(())
}

/// An earlier sweep's report.
fn earlier(path: &Path) -> anyhow::Result<Trade> {
    let context = || format!("--against {}: no trade.json of this program", path.display());
    Trade::parse(&std::fs::read_to_string(path).with_context(context)?).with_context(context)
}

/// A line of the answer; where JSON has stdout, for people alone.
fn tell(args: &TradeArgs, line: &str) -> anyhow::Result<()> {
    if args.json {
        tracing::info!("{line}");
        return Ok(());
    }
    say(line)
}

/// Refuses what could not be written in the end, before anything is measured.
fn check(args: &TradeArgs) -> anyhow::Result<()> {
    if !args.write {
        return Ok(());
    }
    if args.max_error.is_none() && args.max_ms.is_none() {
        bail!(Usage("--write puts in what meets a bound: give --max-error or --max-ms".into()));
    }
    if SHIPPED.iter().any(|(name, _)| *name == args.scene) {
        bail!(Usage(format!(
            "--write: {0} is a shipped scene, inside the program; copy scenes/{0}.toml and give the copy",
            args.scene
        )));
    }
    Ok(())
}

/// The setting to choose, or none that meets the bound, and a line that says so.
fn answer<'a>(args: &TradeArgs, trade: &'a Trade) -> (Option<&'a Traded>, String) {
    let measure = &trade.measure;
    let told = |setting: &Traded| {
        format!(
            "{} ({:.2} ms, {measure} {:.2e}): {}",
            setting.name,
            setting.ms.median,
            setting.error,
            told_changes(setting)
        )
    };
    let front = trade.front();
    let (first, last) = (front.first().expect("the scene's own"), front.last().expect("the scene's own"));
    let count = trade.settings.len();
    match (args.max_error, args.max_ms) {
        (Some(bound), _) => match trade.cheapest(bound) {
            Some(found) => (Some(found), format!("cheapest with {measure} <= {bound}: {}", told(found))),
            None => (
                None,
                format!("none of {count} settings has {measure} <= {bound}; the best is {}", told(first)),
            ),
        },
        (None, Some(ms)) => match trade.most_accurate(ms) {
            Some(found) => (Some(found), format!("most accurate within {ms} ms: {}", told(found))),
            None => (
                None,
                format!("none of {count} settings takes at most {ms} ms; the fastest is {}", told(last)),
            ),
        },
        (None, None) => (Some(first), format!("{} of {count} settings are worth choosing", front.len())),
    }
}

fn told_changes(setting: &Traded) -> String {
    match &setting.changes[..] {
        [] => "nothing to change".into(),
        changes => changes.iter().map(|change| format!("-D {change}")).collect::<Vec<_>>().join(" "),
    }
}

/// The front, a line a setting.
fn print(args: &TradeArgs, trade: &Trade) -> anyhow::Result<()> {
    if args.json {
        return say(trade.json().trim_end());
    }
    let mut text = format!("{:>9}  {:>19}  {:>13}  setting", "ms", "p5 to p95", trade.measure);
    for setting in trade.front() {
        let spread = format!("{:.2} to {:.2}", setting.ms.p5, setting.ms.p95);
        let (ms, error) = (setting.ms.median, setting.error);
        write!(text, "\n{ms:>9.2}  {spread:>19}  {error:>13.3e}  {}", setting.name)?;
    }
    for setting in trade.incomplete() {
        let (ms, error, frames) = (setting.ms.median, setting.error, setting.list_frames);
        write!(
            text,
            "\nnot on the front: {} ({ms:.2} ms, {error:.3e}): incomplete list, whole after {frames} frames",
            setting.name
        )?;
    }
    for refused in &trade.refused {
        write!(text, "\nnot measured: {}: {}", refused.name, refused.why)?;
    }
    for budget in &trade.budgets {
        let (frames, seconds) = (budget.frames, budget.wall_ms / 1e3);
        let same = match budget.differing_bytes {
            0 => "the same settled picture".to_string(),
            bytes => format!("a settled picture that differs in {bytes} bytes"),
        };
        write!(text, "\n{}: {frames} frames, {seconds:.2} s to {same}", budget.changes.join(" "))?;
    }
    say(text)
}
