//! `ortelius mesh`: from a model to a file, and back to plain meshes.

use super::*;
use ortelius::model::Model;
use ortelius::paper::progressive_mesh::mesh::ProgressiveMesh;

/// A folder with the bunny as `b.pmesh`.
fn built() -> TempDir {
    let folder = folder();
    let ran = run(&folder, &["mesh", "build", "bunny", "-o", "b.pmesh", "--target-faces", "100"]);
    let words = String::from_utf8(ran.stderr).unwrap();
    assert_eq!(ran.status.code(), Some(0), "{words}");
    holds(&words, &["3674 faces", "closed", "b.pmesh", "levels"]);
    assert_eq!(names(&folder), ["b.pmesh"]);
    folder
}

fn mesh_failure(folder: &TempDir, arguments: &[&str]) -> (i32, String) {
    failure(&mut ortelius(folder, &[&["mesh"], arguments].concat()))
}

/// stdout and stderr of `ortelius mesh ARGUMENTS`, which must succeed.
fn run_mesh(folder: &TempDir, arguments: &[&str]) -> [String; 2] {
    let ran = run(folder, &[&["mesh"], arguments].concat());
    let [out, err] = [ran.stdout, ran.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    assert_eq!(ran.status.code(), Some(0), "{arguments:?}: {err}");
    [out, err]
}

fn info(folder: &TempDir, file: &str) -> serde_json::Value {
    serde_json::from_str(&run_mesh(folder, &["info", file, "--json"])[0]).unwrap()
}

#[test]
fn a_built_mesh_is_described_and_verified() {
    let folder = built();
    let json = info(&folder, "b.pmesh");
    assert_eq!(json["finest"]["faces"], 3674);
    assert_eq!((&json["finest"]["error"], &json["cut"]), (&0.0.into(), &false.into()));
    assert_eq!((&json["pmesh_version"], &json["metric"]), (&3.into(), &"geometry".into()));
    let coarsest = json["coarsest"]["faces"].as_u64().unwrap();
    assert!((90..=100).contains(&coarsest), "{coarsest} faces");
    assert_eq!(json["bytes"], std::fs::metadata(folder.path().join("b.pmesh")).unwrap().len());
    let sizes: f64 =
        json["sizes"].as_array().unwrap().iter().map(|size| size["bytes"].as_f64().unwrap()).sum();
    assert!((sizes - json["bytes"].as_f64().unwrap()).abs() < 1e-6, "not all bytes are reported: {sizes}");
    let [text, _] = run_mesh(&folder, &["info", "b.pmesh"]);
    holds(&text, &["3674 faces, error 0", "metric        geometry", "FIFO of 16", "bytes per split"]);
    holds(&text, &["drawn         1.000 faces", "in batches    1.", "32 vertices and 32 triangles"]);
    let [text, _] = run_mesh(&folder, &["verify", "b.pmesh"]);
    holds(&text, &["b.pmesh: ", "3674 faces, all intact"]);
}

#[test]
fn a_build_reports_its_steps_and_times() {
    let folder = folder();
    run_mesh(&folder, &["build", "sphere:4", "-o", "s.pmesh", "--target-faces", "20", "--report", "r.json"]);
    let report: serde_json::Value = serde_json::from_str(&read(&folder, "r.json")).unwrap();
    assert_eq!((&report["cleaning"]["faces"], &report["simplifying"]["faces"]), (&320.into(), &20.into()));
    assert_eq!(report["file_bytes"], std::fs::metadata(folder.path().join("s.pmesh")).unwrap().len());
    for step in ["load_and_clean", "simplify", "order", "write"] {
        assert!(report["milliseconds"][step].as_f64().is_some_and(|time| time >= 0.0), "{step}: {report}");
    }
    // The program itself needs more than a MiB.
    let max = &report["most_memory_bytes"];
    assert!(max.is_null() || max.as_u64().unwrap() > 1 << 20, "{max}");
    // Checked before the build: nothing is written.
    let (code, line) = mesh_failure(&folder, &["build", "bunny", "-o", "x.pmesh", "--report", "no/r.json"]);
    assert_eq!(code, 1);
    holds(&line, &["no/r.json", "create it first"]);
    assert_eq!(names(&folder), ["r.json", "s.pmesh"]);
}

#[test]
fn an_order_is_chosen_and_reported() {
    let folder = folder();
    let moved = |arguments: &[&str]| {
        run_mesh(
            &folder,
            &[&["build", "sphere:8", "-o", "s.pmesh", "--target-faces", "20"], arguments].concat(),
        );
        let json = info(&folder, "s.pmesh");
        let transforms = &json["transforms_per_vertex"]["mean"];
        (json["moved_faces_per_split"].as_f64().unwrap(), transforms.as_f64().unwrap())
    };
    let [classical, tail, few, groups] = [
        &["--order", "classical"][..],
        &[],
        &["--moves-budget", "8", "--order", "in-place-23"],
        &["--groups", "3", "--cache", "12", "--order", "paper"],
    ]
    .map(moved);
    assert!(classical.0 == 0.0 && classical.1 > 3.5, "{classical:?}");
    assert!((10.0..=23.0).contains(&tail.0) && tail.1 < 1.8, "{tail:?}");
    assert!((2.0..=8.0).contains(&few.0) && few.1 < 2.2, "{few:?}");
    // Each split adds two faces. The permutations of the three groups move 1/3, 2/3 and all of the added faces, on
    // average 4 faces per split, and the faces of the coarsest level.
    assert!((3.0..4.2).contains(&groups.0), "three groups: {groups:?}");
    for order in ["tail-10", "in-place-10"] {
        let few = moved(&["--order", order]);
        assert!((4.0..=10.0).contains(&few.0) && few.1 < 2.2, "{order}: {few:?}");
        let json = info(&folder, "s.pmesh");
        let batched = json["transforms_per_vertex_in_batches"]["mean"].as_f64().unwrap();
        assert!((few.1..2.5).contains(&batched), "{order}: {few:?}, {batched} in batches");
        let drawn = json["drawn_faces_per_live_face"].as_f64().unwrap();
        // The bar of `in-place-10` is 12 % on larger meshes; births at the tail draw live faces only.
        let more = if order == "tail-10" { 0.0..=0.0 } else { 0.02..=0.13 };
        assert!(more.contains(&(drawn - 1.0)), "{order}: {drawn}");
    }
    // There is at most one group for each split, however many are requested.
    for many in ["4000000000", "0.000001%"] {
        let all = moved(&["--groups", many]);
        assert!(all.1 < tail.1, "{many} groups: {all:?}");
    }
    let smallest = moved(&["--order", "in-place-10", "--cache", "4"]);
    assert!(
        (4.0..=10.0).contains(&smallest.0) && smallest.1 < 3.0,
        "4 entries, 2 of them spare: {smallest:?}"
    );
    for cache in ["batches", "meshlets"] {
        let far_from_16 = moved(&["--order", "in-place-23", "--cache", cache]);
        assert!((10.0..=23.0).contains(&far_from_16.0) && far_from_16.1 < 2.2, "{cache}: {far_from_16:?}");
    }
    for wrong in [["--groups", "0"], ["--cache", "3"], ["--moves-budget", "-1"], ["--order", "best"]] {
        let ran = run(&folder, &[&["mesh", "build", "bunny", "-o", "x.pmesh"][..], &wrong].concat());
        assert_eq!(ran.status.code(), Some(2), "{wrong:?}");
    }
    assert_eq!(names(&folder), ["s.pmesh"]);
}

#[test]
fn a_level_is_exported_by_number_by_error_and_by_faces() {
    let folder = built();
    let mesh = ProgressiveMesh::read(&folder.path().join("b.pmesh")).unwrap().mesh;
    let faces = |file: &str| Model::load(&folder.path().join(file)).unwrap().0.faces.len() as u32;
    run_mesh(&folder, &["export", "b.pmesh", "--level", "0", "-o", "base.obj"]);
    assert_eq!(faces("base.obj"), mesh.levels[0].faces);
    run_mesh(&folder, &["export", "b.pmesh", "--faces", "1000", "-o", "some.ply"]);
    assert!(faces("some.ply").abs_diff(1000) <= 1);
    run_mesh(&folder, &["export", "b.pmesh", "--error", "0", "-o", "full.obj"]);
    assert_eq!(faces("full.obj"), 3674);
    let (full, _) = Model::load(&folder.path().join("full.obj")).unwrap();
    assert_eq!(full.positions.len(), 1839, "welded");
    full.check().unwrap();
    let [_, words] = run_mesh(&folder, &["export", "b.pmesh", "--error", "1e9", "-o", "coarse.ply"]);
    holds(&words, &["coarse.ply: level 0 of "]);
}

#[test]
fn a_truncated_file_is_a_coarser_mesh_and_fails_verification() {
    let folder = built();
    let bytes = std::fs::read(folder.path().join("b.pmesh")).unwrap();
    std::fs::write(folder.path().join("cut.pmesh"), &bytes[..bytes.len() / 2]).unwrap();
    let [_, words] = run_mesh(&folder, &["info", "cut.pmesh"]);
    holds(&words, &["WARN", "cut.pmesh: the end is missing: ", " of 3674 faces are present"]);
    let json = info(&folder, "cut.pmesh");
    let (levels, faces) = (json["levels"].as_u64().unwrap(), json["finest"]["faces"].as_u64().unwrap());
    assert!((200..3600).contains(&faces) && json["cut"] == true, "{levels} levels, {faces} faces");
    // An incomplete chunk counts for nothing, however long it is.
    std::fs::write(folder.path().join("late.pmesh"), &bytes[..bytes.len() - 1]).unwrap();
    let [late, whole] = ["late.pmesh", "b.pmesh"].map(|file| {
        let json = info(&folder, file);
        let sizes = json["sizes"].as_array().unwrap();
        let headers = sizes.iter().find(|size| size["content"] == "headers of file and chunks").unwrap();
        headers["bytes"].as_f64().unwrap()
    });
    assert!(late < whole, "{late} of {whole} bytes");
    // The same level as in the whole file, face for face.
    let level = (levels - 1).to_string();
    run_mesh(&folder, &["export", "cut.pmesh", "--level", &level, "-o", "cut.ply"]);
    run_mesh(&folder, &["export", "b.pmesh", "--level", &level, "-o", "whole.ply"]);
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(read("cut.ply") == read("whole.ply"));
    let (code, line) = mesh_failure(&folder, &["verify", "cut.pmesh"]);
    assert_eq!(code, 3);
    holds(&line, &["cut.pmesh", "chunks", "of 3674 faces are present"]);
    // Before the end of the first chunk there is no mesh. The message states how many bytes are needed, as
    // far as that is known.
    let base = 72 + 28 + u32::from_le_bytes(bytes[72..76].try_into().unwrap()) as usize;
    for (length, needs) in [(3, 100), (60, 100), (80, 100), (100, base), (base - 1, base)] {
        std::fs::write(folder.path().join("stub.pmesh"), &bytes[..length]).unwrap();
        let (code, line) = mesh_failure(&folder, &["info", "stub.pmesh"]);
        assert_eq!(code, 3);
        let words =
            format!("cut off before its coarsest level is complete: {length} bytes of at least {needs}");
        holds(&line, &["stub.pmesh: ", &words]);
    }
    std::fs::write(folder.path().join("stub.pmesh"), &bytes[..base]).unwrap();
    holds(&run_mesh(&folder, &["info", "stub.pmesh"])[1], &["1 of ", " levels"]);
}

#[test]
fn a_truncated_file_in_a_scene_is_warned_of_and_reported() {
    let folder = built();
    let bytes = std::fs::read(folder.path().join("b.pmesh")).unwrap();
    let scene = "[view]\nwidth = 32\nheight = 18\ncamera = \"a\"\n[cameras.a]\naltitude_m = 1.0\neast_m = 0.0\n\
                 north_m = -2.0\ntilt_deg = 90.0\n[surface.b.geometry]\nkind = \"progressive-mesh\"\nsource = \"b.pmesh\"\nsize_m = 1.0\n";
    write(&folder, "s.toml", scene);
    let shown = |length: usize| {
        std::fs::write(folder.path().join("b.pmesh"), &bytes[..length]).unwrap();
        let words = rendered(&folder, &["s.toml", "--report", "r.json"]);
        let report: serde_json::Value = serde_json::from_str(&read(&folder, "r.json")).unwrap();
        (words, report["surfaces"]["b"].clone())
    };
    let (words, surface) = shown(bytes.len() / 2);
    holds(&words, &["WARN", "surface.b.geometry.source: ", "b.pmesh: the end is missing: ", " levels"]);
    assert_eq!(surface["cut_from"]["faces"], 3674);
    assert!(surface["faces"].as_u64().unwrap() < 3674, "{surface}");
    let (words, surface) = shown(bytes.len());
    assert!(!words.contains("missing") && surface["cut_from"].is_null(), "{words}{surface}");
}

#[test]
fn damage_is_reported_with_its_chunk() {
    let folder = built();
    let path = folder.path().join("b.pmesh");
    let mut bytes = std::fs::read(&path).unwrap();
    let at = bytes.len() - 5;
    bytes[at] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    for command in ["verify", "info"] {
        let (code, line) = mesh_failure(&folder, &[command, "b.pmesh"]);
        assert_eq!(code, 3);
        holds(&line, &["b.pmesh: damaged in chunk ", "its checksum differs"]);
    }
}

#[test]
fn invalid_commands_are_reported_in_one_line() {
    let folder = built();
    write(&folder, "text.pmesh", "a text, and no mesh");
    let cases: [(&[&str], i32, &[&str]); 22] = [
        (&["info", "none.pmesh"], 1, &["none.pmesh", "cannot read"]),
        (&["info", "."], 1, &["not a regular file"]),
        (&["info", "text.pmesh"], 3, &["text.pmesh: not a .pmesh file"]),
        (&["export", "b.pmesh", "--level", "99999", "-o", "x.ply"], 2, &["--level 99999", "levels 0 to "]),
        (&["export", "b.pmesh", "--error", "-1", "-o", "x.ply"], 2, &["--error -1: it must be 0 or more"]),
        (&["export", "b.pmesh", "--error", "NaN", "-o", "x.ply"], 2, &["--error NaN"]),
        (&["export", "b.pmesh", "--faces", "9", "-o", "x.stl"], 2, &["x.stl: export writes .ply and .obj"]),
        (&["export", "b.pmesh", "--faces", "9", "-o", "no/x.ply"], 1, &["no/x.ply", "create it first"]),
        (&["build", "text.pmesh", "-o", "x.pmesh"], 1, &["text.pmesh"]),
        (
            &["export", "b.pmesh", "--faces", "9", "-o", "b.pmesh/x.ply"],
            1,
            &["b.pmesh is a file, not a folder"],
        ),
        // Rejected before a build of minutes: the model is not even read.
        (&["build", "none.ply", "-o", "x.txt"], 2, &["-o x.txt: the name must end in .pmesh"]),
        (&["build", "none.ply", "-o", "no/x.pmesh"], 1, &["no/x.pmesh", "create it first"]),
        (
            &["build", "none.ply", "-o", "/proc/x.pmesh"],
            1,
            &["/proc/x.pmesh", "cannot write a file in /proc"],
        ),
        (
            &["build", "bunny", "-o", "x.pmesh", "--order", "classical", "--moves-budget", "10"],
            2,
            &["--moves-budget has no effect with --order classical"],
        ),
        (
            &["build", "bunny", "-o", "x.pmesh", "--order", "classical", "--cache", "16"],
            2,
            &["--cache has no effect with --order classical"],
        ),
        (
            &["build", "bunny", "-o", "x.pmesh", "--order", "tail-23", "--cache", "h100"],
            2,
            &["--cache h100: --order tail-23 is optimised for a FIFO only", "in-place-23"],
        ),
        (
            &["build", "bunny", "-o", "x.pmesh", "--order", "classical", "--groups", "9"],
            2,
            &["--groups has no effect with --order classical"],
        ),
        (
            &["build", "solid", "-o", "x.pmesh", "--groups", "1000000000"],
            2,
            &["--groups: up to 1.3e8 faces would change their slots", "the limit is 1e8"],
        ),
        (&["build", "sphere:99999", "-o", "x.pmesh"], 1, &["sphere has no size \"99999\"", "from 1 to 512"]),
        (&["build", "grid:0", "-o", "x.pmesh"], 1, &["grid has no size \"0\"", "from 2 to 2048"]),
        (
            &["build", "bunny.stl", "-o", "x.pmesh"],
            1,
            &["bunny.stl: the file name extension is not that of a model"],
        ),
        (&["build", "bunny.ply", "-o", "x.pmesh"], 1, &["bunny.ply: cannot be read"]),
    ];
    for (arguments, expected, words) in cases {
        let (code, line) = mesh_failure(&folder, arguments);
        assert_eq!(code, expected, "{arguments:?}: {line}");
        holds(&line, words);
    }
    assert_eq!(names(&folder), ["b.pmesh", "text.pmesh"], "nothing was written");
}

#[test]
fn an_input_file_is_never_overwritten() {
    let folder = built();
    run_mesh(&folder, &["export", "b.pmesh", "--level", "9", "-o", "m.ply"]);
    std::fs::copy(folder.path().join("b.pmesh"), folder.path().join("p.ply")).unwrap();
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    let [model, mesh] = ["m.ply", "p.ply"].map(bytes);
    let cases: [&[&str]; 2] = [
        &["build", "m.ply", "-o", "x.pmesh", "--report", "./m.ply"],
        &["export", "p.ply", "--level", "9", "-o", "p.ply"],
    ];
    for arguments in cases {
        let (code, line) = mesh_failure(&folder, arguments);
        assert_eq!(code, 2, "{arguments:?}: {line}");
        holds(&line, &["this is the input file; choose another name"]);
    }
    assert!(bytes("m.ply") == model && bytes("p.ply") == mesh);
    assert_eq!(names(&folder), ["b.pmesh", "m.ply", "p.ply"]);
}

#[test]
fn a_level_without_faces_is_rejected() {
    let folder = built();
    let ran = run(&folder, &["mesh", "export", "b.pmesh", "--faces", "0", "-o", "x.ply"]);
    assert_eq!(ran.status.code(), Some(2));
    holds(&String::from_utf8(ran.stderr).unwrap(), &["--faces", "0 is not in 1"]);
    assert_eq!(names(&folder), ["b.pmesh"]);
}
