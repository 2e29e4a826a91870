//! `--report`.

use super::*;
use serde_json::Value;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;

const SMALL: [&str; 3] = ["--size", "160x90", "--report"];

#[test]
fn the_reports_key_numbers_are_unique_integers() {
    let folder = folder();
    rendered(&folder, &[&["earth"], &SMALL[..], &["a.json", "--compare-plain", "-o", "a.png"]].concat());
    let text = read(&folder, "a.json");
    let report: Value = serde_json::from_str(&text).unwrap();
    for (key, number) in [
        ("texture_width", 262_144),
        ("texture_height", 131_072),
        ("tile_size", 512),
        ("levels", 18),
        ("resident_levels", 10),
        ("max_anisotropy", 16),
    ] {
        assert_eq!(text.matches(&format!("\"{key}\":")).count(), 1, "{key}");
        assert!(text.contains(&format!("\"{key}\": {number},")), "{key} is no integer {number}");
        let at = if key == "max_anisotropy" { &report["variant"]["filter"] } else { &report };
        assert_eq!(at[key], number);
    }
    assert_eq!(text.matches("\"settled_over_plain\":").count(), 1);
    let plain = &report["plain"];
    let of = |what: &str, value: &str| plain[what][value].as_f64().unwrap();
    // Each round's ratio, and so the median, lies between the quotients of the extreme times.
    let min = of("settled_frame_ns", "min") / of("plain_frame_ns", "max");
    let max = of("settled_frame_ns", "max") / of("plain_frame_ns", "min");
    let ratio = of("settled_over_plain", "median");
    assert!((min..=max).contains(&ratio), "{ratio} is not within {min} and {max}");
    assert_eq!(of("settled_over_plain", "count"), of("settled_frame_ns", "count"));
}

#[test]
fn a_report_has_each_frames_passes_and_all_inputs_of_the_run() {
    let folder = folder();
    let arguments = [&["earth"], &SMALL[..], &["a.json", "--frames", "5", "--deterministic"]].concat();
    let mut command = ortelius(&folder, &[&["render"], &arguments[..]].concat());
    // Neither an environment variable nor an argument must be Unicode.
    let ran =
        command.env("ORTELIUS_NOTE", OsStr::from_bytes(b"caf\xe9")).env("OTHER", "no").output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let text = read(&folder, "a.json");
    let report: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(report["latency_frames"], 2);
    assert_eq!(report["cache"]["deterministic"], true);
    assert!(!text.contains("settled_over_plain"), "nothing was compared");
    let frames = report["frames"].as_array().unwrap();
    assert_eq!(frames.len(), 5);
    for (n, frame) in frames.iter().enumerate() {
        assert_eq!(frame["frame"], n);
        let passes = frame["passes"].as_array().unwrap();
        let labels: Vec<&str> = passes.iter().map(|pass| pass["label"].as_str().unwrap()).collect();
        for label in ["footprint", "dedup", "compact", "texturing"] {
            assert_eq!(labels.iter().filter(|found| **found == label).count(), 1, "{label} in {labels:?}");
        }
        assert!(passes.iter().all(|pass| pass["ns"].is_u64()), "a software driver keeps time: {passes:?}");
        for key in ["triples", "tiles", "hits", "misses", "uploads", "upload_bytes", "gpu_evictions", "bias"]
        {
            assert!(frame[key].is_u64(), "{key}");
        }
    }
    assert!(frames[0]["tiles"].as_u64().unwrap() > 0);
    let uploaded: u64 = frames.iter().map(|frame| frame["uploads"].as_u64().unwrap()).sum();
    let bytes: u64 = frames.iter().map(|frame| frame["upload_bytes"].as_u64().unwrap()).sum();
    assert!(uploaded > 0);
    assert_eq!(bytes, uploaded * 4 * (520 * 520 + 260 * 260), "a tile and its coarser half, 4 bytes a texel");
    let manifest = &report["manifest"];
    assert_eq!(manifest["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(manifest["environment"]["ORTELIUS_NOTE"], "caf\u{fffd}");
    assert_eq!(manifest["environment"].get("OTHER"), None);
    let given: Vec<&str> =
        manifest["arguments"].as_array().unwrap().iter().skip(2).map(|a| a.as_str().unwrap()).collect();
    assert_eq!(given, arguments);
}

#[test]
fn a_frame_of_tiles_and_meshes_has_each_key_once() {
    let folder = folder();
    let mesh = "surface.bunny={geometry={kind='progressive-mesh', source='sphere', size_m=9e4, latitude_deg=30.2, \
                longitude_deg=31.6}}";
    rendered(&folder, &["earth", "-D", mesh, "--size", "32x18", "--frames", "3", "--report", "a.json"]);
    let text = read(&folder, "a.json");
    let frames = text.matches("\"list_of_frame\":").count();
    assert_eq!(frames, 3);
    for key in ["upload_bytes", "mesh_upload_bytes", "uploads", "faces", "host_ns", "host_list_ns"] {
        let within = text.split("\"frames\":").nth(1).unwrap();
        assert_eq!(within.matches(&format!("\"{key}\":")).count(), frames, "{key}");
    }
    let report: Value = serde_json::from_str(&text).unwrap();
    assert!(report["frames"][0]["mesh_upload_bytes"].as_u64().unwrap() > 0);
}

#[test]
fn a_report_names_the_variant_that_ran() {
    let folder = folder();
    let variant = ["-Dvariant.request_format=packed", "-Dvariant.address=own-level", "-Dvariant.memo=false"];
    let more = [
        "-Dvariant.block_log2=1",
        "-Dsurface.land.filter.kind=trilinear",
        "-Dsurface.land.filter.max_anisotropy=4",
        "-Dsurface.land.filter.interpolation=literal",
    ];
    let arguments = [&["earth"], &SMALL[..], &["a.json", "--frames", "1"], &variant, &more].concat();
    rendered(&folder, &arguments);
    let text = read(&folder, "a.json");
    let report: Value = serde_json::from_str(&text).unwrap();
    let ran = &report["variant"];
    assert_eq!(ran["request_format"], "packed");
    assert_eq!(ran["address"], "own-level");
    assert_eq!(ran["memo"], false);
    assert_eq!(ran["block_log2"], 1);
    assert_eq!(ran["filter"]["interpolation"], "literal");
    assert_eq!(ran["filter"]["max_anisotropy"], 4);
    assert_eq!(text.matches("\"max_anisotropy\"").count(), 1);
}

/// Settings of other sections are in the scene's text: `run.scene`.
#[test]
fn a_report_has_every_setting_of_the_variant_the_caches_and_the_filter() {
    let folder = folder();
    rendered(&folder, &["plane", "--size", "32x18", "--frames", "1", "--report", "a.json"]);
    let report: Value = serde_json::from_str(&read(&folder, "a.json")).unwrap();
    let places =
        [("variant.", "/variant/"), ("cache.", "/cache/"), ("surface.NAME.filter.", "/variant/filter/")];
    let keys = ortelius::scene::keys(ortelius::renderer::sections::LANGUAGES);
    let mut found = 0;
    for (prefix, place) in places {
        for key in keys.iter().filter_map(|at| at.dotted.strip_prefix(prefix)) {
            assert!(report.pointer(&format!("{place}{key}")).is_some(), "{prefix}{key} is not in the report");
            found += 1;
        }
    }
    assert!(found > 15, "{found} keys");
    let scene: toml::Table = report["run"]["scene"].as_str().unwrap().parse().unwrap();
    assert!(scene.contains_key("surface") && scene.contains_key("view"));
}

#[test]
fn records_are_a_header_and_the_reports_frames_one_per_line() {
    let folder = folder();
    let run = ["--frames", "4", "--deterministic", "--records", "a.jsonl"];
    rendered(&folder, &[&["earth"], &SMALL[..], &["a.json"], &run[..]].concat());
    let report: Value = serde_json::from_str(&read(&folder, "a.json")).unwrap();
    let lines = read(&folder, "a.jsonl");
    let lines: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let (header, frames) = lines.split_first().unwrap();
    assert_eq!(header, &serde_json::json!({"format": "ortelius-records", "version": 1}));
    assert_eq!((frames.len(), &report["frames"]), (4, &Value::from(frames)));
    // Without a report, frames are not kept in memory, but every line is written.
    rendered(&folder, &["bunny", "--size", "64x36", "--frames", "3", "--records", "b.jsonl"]);
    assert_eq!(read(&folder, "b.jsonl").lines().count(), 1 + 3);
}
