//! `ortelius demo`: three of a paper's figures and three pictures, under out/: the globe, the valley, and the headline
//! frame with its report.

use super::{render, reproduce, say};
use anyhow::Context;
use clap::{Args, Parser};
use std::ffi::OsString;

/// What the paper is about, in minutes: what the frame costs, what the keying does, and what happens at extremes.
const FIGURES: [&str; 3] = ["vt.pipeline", "vt.keying", "vt.extremes"];

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

/// `reproduce`'s arguments by themselves.
#[derive(Parser)]
struct ReproduceLine {
    #[command(flatten)]
    args: reproduce::ReproduceArgs,
}

/// The pictures, each by the command line that makes it.
const PICTURES: [&[&str]; 3] = [
    &["globe", "-o", "out/globe.png"],
    &["valley", "-o", "out/valley.png"],
    &[
        "earth",
        "--settle",
        "--compare-plain",
        "-o",
        "out/earth.png",
        "--report",
        "out/earth.json",
        "--dump-visible",
        "out/earth-tiles.csv",
    ],
];

/// Measures and renders exactly as the commands that it prints would.
pub fn run(args: &DemoArgs) -> anyhow::Result<()> {
    // The one folder that is ours to make: the demo says so in its help.
    std::fs::create_dir_all("out").context("out: the demo's folder cannot be made")?;
    let device: Vec<&str> = args.device.iter().flat_map(|device| ["--device", device]).collect();
    // What an earlier demo of the same program measured is kept.
    let reproduce = [&["reproduce"], &FIGURES[..], &["--quick", "--resume", "-o", "out"], &device].concat();
    tracing::info!("ortelius {}", reproduce.join(" "));
    let line: Vec<OsString> = reproduce.iter().map(OsString::from).collect();
    reproduce::run(&ReproduceLine::try_parse_from(reproduce)?.args, &line)?;
    for picture in PICTURES {
        let render = [&["render"], picture, &device].concat();
        tracing::info!("ortelius {}", render.join(" "));
        render::run(&RenderLine::try_parse_from(render)?.args)?;
    }
    say("figures        out/index.html")?;
    say("report         out/earth.json")?;
    say("visible tiles  out/earth-tiles.csv")?;
    say("pictures       out/globe.png, out/valley.png, out/earth.png")
}

#[cfg(test)]
mod tests {
    use super::*;
    use ortelius::figure::choose;
    use ortelius::paper::FAMILIES;

    #[test]
    fn the_demos_figures_are_there() {
        let names = FIGURES.map(String::from);
        let found = choose(&FAMILIES, &names).unwrap_or_else(|unknown| panic!("{unknown}"));
        assert_eq!(found.iter().map(|figure| figure.id).collect::<Vec<_>>(), FIGURES);
    }
}
