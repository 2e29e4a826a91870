//! Meshes and collapses for tests of the order, independent of our simplifier.

use crate::math::ragged::Ragged;
use crate::model::Model;
use crate::paper::progressive_mesh::simplify::Collapses;
use glam::{DVec2, DVec3};
use std::collections::BTreeSet;

/// A bumpy torus of `side` x `side` quads, two faces each.
pub fn torus(side: u32) -> Model {
    let point = |n: u32| {
        let angles =
            DVec2::new(f64::from(n % side), f64::from(n / side)) * std::f64::consts::TAU / f64::from(side);
        let bump = 0.05 * ((7.0 * angles.x).sin() + (5.0 * angles.y + angles.x).cos());
        let around = DVec3::new(angles.x.cos(), angles.x.sin(), 0.0);
        around * (2.0 + (0.8 + bump) * angles.y.cos()) + DVec3::Z * (0.8 + bump) * angles.y.sin()
    };
    let corner = |x: u32, y: u32| y % side * side + x % side;
    let faces = (0..side * side).map(|quad| (quad % side, quad / side)).flat_map(|(x, y)| {
        let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x, y + 1), corner(x + 1, y + 1)];
        [[a, b, c], [c, b, d]]
    });
    let count = side * side;
    Model {
        positions: (0..count).map(point).collect(),
        wedge_positions: (0..count).collect(),
        faces: faces.collect(),
        ..Model::default()
    }
}

/// `n` faces around vertex 0.
pub fn fan(n: u32) -> Vec<[u32; 3]> {
    (0..n).map(|face| [0, 1 + face, 1 + (face + 1) % n]).collect()
}

/// Executes the cheapest legal collapses until at most `target` faces are left. The cost counts the swept volume and
/// the distance moved.
pub fn collapses(model: &Model, target: usize) -> Collapses {
    let mut mesh = Mesh::new(model);
    let mut collapses = Collapses::default();
    let mut alive = model.faces.len();
    while alive > target {
        let Some((cost, vertex, onto)) = mesh.queue.pop_first() else { break };
        if mesh.legal(vertex, onto) != Some(cost) {
            continue;
        }
        let removed = mesh.collapse(vertex, onto);
        alive -= removed.len();
        let error = collapses.errors.last().copied().unwrap_or(0.0).max(f64::from_bits(cost));
        collapses.errors.push(error);
        collapses.wedges.push([[vertex, onto]]);
        collapses.faces.push(removed);
    }
    collapses
}

struct Mesh<'a> {
    model: &'a Model,
    faces: Vec<[u32; 3]>,
    around: Vec<Vec<u32>>,
    /// Cost as bits, vertex, target vertex. Costs are not negative, so their bits sort like the costs.
    queue: BTreeSet<(u64, u32, u32)>,
}

impl<'a> Mesh<'a> {
    fn new(model: &'a Model) -> Self {
        let mut around = vec![Vec::new(); model.positions.len()];
        for (face, corners) in model.faces.iter().enumerate() {
            corners.iter().for_each(|&vertex| around[vertex as usize].push(face as u32));
        }
        let mut mesh = Self { model, faces: model.faces.clone(), around, queue: BTreeSet::new() };
        (0..model.positions.len() as u32).for_each(|vertex| mesh.ask(vertex));
        mesh
    }

    fn ring(&self, vertex: u32) -> BTreeSet<u32> {
        let faces = self.around[vertex as usize].iter().flat_map(|&face| self.faces[face as usize]);
        faces.filter(|&other| other != vertex).collect()
    }

    fn normal(&self, face: [u32; 3]) -> DVec3 {
        let [a, b, c] = face.map(|vertex| self.model.positions[vertex as usize]);
        (b - a).cross(c - a)
    }

    /// The cost of a collapse; `None` if the collapse would fold the surface or change its topology.
    fn legal(&self, vertex: u32, onto: u32) -> Option<u64> {
        let (ring, other) = (self.ring(vertex), self.ring(onto));
        if !ring.contains(&onto) || ring.intersection(&other).count() != 2 || ring.len() + other.len() < 9 {
            return None;
        }
        let mut cost = 0.0;
        for &face in &self.around[vertex as usize] {
            let corners = self.faces[face as usize];
            if corners.contains(&onto) {
                continue;
            }
            let moved = corners.map(|corner| if corner == vertex { onto } else { corner });
            let (before, after) = (self.normal(corners), self.normal(moved));
            if before.dot(after) < 0.25 * before.length() * after.length() {
                return None;
            }
            let way = self.model.positions[onto as usize] - self.model.positions[vertex as usize];
            cost += before.dot(way).abs() * (1.0 + way.length());
        }
        Some(cost.to_bits())
    }

    fn collapse(&mut self, vertex: u32, onto: u32) -> Vec<u32> {
        let around = std::mem::take(&mut self.around[vertex as usize]);
        let (removed, kept): (Vec<u32>, Vec<u32>) =
            around.into_iter().partition(|&face| self.faces[face as usize].contains(&onto));
        for &face in &removed {
            for corner in self.faces[face as usize].into_iter().filter(|&corner| corner != vertex) {
                self.around[corner as usize].retain(|&other| other != face);
            }
        }
        for &face in &kept {
            let corners = &mut self.faces[face as usize];
            corners.iter_mut().filter(|corner| **corner == vertex).for_each(|corner| *corner = onto);
            self.around[onto as usize].push(face);
        }
        self.ring(onto).into_iter().chain([onto]).for_each(|vertex| self.ask(vertex));
        removed
    }

    fn ask(&mut self, vertex: u32) {
        for onto in self.ring(vertex) {
            self.queue.extend(self.legal(vertex, onto).map(|cost| (cost, vertex, onto)));
            self.queue.extend(self.legal(onto, vertex).map(|cost| (cost, onto, vertex)));
        }
    }
}

#[test]
fn collapses_remove_what_they_say() {
    let model = torus(16);
    let found = collapses(&model, 60);
    assert_eq!(model.faces.len() - found.faces.items().len(), 60);
    assert!(found.faces.rows().all(|row| row.len() == 2) && found.wedges != Ragged::default());
}
