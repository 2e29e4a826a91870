//! `ortelius view`: a scene in a window.

use super::device::DeviceArgs;
use super::request::{RunRequest, SceneArgs};
use super::trade;
use crate::view::{self, OpenView, Variant, ViewOptions};
use clap::{Args, ValueEnum};
use ortelius::renderer::figures::shown;
use ortelius::vk::PresentMode;
use std::path::PathBuf;

#[derive(Args)]
pub struct ViewArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// A variant that Space switches to, as KEY=VALUE[,KEY=VALUE]; repeat for more. Default for a figure: its variants,
    /// if a scene's settings can express them. Default for a scene: its own settings, then other values of some keys.
    /// Virtual texture: the filter, its weight map, variant.dedup, variant.compact, variant.list, variant.request_draw.
    /// Mesh: geometry.apply, geometry.order. Relief: relief.method. Plain texture: filter.kind
    #[arg(long, value_name = "SETTINGS")]
    variant: Vec<String>,
    /// The presentation mode. Default: fifo. Measurements must not wait for the display:
    /// with --measure the default is immediate, or mailbox if immediate is not supported
    #[arg(long, value_enum)]
    present: Option<Present>,
    /// Add a slider through the Pareto-optimal settings of a trade.json (`ortelius trade -o`), from the least error to
    /// the least time
    #[arg(long, value_name = "TRADE.json")]
    trade: Option<PathBuf>,
    /// Show only the picture; F2 shows the panels
    #[arg(long)]
    no_panels: bool,
    /// Record the scene's path into the folder of -o, as R does, and close
    #[arg(long, conflicts_with = "measure")]
    record: bool,
    /// Measure along the scene's path, then close. Prints frame times with cold and warm caches, and with closed and
    /// open panels; then the frames from a key press to a changed picture. With a name, also write them as JSON
    #[arg(long, value_name = "JSON", num_args = 0..=1, require_equals = true)]
    measure: Option<Option<PathBuf>>,
    /// Number of frames in each of the four measurements of frame times, rounded up to a multiple of 24 [default: 120]
    #[arg(long, requires = "measure", value_parser = clap::value_parser!(u32).range(1..=24_000), allow_negative_numbers = true)]
    frames: Option<u32>,
    /// Folder of screenshots (F12) and recordings (R)
    #[arg(short, long, value_name = "FOLDER", default_value = ".")]
    output: PathBuf,
    #[command(flatten)]
    device: DeviceArgs,
}

#[derive(Clone, Copy, ValueEnum)]
enum Present {
    /// First in, first out, at the display's rate
    Fifo,
    /// The newest picture, at the display's rate
    Mailbox,
    /// At once; pictures may tear
    Immediate,
}

pub fn run(args: &ViewArgs) -> anyhow::Result<()> {
    let request = RunRequest::of_scene(&args.scene, &args.device)?;
    let views = match args.scene.views()? {
        views if views.is_empty() => vec![opened(args, "", &request)?],
        views => views_of_figure(args, views)?,
    };
    view::open(ViewOptions {
        name: shown::find(&args.scene.scene)
            .map_or_else(|| request.scene.name.clone(), |figure| figure.id.to_owned()),
        views,
        size: request.run.size,
        deterministic: request.run.deterministic,
        present: match (args.present, args.measure.is_some()) {
            (Some(Present::Fifo), _) | (None, false) => vec![PresentMode::Fifo],
            (Some(Present::Mailbox), _) => vec![PresentMode::Mailbox],
            (Some(Present::Immediate), _) => vec![PresentMode::Immediate],
            (None, true) => vec![PresentMode::Immediate, PresentMode::Mailbox],
        },
        panels: !args.no_panels,
        record: args.record,
        measure: args.measure.as_ref().map(|_| args.frames.map_or(view::STEPS, |frames| frames as usize)),
        times: args.measure.clone().flatten(),
        trade: args.trade.as_deref().map(|path| trade::read("--trade", path)).transpose()?,
        device: args.device.device.clone(),
        validate: args.device.validate,
        folder: args.output.clone(),
    })
}

/// A view with the variants of the command line, or else of the figure, or else of its scene.
fn opened(args: &ViewArgs, name: &str, request: &RunRequest) -> anyhow::Result<OpenView> {
    let of_line =
        |text: &String| Variant { name: text.clone(), changes: text.split(',').map(str::to_owned).collect() };
    let of_line: Vec<Variant> = args.variant.iter().map(of_line).collect();
    let settings = shown::find(&args.scene.scene).map(|figure| (figure.show.variants)()).unwrap_or_default();
    let of_figure = settings.into_iter().map(|setting| Variant {
        changes: shown::for_scene(&setting.changes, &request.scene),
        name: setting.name,
    });
    let variants = if of_line.is_empty() { of_figure.collect() } else { of_line };
    Ok(OpenView::new(name.to_owned(), request.scene.clone(), request.camera()?, variants))
}

/// All views of a figure. A view that does not fit the options of the command line is left out with a warning; an error
/// of the first view is returned.
fn views_of_figure(args: &ViewArgs, views: Vec<(String, SceneArgs)>) -> anyhow::Result<Vec<OpenView>> {
    let mut found = Vec::new();
    for (name, scene) in views {
        let request = RunRequest::of_scene(&scene, &args.device);
        let view = request.and_then(|request| {
            let view = opened(args, &name, &request)?;
            Ok(request.run.path.into_iter().fold(view, OpenView::along))
        });
        match view {
            Err(error) if !found.is_empty() => tracing::warn!("view {name} is left out: {error:#}"),
            view => found.push(view?),
        }
    }
    Ok(found)
}
