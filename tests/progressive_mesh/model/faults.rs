//! An error in a file is reported in one line, with its position and cause.

use super::glb::{cube_glb, glb};
use super::*;

fn refused(name: &str, bytes: impl AsRef<[u8]>) -> String {
    let error = Model::from_bytes(Path::new(name), bytes.as_ref()).unwrap_err().to_string();
    assert!(error.starts_with(name) && error.lines().count() == 1, "{error}");
    error
}

#[test]
fn errors_of_text_name_the_line() {
    for (change, to, words) in [
        ("v 1 1 0\n", "v 1 one 0\n", "a.obj:4: \"one\" is not a number"),
        ("v 1 1 0\n", "v 1 1\n", "a.obj:4: v needs three numbers"),
        ("f 5/1/2", "f 9/1/2", "a.obj:21: index 9, but there are only 8 so far"),
        ("f 5/1/2", "f 0/1/2", "a.obj:21: index 0, but the first index is 1"),
        ("f 5/1/2", "f -9/1/2", "a.obj:21: index -9, but there are only 8 so far"),
        ("f 5/1/2 6/2/2 7/3/2 8/4/2", "f 5 6", "a.obj:21: a face of 2 corners"),
        ("f 5/1/2", "f five", "a.obj:21: \"five\" is not an index"),
    ] {
        assert!(CUBE.contains(change));
        assert_eq!(refused("a.obj", CUBE.replace(change, to)), words);
    }
    assert_eq!(refused("a.obj", "v 1 2 3\n"), "a.obj: it has no faces");
    let flat = refused("a.obj", "v 0 0 0\nv 0 0 0\nv 1 0 0\nf 1 2 3\nf 1 1 3");
    assert_eq!(
        flat,
        "a.obj: cleaning removed all faces: faces that use a vertex twice, dropped: 1; \
         faces with two corners at one position, dropped: 1; vertices in no face, dropped: 3"
    );
}

#[test]
fn errors_of_ply_name_the_line_or_the_byte() {
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                  element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let good = format!("{header}0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    assert_eq!(read("a.ply", &good).faces.len(), 1);
    for (change, to, words) in [
        ("ply\n", "plx\n", "a.ply:1: does not begin with \"ply\""),
        ("end_header", "end", "a.ply:9: not a line of a PLY header: \"end\""),
        ("float x", "half x", "a.ply:4: not a property of an element: \"property half x\""),
        (
            "vertex 3",
            "vertex 4000000000",
            "a.ply:10: 4000000000 of \"vertex\" declared, but the file has room for at most 4",
        ),
        ("vertex 3", "vertex -3", "a.ply:3: not a number of elements: \"element vertex -3\""),
        ("1 0 0", "1 zero 0", "a.ply:11: \"zero\" is not a number"),
        ("3 0 1 2", "3 0 1", "a.ply:14: ends before the last value"),
        ("3 0 1 2", "3 0 1 3", "a.ply: triangle 0 refers to vertex 3, but there are only 3"),
        ("3 0 1 2", "3 0 1 1.5", "a.ply:13: 1.5 is not a vertex index"),
        ("3 0 1 2", "250 0 1 2", "a.ply:13: a list of 250 values, but the file has room for at most 4"),
        ("float y", "float x", "a.ply:5: duplicate \"property float x\""),
        ("float y", "float yy", "a.ply: the vertices lack x, y or z"),
        ("vertex_indices", "corners", "a.ply: faces have no list \"vertex_indices\""),
        (
            "element face",
            "element facet",
            "a.ply: no element \"face\" or \"tristrips\": a point cloud has no faces",
        ),
        ("element face", "element vertex", "a.ply:7: duplicate \"element vertex 1\""),
    ] {
        assert!(good.contains(change));
        assert_eq!(refused("a.ply", good.replace(change, to)), words);
    }
    let binary = written(&cube(), MeshFormat::Ply);
    let cut = refused("a.ply", &binary[..binary.len() - 2]);
    assert_eq!(cut, "a.ply: byte 1365: a list of 3 values, but the file has room for at most 2");
}

#[test]
fn errors_of_glb_name_the_object() {
    let good = cube_glb(r#"{"mesh":0}"#);
    let text = String::from_utf8_lossy(&good[20..]).into_owned();
    let json = &text[..text.find('\0').unwrap().min(text.rfind('}').unwrap() + 1)];
    let json = &json[..json.rfind("}]}").unwrap() + 3];
    let bin = &good[good.len() - 776..];
    assert_eq!(read("a.glb", glb(json, bin)), read("a.glb", &good));
    for (change, to, words) in [
        ("\"count\":6", "\"count\":7", "mesh 0, primitive 0: accessor 18: 7 rows exceed buffer view 1"),
        (
            "\"byteLength\":6}",
            "\"byteLength\":9}",
            "accessor 18: buffer view 1 exceeds the binary chunk of 776 bytes",
        ),
        ("\"indices\":18", "\"indices\":19", "mesh 0, primitive 0: accessor 19: it does not exist"),
        (
            "5121",
            "5120,\"sparse\":{}",
            "accessor 18: sparse accessors are not supported; save the file without them",
        ),
        (
            "{\"byteLength\":774}",
            "{\"uri\":\"a.bin\"}",
            "its data are in another file; save everything as one .glb",
        ),
        ("\"POSITION\"", "\"PLACE\"", "mesh 0, primitive 0: it has no POSITION"),
        ("\"scene\":0", "\"scene\":1", "there is no scene 1"),
        ("{\"mesh\":0}", "{\"mesh\":1}", "there is no mesh 1"),
        (
            "{\"mesh\":0}",
            "{\"mesh\":0,\"children\":[0]}",
            "node 0 appears twice in the scene, or is its own ancestor",
        ),
        (
            "\"scene\":0",
            "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]",
            "KHR_draco_mesh_compression",
        ),
        ("\"scene\":0", "\"scene\":-1", "invalid JSON: invalid value"),
    ] {
        assert!(json.contains(change), "{change}");
        let error = refused("a.glb", glb(&json.replace(change, to), bin));
        assert!(error.contains(words), "{error}");
    }
    for (cut, words) in [
        (3, "a.glb: byte 0: does not begin with \"glTF\""),
        (14, "a.glb: byte 12: ends before the chunk"),
        (100, "exceeds the file"),
        (good.len() - 1, "exceeds the file"),
    ] {
        let error = refused("a.glb", &good[..cut]);
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn a_file_that_is_not_a_model_is_reported_by_name() {
    let unknown = refused("a.stl", "solid");
    assert_eq!(
        unknown,
        "a.stl: the file name extension is not that of a model; known: .ply, .obj and .glb, each optionally followed by .gz"
    );
    let error = Model::open("rabbit").unwrap_err().to_string();
    assert!(
        error.starts_with("\"rabbit\" is neither a file nor the name of a model; available: bunny, sphere"),
        "{error}"
    );
    let error = Model::load(Path::new("none/such.ply")).unwrap_err().to_string();
    assert!(error.starts_with("none/such.ply: cannot be read: "), "{error}");
}
