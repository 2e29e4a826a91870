//! `[surface.NAME]`: properties that surfaces share, and errors for files of the former format.

use crate::{SMALL, changed, load, message};
use ortelius::paper::virtual_texture::Filtering;
use ortelius::paper::virtual_texture::config::owner;
use ortelius::renderer::sections;
use ortelius::scene::camera::Ground;
use ortelius::scene::{Geometry, Plain, PlainSource, Scene};

const SHELL: &str = "\n[surface.shell]\ngeometry = { kind = \"ellipsoid\", columns = 8, rows = 4 }\n";

fn refused(more: &str) -> String {
    load(format!("{SMALL}{more}")).expect_err(more).to_string()
}

#[test]
fn surfaces_share_a_ground_and_one_virtual_texture() {
    let scene = load(format!("{SMALL}{SHELL}texture = \"land\"\nlit = true\n")).unwrap();
    assert_eq!(scene.ground, Ground::Planet);
    let (land, shell) = (&scene.surfaces["land"], &scene.surfaces["shell"]);
    assert_eq!((land.texture.as_deref(), shell.texture.as_deref()), (Some("land"), Some("land")));
    assert_eq!((land.lit, shell.lit), (None, Some(true)));
    assert_eq!(owner(&scene).unwrap().unwrap().name, "land");
    assert_eq!(scene.texture_kind(shell), Some("virtual"));
    assert_eq!(shell.grid().unwrap().triangles.len(), 8 * 2 + 8 * 2 * 2);
    // Without the other surface the scene is still complete.
    assert_eq!(load(SMALL).unwrap().surfaces.len(), 1);
}

#[test]
fn a_plain_texture_is_a_file_or_the_shipped_earth() {
    let plain = |keys: &str| load(format!("{SMALL}{SHELL}texture = {{ kind = \"plain\"{keys} }}\n"));
    let read = |scene: &Scene| scene.read::<Plain>(&["surface", "shell", "texture"]).unwrap();
    assert_eq!(
        read(&plain(", source = \"earth\"").unwrap()),
        Plain { source: PlainSource::Earth, path: None }
    );
    let path = read(&plain(", path = \"a.png\"").unwrap()).path.unwrap();
    assert!(path.is_absolute() && path.ends_with("a.png"), "beside the scene: {}", path.display());
    for (keys, expected) in [
        ("", "surface.shell.texture.path: a plain texture needs path"),
        (", source = \"earth\", path = \"a.png\"", "the source \"earth\" has no path"),
        (", border = 3", "no scene has the key surface.shell.texture.border"),
    ] {
        let error = plain(keys).expect_err(keys).to_string();
        assert!(error.contains(expected), "{keys}: {error}");
    }
}

#[test]
fn invalid_combinations_of_surfaces_are_rejected() {
    let plane = "\n[surface.floor]\ngeometry = { kind = \"plane\", width_m = 1, height_m = 1, columns = 1, rows = 1 }\n";
    let second = "texture = { kind = \"virtual\", source = \"ruler\", width_log2 = 12, height_log2 = 11 }\n";
    for (more, expected) in [
        (plane.to_owned(), "surface.floor.geometry.kind: a scene has one ground, and land is an ellipsoid"),
        (
            "\n[surface.pipe.geometry]\nkind = \"cylinder\"\nradius_m = 1\nlength_m = 1\ncolumns = 8\nrows = 1\n".into(),
            "surface.pipe.geometry.kind: a scene has one ground, and land is an ellipsoid; put the cylinder",
        ),
        (format!("{SHELL}{second}"), "a scene has one virtual texture, and land has one already; share it"),
        (
            format!("{SHELL}texture = \"sea\"\n"),
            "surface \"sea\" does not exist or has no texture of its own; surfaces with a texture: land",
        ),
        (format!("{SHELL}texture = 3\n"), "3 is not a table, nor the name of a surface"),
        (format!("{SHELL}filter = {{ max_anisotropy = 2 }}\n"), "a surface without a texture has no filter"),
        (format!("{SHELL}shiny = true\n"), "no scene has the key surface.shell.shiny"),
        ("\n[surface.bare]\nlit = true\n".into(), "surface.bare.geometry.kind: a surface needs geometry"),
        ("\n[surface]\nflat = 3\n".into(), "surface.flat"),
        (
            SHELL.replace("ellipsoid", "teapot"),
            "\"teapot\" is not a kind of geometry; available: \"ellipsoid\", ",
        ),
        (
            format!("{SHELL}texture = {{ source = \"earth\" }}\n"),
            "\"\" is not a kind of texture; available: \"plain\", ",
        ),
        ("\n[sun]\nelevation_deg = 91.0\n".into(), "91 is outside -90 ..= 90"),
        (
            "\n[cahce]\ngpu_tiles = 3\n".into(),
            "no scene has the key cahce.gpu_tiles; nearest is cache.gpu_tiles",
        ),
    ] {
        let error = refused(&more);
        assert!(error.contains(expected) && error.contains("small.toml:"), "{more}: {error}");
    }
    let nothing = load(SMALL.split("[view]").nth(1).map(|rest| format!("[view]{rest}")).unwrap());
    let nothing = nothing.unwrap_err().to_string();
    assert!(nothing.contains("a camera over a plane has no latitude_deg"), "{nothing}");
    let nothing = load(
        "[view]\nwidth = 9\nheight = 9\ncamera = \"a\"\n[cameras.a]\naltitude_m = 1.0\neast_m = 0.0\nnorth_m = 0.0\n",
    );
    assert!(
        nothing.unwrap_err().to_string().contains("the scene is empty: it needs at least one [surface.NAME]")
    );
}

#[test]
fn a_key_of_the_old_format_is_rejected_and_the_new_one_named() {
    for (old, expected) in [
        ("[texture]\nsource = \"earth\"", "texture is now surface.land.texture; its kind is \"virtual\""),
        (
            "[mesh]\nkind = \"earth\"",
            "mesh is now surface.land.geometry; the kind \"earth\" is now \"ellipsoid\"",
        ),
        (
            "[progressive_mesh.herd]\nsource = \"bunny\"",
            "progressive_mesh.herd is now surface.herd.geometry; its kind is \"progressive-mesh\"",
        ),
        ("[variant]\nfilter = \"bilinear\"", "variant.filter is now surface.land.filter.kind"),
    ] {
        let text = message("frames = 5\n", &format!("frames = 5\n\n{old}\n"));
        let line = if old.starts_with("[variant]") { 29 } else { 28 };
        assert!(text.starts_with(&format!("small.toml:{line}:")) && text.contains(expected), "{old}: {text}");
    }
    for (change, expected) in [
        ("texture.border=8", "texture.border is now surface.land.texture.border"),
        ("mesh.columns=8", "mesh.columns is now surface.land.geometry.columns"),
        ("progressive_mesh.herd.error_pixels=2", "is now surface.herd.geometry.error_pixels"),
        ("variant.max_anisotropy=2", "variant.max_anisotropy is now surface.land.filter.max_anisotropy"),
        ("variant.interpolation=literal", "is now surface.land.filter.interpolation"),
    ] {
        let error = changed(&[change]).unwrap_err().to_string();
        assert!(error.starts_with(&format!("-D {change}: ")) && error.contains(expected), "{error}");
    }
}

/// Each filter of paper 3 is a value, and methods that cannot filter a surface say why.
#[test]
fn a_method_that_is_not_a_filter_of_a_surface_says_why() {
    for kind in Filtering::ALL {
        changed(&[&format!("surface.land.filter.kind={}", kind.name())]).unwrap();
    }
    for (kind, expected) in [
        ("summed-area", "32 times those of bc1"),
        ("hardware", "cannot be confined to a tile"),
        ("object-space", "instead of filtering pixels"),
        ("felin", "is not one of"),
    ] {
        let error = changed(&[&format!("surface.land.filter.kind={kind}")]).unwrap_err().to_string();
        assert!(error.contains("surface.land.filter.kind") && error.contains(expected), "{error}");
    }
}

#[test]
fn without_a_sun_the_light_is_unchanged_bit_for_bit() {
    let bunny = Scene::embedded("bunny").unwrap();
    assert_eq!(bunny.sun(), glam::DVec3::new(-0.45, -0.45, 0.77).normalize());
    let with = |change: &str| bunny.with(&[change.to_owned()]).unwrap().sun();
    assert!((with("sun={}") - bunny.sun()).length() < 1e-3, "the documented angles are the defaults");
    assert!((with("sun={ azimuth_deg = 90, elevation_deg = 0 }") - glam::DVec3::X).length() < 1e-15);
    assert!((with("sun={ elevation_deg = 90 }") - glam::DVec3::Z).length() < 1e-15);
    // Over an ellipsoid the angles are measured at the view's camera.
    let earth = Scene::embedded("earth").unwrap().with(&["sun={ elevation_deg = 90 }".into()]).unwrap();
    assert!((earth.sun() - earth.cameras["headline"].place.frame().up).length() < 1e-15);
}

#[test]
fn the_shipped_meshes_keep_their_background() {
    for name in ["bunny", "herd"] {
        let [red, green, blue] = Scene::embedded(name).unwrap().view.background.map(|channel| channel as f32);
        assert_eq!([red, green, blue], [0.02f32, 0.03, 0.05]);
    }
    let scene = Scene::embedded("plane").unwrap();
    assert!(matches!(scene.surfaces["land"].geometry, Geometry::Plane(_)));
}

#[test]
fn a_late_error_points_at_the_file_or_the_change() {
    let key = ["surface", "land", "texture", "width_log2"];
    let scene = load(SMALL).unwrap();
    let place = scene.place(&key);
    assert!(place.ends_with("small.toml:4:14: surface.land.texture.width_log2"), "{place}");
    let error = scene.fault(&key, "too large").to_string();
    assert!(
        error.contains("small.toml:4:14: surface.land.texture.width_log2: too large\n4 | width_log2 = 12\n"),
        "{error}"
    );
    let changed = changed(&["surface.land.texture.width_log2=13"]).unwrap();
    assert_eq!(changed.place(&key), "-D surface.land.texture.width_log2=13");
    assert_eq!(
        changed.fault(&key, "too large").to_string(),
        "-D surface.land.texture.width_log2=13: too large"
    );
}

#[test]
fn the_filter_auto_has_one_bound_and_a_surface_that_can_be_measured() {
    let land = |keys: &str| format!("[surface.land]\n{keys}\n{SMALL}");
    for bound in ["max_error = 1e-3", "max_ms = 4"] {
        let scene = load(land(&format!("filter = \"auto\"\n{bound}"))).unwrap();
        assert!(scene.surfaces["land"].auto.is_some());
        let named = scene.with(&["surface.land.filter={ kind = \"ellipse\" }".into()]).unwrap();
        assert_eq!(named.surfaces["land"].auto, None);
        assert!(!named.has(&["surface", "land", "max_error"]) && !named.has(&["surface", "land", "max_ms"]));
    }
    // The method of a relief is its filter.
    let auto = ["filter=auto", "max_error=0.1"].map(|change| format!("surface.floor.{change}"));
    let relief = Scene::embedded("relief-brick").unwrap().with(&auto).unwrap();
    assert!(relief.surfaces["floor"].auto.is_some());
    let named = relief.with(&["surface.floor.relief.method=trace".into()]).unwrap();
    assert!(named.surfaces["floor"].auto.is_none() && !named.has(&["surface", "floor", "filter"]));
    let plain = format!("{SHELL}texture = {{ kind = \"plain\", source = \"earth\" }}\n");
    for (text, expected) in [
        (land("filter = \"auto\""), "surface.land.filter: \"auto\" needs a bound: max_error or max_ms"),
        (
            land("filter = \"auto\"\nmax_error = 0.1\nmax_ms = 2"),
            "surface.land.max_ms: \"auto\" has one bound",
        ),
        (land("filter = \"fast\"\nmax_ms = 2"), "surface.land.filter: \"fast\" is not a table, nor \"auto\""),
        (land("filter = \"auto\"\nmax_error = -1"), "-1 is outside 0 ..= 1"),
        (land("filter = \"auto\"\nmax_ms = nan"), "NaN is outside 0 ..= 1000000"),
        (land("max_error = 0.1"), "surface.land.max_error: only filter = \"auto\" has a bound"),
        (land("max_ms = 0.1"), "surface.land.max_ms: only filter = \"auto\" has a bound"),
        (
            format!("{SMALL}{plain}filter = \"auto\"\nmax_ms = 1\n"),
            "surface.shell.filter: \"auto\" is measured for a virtual texture on an ellipsoid",
        ),
    ] {
        let error = load(text.clone()).expect_err(&text).to_string();
        assert!(error.contains(expected) && error.contains("small.toml:"), "{text}: {error}");
    }
}

/// The keys of paper 3's ellipse, each with a valid value.
const OF_THE_ELLIPSE: [&str; 8] = [
    "minor_texels = 1",
    "k = 0",
    "scan = \"bounding-box\"",
    "determinant = \"subtracting\"",
    "axes = \"rows\"",
    "kernel = \"ewa\"",
    "edge = \"none\"",
    "weight_map = \"radial\"",
];

#[test]
fn a_key_of_a_filter_that_its_kind_does_not_read_is_rejected_at_its_key() {
    let land =
        |kind: &str, key: &str| format!("[surface.land]\nfilter = {{ kind = \"{kind}\", {key} }}\n{SMALL}");
    let names = |kinds: &[Filtering]| -> Vec<&str> { kinds.iter().map(|kind| kind.name()).collect() };
    let ellipse = OF_THE_ELLIPSE.map(|key| (key, names(&[Filtering::Ellipse])));
    let random = names(&[Filtering::Stochastic, Filtering::StochasticEllipse]);
    let fixed = [Filtering::Pbrt, Filtering::StochasticEllipse];
    let of_paper_1 = names(&[Filtering::Trilinear, Filtering::Bilinear, Filtering::Stochastic]);
    let without = |others: &[Filtering]| -> Vec<&str> {
        names(&Filtering::ALL.iter().copied().filter(|kind| !others.contains(kind)).collect::<Vec<_>>())
    };
    let others = [
        ("samples = 4", random),
        ("max_anisotropy = 4", without(&fixed)),
        ("interpolation = \"literal\"", of_paper_1),
    ];
    for (key, readers) in ellipse.into_iter().chain(others) {
        for kind in names(Filtering::ALL) {
            match (load(land(kind, key)), readers.contains(&kind)) {
                (Ok(_), true) => {}
                (Err(error), false) => {
                    let (error, name) = (error.to_string(), key.split(' ').next().unwrap());
                    let expected = format!(
                        "surface.land.filter.{name}: kind = \"{kind}\" does not read it; remove the key, or use kind = \"{}\"",
                        readers[0]
                    );
                    assert!(error.contains("small.toml:2:") && error.contains(&expected), "{error}");
                }
                (found, _) => panic!("{kind}, {key}: {found:?}"),
            }
        }
    }
    let error = load(format!("[surface.land]\nfilter = {{ k = 1 }}\n{SMALL}")).unwrap_err().to_string();
    assert!(error.contains("surface.land.filter.k: kind = \"trilinear\" does not read it"), "{error}");
}

/// So `--variant`, `-D` and the window can change the kind alone. A key that a later change states is not dropped.
#[test]
fn another_kind_of_filter_drops_the_keys_that_it_does_not_read() {
    let keys = OF_THE_ELLIPSE.join(", ");
    let own =
        format!("[surface.land]\nfilter = {{ kind = \"ellipse\", max_anisotropy = 4, {keys} }}\n{SMALL}");
    let own = load(own).unwrap();
    let change = |changes: &[&str]| {
        let changes: Vec<String> =
            changes.iter().map(|change| format!("surface.land.filter.{change}")).collect();
        let scene = own.with(&changes).unwrap();
        sections::check(&scene).map(|()| scene).map_err(|error| error.to_string())
    };
    let states = |scene: &Scene, key: &str| scene.has(&["surface", "land", "filter", key]);
    for kind in Filtering::ALL {
        let scene = change(&[&format!("kind={}", kind.name())]).unwrap();
        assert_eq!(states(&scene, "k"), *kind == Filtering::Ellipse, "{kind:?}");
        let fixed = [Filtering::Pbrt, Filtering::StochasticEllipse].contains(kind);
        assert_eq!(states(&scene, "max_anisotropy"), !fixed, "{kind:?}");
    }
    assert!(states(&change(&["kind=feline", "kind=ellipse", "k=1"]).unwrap(), "k"));
    let error = change(&["kind=feline", "k=1"]).unwrap_err();
    assert!(error.contains("surface.land.filter.k=1: kind = \"feline\" does not read it"), "{error}");
}

/// Loads a scene with each of the `good` filters, and is refused each of the bad ones with one message at the key.
fn check_filters(good: &[&str], bad: &[(&str, &str, &str)]) {
    let land = |keys: &str| format!("[surface.land]\nfilter = {{ {keys} }}\n{SMALL}");
    for keys in good {
        load(land(keys)).expect(keys);
    }
    for (keys, key, expected) in bad {
        let error = load(land(keys)).expect_err(keys).to_string();
        assert!(
            error.contains(&format!("surface.land.filter.{key}: ")) && error.contains(expected),
            "{keys}: {error}"
        );
        assert_eq!(error.matches("surface.land.filter").count(), 1, "{keys}: {error}");
    }
}

#[test]
fn a_setting_of_the_ellipse_out_of_its_range_is_rejected_at_its_key() {
    let good = [
        "kind = \"ellipse\", k = 0, minor_texels = 0, max_anisotropy = 64",
        "kind = \"ellipse\", scan = \"bounding-box\", determinant = \"subtracting\"",
        "kind = \"feline\", max_anisotropy = 16",
    ];
    let bad = [
        (
            "kind = \"feline\", max_anisotropy = 17",
            "max_anisotropy",
            "17 is above 16, the most for kind = \"feline\"",
        ),
        ("max_anisotropy = 17", "max_anisotropy", "17 is above 16, the most for kind = \"trilinear\""),
        ("kind = \"ellipse\", max_anisotropy = 65", "max_anisotropy", "65 is outside 1 ..= 64"),
        ("kind = \"ellipse\", k = -0.1", "k", "-0.1 is outside 0 ..= 4"),
        ("kind = \"ellipse\", k = 4.1", "k", "4.1 is outside 0 ..= 4"),
        ("kind = \"ellipse\", k = nan", "k", "NaN is outside 0 ..= 4"),
        ("kind = \"ellipse\", minor_texels = 5", "minor_texels", "5 is outside 0 ..= 4"),
        (
            "kind = \"ellipse\", scan = \"row\"",
            "scan",
            "\"row\" is not one of \"row-span\", \"bounding-box\"",
        ),
        (
            "kind = \"ellipse\", determinant = \"exact\"",
            "determinant",
            "\"exact\" is not one of \"all-positive\",",
        ),
    ];
    check_filters(&good, &bad);
}

#[test]
fn a_weight_map_that_does_not_exist_is_rejected_at_its_key() {
    let good = [
        "kind = \"ellipse\", weight_map = \"none\"",
        "kind = \"ellipse\", weight_map = \"square\", map_entries = 256, map_bits = 8",
        "kind = \"ellipse\", weight_map = \"radial\", map_entries = 4, map_linear = true",
    ];
    let bad = [
        ("kind = \"ellipse\", kernel = \"weight-map\"", "kernel", "name that kernel, and add weight_map"),
        ("kind = \"feline\", weight_map = \"radial\"", "weight_map", "kind = \"feline\""),
        ("kind = \"ellipse\", map_entries = 64", "map_entries", "weight_map = \"none\" has no map_entries"),
        (
            "kind = \"ellipse\", weight_map = \"disc\"",
            "weight_map",
            "\"disc\" is not one of \"none\", \"square\",",
        ),
        (
            "kind = \"ellipse\", weight_map = \"radial\", map_entries = 48",
            "map_entries",
            "48 is not a power of two",
        ),
        (
            "kind = \"ellipse\", weight_map = \"radial\", map_entries = 512",
            "map_entries",
            "512 is outside 4 ..= 256",
        ),
        ("kind = \"ellipse\", weight_map = \"radial\", map_bits = 12", "map_bits", "12 is neither 8 nor 16"),
        (
            "kind = \"ellipse\", weight_map = \"quadrant\", map_linear = true",
            "map_linear",
            "a two-dimensional map is not interpolated",
        ),
    ];
    check_filters(&good, &bad);
}
