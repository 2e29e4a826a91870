//! Stage 1 and the settled picture against the f64 reference, which shares no code with the shaders.

use crate::{device, landscapes, open, pose, scene};
use ortelius::math::camera::Pose;
use ortelius::paper::virtual_texture::config::source_mesh;
use ortelius::paper::virtual_texture::figures::stage1::{self, compare_triples};
use ortelius::paper::virtual_texture::reference::Tolerance;
use ortelius::paper::virtual_texture::reference::picture::{Filter, Texels};
use ortelius::paper::virtual_texture::{Interpolation, Settings};
use ortelius::picture::Picture;
use ortelius::picture::Target;
use ortelius::picture::error::{Difference, compare};
use ortelius::reference::{Sample, View};
use ortelius::scene::Scene;

/// [`stage1::radius_px`] of the largest picture here, rounded up.
pub const RADIUS_PX: f64 = 1.0 / 128.0;

/// [`stage1::tolerance`] on the Earth and its ruler, where an offset stays below 2^-7 (scene::mesh).
pub fn tolerance(sample: &Sample) -> Tolerance {
    stage1::tolerance(sample, 2f64.powi(-7), RADIUS_PX)
}

pub fn view_of(scene: &Scene, pose: &Pose, size: [u32; 2]) -> View {
    View::new(&source_mesh(scene).unwrap(), &pose.world_to_clip(size[0], size[1]), pose.eye, size)
}

#[test]
fn stage_1_differs_from_f64_only_at_borders_of_a_decision() {
    let gpu = device();
    let size = [320, 180];
    for name in landscapes() {
        let scene = scene(name);
        let mut renderer = open(&gpu, &scene, size, |_| ());
        for camera in scene.cameras.keys() {
            let pose = pose(&scene, camera);
            renderer.frame(&pose).unwrap();
            let dump = renderer.footprint().unwrap();
            let view = view_of(&scene, &pose, size);
            let mesh = source_mesh(&scene).unwrap();
            let check = compare_triples(&dump.triples, &view, &mesh, &renderer.technique.source.pyramid());
            println!("{name}, {camera}: {} of {} pixels differ", check.differing, check.pixels);
            let unexplained = &check.unexplained;
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
    let gpu = device();
    let size = [320, 180];
    let scene = scene("earth");
    let mut renderer = open(&gpu, &scene, size, |_| ());
    let pose = pose(&scene, "oblique");
    renderer.frame(&pose).unwrap();
    let dump = renderer.footprint().unwrap();
    let mut beside = pose;
    let angle = 0.1 * pose.vertical_fov_rad / f64::from(size[1]);
    beside.forward = (pose.forward + pose.right * angle).normalize();
    beside.right = (pose.right - pose.forward * angle).normalize();
    let (mesh, view) = (source_mesh(&scene).unwrap(), view_of(&scene, &beside, size));
    let check = compare_triples(&dump.triples, &view, &mesh, &renderer.technique.source.pyramid());
    assert!(!check.unexplained.is_empty());
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
    let gpu = device();
    let size = [640, 360];
    let pose = pose(scene, camera);
    let mut renderer = open(&gpu, scene, size, |settings| {
        settings.target = Target::Linear32;
        settings.streaming.gpu_tiles = 192;
        change(settings);
    });
    renderer.settle(&pose).unwrap();
    assert_eq!(renderer.technique.bias(), 0);
    let floats: Vec<[f32; 4]> =
        renderer.picture_bytes().unwrap().chunks_exact(16).map(bytemuck::pod_read_unaligned).collect();
    let view = view_of(scene, &pose, size);
    let truth = Texels::new(&*renderer.technique.source).picture(&view, Filter::Samples(1)).unwrap();
    let difference = compare(&Picture::new(size[0], size[1], floats), &truth).unwrap();
    let one_triangle = |x, y| {
        let candidates = view.candidates(x, y, RADIUS_PX);
        // Below a pixel's height, snapped vertices move the level by more than BOUND allows.
        candidates.samples.len() + usize::from(candidates.background) == 1
            && candidates.samples.iter().all(|sample| sample.altitude_px >= 1.0)
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
        settings.config.filter.interpolation = Interpolation::Literal;
    });
    assert!(beyond > 100, "{beyond}");
}
