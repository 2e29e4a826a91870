//! `ortelius demo`: the paper's headline picture and its report, under out/.

use super::{render, say};
use anyhow::Context;
use clap::{Args, Parser};

#[derive(Args)]
pub struct DemoArgs {
    /// Part of a device's name, or its index
    #[arg(long, env = "ORTELIUS_DEVICE")]
    device: Option<String>,
}

/// `render`'s arguments by themselves.
#[derive(Parser)]
struct RenderLine {
    #[command(flatten)]
    args: render::RenderArgs,
}

/// Renders the shipped scene `earth` exactly as the command that it prints would.
pub fn run(args: &DemoArgs) -> anyhow::Result<()> {
    // The one folder that is ours to make: the demo says so in its help.
    std::fs::create_dir_all("out").context("out: the demo's folder cannot be made")?;
    let mut line = vec!["render", "earth", "--settle", "--compare-plain"];
    line.extend([
        "-o",
        "out/earth.png",
        "--report",
        "out/earth.json",
        "--dump-visible",
        "out/earth-tiles.csv",
    ]);
    if let Some(device) = &args.device {
        line.extend(["--device", device]);
    }
    tracing::info!("ortelius {}", line.join(" "));
    render::run(&RenderLine::try_parse_from(line)?.args)?;
    say("picture        out/earth.png")?;
    say("report         out/earth.json")?;
    say("visible tiles  out/earth-tiles.csv")
}
