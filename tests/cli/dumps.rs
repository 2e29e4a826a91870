//! `--dump-visible` and `--dump-footprint`.

use super::*;
use ortelius::math::pyramid::{Pyramid, TileId};
use ortelius::paper::virtual_texture::reference::{PixelDerivatives, triple};
use ortelius::picture::write::{Planes, read_exr};
use std::collections::BTreeSet;

/// The texture of the shipped scenes.
fn pyramid() -> Pyramid {
    Pyramid::new(18, 17, 9, 4, None).unwrap()
}

/// (frame, tile) of each line; checks the header.
fn visible(folder: &TempDir, name: &str) -> Vec<(u32, TileId)> {
    let text = read(folder, name);
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("frame,q,i,j"));
    let number = |field: &str| field.parse().unwrap_or_else(|_| panic!("{field:?} is not a number"));
    lines
        .map(|line| match line.split(',').map(number).collect::<Vec<u32>>()[..] {
            [frame, level, row, column] => (frame, TileId { level, row, column }),
            _ => panic!("{line}: not four numbers"),
        })
        .collect()
}

#[test]
fn visible_tiles_are_sorted_within_their_levels_grid_and_only_of_the_settled_frame() {
    let folder = folder();
    rendered(&folder, &["plane", "--size", "160x90", "--settle", "--dump-visible", "a.csv"]);
    let tiles = visible(&folder, "a.csv");
    assert!(tiles.is_sorted_by(|a, b| a < b), "sorted, none twice");
    assert!(tiles.iter().all(|(frame, _)| *frame == tiles[0].0), "one frame");
    for (_, tile) in &tiles {
        assert!(pyramid().contains(*tile), "{tile:?} is outside its level's grid");
    }
    let levels: BTreeSet<u32> = tiles.iter().map(|(_, tile)| tile.level).collect();
    assert!(levels.len() > 3, "a plane to its horizon shows many levels: {levels:?}");
    // The same after a sequence.
    let more = ["--frames", "3", "--settle", "--dump-visible", "b.csv", "--report", "b.json"];
    rendered(&folder, &[&["plane", "--size", "160x90"], &more[..]].concat());
    let after = visible(&folder, "b.csv");
    let report: serde_json::Value = serde_json::from_str(&read(&folder, "b.json")).unwrap();
    assert_eq!(report["frames"].as_array().unwrap().len() as u32 - 1, after[0].0, "the last frame's");
    let of = |list: &[(u32, TileId)]| list.iter().map(|(_, tile)| *tile).collect::<Vec<_>>();
    assert_eq!(of(&after), of(&tiles));
}

#[test]
fn a_sequence_lists_each_of_its_frames() {
    let folder = folder();
    let sequence = ["--path", "pan", "-Dpaths.pan.frames=4", "--frames", "4", "--dump-visible", "a.csv"];
    rendered(&folder, &[&["plane", "--size", "160x90"], &sequence[..]].concat());
    let tiles = visible(&folder, "a.csv");
    assert!(tiles.is_sorted_by(|a, b| a < b));
    let of = |frame| tiles.iter().filter(|(n, _)| *n == frame).map(|(_, tile)| *tile).collect::<Vec<_>>();
    assert_eq!(tiles.iter().map(|(frame, _)| *frame).collect::<BTreeSet<_>>(), BTreeSet::from([0, 1, 2, 3]));
    assert!(of(0) != of(3), "the pan moves");
}

/// A shipped scene's footprints and visible tiles, with one sample per pixel.
fn dumped(scene: &[&str]) -> (Planes, BTreeSet<TileId>) {
    let folder = folder();
    let more = ["--size", "160x90", "--dump-footprint", "a.exr", "--dump-visible", "a.csv"];
    let (name, changes) = scene.split_at(1);
    rendered(&folder, &[name, &["-Dsurface.land.filter={max_anisotropy=1}"], changes, &more].concat());
    let planes = read_exr(&folder.path().join("a.exr")).unwrap();
    assert_eq!([planes.width, planes.height], [160, 90]);
    (planes, visible(&folder, "a.csv").into_iter().map(|(_, tile)| tile).collect())
}

/// Checks every pixel of a dump against the paper's formula in f64 and returns the number that differ; each
/// difference must be so near a boundary between two levels or sample counts that f32 may round to either side.
fn disagreements(planes: &Planes, max_anisotropy: u32) -> usize {
    let pyramid = pyramid();
    let g1 = pyramid.first_resident_level();
    let at = |channel: &str, pixel: usize| f64::from(planes.channels[channel][pixel]);
    let mut near = 0;
    for pixel in 0..160 * 90 {
        let [s, t, q, i, j] = ["s", "t", "q", "i", "j"].map(|channel| at(channel, pixel));
        if q == -1.0 {
            assert!(s.is_nan() && t.is_nan() && [i, j] == [-1.0; 2], "pixel {pixel}: background");
            continue;
        }
        assert!((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t), "pixel {pixel}: {s}, {t}");
        let [dsdx, dtdx, dsdy, dtdy] = ["dsdx", "dtdx", "dsdy", "dtdy"].map(|channel| at(channel, pixel));
        let wanted = |larger: [f64; 2]| {
            let [x, y] = larger;
            let footprint =
                PixelDerivatives { s, t, dsdx: x * dsdx, dtdx: x * dtdx, dsdy: y * dsdy, dtdy: y * dtdy };
            triple(&footprint, &pyramid, max_anisotropy)
        };
        let exact = wanted([1.0; 2]);
        // nA and q depend on sums of two f32 squares, a quotient and a root: 8 roundings of 2^-24 are below 1e-6.
        let around = [0.999_999, 1.000_001]
            .map(|x| [0.999_999, 1.000_001].map(|y| f64::from(wanted([x, y]).q)))
            .concat();
        if q != f64::from(exact.q) {
            near += 1;
            assert!(around.contains(&q), "pixel {pixel}: q {q}, in f64 {exact:?}");
        }
        // s and t times a power of two are exact, so rows and columns need no tolerance.
        let own_level = match q < f64::from(g1) {
            true => [f64::from(exact.i >> q as u32), f64::from(exact.j >> q as u32)],
            false => [-1.0; 2],
        };
        assert_eq!([i, j], own_level, "pixel {pixel}: q {q}, {exact:?}");
    }
    near
}

#[test]
fn footprints_follow_the_papers_formula_and_list_the_visible_tiles() {
    let cases = [
        (&["plane"][..], 1),
        (&["plane", "-Dsurface.land.filter.max_anisotropy=4"], 4),
        // The paper's filter. The border holds all its samples, so no pixel needs a neighbouring tile.
        (&["plane", "-Dsurface.land.filter={}", "-Dsurface.land.texture.border=16"], 16),
        (&["earth", "--camera", "oblique", "-Dvariant.request_format=packed"], 1),
        (&["globe"], 1),
    ];
    for (scene, max_anisotropy) in cases {
        let (planes, visible) = dumped(scene);
        let names: Vec<&str> = planes.channels.keys().map(String::as_str).collect();
        assert_eq!(names, ["dsdx", "dsdy", "dtdx", "dtdy", "i", "j", "q", "s", "t"]);
        let near = disagreements(&planes, max_anisotropy);
        println!("{scene:?}: {near} of 14400 pixels near a decision");
        // A pixel lies within 1e-6 of a level's boundary so rarely that one of 14400 is possible, and 3 are
        // an error.
        assert!(near < 3, "{near} pixels near a decision");
        let first_resident = pyramid().first_resident_level() as f32;
        let [q, i, j] = ["q", "i", "j"].map(|channel| &planes.channels[channel]);
        let seen: BTreeSet<TileId> = (0..q.len())
            .filter(|&n| q[n] >= 0.0 && q[n] < first_resident)
            .map(|n| TileId { level: q[n] as u32, row: i[n] as u32, column: j[n] as u32 })
            .collect();
        assert_eq!(seen, visible, "{scene:?}");
    }
}

#[test]
#[should_panic(expected = "in f64")]
fn a_wrong_level_is_found() {
    let (mut planes, _) = dumped(&["plane"]);
    let q = planes.channels.get_mut("q").unwrap();
    let pixel = q.iter().position(|q| *q >= 1.0).unwrap();
    q[pixel] -= 1.0;
    disagreements(&planes, 1);
}

#[test]
#[should_panic(expected = "left")]
fn a_neighbouring_row_is_found() {
    let (mut planes, _) = dumped(&["plane"]);
    let pixel = planes.channels["i"].iter().position(|i| *i >= 0.0).unwrap();
    planes.channels.get_mut("i").unwrap()[pixel] += 1.0;
    disagreements(&planes, 1);
}
