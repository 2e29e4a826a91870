//! `ortelius keys`.

use super::*;

#[test]
fn keys_are_printed_by_prefix_with_their_whole_declaration() {
    let folder = folder();
    let said = |arguments: &[&str]| {
        let ran = run(&folder, &[&["keys"], arguments].concat());
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
        String::from_utf8(ran.stdout).unwrap()
    };
    let cache = said(&["cache.gpu"]);
    assert!(
        cache.starts_with("cache.gpu_tiles\n    integer, default 192, 1 .. 65536 tiles\n    Tiles in video"),
        "{cache}"
    );
    assert_eq!(cache.lines().count(), 3);
    holds(
        &said(&["surface.NAME.geometry.order"]),
        &["(kind = \"progressive-mesh\")", "default \"tail-23\"", "\n      \"skip-lists\": "],
    );
    let filter = said(&["filter.kind"]);
    assert!(filter.starts_with("surface.NAME.filter.kind"), "{filter}");
    assert!(said(&[]).lines().filter(|line| !line.starts_with(' ')).count() > 90);
    assert!(said(&["--markdown"]).starts_with("# Scene files\n"));
    let schema: serde_json::Value = serde_json::from_str(&said(&["--json-schema"])).unwrap();
    assert_eq!(schema["properties"]["cache"]["properties"]["gpu_tiles"]["default"], 192);
}

#[test]
fn a_prefix_of_no_key_is_a_usage_error() {
    let (code, line) = failure(&mut ortelius(&folder(), &["keys", "cash.gpu_tiles"]));
    assert_eq!(code, 2, "{line}");
    holds(&line, &["no key of scenes contains \"cash.gpu_tiles\"", "nearest is cache.gpu_tiles"]);
}

#[test]
fn an_unknown_section_is_reported_and_an_old_key_in_a_file_has_its_line() {
    let folder = folder();
    write(&folder, "s.toml", &format!("{}[sunn]\nazimuth_deg = 3\n", small_scene(SYNTHETIC)));
    let ran = run(&folder, &["render", "s.toml", "-o", "a.png"]);
    assert_eq!(ran.status.code(), Some(1));
    let words = String::from_utf8(ran.stderr).unwrap();
    holds(
        &words,
        &["s.toml:24:1: no scene has the key sunn.azimuth_deg; nearest is sun.azimuth_deg", "\n24 | "],
    );
    write(&folder, "s.toml", &format!("{}[mesh]\ncolumns = 3\n", small_scene(SYNTHETIC)));
    let words = String::from_utf8(run(&folder, &["trade", "s.toml"]).stderr).unwrap();
    holds(&words, &["s.toml:23:2: mesh is now surface.land.geometry"]);
}
