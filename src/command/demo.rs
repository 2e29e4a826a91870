//! `ortelius demo`: measures three figures and renders three pictures into out/: the globe, the valley, and
//! the headline frame with its report.

use super::{render, reproduce, say};
use anyhow::Context;
use clap::{Args, Parser};
use std::ffi::OsString;

/// The main results of paper 1 (virtual textures), measured within minutes: the cost of a frame, the effect of the
/// tile address, and inputs at the limits.
const FIGURES: [&str; 3] = ["vt.pipeline", "vt.address", "vt.extremes"];

#[derive(Args)]
pub struct DemoArgs {
    /// Part of a device's name, or its index
    #[arg(long, env = "ORTELIUS_DEVICE")]
    device: Option<String>,
}

/// Parses the arguments of `render`.
#[derive(Parser)]
struct RenderLine {
    #[command(flatten)]
    args: render::RenderArgs,
}

/// Parses the arguments of `reproduce`.
#[derive(Parser)]
struct ReproduceLine {
    #[command(flatten)]
    args: reproduce::ReproduceArgs,
}

/// The pictures, each with its command line.
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

/// Measures and renders exactly like the commands that it prints.
pub fn run(args: &DemoArgs) -> anyhow::Result<()> {
    // The folder is created if absent, as the help says.
    std::fs::create_dir_all("out").context("out: the demo's folder cannot be created")?;
    let device: Vec<&str> = args.device.iter().flat_map(|device| ["--device", device]).collect();
    // Results of an earlier demo of the same program are kept.
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
    use super::super::request::RunRequest;
    use super::*;
    use ortelius::figure::choose;
    use ortelius::renderer::figures::FAMILIES;

    #[test]
    fn the_demos_figures_are_there() {
        let names = FIGURES.map(String::from);
        let found = choose(&FAMILIES, &names).unwrap_or_else(|unknown| panic!("{unknown}"));
        assert_eq!(found.iter().map(|figure| figure.id).collect::<Vec<_>>(), FIGURES);
    }

    /// The number of frames of a picture's command line.
    fn frames(picture: &[&str]) -> anyhow::Result<usize> {
        let RenderLine { args } = RenderLine::try_parse_from([&["render"], picture].concat())?;
        Ok(RunRequest::of(&args.run, &args.device, None)?.poses()?.len())
    }

    #[test]
    fn the_demos_pictures_name_scenes_and_cameras_that_exist() {
        for picture in PICTURES {
            assert_eq!(frames(picture).unwrap(), 1, "{picture:?}");
        }
        for wrong in
            [["glob", "--camera", "africa"], ["globe", "--camera", "afrika"], ["globe", "--kamera", "africa"]]
        {
            assert!(frames(&wrong).is_err(), "{wrong:?}");
        }
    }
}
