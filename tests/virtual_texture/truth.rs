//! Stage 1 and the settled picture against the f64 reference, which shares no code with the shaders.

use crate::{Device, open, pose, scene};
use ortelius::math::camera::Pose;
use ortelius::math::pyramid::Pyramid;
use ortelius::paper::virtual_texture::Interpolation;
use ortelius::paper::virtual_texture::reference::picture::{Filter, Texels, footprint};
use ortelius::paper::virtual_texture::reference::{Tolerance, possible_triples, triple};
use ortelius::picture::Picture;
use ortelius::picture::error::{Difference, compare};
use ortelius::reference::{Sample, View};
use ortelius::renderer::{Settings, Target};
use ortelius::scene::{SHIPPED, Scene};

/// How far, in pixels, a device may see beside the reference. It snaps vertices to 1/256 pixel (lavapipe's
/// subPixelPrecisionBits = 8), which moves an edge by half of that; its clip coordinates are f32 products of
/// 4 terms, 2^-22 of at most 10 screen heights: 1/390 pixel at 1080 rows. Twice their sum:
pub const RADIUS_PX: f64 = 1.0 / 128.0;

/// The f32 error of (s, t) and of the derivatives: the place moves by RADIUS_PX; an offset of at most 2^-7 is
/// interpolated with a relative error of 2^-21 (three products and a division); a derivative is the difference of
/// two such values, each of which also carries the rounding of a plane equation extrapolated over the screen,
/// 2^-21 of 2000 pixels' worth of gradient: 2^-10.
pub fn tolerance(sample: &Sample) -> Tolerance {
    let d = &sample.fine;
    let gradient = [d.dsdx.abs() + d.dsdy.abs(), d.dtdx.abs() + d.dtdy.abs()];
    let offset = 2f64.powi(-7 - 21);
    Tolerance {
        coordinate: gradient.map(|g| RADIUS_PX * g + offset),
        derivative: gradient.map(|g| (2f64.powi(-10) + RADIUS_PX / 4.0) * g + 2.0 * offset),
    }
}

/// (differing pixels, those that no decision border explains).
fn compare_triples(triples: &[[u32; 3]], view: &View, pyramid: &Pyramid) -> (usize, Vec<String>) {
    let [width, _] = view.size();
    let (mut differing, mut unexplained) = (0, Vec::new());
    for (index, found) in triples.iter().enumerate() {
        let (x, y) = (index as u32 % width, index as u32 / width);
        let truth = view.sample(x, y).map(|sample| triple(&footprint(&sample), pyramid, 1));
        let equal = match truth {
            None => found[0] == u32::MAX,
            Some(truth) => *found == [truth.q, truth.i, truth.j],
        };
        if equal {
            continue;
        }
        differing += 1;
        let candidates = view.candidates(x, y, RADIUS_PX);
        let explained = match found[0] {
            u32::MAX => candidates.background,
            _ => candidates.samples.iter().any(|sample| {
                let possible = possible_triples(&footprint(sample), &tolerance(sample), pyramid, 1);
                found.iter().zip(possible).all(|(value, [low, high])| (low..=high).contains(value))
            }),
        };
        if !explained {
            unexplained.push(format!("({x}, {y}): {found:?}, not {truth:?}"));
        }
    }
    (differing, unexplained)
}

pub fn view_of(scene: &Scene, pose: &Pose, size: [u32; 2]) -> View {
    View::new(&scene.source_mesh().unwrap(), &pose.world_to_clip(size[0], size[1]), pose.eye, size)
}

#[test]
fn stage_1_differs_from_f64_only_at_borders_of_a_decision() {
    let gpu = Device::open();
    let size = [320, 180];
    for (name, _) in SHIPPED {
        let scene = scene(name);
        let mut renderer = open(&gpu, &scene, size, |_| ());
        for camera in scene.cameras.keys() {
            let pose = pose(&scene, camera);
            let dump = renderer.footprint(&pose).unwrap();
            let view = view_of(&scene, &pose, size);
            let (differing, unexplained) = compare_triples(&dump.triples, &view, &renderer.source.pyramid());
            println!("{name}, {camera}: {differing} of {} pixels differ", size[0] * size[1]);
            assert!(
                unexplained.is_empty(),
                "{name}, {camera}: {} {:#?}",
                unexplained.len(),
                &unexplained[..unexplained.len().min(8)]
            );
        }
    }
}

/// The neighbour that must be rejected: the same comparison with an eye that stands a tenth of a pixel elsewhere.
#[test]
fn a_tenth_of_a_pixel_is_not_explained() {
    let gpu = Device::open();
    let size = [320, 180];
    let scene = scene("earth");
    let mut renderer = open(&gpu, &scene, size, |_| ());
    let pose = pose(&scene, "oblique");
    let dump = renderer.footprint(&pose).unwrap();
    let mut beside = pose;
    let angle = 0.1 * pose.vertical_fov_rad / f64::from(size[1]);
    beside.forward = (pose.forward + pose.right * angle).normalize();
    beside.right = (pose.right - pose.forward * angle).normalize();
    let (_, unexplained) =
        compare_triples(&dump.triples, &view_of(&scene, &beside, size), &renderer.source.pyramid());
    assert!(!unexplained.is_empty());
}

/// What a pixel may be off, in linear light of 0 ..= 1. The sampler weighs with 8 bits (subTexelPrecisionBits and
/// mipmapPrecisionBits): 2^-8 of the contrast between neighbours, twice in a level and once between levels, and the
/// place is known to RADIUS_PX, 2^-7 of it: together less than 5/256 where the contrast is 1, black beside white.
const BOUND: f64 = 5.0 / 256.0;

/// The settled picture of a scene in linear light, the f64 picture, and the pixels beyond BOUND that lie inside one
/// triangle: at silhouettes and at edges another triangle, or none, is as right.
fn settled_beside_truth(
    scene: &Scene,
    camera: &str,
    change: impl FnOnce(&mut Settings),
) -> (Difference, usize) {
    let gpu = Device::open();
    let size = [640, 360];
    let pose = pose(scene, camera);
    let mut renderer = open(&gpu, scene, size, |settings| {
        settings.target = Target::Linear32;
        settings.streaming.gpu_tiles = 192;
        change(settings);
    });
    renderer.settle(&pose).unwrap();
    assert_eq!(renderer.bias(), 0);
    let floats: Vec<[f32; 4]> =
        renderer.picture_bytes().unwrap().chunks_exact(16).map(bytemuck::pod_read_unaligned).collect();
    let view = view_of(scene, &pose, size);
    let truth = Texels::new(&*renderer.source).picture(&view, Filter::Samples(1)).unwrap();
    let difference = compare(&Picture::new(size[0], size[1], floats), &truth).unwrap();
    let one_triangle = |x, y| {
        let candidates = view.candidates(x, y, RADIUS_PX);
        candidates.samples.len() + usize::from(candidates.background) == 1
    };
    let beyond =
        difference.pixels().filter(|error| error.value > BOUND && one_triangle(error.x, error.y)).count();
    let worst = difference.worst().unwrap();
    println!(
        "{}, {camera}: worst pixel {:.5} at ({}, {}), NMSE {:.2e}, {} pixels above {BOUND:.4}, of them {beyond} inside a triangle",
        scene.name,
        worst.value,
        worst.x,
        worst.y,
        difference.nmse(),
        difference.count_above(BOUND),
    );
    (difference, beyond)
}

#[test]
fn the_settled_picture_is_the_f64_picture_within_the_samplers_precision() {
    for (name, camera) in [
        ("earth", "headline"),
        ("earth", "oblique"),
        ("globe", "africa"),
        ("plane", "tilted"),
        ("pole", "above"),
    ] {
        let (difference, beyond) = settled_beside_truth(&scene(name), camera, |_| ());
        assert_eq!(beyond, 0, "{name}, {camera}");
        // BOUND everywhere would be 4e-4 of a white picture; a mean is to be far below the worst.
        assert!(difference.nmse() < 1e-4, "{name}, {camera}");
    }
}

/// The neighbour that must be rejected: the paper's interpolation as printed, the wrong way round.
#[test]
fn the_printed_interpolation_is_not_the_f64_picture() {
    let (_, beyond) = settled_beside_truth(&scene("earth"), "oblique", |settings| {
        settings.config.interpolation = Interpolation::Literal;
    });
    assert!(beyond > 100, "{beyond}");
}
