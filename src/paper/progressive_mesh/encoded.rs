//! Orders a mesh and encodes its file at the same time, on two cores: both work from the coarsest level to the finest.

use super::file::{Contents, MeshEncoder};
use super::mesh::ProgressiveMesh;
use super::order::{OrderOptions, order_growing};
use super::simplify::Collapses;
use crate::model::Model;
use crate::picture::write::{FileError, write_bytes};
use std::path::Path;

/// A mesh, and the bytes of its `.pmesh` file.
pub struct EncodedMesh {
    pub mesh: ProgressiveMesh,
    pub bytes: Vec<u8>,
    pub contents: Contents,
}

/// Orders a mesh as [`order_growing`] does, and encodes it.
///
/// # Panics
/// As [`super::order::order`].
pub fn order_and_encode(
    model: &Model,
    collapses: &Collapses,
    options: Option<&OrderOptions>,
    progress: &mut dyn FnMut(usize, usize),
) -> EncodedMesh {
    let mut encoder = None;
    let mut encode = |mesh: &ProgressiveMesh, levels: usize| {
        encoder.get_or_insert_with(|| MeshEncoder::new(mesh)).encode(mesh, levels);
    };
    let mesh = order_growing(model, collapses, options, progress, &mut encode);
    let (bytes, contents) = encoder.expect("a mesh has at least one level").finish(&mesh);
    EncodedMesh { mesh, bytes, contents }
}

impl EncodedMesh {
    /// Writes the file atomically.
    ///
    /// # Errors
    /// [`FileError`] names the path.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        write_bytes(path, &self.bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::named;
    use crate::paper::progressive_mesh::choices::FaceOrder;
    use crate::paper::progressive_mesh::order::order_or_classical;
    use crate::paper::progressive_mesh::simplify::{SimplifyOptions, simplify};

    #[test]
    fn the_encoder_beside_the_order_gives_the_bytes_of_the_finished_mesh() {
        let few = |options: OrderOptions| options.with_moves(4.0);
        // Without splits, with seams, and with a border.
        for (name, target_faces) in [("sphere:3", 10_000), ("solid:8", 64), ("knot:8", 64), ("grid:9", 9)] {
            let model = named(name).expect("a generated model");
            let options = SimplifyOptions { target_faces, ..SimplifyOptions::default() };
            let collapses = simplify(&model, &options, &mut |_, _| ()).collapses;
            let orders = FaceOrder::ALL.iter().filter(|order| !order.is_baseline());
            let options = orders.map(|&order| OrderOptions::of(order));
            for options in options.flat_map(|options| [options.clone(), options.map(few)]) {
                let (options, mut last) = (options.as_ref(), None);
                let progress = &mut |done, all| last = Some((done, all));
                let found = order_and_encode(&model, &collapses, options, progress);
                let mesh = order_or_classical(&model, &collapses, options, &mut |_, _| ());
                assert!(found.mesh == mesh, "{name}: {options:?}");
                assert!((found.bytes, found.contents) == mesh.to_bytes(), "{name}: {options:?}");
                assert_eq!(last, Some((model.faces.len(), model.faces.len())), "{name}: {options:?}");
            }
        }
    }

    #[test]
    #[should_panic(expected = "is removed twice")]
    fn a_panic_of_the_encoders_thread_is_passed_on() {
        let model = named("sphere:2").expect("a generated model");
        let mut collapses = simplify(&model, &SimplifyOptions::default(), &mut |_, _| ()).collapses;
        collapses.faces = collapses.faces.rows().map(|_| [0]).collect();
        order_and_encode(&model, &collapses, Some(&OrderOptions::IN_PLACE_23), &mut |_, _| ());
    }
}
