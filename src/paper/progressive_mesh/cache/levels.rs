//! What an order costs at every level of detail: the paper's criterion is the mean over all levels, all equally
//! likely (section 2), the levels between two tswaps included.

use super::{Cache, Counter, ProgressiveMesh};
use crate::paper::progressive_mesh::mesh::NOWHERE;
use rayon::prelude::*;

/// Transforms per vertex at some levels of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelCosts {
    /// Ascending.
    pub levels: Vec<u32>,
    /// For each of `levels`.
    pub per_vertex: Vec<f64>,
}

impl LevelCosts {
    /// The mean over the levels; NaN for none.
    pub fn mean(&self) -> f64 {
        self.per_vertex.iter().sum::<f64>() / self.per_vertex.len() as f64
    }

    /// The value that at most `share` of the levels exceed: 0.05 for the 95th percentile, 0 for the worst level.
    pub fn exceeded_by(&self, share: f64) -> f64 {
        let mut sorted = self.per_vertex.clone();
        sorted.sort_by(f64::total_cmp);
        let exceeding = (share * sorted.len() as f64).floor() as usize;
        sorted.iter().rev().nth(exceeding).copied().unwrap_or(f64::NAN)
    }
}

/// All levels of a mesh of at most `all_up_to` faces; else `count` levels at equal steps, first and last included.
pub fn sampled_levels(mesh: &ProgressiveMesh, all_up_to: usize, count: u32) -> Vec<u32> {
    let last = mesh.last_level();
    if mesh.faces.len() <= all_up_to || last < count {
        return (0..=last).collect();
    }
    (0..count).map(|n| (u64::from(n) * u64::from(last) / u64::from(count - 1)) as u32).collect()
}

/// Transforms per vertex of `mesh` at each of `levels` (ascending), counted by each of `caches`, with wedges of one
/// position as one vertex.
///
/// # Panics
/// If a level is beyond the mesh's last.
pub fn level_costs(mesh: &ProgressiveMesh, caches: &[Cache], levels: &[u32]) -> Vec<LevelCosts> {
    // Each part walks up from level 0: little beside the counting, which visits every face of every level.
    let part = levels.len().div_ceil(4 * rayon::current_num_threads()).max(16);
    let costs: Vec<Vec<f64>> = levels
        .par_chunks(part)
        .flat_map_iter(|levels| {
            let mut counters: Vec<Counter> =
                caches.iter().map(|&cache| Counter::new(cache, mesh.vertices.welded.len())).collect();
            let mut climb = Climb::new(mesh);
            let welded = &mesh.vertices.welded;
            levels.iter().map(move |&level| {
                let live = climb.to(level);
                let faces = || live.iter().map(|face| face.map(|vertex| welded[vertex as usize]));
                counters.iter_mut().map(|counter| counter.count(faces()).per_vertex()).collect()
            })
        })
        .collect();
    let of = |cache| costs.iter().map(|of_level: &Vec<f64>| of_level[cache]).collect();
    (0..caches.len()).map(|cache| LevelCosts { levels: levels.to_vec(), per_vertex: of(cache) }).collect()
}

/// The live faces of a level in their order, as vertices.
///
/// # Panics
/// If the mesh has no such level.
pub fn live_faces(mesh: &ProgressiveMesh, level: u32) -> Vec<[u32; 3]> {
    Climb::new(mesh).to(level).to_vec()
}

/// A mesh's faces on the way up.
struct Climb<'a> {
    mesh: &'a ProgressiveMesh,
    faces: Vec<[u32; 3]>,
    level: u32,
    /// How many of the mesh's tswaps have been executed.
    swaps: usize,
}

impl<'a> Climb<'a> {
    fn new(mesh: &'a ProgressiveMesh) -> Self {
        let mut climb = Self { mesh, faces: mesh.faces.clone(), level: 0, swaps: 0 };
        climb.swap();
        climb
    }

    /// The live faces of `level`, which is not below the last one asked for.
    fn to(&mut self, level: u32) -> &[[u32; 3]] {
        while self.level < level {
            self.split();
            self.level += 1;
            self.swap();
        }
        &self.faces[..self.mesh.levels[level as usize].faces as usize]
    }

    fn split(&mut self) {
        let base = self.mesh.levels[0].vertices;
        let [from, to] = [0, 1].map(|above| self.mesh.levels[(self.level + above) as usize].vertices);
        for vertex in from..to {
            let row = (vertex - base) as usize;
            let split = self.mesh.splits.split_vertices[row];
            for &slot in self.mesh.splits.slots.row(row) {
                assert_ne!(split, NOWHERE, "vertex {vertex} replaces nothing, but in a face");
                for corner in self.faces[slot as usize].iter_mut().filter(|corner| **corner == split) {
                    *corner = vertex;
                }
            }
        }
    }

    fn swap(&mut self) {
        let swaps = &self.mesh.swaps;
        while swaps.levels.get(self.swaps) == Some(&self.level) {
            for cycle in swaps.cycles_of(self.swaps) {
                for pair in swaps.cycles.row(cycle).windows(2) {
                    self.faces.swap(pair[0] as usize, pair[1] as usize);
                }
            }
            self.swaps += 1;
        }
    }
}
