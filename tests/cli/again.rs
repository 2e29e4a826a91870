//! Rendering a report again gives the same bytes, from any folder.

use super::*;
use serde_json::Value;

fn bytes(folder: &TempDir, name: &str) -> Vec<u8> {
    std::fs::read(folder.path().join(name)).unwrap()
}

fn path(folder: &TempDir, name: &str) -> String {
    folder.path().join(name).display().to_string()
}

/// The report's `run`.
fn run_of(folder: &TempDir, name: &str) -> Value {
    let report: Value = serde_json::from_str(&read(folder, name)).unwrap();
    assert_eq!((&report["format"], &report["version"]), (&"ortelius-render-report".into(), &5.into()));
    report["run"].clone()
}

/// Renders `arguments` in `folder`, and its report in a second folder, with a picture of this ending. Both runs
/// and both pictures must be equal; the second folder contains only `again.*`.
fn same_again(folder: &TempDir, arguments: &[&str], ending: &str) -> TempDir {
    let [first, second] = ["first", "again"].map(|name| format!("{name}.{ending}"));
    rendered(folder, &[arguments, &["-o", &first, "--report", "r.json"]].concat());
    let elsewhere = super::folder();
    rendered(&elsewhere, &[&*path(folder, "r.json"), "-o", &second, "--report", "again.json"]);
    assert_eq!(run_of(folder, "r.json"), run_of(&elsewhere, "again.json"));
    assert!(bytes(folder, &first) == bytes(&elsewhere, &second), "{arguments:?}");
    elsewhere
}

#[test]
fn a_figure_stands_for_its_first_view() {
    let folder = folder();
    let small = ["--size", "64x36", "--deterministic", "-o"];
    let papers = ["-Dsurface.land.filter={}", "-Dsurface.land.texture.border=16"];
    rendered(&folder, &[&["vt.limit"][..], &small, &["figure.png"]].concat());
    rendered(&folder, &[&["earth", "--camera", "headline"][..], &papers, &small, &["scene.png"]].concat());
    assert!(bytes(&folder, "figure.png") == bytes(&folder, "scene.png"));
    rendered(&folder, &[&["earth", "--camera", "headline"][..], &small, &["own.png"]].concat());
    assert!(bytes(&folder, "figure.png") != bytes(&folder, "own.png"), "the figure has the paper's filter");
    let (code, line) = render_failure(&folder, &["pm.build", "-o", "a.png"]);
    assert!(code == 2 && line.contains("pm.build has no picture: it times the building"), "{line}");
    assert!(line.contains("the nearest scene is bunny"), "{line}");
}

#[test]
fn a_landscape_with_overrides_is_reproduced_and_options_override_the_reports() {
    let folder = folder();
    let changes = ["-Dvariant.level_bias=2", "-D", "variant.address=own-level", "-Dcache.upload_budget_ms=1"];
    let run = ["earth", "--size", "160x90", "--camera", "oblique", "--frames", "3", "--deterministic"];
    let elsewhere = same_again(&folder, &[&run[..], &changes].concat(), "png");
    let report = path(&folder, "r.json");
    for (number, (options, size)) in [
        (&["--camera", "headline"][..], [160, 90]),
        (&["-Dview.camera=headline"], [160, 90]),
        (&["-Dvariant.level_bias=6"], [160, 90]),
        (&["--size", "80x45"], [80, 45]),
        (&["-Dview.width=80", "-Dview.height=45"], [80, 45]),
    ]
    .into_iter()
    .enumerate()
    {
        let name = format!("other{number}.png");
        rendered(&elsewhere, &[&[&*report, "-o", &*name][..], options].concat());
        let picture = picture(&elsewhere.path().join(&name));
        assert_eq!([picture.width, picture.height], size, "{options:?}");
        assert!(bytes(&elsewhere, &name) != bytes(&folder, "first.png"), "{options:?} changed nothing");
    }
    let [camera, key] = ["other0.png", "other1.png"].map(|name| bytes(&elsewhere, name));
    assert!(camera == key, "--camera and view.camera");
}

#[test]
fn progressive_meshes_are_reproduced() {
    let folder = folder();
    let run = ["herd", "--size", "128x72", "--path", "rise", "--frames", "4", "--deterministic"];
    same_again(&folder, &[&run[..], &["-Dsurface.herd.geometry.instances=20"]].concat(), "png");
}

#[test]
fn relative_files_are_found_from_another_folder() {
    let folder = folder();
    for name in ["scenes", "tiles"] {
        std::fs::create_dir(folder.path().join(name)).unwrap();
    }
    bake(&folder, "tiles/t.tiles", "rgba8");
    let scene = small_scene("source = \"file\"\npath = \"../tiles/t.tiles\"");
    write(&folder, "scenes/s.toml", &scene);
    same_again(&folder, &["scenes/s.toml"], "png");
    // A path given by -D is relative to the working directory.
    write(&folder, "scenes/none.toml", &scene.replace("t.tiles", "none.tiles"));
    let change = ["-D", "surface.land.texture.path=tiles/t.tiles"];
    same_again(&folder, &[&["scenes/none.toml"][..], &change].concat(), "png");
    let table = "surface.land.texture={kind=\"virtual\", source=\"file\", path=\"tiles/t.tiles\"}";
    same_again(&folder, &["scenes/none.toml", "-D", table], "png");
}

#[test]
fn linear_light_is_reproduced_also_with_only_a_report() {
    let folder = folder();
    write(&folder, "s.toml", &small_scene(SYNTHETIC));
    let elsewhere = same_again(&folder, &["s.toml", "--camera", "elsewhere"], "exr");
    rendered(&elsewhere, &[&path(&folder, "r.json"), "--report", "alone.json"]);
    assert_eq!(run_of(&elsewhere, "alone.json")["linear"], true);
    rendered(&elsewhere, &[&path(&folder, "r.json"), "--report", "png.json", "-o", "a.png"]);
    assert_eq!(run_of(&elsewhere, "png.json")["linear"], false);
}

#[test]
fn a_report_of_another_version_is_rejected_in_one_line_that_names_both() {
    let folder = folder();
    let own = "this program reads format \"ortelius-render-report\" versions 3 to 5";
    for (text, words) in [
        ("{}", &["it states no format", own][..]),
        (
            "{\"format\": \"ortelius-render-report\", \"version\": 6}",
            &["format \"ortelius-render-report\" version 6", own],
        ),
        (
            "{\"format\": \"ortelius-render-report\", \"version\": 2}",
            &["format \"ortelius-render-report\" version 2", own],
        ),
        ("{\"format\": \"ortelius-trade\", \"version\": 1}", &["format \"ortelius-trade\" version 1", own]),
        (
            "{\"format\": \"ortelius-render-report\", \"version\": 3}",
            &["this report cannot be rendered again"],
        ),
        ("[surface.land]", &["r.json: not a render report"]),
    ] {
        write(&folder, "r.json", text);
        let (code, line) = render_failure(&folder, &["r.json", "-o", "a.png"]);
        assert_eq!(code, 1, "{line}");
        holds(&line, words);
    }
    assert_eq!(render_failure(&folder, &["none.json", "-o", "a.png"]).0, 1);
    assert_eq!(names(&folder), ["r.json"]);
}

/// report-3.json was written by the last program with version 3 (commit 3f51fb6).
#[test]
fn a_report_of_version_3_gives_the_bytes_of_its_scene() {
    let folder = folder();
    let old = include_str!("report-3.json");
    write(&folder, "old.json", old);
    rendered(&folder, &["old.json", "-o", "old.png", "--report", "new.json"]);
    let [old, new] =
        [old, &read(&folder, "new.json")].map(|text| serde_json::from_str::<Value>(text).unwrap());
    assert_eq!((&old["version"], &old["run"]), (&3.into(), &new["run"]));
    write(&folder, "s.toml", old["run"]["scene"].as_str().unwrap());
    let run = ["--size", "64x36", "--frames", "1", "--settle", "--deterministic"];
    rendered(&folder, &[&["s.toml"][..], &run, &["-o", "scene.png"]].concat());
    assert!(bytes(&folder, "old.png") == bytes(&folder, "scene.png"));
    let other = read(&folder, "old.json").replace("longitude_deg = 31.0", "longitude_deg = -60.0");
    write(&folder, "other.json", &other);
    rendered(&folder, &["other.json", "-o", "other.png"]);
    assert!(bytes(&folder, "other.png") != bytes(&folder, "scene.png"), "the report's scene has no effect");
}

#[test]
fn a_camera_of_the_command_line_equals_its_keys_and_is_in_the_report() {
    let folder = folder();
    let eye = ["--lat", "-33.5", "--lon", "18", "--alt", "9e5", "--heading", "-20", "--tilt", "35"];
    let run = ["globe", "--size", "96x54", "--camera", "antarctica"];
    same_again(&folder, &[&run[..], &eye].concat(), "png");
    let keys =
        ["latitude_deg=-33.5", "longitude_deg=18.0", "altitude_m=9e5", "heading_deg=-20.0", "tilt_deg=35.0"];
    let keys = keys.map(|key| format!("-Dcameras.antarctica.{key}"));
    let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
    rendered(&folder, &[&run[..], &keys, &["-o", "keys.png"]].concat());
    assert!(bytes(&folder, "first.png") == bytes(&folder, "keys.png"));
    // A camera on the command line replaces the scene's own path, but conflicts with --path.
    rendered(&folder, &["herd", "--size", "96x54", "--tilt", "60", "-o", "herd.png"]);
    let (code, line) = render_failure(&folder, &["plane", "--lat", "1", "-o", "p.png"]);
    assert_eq!(code, 2);
    holds(&line, &["--lat", "plane", "east_m"]);
    for option in [["--lat", "91"], ["--tilt", "200"]] {
        let (code, line) = render_failure(&folder, &[&["globe"], &option[..], &["-o", "p.png"]].concat());
        assert_eq!(code, 2);
        holds(&line, &[&format!("{}: {} is outside", option[0], option[1])]);
        assert!(!line.contains("-D"), "{line}");
    }
    let refused = usage_error(&folder, &["render", "earth", "--path", "pan", "--tilt", "3", "-o", "p.png"]);
    holds(&refused, &["--tilt", "--path"]);
}

/// The message of clap for a rejected command line.
fn usage_error(folder: &TempDir, arguments: &[&str]) -> String {
    let ran = run(folder, arguments);
    assert_eq!(ran.status.code(), Some(2));
    String::from_utf8(ran.stderr).unwrap()
}
