//! vt.filter: the time of each filter, and its error against the mean over each pixel's footprint.

use super::super::common::pixels_of;
use super::{Shown, Variant, detail};
use crate::figure::prelude::*;
use crate::paper::virtual_texture::Filtering;
use crate::paper::virtual_texture::config::source_mesh;
use crate::paper::virtual_texture::reference::picture::{ReferenceFilter, SourceTexels, sides};
use crate::picture::Picture;
use crate::picture::measures::{Comparison, OUTLIER_BOUND};
use crate::picture::write::Srgb8Picture;
use crate::reference::ReferenceView;
use crate::reference::filter::sample_count;
use crate::stats::mean;

pub const FILTER: Figure = Figure {
    id: "vt.filter",
    title: "Filters: time, error and noise",
    about: "The paper blends two levels of a tile (section 4) and leaves anisotropic filtering to the hardware, \
            which cannot cross tiles. The figure compares one trilinear sample; the nearest level alone; up to NA \
            trilinear samples along the footprint inside the tile's border, as in the paper (here NA is 2 to 8); and \
            texels chosen at random (Pharr et al. 2024), 1 to 64 per pixel, at one point or along the footprint. \
            Random texels are fetched through the page table and need no border. Each picture is compared with the \
            f64 picture of the same filter, which shows rounding and noise, and with the f64 mean over each pixel's \
            footprint, which shows the error of the filter itself. Pixels beyond the textured surface and at its \
            outline are left out, and their share is reported. The time is that of the texturing pass. Pictures have \
            320 x 180 (quick) or 640 x 360 pixels, because an f64 picture takes seconds.",
    scenes: &["earth/oblique", "earth/low"],
    variants: || VARIANTS.iter().map(Variant::name).collect(),
    show: Show::scenes(&[]).variants(|| VARIANTS.map(|variant| variant.setting(BORDER)).into()),
    measure,
    plots: &[
        Plot::bars(AREA_NMSE).log_y(),
        Plot::bars(AREA_FLIP),
        Plot::bars(OWN_NMSE).log_y(),
        Plot::bars(TIME).log_y().floor("empty pass"),
    ],
    claims: &[
        Claim::ours(
            "anisotropic",
            "Each doubling of the samples along the footprint reduces the error against the mean over the footprint.",
            &[
                Test::ratio_of(AREA_NMSE, ["anisotropic 2", "trilinear"], Below(1.0)),
                Test::ratio_of(AREA_NMSE, ["anisotropic 4", "anisotropic 2"], Below(1.0)),
                Test::ratio_of(AREA_NMSE, ["anisotropic 8", "anisotropic 4"], Below(1.0)),
            ],
        ),
        Claim::ours(
            "noise",
            "The noise of 4, 16 or 64 random texels is at most 1/4, 1/16 or 1/64 of the noise of one.",
            &[
                Test::ratio_of(OWN_NMSE, ["1 tap", "4 taps"], AtLeast(4.0)),
                Test::ratio_of(OWN_NMSE, ["1 tap", "16 taps"], AtLeast(16.0)),
                Test::ratio_of(OWN_NMSE, ["1 tap", "64 taps"], AtLeast(64.0)),
            ],
        ),
        Claim::ours(
            "along",
            "16 random texels along the footprint, without a border, have a smaller error against the mean over the \
             footprint than one trilinear sample.",
            &[Test::ratio_of(AREA_NMSE, ["trilinear", "16 taps along NA 8"], Above(1.0))],
        ),
        Claim::ours_timed(
            "one-tap",
            "One random texel takes no more time than a trilinear sample.",
            &[Test::ratio_of(TIME, ["1 tap", "trilinear"], AtMost(1.0))],
        ),
    ],
    ..Figure::BASE
};

const VARIANTS: [Variant; 10] = [
    Variant::new(Filtering::Bilinear, 1, 1),
    Variant::new(Filtering::Trilinear, 1, 1),
    Variant::new(Filtering::Trilinear, 2, 1),
    Variant::new(Filtering::Trilinear, 4, 1),
    Variant::new(Filtering::Trilinear, 8, 1),
    Variant::new(Filtering::Stochastic, 1, 1),
    Variant::new(Filtering::Stochastic, 1, 4),
    Variant::new(Filtering::Stochastic, 1, 16),
    Variant::new(Filtering::Stochastic, 1, 64),
    Variant::new(Filtering::Stochastic, 8, 16),
];

/// The values of NA in [`VARIANTS`].
const NAS: [u32; 4] = [1, 2, 4, 8];

/// The border in texels. It is sufficient for 8 samples along the footprint.
const BORDER: u32 = 8;

const AREA_NMSE: &str = "NMSE against the mean over the footprint";
const AREA_FLIP: &str = "FLIP against the mean over the footprint";
const AREA_PSNR: &str = "PSNR against the mean over the footprint";
const OWN_NMSE: &str = "NMSE against the same filter in f64";
const OWN_OUTLIERS: &str = "pixels off by more than 5/256 from the same filter in f64";
const EXCUSED: &str = "pixels left out: beyond the textured surface or at its outline";
const TIME: &str = "texturing";
/// A count that is equal on every device: 8 for each trilinear sample, 4 for a bilinear one, 1 for a random texel.
const TEXELS: &str = "texels fetched per pixel";

fn measure(bench: &mut Bench, cell: &Cell) -> anyhow::Result<Vec<Row>> {
    let size = pixels_of(bench.effort_of(180.0, 360.0));
    let mut sessions = Vec::new();
    for max_anisotropy in NAS {
        sessions.push(Shown::settle(bench, &cell.scene, size, BORDER, max_anisotropy)?);
    }
    let truths = Truths::new(&sessions[0])?;
    let mut rows = Vec::new();
    for variant in &VARIANTS {
        let picture = blacken(sessions[at_na(variant)].picture(variant)?, &truths.inside);
        let own = Comparison::of(&picture, truths.own(variant))?.measures(OUTLIER_BOUND);
        let area = Comparison::of(&picture, &truths.area)?.measures(OUTLIER_BOUND);
        for (quantity, unit, number) in [
            (AREA_NMSE, "", area.nmse),
            (AREA_FLIP, "", area.flip_mean),
            (AREA_PSNR, "dB", area.psnr_db),
            (OWN_NMSE, "", own.nmse),
            (OWN_OUTLIERS, "pixels", own.outliers as f64),
            (TEXELS, "texels", truths.texels(variant)),
        ] {
            rows.push(Row::number(variant.name(), quantity, unit, number));
        }
        show(bench, cell, &variant.name(), &picture)?;
    }
    let excused = truths.inside.iter().filter(|inside| !**inside).count();
    let share = Value::Number(100.0 * excused as f64 / truths.inside.len() as f64);
    rows.push(Row::new("the mean over the footprint", EXCUSED, "% of the pixels", share));
    show(bench, cell, "the mean over the footprint", &truths.area)?;
    let contenders = VARIANTS.iter().map(|variant| sessions[at_na(variant)].contender(variant));
    let contenders = contenders.collect::<anyhow::Result<Vec<_>>>()?;
    rows.extend(bench.times(&sessions[0].opened.session.gpu, contenders, TIME)?);
    Ok(rows)
}

/// The index of a variant's NA in [`NAS`].
fn at_na(variant: &Variant) -> usize {
    NAS.iter().position(|&na| na == variant.max_anisotropy).expect("one of NAS")
}

/// Writes the picture's middle, enlarged. For the reference, also writes the whole picture.
fn show(bench: &mut Bench, cell: &Cell, name: &str, picture: &Picture) -> anyhow::Result<()> {
    let name = format!("vt.filter-{}-{}", cell.scene.replace('/', "-"), name.replace(' ', "-"));
    if name.ends_with("the-mean-over-the-footprint") {
        bench.picture(&format!("{name}-whole"), &Srgb8Picture::from(picture))?;
    }
    bench.picture(&name, &detail(picture, [picture.width / 2, picture.height / 2], 4))
}

/// The f64 pictures of one view.
struct Truths {
    area: Picture,
    /// Bilinear in the nearest level.
    nearer_level: Picture,
    /// Up to NA samples along the footprint, for each of [`NAS`].
    samples: Vec<Picture>,
    /// The mean number of samples per pixel of the surface (the paper's nA), for each of [`NAS`].
    counts: [f64; NAS.len()],
    /// True for pixels that the textured surface covers together with all their neighbours.
    inside: Vec<bool>,
}

impl Truths {
    fn new(shown: &Shown) -> anyhow::Result<Truths> {
        let (session, pose) = (&shown.opened.session, &shown.opened.pose);
        let [width, height] = session.technique.settings.size;
        let mesh = source_mesh(&shown.opened.scene)?;
        let view = ReferenceView::new(&mesh, &pose.world_to_clip(width, height), pose.eye, [width, height]);
        let surface = view.samples();
        let covered: Vec<bool> = surface.iter().map(Option::is_some).collect();
        let at = |x: u32, y: u32| covered[(y * width + x) as usize];
        let around = |n: u32| {
            let (x, y) = (n % width, n / width);
            let [left, top] = [x.saturating_sub(1), y.saturating_sub(1)];
            let [right, bottom] = [(x + 1).min(width - 1), (y + 1).min(height - 1)];
            (top..=bottom).all(|y| (left..=right).all(|x| at(x, y)))
        };
        let inside: Vec<bool> = (0..width * height).map(around).collect();
        let texels = SourceTexels::new(&*session.technique.source);
        let picture =
            |filter| -> anyhow::Result<Picture> { Ok(blacken(texels.picture(&view, filter)?, &inside)) };
        let samples = NAS.into_iter().map(|max| picture(ReferenceFilter::Samples(max)));
        let pyramid = session.technique.source.pyramid();
        let lengths: Vec<[f64; 2]> =
            surface.iter().flatten().map(|sample| sides(sample, &pyramid).lengths()).collect();
        let samples_of = |max| {
            let count = |&[longest, shortest]: &[f64; 2]| f64::from(sample_count(longest, shortest, max));
            mean(lengths.iter().map(count))
        };
        Ok(Truths {
            area: picture(ReferenceFilter::Area)?,
            nearer_level: picture(ReferenceFilter::NearerLevel)?,
            samples: samples.collect::<anyhow::Result<_>>()?,
            counts: NAS.map(samples_of),
            inside,
        })
    }

    /// [`TEXELS`] of a filter.
    fn texels(&self, variant: &Variant) -> f64 {
        match variant.filter {
            Filtering::Bilinear => 4.0,
            Filtering::Trilinear => 8.0 * self.counts[at_na(variant)],
            _ => f64::from(variant.taps),
        }
    }

    fn own(&self, variant: &Variant) -> &Picture {
        match variant.filter {
            Filtering::Bilinear => &self.nearer_level,
            _ => &self.samples[at_na(variant)],
        }
    }
}

/// Blackens all pixels outside the textured surface and at its outline, so that they do not count in a comparison.
fn blacken(mut picture: Picture, inside: &[bool]) -> Picture {
    for (pixel, _) in picture.rgba.iter_mut().zip(inside).filter(|(_, inside)| !**inside) {
        *pixel = [0.0, 0.0, 0.0, 1.0];
    }
    picture
}
