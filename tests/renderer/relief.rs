//! A relief below a plane against the f64 mean of rays that hit it, and surfaces that cannot have one.

use crate::scenes::SIZE;
use crate::{settled, silent};
use ortelius::Renderer;
use ortelius::paper::texture_mapping::config::side_of;
use ortelius::paper::texture_mapping::relief::reference::first_hit;
use ortelius::paper::texture_mapping::relief::{Kind, Ray, Relief};
use ortelius::picture::Target;
use ortelius::reference::ReferenceView;
use ortelius::reference::filter::srgb8_to_linear;
use ortelius::reference::supersample::{Density, Kernel, Tiled, Truth, supersample};
use ortelius::renderer::Options;
use ortelius::scene::Scene;

/// The scene of a shipped default picture without light, so that colours are the texture's.
fn unlit(name: &str, changes: &[&str]) -> Scene {
    let all = ["surface.SURFACE.lit=false"];
    let scene = Scene::embedded(name).unwrap();
    let surface = scene.surfaces.keys().next().unwrap().clone();
    let changes = all.iter().chain(changes).map(|change| change.replace("SURFACE", &surface));
    scene.with(&changes.collect::<Vec<_>>()).unwrap()
}

/// The truth of the green channel, for a relief of this kind that reaches `depth_m` below a plane of 4 m.
fn truth(scene: &Scene, kind: Kind, depth_m: f64) -> Truth {
    let side = side_of(kind);
    let relief = Relief { depth: (depth_m / 4.0 * side as f64) as f32, ..kind.relief(side) };
    let bytes: Vec<f64> = kind.picture(side).iter().map(|[_, green, _]| srgb8_to_linear(*green)).collect();
    let pose = scene.pose(0).unwrap();
    let surface = scene.surfaces.values().next().unwrap();
    let view =
        ReferenceView::new(&surface.grid().unwrap(), &pose.world_to_clip(SIZE[0], SIZE[1]), pose.eye, SIZE);
    let texels = side as f64;
    let eye = [
        (pose.eye.x / 4.0 + 0.5) * texels - 0.5,
        (0.5 - pose.eye.y / 4.0) * texels - 0.5,
        pose.eye.z / 4.0 * texels,
    ];
    let hit = |x: f64, y: f64| {
        let [s, t] = view.coordinate(x, y)?;
        let at = [s, t].map(|c| c * texels - 0.5);
        let towards = [at[0] - eye[0], at[1] - eye[1], -eye[2]];
        let length = towards.iter().map(|c| c * c).sum::<f64>().sqrt();
        let direction = towards.map(|c| c / length);
        let ray = Ray { origin: at.map(|c| c as f32), direction: direction.map(|c| c as f32) };
        let distance = first_hit(&relief, &ray);
        Some([0, 1].map(|n| at[n] + distance * direction[n] + 0.5))
    };
    let colour = |[u, v]: [f64; 2]| bilinear(&bytes, side, u - 0.5, v - 0.5);
    supersample(SIZE, hit, colour, Kernel::Box, Density { per_texel: 0.0, least: 12, most: 12 })
}

fn bilinear(values: &[f64], side: usize, x: f64, y: f64) -> f64 {
    let at = |a: f64, b: f64| {
        let wrap = |c: f64| (c.rem_euclid(side as f64)) as usize % side;
        values[wrap(y.floor() + b) * side + wrap(x.floor() + a)]
    };
    let (fx, fy) = (x - x.floor(), y - y.floor());
    (at(0.0, 0.0) * (1.0 - fx) + at(1.0, 0.0) * fx) * (1.0 - fy)
        + (at(0.0, 1.0) * (1.0 - fx) + at(1.0, 1.0) * fx) * fy
}

/// The NMSE of the green channel, over the pixels that lie wholly on the plane.
fn nmse(scene: &Scene, truth: &Truth) -> f64 {
    let mut renderer = settled(scene, Target::Linear32);
    let bytes = renderer.picture_bytes().unwrap();
    silent(&renderer);
    let found: Vec<[f32; 4]> = bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect();
    let whole = || (0..found.len()).filter(|&n| truth.whole[n]);
    assert!(whole().count() > found.len() / 3, "{} whole pixels", whole().count());
    let square: f64 = whole().map(|n| (f64::from(found[n][1]) - truth.values[n]).powi(2)).sum();
    square / whole().map(|n| truth.values[n].powi(2)).sum::<f64>()
}

#[test]
fn a_relief_is_near_the_mean_of_exact_rays_and_a_flat_plane_is_not() {
    for (name, kind, depth_m, flat) in [
        ("relief-brick", Kind::Bricks, 0.06, "surface.SURFACE.relief.depth_m=1e-6"),
        ("relief-rock", Kind::Rock, 0.25, "surface.SURFACE.relief.depth_m=1e-6"),
    ] {
        let scene = unlit(name, &[]);
        let truth = truth(&scene, kind, depth_m);
        let [own, flat] = [nmse(&scene, &truth), nmse(&unlit(name, &[flat]), &truth)];
        println!("{name}: {own:.2e}, flat {flat:.2e}, the truth's own {:.2e}", truth.own_nmse);
        assert!(own < 5e-3 && flat > 4.0 * own, "{name}: {own:.2e}, flat {flat:.2e}");
    }
}

#[test]
fn a_surface_that_cannot_carry_a_relief_says_why() {
    let brick = Scene::embedded("relief-brick").unwrap();
    let refused = |changes: &[&str]| {
        let changes: Vec<String> = changes.iter().map(|change| (*change).to_string()).collect();
        let error = match brick.with(&changes) {
            Err(error) => error.to_string(),
            Ok(scene) => Renderer::open(&scene, &Options::default()).err().expect("refused").to_string(),
        };
        // The following lines show the line of the scene.
        error.lines().next().expect("a line").to_string()
    };
    for (changes, expected) in [
        (&["surface.floor.geometry.height_m=2.0"][..], "width_m and height_m"),
        (&["surface.floor.filter.kind=ellipse"], "omit filter"),
        (&["surface.floor.relief.map=file"], "path"),
        (&["surface.floor.relief.path=x.png"], "path"),
        (&["surface.floor.relief.method=trace", "surface.floor.relief.depth_m=2.0"], "projected-width"),
    ] {
        let error = refused(changes);
        assert!(error.contains(expected) && error.contains("surface.floor"), "{error}");
    }
}

#[test]
fn a_relief_from_a_file_is_that_relief() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, [width, height]: [u32; 2], byte: &dyn Fn(u32, u32) -> u8| {
        let picture = image::GrayImage::from_fn(width, height, |x, y| image::Luma([byte(x, y)]));
        picture.save(folder.path().join(name)).unwrap();
    };
    let relief = Kind::Bricks.relief(256);
    write("bricks.png", [256; 2], &|x, y| relief.heights[(y * 256 + x) as usize]);
    write("wide.png", [256, 128], &|_, _| 0);
    let of = |name: &str| {
        let path = folder.path().join(name).display().to_string();
        let changes =
            ["surface.floor.relief.map=file".to_string(), format!("surface.floor.relief.path={path}")];
        Scene::embedded("relief-brick").unwrap().with(&changes).unwrap()
    };
    let bytes = |scene: &Scene| {
        let options = Options { size: Some(SIZE), ..Options::default() };
        let mut renderer = Renderer::open(scene, &options).unwrap();
        renderer.settle(&scene.pose(0).unwrap()).unwrap();
        renderer.picture().unwrap().rgba
    };
    assert_eq!(bytes(&of("bricks.png")), bytes(&Scene::embedded("relief-brick").unwrap()));
    let wide = Renderer::open(&of("wide.png"), &Options::default()).err().expect("refused").to_string();
    assert!(wide.contains("256 x 128") && wide.contains("power of two"), "{wide}");
}

#[test]
fn the_truths_texture_is_bilinear() {
    let bytes: Vec<u8> = (0..64).map(|n| (n * 37 % 256) as u8).collect();
    let (tiled, values) = (Tiled::new(8, &bytes), bytes.iter().map(|byte| f64::from(*byte) / 255.0));
    let values: Vec<f64> = values.collect();
    for n in 0..50 {
        let at = [f64::from(n) * 0.37, f64::from(n) * 0.73];
        let found = bilinear(&values, 8, at[0] - 0.5, at[1] - 0.5);
        assert!((found - tiled.at(at)).abs() < 1e-12, "{at:?}");
    }
}
