//! Runs the readers in docs/readers, which were written only from the documents, on new files.

use super::*;
use ortelius::paper::progressive_mesh::cache::drawn_faces;
use ortelius::paper::progressive_mesh::mesh::ProgressiveMesh;
use ortelius::paper::progressive_mesh::run::State;
use ortelius::picture::write::write_png;
use std::path::PathBuf;
use xxhash_rust::xxh3::xxh3_64;

/// Output of a reader for a file; `None` only if the user allows a missing Python.
fn read_by(reader: &str, folder: &TempDir, arguments: &[&str]) -> Option<(bool, String)> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let Some(python) = std::env::split_paths(&path).map(|p| p.join("python3")).find(|p| p.is_file()) else {
        let is = |name: &str, value: &str| std::env::var(name).is_ok_and(|found| found == value);
        assert!(
            is("ORTELIUS_ALLOW_NO_PYTHON", "1") && !is("CI", "true"),
            "no python3 in PATH: install it, or do without the formats' second readers with ORTELIUS_ALLOW_NO_PYTHON=1"
        );
        eprintln!("NOT RUN: no python3 here, and ORTELIUS_ALLOW_NO_PYTHON=1");
        return None;
    };
    let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("docs/readers").join(reader);
    // -B: writes no bytecode next to the script.
    let ran =
        Command::new(python).arg("-B").arg(script).args(arguments).current_dir(folder).output().unwrap();
    let said = [ran.stdout, ran.stderr].map(|bytes| String::from_utf8(bytes).unwrap()).concat();
    Some((ran.status.success(), said))
}

#[test]
fn tiles_are_as_documented() {
    let folder = folder();
    let texel = |x: u32, y: u32| [(x * 37 + y * 11) as u8, (x * y) as u8, ((x ^ y) * 3) as u8, 255 - x as u8];
    let (width, height) = (40, 36);
    let rgba: Vec<u8> = (0..width * height).flat_map(|at| texel(at % width, at / width)).collect();
    std::fs::write(folder.path().join("a.rgba"), &rgba).unwrap();
    write_png(&folder.path().join("a.png"), &Srgb8Picture { width, height, rgba }).unwrap();
    // An odd border splits a texel of the coarser picture.
    for (name, more) in [("3", ["--border", "3"]), ("8", ["--border", "8"]), ("bc1", ["--format", "bc1"])] {
        let file = format!("{name}.tiles");
        let bake = ["bake", "a.png", "-o", &file, "--tile", "16"];
        let ran = run(&folder, &[&bake[..], &more].concat());
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
        let Some((read, said)) = read_by("tiles.py", &folder, &[&file, "a.rgba", "40", "36"]) else { return };
        assert!(read, "{said}");
        holds(&said, &["21 tiles", "all as documented"]);
    }
    // Must be rejected: a changed byte of a tile with its old checksum, and another source.
    let mut damaged = std::fs::read(folder.path().join("3.tiles")).unwrap();
    let last = damaged.len() - 4096;
    damaged[last] ^= 1;
    std::fs::write(folder.path().join("damaged.tiles"), damaged).unwrap();
    let (read, said) = read_by("tiles.py", &folder, &["damaged.tiles"]).expect("python3");
    assert!(!read && said.contains("checksum of record"), "{said}");
    let (read, said) = read_by("tiles.py", &folder, &["3.tiles", "a.rgba", "36", "40"]).expect("python3");
    assert!(!read && said.contains("level 0"), "{said}");
}

#[test]
fn meshes_are_as_documented() {
    let folder = folder();
    // Models with normals and seams, and with several attributes; orders with many and with few moves.
    for (model, order, metric) in [
        ("bunny", "tail-23", "geometry"),
        ("solid", "in-place-10", "appearance"),
        ("sphere:4", "classical", "geometry"),
    ] {
        let build = ["mesh", "build", model, "-o", "a.pmesh", "--target-faces", "100", "--order", order];
        let ran = run(&folder, &[&build[..], &["--metric", metric]].concat());
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
        let Some((read, said)) = read_by("pmesh.py", &folder, &["a.pmesh"]) else { return };
        assert!(read, "{model}: {said}");
        let mesh = ProgressiveMesh::read(&folder.path().join("a.pmesh")).unwrap().mesh;
        let lines = said.lines().map(|line| line.split(' ').collect::<Vec<&str>>());
        let (drawn, lines): (Vec<Vec<&str>>, Vec<Vec<&str>>) = lines.partition(|line| line[0] == "drawn");
        let (first, lines) = lines.split_first().unwrap();
        assert_eq!(*first, ["metric", metric]);
        assert_eq!(drawn.len() > 3, order == "in-place-10", "{said}");
        for line in &drawn {
            let level = line[1].parse().unwrap();
            let faces = drawn_faces(&mesh, level);
            let bytes: Vec<u8> = faces.as_flattened().iter().flat_map(|index| index.to_le_bytes()).collect();
            let wanted = [faces.len().to_string(), format!("{:016x}", xxh3_64(&bytes))];
            assert_eq!(&line[2..], wanted, "{model}, level {level}");
        }
        let mut state = State::new(&mesh);
        let (vertices, levels) = lines.split_last().unwrap();
        assert!(levels.len() > 3, "{said}");
        for line in levels {
            let number: usize = line[0].parse().unwrap();
            let level = mesh.levels[number];
            assert_eq!([line[1], line[2]], [&*level.vertices.to_string(), &*level.faces.to_string()]);
            state.go_to(&mesh, number as u32);
            let indices = state.live(&mesh).as_flattened();
            let bytes: Vec<u8> = indices.iter().flat_map(|index| index.to_le_bytes()).collect();
            assert_eq!(line[3], format!("{:016x}", xxh3_64(&bytes)), "{model}, level {number}");
        }
        let mut bytes = Vec::new();
        for vertex in 0..mesh.vertices.positions.len() {
            let attributes = &mesh.vertices.attributes;
            bytes.extend(mesh.vertices.positions[vertex].iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend(attributes.normals.get(vertex).into_iter().flatten().flat_map(|x| x.to_le_bytes()));
            bytes.extend(
                attributes.coordinates.get(vertex).into_iter().flatten().flat_map(|x| x.to_le_bytes()),
            );
            bytes.extend(attributes.colors.get(vertex).into_iter().flatten());
        }
        assert_eq!(vertices[1], format!("{:016x}", xxh3_64(&bytes)), "{model}");
    }
}
