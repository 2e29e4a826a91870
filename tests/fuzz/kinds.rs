//! How each kind of file is read, and the invariants of its content.

use ortelius::figure::Results;
use ortelius::model::Model;
use ortelius::paper::progressive_mesh::mesh::ProgressiveMesh;
use ortelius::paper::progressive_mesh::order::{OrderOptions, order};
use ortelius::paper::progressive_mesh::run::State;
use ortelius::paper::progressive_mesh::simplify::{SimplifyOptions, simplify};
use ortelius::renderer::sections;
use ortelius::scene::Scene;
use ortelius::texture::bake::open_picture;
use ortelius::texture::source::TileSource;
use ortelius::texture::tiles::{TileFile, verify};
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

pub struct Kind {
    /// The name of its test, and of its folder under `corpus`.
    pub name: &'static str,
    /// Number of damaged files that `./x test` reads.
    pub cases: usize,
    /// Reads the file; an error is a message. Panics if the content breaks an invariant.
    pub read: fn(&Path) -> Result<(), String>,
    /// Repairs the checksums.
    pub reseal: fn(&mut [u8]),
}

pub const KINDS: [Kind; 9] = [
    Kind { name: "scene", cases: 2000, read: scene, reseal: unsealed },
    Kind { name: "tiles", cases: 2000, read: tiles, reseal: reseal_tiles },
    // Checksums are not repaired here: the tests of src/paper/progressive_mesh/file do that with ten thousand files.
    Kind { name: "pmesh", cases: 2000, read: pmesh, reseal: unsealed },
    Kind { name: "ply", cases: 6000, read: model, reseal: unsealed },
    Kind { name: "obj", cases: 2000, read: model, reseal: unsealed },
    Kind { name: "glb", cases: 2000, read: model, reseal: unsealed },
    Kind { name: "tiff", cases: 2000, read: picture, reseal: unsealed },
    Kind { name: "png", cases: 2000, read: picture, reseal: reseal_png },
    Kind { name: "results", cases: 2000, read: results, reseal: unsealed },
];

fn unsealed(_: &mut [u8]) {}

fn scene(path: &Path) -> Result<(), String> {
    let scene = sections::load(path.to_str().expect("UTF-8"), &[]).map_err(|error| error.to_string())?;
    let again =
        Scene::from_text(path, scene.to_toml()).unwrap_or_else(|error| panic!("written again: {error}"));
    assert_eq!(again, scene);
    Ok(())
}

fn tiles(path: &Path) -> Result<(), String> {
    let file = TileFile::open(path).map_err(|error| error.to_string())?;
    let layout = *file.layout();
    let report = verify(path, &|_| ()).map_err(|error| error.to_string())?;
    let mut bytes = vec![0; layout.tile_bytes()];
    let mut bad = 0;
    for index in 0..layout.pyramid().tile_count() {
        bad += usize::from(file.read_tile(layout.tile(index), &mut bytes).is_err());
    }
    for level in layout.pyramid().first_resident_level()..=layout.pyramid().coarsest_level() {
        bad += usize::from(file.read_resident_level(level).is_err());
    }
    assert_eq!(bad, report.bad.len(), "reading and verifying disagree");
    report.bad.first().map_or(Ok(()), |bad| Err(bad.to_string()))
}

/// Reseals header and index; records keep the checksums stored there.
fn reseal_tiles(bytes: &mut [u8]) {
    for page in bytes.chunks_exact_mut(4096).take(2) {
        let sum = xxh3_64(&page[..4088]);
        page[4088..].copy_from_slice(&sum.to_le_bytes());
    }
}

fn pmesh(path: &Path) -> Result<(), String> {
    let loaded = ProgressiveMesh::read(path).map_err(|error| error.to_string())?;
    up_and_down(&loaded.mesh);
    Ok(())
}

fn up_and_down(mesh: &ProgressiveMesh) {
    mesh.check().unwrap();
    let mut state = State::new(mesh);
    [mesh.last_level(), 0].iter().for_each(|&level| state.go_to(mesh, level));
    assert!(state.faces() == mesh.faces);
}

/// A clean model; one of five is also built to a progressive mesh, written and read back.
fn model(path: &Path) -> Result<(), String> {
    let bytes = std::fs::read(path).unwrap();
    let (model, report) = match Model::from_bytes(path, &bytes) {
        Ok(read) => read,
        Err(error) => {
            let error = error.to_string();
            assert!(error.starts_with(path.to_str().unwrap()) && error.lines().count() == 1, "{error}");
            return Err(error);
        }
    };
    assert_eq!(report.faces, model.faces.len());
    model.check().unwrap_or_else(|broken| panic!("{broken}"));
    if xxh3_64(&bytes).is_multiple_of(5) {
        let options = SimplifyOptions { target_faces: 2, ..SimplifyOptions::default() };
        let collapses = simplify(&model, &options, &mut |_, _| ()).collapses;
        for options in [OrderOptions::TAIL_23, OrderOptions::IN_PLACE_10] {
            let mesh = order(&model, &collapses, &options, &mut |_, _| ());
            assert!(ProgressiveMesh::from_bytes(&mesh.to_bytes().0).unwrap().mesh == mesh);
            up_and_down(&mesh);
        }
    }
    Ok(())
}

/// Most pixels of a picture that is read; larger ones are only opened.
const MAX_PIXELS: u64 = 1 << 20;

fn picture(path: &Path) -> Result<(), String> {
    let mut rows = open_picture(path).map_err(|error| error.to_string())?;
    let [width, height] = rows.size();
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Ok(());
    }
    let mut rgba = vec![0; width as usize * 4];
    (0..height).try_for_each(|_| rows.next_row(&mut rgba)).map_err(|error| error.to_string())
}

/// Recomputes the CRC of every complete chunk.
fn reseal_png(bytes: &mut [u8]) {
    let mut at = 8;
    while let Some(length) = bytes.get(at..at + 4) {
        let length = u32::from_be_bytes(length.try_into().expect("4 bytes")) as usize;
        let end = at + 8 + length;
        if bytes.len() < end + 4 {
            return;
        }
        let mut check = flate2::Crc::new();
        check.update(&bytes[at + 4..end]);
        bytes[end..end + 4].copy_from_slice(&check.sum().to_be_bytes());
        at = end + 4;
    }
}

fn results(path: &Path) -> Result<(), String> {
    let text = String::from_utf8(std::fs::read(path).unwrap()).map_err(|error| error.to_string())?;
    let results = Results::parse(&text).map_err(|error| error.to_string())?;
    let written = results.text();
    let again = Results::parse(&written).unwrap_or_else(|error| panic!("written again: {error}"));
    assert!(again.text() == written);
    Ok(())
}
