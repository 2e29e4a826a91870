//! Scenes of progressive meshes: their keys, and the poses of their instances.

use crate::{SMALL, load};
use glam::DVec3;
use ortelius::math::geodesy::{ecef_to_geodetic, geodetic_to_ecef, local_frame};
use ortelius::model::Model;
use ortelius::paper::progressive_mesh::config::{self, ModelSource};
use ortelius::paper::progressive_mesh::load::load as models;
use ortelius::paper::progressive_mesh::stand::{Stand, stands};
use ortelius::scene::Scene;

const EYE: &str = "
[view]
width = 64
height = 36
camera = \"a\"

[cameras.a]
east_m = 1.0
north_m = 2.0
altitude_m = 300e3

[paths.down]
kind = \"dive\"
camera = \"a\"
to_altitude_m = 10.0
frames = 5
";

/// A herd with additional keys.
fn herd(lines: &str) -> String {
    format!(
        "[surface.herd.geometry]\nkind = \"progressive-mesh\"\nsource = \"bunny\"\nsize_m = 2.0\n{lines}\n{EYE}"
    )
}

#[test]
fn a_herd_needs_no_texture_and_has_its_documented_values() {
    let scene = load(herd("")).unwrap();
    let herd = config::surface(&scene, "herd").unwrap();
    assert_eq!(herd.source, ModelSource::Named("bunny".into()));
    assert_eq!((herd.instances, herd.error_pixels, herd.geomorph), (1, 1.0, false));
    assert_eq!(herd.order, config::DEFAULT_ORDER);
    assert_eq!(stands(&scene, &herd), [Stand::on_plane(DVec3::ZERO, 0.0)]);
    assert_eq!(scene.pose(0).unwrap().eye, DVec3::new(1.0, 2.0, 300e3));
    assert_eq!(config::names(&scene).collect::<Vec<_>>(), ["herd"]);
}

#[test]
fn a_wrong_value_of_a_herd_is_rejected_at_its_key() {
    for (line, expected) in [
        ("instances = 0", "0 is outside 1 ..= 100000"),
        ("instances = 3", "a grid needs area_m"),
        ("area_m = [1.0, 2.0, 3.0]", "[1.0, 2.0, 3.0] is not a list of 2 numbers"),
        ("area_m = [1.0, -2.0]", "-2 is outside 0 ..="),
        ("error_pixels = -1.0", "-1 is outside 0 ..="),
        ("error_pixels = nan", "NaN is outside"),
        ("order = \"best\"", "\"best\" is not one of \"classical\", \"paper\", \"tail-23\""),
        ("order = \"ours-few-moves\"", "\"ours-few-moves\" is now \"tail-10\""),
        ("order = \"skip-lists\"\napply = \"gpu\"", "is a baseline and executes no splits"),
        ("order = \"discrete\"\ngeomorph = true", "have no splits to morph; leave geomorph out"),
        (
            "geomorph = true\n[surface.herd.texture]\nkind = \"plain\"\nsource = \"checker\"",
            "leave out geomorph, or the texture",
        ),
        ("layout = \"along\"", "a layout along a path needs path"),
        ("layout = \"along\"\npath = \"up\"", "has no path \"up\"; it has down"),
        ("layout = \"scatter\"\nseed = 3\naside_m = 2.0", "a scatter has no aside_m"),
        ("seed = 3", "a grid has no seed"),
        ("east_m = 1e10", "10000000000 is outside"),
        ("latitude_deg = 1.0", "a mesh over a plane has no latitude_deg"),
        ("ground = \"sea\"", "no surface \"sea\"; there are herd"),
        ("ground = \"herd\"", "herd has a ground itself"),
        ("\n[governor]\nframe_ms = 0.0", "0 is outside 0.001 ..="),
        ("\n[governor]\nframe_faces = 0", "0 is outside 1 ..="),
        ("\n[governor]\n", "a governor needs a budget"),
    ] {
        let error = load(herd(line)).expect_err(line).to_string();
        assert!(error.contains("small.toml:") && error.contains(expected), "{line}: {error}");
    }
}

/// The poses of `herd` in a scene with these keys.
fn stands_of(lines: &str) -> Vec<Stand> {
    let scene = load(herd(lines)).unwrap();
    stands(&scene, &config::surface(&scene, "herd").unwrap())
}

const PLACE: &str = "east_m = 10.0\nnorth_m = 20.0\nup_m = 3.0\narea_m = [40.0, 30.0]\n";

#[test]
fn a_grid_fills_its_area_without_duplicate_positions() {
    let stands = stands_of(&format!("{PLACE}instances = 12"));
    assert_eq!(stands.len(), 12);
    let mut places: Vec<[i64; 2]> =
        stands.iter().map(|s| [s.foot.x, s.foot.y].map(|m| (m * 1e6) as i64)).collect();
    places.sort_unstable();
    places.dedup();
    assert_eq!(places.len(), 12);
    for Stand { foot, .. } in &stands {
        let within = (foot.x - 10.0).abs() <= 20.0 && (foot.y - 20.0).abs() <= 15.0 && foot.z == 3.0;
        assert!(within, "{foot}");
    }
    // Four columns and three rows: the outer instances are half a cell from the area's edge.
    assert!((stands[0].foot - DVec3::new(-5.0, 10.0, 3.0)).length() < 1e-12, "{}", stands[0].foot);
}

#[test]
fn a_scatter_stays_in_its_area_and_depends_on_its_seed() {
    let scatter = |seed| stands_of(&format!("{PLACE}instances = 500\nlayout = \"scatter\"\nseed = {seed}"));
    let stands = scatter(1);
    assert!(stands.iter().all(|s| (s.foot.x - 10.0).abs() <= 20.0 && (s.foot.y - 20.0).abs() <= 15.0));
    assert_ne!(stands, scatter(2));
    assert_eq!(stands, scatter(1));
    let mean = stands.iter().map(|s| s.foot.x).sum::<f64>() / 500.0;
    // The mean of 500 positions has a standard deviation of 40 / sqrt(12 * 500).
    assert!((mean - 10.0).abs() < 4.0 * 40.0 / 6000f64.sqrt(), "{mean}");
}

/// SMALL's ellipsoid with a herd on it.
fn on_the_earth(lines: &str) -> String {
    let mesh = "\n[surface.herd.geometry]\nkind = \"progressive-mesh\"\nsource = \"bunny\"\nsize_m = 2.0\n";
    format!("{SMALL}{mesh}{lines}")
}

#[test]
fn instances_are_upright_on_the_ellipsoid_also_far_from_the_tangent_point() {
    let lines =
        "latitude_deg = 46.0\nlongitude_deg = 8.0\nup_m = 5.0\ninstances = 4\narea_m = [400e3, 400e3]\n";
    let scene = load(on_the_earth(lines)).unwrap();
    let stands = stands(&scene, &config::surface(&scene, "herd").unwrap());
    let middle = geodetic_to_ecef(46.0, 8.0, 0.0);
    let frame = local_frame(46.0, 8.0);
    for (n, stand) in stands.iter().enumerate() {
        let place = ecef_to_geodetic(stand.foot);
        assert!((place.altitude_m - 5.0).abs() < 1e-6, "{place:?}");
        let own = local_frame(place.latitude_deg, place.longitude_deg);
        assert!(
            (stand.axes.z_axis - own.up).length() < 1e-12 && (stand.axes.x_axis - own.east).length() < 1e-12
        );
        // Columns at -100 and 100 km. At 141 km the ellipsoid is 1.6 km below the tangent plane, which shifts them
        // by 25 m.
        let by = stand.foot - middle;
        let expected = [[-1e5, -1e5], [1e5, -1e5], [-1e5, 1e5], [1e5, 1e5]][n];
        assert!((by.dot(frame.east) - expected[0]).abs() < 200.0, "{by}");
        assert!((by.dot(frame.north) - expected[1]).abs() < 200.0, "{by}");
    }
    for (lines, expected) in [
        ("", "a mesh over an ellipsoid needs latitude_deg"),
        ("east_m = 3.0", "a mesh over an ellipsoid has no east_m"),
        (
            "layout = \"along\"\npath = \"down\"\nlatitude_deg = 3.0",
            "a layout along a path has no latitude_deg",
        ),
        (
            "latitude_deg = 1.0\nlongitude_deg = 1.0\nground = \"land\"",
            "land is not a progressive mesh or a plane",
        ),
    ] {
        let error = load(on_the_earth(lines)).expect_err(lines).to_string();
        assert!(error.contains(expected), "{lines}: {error}");
    }
}

/// A surface of paper 2 on the plane.
fn mesh(name: &str, lines: &str) -> String {
    format!("[surface.{name}.geometry]\nkind = \"progressive-mesh\"\n{lines}\n")
}

fn scene_of(surfaces: &[String]) -> Scene {
    load(surfaces.concat() + EYE).unwrap()
}

/// Height of a model's surface at a point of the plane, from a test of every face.
fn height(model: &Model, scale: f64, at: DVec3) -> f64 {
    let (min, max) = model
        .positions
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(*p), max.max(*p)));
    let middle = (min + max) / 2.0;
    let world = |corner: u32| {
        let p = model.positions[corner as usize];
        DVec3::new((p.x - middle.x) * scale, (p.y - middle.y) * scale, (p.z - min.z) * scale)
    };
    let hit = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|wedge| world(model.wedge_positions[wedge as usize]));
        let area = |a: DVec3, b: DVec3| (a - at).truncate().perp_dot((b - at).truncate());
        let areas = [area(b, c), area(c, a), area(a, b)];
        let inside = areas.iter().all(|area| *area >= -1e-9) || areas.iter().all(|area| *area <= 1e-9);
        let whole: f64 = areas.iter().sum();
        (inside && whole.abs() > 1e-9).then(|| (areas[0] * a.z + areas[1] * b.z + areas[2] * c.z) / whole)
    };
    model.faces.iter().filter_map(hit).fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn instances_are_placed_on_the_full_terrain_at_every_level() {
    let terrain = mesh("terrain", "source = \"grid:20\"\nsize_m = 100.0\nup = \"z\"\neast_m = 0.0");
    let trees = mesh(
        "trees",
        "source = \"solid:4\"\nsize_m = 1.0\ninstances = 60\nlayout = \"scatter\"\narea_m = [90.0, 90.0]\nup_m = -0.25\n\
         ground = \"terrain\"",
    );
    let scene = scene_of(&[terrain.clone(), trees]);
    let models = models(&scene).unwrap();
    let stands = &models.iter().find(|model| model.name == "trees").unwrap().stands;
    let (model, _) = Model::open("grid:20").unwrap();
    let width = model.positions.iter().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max) * 2.0;
    let mut heights = Vec::new();
    for stand in stands {
        let expected = height(&model, 100.0 / width, stand.foot) - 0.25;
        // The progressive mesh stores positions in f32: 2^-24 of 50 m, with slopes of up to 1.
        assert!((stand.foot.z - expected).abs() < 1e-4, "{} {expected}", stand.foot);
        heights.push(stand.foot.z);
    }
    heights.sort_by(f64::total_cmp);
    assert!(heights[59] - heights[0] > 1.0, "the terrain is not flat: {heights:?}");
    let wide = mesh("wide", "source = \"solid:4\"\nsize_m = 1.0\neast_m = 60.0\nground = \"terrain\"");
    let error = self::models(&scene_of(&[terrain, wide])).unwrap_err().to_string();
    assert!(error.contains("surface.wide.geometry.ground: instance 0, at"), "{error}");
    assert!(error.contains("is not above terrain"), "{error}");
}

#[test]
fn instances_on_a_terrain_of_the_ellipsoid_rise_along_their_own_verticals() {
    let place = "latitude_deg = 46.0\nlongitude_deg = 8.0\n";
    let terrain = mesh("terrain", &format!("source = \"grid:9\"\nsize_m = 60e3\nup = \"z\"\n{place}"));
    let trees = mesh(
        "trees",
        &format!(
            "source = \"solid:4\"\nsize_m = 1.0\ninstances = 9\narea_m = [50e3, 50e3]\n{place}ground = \"terrain\""
        ),
    );
    let scene = load(format!("{SMALL}\n{terrain}{trees}")).unwrap();
    let models = models(&scene).unwrap();
    let of = |name: &str| models.iter().find(|model| model.name == name).unwrap();
    let before = stands(&scene, &of("trees").surface);
    for (stand, before) in of("trees").stands.iter().zip(before) {
        let up = stand.axes.z_axis;
        let risen = stand.foot - before.foot;
        assert!((risen - up * risen.dot(up)).length() < 1e-6, "not along the vertical: {risen}");
        // The grid rises from 0 to at most 0.3 of 60 km. At 35 km the tangent plane is 0.1 km above the ellipsoid.
        assert!((0.0..20e3).contains(&risen.dot(up)), "{risen}");
    }
    assert!(of("terrain").stands[0].axes.z_axis == local_frame(46.0, 8.0).up);
}

#[test]
fn a_plane_is_a_ground_within_its_bounds() {
    let plane = "[surface.floor]\ngeometry = { kind = \"plane\", width_m = 10.0, height_m = 10.0, columns = 1, rows = 1 }\n";
    let tree = |east_m: f64| {
        mesh(
            "tree",
            &format!("source = \"bunny\"\nsize_m = 1.0\neast_m = {east_m}\nup_m = 0.5\nground = \"floor\""),
        )
    };
    let stand =
        |east_m| models(&scene_of(&[plane.into(), tree(east_m)])).map(|models| models[0].stands[0].foot);
    assert_eq!(stand(5.0).unwrap(), DVec3::new(5.0, 0.0, 0.5));
    assert!(stand(5.1).unwrap_err().to_string().contains("is not above floor"));
}

#[test]
fn a_ground_is_a_single_mesh_without_a_ground_of_its_own() {
    let ground = |lines: &str| mesh("ground", &format!("source = \"bunny\"\nsize_m = 1.0\n{lines}"));
    let tree = mesh("tree", "source = \"bunny\"\nsize_m = 1.0\nground = \"ground\"");
    let other = mesh("other", "source = \"bunny\"\nsize_m = 1.0");
    load([ground("instances = 1"), tree.clone()].concat() + EYE).unwrap();
    for (lines, expected) in [
        ("instances = 2\narea_m = [9.0, 9.0]", "ground has 2 instances; a ground is one mesh"),
        ("ground = \"other\"", "ground has a ground itself"),
    ] {
        let error =
            load([ground(lines), tree.clone(), other.clone()].concat() + EYE).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_file_of_an_unknown_kind_is_no_name_of_a_model() {
    let error = load(mesh("stone", "source = \"stone.stl\"\nsize_m = 1.0") + EYE).unwrap_err().to_string();
    assert!(error.contains("\"stone.stl\"") && error.contains(".ply, .obj, .glb or .pmesh"), "{error}");
}
