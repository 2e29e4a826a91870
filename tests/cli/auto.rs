//! `filter = "auto"`: one measurement for a device, and a report that names the choice.

use super::*;
use serde_json::Value;

/// Runs `render` with the cache folder `cache`.
fn render(folder: &TempDir, arguments: &[&str]) -> Command {
    let mut command = ortelius(folder, &[&["render"], arguments].concat());
    command.env("XDG_CACHE_HOME", folder.path().join("cache")).env_remove("ORTELIUS_CACHE");
    command
}

/// The messages of a successful run.
fn said(mut command: Command) -> String {
    let ran = command.output().unwrap();
    let words = String::from_utf8(ran.stderr).unwrap();
    assert_eq!(ran.status.code(), Some(0), "{words}");
    words
}

/// The kept front.
fn kept(folder: &TempDir) -> String {
    let fronts = std::fs::read_dir(folder.path().join("cache/ortelius/fronts")).unwrap();
    let names: Vec<String> = fronts.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    assert_eq!(names.len(), 1, "{names:?}");
    format!("cache/ortelius/fronts/{}", names[0])
}

/// Edits the kept front.
fn edit(folder: &TempDir, change: impl Fn(&mut Value)) {
    let name = kept(folder);
    let mut front: Value = serde_json::from_str(&read(folder, &name)).unwrap();
    change(&mut front);
    write(folder, &name, &front.to_string());
}

#[test]
fn a_front_is_measured_once_for_a_device_and_the_report_names_the_choice() {
    let folder = folder();
    let scene = small_scene(SYNTHETIC).replacen('\n', "\nfilter = \"auto\"\nmax_error = 1.0\n", 1);
    write(&folder, "s.toml", &scene);
    let run = ["s.toml", "--size", "48x27"];
    let words = said(render(&folder, &[&run[..], &["-o", "a.png"]].concat()));
    holds(&words, &["measuring filters on ", "surface.land.filter: ", "measured now"]);

    // A front of two settings.
    edit(&folder, |front| {
        for setting in front["settings"].as_array_mut().unwrap() {
            let (on_front, error, ms) = match setting["name"].as_str().unwrap() {
                "stochastic 4" => (true, 0.25, 1.0),
                "ellipse, minor 1, NA 4" => (true, 0.125, 2.0),
                _ => (false, 0.0, 0.5),
            };
            (setting["on_front"], setting["error"]) = (on_front.into(), error.into());
            setting["ms"]["median"] = ms.into();
        }
    });
    let bounds = ["max_error=0.3", "max_error=0.2"].map(|bound| format!("-Dsurface.land.{bound}"));
    let words =
        said(render(&folder, &[&run[..], &[&bounds[0], "-o", "b.png", "--report", "r.json"]].concat()));
    holds(&words, &["stochastic 4 (1.00 ms, NMSE 2.50e-1), measured before"]);
    assert!(!words.contains("measuring"), "{words}");
    let words = said(render(&folder, &[&run[..], &[&bounds[1], "-o", "c.png"]].concat()));
    holds(&words, &["ellipse, minor 1, NA 4 (2.00 ms, NMSE 1.25e-1), measured before"]);
    let (code, line) = failure(&mut render(
        &folder,
        &["s.toml", "--size", "48x27", "-Dsurface.land.max_error=0.1", "-o", "d.png"],
    ));
    assert_eq!(code, 2);
    holds(&line, &["max_error=0.1", "no filter satisfies this bound; the nearest is ellipse, minor 1, NA 4"]);

    // The report needs no front.
    let report: Value = serde_json::from_str(&read(&folder, "r.json")).unwrap();
    holds(report["run"]["scene"].as_str().unwrap(), &["kind = \"stochastic\"", "samples = 4"]);
    let elsewhere = super::folder();
    let path = folder.path().join("r.json").display().to_string();
    said(render(&elsewhere, &[&path, "-o", "again.png"]));
    let bytes = |folder: &TempDir, name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(bytes(&elsewhere, "again.png") == bytes(&folder, "b.png"));
    assert!(bytes(&folder, "b.png") != bytes(&folder, "c.png"), "the choice changes the picture");
    assert!(!elsewhere.path().join("cache/ortelius").exists());

    // Another device's front is measured again, by the rule of `Machine::is_same`.
    edit(&folder, |front| front["machine"]["device"] = "another".into());
    let words = said(render(&folder, &[&run[..], &["-o", "e.png"]].concat()));
    holds(&words, &["measured now"]);
    let front: Value = serde_json::from_str(&read(&folder, &kept(&folder))).unwrap();
    assert_ne!(front["machine"]["device"], "another");
}

/// A plain texture's filter is measured, and a relief's method.
#[test]
fn a_scene_without_a_virtual_texture_has_a_front_too() {
    let folder = folder();
    // A small relief: the brick wall's distance map takes half a minute.
    let heights = image::GrayImage::from_fn(16, 16, |x, y| image::Luma([(x / 4 + y / 4) as u8 % 2 * 255]));
    heights.save(folder.path().join("heights.png")).unwrap();
    let relief = ["relief.map=file", "relief.path=heights.png", "filter=auto", "max_error=1.0"]
        .map(|change| format!("-Dsurface.floor.{change}"));
    let board = ["filter=auto", "max_ms=1e6"].map(|change| format!("-Dsurface.board.{change}"));
    for (scene, changes, surface, chosen) in
        [("relief-brick", &relief[..], "floor", "method = "), ("plane-tilt", &board[..], "board", "kind = ")]
    {
        let mut run = vec![scene, "--size", "48x27", "-o", "a.png", "--report", "r.json"];
        run.extend(changes.iter().map(|change| &**change));
        let words = said(render(&folder, &run));
        holds(&words, &["measuring filters on ", &format!("surface.{surface}.filter: "), "measured now"]);
        let report: Value = serde_json::from_str(&read(&folder, "r.json")).unwrap();
        let text = report["run"]["scene"].as_str().unwrap();
        let left = ["auto", "max_error", "max_ms"].into_iter().find(|word| text.contains(word));
        assert!(text.contains(chosen) && left.is_none(), "{left:?}: {text}");
        holds(&said(render(&folder, &run)), &["measured before"]);
    }
    // Other heights in a file of the same name need another front.
    image::GrayImage::new(16, 16).save(folder.path().join("heights.png")).unwrap();
    let mut run = vec!["relief-brick", "--size", "48x27", "-o", "a.png"];
    run.extend(relief.iter().map(|change| &**change));
    holds(&said(render(&folder, &run)), &["measured now"]);
}
