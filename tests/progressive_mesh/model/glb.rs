//! Binary glTF.

use super::*;

/// A GLB file from a JSON text and a binary chunk.
pub fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let mut text = json.as_bytes().to_vec();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let length = 12 + 8 + text.len() + 8 + bin.len();
    let mut file = b"glTF".to_vec();
    for word in [2, length as u32, text.len() as u32] {
        file.extend(word.to_le_bytes());
    }
    file.extend(b"JSON");
    file.extend(text);
    file.extend((bin.len() as u32).to_le_bytes());
    file.extend(b"BIN\0");
    file.extend(bin);
    file
}

/// The cube with all its attributes. Each side is a primitive with four interleaved vertices (32 bytes each)
/// and six indices.
pub fn cube_glb(node: &str) -> Vec<u8> {
    let cube = cube();
    let (mut bin, mut sides) = (Vec::new(), Vec::new());
    for side in 0..6 {
        let [a, b, c] = cube.faces[2 * side];
        let d = cube.faces[2 * side + 1][2];
        for wedge in [a, b, c, d].map(|wedge| wedge as usize) {
            let position = cube.positions[cube.wedge_positions[wedge] as usize].as_vec3();
            let values = position.to_array().into_iter();
            for value in
                values.chain(cube.attributes.normals[wedge]).chain(cube.attributes.coordinates[wedge])
            {
                bin.extend(value.to_le_bytes());
            }
        }
        sides.push(format!(
            r#"{{"attributes":{{"POSITION":{},"NORMAL":{},"TEXCOORD_0":{}}},"indices":18}}"#,
            3 * side,
            3 * side + 1,
            3 * side + 2
        ));
    }
    [0u8, 1, 2, 0, 2, 3].iter().for_each(|index| bin.push(*index));
    let mut accessors = Vec::new();
    for side in 0..6 {
        for (offset, shape) in [(0, "VEC3"), (12, "VEC3"), (24, "VEC2")] {
            accessors.push(format!(
                r#"{{"bufferView":0,"byteOffset":{},"componentType":5126,"count":4,"type":"{shape}"}}"#,
                128 * side + offset
            ));
        }
    }
    accessors.push(r#"{"bufferView":1,"componentType":5121,"count":6,"type":"SCALAR"}"#.to_owned());
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{node}],
           "meshes":[{{"primitives":[{}]}}],"accessors":[{}],
           "bufferViews":[{{"buffer":0,"byteLength":768,"byteStride":32}},{{"buffer":0,"byteOffset":768,"byteLength":6}}],
           "buffers":[{{"byteLength":774}}]}}"#,
        sides.join(","),
        accessors.join(",")
    );
    glb(&json, &bin)
}

#[test]
fn a_glb_has_the_same_shape_as_the_obj() {
    assert_eq!(corners(&read("cube.glb", cube_glb(r#"{"mesh":0}"#))), corners(&cube()));
}

#[test]
fn nodes_transform_meshes_and_a_mirror_reverses_the_winding() {
    let nested = r#"{"children":[1],"translation":[10,0,0]},{"mesh":0,"scale":[-2,1,1]}"#;
    let model = read("cube.glb", cube_glb(nested));
    let x: Vec<f64> = model.positions.iter().map(|position| position.x).collect();
    assert_eq!(
        (x.iter().copied().fold(f64::MAX, f64::min), x.iter().copied().fold(f64::MIN, f64::max)),
        (8.0, 10.0)
    );
    for face in 0..12 {
        let [a, b, c] = model.face_positions(face).map(|position| model.positions[position as usize]);
        let normal = model.attributes.normals[model.faces[face][0] as usize].map(f64::from);
        let turned = (b - a).cross(c - a).dot(normal.into());
        assert!(turned > 0.0, "face {face}: {turned}");
    }
    // A quarter turn about z, as columns.
    let turned = r#"{"mesh":0,"matrix":[0,1,0,0,-1,0,0,0,0,0,1,0,0,0,0,1]}"#;
    let model = read("cube.glb", cube_glb(turned));
    let min = model.positions.iter().fold(glam::DVec3::MAX, |min, position| min.min(*position));
    assert_eq!(min.to_array(), [-1.0, 0.0, 0.0]);
}

/// A flat square in one primitive without indices.
fn square(mode: u32, corners: &[[f32; 2]]) -> Model {
    let bin: Vec<u8> = corners.iter().flat_map(|&[x, y]| [x, y, 0.0]).flat_map(f32::to_le_bytes).collect();
    let json = format!(
        r#"{{"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":{mode}}}]}}],
           "accessors":[{{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3"}}],
           "bufferViews":[{{"buffer":0,"byteLength":{}}}],"buffers":[{{"byteLength":{}}}]}}"#,
        corners.len(),
        bin.len(),
        bin.len()
    );
    read("square.glb", glb(&json, &bin))
}

#[test]
fn lists_strips_and_fans_are_the_same_square() {
    let [a, b, c, d] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    for model in [square(4, &[a, b, c, a, c, d]), square(5, &[d, a, c, b]), square(6, &[a, b, c, d])] {
        assert_eq!((model.faces.len(), model.topology().boundary_edges), (2, 4));
        for face in 0..2 {
            let [a, b, c] = model.face_positions(face).map(|position| model.positions[position as usize]);
            assert_eq!((b - a).cross(c - a).to_array(), [0.0, 0.0, 1.0]);
        }
    }
}
