//! `ortelius render`: a scene becomes a picture, with a report.

use super::device::DeviceArgs;
use super::outputs::{Outputs, write_visible};
use super::{Usage, say};
use anyhow::bail;
use clap::Args;
use ortelius::frame::{Records, Technique, View};
use ortelius::math::camera::Pose;
use ortelius::paper::virtual_texture::PlainComparison;
use ortelius::paper::virtual_texture::config::owner;
use ortelius::renderer::report::Report;
use ortelius::renderer::{Options, RenderError, Renderer, sections};
use ortelius::scene::Scene;
use ortelius::texture::source::TileFormat;
use std::path::PathBuf;

#[derive(Args)]
pub struct RenderArgs {
    /// A scene file, or the name of a shipped scene: earth, globe, pole, antimeridian, plane, ruler, bunny,
    /// herd, valley
    scene: String,
    /// The picture: .png (sRGB) or .exr (linear light). With {frame} in its name every frame is written, and
    /// the settled one after them
    #[arg(short, long, value_name = "PICTURE")]
    output: Option<PathBuf>,
    /// Pixels, WIDTHxHEIGHT; the scene's own otherwise
    #[arg(long, value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// One of the scene's cameras
    #[arg(long, conflicts_with = "path")]
    camera: Option<String>,
    /// One of the scene's paths
    #[arg(long)]
    path: Option<String>,
    /// Render so many frames; without it: until nothing is missing
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    frames: Option<u32>,
    /// After --frames, go on from the last pose until nothing is missing
    #[arg(long)]
    settle: bool,
    /// Budgets count tiles and faces instead of time: the same frames on every run
    #[arg(long)]
    deterministic: bool,
    /// Measure the settled frame against the same mesh with one plain trilinear texture (not of bc1 tiles)
    #[arg(long)]
    compare_plain: bool,
    /// Override a key of the scene: -D variant.keying=native
    #[arg(short = 'D', value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    #[command(flatten)]
    device: DeviceArgs,
    /// Everything measured, as JSON
    #[arg(long, value_name = "JSON")]
    report: Option<PathBuf>,
    /// Visible tiles as CSV: frame,q,i,j (native rows and columns)
    #[arg(long, value_name = "CSV")]
    dump_visible: Option<PathBuf>,
    /// s, t, derivatives, q, i, j of the last frame's pixels, 32-bit float channels
    #[arg(long, value_name = "EXR")]
    dump_footprint: Option<PathBuf>,
    /// Print the device features, passes and memory that the scene asks for
    #[arg(long)]
    explain: bool,
}

pub(super) fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let parsed = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match parsed {
        Some(size @ [1..=16384, 1..=16384]) => Ok(size),
        _ => Err("a size is WIDTHxHEIGHT in pixels, 1 to 16384 each, as in 1920x1080".into()),
    }
}

impl RenderArgs {
    /// Whether the run ends with frames until nothing is missing.
    fn settles(&self) -> bool {
        self.settle || self.frames.is_none()
    }
}

pub fn run(args: &RenderArgs) -> anyhow::Result<()> {
    let outputs = Outputs::check(
        args.output.as_deref(),
        args.report.as_deref(),
        args.dump_visible.as_deref(),
        args.dump_footprint.as_deref(),
    )?;
    if !outputs.any() && !args.explain {
        bail!(Usage("nothing to write: give -o PICTURE, --report, a dump, or --explain".into()));
    }
    if args.compare_plain && !args.settles() {
        bail!(Usage(
            "--compare-plain measures the settled frame: add --settle, or leave out --frames".into()
        ));
    }
    let scene = sections::load(&args.scene, &args.overrides)?;
    check_options(args, &scene, &outputs)?;
    let (poses, view_name) = poses(args, &scene)?;
    let mut renderer = open(args, &scene, &outputs)?;
    if args.explain {
        explain(&renderer)?;
    }
    if !outputs.any() {
        return Ok(());
    }
    let frames = run_frames(args, &mut renderer, &poses, &outputs)?;
    let last = poses.last().expect("there is at least one pose");
    outputs.write_last(&mut renderer, args.settles().then_some(frames))?;
    if let Some(path) = outputs.visible() {
        // --settle: the settled frame alone; it is the last one.
        write_visible(path, &renderer.records, args.settles())?;
    }
    outputs.write_footprint(&renderer)?;
    let plain = compare_plain(args, &mut renderer, last);
    outputs.write_report(&Report::of(&renderer, &args.scene, &view_name, plain))?;
    let messages = renderer.gpu.messages();
    match messages.first() {
        Some(first) if args.device.validate => {
            bail!(
                "Vulkan's validation layer had {} messages, first {}: {}",
                messages.len(),
                first.id,
                first.text
            )
        }
        _ => Ok(()),
    }
}

/// Refuses what only a virtual texture has, where there is none.
fn check_options(args: &RenderArgs, scene: &Scene, outputs: &Outputs) -> anyhow::Result<()> {
    let option = outputs.of_a_texture().or(args.compare_plain.then_some("--compare-plain"));
    match (owner(scene)?, option) {
        (None, Some(option)) => {
            bail!(Usage(format!("{option}: scene {} has no virtual texture; leave it out", args.scene)))
        }
        _ => Ok(()),
    }
}

/// `--compare-plain`, once the picture is safe: what fails here costs only the comparison.
fn compare_plain(args: &RenderArgs, renderer: &mut Renderer, pose: &Pose) -> Option<PlainComparison> {
    if !args.compare_plain {
        return None;
    }
    let (gpu, target) = (renderer.gpu.clone(), renderer.target().clone());
    let texture = renderer.technique.texture.as_mut()?;
    match texture.compare_plain(&gpu, &View::new(pose, target.size()), &target) {
        Ok(Some(plain)) => {
            let (settled_ms, plain_ms) = (plain.settled.median / 1e6, plain.plain.median / 1e6);
            let ratio = plain.ratio.median;
            tracing::info!("settled frame {settled_ms:.2} ms, plain frame {plain_ms:.2} ms: {ratio:.2}x");
            Some(plain)
        }
        Ok(None) => {
            tracing::warn!("{} keeps no time: nothing is compared", gpu.physical().name);
            None
        }
        Err(error) => {
            tracing::warn!("nothing is compared: {error}");
            None
        }
    }
}

/// The run's poses in order, and the name that they have in the scene.
fn poses(args: &RenderArgs, scene: &Scene) -> anyhow::Result<(Vec<Pose>, String)> {
    let path = match (&args.path, &args.camera) {
        (Some(path), _) => Some(path.clone()),
        (None, Some(_)) => None,
        (None, None) => scene.view.path.clone(),
    };
    match path {
        Some(name) => {
            let path = scene.path(&name)?;
            let frames = args.frames.unwrap_or(path.frames);
            Ok(((0..frames).map(|frame| path.pose(frame)).collect(), name))
        }
        None => {
            let name = args.camera.clone().unwrap_or_else(|| scene.view.camera.clone());
            let pose = scene.camera(&name)?.pose();
            Ok((vec![pose; args.frames.unwrap_or(1) as usize], name))
        }
    }
}

fn open(args: &RenderArgs, scene: &Scene, outputs: &Outputs) -> anyhow::Result<Renderer> {
    let options = Options {
        target: outputs.target(),
        size: args.size,
        device: args.device.device.as_deref(),
        validate: args.device.validate,
        deterministic: args.deterministic,
    };
    let named = |error| match error {
        // A texture's file does not say which scene asks for it.
        RenderError::Texture(_) => anyhow::Error::new(error).context(format!("scene {}", args.scene)),
        error => error.into(),
    };
    let mut renderer = Renderer::open(scene, &options).map_err(named)?;
    if let Some(texture) = &renderer.technique.texture
        && args.compare_plain
        && texture.source.format() != TileFormat::Rgba8
    {
        let what = "--compare-plain: a bc1 texture has no level in RGBA8 to compare with";
        bail!(Usage(format!("{what} ({}); bake it with --format rgba8", texture.source.describe())));
    }
    // Only a file that holds every frame needs every frame's record.
    if !outputs.of_all_frames() {
        renderer.keep(Records::last_ones(1));
    }
    Ok(renderer)
}

/// Renders the sequence, then until nothing is missing, as asked. Returns the sequence's length.
fn run_frames(
    args: &RenderArgs,
    renderer: &mut Renderer,
    poses: &[Pose],
    outputs: &Outputs,
) -> anyhow::Result<usize> {
    // Without --frames a single camera only has to settle; a path is run through first.
    let sequence = if args.frames.is_some() || poses.len() > 1 { poses } else { &[] };
    for (frame, pose) in sequence.iter().enumerate() {
        renderer.frame(pose)?;
        outputs.write_frame(renderer, frame)?;
    }
    if args.settles() {
        let frames = renderer.settle(poses.last().expect("there is at least one pose"))?;
        if let Some(texture) = &renderer.technique.texture {
            tracing::info!("settled after {frames} frames, level bias {}", texture.bias());
        }
    }
    renderer.drain()?;
    Ok(sequence.len())
}

fn explain(renderer: &Renderer) -> anyhow::Result<()> {
    say(format_args!("device     {}", renderer.gpu.physical().name))?;
    for need in renderer.technique.needs() {
        say(format_args!("feature    {}: pass {:?}", need.feature.name(), need.pass))?;
    }
    for pass in renderer.technique.passes() {
        say(format_args!("pass       {pass}"))?;
    }
    for surface in renderer.technique.meshes.iter().flat_map(|meshes| &meshes.surfaces) {
        say(format_args!("instances  {}", surface.of_an_instance()))?;
    }
    for (name, bytes) in renderer.memory() {
        say(format_args!("memory     {name}: {bytes} bytes"))?;
    }
    Ok(())
}
