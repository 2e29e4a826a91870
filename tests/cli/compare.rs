//! `ortelius compare`: hand-computed measures, maps, and rejected inputs.

use super::*;
use ortelius::picture::Picture;
use ortelius::picture::write::{Planes, read_exr, write_exr, write_png};
use serde_json::Value;

/// 40 x 20 pixels of 0.5 in linear light.
fn grey() -> Picture {
    Picture::filled(40, 20, [0.5, 0.5, 0.5, 1.0])
}

fn save(folder: &TempDir, name: &str, picture: &Picture) {
    write_exr(&folder.path().join(name), &Planes::from(picture)).unwrap();
}

/// Grey except for green at (7, 3), which is 0.75.
fn wrong() -> Picture {
    let mut picture = grey();
    picture.rgba[3 * 40 + 7][1] = 0.75;
    picture
}

fn said(folder: &TempDir, arguments: &[&str]) -> String {
    let ran = run(folder, &[&["compare"], arguments].concat());
    let words = String::from_utf8(ran.stderr).unwrap();
    assert_eq!((ran.status.code(), &*words), (Some(0), ""), "{arguments:?}");
    String::from_utf8(ran.stdout).unwrap()
}

fn json(folder: &TempDir, arguments: &[&str]) -> Value {
    let said: Value = serde_json::from_str(&said(folder, &[arguments, &["--json"]].concat())).unwrap();
    assert_eq!((&said["format"], &said["version"]), (&"ortelius-comparison".into(), &2.into()));
    said["comparisons"].clone()
}

#[test]
fn every_measure_of_a_wrong_pixel_is_the_hand_computed_one() {
    let folder = folder();
    save(&folder, "a.exr", &wrong());
    save(&folder, "b.exr", &grey());
    let found = &json(&folder, &["a.exr", "b.exr", "--outliers-above", "0.2"])[0];
    // One of 2400 values of 0.5 differs by 0.25.
    assert_eq!(found["nmse"].as_f64().unwrap(), 0.0625 / 600.0);
    assert!((found["psnr_db"].as_f64().unwrap() - 10.0 * (2400.0f64 / 0.0625).log10()).abs() < 1e-9);
    assert_eq!(found["worst"], serde_json::json!({ "x": 7, "y": 3, "value": 0.25 }));
    assert_eq!((&found["outliers"], &found["pixels"]), (&1.into(), &800.into()));
    let flip = found["flip_mean"].as_f64().unwrap();
    assert!(0.0 < flip && flip < 0.1, "{flip}");
    // A pixel exactly at the bound is not counted.
    assert_eq!(json(&folder, &["a.exr", "b.exr", "--outliers-above", "0.25"])[0]["outliers"], 0);
    let words = said(&folder, &["a.exr", "b.exr"]);
    holds(
        &words,
        &[
            "A: a.exr against b.exr",
            "NMSE          1.042e-4",
            "0.25000 at (7, 3)",
            "above 0.01953",
            "1 of 800",
        ],
    );
    // A picture compared with itself; JSON has no infinity.
    let same = &json(&folder, &["a.exr", "a.exr"])[0];
    assert_eq!(
        (&same["nmse"], &same["flip_worst"], &same["psnr_db"]),
        (&0.0.into(), &0.0.into(), &Value::Null)
    );
}

#[test]
fn alpha_is_ignored_and_the_pixels_that_differ_in_it_are_counted() {
    let folder = folder();
    let mut clear = grey();
    (clear.rgba[0][3], clear.rgba[9][3]) = (0.25, 0.5);
    save(&folder, "clear.exr", &clear);
    save(&folder, "grey.exr", &grey());
    let found = &json(&folder, &["clear.exr", "grey.exr"])[0];
    assert_eq!((&found["alpha_differs"], &found["nmse"]), (&2.into(), &0.0.into()));
    assert_eq!((&found["worst"]["value"], &found["outliers"]), (&0.0.into(), &0.into()));
    holds(&said(&folder, &["clear.exr", "grey.exr"]), &["alpha         ignored, 2 pixels differ"]);
    assert!(!said(&folder, &["grey.exr", "grey.exr"]).contains("alpha"));
}

#[test]
fn a_png_is_compared_in_linear_light() {
    let folder = folder();
    let bytes = |code: u8| Srgb8Picture { width: 2, height: 2, rgba: [code, code, code, 255].repeat(4) };
    write_png(&folder.path().join("white.png"), &bytes(255)).unwrap();
    write_png(&folder.path().join("half.png"), &bytes(188)).unwrap();
    save(&folder, "half.exr", &Picture::filled(2, 2, [0.5, 0.5, 0.5, 1.0]));
    // Code 188 is half of white's linear light, not 188/255 of it.
    let found = &json(&folder, &["half.png", "white.png"])[0];
    assert!((found["nmse"].as_f64().unwrap() - 0.25).abs() < 0.005, "{found}");
    let found = &json(&folder, &["half.png", "half.exr"])[0];
    assert!(found["worst"]["value"].as_f64().unwrap() < 0.005, "{found}");
}

#[test]
fn two_pictures_are_measured_against_a_reference_and_drawn_side_by_side() {
    let folder = folder();
    save(&folder, "a.exr", &wrong());
    save(&folder, "b.exr", &Picture::filled(40, 20, [0.4, 0.5, 0.5, 1.0]));
    save(&folder, "r.exr", &grey());
    let arguments = ["a.exr", "b.exr", "--reference", "r.exr"];
    let found = json(&folder, &[&arguments[..], &["-o", "map.png"]].concat());
    assert_eq!((&found[0]["outliers"], &found[1]["outliers"]), (&1.into(), &800.into()));
    assert_eq!((&found[0]["truth"], &found[1]["picture"]), (&"r.exr".into(), &"b.exr".into()));
    let map = picture(&folder.path().join("map.png"));
    let light = |x: u32, y: u32| {
        map.rgba[4 * (y * map.width + x) as usize..][..3].iter().map(|&c| u32::from(c)).sum::<u32>()
    };
    assert_eq!((light(6, 3), light(8, 3)), (0, 0), "A's other pixels are equal");
    assert!(light(7, 3) > light(48 + 7, 3) && light(48 + 7, 3) > 0, "0.25 is lighter than 0.1");
    said(&folder, &[&arguments[..], &["-o", "map.exr"]].concat());
    let planes = read_exr(&folder.path().join("map.exr")).unwrap();
    assert_eq!(
        planes.channels.keys().collect::<Vec<_>>(),
        ["A.B", "A.FLIP", "A.G", "A.R", "B.B", "B.FLIP", "B.G", "B.R"]
    );
    assert_eq!((planes.channels["A.G"][3 * 40 + 7], planes.channels["A.R"][3 * 40 + 7]), (0.25, 0.0));
    said(&folder, &["a.exr", "r.exr", "-o", "one.exr"]);
    let planes = read_exr(&folder.path().join("one.exr")).unwrap();
    assert_eq!(planes.picture().unwrap().at(7, 3), [0.0, 0.25, 0.0, 1.0]);
    assert!(planes.channels["FLIP"][3 * 40 + 7] > 0.0);
}

#[test]
fn incomparable_inputs_are_rejected_in_one_line() {
    let folder = folder();
    save(&folder, "a.exr", &grey());
    save(&folder, "small.exr", &Picture::filled(4, 3, [0.5; 4]));
    write(&folder, "broken.png", "no picture");
    write(&folder, "a.jpg", "no picture");
    for (arguments, code, words) in [
        (&["a.exr", "small.exr"][..], 1, &["a.exr and small.exr", "40 x 20", "4 x 3"][..]),
        (&["none.png", "a.exr"], 1, &["none.png", "No such file"]),
        (&["a.exr", "broken.png"], 1, &["cannot read broken.png"]),
        (&["a.jpg", "a.exr"], 2, &["a.jpg", ".png or .exr"]),
        (&["a.exr", "a.exr", "-o", "d.txt"], 2, &["d.txt", ".png or .exr"]),
        (&["a.exr", "small.exr", "-o", "a.exr"], 2, &["a.exr", "overwritten"]),
        (&["a.exr", "a.exr", "-o", "no/d.png"], 1, &["no/d.png", "folder no does not exist", "create it"]),
    ] {
        let (found, line) = failure(&mut ortelius(&folder, &[&["compare"], arguments].concat()));
        assert_eq!(found, code, "{line}");
        holds(&line, words);
    }
    let ran = run(&folder, &["compare", "a.exr", "a.exr", "--outliers-above", "-1"]);
    assert_eq!(ran.status.code(), Some(2));
    holds(&String::from_utf8(ran.stderr).unwrap(), &["'-1'", "expected a number of linear light, 0 or more"]);
    assert_eq!(names(&folder), ["a.exr", "a.jpg", "broken.png", "small.exr"]);
}
