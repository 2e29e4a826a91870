//! `ortelius render`: renders a scene to a picture, with a report.

use super::Usage;
use super::device::DeviceArgs;
use super::explain::explain;
use super::outputs::{Outputs, write_visible};
use super::progress::ProgressLine;
use super::records::Lines;
use super::request::{RunArgs, RunRequest};
use anyhow::{Context, bail};
use clap::Args;
use ortelius::frame::{Records, View};
use ortelius::math::camera::Pose;
use ortelius::paper::virtual_texture::PlainComparison;
use ortelius::paper::virtual_texture::config::{TextureError, owner, with_one_sample};
use ortelius::renderer::report::Report;
use ortelius::renderer::{Options, RenderError, Renderer};
use ortelius::scene::Scene;
use ortelius::scene::path::FRAMES_PER_SECOND;
use ortelius::texture::source::TileFormat;
use std::path::PathBuf;

#[derive(Args)]
pub struct RenderArgs {
    /// Write the picture: .png (sRGB) or .exr (linear light). With {frame} in the name, write every frame, then the
    /// settled frame
    #[arg(short, long, value_name = "PICTURE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    pub(super) run: RunArgs,
    /// Compare the time of the settled frame with the time of a frame with one plain texture on the same mesh. Both
    /// frames take one trilinear sample per pixel. Not for bc1 tiles
    #[arg(long)]
    compare_plain: bool,
    #[command(flatten)]
    pub(super) device: DeviceArgs,
    /// Write all measurements as JSON, with the data needed to repeat the run
    #[arg(long, value_name = "JSON")]
    report: Option<PathBuf>,
    /// Write a header, then one line of JSON for each frame as soon as the frame has ended
    #[arg(long, value_name = "JSONL")]
    records: Option<PathBuf>,
    /// Write the visible tiles as CSV: frame,q,i,j (the tile's level q, row i and column j)
    #[arg(long, value_name = "CSV")]
    dump_visible: Option<PathBuf>,
    /// Write an EXR of the last frame with 32-bit float channels for each pixel: texture coordinates s and t, their
    /// derivatives, the level q, and the tile's row i and column j
    #[arg(long, value_name = "EXR")]
    dump_footprint: Option<PathBuf>,
    /// Exit with code 3 if a tile could not be read. By default, a coarser tile is shown, with a warning
    #[arg(long)]
    strict: bool,
    /// Print the device features, passes and memory that the scene needs
    #[arg(long)]
    explain: bool,
}

/// Tiles of the texture that could not be read.
#[derive(Debug, thiserror::Error)]
#[error("{tiles} tiles could not be read and are shown coarser; `ortelius verify` checks a tile file")]
pub struct Unreadable {
    tiles: usize,
}

pub fn run(args: &RenderArgs) -> anyhow::Result<()> {
    let outputs = Outputs::check(
        args.output.as_deref(),
        args.report.as_deref(),
        args.dump_visible.as_deref(),
        args.dump_footprint.as_deref(),
        args.records.as_deref(),
    )?;
    if !outputs.any() && !args.explain {
        bail!(Usage(args.run.of.nothing_to_write()?));
    }
    let request = RunRequest::of(&args.run, &args.device, outputs.target())?;
    if args.compare_plain && !request.settles() {
        bail!(Usage("--compare-plain measures the settled frame: add --settle, or omit --frames".into()));
    }
    check_options(args, &request.scene, &outputs)?;
    let poses = request.poses()?;
    let mut renderer = open(args, &request)?;
    if args.explain {
        explain(&renderer)?;
    }
    if !outputs.any() {
        return Ok(());
    }
    let lines = outputs.records().map(Lines::create).transpose()?;
    // Only outputs with data of every frame need all records.
    let records = if outputs.of_all_frames() { Records::all() } else { Records::last_ones(1) };
    renderer.keep(match &lines {
        Some(lines) => lines.tap(records),
        None => records,
    });
    if request.run.path.is_some() {
        renderer.frame_seconds = 1.0 / f64::from(FRAMES_PER_SECOND);
    }
    let frames = run_frames(&request, &mut renderer, &poses, &outputs)?;
    lines.map_or(Ok(()), Lines::finish)?;
    let last = poses.last().expect("there is at least one pose");
    outputs.write_last(&mut renderer, request.settles().then_some(frames))?;
    if let Some(path) = outputs.visible() {
        // With --settle, only the last frame is written, which is the settled frame.
        write_visible(path, &renderer.records, request.settles())?;
    }
    outputs.write_footprint(&renderer)?;
    let plain = compare_plain(args, &request, &renderer, last);
    let mut report = Report::of(&renderer, &args.run.of.scene, request.eye(), plain);
    report.run = Some(request.run);
    outputs.write_report(&report)?;
    check_run(args, &renderer)
}

/// Reports unreadable tiles and validation messages.
fn check_run(args: &RenderArgs, renderer: &Renderer) -> anyhow::Result<()> {
    let texture = renderer.records.last().and_then(|record| record.texture.as_ref());
    let unreadable = Unreadable { tiles: texture.map_or(0, |texture| texture.streaming.failed_tiles) };
    if unreadable.tiles > 0 {
        if args.strict {
            return Err(unreadable.into());
        }
        tracing::info!("{unreadable}");
    }
    let messages = renderer.gpu.messages();
    match messages.first() {
        Some(first) if args.device.validate => {
            bail!(
                "the Vulkan validation layer reported {} messages; first: {}: {}",
                messages.len(),
                first.id,
                first.text
            )
        }
        _ => Ok(()),
    }
}

/// Refuses options that need a virtual texture if the scene has none.
fn check_options(args: &RenderArgs, scene: &Scene, outputs: &Outputs) -> anyhow::Result<()> {
    let option = outputs.of_a_texture().or(args.compare_plain.then_some("--compare-plain"));
    match (owner(scene)?, option) {
        (None, Some(option)) => {
            bail!(Usage(format!(
                "{option}: scene {} has no virtual texture; omit the option",
                args.run.of.scene
            )))
        }
        _ => Ok(()),
    }
}

/// `--compare-plain`, after the picture is written, so that an error here costs only the comparison.
fn compare_plain(
    args: &RenderArgs,
    request: &RunRequest,
    renderer: &Renderer,
    pose: &Pose,
) -> Option<PlainComparison> {
    if !args.compare_plain {
        return None;
    }
    let gpu = &renderer.gpu;
    // The plain texture takes one sample per pixel, so the scene must too; its own filter may take many.
    let compared = || -> anyhow::Result<_> {
        let scene = with_one_sample(&request.scene)?;
        let mut sampled_once = Renderer::on(gpu, &scene, &options(args, request))?;
        sampled_once.settle(pose)?;
        sampled_once.drain()?;
        let target = sampled_once.target().clone();
        let texture = sampled_once.technique.texture.as_mut().context("no virtual texture")?;
        Ok(texture.compare_plain(gpu, &View::new(pose, target.size()), &target)?)
    };
    match compared() {
        Ok(Some(plain)) => {
            let (settled_ms, plain_ms) =
                (plain.settled_frame_ns.median / 1e6, plain.plain_frame_ns.median / 1e6);
            let ratio = plain.settled_over_plain.median;
            tracing::info!(
                "one trilinear sample per pixel: settled frame {settled_ms:.2} ms, plain frame {plain_ms:.2} ms: {ratio:.2}x"
            );
            Some(plain)
        }
        Ok(None) => {
            tracing::warn!("{} has no timestamps, so --compare-plain is skipped", gpu.physical().name);
            None
        }
        Err(error) => {
            tracing::warn!("--compare-plain is skipped: {error:#}");
            None
        }
    }
}

fn options<'a>(args: &'a RenderArgs, request: &RunRequest) -> Options<'a> {
    Options {
        target: request.target(),
        size: Some(request.run.size),
        device: args.device.device.as_deref(),
        validate: args.device.validate,
        deterministic: request.run.deterministic,
        stop: None,
    }
}

fn open(args: &RenderArgs, request: &RunRequest) -> anyhow::Result<Renderer> {
    let named = |error| match error {
        RenderError::Texture(TextureError::Scene(error)) => error.into(),
        RenderError::Texture(error @ TextureError::Differs { .. }) => error.into(),
        // Errors of a texture file do not name the scene.
        RenderError::Texture(_) => anyhow::Error::new(error).context(format!("scene {}", args.run.of.scene)),
        error => error.into(),
    };
    let renderer = Renderer::open(&request.scene, &options(args, request)).map_err(named)?;
    if let Some(texture) = &renderer.technique.texture
        && args.compare_plain
        && texture.source.format() != TileFormat::Rgba8
    {
        let what = "--compare-plain: a bc1 texture has no level in RGBA8 to compare with";
        bail!(Usage(format!("{what} ({}); bake it with --format rgba8", texture.source.describe())));
    }
    Ok(renderer)
}

/// Renders the sequence, then settles if requested. Returns the sequence's length.
fn run_frames(
    request: &RunRequest,
    renderer: &mut Renderer,
    poses: &[Pose],
    outputs: &Outputs,
) -> anyhow::Result<usize> {
    // Without --frames, a single camera only has to settle; a path is rendered first.
    let sequence = if request.run.frames.is_some() || poses.len() > 1 { poses } else { &[] };
    let bar = (sequence.len() > 1).then(|| ProgressLine::counting("frames"));
    if let Some(bar) = &bar {
        bar.phase("", Some(sequence.len() as u64));
    }
    for (frame, pose) in sequence.iter().enumerate() {
        match request.run.settle_each {
            true => drop(renderer.settle(pose)?),
            false => renderer.frame(pose)?,
        }
        outputs.write_frame(renderer, frame)?;
        bar.iter().for_each(|bar| bar.advance(1));
    }
    drop(bar);
    if sequence.len() > 1 && outputs.only_the_last() {
        tracing::info!(
            "{} frames; the picture shows the last pose (put {{frame}} in its name to write every frame)",
            sequence.len()
        );
    }
    if request.settles() {
        let frames = renderer.settle(poses.last().expect("there is at least one pose"))?;
        if let Some(texture) = &renderer.technique.texture {
            tracing::info!("settled after {frames} frames, level bias {}", texture.bias());
        }
    }
    renderer.drain()?;
    Ok(sequence.len())
}
