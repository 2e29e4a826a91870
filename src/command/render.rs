//! `ortelius render`: a scene becomes a picture, with a report.

use super::outputs::{Outputs, write_visible};
use anyhow::{Context, bail};
use clap::Args;
use ortelius::math::camera::Pose;
use ortelius::paper::virtual_texture::NEEDS;
use ortelius::renderer::{Renderer, Settings, Target};
use ortelius::scene::{Scene, mesh};
use ortelius::vk::{Gpu, GpuOptions};
use std::path::PathBuf;

#[derive(Args)]
pub struct RenderArgs {
    /// A scene file, or the name of a shipped scene: earth, globe, pole, antimeridian, plane, ruler
    scene: String,
    /// The picture: .png (sRGB) or .exr (linear light). With {frame} in its name every frame is written
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
    #[arg(long)]
    frames: Option<u32>,
    /// After --frames, go on from the last pose until nothing is missing
    #[arg(long)]
    settle: bool,
    /// Budgets count tiles instead of time: the same frames on every run
    #[arg(long)]
    deterministic: bool,
    /// Measure the settled frame against the same mesh with one plain trilinear texture
    #[arg(long)]
    compare_plain: bool,
    /// Override a key of the scene: -D variant.keying=native
    #[arg(short = 'D', value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// Part of a device's name, or its index
    #[arg(long, env = "ORTELIUS_DEVICE")]
    device: Option<String>,
    /// Run with Vulkan's validation layer, synchronisation included
    #[arg(long)]
    validate: bool,
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

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let parsed = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match parsed {
        Some(size @ [1..=16384, 1..=16384]) => Ok(size),
        _ => Err("a size is WIDTHxHEIGHT in pixels, 1 to 16384 each, as in 1920x1080".into()),
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
        bail!(super::Usage("nothing to write: give -o PICTURE, --report, a dump, or --explain".into()));
    }
    let scene = Scene::load_with(&args.scene, &args.overrides)?;
    let (poses, view_name) = poses(args, &scene)?;
    let mut renderer = open(args, &scene, outputs.target())?;
    if args.explain {
        explain(&renderer);
    }
    if !outputs.any() {
        return Ok(());
    }
    run_frames(args, &mut renderer, &poses, &outputs)?;
    let last = poses.last().expect("there is at least one pose");
    let plain = match args.compare_plain {
        true => renderer.compare_plain(last)?,
        false => None,
    };
    if let Some(plain) = &plain {
        let (settled, plain_ms) = (plain.settled.median / 1e6, plain.plain.median / 1e6);
        tracing::info!("settled frame {settled:.2} ms, plain frame {plain_ms:.2} ms: {:.2}x", plain.ratio);
    }
    outputs.write_picture(&mut renderer, None)?;
    if let Some(path) = &args.dump_visible {
        // --settle: the settled frame alone; it is the last one.
        let only_last = args.settle || args.frames.is_none();
        write_visible(path, &renderer.records, only_last)?;
    }
    outputs.write_footprint(&mut renderer, last)?;
    let report = renderer.report(&args.scene, &view_name, plain);
    outputs.write_report(&report)
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
            Ok(((0..frames.max(1)).map(|frame| path.pose(frame)).collect(), name))
        }
        None => {
            let name = args.camera.clone().unwrap_or_else(|| scene.view.camera.clone());
            let pose = scene.camera(&name)?.pose();
            Ok((vec![pose; args.frames.unwrap_or(1).max(1) as usize], name))
        }
    }
}

fn open(args: &RenderArgs, scene: &Scene, target: Target) -> anyhow::Result<Renderer> {
    let options = GpuOptions { device: args.device.as_deref(), validate: args.validate, needs: &NEEDS };
    let gpu = Gpu::new(&options)?;
    tracing::info!("{}, {}", gpu.physical().name, gpu.physical().driver);
    let mut settings = Settings::of_scene(scene, target);
    settings.size = args.size.unwrap_or(settings.size);
    settings.streaming.deterministic = args.deterministic;
    let source = scene.open_texture().with_context(|| format!("scene {}", args.scene))?;
    Ok(Renderer::new(gpu, source, &mesh::gpu_mesh(&scene.source_mesh()?)?, settings)?)
}

fn run_frames(
    args: &RenderArgs,
    renderer: &mut Renderer,
    poses: &[Pose],
    outputs: &Outputs,
) -> anyhow::Result<()> {
    // Without --frames a single camera only has to settle; a path is run through first.
    if args.frames.is_some() || poses.len() > 1 {
        for (frame, pose) in poses.iter().enumerate() {
            renderer.frame(pose)?;
            outputs.write_picture(renderer, Some(frame))?;
        }
    }
    if args.settle || args.frames.is_none() {
        let frames = renderer.settle(poses.last().expect("there is at least one pose"))?;
        tracing::info!("settled after {frames} frames, level bias {}", renderer.bias());
    }
    Ok(renderer.drain()?)
}

fn explain(renderer: &Renderer) {
    println!("device     {}", renderer.gpu.physical().name);
    for need in NEEDS {
        println!("feature    {}: pass {:?}", need.feature.name(), need.pass);
    }
    for pass in renderer.pipeline.passes() {
        println!("pass       {pass}");
    }
    for (name, bytes) in renderer.memory() {
        println!("memory     {name}: {bytes} bytes");
    }
}
