//! The order of faces at every level of detail (paper 2, sections 4 and 5).
//!
//! [`classical`] is the plain view-independent progressive mesh that the paper starts from: vertices and faces stand
//! in the order in which splits bring them, and nothing ever moves.

mod assemble;
#[cfg(test)]
pub(super) mod scratch;

use super::mesh::ProgressiveMesh;
use super::simplify::Collapses;
use crate::scene::model::Model;
use assemble::{Arrangement, assemble};

/// The standard order (section 4): what is removed first stands last. No tswaps.
///
/// # Panics
/// If `collapses` are not of `model`: a wedge or face removed twice, or one that lives on without a vertex.
pub fn classical(model: &Model, collapses: &Collapses) -> ProgressiveMesh {
    assemble(model, collapses, &Arrangement { births: births(model, collapses), moves: Vec::new() })
}

/// The model's faces in the order of their appearance: those of M0 as the model lists them, then each split's.
fn births(model: &Model, collapses: &Collapses) -> Vec<u32> {
    let mut stays = vec![true; model.faces.len()];
    collapses.faces.items().iter().for_each(|&face| stays[face as usize] = false);
    let base = (0..model.faces.len() as u32).filter(|&face| stays[face as usize]);
    base.chain(collapses.faces.rows().rev().flatten().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::progressive_mesh::cache::{Cache, level_costs, live_faces, sampled_levels};
    use glam::DVec3;

    #[test]
    fn the_classical_order_wastes_the_cache() {
        let model = scratch::torus(40);
        let mesh = classical(&model, &scratch::collapses(&model, 64));
        let levels = sampled_levels(&mesh, 100_000, 256);
        assert_eq!(levels.len(), mesh.levels.len());
        let costs = &level_costs(&mesh, &[Cache::Fifo(16)], &levels)[0];
        let (mean, worst) = (costs.mean(), costs.exceeded_by(0.0));
        assert!(4.0 < mean && mean < worst && worst < 6.0, "{mean}, {worst}: the paper says 4 to 6");
    }

    #[test]
    fn the_last_level_is_the_model() {
        let model = scratch::torus(12);
        let mesh = classical(&model, &scratch::collapses(&model, 40));
        let last = mesh.levels.last().expect("levels");
        assert_eq!((last.vertices, last.faces, last.error), (144, 288, 0.0));
        let point = |vertex: u32| {
            DVec3::from(mesh.vertices.positions[vertex as usize].map(f64::from)) + mesh.vertices.centre
        };
        let key = |point: DVec3| point.to_array().map(|x| (x * 1e5).round() as i64);
        let mut ours: Vec<_> =
            live_faces(&mesh, mesh.last_level()).iter().map(|face| face.map(|v| key(point(v)))).collect();
        let mut wanted: Vec<_> =
            model.faces.iter().map(|face| face.map(|v| key(model.positions[v as usize]))).collect();
        ours.sort_unstable();
        wanted.sort_unstable();
        assert_eq!(ours, wanted);
    }
}
