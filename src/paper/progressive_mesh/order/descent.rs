//! Takes a model down to level 0 and records what each collapse changes.

use crate::math::ragged::Ragged;
use crate::math::rows::Rows;
use crate::model::Model;
use crate::paper::progressive_mesh::mesh::NOWHERE;
use crate::paper::progressive_mesh::simplify::Collapses;

/// The model's faces and their corners' wedges, on the way down from the full mesh.
pub(super) struct Descent {
    /// Each face with its corners at its first level: the level at which it appears, or level 0.
    pub faces: Vec<[u32; 3]>,
    alive: Vec<bool>,
    /// For each wedge, the faces that had it as a corner at some level, including removed faces.
    around: Rows,
    /// For each removed wedge, in the order of removal, the live faces in which another wedge replaced it.
    pub changed: Ragged<u32>,
}

impl Descent {
    /// # Panics
    /// If `collapses` do not belong to `model`: a face is removed twice, or remains without a vertex.
    pub fn new(model: &Model, collapses: &Collapses) -> Self {
        let mut around = Rows::default();
        around.grow(model.wedge_positions.len());
        for (face, corners) in model.faces.iter().enumerate() {
            corners.iter().for_each(|&wedge| around.push(wedge as usize, face as u32));
        }
        let alive = vec![true; model.faces.len()];
        let mut descent = Self { faces: model.faces.clone(), alive, around, changed: Ragged::default() };
        for collapse in 0..collapses.wedges.len() {
            descent.collapse(collapses, collapse);
        }
        descent
    }

    fn collapse(&mut self, collapses: &Collapses, collapse: usize) {
        for &face in collapses.faces.row(collapse) {
            assert!(std::mem::take(&mut self.alive[face as usize]), "face {face} is removed twice");
        }
        for &[wedge, target] in collapses.wedges.row(collapse) {
            let here = self.around.row(wedge as usize).iter().copied();
            let around: Vec<u32> = here.filter(|&face| self.alive[face as usize]).collect();
            assert!(around.is_empty() || target != NOWHERE, "wedge {wedge} has no target, but live faces");
            for &face in &around {
                let corners = &mut self.faces[face as usize];
                corners.iter_mut().filter(|corner| **corner == wedge).for_each(|corner| *corner = target);
                self.around.push(target as usize, face);
            }
            self.changed.push(around);
        }
    }
}
