//! `ortelius trade` for a scene without a virtual texture: the filters of its plain textures, and the methods of its
//! relief.

use super::open::{plain_texture, relief};
use super::truth::SceneTruth;
use super::{Options, Renderer};
use crate::figure::{Bench, Contender, Machine, Trade};
use crate::paper::texture_mapping::config::ReliefMethod;
use crate::paper::texture_mapping::relief::reference::first_hit;
use crate::paper::texture_mapping::relief::{Ray, Relief};
use crate::paper::virtual_texture::Filtering;
use crate::paper::virtual_texture::config::{Filter, filter};
use crate::paper::virtual_texture::figures::trade::{Batch, Found, MOST, Mosaic, Setting, Sweep, levelled};
use crate::picture::measures::{Comparison, OUTLIER_BOUND};
use crate::picture::write::Srgb8Picture;
use crate::reference::ReferenceView;
use crate::reference::filter::srgb8_to_linear;
use crate::scene::{Scene, Surface};
use crate::vk::Gpu;
use anyhow::Context;

/// Largest ratio of the ellipse's axes, and texels along its minor semi-axis.
const ELLIPSES: [[u32; 2]; 6] = [[4, 1], [4, 2], [4, 4], [16, 1], [16, 2], [16, 4]];

/// Rays along each side of a pixel of the reference.
const RAYS: u32 = 12;

/// Measures all settings of a scene without a virtual texture; the sweep's knobs do not apply. `progress` receives the
/// number of settings done and the number of all settings.
///
/// # Errors
/// A scene with nothing to vary, or without a reference; an unavailable device, or one without timestamps.
pub fn run(sweep: &Sweep<'_>, bench: &Bench, progress: impl Fn(usize, usize)) -> anyhow::Result<Trade> {
    let Sweep { scene, pose, size, measure, .. } = *sweep;
    let settings = settings(scene)?;
    anyhow::ensure!(
        settings.len() > 1,
        "scene {}: nothing to vary: it has no virtual texture, no plain texture with a filter, and no relief",
        scene.name
    );
    let gpu = bench.gpu(&[])?;
    let truth = mosaic(sweep)?;
    let (mut found, mut renderers) = (Vec::new(), Vec::new());
    for setting in &settings {
        // The reference of a relief has no light.
        let mut renderer = settled(sweep, &gpu, &[&setting.changes[..], &unlit(scene)].concat())?;
        let Srgb8Picture { rgba, .. } = renderer.picture()?;
        let measures = Comparison::of(&truth.cut(&rgba), &truth.picture)?.measures(OUTLIER_BOUND);
        found.push(Found { setting: setting.clone(), measures, forced_bias: 0, list_frames: 1 });
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
    let (settings, drift_ms) = levelled(&own, vec![batch], measure);
    let mut trade = Trade {
        scene: scene.name.clone(),
        size,
        measure: measure.name().to_string(),
        truth: truth.describe(),
        machine: Machine::here(gpu.physical()),
        runs: bench.runs(),
        most_runs: MOST * bench.runs(),
        drift_ms,
        settings,
        refused: Vec::new(),
        budgets: Vec::new(),
    };
    trade.mark_front();
    Ok(trade)
}

fn settled(sweep: &Sweep<'_>, gpu: &Gpu, changes: &[String]) -> anyhow::Result<Renderer> {
    let options = Options { size: Some(sweep.size), deterministic: true, ..Options::default() };
    let mut renderer = Renderer::on(gpu, &sweep.scene.with(changes)?, &options)?;
    renderer.settle(&sweep.pose)?;
    renderer.drain()?;
    Ok(renderer)
}

fn has_relief(scene: &Scene, surface: &Surface) -> bool {
    scene.has(&["surface", &surface.name, "relief"])
}

fn unlit(scene: &Scene) -> Vec<String> {
    let reliefs = scene.surfaces.values().filter(|surface| has_relief(scene, surface));
    reliefs.map(|surface| format!("surface.{}.lit=false", surface.name)).collect()
}

/// All combinations of the surfaces' settings, the scene's own first.
fn settings(scene: &Scene) -> anyhow::Result<Vec<Setting>> {
    let mut all = vec![Vec::new()];
    for surface in scene.surfaces.values() {
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
        Setting { name, changes }
    };
    Ok(all.into_iter().map(setting).collect())
}

/// The other settings of a surface: words, and the change of the scene.
fn others(scene: &Scene, surface: &Surface) -> anyhow::Result<Vec<[String; 2]>> {
    let Surface { name, .. } = surface;
    if let Some((keys, ..)) = relief(scene, surface)? {
        let methods = ReliefMethod::ALL.iter().filter(|method| **method != keys.method);
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
    for [max_anisotropy, minor_texels] in ELLIPSES {
        let ellipse = Filter { kind: Filtering::Ellipse, max_anisotropy, minor_texels, ..Filter::DEFAULT };
        if own != ellipse {
            let keys = format!("max_anisotropy={max_anisotropy}, minor_texels={minor_texels}");
            others.push([
                format!("ellipse {max_anisotropy}:1, minor {minor_texels}"),
                format!("surface.{name}.filter={{kind='ellipse', {keys}}}"),
            ]);
        }
    }
    Ok(others)
}

/// The reference: of a relief, exact rays; of other scenes, the mean over each pixel's footprint.
fn mosaic(sweep: &Sweep<'_>) -> anyhow::Result<Mosaic> {
    let Sweep { scene, pose, size, .. } = sweep;
    let mut surfaces = scene.surfaces.values();
    let Some(surface) = surfaces.clone().find(|surface| has_relief(scene, surface)) else {
        let truth = SceneTruth::new(scene, None, pose, *size).map_err(anyhow::Error::msg)?;
        let what = "the f64 mean over each pixel's footprint";
        return Ok(Mosaic::of(*size, what, |x, y| truth.covers(x, y), |x, y| truth.pixel(x, y)));
    };
    anyhow::ensure!(
        surfaces.by_ref().count() == 1,
        "scene {}: the reference of a relief shows no other surface",
        scene.name
    );
    let truth = ReliefTruth::new(sweep, surface)?;
    let what = "the f64 mean of 144 exact rays per pixel, both unlit";
    Ok(Mosaic::of(*size, what, |x, y| truth.view.sample(x, y).is_some(), |x, y| truth.pixel(x, y)))
}

/// A relief below a square plane, by exact rays.
struct ReliefTruth {
    view: ReferenceView,
    relief: Relief,
    /// In texels of the relief: to the east, to the south, and above the plane.
    eye: [f64; 3],
    /// Texels along a side, and linear colours.
    side: usize,
    colours: Vec<[f64; 3]>,
}

impl ReliefTruth {
    fn new(sweep: &Sweep<'_>, surface: &Surface) -> anyhow::Result<ReliefTruth> {
        let Sweep { scene, pose, size, .. } = sweep;
        let (_, relief, size_m) = relief(scene, surface)?.context("a surface with a relief")?;
        let texture = plain_texture(scene, surface.texture.as_deref())?;
        let [side, height] = texture.size.map(|side| side as usize);
        anyhow::ensure!(
            side == height,
            "surface.{}: the reference of a relief needs a square texture",
            surface.name
        );
        let mesh = surface.grid().context("a relief lies below a plane")?;
        let texels = relief.side as f64;
        Ok(ReliefTruth {
            view: ReferenceView::new(&mesh, &pose.world_to_clip(size[0], size[1]), pose.eye, *size),
            eye: [
                (pose.eye.x / size_m + 0.5) * texels - 0.5,
                (0.5 - pose.eye.y / size_m) * texels - 0.5,
                pose.eye.z / size_m * texels,
            ],
            side,
            colours: texture.levels[0]
                .chunks_exact(4)
                .map(|texel| [0, 1, 2].map(|c| srgb8_to_linear(texel[c])))
                .collect(),
            relief,
        })
    }

    /// The mean over the pixel's square; `None` if part of it lies beyond the plane.
    fn pixel(&self, x: u32, y: u32) -> Option<[f64; 4]> {
        let mut sum = [0.0, 0.0, 0.0, 1.0];
        let part = |n: u32| (f64::from(n) + 0.5) / f64::from(RAYS);
        for [i, j] in (0..RAYS * RAYS).map(|n| [n % RAYS, n / RAYS]) {
            let colour = self.ray(f64::from(x) + part(i), f64::from(y) + part(j))?;
            (0..3).for_each(|c| sum[c] += colour[c] / f64::from(RAYS * RAYS));
        }
        Some(sum)
    }

    fn ray(&self, x: f64, y: f64) -> Option<[f64; 3]> {
        let texels = self.relief.side as f64;
        let at = self.view.coordinate(x, y)?.map(|c| c * texels - 0.5);
        let towards = [at[0] - self.eye[0], at[1] - self.eye[1], -self.eye[2]];
        let length = towards.iter().map(|c| c * c).sum::<f64>().sqrt();
        let direction = towards.map(|c| c / length);
        let ray = Ray { origin: at.map(|c| c as f32), direction: direction.map(|c| c as f32) };
        let distance = first_hit(&self.relief, &ray);
        let finer = self.side as f64 / texels;
        let [u, v] = [0, 1].map(|n| finer * (at[n] + distance * direction[n] + 0.5) - 0.5);
        let wrap = |c: f64| c.rem_euclid(self.side as f64) as usize % self.side;
        let texel = |a: f64, b: f64| self.colours[wrap(v.floor() + b) * self.side + wrap(u.floor() + a)];
        let (fu, fv) = (u - u.floor(), v - v.floor());
        let corners = [texel(0.0, 0.0), texel(1.0, 0.0), texel(0.0, 1.0), texel(1.0, 1.0)];
        let weights = [(1.0 - fu) * (1.0 - fv), fu * (1.0 - fv), (1.0 - fu) * fv, fu * fv];
        Some([0, 1, 2].map(|c| (0..4).map(|n| weights[n] * corners[n][c]).sum()))
    }
}
