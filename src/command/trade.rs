//! `ortelius trade`: time and error of a scene's settings, and the best choice.

use super::device::DeviceArgs;
use super::outputs::check_folder;
use super::progress::ProgressLine;
use super::request::parse_size;
use super::{Usage, bound, named, say};
use anyhow::{Context, anyhow, bail};
use clap::Args;
use ortelius::figure::{Bench, Effort, Same, TimedSetting, Trade};
use ortelius::file::{MAX_RESULTS_BYTES, read_text};
use ortelius::paper::virtual_texture::config::owner;
use ortelius::paper::virtual_texture::trade::{ErrorMeasure, Knob, TradeKernel, TradeSweep};
use ortelius::renderer::{sections, trade as plain};
use ortelius::scene::{SHIPPED, Scene, write_changes};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

const NUMBER: &str = "a number, 0 or more, for example 0.002";

#[derive(Args)]
pub struct TradeArgs {
    /// A scene file, or the name of a shipped scene
    scene: String,
    /// How errors are measured
    #[arg(long, value_parser = named(|_: ErrorMeasure| true), default_value = "nmse")]
    error: ErrorMeasure,
    /// How the reference weights the samples of a pixel. In the reference of a relief, all rays have the same weight
    #[arg(long, value_parser = named(|_: TradeKernel| true), default_value = "gaussian")]
    kernel: TradeKernel,
    /// Find the fastest setting with at most this error
    #[arg(long, value_name = "E", value_parser = bound(NUMBER), conflicts_with = "max_ms", allow_negative_numbers = true)]
    max_error: Option<f64>,
    /// Find the most accurate setting that takes at most this time
    #[arg(long, value_name = "T", value_parser = bound(NUMBER), allow_negative_numbers = true)]
    max_ms: Option<f64>,
    /// Vary only these; default: all. In a scene without a virtual texture, the filters of plain textures and the
    /// relief's method are varied instead
    #[arg(long, value_name = "KNOB,…", value_delimiter = ',', value_parser = named(|_: Knob| true))]
    knobs: Vec<Knob>,
    /// Write a report (index.html, trade.svg, trade.json) into this folder, created if absent
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Test whether an earlier sweep (a report's trade.json) found the same Pareto front within noise
    #[arg(long, value_name = "TRADE.json")]
    against: Option<PathBuf>,
    /// Write the chosen setting into the scene file; its comments are kept
    #[arg(long, conflicts_with = "overrides")]
    write: bool,
    /// Time each setting in at least 30 runs instead of 12. In both cases, settings with an uncertain median get more
    /// runs, up to six times as many
    #[arg(long)]
    full: bool,
    /// Print all measurements as JSON
    #[arg(long)]
    json: bool,
    /// Size of the picture in pixels, as WIDTHxHEIGHT; default: the scene's size
    #[arg(long, value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Use this camera of the scene
    #[arg(long)]
    camera: Option<String>,
    /// Override a key of the scene, for example -D cache.gpu_tiles=64
    #[arg(short = 'D', value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    #[command(flatten)]
    device: DeviceArgs,
}

pub fn run(args: &TradeArgs) -> anyhow::Result<()> {
    check(args)?;
    let earlier = args.against.as_deref().map(|path| read("--against", path)).transpose()?;
    if let Some(folder) = &args.output {
        check_folder(folder)?;
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot create the folder {}", folder.display()))?;
    }
    // Check the whole scene, including parts that the sweep does not use.
    let scene = sections::load(&args.scene, &args.overrides)?;
    if owner(&scene)?.is_none() && !args.knobs.is_empty() {
        bail!(Usage(format!("--knobs: {} has no virtual texture; omit --knobs", args.scene)));
    }
    let trade = measured(args, &scene)?;
    let (found, answer) = answer(args, &trade);
    if let Some(folder) = &args.output {
        trade.write(folder, &answer)?;
        tracing::info!("the report is {}/index.html", folder.display());
    }
    print(args, &trade)?;
    if let Some(earlier) = &earlier {
        let same = Same::of(earlier, &trade).map_err(|why| anyhow!("--against: {why}"))?;
        same.lines().iter().try_for_each(|line| print_answer(args, line))?;
    }
    let Some(found) = found else { bail!("{answer}") };
    if !args.json {
        say(&answer)?;
    }
    if args.write {
        write_changes(Path::new(&args.scene), &found.changes, sections::check)?;
        tracing::info!("{}: {}", args.scene, describe_changes(found));
    }
    Ok(())
}

fn measured(args: &TradeArgs, scene: &Scene) -> anyhow::Result<Trade> {
    let effort = if args.full { Effort::Full } else { Effort::Quick };
    let mut bench = Bench::new(effort, args.device.device.clone(), PathBuf::new());
    bench.validate = args.device.validate;
    let sweep = TradeSweep {
        scene,
        pose: match &args.camera {
            Some(name) => scene.camera(name)?.pose(),
            None => scene.pose(0)?,
        },
        size: args.size.unwrap_or([scene.view.width, scene.view.height]),
        knobs: if args.knobs.is_empty() { Knob::ALL } else { &args.knobs },
        measure: args.error,
        kernel: args.kernel,
    };
    let bar = ProgressLine::counting("settings");
    bar.phase("", None);
    let progress = |done, all| bar.set(done, all);
    let trade = match owner(scene)? {
        Some(_) => sweep.run(&bench, progress)?,
        None => plain::run(&sweep, None, &bench, progress)?,
    };
    drop(bar);
    if let Some(first) = bench.messages().first() {
        bail!("the Vulkan validation layer reported messages; first: {}: {}", first.id, first.text);
    }
    Ok(trade)
}

/// Reads an earlier sweep's report.
pub fn read(option: &str, path: &Path) -> anyhow::Result<Trade> {
    let context = || format!("{option} {}: not a trade.json of this program", path.display());
    Trade::parse(&read_text(path, MAX_RESULTS_BYTES).with_context(context)?).with_context(context)
}

/// Prints a line of the answer; on stderr if stdout is used for JSON.
fn print_answer(args: &TradeArgs, line: &str) -> anyhow::Result<()> {
    if args.json {
        tracing::info!("{line}");
        return Ok(());
    }
    say(line)
}

/// Refuses requests whose result could not be written. Called before anything is measured.
fn check(args: &TradeArgs) -> anyhow::Result<()> {
    if !args.write {
        return Ok(());
    }
    if args.max_error.is_none() && args.max_ms.is_none() {
        bail!(Usage("--write needs a bound: give --max-error or --max-ms".into()));
    }
    if SHIPPED.iter().any(|(name, _)| *name == args.scene) {
        bail!(Usage(format!(
            "--write: {0} is a shipped scene inside the program; copy scenes/{0}.toml and use the copy",
            args.scene
        )));
    }
    Ok(())
}

/// The chosen setting, or `None` if no setting meets the bound; and the line to print.
fn answer<'a>(args: &TradeArgs, trade: &'a Trade) -> (Option<&'a TimedSetting>, String) {
    let measure = &trade.measure;
    let described = |setting: &TimedSetting| {
        format!(
            "{} ({:.2} ms, {measure} {:.2e}): {}",
            setting.name,
            setting.ms.median,
            setting.error,
            describe_changes(setting)
        )
    };
    let front = trade.front();
    let (first, last) = (front.first().expect("the scene's own"), front.last().expect("the scene's own"));
    let count = trade.settings.len();
    match (args.max_error, args.max_ms) {
        (Some(bound), _) => match trade.cheapest(bound) {
            Some(found) => (Some(found), format!("cheapest with {measure} <= {bound}: {}", described(found))),
            None => (
                None,
                format!(
                    "none of {count} settings has {measure} <= {bound}; the best is {}",
                    described(first)
                ),
            ),
        },
        (None, Some(ms)) => match trade.most_accurate(ms) {
            Some(found) => (Some(found), format!("most accurate within {ms} ms: {}", described(found))),
            None => (
                None,
                format!("none of {count} settings takes at most {ms} ms; the fastest is {}", described(last)),
            ),
        },
        (None, None) => (Some(first), format!("{} of {count} settings are Pareto-optimal", front.len())),
    }
}

fn describe_changes(setting: &TimedSetting) -> String {
    match &setting.changes[..] {
        [] => "no changes".into(),
        changes => changes.iter().map(|change| format!("-D {change}")).collect::<Vec<_>>().join(" "),
    }
}

/// Prints the Pareto front, one line for each setting.
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
            "\nnot on the Pareto front: {} ({ms:.2} ms, {error:.3e}): incomplete list, complete after {frames} frames",
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
