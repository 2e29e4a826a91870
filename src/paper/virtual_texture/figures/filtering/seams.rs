//! vt.seams: what a tile's border is for, and how wide it must be.

use super::super::common::pixels_of;
use super::{Shown, Variant, detail, of_facts};
use crate::figure::{Axis, Bench, Cell, Claim, Effort, Figure, Finding, Origin, Plot, Row, Table, Value};
use crate::math::pyramid::Pyramid;
use crate::paper::virtual_texture::Filtering;
use crate::paper::virtual_texture::session::FootprintPicture;
use crate::picture::Picture;
use crate::picture::error::{compare, compare_where};
use crate::picture::map::error_maps;

pub const SEAMS: Figure = Figure {
    id: "vt.seams",
    title: "Seams at tiles' edges against the border's width",
    about: "The paper's tiles have no border (section 4 says nothing of samples that reach beyond a tile), so a sampler \
            repeats a tile's last texel where the neighbour's belongs. How far is the picture off within 8 texels of a \
            tile's edge, and elsewhere, from the same filter's picture with a border of 16 texels? The tests hold pictures \
            with a border of 4 and 8 to an f64 reference. A tile's coarser picture has half the border (of one texel: one \
            before the tile, none after). The ruler's texels are white noise: the worst case of any texture.",
    scenes: &["earth/oblique", "ruler/corner-oblique"],
    variants: || VARIANTS.iter().map(Variant::name).collect(),
    sweep: None,
    measure,
    plots: &[
        Plot { quantity: WORST, x: BORDER_AXIS, log_x: false, log_y: false, floor: None },
        Plot { quantity: NMSE, x: BORDER_AXIS, log_x: false, log_y: false, floor: None },
        Plot { quantity: ELSEWHERE, x: BORDER_AXIS, log_x: false, log_y: false, floor: None },
    ],
    claims: &[
        Claim {
            id: "seams",
            text: "The paper's tiles, without a border, show seams: at tiles' edges the picture is off by more than 5/256 \
                   of linear light, elsewhere by less than 1/256.",
            from: Origin::Ours,
            check: seams,
        },
        Claim {
            id: "two-levels",
            text: "Two texels of border are enough for bilinear and for trilinear samples: no pixel is off by more than \
                   1/256.",
            from: Origin::Ours,
            check: two_texels,
        },
        Claim {
            id: "anisotropic",
            text: "A border of NA texels is enough for NA samples along a footprint: no pixel is off by more than 1/256.",
            from: Origin::Ours,
            check: anisotropic,
        },
        Claim {
            id: "stochastic",
            text: "Single texels chosen by chance, each looked up in its own tile, need no border: with none, the picture \
                   is the same.",
            from: Origin::Ours,
            check: stochastic,
        },
    ],
};

const VARIANTS: [Variant; 6] = [
    Variant::new(Filtering::Bilinear, 1, 1),
    Variant::new(Filtering::Trilinear, 1, 1),
    Variant::new(Filtering::Stochastic, 1, 16),
    Variant::new(Filtering::Trilinear, 2, 1),
    Variant::new(Filtering::Trilinear, 4, 1),
    Variant::new(Filtering::Trilinear, 8, 1),
];

const BORDERS: [u32; 5] = [0, 1, 2, 4, 8];
/// What all others are compared with.
const WIDEST: u32 = 16;
/// Texels of the pixel's level within which a tile's edge counts as near.
const NEAR_TEXELS: f64 = 8.0;
/// A step of 8 bits: what sampling one place in images of two sizes may differ by.
const STEP: f64 = 1.0 / 256.0;

const BORDER_AXIS: Axis = Axis::Series("border, texels");
const WORST: &str = "worst error at tiles' edges";
const NMSE: &str = "NMSE at tiles' edges";
const ELSEWHERE: &str = "worst error elsewhere";

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = pixels_of(if bench.effort == Effort::Quick { 270.0 } else { 720.0 });
    let mut rows = Vec::new();
    for max_anisotropy in [1, 2, 4, 8] {
        let variants: Vec<&Variant> =
            VARIANTS.iter().filter(|v| v.max_anisotropy == max_anisotropy).collect();
        let mut widest = Shown::settle(bench, &cell.scene, size, WIDEST, max_anisotropy)?;
        let near = Near::of(&mut widest)?;
        let truths = pictures(&mut widest, &variants)?;
        drop(widest);
        let mut series = vec![[const { Vec::new() }; 3]; variants.len()];
        for border in BORDERS.into_iter().filter(|&border| max_anisotropy == 1 || max_anisotropy <= border) {
            let mut shown = Shown::settle(bench, &cell.scene, size, border, max_anisotropy)?;
            for (n, picture) in pictures(&mut shown, &variants)?.iter().enumerate() {
                let at_edges = compare_where(picture, &truths[n], |x, y| near.at(x, y))?;
                let elsewhere = compare_where(picture, &truths[n], |x, y| !near.at(x, y))?;
                let worst =
                    |of: &crate::picture::error::Difference| of.worst().map_or(0.0, |worst| worst.value);
                let found = [worst(&at_edges), at_edges.nmse(), worst(&elsewhere)];
                for (points, value) in series[n].iter_mut().zip(found) {
                    points.push([f64::from(border), value]);
                }
                if *variants[n] == VARIANTS[1] && border == 0 {
                    show(bench, cell, picture, &truths[n])?;
                }
            }
        }
        for (variant, series) in variants.iter().zip(series) {
            for (quantity, points) in [WORST, NMSE, ELSEWHERE].into_iter().zip(series) {
                let unit = if quantity == NMSE { "" } else { "linear light" };
                rows.push(Row::new(variant.name(), quantity, unit, Value::Series(points)));
            }
            rows.push(Row::new(
                variant.name(),
                "pixels at tiles' edges",
                "",
                Value::Number(near.count() as f64),
            ));
        }
    }
    Ok(rows)
}

fn pictures(shown: &mut Shown, variants: &[&Variant]) -> anyhow::Result<Vec<Picture>> {
    variants.iter().map(|variant| shown.picture(variant)).collect()
}

/// The trilinear picture without a border around its worst pixel, the same with the widest, and the map of all errors.
fn show(bench: &mut Bench, cell: &Cell, picture: &Picture, truth: &Picture) -> anyhow::Result<()> {
    let difference = compare(picture, truth)?;
    let scene = cell.scene.replace('/', "-");
    if let Some(worst) = difference.worst() {
        let at = [worst.x, worst.y];
        bench.picture(&format!("vt.seams-{scene}-trilinear-border-0"), &detail(picture, at, 4))?;
        bench.picture(&format!("vt.seams-{scene}-trilinear-border-{WIDEST}"), &detail(truth, at, 4))?;
    }
    let map = error_maps([truth.width, truth.height], &[&difference]);
    bench.picture(&format!("vt.seams-{scene}-trilinear-border-0-errors"), &map)
}

/// Which pixels lie near an edge of the tile that stage 1 names.
struct Near {
    width: u32,
    pixels: Vec<bool>,
}

impl Near {
    fn of(shown: &mut Shown) -> anyhow::Result<Near> {
        let pose = shown.opened.pose;
        let pyramid = shown.opened.session.source.pyramid();
        let width = shown.opened.session.settings.size[0];
        let FootprintPicture { coordinates, triples, .. } = shown.opened.session.footprint(&pose)?;
        let near = |(&st, &[q, ..]): (&[f32; 2], &[u32; 3])| {
            q < pyramid.first_resident_level() && near_edge(&pyramid, q, st)
        };
        Ok(Near { width, pixels: coordinates.iter().zip(&triples).map(near).collect() })
    }

    fn at(&self, x: u32, y: u32) -> bool {
        self.pixels[(y * self.width + x) as usize]
    }

    fn count(&self) -> usize {
        self.pixels.iter().filter(|&&near| near).count()
    }
}

fn near_edge(pyramid: &Pyramid, q: u32, st: [f32; 2]) -> bool {
    let size = pyramid.level_size(q);
    let tile = f64::from(pyramid.tile_size());
    (0..2).any(|axis| {
        let within = (f64::from(st[axis]) * f64::from(size[axis])).rem_euclid(tile);
        within.min(tile - within) <= NEAR_TEXELS
    })
}

/// Every (scene, variant, border, error) of a quantity.
fn points<'a>(table: &'a Table, quantity: &'a str) -> impl Iterator<Item = (&'a str, &'a str, u32, f64)> {
    table.of(quantity).flat_map(|record| {
        let points: &[[f64; 2]] = match &record.row.value {
            Value::Series(points) => points,
            _ => &[],
        };
        points.iter().map(|&[border, error]| (&*record.scene, &*record.row.variant, border as u32, error))
    })
}

/// The largest error of the points that `of` takes, each of which `holds`.
fn judged(
    table: &Table,
    quantities: &[&str],
    of: impl Fn(&str, u32) -> bool,
    holds: impl Fn(f64) -> bool,
    why: &str,
) -> Finding {
    let found: Vec<_> = quantities
        .iter()
        .flat_map(|quantity| points(table, quantity))
        .filter(|&(_, variant, border, _)| of(variant, border))
        .collect();
    let facts: Vec<bool> = found.iter().map(|&(.., error)| holds(error)).collect();
    let numbers: Vec<String> = found
        .iter()
        .map(|(scene, variant, border, error)| format!("{scene}, {variant}, border {border}: {error:.5}"))
        .collect();
    of_facts(&facts, numbers.join("; "), why)
}

fn seams(table: &Table) -> Finding {
    let bare = |variant: &str, border| border == 0 && !variant.contains("tap");
    let edges = judged(table, &[WORST], bare, |error| error > 5.0 * STEP, "");
    let elsewhere: Vec<bool> = points(table, ELSEWHERE)
        .filter(|&(_, v, border, _)| bare(v, border))
        .map(|(.., e)| e <= STEP)
        .collect();
    let all = !elsewhere.is_empty() && elsewhere.iter().all(|&fact| fact);
    let facts = [edges.verdict == crate::figure::Verdict::Reproduced, all];
    of_facts(
        &facts,
        edges.numbers,
        "the clamped sampler repeats a tile's last texel where the neighbour's belongs",
    )
}

fn two_texels(table: &Table) -> Finding {
    let bordered = |variant: &str, border| border >= 2 && ["bilinear", "trilinear"].contains(&variant);
    let why = "a sample mixes the next texel of either level, and a border of 2 is 1 of the coarser level";
    judged(table, &[WORST, ELSEWHERE], bordered, |error| error <= STEP, why)
}

fn anisotropic(table: &Table) -> Finding {
    let why = "the outermost of NA samples lies less than NA - 1 texels away and mixes half a texel more";
    judged(
        table,
        &[WORST, ELSEWHERE],
        |variant, _| variant.starts_with("anisotropic"),
        |error| error <= STEP,
        why,
    )
}

fn stochastic(table: &Table) -> Finding {
    let taps = |variant: &str, border| variant.contains("tap") && border == 0;
    let why = "the same taps fall on the same texels; only where the neighbour's tile is not resident, because no pixel \
               asks for it, does a coarser one stand in";
    judged(table, &[WORST, ELSEWHERE], taps, |error| error == 0.0, why)
}
