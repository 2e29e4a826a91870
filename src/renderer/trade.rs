//! `ortelius trade` for a scene without a virtual texture: the filters of its plain textures, and the methods of its
//! relief.

use super::surface::relief;
use super::truth::SceneTruth;
use super::{Options, Renderer};
use crate::figure::{Bench, Contender, Machine, Trade};
use crate::paper::texture_mapping::config::ReliefMethod;
use crate::paper::texture_mapping::relief::surface::{MAX_WORK, work};
use crate::paper::virtual_texture::choices::{FilterEdge, FilterMap, Filtering};
use crate::paper::virtual_texture::config::{Filter, filter};
use crate::paper::virtual_texture::trade::{
    Batch, MAX_REPEATS, Mosaic, SweepPoint, TradeResult, TradeSweep, in_milliseconds,
};
use crate::picture::measures::{Comparison, OUTLIER_BOUND};
use crate::picture::write::Srgb8Picture;
use crate::scene::{Scene, Surface};
use crate::vk::Gpu;
use anyhow::Context;

/// Largest ratio of the ellipse's axes, and texels along its minor semi-axis.
const ELLIPSES: [(u32, f64); 6] = [(4, 1.0), (4, 2.0), (4, 4.0), (16, 1.0), (16, 2.0), (16, 4.0)];

/// Limits memory: each setting's renderer stays open, because the timed runs are interleaved.
const MAX_SETTINGS: usize = 64;

/// Rays along each side of a pixel of the reference.
const RAYS: u32 = 12;

/// Measures all settings of a scene without a virtual texture, or only the settings of the surface `only`. Ignores
/// `sweep.knobs`, which are for virtual textures. `progress` receives the number of settings done and the number of all
/// settings.
///
/// # Errors
/// A scene with nothing to vary, with more than `MAX_SETTINGS` settings, or without a reference; an unavailable
/// device, or a device without timestamps.
pub fn run(
    sweep: &TradeSweep<'_>,
    only: Option<&str>,
    bench: &Bench,
    progress: impl Fn(usize, usize),
) -> anyhow::Result<Trade> {
    let TradeSweep { scene, pose, size, measure, .. } = *sweep;
    let settings = settings(scene, only)?;
    anyhow::ensure!(
        settings.len() > 1,
        "scene {}: nothing to vary: it has no virtual texture, no plain texture with a filter, and no relief",
        scene.name
    );
    anyhow::ensure!(
        settings.len() <= MAX_SETTINGS,
        "scene {}: its surfaces have {} combinations of filters, but at most {MAX_SETTINGS} can be measured together; \
         measure a scene with fewer surfaces",
        scene.name,
        settings.len()
    );
    let gpu = bench.gpu(&[])?;
    let truth = mosaic(sweep)?;
    let (mut found, mut renderers) = (Vec::new(), Vec::new());
    for setting in &settings {
        let mut renderer = settled(sweep, &gpu, &setting.changes)?;
        let Srgb8Picture { rgba, .. } = renderer.picture()?;
        let measures = Comparison::of(&truth.cut(&rgba), &truth.picture)?.measures(OUTLIER_BOUND);
        found.push(TradeResult { setting: setting.clone(), measures, forced_bias: 0, list_frames: 1 });
        renderers.push(renderer);
        progress(found.len(), settings.len());
    }
    let contenders = settings.iter().zip(&mut renderers).map(|(setting, renderer)| Contender {
        variant: setting.name.clone(),
        run: Box::new(move || {
            renderer.frame(&pose)?;
            renderer.drain()?;
            Ok(renderer.records.last().context("a drained frame has a record")?.passes.clone())
        }),
    });
    let own = found.remove(0);
    let batch = Batch::time(bench, &gpu, measure, &found, contenders.collect())?;
    let (settings, drift_ms) = in_milliseconds(&own, vec![batch], measure);
    let mut trade = Trade {
        scene: scene.name.clone(),
        size,
        measure: measure.label().to_string(),
        truth: truth.describe(),
        machine: Machine::here(gpu.physical()),
        runs: bench.runs(),
        max_runs: MAX_REPEATS * bench.runs(),
        drift_ms,
        settings,
        refused: Vec::new(),
        budgets: Vec::new(),
    };
    trade.mark_front();
    Ok(trade)
}

fn settled(sweep: &TradeSweep<'_>, gpu: &Gpu, changes: &[String]) -> anyhow::Result<Renderer> {
    let options = Options { size: Some(sweep.size), deterministic: true, ..Options::default() };
    let mut renderer = Renderer::on(gpu, &sweep.scene.with(changes)?, &options)?;
    renderer.settle(&sweep.pose)?;
    renderer.drain()?;
    Ok(renderer)
}

/// All combinations of the surfaces' settings, the scene's own first.
fn settings(scene: &Scene, only: Option<&str>) -> anyhow::Result<Vec<SweepPoint>> {
    let mut all = vec![Vec::new()];
    for surface in scene.surfaces.values().filter(|surface| only.is_none_or(|only| only == surface.name)) {
        let others = others(scene, surface)?;
        all = all
            .into_iter()
            .flat_map(|one: Vec<[String; 2]>| {
                let with = others.iter().map(|other| [&one[..], std::slice::from_ref(other)].concat());
                std::iter::once(one.clone()).chain(with).collect::<Vec<_>>()
            })
            .collect();
    }
    all.sort_by_key(Vec::len);
    let setting = |changes: Vec<[String; 2]>| {
        let (words, changes): (Vec<String>, Vec<String>) =
            changes.into_iter().map(|[words, change]| (words, change)).unzip();
        let name = if words.is_empty() { "the scene's own".to_string() } else { words.join(", ") };
        SweepPoint { name, changes }
    };
    Ok(all.into_iter().map(setting).collect())
}

/// The other settings of a surface: the name of each, and the `-D` change that selects it.
fn others(scene: &Scene, surface: &Surface) -> anyhow::Result<Vec<[String; 2]>> {
    let Surface { name, .. } = surface;
    if let Some((keys, heights, _)) = relief(scene, surface)? {
        let quantised = scene.has(&["surface", name, "relief", "map_precision"]);
        let fits = |method: &&ReliefMethod| {
            (!quantised || method.has_distance_map()) && work(&heights, **method) <= MAX_WORK
        };
        let methods = ReliefMethod::ALL.iter().filter(|method| **method != keys.method).filter(fits);
        let of = |method: &ReliefMethod| {
            [method.name().to_string(), format!("surface.{name}.relief.method={}", method.name())]
        };
        return Ok(methods.map(of).collect());
    }
    if surface.texture.is_none() {
        return Ok(Vec::new());
    }
    let own = filter(scene, surface)?;
    let mut others = Vec::new();
    if own.kind != Filtering::Trilinear {
        others.push(["trilinear".to_string(), format!("surface.{name}.filter={{kind='trilinear'}}")]);
    }
    let ellipse = Filter { kind: Filtering::Ellipse, ..Filter::DEFAULT };
    let with_ramp = ELLIPSES
        .map(|(max_anisotropy, minor_texels)| (Filter { max_anisotropy, minor_texels, ..ellipse }, ["", ""]));
    let special = [1.0, 2.0].into_iter().flat_map(|minor_texels| {
        let map = Filter { minor_texels, weight_map: FilterMap::Radial, ..ellipse };
        // Without a ramp at the edge, fewer texels are read (scene.filters).
        let no_ramp = Filter { minor_texels, edge: FilterEdge::None, ..ellipse };
        [(map, [", radial map", ", weight_map='radial'"]), (no_ramp, [", edge none", ", edge='none'"])]
    });
    for (filter, [words, keys]) in with_ramp.into_iter().chain(special).filter(|(filter, _)| own != *filter) {
        let Filter { max_anisotropy, minor_texels, .. } = filter;
        let common = format!("max_anisotropy={max_anisotropy}, minor_texels={minor_texels}");
        others.push([
            format!("ellipse {max_anisotropy}:1, minor {minor_texels}{words}"),
            format!("surface.{name}.filter={{kind='ellipse', {common}{keys}}}"),
        ]);
    }
    // Mavridis: four taps, each of up to 16 samples, cost about as much as the ellipse.
    for (kind, max, words) in [
        (Filtering::Feline, Some(16), "feline, 16 samples"),
        (Filtering::Mavridis, Some(4), "mavridis, 4 taps"),
        (Filtering::Pbrt, None, "pbrt"),
    ] {
        let max_anisotropy = max.unwrap_or(Filter::DEFAULT.max_anisotropy);
        if own != (Filter { kind, max_anisotropy, ..Filter::DEFAULT }) {
            let max = max.map_or_else(String::new, |max| format!(", max_anisotropy={max}"));
            let change = format!("surface.{name}.filter={{kind='{}'{max}}}", kind.name());
            others.push([words.to_string(), change]);
        }
    }
    Ok(others)
}

/// The reference: the mean over each pixel's footprint; for a relief, the mean of exact rays.
fn mosaic(sweep: &TradeSweep<'_>) -> anyhow::Result<Mosaic> {
    let TradeSweep { scene, pose, size, kernel, .. } = sweep;
    let mut truth = SceneTruth::new(scene, None, pose, *size).map_err(anyhow::Error::msg)?;
    truth.filter = kernel.filter();
    let what = match truth.has_reliefs() {
        true => "the mean of 144 traced rays per pixel of a relief, without weights",
        false => kernel.describe(),
    };
    Ok(Mosaic::of(*size, what, |x, y| truth.covers(x, y), |x, y| truth.pixel(x, y, RAYS)))
}
