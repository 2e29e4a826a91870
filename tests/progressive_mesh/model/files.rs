//! PLY and OBJ files, read and written.

use super::*;
use ortelius::model::{NAMES, named};
use std::io::Write;

#[test]
fn the_cube_is_closed_and_has_three_wedges_at_each_corner() {
    let cube = cube();
    let topology = cube.topology();
    assert_eq!((cube.positions.len(), cube.wedge_positions.len(), cube.faces.len()), (8, 24, 12));
    assert_eq!((topology.edges, topology.seam_edges, topology.is_closed()), (18, 12, true));
    for face in 0..12 {
        let [a, b, c] = cube.face_positions(face).map(|position| cube.positions[position as usize]);
        let normal = cube.attributes.normals[cube.faces[face][0] as usize].map(f64::from);
        assert_eq!((b - a).cross(c - a).to_array(), normal, "face {face}");
    }
}

#[test]
fn an_obj_may_use_negative_indices_continued_lines_and_mixed_corners() {
    let other =
        CUBE.replace("f 1/1/1 4/2/1 3/3/1 2/4/1", "g side\nf -8/-4/-6 -5/2/1\\\n 3/3/1 2/4/1 # first\nl 1 2");
    assert_eq!(corners(&read("a.obj", other)), corners(&cube()));
    let crlf = CUBE.replace('\n', "\r\n");
    assert_eq!(read("a.obj", crlf), cube());
    // A corner without a normal gets the normal of its face, which equals the original here.
    let mixed = CUBE.replace("f 1/1/1 4/2/1 3/3/1 2/4/1", "f 1/1 4/2 3/3 2/4");
    let (mixed, report) = Model::from_bytes(Path::new("a.obj"), mixed.as_bytes()).unwrap();
    assert_eq!((corners(&mixed), report.replaced_attributes), (corners(&cube()), 4));
}

/// The cube without attributes: in ASCII, and in both binary byte orders with additional elements and
/// properties.
fn plys() -> [Vec<u8>; 3] {
    let cube = cube();
    let mut ascii = String::from(
        "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 8\nproperty float x\nproperty double y\n\
         property short z\nelement face 12\nproperty list uchar int vertex_index\nend_header\n",
    );
    for position in &cube.positions {
        ascii += &format!("{} {:e}\t{}\n", position.x, position.y, position.z);
    }
    for face in 0..12 {
        let [a, b, c] = cube.face_positions(face);
        ascii += &format!("3 {a} {b} {c}\n");
    }
    let binary = |order: &str, big: bool| {
        let mut file = format!(
            "ply\r\nformat {order} 1.0\r\nelement sensor 2\r\nproperty list ushort float range\r\n\
             element vertex 8\r\nproperty uchar quality\r\nproperty float z\r\nproperty float y\r\nproperty double x\r\n\
             element face 12\r\nproperty list uchar double weights\r\nproperty list ushort uint vertex_indices\r\n\
             property int group\r\nend_header\r\n"
        )
        .into_bytes();
        let mut put = |little: &[u8]| {
            let mut bytes = little.to_vec();
            if big {
                bytes.reverse();
            }
            file.extend(bytes);
        };
        put(&0u16.to_le_bytes());
        put(&1u16.to_le_bytes());
        put(&1f32.to_le_bytes());
        for position in &cube.positions {
            put(&[7]);
            put(&(position.z as f32).to_le_bytes());
            put(&(position.y as f32).to_le_bytes());
            put(&position.x.to_le_bytes());
        }
        for face in 0..12 {
            put(&[1]);
            put(&0.5f64.to_le_bytes());
            put(&3u16.to_le_bytes());
            cube.face_positions(face).iter().for_each(|corner| put(&corner.to_le_bytes()));
            put(&(-1i32).to_le_bytes());
        }
        file
    };
    [
        ascii.trim_end().as_bytes().to_vec(),
        binary("binary_little_endian", false),
        binary("binary_big_endian", true),
    ]
}

#[test]
fn a_ply_reads_the_same_in_every_byte_order_and_among_unknown_elements() {
    let mut bare = cube();
    bare.attributes = Default::default();
    for ply in plys() {
        let model = read("cube.ply", ply);
        assert_eq!((corners(&model), model.wedge_positions.len()), (corners(&bare), 8));
    }
}

#[test]
fn a_polygon_of_a_ply_is_a_fan() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
               property uchar red\nproperty uchar green\nproperty uchar blue\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n\
               0 0 0 1 2 3\n1 0 0 1 2 3\n2 1 0 1 2 3\n1 2 0 1 2 3\n0 1 0 1 2 3\n5 0 1 2 3 4\n";
    let model = read("a.ply", ply);
    assert_eq!(model.faces, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    assert_eq!(model.attributes.colors, [[1, 2, 3, 255]; 5]);
}

#[test]
fn a_vertex_of_an_obj_has_a_colour_with_and_without_a_weight() {
    let obj = "v 0 0 0 1 0 0.2\nv 1 0 0 1 1 0 0.2\nv 0 1 0 0.5\nf 1 2 3\n";
    let colors = read("a.obj", obj).attributes.colors;
    assert_eq!(colors, [[255, 0, 51, 255], [255, 0, 51, 255], [255; 4]]);
}

#[test]
fn a_written_model_reads_back_bit_for_bit() {
    let mut colored = cube();
    colored.attributes.colors = (0..24).map(|i| [i * 10, 255 - i, 7, 255]).collect();
    let mut bare = colored.clone();
    bare.attributes.normals.clear();
    bare.attributes.coordinates.clear();
    let mut models = vec![cube(), colored, bare];
    models.extend(NAMES.map(|name| named(name).unwrap()));
    for (index, model) in models.iter().enumerate() {
        for (format, name) in [(MeshFormat::Ply, "a.ply"), (MeshFormat::Obj, "a.obj")] {
            let again = read(name, written(model, format));
            assert!(again == *model, "model {index} as {name}");
        }
    }
}

#[test]
fn an_exact_f32_coordinate_takes_four_bytes_and_any_other_eight() {
    let mut model = named("grid:5").unwrap();
    let double = written(&model, MeshFormat::Ply).len();
    model.positions.iter_mut().for_each(|position| *position = position.as_vec3().as_dvec3());
    // Each coordinate of 25 positions takes 4 more bytes. The word "double" is one letter longer than "float", in three
    // properties.
    assert_eq!(double - written(&model, MeshFormat::Ply).len(), 25 * 3 * 4 + 3);
}

#[test]
fn a_packed_file_is_unpacked_and_a_decompression_bomb_is_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let pack = |name: &str, write: &dyn Fn(&mut dyn Write)| {
        let path = folder.path().join(name);
        let file = std::fs::File::create(&path).unwrap();
        let mut packer = flate2::write::GzEncoder::new(file, flate2::Compression::default());
        write(&mut packer);
        packer.finish().unwrap();
        path
    };
    let path = pack("cube.obj.gz", &|out| out.write_all(CUBE.as_bytes()).unwrap());
    assert_eq!(Model::load(&path).unwrap().0, cube());
    // 65 MiB of newlines pack to 64 KiB.
    let blank = vec![b'\n'; 1 << 20];
    let path = pack("bomb.obj.gz", &|out| (0..65).for_each(|_| out.write_all(&blank).unwrap()));
    let error = Model::load(&path).unwrap_err().to_string();
    assert!(error.ends_with("bomb.obj.gz: unpacks to more than the limit of 67108864 bytes"), "{error}");
}

#[test]
fn strips_are_triangles_with_every_second_one_reversed() {
    let header = "ply\nformat ascii 1.0\nelement vertex 7\nproperty float x\nproperty float y\nproperty float z\n\
                  element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
    let places = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n5 0 0\n6 0 0\n5 1 0\n";
    let model = read("a.ply", format!("{header}{places}9 0 1 2 3 -1 4 5 6 -1\n"));
    let faces: Vec<[u32; 3]> = (0..3).map(|face| model.face_positions(face)).collect();
    assert_eq!(faces, [[0, 1, 2], [2, 1, 3], [4, 5, 6]]);
    let wrong = format!("{header}{places}4 0 1 2 -2\n");
    let error = Model::from_bytes(Path::new("a.ply"), wrong.as_bytes()).unwrap_err().to_string();
    assert_eq!(error, "a.ply:17: -2 is not a vertex index");
}

#[test]
fn an_obj_counts_the_second_texture_coordinate_from_the_lower_edge() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0.25\nvt 0 1\nf 1/1 2/2 3/3\n";
    let model = read("a.obj", text);
    let coordinates = model.faces[0].map(|wedge| model.attributes.coordinates[wedge as usize]);
    assert_eq!(coordinates, [[0.0, 1.0], [1.0, 0.75], [0.0, 0.0]]);
    let again = String::from_utf8(written(&model, MeshFormat::Obj)).unwrap();
    assert!(["vt 0 0\n", "vt 1 0.25\n", "vt 0 1\n"].iter().all(|line| again.contains(line)), "{again}");
    let error = Model::from_bytes(Path::new("a.obj"), b"v 0 0 0\nf 0 1 1\n").unwrap_err().to_string();
    assert_eq!(error, "a.obj:2: index 0, but the first index is 1");
}

#[test]
fn texture_coordinates_of_corners_make_wedges() {
    let header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                  element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n\
                  0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 6 0 0 1 0 1 1\n";
    // Of the two shared vertices, only vertex 2 has the same coordinates in both faces.
    let model = read("a.ply", format!("{header}3 0 2 3 6 0.5 0 1 1 0 1\n"));
    assert_eq!((model.positions.len(), model.wedge_positions.len()), (4, 5));
    let coordinates =
        |face: usize| model.faces[face].map(|wedge| model.attributes.coordinates[wedge as usize]);
    // The file counts the second coordinate from the picture's lower edge.
    assert_eq!(coordinates(0), [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]);
    assert_eq!(coordinates(1), [[0.5, 1.0], [1.0, 0.0], [0.0, 0.0]]);
    let short = format!("{header}3 0 2 3 5 0 0 1 1 0\n");
    let error = Model::from_bytes(Path::new("a.ply"), short.as_bytes()).unwrap_err().to_string();
    assert_eq!(error, "a.ply:16: texcoord has 5 numbers for a face of 3 corners");
}
