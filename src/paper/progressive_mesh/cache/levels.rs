//! The cost of an order at every level of detail. The paper's measure is the mean over all levels, equally
//! weighted (section 2), including the levels between two tswaps.

use super::{Cache, Counter, ProgressiveMesh};
use crate::paper::progressive_mesh::run::{IgnoreWrites, Program, State};
use rayon::prelude::*;

/// Transforms per vertex at some levels of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelCosts {
    /// The levels, ascending.
    pub levels: Vec<u32>,
    /// Transforms per vertex at each of `levels`.
    pub per_vertex: Vec<f64>,
}

impl LevelCosts {
    /// The mean over the levels; NaN without levels.
    pub fn mean(&self) -> f64 {
        self.per_vertex.iter().sum::<f64>() / self.per_vertex.len() as f64
    }

    /// The value that at most this share of the levels exceeds: 0.05 gives the 95th percentile, 0 the worst
    /// level.
    pub fn exceeded_by(&self, share: f64) -> f64 {
        let mut sorted = self.per_vertex.clone();
        sorted.sort_by(f64::total_cmp);
        let exceeding = (share * sorted.len() as f64).floor() as usize;
        sorted.iter().rev().nth(exceeding).copied().unwrap_or(f64::NAN)
    }
}

/// All levels if the mesh has at most `all_up_to` faces, or at most `count` levels. Otherwise `count` levels at equal
/// steps, including the first and the last.
pub fn sampled_levels(mesh: &ProgressiveMesh, all_up_to: usize, count: u32) -> Vec<u32> {
    let last = mesh.last_level();
    if mesh.faces.len() <= all_up_to || last < count {
        return (0..=last).collect();
    }
    (0..count).map(|n| (u64::from(n) * u64::from(last) / u64::from(count - 1)) as u32).collect()
}

/// Transforms per vertex of `mesh` at each of `levels` (ascending), for each of `caches`. Wedges of one
/// position count as one vertex.
///
/// # Panics
/// If a level is beyond the mesh's last level, or the mesh fails [`ProgressiveMesh::check`].
pub fn level_costs(mesh: &ProgressiveMesh, caches: &[Cache], levels: &[u32]) -> Vec<LevelCosts> {
    let program = Program::new(mesh).unwrap_or_else(|flaw| panic!("{flaw}"));
    costs_of(&program, &mesh.vertices.welded, caches, levels)
}

/// As [`level_costs`], for a program. `shared` has the index that represents each vertex.
///
/// # Panics
/// If a level is beyond the program's last level.
pub fn costs_of(program: &Program, shared: &[u32], caches: &[Cache], levels: &[u32]) -> Vec<LevelCosts> {
    // Each part of the levels is reached by a walk up from level 0. The walk is cheap compared with counting,
    // which visits every face of every level.
    let part = levels.len().div_ceil(4 * rayon::current_num_threads()).max(16);
    let costs: Vec<Vec<f64>> = levels
        .par_chunks(part)
        .flat_map_iter(|levels| {
            let mut counters: Vec<Counter> =
                caches.iter().map(|&cache| Counter::new(cache, shared.len())).collect();
            let (mut faces, mut at, mut kept) = (program.faces().to_vec(), 0, Vec::new());
            levels.iter().map(move |&level| {
                program.run(&mut faces, at, level, &mut kept, &mut IgnoreWrites);
                at = level;
                let drawn = &faces[..program.drawn(level) as usize];
                let drawn = || drawn.iter().map(|face| face.map(|vertex| shared[vertex as usize]));
                counters.iter_mut().map(|counter| counter.count(drawn()).per_vertex()).collect()
            })
        })
        .collect();
    let of = |cache| costs.iter().map(|of_level: &Vec<f64>| of_level[cache]).collect();
    (0..caches.len()).map(|cache| LevelCosts { levels: levels.to_vec(), per_vertex: of(cache) }).collect()
}

/// The faces drawn at a level, in order: the live faces, and with births in place also the unborn faces.
///
/// # Panics
/// As [`live_faces`].
pub fn drawn_faces(mesh: &ProgressiveMesh, level: u32) -> Vec<[u32; 3]> {
    let program = Program::new(mesh).unwrap_or_else(|flaw| panic!("{flaw}"));
    let mut faces = program.faces().to_vec();
    program.run(&mut faces, 0, level, &mut Vec::new(), &mut IgnoreWrites);
    faces.truncate(program.drawn(level) as usize);
    faces
}

/// The live faces of a level, in the order that the paper's operations give.
///
/// # Panics
/// If the mesh has no such level, or fails [`ProgressiveMesh::check`].
pub fn live_faces(mesh: &ProgressiveMesh, level: u32) -> Vec<[u32; 3]> {
    let mut state = State::new(mesh);
    state.go_to(mesh, level);
    state.live(mesh).to_vec()
}
