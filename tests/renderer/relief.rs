//! A relief below a plane against the f64 mean of rays that hit it, and surfaces that cannot have one.

use crate::scenes::SIZE;
use crate::{greens, nmse, settled, silent};
use ortelius::Renderer;
use ortelius::paper::texture_mapping::config::side_of;
use ortelius::paper::texture_mapping::relief::reference::first_hit;
use ortelius::paper::texture_mapping::relief::shipped::{BRICK_WALL, CLIFF};
use ortelius::paper::texture_mapping::relief::{Ray, Relief, ReliefKind};
use ortelius::picture::PixelFormat;
use ortelius::reference::ReferenceView;
use ortelius::reference::filter::srgb8_to_linear;
use ortelius::reference::supersample::{Density, PixelKernel, Tiled, Truth, supersample};
use ortelius::renderer::Options;
use ortelius::scene::Scene;

/// The least number of pixels whose kernel lies wholly on the surface.
const WHOLE: usize = (SIZE[0] * SIZE[1] / 3) as usize;

/// A shipped scene without light, so that colours are the texture's.
fn unlit(name: &str, changes: &[&str]) -> Scene {
    let all = ["surface.SURFACE.lit=false"];
    let scene = Scene::embedded(name).unwrap();
    let surface = scene.surfaces.keys().next().unwrap().clone();
    let changes = all.iter().chain(changes).map(|change| change.replace("SURFACE", &surface));
    scene.with(&changes.collect::<Vec<_>>()).unwrap()
}

/// Texels along a side of a relief's colours, and the colours.
type Colours = (usize, Vec<[u8; 3]>);

/// The truth of the green channel, for a plane of 4 m with this relief, `depth_m` deep, and these colours.
fn truth(scene: &Scene, relief: Relief, (colours, picture): Colours, depth_m: f64) -> Truth {
    let side = relief.side;
    let relief = Relief { depth: (depth_m / 4.0 * side as f64) as f32, ..relief };
    let bytes: Vec<f64> = picture.iter().map(|[_, green, _]| srgb8_to_linear(*green)).collect();
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
    let finer = colours as f64 / texels;
    let colour = |[u, v]: [f64; 2]| bilinear(&bytes, colours, finer * u - 0.5, finer * v - 0.5);
    supersample(SIZE, hit, colour, PixelKernel::Box, Density { per_texel: 0.0, min: 12, max: 12 })
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

#[test]
fn a_relief_is_near_the_mean_of_exact_rays_and_a_flat_plane_is_not() {
    let generated =
        |kind: ReliefKind| (kind.relief(side_of(kind)), (side_of(kind), kind.picture(side_of(kind))));
    let [wall, cliff] = [BRICK_WALL, CLIFF].map(|shipped| (shipped.relief(), shipped.picture()));
    // Two bounds are wider. The joints of the brick wall are two texels wide and ten times as bright as its bricks. A
    // pixel of the cliff takes only one ray.
    for (name, map, (relief, colours), depth_m, max) in [
        ("relief-brick", "brick-wall", wall, 0.06, 3e-2),
        ("relief-rock", "cliff", cliff, 0.12, 3e-2),
        ("relief-brick", "bricks", generated(ReliefKind::Bricks), 0.06, 5e-3),
        ("relief-rock", "rock", generated(ReliefKind::Rock), 0.25, 5e-3),
    ] {
        let of = |depth_m: f64| {
            let relief = format!("surface.SURFACE.relief.depth_m={depth_m}");
            let maps = ["texture.source", "relief.map"].map(|key| format!("surface.SURFACE.{key}={map}"));
            unlit(name, &[&maps[0], &maps[1], &relief])
        };
        let scene = of(depth_m);
        let truth = truth(&scene, relief, colours, depth_m);
        let [own, flat] = [scene, of(1e-6)].map(|scene| nmse(&greens(&scene), &truth, WHOLE));
        println!("{name} {map}: {own:.2e}, flat {flat:.2e}, the truth's own {:.2e}", truth.own_nmse());
        assert!(own < max && flat > 4.0 * own, "{name} {map}: {own:.2e}, flat {flat:.2e}");
    }
}

/// Heights with 32 texels a side and colours with 512: a pixel near the camera is smaller than a texel of the heights
/// and larger than a texel of the colours.
#[test]
fn colours_finer_than_the_heights_keep_their_detail() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("heights.png");
    let relief = ReliefKind::Rock.relief(32);
    image::GrayImage::from_raw(32, 32, relief.heights.clone()).unwrap().save(&path).unwrap();
    let colours = CLIFF.picture();
    let changes = [
        "surface.SURFACE.texture.source=cliff".to_string(),
        "surface.SURFACE.relief.map=file".to_string(),
        format!("surface.SURFACE.relief.path={}", path.display()),
        "cameras.low.altitude_m=0.2".to_string(),
    ];
    let scene = unlit("relief-brick", &changes.each_ref().map(|change| change.as_str()));
    let of = |colours: Colours| truth(&scene, relief.clone(), colours, 0.06);
    let mean = |at: usize| {
        let corner = at / 32 * 16 * 512 + at % 32 * 16;
        let inside = (0..16 * 16).map(|n| u32::from(colours.1[corner + n / 16 * 512 + n % 16][1]));
        [(inside.sum::<u32>() / 256) as u8; 3]
    };
    let coarse: Vec<[u8; 3]> = (0..32 * 32).map(mean).collect();
    let (truth, coarse) = (of(colours), of((32, coarse)));
    let own = nmse(&greens(&scene), &truth, WHOLE);
    let whole = || (0..truth.whole.len()).filter(|&n| truth.whole[n]);
    let lost: f64 = whole().map(|n| (coarse.values[n] - truth.values[n]).powi(2)).sum();
    let lost = lost / whole().map(|n| truth.values[n].powi(2)).sum::<f64>();
    println!("{own:.2e}, with a colour per texel of the heights {lost:.2e}");
    assert!(own < 2e-2 && lost > 4.0 * own, "{own:.2e}, {lost:.2e}");
}

/// A pixel of this view is smaller than a texel, so a traced pixel shows the bilinear colour at its centre's hit. A
/// relief that is a twentieth shallower must have ten times the error.
#[test]
fn every_tracer_shows_the_colour_at_the_exact_hit() {
    let (kind, side) = (ReliefKind::Rock, side_of(ReliefKind::Rock));
    let (relief, picture) = (kind.relief(side), kind.picture(side));
    let relief = Relief { depth: (0.2 / 4.0 * side as f64) as f32, ..relief };
    let colours: Vec<f64> = picture.iter().map(|[_, green, _]| srgb8_to_linear(*green)).collect();
    let shallower = Relief { depth: 0.95 * relief.depth, heights: relief.heights.clone(), ..relief };
    let of = |method: &str, precision: Option<&str>| {
        let keys = ["texture.source=rock", "relief.map=rock", "relief.depth_m=0.2"];
        let keys = keys.map(|key| format!("surface.SURFACE.{key}")).into_iter();
        let keys = keys.chain([format!("surface.SURFACE.relief.method={method}")]);
        let keys = keys.chain(precision.map(|bits| format!("surface.SURFACE.relief.map_precision={bits}")));
        let camera = ["north_m=-0.2", "altitude_m=0.4", "tilt_deg=40"];
        let keys: Vec<String> = keys.chain(camera.map(|key| format!("cameras.low.{key}"))).collect();
        unlit("relief-brick", &keys.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let [right, wrong] =
        [&relief, &shallower].map(|relief| colours_at_hits(&of("trace", None), relief, &colours));
    for (method, precision) in [
        ("trace", None),
        ("trace", Some("16-bit")),
        ("trace", Some("8-bit")),
        ("trace-donnelly", None),
        ("trace-donnelly", Some("8-bit")),
        ("trace-cones", None),
        ("trace-relaxed-cones", None),
        ("trace-linear", None),
    ] {
        let mut renderer = settled(&of(method, precision), PixelFormat::Linear32);
        let found = renderer.linear_picture().unwrap().rgba;
        silent(&renderer);
        let (error, off) = hit_error(&found, &right);
        println!("{method} {precision:?}: NMSE {error:.2e}, {off:.4} of the pixels off by more than 0.02");
        let (wrong, _) = hit_error(&found, &wrong);
        assert!(
            10.0 * error < wrong,
            "{method} {precision:?}: {error:.2e}, a twentieth shallower {wrong:.2e}"
        );
    }
}

/// For each pixel, the green channel of the colour at the exact hit of its centre's ray; `None` beyond the plane.
fn colours_at_hits(scene: &Scene, relief: &Relief, colours: &[f64]) -> Vec<Option<f64>> {
    let pose = scene.pose(0).unwrap();
    let surface = scene.surfaces.values().next().unwrap();
    let view =
        ReferenceView::new(&surface.grid().unwrap(), &pose.world_to_clip(SIZE[0], SIZE[1]), pose.eye, SIZE);
    let texels = relief.side as f64;
    let eye = [
        (pose.eye.x / 4.0 + 0.5) * texels - 0.5,
        (0.5 - pose.eye.y / 4.0) * texels - 0.5,
        pose.eye.z / 4.0 * texels,
    ];
    let of_pixel = |at: u32| {
        let [x, y] = [at % SIZE[0], at / SIZE[0]].map(|c| f64::from(c) + 0.5);
        let at = view.coordinate(x, y)?.map(|c| c * texels - 0.5);
        let towards = [at[0] - eye[0], at[1] - eye[1], -eye[2]];
        let length = towards.iter().map(|c| c * c).sum::<f64>().sqrt();
        let direction = towards.map(|c| c / length);
        let ray = Ray { origin: at.map(|c| c as f32), direction: direction.map(|c| c as f32) };
        let distance = first_hit(relief, &ray);
        let [u, v] = [0, 1].map(|n| at[n] + distance * direction[n]);
        Some(bilinear(colours, relief.side, u, v))
    };
    (0..SIZE[0] * SIZE[1]).map(of_pixel).collect()
}

/// The NMSE of a picture's green channel against the colours at the exact hits, and the share of pixels whose error
/// exceeds 0.02.
fn hit_error(found: &[[f32; 4]], right: &[Option<f64>]) -> (f64, f64) {
    let pair = |(own, right): (&[f32; 4], &Option<f64>)| Some([f64::from(own[1]), (*right)?]);
    let pairs: Vec<[f64; 2]> = found.iter().zip(right).filter_map(pair).collect();
    assert!(pairs.len() > (SIZE[0] * SIZE[1]) as usize / 3, "{} pixels show the plane", pairs.len());
    let square: f64 = pairs.iter().map(|[own, right]| (own - right).powi(2)).sum();
    let off = pairs.iter().filter(|[own, right]| (own - right).abs() > 0.02).count();
    let off = off as f64 / pairs.len() as f64;
    (square / pairs.iter().map(|[_, right]| right * right).sum::<f64>(), off)
}

/// Without depth, the filters sum the same texels. With depth, each is nearer to the mean of exact rays than the
/// filters below it in this order: the projected width, the other filters that trace the footprint's rays, the offset,
/// which traces no ray, and a plane without relief.
#[test]
fn every_filter_of_a_footprint_is_near_the_mean_of_exact_rays() {
    const FLAT_M: f64 = 1e-6;
    const DEEP_M: f64 = 0.06;
    let (kind, side) = (ReliefKind::Bricks, side_of(ReliefKind::Bricks));
    let of = |method: &str, depth_m: f64| {
        let keys = ["texture.source=bricks".to_owned(), "relief.map=bricks".to_owned()];
        let keys =
            keys.into_iter().chain([format!("relief.method={method}"), format!("relief.depth_m={depth_m}")]);
        let keys: Vec<String> = keys.map(|key| format!("surface.SURFACE.{key}")).collect();
        unlit("relief-brick", &keys.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let truths = [FLAT_M, DEEP_M].map(|depth_m| {
        truth(&of("projected-width", depth_m), kind.relief(side), (side, kind.picture(side)), depth_m)
    });
    let pictures = |method| [FLAT_M, DEEP_M].map(|depth_m| greens(&of(method, depth_m)));
    let errors =
        |[flat, deep]: &[Vec<f64>; 2]| [nmse(flat, &truths[0], WHOLE), nmse(deep, &truths[1], WHOLE)];
    let projected = pictures("projected-width");
    let (best, ignoring) = (errors(&projected), nmse(&projected[0], &truths[1], WHOLE));
    // A traced ray takes the sampler's trilinear filter instead of the footprint's texels.
    let sampler = nmse(&greens(&of("trace-linear", FLAT_M)), &truths[0], WHOLE);
    println!("projected-width: {best:?}, without relief {ignoring:.2e}, flat by the sampler {sampler:.2e}");
    let offset = errors(&pictures("offset"));
    assert!(best[1] < offset[1] && offset[1] < ignoring, "offset: {offset:?}");
    let whole = pictures("whole-footprint");
    for method in ["visible-texels", "whole-footprint", "unperturbed-derivatives", "offset"] {
        let shown = pictures(method);
        let [flat, deep] = errors(&shown);
        // Seen from 0.7 m, the plane's farthest corner is 4.7 m away, so a ray advances by at most 7 texels per texel
        // of descent. Without depth these are 4.5e-4 texels or, in steps of 1/32 texel, 0.015 steps. So each of a
        // footprint's two ends passes a step in at most 1.5 % of the pixels.
        let other = shown[0].iter().zip(&whole[0]).filter(|(a, b)| (*a - *b).abs() > 1e-5).count();
        println!("{method}: flat {flat:.2e}, deep {deep:.2e}, {other} other pixels than the whole footprint");
        assert!(other * 100 <= 3 * whole[0].len(), "{method}: {other} pixels");
        // The projected width takes the parts of the texels at the ends, a box all or nothing.
        assert!(best[0] < flat && flat < sampler, "{method}: flat {flat:.2e}");
        assert!(method == "offset" || best[1] < deep && deep < offset[1], "{method}: deep {deep:.2e}");
    }
}

#[test]
fn a_near_oblique_view_of_a_deep_relief_has_a_colour_in_every_pixel() {
    // A step is a 32nd of a texel here, and descents are thousands of steps long.
    let near = |map: &str| {
        let maps = ["texture.source=bricks", "relief.depth_m=0.5", &format!("relief.map={map}")]
            .map(|change| format!("surface.SURFACE.{change}"));
        let camera =
            ["north_m=0.0", "altitude_m=0.02", "tilt_deg=75"].map(|change| format!("cameras.low.{change}"));
        unlit("relief-brick", &maps.iter().chain(&camera).map(String::as_str).collect::<Vec<_>>())
    };
    for map in ["bricks", "pillars"] {
        let mut renderer = settled(&near(map), PixelFormat::Linear32);
        let values = renderer.linear_picture().unwrap().rgba;
        silent(&renderer);
        assert!(values.as_flattened().iter().all(|value| value.is_finite()), "{map}");
    }
    let (scene, side) = (near("bricks"), side_of(ReliefKind::Bricks));
    let truth = truth(&scene, ReliefKind::Bricks.relief(side), (side, ReliefKind::Bricks.picture(side)), 0.5);
    let own = nmse(&greens(&scene), &truth, WHOLE);
    println!("{own:.2e}, the truth's own {:.2e}", truth.own_nmse());
    assert!(own < 2e-2, "{own:.2e}");
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
        (&["surface.floor.relief.map_precision=8-bit"], "distance map"),
        (
            &["surface.floor.relief.method=trace-cones", "surface.floor.relief.map_precision=8-bit"],
            "distance map",
        ),
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
    let relief = ReliefKind::Bricks.relief(256);
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
    let generated = ["surface.floor.relief.map=bricks".to_string()];
    let generated = Scene::embedded("relief-brick").unwrap().with(&generated).unwrap();
    assert_eq!(bytes(&of("bricks.png")), bytes(&generated));
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
