//! Footprints at the limb of the globe: bounded by what a pixel sees, or the facet's own.

use crate::ellipse::{SIZE, listed, needed, of_samples, settled};
use crate::truth::view_of;
use crate::{bordered, pose};
use ortelius::paper::virtual_texture::choices::FilterLimb;
use ortelius::paper::virtual_texture::config::{Filter, open_texture};
use ortelius::paper::virtual_texture::reference::picture::SourceTexels;
use ortelius::paper::virtual_texture::reference::{PixelDerivatives, Tolerance, possible_triples};
use ortelius::paper::virtual_texture::{Filtering, FootprintPicture};
use ortelius::picture::PixelFormat;
use ortelius::reference::ReferenceView;
use ortelius::reference::filter::{Edges, MipPyramid};
use ortelius::reference::supersample::{Density, PixelKernel, Truth, supersample};
use ortelius::texture::source::TileSource;

const ELLIPSE: Filter = Filter { kind: Filtering::Ellipse, ..Filter::DEFAULT };
const FELINE: Filter = Filter { kind: Filtering::Feline, ..Filter::DEFAULT };

/// 64 texels of level 0 are less than an eighth of the footprints at the limb.
const LEVEL: u32 = 6;

/// A level's linear colours as a function that threads share.
fn colours(source: &dyn TileSource) -> MipPyramid<impl Fn(u32, u32, u32) -> [f64; 4] + Sync> {
    let (texels, pyramid) = (SourceTexels::new(source), source.pyramid());
    let [width, height] = pyramid.level_size(LEVEL);
    let texture = texels.texture();
    let place = |n: u32| texture.texel_at(LEVEL, i64::from(n % width), i64::from(n / width));
    let all: Vec<[f64; 4]> = (0..width * height).map(place).collect();
    let texel = move |_: u32, x: u32, y: u32| all[(y * width + x) as usize];
    MipPyramid {
        width_log2: pyramid.width_log2(),
        height_log2: pyramid.height_log2(),
        edges: Edges::Planet,
        texel,
    }
}

/// The green channel of the globe, supersampled.
fn truth(source: &dyn TileSource, view: &ReferenceView, kernel: PixelKernel) -> Truth {
    let texture = colours(source);
    supersample(
        view.size(),
        |x, y| view.coordinate(x, y),
        |[s, t]| texture.bilinear(LEVEL, s, t)[1],
        kernel,
        Density { per_texel: 0.0, min: 6, max: 6 },
    )
}

/// Where the limb cuts a pixel's kernel, a bounded footprint is nearer to the truth than the facet's own. Its NMSE is
/// at most half, except with one round sample, which is far too wide in either case. Its worst pixel is better.
#[test]
fn a_bounded_footprint_is_nearer_to_what_the_pixels_at_the_limb_see() {
    let scene = bordered("globe", 4);
    let view = view_of(&scene, &pose(&scene, "africa"), SIZE);
    let source = open_texture(&scene).unwrap();
    let [gaussian, boxed] =
        [PixelKernel::GAUSSIAN, PixelKernel::Box].map(|kernel| truth(&*source, &view, kernel));
    let samples = |max_anisotropy| Filter { max_anisotropy, ..Filter::DEFAULT };
    for (filter, truth, max) in [
        (ELLIPSE, &gaussian, 0.5),
        (FELINE, &gaussian, 0.5),
        (samples(1), &boxed, 1.0),
        (samples(16), &boxed, 0.5),
    ] {
        let errors = [FilterLimb::Facet, FilterLimb::Bounded].map(|limb| {
            let mut renderer = settled("globe", "africa", 4, |settings| {
                settings.target = PixelFormat::Linear32;
                settings.config.filter = Filter { limb: Some(limb), ..filter };
            });
            let shown = renderer.linear_picture().unwrap().rgba;
            let (mut error, mut square, mut worst, mut pixels) = (0.0, 0.0, 0.0f64, 0);
            // The Gaussian's support selects the pixels for both kernels.
            let of_limb = view.samples().into_iter().zip(&gaussian.whole).enumerate();
            for (n, _) in of_limb.filter(|(_, (sample, whole))| sample.is_some() && !**whole) {
                let off = f64::from(shown[n][1]) - truth.values[n];
                error += off * off;
                square += truth.values[n].powi(2);
                worst = worst.max(off.abs());
                pixels += 1;
            }
            assert!(pixels > 100, "{pixels}");
            [error / square, worst]
        });
        println!("{:?}, NA {}: [NMSE, worst] {errors:.4?}", filter.kind, filter.max_anisotropy);
        let [facet, bounded] = errors;
        assert!(bounded[0] < max * facet[0] && bounded[1] < facet[1], "{:?}: {errors:?}", filter.kind);
    }
}

/// The levels are section 2.1's for the bounded footprints, and the list has exactly the tiles that the samples read.
/// Without the bound, other levels are wrong.
#[test]
fn paper_1s_levels_and_list_follow_the_bounded_footprint() {
    let mut rejected = 0;
    for max in [1, 4, 16] {
        let of = |limb| {
            settled("earth", "oblique", 4, |settings| {
                settings.streaming.gpu_tiles = 192;
                settings.config.filter = Filter { max_anisotropy: max, limb, ..Filter::DEFAULT };
            })
        };
        let mut renderer = of(Some(FilterLimb::Bounded));
        let pyramid = renderer.technique.source.pyramid();
        let FootprintPicture { coordinates, derivatives, triples, .. } = renderer.footprint().unwrap();
        let level = |n: usize| {
            let [s, t] = [0, 1].map(|axis| f64::from(coordinates[n][axis]));
            let [dsdx, dtdx, dsdy, dtdy] = derivatives[n].map(f64::from);
            // The device squares, adds and divides in f32.
            let derivative = [dsdx.hypot(dsdy), dtdx.hypot(dtdy)].map(|length| length * 1e-6);
            let at = PixelDerivatives { s, t, dsdx, dtdx, dsdy, dtdy };
            possible_triples(&at, &Tolerance { coordinate: [0.0; 2], derivative }, &pyramid, max)[0]
        };
        let seen: Vec<usize> = (0..triples.len()).filter(|&n| triples[n][0] != u32::MAX).collect();
        let outside = |triples: &[[u32; 3]]| {
            let is_wrong = |n: &&usize| !(level(**n)[0]..=level(**n)[1]).contains(&triples[**n][0]);
            seen.iter().filter(is_wrong).count()
        };
        assert_eq!(outside(&triples), 0, "NA = {max}");
        let facets = of(None).footprint().unwrap();
        rejected += outside(&facets.triples);
        let (tiles, _) = needed(&mut renderer, 3, &of_samples(max));
        assert_eq!(listed(&renderer), tiles, "NA = {max}");
    }
    assert!(rejected > 20, "{rejected} pixels");
}
