//! `ortelius render`: a scene becomes a picture, with a report.

use super::Usage;
use super::asked::{Asked, RunArgs};
use super::device::DeviceArgs;
use super::explain::explain;
use super::outputs::{Outputs, write_visible};
use super::records::Lines;
use anyhow::bail;
use clap::Args;
use ortelius::frame::{Records, View};
use ortelius::math::camera::Pose;
use ortelius::paper::virtual_texture::PlainComparison;
use ortelius::paper::virtual_texture::config::{TextureError, owner};
use ortelius::renderer::report::Report;
use ortelius::renderer::{Options, RenderError, Renderer};
use ortelius::scene::Scene;
use ortelius::texture::source::TileFormat;
use std::path::PathBuf;

#[derive(Args)]
pub struct RenderArgs {
    /// The picture: .png (sRGB) or .exr (linear light). With {frame} in its name every frame is written, and
    /// the settled one after them
    #[arg(short, long, value_name = "PICTURE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    run: RunArgs,
    /// Measure the settled frame against the same mesh with one plain trilinear texture (not of bc1 tiles)
    #[arg(long)]
    compare_plain: bool,
    #[command(flatten)]
    device: DeviceArgs,
    /// Everything measured, and what it takes to render the same again, as JSON
    #[arg(long, value_name = "JSON")]
    report: Option<PathBuf>,
    /// Each frame's record as a line of JSON, as soon as the frame has ended
    #[arg(long, value_name = "JSONL")]
    records: Option<PathBuf>,
    /// Visible tiles as CSV: frame,q,i,j (native rows and columns)
    #[arg(long, value_name = "CSV")]
    dump_visible: Option<PathBuf>,
    /// s, t, derivatives, q, i, j of the last frame's pixels, 32-bit float channels
    #[arg(long, value_name = "EXR")]
    dump_footprint: Option<PathBuf>,
    /// Exit with 3 if a tile could not be read; without it a coarser tile is shown and a warning printed
    #[arg(long)]
    strict: bool,
    /// Print the device features, passes and memory that the scene asks for
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
        bail!(Usage("nothing to write: give -o PICTURE, --report, a dump, or --explain".into()));
    }
    let asked = Asked::of(&args.run, outputs.target())?;
    if args.compare_plain && !asked.settles() {
        bail!(Usage(
            "--compare-plain measures the settled frame: add --settle, or leave out --frames".into()
        ));
    }
    check_options(args, &asked.scene, &outputs)?;
    let poses = asked.poses()?;
    let mut renderer = open(args, &asked)?;
    if args.explain {
        explain(&renderer)?;
    }
    if !outputs.any() {
        return Ok(());
    }
    let lines = outputs.records().map(Lines::create).transpose()?;
    // Only a file that holds every frame needs every frame's record.
    let records = if outputs.of_all_frames() { Records::all() } else { Records::last_ones(1) };
    renderer.keep(match &lines {
        Some(lines) => lines.tap(records),
        None => records,
    });
    let frames = run_frames(&asked, &mut renderer, &poses, &outputs)?;
    lines.map_or(Ok(()), Lines::finish)?;
    let last = poses.last().expect("there is at least one pose");
    outputs.write_last(&mut renderer, asked.settles().then_some(frames))?;
    if let Some(path) = outputs.visible() {
        // --settle: the settled frame alone; it is the last one.
        write_visible(path, &renderer.records, asked.settles())?;
    }
    outputs.write_footprint(&renderer)?;
    let plain = compare_plain(args, &mut renderer, last);
    let mut report = Report::of(&renderer, &args.run.of.scene, asked.eye(), plain);
    report.run = Some(asked.run);
    outputs.write_report(&report)?;
    check_run(args, &renderer)
}

/// Reports unreadable tiles and messages of the validation layer.
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
            bail!(Usage(format!(
                "{option}: scene {} has no virtual texture; leave it out",
                args.run.of.scene
            )))
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

fn open(args: &RenderArgs, asked: &Asked) -> anyhow::Result<Renderer> {
    let options = Options {
        target: asked.target(),
        size: Some(asked.run.size),
        device: args.device.device.as_deref(),
        validate: args.device.validate,
        deterministic: asked.run.deterministic,
    };
    let named = |error| match error {
        RenderError::Texture(TextureError::Scene(error)) => error.into(),
        RenderError::Texture(error @ TextureError::Differs { .. }) => error.into(),
        // A texture's file does not say which scene asks for it.
        RenderError::Texture(_) => anyhow::Error::new(error).context(format!("scene {}", args.run.of.scene)),
        error => error.into(),
    };
    let renderer = Renderer::open(&asked.scene, &options).map_err(named)?;
    if let Some(texture) = &renderer.technique.texture
        && args.compare_plain
        && texture.source.format() != TileFormat::Rgba8
    {
        let what = "--compare-plain: a bc1 texture has no level in RGBA8 to compare with";
        bail!(Usage(format!("{what} ({}); bake it with --format rgba8", texture.source.describe())));
    }
    Ok(renderer)
}

/// Renders the sequence, then until nothing is missing, as asked. Returns the sequence's length.
fn run_frames(
    asked: &Asked,
    renderer: &mut Renderer,
    poses: &[Pose],
    outputs: &Outputs,
) -> anyhow::Result<usize> {
    // Without --frames a single camera only has to settle; a path is run through first.
    let sequence = if asked.run.frames.is_some() || poses.len() > 1 { poses } else { &[] };
    for (frame, pose) in sequence.iter().enumerate() {
        match asked.run.settle_each {
            true => drop(renderer.settle(pose)?),
            false => renderer.frame(pose)?,
        }
        outputs.write_frame(renderer, frame)?;
    }
    if sequence.len() > 1 && outputs.only_the_last() {
        tracing::info!(
            "{} frames; the picture is that of the last pose ({{frame}} in its name writes each)",
            sequence.len()
        );
    }
    if asked.settles() {
        let frames = renderer.settle(poses.last().expect("there is at least one pose"))?;
        if let Some(texture) = &renderer.technique.texture {
            tracing::info!("settled after {frames} frames, level bias {}", texture.bias());
        }
    }
    renderer.drain()?;
    Ok(sequence.len())
}
