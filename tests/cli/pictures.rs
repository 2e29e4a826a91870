//! Sequences, picture names, `--explain`, validation.

use super::*;

/// Five places far apart in 12 frames.
const SEQUENCE: [&str; 8] =
    ["earth", "--size", "160x90", "--path", "teleport", "-Dpaths.teleport.frames=12", "--frames", "12"];

#[test]
fn a_deterministic_sequence_gives_the_same_bytes_twice() {
    let runs = [folder(), folder()];
    for folder in &runs {
        let more = ["--deterministic", "-o", "f{frame}.png", "--dump-visible", "a.csv"];
        rendered(folder, &[&SEQUENCE[..], &more].concat());
    }
    let mut expected: Vec<String> = (0..12).map(|frame| format!("f{frame:05}.png")).collect();
    expected.insert(0, "a.csv".into());
    assert_eq!(names(&runs[0]), expected);
    assert_eq!(names(&runs[1]), expected);
    let bytes = |folder: &TempDir, name: &str| std::fs::read(folder.path().join(name)).unwrap();
    for name in &expected {
        assert!(bytes(&runs[0], name) == bytes(&runs[1], name), "{name}");
    }
    // The frames differ, and so do the stops.
    assert!(bytes(&runs[0], "f00000.png") != bytes(&runs[0], "f00005.png"));
    assert!(bytes(&runs[0], "f00005.png") != bytes(&runs[0], "f00011.png"));
}

#[test]
fn a_name_without_a_frame_number_writes_only_the_last_picture() {
    let all = folder();
    rendered(&all, &[&SEQUENCE[..], &["--deterministic", "-o", "f{frame}.png"]].concat());
    let last = folder();
    rendered(&last, &[&SEQUENCE[..], &["--deterministic", "-o", "a.png"]].concat());
    assert_eq!(names(&last), ["a.png"]);
    let [a, b] = [all.path().join("f00011.png"), last.path().join("a.png")].map(|path| picture(&path));
    assert!(a == b);
}

#[test]
fn the_settled_picture_has_the_number_after_the_sequence() {
    let folder = folder();
    let size = ["earth", "--size", "160x90"];
    rendered(&folder, &[&size[..], &["-o", "s{frame}.png"]].concat());
    rendered(&folder, &[&size[..], &["-o", "f{frame}.png", "--frames", "2", "--settle"]].concat());
    assert_eq!(names(&folder), ["f00000.png", "f00001.png", "f00002.png", "s00000.png"]);
    let [a, b] = ["f00002.png", "s00000.png"].map(|name| picture(&folder.path().join(name)));
    assert!(a == b, "settled is settled");
}

#[test]
fn a_link_is_kept_and_its_file_replaced() {
    let folder = folder();
    std::fs::create_dir(folder.path().join("d")).unwrap();
    write(&folder, "d/a.png", "older");
    std::os::unix::fs::symlink("d/a.png", folder.path().join("l.png")).unwrap();
    rendered(&folder, &["earth", "--size", "16x9", "-o", "l.png"]);
    assert!(folder.path().join("l.png").is_symlink());
    assert_eq!(picture(&folder.path().join("d/a.png")).width, 16);
}

#[test]
fn every_shipped_scene_renders_outside_the_repository() {
    let folder = folder();
    for scene in ["earth", "globe", "pole", "antimeridian", "plane", "ruler"] {
        rendered(&folder, &[scene, "--size", "64x36", "--frames", "1", "-o", &format!("{scene}.png")]);
        let picture = picture(&folder.path().join(format!("{scene}.png")));
        assert_eq!([picture.width, picture.height], [64, 36]);
        assert!(picture.rgba.chunks(4).any(|pixel| pixel[..3] != [0; 3]), "{scene}: black");
    }
}

#[test]
fn a_mesh_is_built_once_and_then_gives_the_same_picture() {
    let folder = folder();
    let render = |picture: &str| {
        let small = "-Dsurface.bunny.geometry.source=sphere:2";
        let mut command = ortelius(&folder, &["render", "bunny", small, "--size", "64x36", "-o", picture]);
        let ran = command.env("ORTELIUS_CACHE", folder.path().join("cache")).output().unwrap();
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
        String::from_utf8(ran.stderr).unwrap()
    };
    assert!(render("built.png").contains("sphere:2: building"));
    assert_eq!(std::fs::read_dir(folder.path().join("cache/meshes")).unwrap().count(), 1);
    assert!(!render("kept.png").contains("building"));
    let [built, kept] =
        ["built.png", "kept.png"].map(|name| std::fs::read(folder.path().join(name)).unwrap());
    assert!(built == kept);
}

#[test]
fn earth_renders_without_validation_messages() {
    let folder = folder();
    let words = rendered(&folder, &["earth", "--size", "160x90", "--validate", "-o", "a.png"]);
    assert_eq!(words.matches("WARN").count() + words.matches("ERROR").count(), 0, "{words}");
}

/// The output of `--explain` as (first word, rest).
fn explained(folder: &TempDir, more: &[&str]) -> Vec<(String, String)> {
    let ran = run(folder, &[&["render", "earth", "--size", "160x90", "--explain"], more].concat());
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let words = String::from_utf8(ran.stdout).unwrap();
    words
        .lines()
        .map(|line| line.split_once(' ').unwrap())
        .map(|(a, b)| (a.into(), b.trim().into()))
        .collect()
}

fn memory_bytes(explained: &[(String, String)], name: &str) -> u64 {
    let line = explained.iter().find(|(word, rest)| word == "memory" && rest.starts_with(name)).unwrap();
    let number = line.1.strip_prefix(name).unwrap().trim_start_matches(": ").strip_suffix(" bytes").unwrap();
    number.parse().unwrap()
}

#[test]
fn explain_lists_features_passes_and_bytes_and_writes_nothing() {
    let folder = folder();
    let said = explained(&folder, &[]);
    assert_eq!(names(&folder), [""; 0]);
    let all = |kind: &'static str| -> Vec<&str> {
        said.iter().filter(|(word, _)| word == kind).map(|(_, rest)| rest.as_str()).collect()
    };
    assert_eq!(
        all("pass"),
        [
            "upload: land",
            "footprint: land",
            "dedup: land; needs geometryShader, logicOp",
            "compact: land; needs geometryShader, transformFeedback (VK_EXT_transform_feedback)",
            "read-back: land",
            "texturing: land"
        ],
        "no more than the scene needs"
    );
    assert!(all("feature").is_empty(), "each belongs to a pass");
    let compute = ["-D", "variant.dedup=test-or", "-D", "variant.compact=append"];
    let needed = explained(&folder, &compute);
    assert!(needed.iter().all(|(_, rest)| !rest.contains("needs")), "compute variants need none: {needed:?}");
    // 192 tiles of 520 x 520 and 260 x 260 texels, 4 bytes each.
    assert_eq!(memory_bytes(&said, "land: tile pool"), 192 * 4 * (520 * 520 + 260 * 260));
    assert_eq!(
        memory_bytes(&said, "land: tile mask"),
        512 * 256 * 8,
        "a cell of 8 bytes for each tile of level 0"
    );
    assert_eq!(memory_bytes(&said, "picture"), 160 * 90 * 4);
    assert_eq!(memory_bytes(&said, "depth"), 160 * 90 * 4);
}

#[test]
fn a_variant_takes_only_the_memory_that_it_needs() {
    let folder = folder();
    let wide = explained(&folder, &["-Dvariant.request_format=rgba32"]);
    let packed = explained(&folder, &["-Dvariant.request_format=packed"]);
    let few = explained(&folder, &["-Dcache.gpu_tiles=96"]);
    assert_eq!(memory_bytes(&wide, "land: request image"), 160 * 90 * 16);
    assert_eq!(memory_bytes(&packed, "land: request image"), 160 * 90 * 4);
    assert_eq!(2 * memory_bytes(&few, "land: tile pool"), memory_bytes(&packed, "land: tile pool"));
    // All except the request image and the total that includes it.
    let but = |said: &[(String, String)]| -> Vec<(String, String)> {
        let other =
            |rest: &str| !rest.starts_with("land: request image") && !rest.ends_with(" of video memory");
        said.iter().filter(|(_, rest)| other(rest)).cloned().collect()
    };
    assert_eq!(but(&wide), but(&packed));
}
