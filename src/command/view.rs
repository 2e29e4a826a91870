//! `ortelius view`: a scene in a window.

use super::asked::{Asked, SceneArgs};
use super::device::DeviceArgs;
use crate::view::{self, Opening, Variant};
use clap::{Args, ValueEnum};
use ortelius::vk::PresentMode;
use std::path::PathBuf;

#[derive(Args)]
pub struct ViewArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Settings that Space switches to, as KEY=VALUE[,KEY=VALUE]; repeat it for more. Without it: the scene's own, and
    /// every other value of variant.dedup or of a mesh's geometry.apply
    #[arg(long, value_name = "SETTINGS")]
    variant: Vec<String>,
    /// When a finished picture replaces the one that is shown
    #[arg(long, value_enum, default_value_t = Present::Fifo)]
    present: Present,
    /// Only the picture; F2 shows the panels
    #[arg(long)]
    no_panels: bool,
    /// Where screenshots (F12) and recordings (R) go
    #[arg(short, long, value_name = "FOLDER", default_value = ".")]
    output: PathBuf,
    #[command(flatten)]
    device: DeviceArgs,
}

#[derive(Clone, Copy, ValueEnum)]
enum Present {
    /// In turn, at the display's rate
    Fifo,
    /// The newest, at the display's rate
    Mailbox,
    /// At once; the picture may tear
    Immediate,
}

pub fn run(args: &ViewArgs) -> anyhow::Result<()> {
    let asked = Asked::of_scene(&args.scene)?;
    let camera = asked.camera()?;
    let variant =
        |text: &String| Variant { name: text.clone(), changes: text.split(',').map(str::to_owned).collect() };
    view::open(Opening {
        camera,
        size: asked.run.size,
        deterministic: asked.run.deterministic,
        scene: asked.scene,
        variants: args.variant.iter().map(variant).collect(),
        present: match args.present {
            Present::Fifo => PresentMode::Fifo,
            Present::Mailbox => PresentMode::Mailbox,
            Present::Immediate => PresentMode::Immediate,
        },
        panels: !args.no_panels,
        device: args.device.device.clone(),
        validate: args.device.validate,
        folder: args.output.clone(),
    })
}
