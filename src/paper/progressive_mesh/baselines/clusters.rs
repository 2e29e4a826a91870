//! meshoptimizer's clusters, made anew at every level: a strong baseline for batches and meshlets.

use crate::paper::progressive_mesh::cache::{Cache, LevelCosts, Transforms, live_faces};
use crate::paper::progressive_mesh::mesh::ProgressiveMesh;
use meshopt::{VertexDataAdapter, build_meshlets};
use rayon::prelude::*;

/// meshoptimizer's weights of a cluster's shape against its number of vertices. The weight with the lowest mean cost is
/// used.
const CONE_WEIGHTS: [f32; 4] = [0.0, 0.25, 0.5, 0.75];

/// The transforms per vertex if the live faces of each of `levels` are clustered for `cache`: a vertex is transformed
/// once for each cluster that uses it. Wedges are vertices.
///
/// # Panics
/// If `cache` is a FIFO, or a level is beyond the mesh's last level.
pub fn clustered_costs(mesh: &ProgressiveMesh, cache: Cache, levels: &[u32]) -> LevelCosts {
    let costs = CONE_WEIGHTS.map(|cone_weight| LevelCosts {
        levels: levels.to_vec(),
        per_vertex: levels.par_iter().map(|&level| clustered(mesh, cache, level, cone_weight)).collect(),
    });
    costs.into_iter().min_by(|a, b| a.mean().total_cmp(&b.mean())).expect("there are weights")
}

fn clustered(mesh: &ProgressiveMesh, cache: Cache, level: u32, cone_weight: f32) -> f64 {
    let triangles = cache.triangles().expect("batches or meshlets") as usize;
    let indices: Vec<u32> = live_faces(mesh, level).into_iter().flatten().collect();
    let positions: &[u8] = bytemuck::cast_slice(&mesh.vertices.positions);
    let positions =
        VertexDataAdapter::new(positions, size_of::<[f32; 3]>(), 0).expect("three floats per vertex");
    let clusters = build_meshlets(&indices, &positions, cache.entries() as usize, triangles, cone_weight);
    let transforms = clusters.iter().map(|cluster| cluster.vertices.len() as u64).sum();
    let mut vertices = indices;
    vertices.sort_unstable();
    vertices.dedup();
    Transforms { transforms, vertices: vertices.len() as u64 }.per_vertex()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::progressive_mesh::baselines::{OrderBaseline, baseline_costs};
    use crate::paper::progressive_mesh::order::{classical, scratch};

    #[test]
    fn clusters_fill_batches_better_than_an_order_for_a_fifo() {
        let model = scratch::torus(32);
        let mesh = classical(&model, &scratch::collapses(&model, 64));
        let levels = [mesh.last_level() / 2, mesh.last_level()];
        for (cache, min) in [(Cache::Batches, 1.5), (Cache::Meshlets, 1.25)] {
            let clusters = clustered_costs(&mesh, cache, &levels).mean();
            let fifo =
                baseline_costs(&mesh, OrderBaseline::ReoptimisedFifo, &[cache], &levels).costs[0].mean();
            assert!(
                min < clusters && clusters < fifo,
                "{cache:?}: {clusters} in clusters, {fifo} in a FIFO's order"
            );
        }
    }
}
