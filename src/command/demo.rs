//! `ortelius demo`: the paper's headline picture with its report, and three of its figures, under out/.

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

/// Renders the shipped scene `earth` and measures, exactly as the two commands that it prints would.
pub fn run(args: &DemoArgs) -> anyhow::Result<()> {
    // The one folder that is ours to make: the demo says so in its help.
    std::fs::create_dir_all("out").context("out: the demo's folder cannot be made")?;
    let mut render = vec!["render", "earth", "--settle", "--compare-plain"];
    render.extend([
        "-o",
        "out/earth.png",
        "--report",
        "out/earth.json",
        "--dump-visible",
        "out/earth-tiles.csv",
    ]);
    // What an earlier demo of the same program measured stands.
    let mut reproduce = [&["reproduce"], &FIGURES[..], &["--quick", "--resume", "-o", "out"]].concat();
    if let Some(device) = &args.device {
        render.extend(["--device", device]);
        reproduce.extend(["--device", device]);
    }
    tracing::info!("ortelius {}", render.join(" "));
    render::run(&RenderLine::try_parse_from(render)?.args)?;
    say("picture        out/earth.png")?;
    say("report         out/earth.json")?;
    say("visible tiles  out/earth-tiles.csv")?;
    tracing::info!("ortelius {}", reproduce.join(" "));
    let line: Vec<OsString> = reproduce.iter().map(OsString::from).collect();
    reproduce::run(&ReproduceLine::try_parse_from(reproduce)?.args, &line)?;
    say("figures        out/index.html")
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
