//! `ortelius trade`: a small sweep with a choice, and rejected inputs.

use super::*;
use serde_json::Value;

/// The scene with a comment at the line that `--write` changes.
fn commented() -> String {
    let variant = "[surface.land.filter]\n# What the paper has.\nkind = \"trilinear\" # two levels\n";
    small_scene(SYNTHETIC) + variant
}

#[test]
fn a_sweep_finds_its_front_and_writes_the_setting_within_the_bound() {
    let folder = folder();
    write(&folder, "small.toml", &commented());
    let sweep = ["trade", "small.toml", "--size", "96x54", "--knobs", "level-bias,filter"];
    let ran = run(&folder, &[&sweep[..], &["--json", "-o", "report"]].concat());
    let words = String::from_utf8(ran.stderr).unwrap();
    assert_eq!(ran.status.code(), Some(0), "{words}");
    let trade: Value = serde_json::from_slice(&ran.stdout).unwrap();
    assert_eq!((&trade["format"], &trade["version"]), (&"ortelius-trade".into(), &1.into()));
    let settings = trade["settings"].as_array().unwrap();
    // Three biases; trilinear, bilinear, and 1, 4 and 16 single texels. At the scene's own bias also Feline twice,
    // Mavridis, pbrt's EWA and random texels of the ellipse.
    assert_eq!((settings.len(), trade["refused"].as_array().unwrap().len()), (3 * 5 + 5, 0));
    let number = |setting: &Value, key: &str| setting[key].as_f64().unwrap();
    let named = |name: &str| settings.iter().find(|setting| setting["name"] == name).unwrap();
    let (own, coarse) = (named("the scene's own"), named("bias 2"));
    assert!(4.0 * number(own, "error") < number(coarse, "error"), "{own} {coarse}");
    assert!(number(named("stochastic 16"), "error") < number(named("stochastic 1, NA 1"), "error"));
    let front: Vec<&Value> = settings.iter().filter(|setting| setting["on_front"] == true).collect();
    let min = settings.iter().map(|setting| number(setting, "error")).fold(f64::INFINITY, f64::min);
    assert!(front.iter().any(|member| number(member, "error") <= 1.01 * min), "{front:?}");
    let page = read(&folder, "report/index.html");
    assert!(page.contains("<svg") && page.contains("bias 2") && page.contains("p5 to p95"));
    assert_eq!(
        read(&folder, "report/trade.json").trim_end(),
        String::from_utf8(ran.stdout).unwrap().trim_end()
    );
    assert!(read(&folder, "report/trade.svg").contains("<style>"));

    // Errors and settings are the same the second time. Whether the front is the same depends on times, so that is not
    // tested.
    let again = run(&folder, &[&sweep[..], &["--against", "report/trade.json"]].concat());
    let said = String::from_utf8(again.stdout).unwrap();
    let found = said.lines().skip_while(|line| !line.contains("front")).collect::<Vec<_>>();
    assert!(
        found[0].contains("Pareto front") && found[0].contains(": the times of 95 % of the 20 settings"),
        "{said}"
    );
    assert!(!said.contains("another error"), "{said}");

    // With any error allowed, the fastest setting is chosen.
    let ran = run(&folder, &[&sweep[..4], &["--knobs", "filter", "--max-error", "0.9", "--write"]].concat());
    let said = String::from_utf8(ran.stdout).unwrap();
    assert_eq!(ran.status.code(), Some(0), "{}", String::from_utf8_lossy(&ran.stderr));
    holds(&said, &["p5 to p95", "cheapest with NMSE <= 0.9: "]);
    let chosen = said.lines().last().unwrap().split("-D ").skip(1).map(str::trim).collect::<Vec<_>>();
    let written = read(&folder, "small.toml");
    holds(&written, &["# What the paper has.", "# two levels"]);
    let changes: Vec<String> = chosen.iter().map(ToString::to_string).collect();
    let of = |text: &str, changes: &[String]| {
        write(&folder, "other.toml", text);
        ortelius::scene::Scene::load_with(folder.path().join("other.toml").to_str().unwrap(), changes)
            .unwrap()
    };
    assert_eq!(of(&written, &[]), of(&commented(), &changes));
}

#[test]
fn a_bound_that_no_setting_satisfies_is_reported_with_the_nearest_setting() {
    let folder = folder();
    write(&folder, "small.toml", &commented());
    let sweep = ["trade", "small.toml", "--size", "96x54"];
    let ran = run(&folder, &[&sweep[..], &["--knobs", "list", "--max-ms", "0"]].concat());
    assert_eq!(ran.status.code(), Some(1));
    let words = String::from_utf8(ran.stderr).unwrap();
    holds(
        words.lines().last().unwrap(),
        &["ortelius: none of 5 settings takes at most 0 ms; the fastest is "],
    );
    let said = String::from_utf8(ran.stdout).unwrap();
    holds(
        &said,
        &["not on the Pareto front: feedback 1/256 (", "incomplete list, complete after 256 frames"],
    );
}

#[test]
fn budgets_change_the_frames_until_settled_but_not_the_picture() {
    let folder = folder();
    write(&folder, "small.toml", &commented());
    let sweep = ["trade", "small.toml", "--size", "96x54", "--knobs", "budgets,gpu-tiles", "-o", "report"];
    let ran = run(&folder, &sweep);
    let words = String::from_utf8(ran.stderr).unwrap();
    assert_eq!(ran.status.code(), Some(0), "{words}");
    let trade: Value = serde_json::from_str(&read(&folder, "report/trade.json")).unwrap();
    let names: Vec<&str> =
        trade["settings"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert!(names.len() == 3 && names[1].starts_with("N1 "), "{names:?}");
    let budgets = trade["budgets"].as_array().unwrap();
    assert_eq!(budgets.len(), 7);
    for budget in budgets {
        assert!(budget["frames"].as_u64().unwrap() > 1 && budget["differing_bytes"] == 0, "{budget}");
    }
    let said = String::from_utf8(ran.stdout).unwrap();
    holds(&said, &["cache.upload_budget_ms=0.5: ", "frames, ", "the same settled picture"]);
    assert!(read(&folder, "report/index.html").contains("Budgets: frames until settled"));
}

/// Without a virtual texture: a relief's methods, or the filters of a plain texture.
#[test]
fn a_scene_with_plain_textures_has_a_front() {
    let folder = folder();
    // A small relief: the brick wall's distance map takes half a minute.
    let heights = image::GrayImage::from_fn(16, 16, |x, y| {
        image::Luma([if (x / 4 + y / 4) % 2 == 0 { 255 } else { 0 }])
    });
    heights.save(folder.path().join("heights.png")).unwrap();
    let colours =
        image::RgbImage::from_fn(16, 16, |x, y| image::Rgb([60 + 8 * x as u8, 90, 200 - 8 * y as u8]));
    colours.save(folder.path().join("colours.png")).unwrap();
    let file = [
        "-Dsurface.floor.relief.map=file",
        "-Dsurface.floor.relief.path=heights.png",
        "-Dsurface.floor.texture.source=file",
        "-Dsurface.floor.texture.path=colours.png",
    ];
    let errors = |arguments: &[&str]| -> Vec<(String, f64)> {
        let ran = run(&folder, &[&["trade", "--size", "64x36", "--json"], arguments].concat());
        assert_eq!(ran.status.code(), Some(0), "{}", String::from_utf8(ran.stderr).unwrap());
        let trade: Value = serde_json::from_slice(&ran.stdout).unwrap();
        let settings = trade["settings"].as_array().unwrap();
        assert!(settings.iter().any(|setting| setting["on_front"] == true));
        let named = |setting: &Value| setting["name"].as_str().unwrap().to_string();
        settings.iter().map(|setting| (named(setting), setting["error"].as_f64().unwrap())).collect()
    };
    let relief = errors(&[&["relief-brick"], &file[..]].concat());
    let names: Vec<&str> = relief.iter().map(|(name, _)| &**name).collect();
    let methods = [
        "visible-texels",
        "whole-footprint",
        "unperturbed-derivatives",
        "offset",
        "trace",
        "trace-donnelly",
        "trace-cones",
        "trace-relaxed-cones",
        "trace-linear",
    ];
    assert_eq!(names, [&["the scene's own"][..], &methods].concat());
    assert!(relief.iter().all(|(_, error)| (1e-6..0.1).contains(error)), "{relief:?}");
    let of_trace = relief.iter().find(|(name, _)| name == "trace").expect("listed").1;
    assert!(relief[0].1 != of_trace, "{relief:?}");
    let plane = errors(&["plane-tilt"]);
    let of =
        |name: &str| plane.iter().find(|(found, _)| found == name).unwrap_or_else(|| panic!("{plane:?}")).1;
    assert!(plane.len() == 14 && of("the scene's own") < of("trilinear"), "{plane:?}");
    let knobs = run(&folder, &["trade", "plane-tilt", "--knobs", "filter"]);
    assert_eq!(knobs.status.code(), Some(2));
    holds(&String::from_utf8(knobs.stderr).unwrap(), &["no virtual texture", "omit --knobs"]);
}

#[test]
fn invalid_outputs_and_knobs_are_rejected_before_any_measurement() {
    let folder = folder();
    write(&folder, "small.toml", &commented());
    write(&folder, "newer.json", "{\"format\": \"ortelius-trade\", \"version\": 2}");
    for (arguments, code, words) in [
        (
            &["earth", "--write", "--max-ms", "5"][..],
            2,
            &["earth is a shipped scene", "copy scenes/earth.toml"][..],
        ),
        (&["small.toml", "--write"], 2, &["give --max-error or --max-ms"]),
        (&["nowhere"], 2, &["nowhere", "shipped scenes: "]),
        (&["small.toml", "-o", "small.toml"], 1, &["-o small.toml: small.toml is not a folder"]),
        (&["small.toml", "-o", "/proc/trade"], 1, &["-o /proc/trade: cannot write in /proc"]),
        (
            &["small.toml", "--against", "small.toml"],
            1,
            &["--against small.toml: not a trade.json of this program"],
        ),
        (
            &["small.toml", "--against", "newer.json"],
            1,
            &[
                "--against newer.json",
                "format \"ortelius-trade\" version 2",
                "reads format \"ortelius-trade\" version 1",
            ],
        ),
        (&["small.toml", "--against", "none.json"], 1, &["none.json", "No such file"]),
        (&["small.toml", "--device", "no such device"], 2, &["\"no such device\""]),
    ] {
        let (found, line) = failure(&mut ortelius(&folder, &[&["trade"], arguments].concat()));
        assert_eq!(found, code, "{line}");
        holds(&line, words);
    }
    let ran = run(&folder, &["trade", "small.toml", "--max-error", "-1"]);
    assert_eq!((ran.status.code(), ran.stdout.len()), (Some(2), 0));
    holds(&String::from_utf8(ran.stderr).unwrap(), &["'-1'", "expected a number, 0 or more"]);
    for arguments in [
        &["trade", "small.toml", "--max-ms", "-1"][..],
        &["trade", "small.toml", "--max-error", "1", "--max-ms", "1"],
        &["trade", "small.toml", "--knobs", "filtre"],
        &["trade", "small.toml", "--write", "--max-ms", "1", "-D", "variant.level_bias=1"],
        &["trade", "small.toml", "--error", "mse"],
    ] {
        let ran = run(&folder, arguments);
        assert_eq!((ran.status.code(), ran.stdout.len()), (Some(2), 0), "{arguments:?}");
    }
    assert_eq!(
        (read(&folder, "small.toml"), names(&folder)),
        (commented(), vec!["newer.json".to_string(), "small.toml".to_string()])
    );
}

/// The run clamps the knob's level bias to the coarsest level.
#[test]
fn a_texture_smaller_than_the_knobs_bias_is_swept() {
    let folder = folder();
    let small = [
        "trade",
        "earth",
        "-D",
        "surface.land.texture.width_log2=10",
        "-D",
        "surface.land.texture.height_log2=9",
    ];
    let sweep = ["--max-error", "1", "--knobs", "level-bias", "--size", "96x54"];
    let ran = run(&folder, &[&small[..], &sweep].concat());
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
}
