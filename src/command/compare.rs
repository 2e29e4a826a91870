//! `ortelius compare`: the difference between two pictures, with the measures that figures use.

use super::outputs::{check_place, ending};
use super::{Usage, bound, say};
use anyhow::{Context, bail};
use clap::Args;
use ortelius::header::JsonFormat;
use ortelius::picture::Picture;
use ortelius::picture::map::error_maps;
use ortelius::picture::measures::{Comparison, Measures, OUTLIER_BOUND};
use ortelius::picture::read::read;
use ortelius::picture::write::{Planes, write_exr, write_png};
use serde::Serialize;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Measures the difference between picture A and picture B, or the difference of each from a reference. All measures
/// except FLIP use linear light. Alpha is ignored; the number of pixels with different alpha is printed. Red, green and
/// blue are compared as stored. In an EXR, the colours are usually premultiplied by alpha; in a PNG, they never are.
#[derive(Args, Debug)]
pub struct CompareArgs {
    /// A picture, .png or .exr
    #[arg(value_name = "A")]
    a: PathBuf,
    /// A picture of the same size. Without --reference it counts as the truth
    #[arg(value_name = "B")]
    b: PathBuf,
    /// The truth, with which both A and B are compared
    #[arg(long, value_name = "R")]
    reference: Option<PathBuf>,
    /// Write an error map: .png in false colours from 1e-5 to 1 (A left of B), or .exr with absolute differences and
    /// FLIP
    #[arg(short, long, value_name = "DIFF")]
    output: Option<PathBuf>,
    /// A pixel is an outlier if the error of any channel exceeds this; default: 5/256
    #[arg(long, value_name = "ERROR", default_value_t = OUTLIER_BOUND, hide_default_value = true, value_parser = bound("a number of linear light, 0 or more, for example 0.02"), allow_negative_numbers = true)]
    outliers_above: f64,
    /// Print JSON. Values that are not finite are null: the PSNR of equal pictures, the error of a pixel that is not
    /// finite
    #[arg(long)]
    json: bool,
}

/// In version 1, this JSON was only the list of comparisons.
const FORMAT: JsonFormat = JsonFormat::new("ortelius-comparison", 2);

#[derive(Serialize)]
struct Measured {
    picture: PathBuf,
    truth: PathBuf,
    /// Number of pixels whose alpha differs. No measure includes alpha.
    alpha_differs: usize,
    #[serde(flatten)]
    measures: Measures,
}

pub fn run(args: &CompareArgs) -> anyhow::Result<()> {
    let output = args.output.as_deref().map(check_output).transpose()?;
    let pictures: &[&Path] = if args.reference.is_some() { &[&args.a, &args.b] } else { &[&args.a] };
    let truth_path = args.reference.as_deref().unwrap_or(&args.b);
    for path in pictures.iter().copied().chain([truth_path]) {
        if !["png", "exr"].contains(&ending(path)) {
            bail!(Usage(format!("{}: the file name of a picture must end in .png or .exr", path.display())));
        }
        // The map would overwrite its own input.
        if output.as_deref() == Some(path) {
            bail!(Usage(format!(
                "{} is an input and would be overwritten; choose another name for -o",
                path.display()
            )));
        }
    }
    let truth = read(truth_path)?;
    let mut comparisons = Vec::new();
    let mut measured = Vec::new();
    for path in pictures {
        let context = || format!("{} and {}", path.display(), truth_path.display());
        let picture = read(path)?;
        let comparison = Comparison::of(&picture, &truth).with_context(context)?;
        measured.push(Measured {
            picture: path.to_path_buf(),
            truth: truth_path.to_path_buf(),
            alpha_differs: picture.rgba.iter().zip(&truth.rgba).filter(|(a, b)| a[3] != b[3]).count(),
            measures: comparison.measures(args.outliers_above),
        });
        comparisons.push(comparison);
    }
    if let Some(output) = &output {
        write_map(output, &truth, &comparisons)?;
    }
    if args.json {
        let list = FORMAT.head(json!({ "comparisons": measured }));
        return say(serde_json::to_string_pretty(&list)?);
    }
    print(&measured)
}

fn check_output(path: &Path) -> anyhow::Result<PathBuf> {
    if !["png", "exr"].contains(&ending(path)) {
        bail!(Usage(format!("{}: the name must end in .png or .exr", path.display())));
    }
    check_place(path)
}

fn write_map(path: &Path, truth: &Picture, comparisons: &[Comparison]) -> anyhow::Result<()> {
    let size = [truth.width, truth.height];
    if ending(path) == "png" {
        let differences: Vec<_> = comparisons.iter().map(|comparison| &comparison.difference).collect();
        return Ok(write_png(path, &error_maps(size, &differences))?);
    }
    // A single comparison has plain channel names, which every viewer shows as a picture; two comparisons become
    // layers.
    let layers: &[&str] = if comparisons.len() == 1 { &[""] } else { &["A.", "B."] };
    let mut channels = BTreeMap::new();
    for (layer, comparison) in layers.iter().zip(comparisons) {
        for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
            channels
                .insert(format!("{layer}{name}"), comparison.absolute.iter().map(|pixel| pixel[c]).collect());
        }
        channels.insert(format!("{layer}FLIP"), comparison.flip.values.clone());
    }
    Ok(write_exr(path, &Planes { width: size[0], height: size[1], channels })?)
}

/// Prints one column for each comparison.
fn print(measured: &[Measured]) -> anyhow::Result<()> {
    let row = |name: &str, value: &dyn Fn(&Measures) -> String| {
        let values: Vec<String> = measured.iter().map(|m| format!("{:<24}", value(&m.measures))).collect();
        say(format!("{name:<14}{}", values.join("  ")).trim_end())
    };
    for (name, m) in ["A", "B"].iter().zip(measured) {
        say(format_args!("{name}: {} against {}", m.picture.display(), m.truth.display()))?;
    }
    row("NMSE", &|m| format!("{:.3e}", m.nmse))?;
    row("PSNR", &|m| format!("{:.2} dB", m.psnr_db))?;
    row("FLIP", &|m| format!("{:.4}, worst {:.4}", m.flip_mean, m.flip_worst))?;
    row("worst pixel", &|m| {
        m.worst.map_or("none".into(), |worst| format!("{:.5} at ({}, {})", worst.value, worst.x, worst.y))
    })?;
    let bound = measured.first().map_or(0.0, |m| m.measures.outlier_bound);
    row(&format!("above {bound:.5}"), &|m| format!("{} of {} pixels", m.outliers, m.pixels))?;
    if measured.iter().any(|m| m.measures.not_finite > 0) {
        row("not finite", &|m| format!("{} pixels", m.not_finite))?;
    }
    if measured.iter().any(|m| m.alpha_differs > 0) {
        let words = |m: &Measured| format!("{:<24}", format!("ignored, {} pixels differ", m.alpha_differs));
        let words = measured.iter().map(words).collect::<Vec<_>>().join("  ");
        say(format!("{:<14}{words}", "alpha").trim_end())?;
    }
    Ok(())
}
