//! Keeps the meshes that are built for scenes as `.pmesh` files, which are lossless. A build takes seconds to minutes;
//! its result depends only on the model, the options and the version of the builder. The file's name is a hash of these
//! three.

use super::choices::FaceOrder;
use super::encoded::{EncodedMesh, order_and_encode};
use super::file::{LoadedFile, PmeshError};
use super::mesh::ProgressiveMesh;
use super::order::{OrderOptions, order_or_classical};
use super::simplify::{Collapses, SimplifyOptions, simplify};
use crate::model::{Attributes, Model};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use xxhash_rust::xxh3::Xxh3;

/// Version of the simplifier and of the orders. Increase it if one of them gives a different mesh: kept files of
/// earlier versions are then ignored. A test compares a hash of a built mesh.
const VERSION: u32 = 10;

/// Receives the number of finished faces, and the number of all faces.
pub type BuildProgress = Box<dyn FnMut(usize, usize)>;

/// Where built meshes are kept, and how the progress of a build is shown.
pub struct Builds {
    /// `None`: built meshes are not kept.
    pub folder: Option<PathBuf>,
    /// Called with the name of each step.
    pub step: Box<dyn Fn(&'static str) -> BuildProgress + Send + Sync>,
}

/// Set by the command line. If it is not set, as in tests, nothing is kept and no progress is shown.
static BUILDS: OnceLock<Builds> = OnceLock::new();

/// Sets how the process builds and keeps meshes. Only the first call has an effect.
pub fn keep(builds: Builds) {
    let _first_call_wins = BUILDS.set(builds);
}

/// The mesh of the model `source`: kept by an earlier run, or built and kept.
pub(super) fn kept_or_built(
    source: &str,
    model: &Model,
    options: &SimplifyOptions,
    order: FaceOrder,
) -> ProgressiveMesh {
    let silent = || Builds { folder: None, step: Box::new(|_| Box::new(|_, _| ())) };
    BUILDS.get_or_init(silent).mesh(source, model, options, order)
}

impl Builds {
    fn mesh(
        &self,
        source: &str,
        model: &Model,
        options: &SimplifyOptions,
        order: FaceOrder,
    ) -> ProgressiveMesh {
        let path = self.folder.as_ref().map(|folder| folder.join(file_name(model, options, order)));
        if let Some(mesh) = path.as_deref().and_then(|path| read(path, model)) {
            return mesh;
        }
        tracing::info!("{source}: building the levels of detail of {} faces", model.faces.len());
        let simplified = simplify(model, options, &mut (self.step)("simplify"));
        let options = OrderOptions::of(order);
        let progress = &mut (self.step)("order");
        let Some(path) = path else {
            return order_or_classical(model, &simplified.collapses, options.as_ref(), progress);
        };
        let encoded = order_and_encode(model, &simplified.collapses, options.as_ref(), progress);
        write(&path, &encoded);
        encoded.mesh
    }
}

/// A model's progressive mesh with the given order of faces. Baselines get the classical order.
pub fn ordered(model: &Model, collapses: &Collapses, face_order: FaceOrder) -> ProgressiveMesh {
    order_or_classical(model, collapses, OrderOptions::of(face_order).as_ref(), &mut |_, _| ())
}

/// The file's name: a hash of everything that the mesh depends on.
pub(super) fn file_name(model: &Model, options: &SimplifyOptions, order: FaceOrder) -> String {
    let Model { positions, wedge_positions, attributes, faces } = model;
    let Attributes { normals, coordinates, colors } = attributes;
    let lengths =
        [positions.len(), wedge_positions.len(), normals.len(), coordinates.len(), colors.len(), faces.len()];
    let mut hash = Xxh3::new();
    hash.update(format!("{VERSION} {options:?} {:?} {lengths:?}", OrderOptions::of(order)).as_bytes());
    positions.iter().flat_map(|at| at.to_array()).for_each(|number| hash.update(&number.to_le_bytes()));
    let floats = normals.as_flattened().iter().chain(coordinates.as_flattened());
    floats.for_each(|number| hash.update(&number.to_le_bytes()));
    hash.update(colors.as_flattened());
    let indices = wedge_positions.iter().chain(faces.as_flattened());
    indices.for_each(|index| hash.update(&index.to_le_bytes()));
    format!("{:032x}.pmesh", hash.digest128())
}

/// A kept mesh. `None` if there is no file, or, with a warning, if the file is damaged.
fn read(path: &Path, model: &Model) -> Option<ProgressiveMesh> {
    let is_of_model = |mesh: &ProgressiveMesh| {
        let full = mesh.levels[mesh.last_level() as usize];
        [full.vertices as usize, full.faces as usize] == [model.wedge_positions.len(), model.faces.len()]
    };
    let fault = match ProgressiveMesh::read(path) {
        Ok(LoadedFile { mesh, contents }) if !contents.is_cut() && is_of_model(&mesh) => return Some(mesh),
        Ok(_) => format!("{}: not the whole mesh of this model", path.display()),
        Err(PmeshError::Read { source, .. }) if source.kind() == ErrorKind::NotFound => return None,
        Err(error) => error.to_string(),
    };
    tracing::warn!("{fault}; the mesh is built again");
    None
}

/// A mesh that cannot be kept is built again next time.
fn write(path: &Path, encoded: &EncodedMesh) {
    let folder = path.parent().expect("a file in the cache folder");
    let made = std::fs::create_dir_all(folder).map_err(anyhow::Error::from);
    match made.and_then(|()| Ok(encoded.write(path)?)) {
        Ok(()) => tracing::debug!("{}: {} bytes", path.display(), encoded.bytes.len()),
        Err(error) => tracing::info!("the built mesh is not kept: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::named;
    use crate::paper::progressive_mesh::choices::{BuildEffort, ErrorMetric};
    use glam::DVec3;
    use sha2::{Digest, Sha256};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    const ORDER: FaceOrder = FaceOrder::Tail23;

    /// Keeps meshes in a folder, and counts the steps of builds.
    fn counted(folder: Option<&Path>) -> (Builds, Arc<AtomicUsize>) {
        let steps = Arc::<AtomicUsize>::default();
        let counter = steps.clone();
        let step = move |_| -> BuildProgress {
            counter.fetch_add(1, Ordering::Relaxed);
            Box::new(|_, _| ())
        };
        (Builds { folder: folder.map(Path::to_owned), step: Box::new(step) }, steps)
    }

    fn built(builds: &Builds, model: &Model, order: FaceOrder) -> ProgressiveMesh {
        builds.mesh("test", model, &SimplifyOptions::default(), order)
    }

    /// The debug text of a mesh. The texts of two floats differ if any bit differs, except for NaN.
    fn text(mesh: &ProgressiveMesh) -> String {
        format!("{mesh:?}")
    }

    /// A model with all attributes, and with positive and negative zeros.
    fn with_attributes() -> Model {
        let mut model = named("sphere:3").unwrap();
        let wedges = model.wedge_positions.len();
        let number = |wedge: usize| (wedge as f32).sin();
        let sign = |wedge: usize| if wedge.is_multiple_of(2) { 0.0 } else { -0.0 };
        model.attributes.normals = (0..wedges).map(|n| [number(n), -number(n), sign(n)]).collect();
        model.attributes.coordinates = (0..wedges).map(|n| [number(n) / 3.0, sign(n)]).collect();
        model.attributes.colors = (0..wedges).map(|n| [n as u8, 255, 0, 7]).collect();
        model
    }

    #[test]
    fn a_kept_mesh_has_every_bit_of_the_built_one_and_is_not_built_again() {
        let models = [named("grid:9").unwrap(), with_attributes()];
        for model in &models {
            for &order in FaceOrder::ALL.iter().filter(|order| !order.is_baseline()) {
                let folder = tempfile::tempdir().unwrap();
                let (builds, steps) = counted(Some(folder.path()));
                let [fresh, kept] = [(); 2].map(|()| text(&built(&builds, model, order)));
                assert_eq!(steps.load(Ordering::Relaxed), 2, "{order:?}: one build of two steps");
                assert!(fresh == kept, "{order:?}");
                let alone = text(&built(&counted(None).0, model, order));
                assert!(fresh == alone, "{order:?}: without a folder");
            }
        }
    }

    #[test]
    fn damaged_files_and_meshes_of_other_models_are_replaced() {
        let (model, other) = (named("sphere:3").unwrap(), named("sphere:2").unwrap());
        let folder = tempfile::tempdir().unwrap();
        let (builds, steps) = counted(Some(folder.path()));
        let fresh = text(&built(&builds, &model, ORDER));
        let path = folder.path().join(file_name(&model, &SimplifyOptions::default(), ORDER));
        let whole = std::fs::read(&path).unwrap();
        let mut flipped = whole.clone();
        *flipped.last_mut().unwrap() ^= 1;
        let foreign = built(&counted(None).0, &other, ORDER).to_bytes().0;
        let damaged = [&flipped[..], &whole[..whole.len() - 1], &foreign, b"text", b""];
        for (n, bytes) in damaged.into_iter().enumerate() {
            std::fs::write(&path, bytes).unwrap();
            assert!(text(&built(&builds, &model, ORDER)) == fresh);
            assert_eq!(steps.load(Ordering::Relaxed), 2 * (n + 2), "file {n} is built again");
            assert!(std::fs::read(&path).unwrap() == whole, "file {n} is replaced");
        }
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_no_error() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let model = named("sphere:2").unwrap();
        let (builds, steps) = counted(Some(&file.path().join("meshes")));
        (0..2).for_each(|_| drop(built(&builds, &model, ORDER)));
        assert_eq!(steps.load(Ordering::Relaxed), 4);
    }

    #[test]
    fn the_name_depends_on_the_model_and_on_every_setting() {
        let model = with_attributes();
        let own = SimplifyOptions::default();
        let mut names = vec![file_name(&model, &own, ORDER), file_name(&model, &own, FaceOrder::Classical)];
        let changed = [
            SimplifyOptions { target_faces: 65, ..own },
            SimplifyOptions { seed: 1, ..own },
            SimplifyOptions { effort: BuildEffort::Fast, ..own },
            SimplifyOptions { metric: ErrorMetric::Appearance, ..own },
        ];
        names.extend(changed.iter().map(|options| file_name(&model, options, ORDER)));
        let changes: [fn(&mut Model); 6] = [
            |model| model.positions[5].y += 1e-12,
            |model| model.wedge_positions[3] += 1,
            |model| model.faces[7].rotate_left(1),
            |model| model.attributes.normals[2][2] *= -1.0,
            |model| model.attributes.coordinates[2][0] += 1e-6,
            |model| model.attributes.colors[2][3] ^= 1,
        ];
        names.extend(changes.map(|change| {
            let mut other = model.clone();
            change(&mut other);
            file_name(&other, &own, ORDER)
        }));
        let count = names.len();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), count);
        // Baselines start from the classical mesh.
        let [classical, random] =
            [FaceOrder::Classical, FaceOrder::Random].map(|order| file_name(&model, &own, order));
        assert_eq!(classical, random);
    }

    /// The models are computed without transcendental functions, whose last bit depends on the C library. The builder
    /// itself takes logarithms and powers. If this test fails only with another C library, these functions are the
    /// cause.
    #[test]
    fn a_build_that_gives_another_mesh_needs_another_version() {
        let grid = named("grid:17").unwrap();
        let orders = [FaceOrder::Tail23, FaceOrder::Tail10, FaceOrder::InPlace23, FaceOrder::Paper];
        let mut bytes = orders.map(|order| built(&counted(None).0, &grid, order).to_bytes().0).concat();
        let mut coloured = grid.clone();
        let part = |n: usize| (n * 37 % 101) as f32 / 101.0;
        let count = coloured.wedge_positions.len();
        coloured.attributes.normals =
            (0..count).map(|n| [0.0, 0.6, if n % 3 == 0 { 0.8 } else { -0.8 }]).collect();
        coloured.attributes.coordinates = (0..count).map(|n| [part(n), part(n + 5)]).collect();
        let appearance = SimplifyOptions { metric: ErrorMetric::Appearance, ..SimplifyOptions::default() };
        bytes.extend(counted(None).0.mesh("test", &coloured, &appearance, ORDER).to_bytes().0);
        // Two components. One has an eighth of the size of the other.
        let mut two = grid.clone();
        let (positions, wedges) = (two.positions.len() as u32, two.wedge_positions.len() as u32);
        two.positions.extend(grid.positions.iter().map(|at| *at * 0.125 + DVec3::new(9.0, 0.0, 0.0)));
        two.wedge_positions.extend(grid.wedge_positions.iter().map(|position| position + positions));
        two.faces.extend(grid.faces.iter().map(|face| face.map(|wedge| wedge + wedges)));
        bytes.extend(built(&counted(None).0, &two, ORDER).to_bytes().0);
        let hash: String = Sha256::digest(&bytes)[..8].iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(
            (VERSION, &*hash),
            (10, "0f7035128b7771f5"),
            "increase VERSION and store the new hash here"
        );
    }
}
