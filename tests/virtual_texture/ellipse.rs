//! Paper 3's ellipse on tiles: its level, the list and the picture, compared with paper 3's own f64 reference.

use crate::truth::{RADIUS_PX, tolerance, view_of};
use crate::{TextureSession, bordered, device, open, open_with, pose};
use ortelius::math::pyramid::{Pyramid, TileId};
use ortelius::paper::texture_mapping::method::{EllipseFilter, PixelCentre};
use ortelius::paper::texture_mapping::reference::ellipse::{bounded, filtered, half_sides, levels};
use ortelius::paper::virtual_texture::choices::FilterMap;
use ortelius::paper::virtual_texture::config::Filter;
use ortelius::paper::virtual_texture::reach::neighbours;
use ortelius::paper::virtual_texture::reference::picture::{SourceTexels, sides};
use ortelius::paper::virtual_texture::reference::{tiles_of_texels, visible_tiles};
use ortelius::paper::virtual_texture::{
    Compaction, Config, Dedup, Filtering, Listing, RequestFormat, TileAddress, VirtualTextureSettings,
};
use ortelius::picture::PixelFormat;
use ortelius::reference::Sample;
use ortelius::reference::filter::{sample_count, srgb8_to_linear};
use ortelius::texture::source::{TileError, TileSource};
use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::sync::Arc;

/// Scene, camera, border, ratio of the axes. Without a border every texel of another tile is looked up; with the widest
/// border, few texels are looked up.
const CASES: [(&str, &str, u32, u32); 7] = [
    ("earth", "oblique", 16, 16),
    ("earth", "low", 0, 16),
    ("plane", "tilted", 4, 3),
    ("globe", "africa", 8, 16),
    ("globe", "antarctica", 0, 16),
    ("ruler", "corner-oblique", 4, 16),
    ("ruler", "antimeridian", 1, 5),
];

/// The ellipse with an axis ratio of at most `ratio`, in tiles of `tile_size`.
fn ellipse(ratio: u32, tile_size: u32) -> EllipseFilter {
    EllipseFilter::BEST.max_ratio(ratio as f32).minor_texels(2.0).within(tile_size / 2)
}

/// The size of the pictures.
pub const SIZE: [u32; 2] = [160, 90];

fn filter(settings: &mut VirtualTextureSettings, max_anisotropy: u32) {
    settings.target = PixelFormat::Linear32;
    settings.streaming.gpu_tiles = 192;
    settings.config.filter = Filter { kind: Filtering::Ellipse, max_anisotropy, ..Filter::DEFAULT };
}

pub fn settled(
    scene: &str,
    camera: &str,
    border: u32,
    change: impl FnOnce(&mut VirtualTextureSettings),
) -> TextureSession {
    let scene = bordered(scene, border);
    let mut renderer = open(&device(), &scene, SIZE, change);
    renderer.settle(&pose(&scene, camera)).unwrap();
    renderer.drain().unwrap();
    assert_eq!(renderer.technique.bias(), 0);
    renderer
}

fn pixel_of(centre: [f64; 2], [[ux, uy], [vx, vy]]: [[f64; 2]; 2]) -> PixelCentre {
    PixelCentre { place: [0; 2], centre, jacobian: [[ux, uy], [vx, vy]], determinant: ux * vy - uy * vx }
}

/// The number of pixels whose level differs from the reference's level for the device's derivatives, and the number of
/// covered pixels.
pub fn wrong_levels(renderer: &mut TextureSession, ellipse: &EllipseFilter) -> [usize; 2] {
    let (dump, pyramid) = (renderer.footprint().unwrap(), renderer.technique.source.pyramid());
    let size = pyramid.level_size(0).map(f64::from);
    let mut counts = [0; 2];
    for (derivatives, &[q, ..]) in
        dump.derivatives.iter().zip(&dump.triples).filter(|(_, t)| t[0] != u32::MAX)
    {
        let [dsdx, dtdx, dsdy, dtdy] = derivatives.map(f64::from);
        let jacobian = [[dsdx, dsdy].map(|d| d * size[0]), [dtdx, dtdy].map(|d| d * size[1])];
        let [low, high] = levels(ellipse, &pixel_of([0.0; 2], jacobian), pyramid.coarsest_level());
        let first = pyramid.first_resident_level();
        counts[0] += usize::from(!(low.min(first)..=high.min(first)).contains(&q));
        counts[1] += 1;
    }
    counts
}

/// Distances in texels from the centre to the furthest texels, for a Jacobian and a level. The last argument is the
/// sign of the rounding error: -1 gives the least, 1 the greatest distance.
pub type HalfSides<'a> = &'a dyn Fn([[f64; 2]; 2], u32, f64) -> [f64; 2];

/// The tiles from which the filter reads texels in any pixel. Texels up to `margin` beyond a tile belong to the tile.
/// If rounding decides, the device's choice counts. Also returns the number of pixels that read texels of other tiles,
/// and the number of pixels for which rounding decides.
pub fn needed(
    renderer: &mut TextureSession,
    margin: i64,
    half_sides: HalfSides<'_>,
) -> (BTreeSet<TileId>, [usize; 2]) {
    let (dump, pyramid) = (renderer.footprint().unwrap(), renderer.technique.source.pyramid());
    let size = pyramid.level_size(0).map(f64::from);
    let side = i64::from(pyramid.tile_size());
    let (mut tiles, mut reaching, mut undecided) = (BTreeSet::new(), 0, 0);
    for (n, &[q, i, j]) in dump.triples.iter().enumerate() {
        if q >= pyramid.first_resident_level() {
            continue;
        }
        let own = TileId { level: q, row: i >> q, column: j >> q };
        tiles.insert(own);
        let [dsdx, dtdx, dsdy, dtdy] = dump.derivatives[n].map(f64::from);
        let jacobian = [[dsdx, dsdy].map(|d| d * size[0]), [dtdx, dtdy].map(|d| d * size[1])];
        let centre =
            [0, 1].map(|axis| f64::from(dump.coordinates[n][axis]) * size[axis] / 2f64.powi(q as i32));
        let corner = [own.column, own.row].map(|tile| i64::from(tile) * side);
        let of = |sign: f64| {
            // s and t in the dump have 24 bits.
            let off = sign * (2f64.powi(-24) * size[0] + 2f64.powi(-12));
            let half = half_sides(jacobian, q, sign);
            let first = [0, 1].map(|axis| (centre[axis] - half[axis] - off).floor() as i64);
            let last = [0, 1].map(|axis| (centre[axis] + half[axis] + off).floor() as i64);
            let inside = (0..2).all(|axis| {
                first[axis] >= corner[axis] - margin && last[axis] < corner[axis] + side + margin
            });
            if inside { BTreeSet::from([own]) } else { tiles_of_texels(&pyramid, q, first, last) }
        };
        let (min, max) = (of(-1.0), of(1.0));
        reaching += usize::from(max.len() > 1);
        if min == max {
            tiles.extend(max);
        } else {
            undecided += 1;
            let at = |[level, i, j]: [u32; 3]| TileId { level, row: i >> level, column: j >> level };
            tiles.extend(neighbours(&pyramid, [q, i, j], dump.reaches[n]).map(at));
        }
    }
    assert!(100 * undecided < dump.triples.len(), "{undecided} undecided");
    (tiles, [reaching, undecided])
}

/// The half sides of the ellipse. Its bounding box contains the centres of its texels.
pub fn of_ellipse(ellipse: EllipseFilter) -> impl Fn([[f64; 2]; 2], u32, f64) -> [f64; 2] {
    move |jacobian, q, _| half_sides(&ellipse, &pixel_of([0.0; 2], jacobian), q).map(|side| side - 0.5)
}

/// The half sides of nA samples along the footprint. The outermost sample lies 1 / (2 nA) of the longer side before
/// that side's end.
pub fn of_samples(max: u32) -> impl Fn([[f64; 2]; 2], u32, f64) -> [f64; 2] {
    move |[u, v], q, sign| {
        let [r1, r2] = [[u[0], v[0]], [u[1], v[1]]];
        let [a, b] = [r1, r2].map(|[s, t]| s.hypot(t));
        let count = f64::from(sample_count(a.max(b) * (1.0 + sign * 1e-5), a.min(b), max));
        let major = if a > b { r1 } else { r2 };
        major.map(|side| side.abs() * (0.5 - 0.5 / count) / 2f64.powi(q as i32))
    }
}

pub fn listed(renderer: &TextureSession) -> BTreeSet<TileId> {
    renderer.records.last().unwrap().visible.iter().copied().collect()
}

#[test]
fn the_level_and_the_list_are_the_references() {
    let (mut beside, mut rejected) = (0, 0);
    for (scene, camera, border, ratio) in CASES {
        let mut renderer = settled(scene, camera, border, |settings| filter(settings, ratio));
        let tile_size = renderer.technique.source.pyramid().tile_size();
        let [wrong, covered] = wrong_levels(&mut renderer, &ellipse(ratio, tile_size));
        assert!(wrong == 0 && covered > 4000, "{scene}, {camera}: {wrong} of {covered}");
        let own = ellipse(ratio, tile_size);
        let (tiles, [reaching, undecided]) = needed(&mut renderer, i64::from(border), &of_ellipse(own));
        println!("{scene}, {camera}: {} tiles, {reaching} pixels reach, {undecided} undecided", tiles.len());
        assert_eq!(listed(&renderer), tiles, "{scene}, {camera}");
        // Near miss that must be rejected: a footprint that reaches at most three texels.
        let [wrong, _] = wrong_levels(&mut renderer, &ellipse(ratio, tile_size).within(3));
        rejected += wrong;
        let requests = renderer.requests().unwrap();
        beside += tiles.len() - visible_tiles(&requests, &renderer.technique.source.pyramid()).len();
    }
    assert!(beside > 0 && rejected > 10_000, "{beside} tiles beside, {rejected} levels");
}

/// Every method that makes the list, on tiles without a border.
#[test]
fn every_method_lists_the_neighbouring_tiles_that_the_filter_reads() {
    let (gpu, scene) = (device(), bordered("ruler", 0));
    let tiles = |change: &dyn Fn(&mut Config)| {
        let mut renderer = open(&gpu, &scene, SIZE, |settings| {
            filter(settings, 16);
            change(&mut settings.config);
        });
        for _ in 0..3 {
            renderer.frame(&pose(&scene, "corner-oblique")).unwrap();
        }
        renderer.drain().unwrap();
        let list = listed(&renderer);
        (renderer, list)
    };
    let (mut renderer, list) = tiles(&|_| {});
    let (needed, [reaching, _]) = needed(&mut renderer, 0, &of_ellipse(ellipse(16, 512)));
    let own = visible_tiles(&renderer.requests().unwrap(), &renderer.technique.source.pyramid());
    assert!(reaching > 100 && own.len() < needed.len(), "{reaching}, {} of {}", own.len(), needed.len());
    assert_eq!(list, needed);
    for list in [Listing::HostHash, Listing::HostBitmap] {
        assert_eq!(tiles(&|config| config.list = list).1, needed, "{list:?}");
    }
    for &format in RequestFormat::ALL.iter().filter(|format| gpu.renders_to(format.image_format())) {
        assert_eq!(tiles(&|config| config.request_format = Some(format)).1, needed, "{format:?}");
    }
    for &dedup in Dedup::ALL {
        for address in [TileAddress::Level0, TileAddress::OwnLevel] {
            let variant = |config: &mut Config| {
                *config = Config { dedup, address, compact: Compaction::Append, ..*config };
            };
            let mut config = Config::DEFAULT;
            variant(&mut config);
            // Without a depth-only draw, hidden fragments also mark.
            let exact = dedup != Dedup::Fused && config.check(&renderer.technique.source.pyramid()).is_ok();
            if exact {
                assert_eq!(tiles(&variant).1, needed, "{dedup:?}, {address:?}");
            }
        }
    }
}

#[test]
fn nine_and_sixteen_samples_list_the_tiles_that_they_are_in() {
    let mut beside = 0;
    for (scene, camera, max, border) in [
        ("ruler", "corner-oblique", 9, 2),
        ("ruler", "corner-oblique", 16, 4),
        ("plane", "tilted", 16, 4),
        ("ruler", "north-pole", 16, 2),
        ("earth", "low", 4, 4),
    ] {
        let mut renderer = settled(scene, camera, border, |settings| {
            settings.config.filter.max_anisotropy = max;
            settings.streaming.gpu_tiles = 192;
        });
        let (tiles, [reaching, undecided]) = needed(&mut renderer, i64::from(border) - 1, &of_samples(max));
        println!("{scene}, {camera}, NA {max}: {} tiles, {reaching} pixels reach, {undecided}", tiles.len());
        assert_eq!(listed(&renderer), tiles, "{scene}, NA = {max}");
        assert!(max > border || reaching == 0, "{reaching}");
        beside += reaching;
    }
    assert!(beside > 50, "{beside}");
}

/// All colours that the reference allows: one for each level within the tolerance of the derivatives. `None` if that
/// tolerance exceeds a quarter of the footprint's width, as at the limb, where triangles are less than a pixel high.
fn possible(
    ellipse: &EllipseFilter,
    sample: &Sample,
    texels: &SourceTexels<'_>,
    pyramid: &Pyramid,
    limb: f64,
) -> Option<Vec<[f64; 3]>> {
    let size = pyramid.level_size(0).map(f64::from);
    let footprint = sides(sample, pyramid);
    let centre = [sample.s * size[0], sample.t * size[1]];
    let [[ux, vx], [uy, vy]] = [footprint.r1, footprint.r2];
    let facet = pixel_of(centre, [[ux, uy], [vx, vy]]);
    // A plane has no limb.
    let max = if limb > 0.0 { (sample.w_m * limb).sqrt() * size[1] / PI } else { f64::INFINITY };
    let pixel = bounded(&facet, max, (PI * sample.t).sin().max(1e-3));
    let [ds, dt] = tolerance(sample).derivative;
    let minor = facet.determinant.abs() / footprint.lengths()[0];
    let off = (size[0] * ds).hypot(size[1] * dt) / minor;
    if off.is_nan() || off > 0.25 {
        return None;
    }
    let scaled = |by: f64| {
        let larger = pixel_of(centre, pixel.jacobian.map(|row| row.map(|d| d * by)));
        levels(ellipse, &larger, pyramid.coarsest_level())
    };
    let (low, high) = (scaled(1.0 - off)[0], scaled(1.0 + off)[1]);
    let texture = texels.texture();
    let colour = |level: u32| {
        [0, 1, 2].map(|channel| {
            let texel = |column, row| texture.texel_at(level, column, row)[channel];
            filtered(ellipse, &pixel, [level, pyramid.coarsest_level()], texel).value
        })
    };
    Some((low..=high).map(colour).collect())
}

/// A pixel's position is known to 2^-7 pixel. This changes a Gaussian of sigma 1/2 pixel by at most 0.8 x 2^-7 of the
/// contrast. The derivatives are known to a relative 2^-9. Together this is less than 5/256, as for one sample.
const BOUND: f64 = 5.0 / 256.0;

/// Number of pixels inside one triangle that no colour of `reference` explains.
fn beyond(renderer: &mut TextureSession, scene: &str, camera: &str, reference: &EllipseFilter) -> usize {
    let scene = bordered(scene, renderer.technique.source.pyramid().border_texels());
    let size = renderer.technique.settings.size;
    let found = renderer.linear_picture().unwrap().rgba;
    let pose = pose(&scene, camera);
    let view = view_of(&scene, &pose, size);
    let limb = pose.pixel_tangent(size[1]) * scene.surfaces["land"].grid().unwrap().curvature;
    let source = renderer.technique.source.clone();
    let (texels, pyramid) = (SourceTexels::new(&*source), source.pyramid());
    let (mut worst, mut beyond, mut judged, mut excused) = (0.0f64, 0, 0, 0);
    for (n, found) in found.iter().enumerate() {
        let (x, y) = (n as u32 % size[0], n as u32 / size[0]);
        let Some(sample) = view.sample(x, y) else { continue };
        let error =
            |colour: &[f64; 3]| (0..3).map(|c| (f64::from(found[c]) - colour[c]).abs()).fold(0.0, f64::max);
        let Some(colours) = possible(reference, &sample, &texels, &pyramid, limb) else {
            excused += 1;
            continue;
        };
        judged += 1;
        let min = colours.iter().map(error).fold(f64::INFINITY, f64::min);
        if min > BOUND {
            let candidates = view.candidates(x, y, RADIUS_PX);
            let one = candidates.samples.len() == 1 && !candidates.background;
            // In triangles less than a pixel high, snapped vertices move the footprint by more than the bound allows.
            beyond += usize::from(one && sample.altitude_px >= 1.0);
        } else {
            worst = worst.max(min);
        }
    }
    texels.check().unwrap();
    // `possible` excuses the pixels just below the plane's horizon: one row in eighteen.
    assert!(10 * excused < judged, "{excused} excused beside {judged}");
    println!("{}, {camera}: worst within the bound {worst:.4}; beyond {beyond}", scene.name);
    beyond
}

#[test]
fn the_picture_is_the_f64_picture_with_any_border() {
    for (scene, camera, border, ratio) in CASES {
        let mut renderer = settled(scene, camera, border, |settings| filter(settings, ratio));
        let tile_size = renderer.technique.source.pyramid().tile_size();
        assert_eq!(beyond(&mut renderer, scene, camera, &ellipse(ratio, tile_size)), 0, "{scene}, {camera}");
    }
}

/// Near misses that must be rejected: another limit of the axes, another reach, fewer texels.
#[test]
fn another_ellipse_is_not_the_picture() {
    let mut renderer = settled("ruler", "corner-oblique", 4, |settings| filter(settings, 16));
    let own = ellipse(16, renderer.technique.source.pyramid().tile_size());
    for other in [own.max_ratio(1.0), own.within(8), own.minor_texels(1.0)] {
        let beyond = beyond(&mut renderer, "ruler", "corner-oblique", &other);
        assert!(beyond > 250, "{other:?}: {beyond}");
    }
}

#[test]
fn a_fused_draw_shows_and_lists_the_same() {
    let of = |fuse: bool| {
        let mut renderer = settled("earth", "oblique", 8, |settings| {
            filter(settings, 16);
            if fuse {
                settings.config.dedup = Dedup::FusedExact;
                settings.config.address = TileAddress::OwnLevel;
                settings.config.compact = Compaction::Append;
            }
        });
        let visible: BTreeSet<TileId> = renderer.records.last().unwrap().visible.iter().copied().collect();
        (renderer.picture_bytes().unwrap(), visible)
    };
    let (staged, fused) = (of(false), of(true));
    assert_eq!(staged.1, fused.1);
    assert!(staged.0 == fused.0);
}

/// A texture with the same byte everywhere.
struct Constant(Pyramid);

impl TileSource for Constant {
    fn describe(&self) -> String {
        "constant".into()
    }
    fn pyramid(&self) -> Pyramid {
        self.0
    }
    fn read_tile(&self, _: TileId, bytes: &mut [u8]) -> Result<(), TileError> {
        bytes.fill(119);
        Ok(())
    }
    fn read_resident_level(&self, level: u32) -> Result<Vec<u8>, TileError> {
        let [width, height] = self.0.level_size(level).map(|side| side as usize);
        Ok(vec![119; 4 * width * height])
    }
}

#[test]
fn a_constant_texture_comes_out_exactly_by_every_filter() {
    let scene = bordered("plane", 16);
    let (gpu, pyramid) = (device(), Pyramid::new(18, 17, 9, 16, None).unwrap());
    // A device's sampler weights texels in steps of 1/256, and sums of samples are rounded.
    let sampled = 1.0 / 512.0;
    let maps = FilterMap::ALL[1..].iter().map(|&map| (Filtering::Ellipse, 1, map, 0.0));
    let filters = [
        (Filtering::Ellipse, 1, 0.0),
        (Filtering::Trilinear, 1, sampled),
        (Filtering::Stochastic, 1, 0.0),
        (Filtering::Stochastic, 16, sampled),
        (Filtering::Feline, 1, 0.0),
        (Filtering::Mavridis, 1, 0.0),
        (Filtering::Pbrt, 1, 0.0),
        (Filtering::StochasticEllipse, 16, 0.0),
    ];
    let filters = filters.map(|(kind, samples, max)| (kind, samples, FilterMap::None, max));
    for (kind, samples, weight_map, max) in filters.into_iter().chain(maps) {
        let mut renderer = open_with(&gpu, &scene, SIZE, Arc::new(Constant(pyramid)), |settings| {
            filter(settings, 16);
            settings.config.filter = Filter { kind, samples, weight_map, ..settings.config.filter };
        });
        renderer.settle(&pose(&scene, "tilted")).unwrap();
        let pixels = renderer.linear_picture().unwrap().rgba;
        let exact = srgb8_to_linear(119);
        // The sky is far from the texture's colour.
        let off = |pixel: &[f32; 4]| (f64::from(pixel[0]) - exact).abs();
        let on: Vec<&[f32; 4]> = pixels.iter().filter(|pixel| off(pixel) < 0.02).collect();
        assert!(on.len() > pixels.len() / 3, "{kind:?} {samples}: {} pixels", on.len());
        let mut sky: Vec<[u32; 4]> =
            pixels.iter().filter(|pixel| off(pixel) >= 0.02).map(|pixel| pixel.map(f32::to_bits)).collect();
        sky.dedup();
        assert!(sky.len() <= 1, "{kind:?} {samples}: {sky:?}");
        let channels = || on.iter().flat_map(|pixel| &pixel[..3]).copied();
        let (min, largest) = (channels().fold(1.0, f32::min), channels().fold(0.0, f32::max));
        println!("{kind:?} {samples}: {min} to {largest}");
        assert!(largest - min <= max, "{kind:?} {samples} {weight_map:?}: {min} to {largest}");
    }
}
