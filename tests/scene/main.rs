//! Scene files: which load, which are rejected, and the position in the message.

mod documents;
mod herd;
mod surfaces;

use ortelius::paper::virtual_texture::config::{Config, TextureSource, source_mesh, texture};
use ortelius::paper::virtual_texture::streaming::StreamingConfig;
use ortelius::paper::virtual_texture::{TileAddress, VirtualTextureSettings};
use ortelius::picture::PixelFormat;
use ortelius::renderer::sections;
use ortelius::scene::camera::{self, GroundPoint};
use ortelius::scene::{Ellipsoid, Geometry, SHIPPED, Scene, SceneError};
use proptest::prelude::*;
use std::path::{Path, PathBuf};

#[test]
fn the_next_pose_of_a_path_is_extrapolated() {
    let scene = Scene::embedded("earth").unwrap();
    // Turns extrapolate exactly. A pan's height follows the ellipsoid. A dive slows down: e^(-8 x 0.0267) is 0.808, but
    // the straight line reaches 0.784.
    for (name, bound) in [("orbit", 1e-3), ("pan", 1e-3), ("pole-crossing", 1e-3), ("dive", 0.03)] {
        let path = scene.path(name).unwrap();
        let (before, now, then) = (path.pose(9), path.pose(10), path.pose(18));
        let ahead = camera::extrapolated(&before, &now, 8).unwrap();
        let altitude_m = 64.0 * now.near_m;
        let missed_m = (ahead.eye - then.eye).length();
        assert!(missed_m <= bound * altitude_m, "{name}: {missed_m} m of {altitude_m} m");
        assert!((ahead.forward - then.forward).length() < 1e-3, "{name}");
    }
    let path = scene.path("teleport").unwrap();
    let jump = (1..path.frames).find(|&frame| path.pose(frame) != path.pose(frame - 1)).unwrap();
    assert_eq!(
        camera::extrapolated(&path.pose(jump - 1), &path.pose(jump), 8),
        None,
        "a jump is not extrapolated"
    );
    assert_eq!(
        camera::extrapolated(&path.pose(0), &path.pose(0), 8),
        None,
        "a resting camera is not extrapolated"
    );
}

#[test]
fn an_extrapolated_dive_stays_above_half_the_height_whatever_the_near_plane() {
    let scene = Scene::embedded("plane-tilt").unwrap();
    for near_m in [None, Some(0.001), Some(3.0)] {
        let at = |altitude_m| camera::Camera { altitude_m, near_m, ..scene.cameras["tilted"] }.pose();
        let ahead = camera::extrapolated(&at(11.0), &at(10.0), 20).unwrap();
        assert!((ahead.eye.z - 5.0).abs() < 1e-9, "near plane {near_m:?}: {} m", ahead.eye.z);
        assert_eq!(
            camera::extrapolated(&at(16.0), &at(10.0), 20),
            None,
            "a jump by more than half the height"
        );
    }
}

fn scenes_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

/// A small complete scene; tests change one line of it.
const SMALL: &str = r#"[surface.land.texture]
kind = "virtual"
source = "earth"
width_log2 = 12
height_log2 = 11

[surface.land.geometry]
kind = "ellipsoid"
columns = 24
rows = 12

[view]
width = 64
height = 36
camera = "alps"

[cameras.alps]
latitude_deg = 46.0
longitude_deg = 8.0
altitude_m = 300e3

[paths.down]
kind = "dive"
camera = "alps"
to_altitude_m = 10.0
frames = 5
"#;

struct Written {
    folder: tempfile::TempDir,
    path: PathBuf,
}

fn written(text: impl AsRef<[u8]>) -> Written {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.toml");
    std::fs::write(&path, text).unwrap();
    Written { folder, path }
}

/// Loads with all checks of the program.
fn load_file(file: &Written, changes: &[String]) -> Result<Scene, SceneError> {
    sections::load(file.path.to_str().unwrap(), changes)
}

fn load(text: impl AsRef<[u8]>) -> Result<Scene, SceneError> {
    load_file(&written(text), &[])
}

/// The message for SMALL with one line replaced, without the folder's name.
fn message(line: &str, by: &str) -> String {
    assert_eq!(SMALL.matches(line).count(), 1, "{line:?} must name one line");
    let file = written(SMALL.replace(line, by));
    let error = load_file(&file, &[]).expect_err(by).to_string();
    error.replace(&format!("{}/", file.folder.path().display()), "")
}

fn changed(changes: &[&str]) -> Result<Scene, SceneError> {
    let changes: Vec<String> = changes.iter().map(|&change| change.to_owned()).collect();
    load_file(&written(SMALL), &changes)
}

#[test]
fn every_shipped_scene_loads_and_equals_its_file() {
    let mut files: Vec<String> = std::fs::read_dir(scenes_folder())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter_map(|name| name.strip_suffix(".toml").map(str::to_owned))
        .collect();
    files.sort();
    assert_eq!(files, SHIPPED.map(|(name, _)| name), "shipped scenes and the folder differ");
    for name in files {
        let path = scenes_folder().join(format!("{name}.toml"));
        let embedded = Scene::embedded(&name).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(embedded, Scene::load(&path).unwrap());
        assert_eq!(embedded, Scene::load_with(&name, &[]).unwrap());
        for path in embedded.paths.values() {
            for frame in 0..=path.frames {
                assert!(path.pose(frame).eye.is_finite());
            }
        }
        sections::check(&embedded).unwrap_or_else(|error| panic!("{error}"));
        match embedded.surfaces.contains_key("land") {
            true => {
                assert!(texture(&embedded).unwrap().pyramid().unwrap().is_some());
                // A progressive mesh's triangles are in its model file.
                assert_eq!(source_mesh(&embedded).is_ok(), embedded.surfaces["land"].grid().is_some());
            }
            false => assert!(texture(&embedded).is_err() && source_mesh(&embedded).is_err(), "{name}"),
        }
    }
}

#[test]
fn the_shipped_earth_is_the_papers_headline() {
    let scene = Scene::embedded("earth").unwrap();
    let pyramid = texture(&scene).unwrap().pyramid().unwrap().unwrap();
    assert_eq!((pyramid.width_log2(), pyramid.height_log2(), pyramid.tile_size()), (18, 17, 512));
    assert_eq!((scene.view.width, scene.view.height), (1920, 1080));
    assert_eq!(source_mesh(&scene).unwrap().triangles.len(), 149_768);
    let camera = scene.camera(&scene.view.camera).unwrap();
    assert_eq!((camera.altitude_m, camera.magnification), (300e3, 4.0));
    for path in ["orbit", "pan", "dive", "pole-crossing", "antimeridian-crossing", "teleport"] {
        assert!(scene.path(path).is_ok(), "{path}");
    }
}

#[test]
fn omitted_keys_have_their_documented_values() {
    let scene = load(SMALL).unwrap();
    assert_eq!(scene.name, "small");
    assert_eq!((texture(&scene).unwrap().tile_size, texture(&scene).unwrap().border), (512, 4));
    let VirtualTextureSettings { config, streaming, .. } =
        VirtualTextureSettings::of_scene(&scene, PixelFormat::Srgb8).unwrap();
    assert_eq!((config, &streaming), (Config::DEFAULT, &StreamingConfig::DEFAULT));
    assert_eq!((streaming.gpu_tiles, streaming.host_tiles), (192, 384));
    assert_eq!((config.request_format, config.address), (None, TileAddress::Level0));
    assert_eq!((config.block_log2, config.list_capacity), (3, 65_536));
    assert_eq!(scene.cameras["alps"].magnification, 1.0);
    assert_eq!(scene.view.background, [0.0; 3]);
    assert_eq!(scene.pose(0).unwrap(), scene.cameras["alps"].pose());
}

#[test]
fn a_typo_names_line_and_column_and_shows_the_caret() {
    let message = message("columns = 24", "colums = 24");
    assert_eq!(
        message,
        "small.toml:9:1: no scene has the key surface.land.geometry.colums; nearest is \
         surface.land.geometry.columns\n9 | colums = 24\n  | ^^^^^^"
    );
}

#[test]
fn broken_toml_is_shown_at_its_position() {
    let message = message("rows = 12", "rows = = 12");
    assert!(message.starts_with("small.toml:10:8: "), "{message}");
    assert!(message.contains("\n10 | rows = = 12\n   |        ^"), "{message}");
    assert_eq!(message.lines().count(), 3, "{message}");
}

#[test]
fn a_wrong_type_is_shown_at_its_value() {
    let message = message("altitude_m = 300e3", "altitude_m = \"high\"");
    assert_eq!(
        message,
        "small.toml:20:14: cameras.alps.altitude_m: \"high\" is not a number\n\
         20 | altitude_m = \"high\"\n   |              ^^^^^^"
    );
}

#[test]
fn a_missing_key_is_named() {
    let message = message("altitude_m = 300e3\n", "");
    assert!(message.starts_with("small.toml:17:1: cameras.alps.altitude_m: is missing"), "{message}");
}

#[test]
fn an_unknown_camera_lists_those_that_exist() {
    let text = message("camera = \"alps\"\n\n", "camera = \"alp\"\n\n");
    assert_eq!(
        text,
        "small.toml:15:10: view.camera: no camera \"alp\"; available: alps\n\
         15 | camera = \"alp\"\n   |          ^^^^^"
    );
    let text = message("camera = \"alps\"\nto", "camera = \"x\"\nto");
    assert!(text.starts_with("small.toml:24:10: paths.down.camera: no camera \"x\""), "{text}");
    let error = load(SMALL).unwrap().camera("sea").unwrap_err().to_string();
    assert_eq!(error, "scene small has no camera \"sea\"; it has alps");
}

#[test]
fn numbers_out_of_range_are_rejected_with_the_range() {
    for (line, by, expected) in [
        ("latitude_deg = 46.0", "latitude_deg = 90.5", "90.5 is outside -90 ..= 90"),
        ("latitude_deg = 46.0", "latitude_deg = nan", "NaN is outside -90 ..= 90"),
        ("longitude_deg = 8.0", "longitude_deg = inf", "inf is outside -360 ..= 360"),
        ("\naltitude_m = 300e3", "\naltitude_m = 0.0", "0 is outside 0.001 ..= 1000000000"),
        ("\naltitude_m = 300e3", "\naltitude_m = -inf", "-inf is outside"),
        ("\naltitude_m = 300e3", "\naltitude_m = 1e3\ntilt_deg = 181.0", "181 is outside 0 ..= 180"),
        ("\naltitude_m = 300e3", "\naltitude_m = 1e3\nmagnification = 0.5", "0.5 is outside 1 ..="),
        ("to_altitude_m = 10.0", "to_altitude_m = nan", "NaN is outside"),
        ("frames = 5", "frames = 0", "0 is outside 1 ..="),
        ("columns = 24", "columns = 2", "2 is outside 3 ..= 8192"),
        ("width = 64", "width = 0", "0 is outside 1 ..= 16384"),
        ("width = 64", "width = -1", "-1 is not an integer from 0 to 4294967295"),
        ("width_log2 = 12", "width_log2 = 21", "2^21 x 2^11 texels is outside"),
        ("width_log2 = 12", "width_log2 = 12\ntile_size = 500", "500 texels is not a power of two"),
        ("width_log2 = 12", "width_log2 = 12\nborder = 257", "257 texels is wider than half a tile"),
        ("width_log2 = 12", "width_log2 = 12\nresident_levels = 3", "3 resident levels are outside"),
        ("width_log2 = 12", "width_log2 = 12\nformat = \"bc1\"\nborder = 2", "must be a multiple of 4"),
        ("frames = 5", "frames = 5\n[variant]\nblock_log2 = 5", "5 is outside 0 ..= 4"),
        ("frames = 5", "frames = 5\n[variant]\ncompact_block_log2 = 3", "3 is outside 0 ..= 2"),
        ("frames = 5", "frames = 5\n[surface.land.filter]\nmax_anisotropy = 0", "0 is outside 1 ..= 64"),
        (
            "frames = 5",
            "frames = 5\n[variant]\nrequest_format = \"rg32\"",
            "\"rg32\" is not one of \"rgb32\", ",
        ),
        ("frames = 5", "frames = 5\n[cache]\ngpu_tiles = 0", "0 is outside 1 ..="),
        ("frames = 5", "frames = 5\n[cache]\nload_budget_ms = nan", "NaN is outside"),
    ] {
        let message = message(line, by);
        assert!(message.starts_with("small.toml:") && message.contains(expected), "{by}: {message}");
        assert!(message.contains('^'), "{by}: {message}");
        let shown = message.lines().nth(1).unwrap();
        assert!(shown.ends_with(by.rsplit('\n').next().unwrap()), "{by}: another line is shown: {message}");
    }
}

#[test]
fn keys_of_another_kind_are_rejected() {
    for (line, by, expected) in [
        ("columns = 24", "columns = 24\nwidth_m = 3.0", "no scene has the key surface.land.geometry.width_m"),
        ("latitude_deg = 46.0", "east_m = 46.0", "a camera over the earth has no east_m"),
        ("latitude_deg = 46.0\n", "", "a camera over the earth needs latitude_deg"),
        ("kind = \"dive\"", "kind = \"orbit\"\ndegrees = 9.0", "an orbit has no to_altitude_m"),
        ("to_altitude_m = 10.0\n", "", "a dive needs to_altitude_m"),
        ("source = \"earth\"", "source = \"file\"", "the source \"file\" needs a path"),
        ("source = \"earth\"", "source = \"ruler\"\npath = \"x\"", "only the source \"file\" has a path"),
        ("source = \"earth\"", "source = \"ruler\"\nformat = \"bc1\"", "the ruler is exact texel by texel"),
        ("kind = \"ellipsoid\"", "kind = \"plane\"", "a camera over a plane has no latitude_deg"),
        ("height_log2 = 11\n", "", "height_log2: is missing"),
        ("[cameras.alps]", "[cameras.\"a b\"]", "\"a b\" is not a name"),
    ] {
        let message = message(line, by);
        assert!(message.contains(expected), "{by}: {message}");
    }
}

#[test]
fn an_orbit_about_the_sky_is_rejected_at_its_camera() {
    let by = "\naltitude_m = 300e3\ntilt_deg = 120.0\n[paths.round]\nkind = \"orbit\"\ncamera = \"alps\"\n\
              degrees = 90.0\nframes = 3";
    let message = message("\naltitude_m = 300e3", by);
    assert!(message.starts_with("small.toml:24:10: paths.round.camera: an orbit needs"), "{message}");
}

#[test]
fn a_texture_file_is_found_beside_its_scene() {
    let text = SMALL.replace(
        "source = \"earth\"\nwidth_log2 = 12\nheight_log2 = 11",
        "source = \"file\"\npath = \"a/b.tiles\"",
    );
    let file = written(&text);
    let found = texture(&load_file(&file, &[]).unwrap()).unwrap();
    assert_eq!(
        (found.source, found.path.clone()),
        (TextureSource::File, Some(file.folder.path().join("a/b.tiles")))
    );
    assert_eq!(found.pyramid().unwrap(), None, "the file itself knows its size");
    let scene = load_file(&file, &["surface.land.texture.path=c.tiles".to_owned()]).unwrap();
    assert_eq!(texture(&scene).unwrap().path, Some("c.tiles".into()), "from the working directory");
    // The size keys of the replaced texture do not apply to the file.
    let scene = changed(&["surface.land.texture.path=c.tiles", "surface.land.texture.source=file"]).unwrap();
    assert_eq!(texture(&scene).unwrap().pyramid().unwrap(), None);
}

#[test]
fn absent_and_unreadable_scenes_are_named() {
    let error = Scene::load(Path::new("no/such.toml")).unwrap_err().to_string();
    assert!(error.starts_with("no/such.toml: cannot read the scene: "), "{error}");
    let error = Scene::load_with("no/such.toml", &[]).unwrap_err().to_string();
    assert!(error.starts_with("no/such.toml: cannot read the scene: "), "{error}");
    let error = Scene::load_with("eart", &[]).unwrap_err().to_string();
    assert!(error.contains("\"eart\" is neither a scene file nor a shipped scene; shipped scenes: antimeridian, bunny, earth,"), "{error}");
    let error = load(b"[view]\nsource = \"\xff\"\n").unwrap_err().to_string();
    assert!(error.contains("small.toml:2:11: this byte is not UTF-8"), "{error}");
    let too_long = |bytes: usize| {
        load(vec![b'#'; bytes])
            .is_err_and(|error| error.to_string().contains("it has more than 1048576 bytes"))
    };
    assert_eq!([1 << 20, (1 << 20) + 1].map(too_long), [false, true]);
}

#[test]
fn changes_reach_every_section_with_any_value() {
    let scene = changed(&[
        "variant.block_log2=1",
        "variant.address = own-level",
        "cache.upload_budget_ms=0.5",
        "cameras.alps.altitude_m=1e3",
        "cameras.sea={ latitude_deg = 0, longitude_deg = -30.0, altitude_m = 5 }",
        "view.camera=sea",
        "view.path=\"down\"",
        "surface.land.geometry.columns=30",
        "surface.land.filter.kind=stochastic",
        "variant.request_format=auto",
    ])
    .unwrap();
    let VirtualTextureSettings { config, streaming, .. } =
        VirtualTextureSettings::of_scene(&scene, PixelFormat::Srgb8).unwrap();
    assert_eq!((config.block_log2, config.address, config.request_format), (1, TileAddress::OwnLevel, None));
    assert_eq!(config.filter.kind.name(), "stochastic");
    assert_eq!(streaming.upload_budget_ms, 0.5);
    assert_eq!(scene.cameras["alps"].altitude_m, 1e3);
    let sea = GroundPoint::Planet { latitude_deg: 0.0, longitude_deg: -30.0 };
    assert_eq!(scene.camera(&scene.view.camera).unwrap().place, sea);
    assert_eq!(scene.view.path.as_deref(), Some("down"));
    assert_eq!(scene.surfaces["land"].geometry, Geometry::Ellipsoid(Ellipsoid { columns: 30, rows: 12 }));
}

#[test]
fn a_wrong_change_repeats_itself_and_suggests_the_nearest_key() {
    for (change, expected) in [
        ("variant.blok_log2=2", "no scene has the key variant.blok_log2; nearest is variant.block_log2"),
        ("vew.width=2", "no scene has the key vew.width; nearest is view.width"),
        ("cameras.alps.altitud=2", "nearest is cameras.alps.altitude_m"),
        ("cameras.alp.altitude_m=2", "no cameras.alp in this scene; it has alps"),
        ("view.width.x=2", "view.width is 64, not a table"),
        ("variant.block_log2=9", "9 is outside 0 ..= 4"),
        ("variant.compact=fused-append", "choose \"append\", or variant.dedup = \"fused-exact\""),
        ("variant.block_log2=many", "\"many\" is not an integer"),
        ("variant.memo=[1", "is not a TOML value"),
        ("variant.memo=", "is not a TOML value"),
        ("variant.memo", "expected SECTION.KEY=VALUE"),
        ("view.camera=sea", "no camera \"sea\"; available: alps"),
        ("variant={ p = 3 }", "no scene has the key variant.p; nearest is variant.list"),
        ("view=3", "expected SECTION.KEY=VALUE"),
        ("=3", "expected SECTION.KEY=VALUE"),
        ("sun.x.y=3", "no scene has the key sun.x"),
        ("surface.lnd.lit=true", "no surface.lnd in this scene; it has land"),
        ("surface.land.geometry.rows=1", "1 is outside 2 ..= 8192"),
        ("surface.land.texture.width_log2=21", "2^21 x 2^11 texels is outside"),
    ] {
        let error = changed(&[change]).expect_err(change).to_string();
        assert!(error.starts_with(&format!("-D {change}: ")), "{error}");
        assert!(error.contains(expected), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

#[test]
fn changes_that_place_a_camera_make_a_new_one() {
    let place = ["cameras.new.latitude_deg=10", "cameras.new.longitude_deg=20", "cameras.new.altitude_m=3e6"];
    let scene = changed(&[&place[..], &["cameras.new.tilt_deg=5", "view.camera=new"]].concat()).unwrap();
    let camera = scene.camera("new").unwrap();
    assert_eq!((camera.altitude_m, camera.tilt_deg), (3e6, 5.0));
    let refused = changed(&place[1..]).unwrap_err().to_string();
    assert!(refused.contains("no cameras.new in this scene"), "{refused}");
}

#[test]
fn every_key_of_the_shipped_scenes_can_be_changed() {
    for (name, text) in SHIPPED {
        let table: toml::Table = toml::from_str(text).unwrap();
        let mut changes = Vec::new();
        let mut open = vec![(String::new(), toml::Value::Table(table))];
        while let Some((key, value)) = open.pop() {
            match value {
                toml::Value::Table(inner) => open.extend(inner.into_iter().map(|(part, value)| {
                    (if key.is_empty() { part } else { format!("{key}.{part}") }, value)
                })),
                value => changes.push(format!("{key}={value}")),
            }
        }
        assert!(changes.len() > 10);
        assert_eq!(Scene::load_with(name, &changes).unwrap(), Scene::embedded(name).unwrap());
    }
}

#[test]
fn a_report_can_contain_the_whole_scene() {
    let earth = Scene::embedded("earth").unwrap();
    let json = serde_json::to_value(&earth).unwrap();
    assert_eq!(json["cameras"]["headline"]["latitude_deg"], 30.2);
    assert_eq!(json["surface"]["land"]["texture"]["width_log2"], 18);
    assert_eq!(json["paths"]["pole-crossing"]["kind"], "pan");
    let changed = earth.with(&["variant.address=own-level".into()]).unwrap();
    assert_eq!(Scene::from_text(Path::new("earth.toml"), changed.to_toml()).unwrap(), changed);
    assert_ne!(changed, earth);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Bytes are replaced, inserted or removed at any position. The result is a scene or one message, never a panic.
    #[test]
    fn a_mutated_scene_never_panics(
        which in 0..=SHIPPED.len(),
        edits in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>(), 0..4u8), 1..6),
    ) {
        let mut bytes = SHIPPED.get(which).map_or(SMALL, |(_, text)| text).as_bytes().to_vec();
        for (place, byte, edit) in edits {
            let place = place.index(bytes.len());
            match edit {
                0 => bytes[place] = byte,
                1 => bytes.insert(place, byte),
                2 => drop(bytes.remove(place)),
                // Digits pass the parser more often.
                _ => bytes[place] = b'0' + byte % 10,
            }
        }
        if let Err(error) = load(&bytes) {
            prop_assert!(error.to_string().contains("small.toml:"), "{}", error);
        }
    }

    #[test]
    fn an_arbitrary_change_never_panics(key in "[a-z_.=0-9 \"]{0,24}", value in "\\PC{0,12}") {
        if let Err(error) = changed(&[&format!("{key}={value}")]) {
            prop_assert!(error.to_string().starts_with("-D "), "{}", error);
        }
    }
}
