//! Rendering from `.tiles` files: whole, damaged, compressed.

use super::*;
use ortelius::math::pyramid::TileId;
use ortelius::texture::source::TileSource;
use ortelius::texture::tiles::TileFile;
use std::os::unix::fs::FileExt;

/// A folder with the small scene over a baked file: `s.toml` and `t.tiles`.
fn baked(format: &str) -> TempDir {
    let folder = folder();
    bake(&folder, "t.tiles", format);
    write(&folder, "s.toml", &small_scene("source = \"file\"\npath = \"t.tiles\""));
    write(&folder, "pure.toml", &small_scene(SYNTHETIC));
    folder
}

/// Flips one bit of a file.
fn damage(folder: &TempDir, offset: u64) {
    let path = folder.path().join("t.tiles");
    let file = std::fs::File::options().read(true).write(true).open(path).unwrap();
    let mut byte = [0];
    file.read_exact_at(&mut byte, offset).unwrap();
    file.write_all_at(&[byte[0] ^ 1], offset).unwrap();
}

fn open(folder: &TempDir) -> TileFile {
    TileFile::open(&folder.path().join("t.tiles")).unwrap()
}

fn report(folder: &TempDir, name: &str) -> serde_json::Value {
    serde_json::from_str(&read(folder, name)).unwrap()
}

#[test]
fn a_baked_file_gives_the_picture_of_its_source() {
    let folder = baked("rgba8");
    rendered(&folder, &["s.toml", "-o", "file.png", "--dump-visible", "file.csv"]);
    rendered(&folder, &["pure.toml", "-o", "pure.png", "--dump-visible", "pure.csv"]);
    // Without the frame number: the frame at which a picture settles depends on the machine.
    let tiles =
        |name| read(&folder, name).lines().map(|line| line.split_once(',').unwrap().1.to_string()).collect();
    let [file, pure]: [Vec<String>; 2] = ["file.csv", "pure.csv"].map(tiles);
    assert!(file.len() > 5, "{file:?}");
    assert_eq!(file, pure);
    let [file, pure] = ["file.png", "pure.png"].map(|name| picture(&folder.path().join(name)));
    assert!(file == pure);
    // The comparison detects differences: another camera gives another picture.
    rendered(&folder, &["s.toml", "-o", "other.png", "--camera", "elsewhere"]);
    assert!(picture(&folder.path().join("other.png")) != pure);
}

#[test]
fn paths_in_a_scene_are_relative_to_the_scene() {
    let folder = folder();
    std::fs::create_dir_all(folder.path().join("deep/er")).unwrap();
    bake(&folder, "deep/er/t.tiles", "rgba8");
    write(&folder, "deep/s.toml", &small_scene("source = \"file\"\npath = \"er/t.tiles\""));
    rendered(&folder, &["deep/s.toml", "-o", "a.png"]);
    assert_eq!(names(&folder), ["a.png", "deep"]);
}

#[test]
fn a_damaged_tile_is_warned_of_once_and_counted_and_rendering_continues() {
    let folder = baked("rgba8");
    rendered(&folder, &["s.toml", "-o", "whole.png", "--dump-visible", "a.csv"]);
    let numbers = |line: &str| -> Vec<u32> { line.split(',').map(|n| n.parse().unwrap()).collect() };
    let visible: Vec<Vec<u32>> = read(&folder, "a.csv").lines().skip(1).map(numbers).collect();
    let tile = visible.iter().find(|tile| tile[1] == 1).expect("a tile of level 1 is visible");
    let tile = TileId { level: tile[1], row: tile[2], column: tile[3] };
    let layout = *open(&folder).layout();
    damage(&folder, layout.record_offset(layout.pyramid().tile_index(tile)) + 1000);
    let words = rendered(&folder, &["s.toml", "-o", "hurt.png", "--report", "a.json"]);
    assert_eq!(words.matches("WARN").count(), 1, "{words}");
    let warning = words.lines().find(|line| line.contains("WARN")).unwrap();
    holds(warning, &["t.tiles", "checksum", "ortelius verify"]);
    let report = report(&folder, "a.json");
    assert_eq!(report["unreadable_tiles"], 1);
    assert_eq!(report["settled"], true);
    // The coarser level replaces it: the picture differs, but has no hole.
    let [whole, hurt] = ["whole.png", "hurt.png"].map(|name| picture(&folder.path().join(name)));
    assert!(whole != hurt);
    let black = |picture: &Srgb8Picture| picture.rgba.chunks(4).filter(|p| p[..3] == [0; 3]).count();
    assert_eq!(black(&whole), black(&hurt));
}

#[test]
fn a_damaged_resident_level_is_exit_3() {
    let folder = baked("rgba8");
    let file = open(&folder);
    damage(&folder, file.layout().resident_offset(file.pyramid().first_resident_level()));
    let (code, line) = render_failure(&folder, &["s.toml", "-o", "a.png"]);
    assert_eq!(code, 3, "{line}");
    holds(&line, &["t.tiles", "checksum", "damaged"]);
    assert!(!names(&folder).contains(&"a.png".to_string()));
}

#[test]
fn a_warning_names_each_key_that_the_file_overrides() {
    let folder = baked("rgba8");
    let own = open(&folder).pyramid().border_texels();
    for (border, warned) in [(own, false), (own + 1, true)] {
        let change = format!("-Dsurface.land.texture.border={border}");
        let ran = run(&folder, &["render", "s.toml", "--size", "48x27", &change, "-o", "a.png"]);
        let words = String::from_utf8(ran.stderr).unwrap();
        let warning = format!("surface.land.texture.border={border}: {border} is not used, because ");
        assert_eq!((ran.status.code(), words.contains(&warning)), (Some(0), warned), "{words}");
    }
}

#[test]
fn a_truncated_file_is_exit_3_and_one_of_another_size_is_rejected() {
    let folder = baked("rgba8");
    write(
        &folder,
        "stated.toml",
        &small_scene("source = \"file\"\npath = \"t.tiles\"\nwidth_log2 = 12\nheight_log2 = 11"),
    );
    let (code, line) = render_failure(&folder, &["stated.toml", "-o", "a.png"]);
    assert_eq!(code, 1, "{line}");
    holds(
        &line,
        &[
            "stated.toml:7:14: surface.land.texture.width_log2",
            "t.tiles has 2^11 x 2^10",
            "correct the scene",
        ],
    );
    let path = folder.path().join("t.tiles");
    let file = std::fs::File::options().write(true).open(&path).unwrap();
    file.set_len(file.metadata().unwrap().len() - 1).unwrap();
    let (code, line) = render_failure(&folder, &["s.toml", "-o", "a.png"]);
    assert_eq!(code, 3, "{line}");
    holds(&line, &["t.tiles", "truncated"]);
}

/// Largest and root mean square difference of two pictures' colours, in codes.
fn difference(a: &Srgb8Picture, b: &Srgb8Picture) -> (u8, f64) {
    let colours = |picture: &Srgb8Picture| -> Vec<u8> {
        picture.rgba.chunks(4).flat_map(|pixel| pixel[..3].to_vec()).collect()
    };
    let (a, b) = (colours(a), colours(b));
    let differences: Vec<u8> = a.iter().zip(&b).map(|(a, b)| a.abs_diff(*b)).collect();
    let sum: f64 = differences.iter().map(|d| f64::from(*d).powi(2)).sum();
    (*differences.iter().max().unwrap(), (sum / differences.len() as f64).sqrt())
}

#[test]
fn bc1_tiles_give_nearly_the_same_picture_and_request_the_feature() {
    let folder = baked("bc1");
    let words = rendered(&folder, &["s.toml", "-o", "bc1.png", "--validate"]);
    assert_eq!(words.matches("WARN").count() + words.matches("ERROR").count(), 0, "{words}");
    rendered(&folder, &["pure.toml", "-o", "pure.png"]);
    rendered(&folder, &["s.toml", "-o", "other.png", "--camera", "elsewhere"]);
    let [bc1, pure, other] =
        ["bc1.png", "pure.png", "other.png"].map(|name| picture(&folder.path().join(name)));
    let (worst, rms) = difference(&bc1, &pure);
    println!("BC1: worst {worst}, root mean square {rms:.3} codes");
    // Tiles encoded while reading equal those of the file.
    rendered(&folder, &["pure.toml", "-D", "surface.land.texture.format=bc1", "-o", "on-the-fly.png"]);
    assert_eq!(difference(&bc1, &picture(&folder.path().join("on-the-fly.png"))), (0, 0.0));
    // The encoder's own error is 1.9 to 3.8 codes on texels of 2.5 to 5 km. Here a texel is 20 km, with more
    // contrast in a block (4.6 measured). The colours of a coast are not on BC1's line of four
    // colours, so single pixels err by a quarter of the range.
    assert!(worst <= 80 && rms < 6.0, "worst {worst}, root mean square {rms}");
    let (worst, rms) = difference(&other, &pure);
    assert!(worst > 80 && rms > 6.0, "another picture must differ: {worst}, {rms}");
    let explained = |scene: &str| {
        let ran = run(&folder, &["render", scene, "--explain"]);
        String::from_utf8(ran.stdout).unwrap()
    };
    holds(&explained("s.toml"), &["pass       texturing: land; needs textureCompressionBC"]);
    assert!(!explained("pure.toml").contains("textureCompressionBC"), "only what the scene requires");
}

#[test]
fn comparing_bc1_tiles_with_a_plain_texture_is_rejected_at_once() {
    let folder = baked("bc1");
    let (code, line) = render_failure(&folder, &["s.toml", "-o", "a.png", "--compare-plain"]);
    assert_eq!(code, 2, "{line}");
    holds(&line, &["--compare-plain", "bc1", "t.tiles", "--format rgba8"]);
}
