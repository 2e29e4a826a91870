//! vt.seams: why a tile needs a border, and how wide it must be.

use super::super::common::pixels_of;
use super::{Shown, Variant, detail};
use crate::figure::prelude::*;
use crate::math::pyramid::Pyramid;
use crate::paper::virtual_texture::Filtering;
use crate::paper::virtual_texture::FootprintPicture;
use crate::paper::virtual_texture::footprint::BACKGROUND;
use crate::paper::virtual_texture::reference::{PixelDerivatives, triple};
use crate::picture::Picture;
use crate::picture::error::{compare, compare_where};
use crate::picture::map::error_maps;
use crate::reference::filter::SAMPLER_ERROR;

pub const SEAMS: Figure = Figure {
    id: "vt.seams",
    title: "Seams at tiles' edges, by the width of the border",
    about: "The paper's tiles have no border (section 4 does not mention samples beyond a tile), so beyond the edge a \
            sampler repeats the tile's last texel instead of reading the neighbour's texels. The figure shows the \
            error within 8 texels of a tile's edge, and elsewhere, against the same filter with a border of 16 texels. \
            Pictures with different borders may differ by a sampler's rounding (at most 3/256), because the border \
            changes the size of the tile pool's layers. The tests compare pictures that have a border of 4 or 8 texels \
            against an f64 reference. A tile is stored in two levels; in the coarser one its border is half as wide. \
            (If the border is one texel, the coarser level has one texel before the tile and none after it.) The \
            ruler's texels are white noise, the worst case of any texture. Pictures have 480 x 270 (quick) or 1280 x \
            720 pixels; all pixels count.",
    scenes: &["earth/oblique", "ruler/corner-oblique"],
    variants: || VARIANTS.iter().map(Variant::name).collect(),
    show: Show::scenes(&[]).variants(|| {
        // The smallest borders that the figure measures. Only bilinear and trilinear samples show seams with them.
        VARIANTS.map(|variant| variant.setting(if variant.max_anisotropy == 1 { 0 } else { 2 })).into()
    }),
    measure,
    plots: &[
        Plot::curves(WORST, BORDER_AXIS),
        Plot::curves(NMSE, BORDER_AXIS),
        Plot::curves(ELSEWHERE, BORDER_AXIS),
    ],
    claims: &[
        Claim::ours(
            "seams",
            "The paper's tiles, without a border, show seams: at tiles' edges the picture is off by more than 5/256 of \
             linear light, elsewhere by at most 3/256.",
            &[
                Test::value(single(WORST, 0.0, 0.0), Above(5.0 / 256.0)),
                Test::value(single(ELSEWHERE, 0.0, 0.0), AtMost(SAMPLER_ERROR)),
            ],
        ),
        Claim::ours(
            "two-levels",
            "Two texels of border are enough for bilinear and for trilinear samples: no pixel is off by more than \
             3/256.",
            &[
                Test::value(single(WORST, 2.0, MAX), AtMost(SAMPLER_ERROR)),
                Test::value(single(ELSEWHERE, 2.0, MAX), AtMost(SAMPLER_ERROR)),
            ],
        ),
        Claim::ours(
            "anisotropic",
            "Two texels of border are enough for NA samples along a footprint, because samples beyond the border are \
             looked up in the neighbouring tile: no pixel is off by more than 3/256.",
            &[
                Test::value(along(WORST), AtMost(SAMPLER_ERROR)),
                Test::value(along(ELSEWHERE), AtMost(SAMPLER_ERROR)),
            ],
        ),
    ],
    ..Figure::BASE
};

const VARIANTS: [Variant; 7] = [
    Variant::new(Filtering::Bilinear, 1, 1),
    Variant::new(Filtering::Trilinear, 1, 1),
    Variant::new(Filtering::Stochastic, 1, 16),
    Variant::new(Filtering::Trilinear, 2, 1),
    Variant::new(Filtering::Trilinear, 4, 1),
    Variant::new(Filtering::Trilinear, 8, 1),
    Variant::new(Filtering::Trilinear, 16, 1),
];

const BORDERS: [u32; 5] = [0, 1, 2, 4, 8];
const MAX: f64 = 8.0;
/// The border of the reference picture.
const WIDEST: u32 = 16;
/// Largest distance to a tile's edge, in texels of the pixel's level, that counts as near.
const NEAR_TEXELS: f64 = 8.0;
const BORDER_AXIS: &str = "border, texels";
const WORST: &str = "worst error at tiles' edges";
const NMSE: &str = "NMSE at tiles' edges";
const ELSEWHERE: &str = "worst error elsewhere";

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = pixels_of(bench.effort_of(270.0, 720.0));
    let mut rows = Vec::new();
    for max_anisotropy in [1, 2, 4, 8, 16] {
        let variants: Vec<&Variant> =
            VARIANTS.iter().filter(|v| v.max_anisotropy == max_anisotropy).collect();
        let mut widest = Shown::settle(bench, &cell.scene, size, WIDEST, max_anisotropy)?;
        let near = Near::of(&mut widest)?;
        let truths = pictures(&mut widest, &variants)?;
        drop(widest);
        let mut series = vec![[const { Vec::new() }; 3]; variants.len()];
        for border in BORDERS.into_iter().filter(|&border| max_anisotropy == 1 || border >= 2) {
            let mut shown = Shown::settle(bench, &cell.scene, size, border, max_anisotropy)?;
            for (n, picture) in pictures(&mut shown, &variants)?.iter().enumerate() {
                let at_edges = compare_where(picture, &truths[n], |x, y| near.at(x, y))?;
                let elsewhere = compare_where(picture, &truths[n], |x, y| !near.at(x, y))?;
                let found = [at_edges.largest(), at_edges.nmse(), elsewhere.largest()];
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
            rows.push(Row::number(variant.name(), "pixels at tiles' edges", "", near.count() as f64));
        }
    }
    Ok(rows)
}

fn pictures(shown: &mut Shown, variants: &[&Variant]) -> anyhow::Result<Vec<Picture>> {
    variants.iter().map(|variant| shown.picture(variant)).collect()
}

/// Writes the trilinear picture around its worst pixel, without a border and with the widest border, and the map of all
/// errors.
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

/// The pixels that show a position near an edge of its tile.
struct Near {
    width: u32,
    pixels: Vec<bool>,
}

impl Near {
    fn of(shown: &mut Shown) -> anyhow::Result<Near> {
        let pyramid = shown.opened.session.technique.source.pyramid();
        let width = shown.opened.session.technique.settings.size[0];
        let max = shown.opened.session.technique.settings.config.filter.max_anisotropy;
        let FootprintPicture { coordinates, derivatives, triples, .. } = shown.opened.session.footprint()?;
        let near = |((&st, &d), &[q, ..]): ((&[f32; 2], &[f32; 4]), &[u32; 3])| {
            q != BACKGROUND && near_edge(&pyramid, shown_level(&pyramid, q, st, d, max), st)
        };
        let pixels = coordinates.iter().zip(&derivatives).zip(&triples).map(near).collect();
        Ok(Near { width, pixels })
    }

    fn at(&self, x: u32, y: u32) -> bool {
        self.pixels[(y * self.width + x) as usize]
    }

    fn count(&self) -> usize {
        self.pixels.iter().filter(|&&near| near).count()
    }
}

/// The level that a pixel shows: stage 1's q for streamed levels, floor(e) in the resident tail.
fn shown_level(pyramid: &Pyramid, q: u32, st: [f32; 2], derivatives: [f32; 4], max: u32) -> u32 {
    if q < pyramid.first_resident_level() {
        return q;
    }
    let [s, t] = st.map(f64::from);
    let [dsdx, dtdx, dsdy, dtdy] = derivatives.map(f64::from);
    let e = triple(&PixelDerivatives { s, t, dsdx, dtdx, dsdy, dtdy }, pyramid, max).e;
    // A footprint that is not finite gives NaN, which casts to 0.
    (e.floor() as u32).clamp(q, pyramid.coarsest_level())
}

/// True if (s, t) is near an edge. Resident levels are also cut into tiles; a level smaller than a tile has its own
/// edges.
fn near_edge(pyramid: &Pyramid, level: u32, st: [f32; 2]) -> bool {
    let size = pyramid.level_size(level);
    (0..2).any(|axis| {
        let edges = f64::from(pyramid.tile_size().min(size[axis]));
        let within = (f64::from(st[axis]) * f64::from(size[axis])).rem_euclid(edges);
        within.min(edges - within) <= NEAR_TEXELS
    })
}

/// Errors of filters with one sample per pixel, for a range of borders.
const fn single(quantity: &'static str, min: f64, max: f64) -> Pick {
    each(quantity, || ["bilinear", "trilinear"].map(String::from).into()).x(At::Points(min, max))
}

/// Errors of filters with NA samples along the footprint, for every border of at least 2 texels.
const fn along(quantity: &'static str) -> Pick {
    let names = || VARIANTS.iter().filter(|v| v.max_anisotropy > 1).map(Variant::name).collect();
    each(quantity, names).x(At::Points(0.0, MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Levels 0 to 8 are streamed. Level 9 is one tile with 512 x 256 texels; level 11 has 128 x 64.
    fn pyramid() -> Pyramid {
        Pyramid::new(18, 17, 9, 4, None).unwrap()
    }

    #[test]
    fn edges_are_those_of_the_level_that_shows_the_pixel() {
        let at = |level, texels: [f32; 2]| {
            let size = pyramid().level_size(level).map(|side| side as f32);
            near_edge(&pyramid(), level, [texels[0] / size[0], texels[1] / size[1]])
        };
        assert_eq!(
            [at(3, [256.0, 256.0]), at(3, [519.0, 256.0]), at(3, [256.0, 505.0])],
            [false, true, true]
        );
        assert_eq!([at(3, [522.0, 256.0]), at(3, [512.0, 256.0])], [false, true]);
        // In the resident tail a level's end is an edge, even if the level is smaller than a tile.
        assert_eq!([at(9, [256.0, 128.0]), at(9, [256.0, 250.0]), at(11, [64.0, 60.0])], [false, true, true]);
    }

    #[test]
    fn in_the_resident_tail_the_footprint_selects_the_level() {
        let level = |q, texels: f32| {
            let [w, h] = pyramid().level_size(0).map(|side| side as f32);
            shown_level(&pyramid(), q, [0.5, 0.5], [texels / w, 0.0, 0.0, texels / h], 1)
        };
        assert_eq!([level(3, 4096.0), level(9, 513.0), level(9, 4097.0), level(9, 1e9)], [3, 9, 12, 18]);
        assert_eq!(shown_level(&pyramid(), 9, [0.5, 0.5], [f32::NAN; 4], 1), 9);
    }
}
