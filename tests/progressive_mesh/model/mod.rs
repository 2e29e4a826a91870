//! Models from files: every format gives the same shape, and written files read back. Damaged files are in tests/fuzz.

mod faults;
mod files;
mod glb;
mod pipeline;
mod soup;

use ortelius::model::{MeshFormat, Model};
use std::path::Path;

/// A cube with the normals and coordinates of its sides, in quads.
const CUBE: &str = "\
# eight corners
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 -1
vn 0 0 1
vn 0 -1 0
vn 1 0 0
vn 0 1 0
vn -1 0 0
f 1/1/1 4/2/1 3/3/1 2/4/1
f 5/1/2 6/2/2 7/3/2 8/4/2
f 1/1/3 2/2/3 6/3/3 5/4/3
f 2/1/4 3/2/4 7/3/4 6/4/4
f 3/1/5 4/2/5 8/3/5 7/4/5
f 4/1/6 1/2/6 5/3/6 8/4/6
";

fn read(name: &str, bytes: impl AsRef<[u8]>) -> Model {
    let (model, _) = Model::from_bytes(Path::new(name), bytes.as_ref()).unwrap();
    model.check().unwrap_or_else(|broken| panic!("{name}: {broken}"));
    model
}

fn cube() -> Model {
    read("cube.obj", CUBE)
}

/// A model as the bytes of a file.
fn written(model: &Model, format: MeshFormat) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model");
    model.write(&path, format).unwrap();
    std::fs::read(path).unwrap()
}

/// A model independent of the numbering of its wedges: the corners of each face with all their values.
fn corners(model: &Model) -> Vec<[Vec<u64>; 3]> {
    let attributes = &model.attributes;
    let corner = |wedge: u32| {
        let wedge = wedge as usize;
        let position = model.positions[model.wedge_positions[wedge] as usize].to_array().map(f64::to_bits);
        let normal = attributes.normals.get(wedge).into_iter().flatten();
        let coordinate = attributes.coordinates.get(wedge).into_iter().flatten();
        let floats = normal.chain(coordinate).map(|value| u64::from(value.to_bits()));
        let color = attributes.colors.get(wedge).map(|color| u64::from(u32::from_le_bytes(*color)));
        position.into_iter().chain(floats).chain(color).collect()
    };
    model.faces.iter().map(|face| face.map(corner)).collect()
}
