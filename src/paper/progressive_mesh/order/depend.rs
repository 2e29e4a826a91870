//! Which splits must have been executed before which.

use crate::math::ragged::Ragged;
use crate::model::Model;
use crate::paper::progressive_mesh::mesh::NOWHERE;
use crate::paper::progressive_mesh::simplify::Collapses;

/// For each collapse the later ones that must be undone before it can be: those that changed or removed a face
/// around its position or around its target. In every order that respects this each split finds its surroundings
/// as the simplifier saw them, so that no face folds over and the surface stays a manifold at every level.
pub(super) fn dependencies(model: &Model, collapses: &Collapses) -> Ragged<u32> {
    let mut around = vec![Vec::new(); model.positions.len()];
    for face in 0..model.faces.len() {
        model.face_positions(face).iter().for_each(|&position| around[position as usize].push(face as u32));
    }
    let mut touched =
        Touched { last: vec![NOWHERE; model.faces.len()], readers: vec![Vec::new(); model.faces.len()] };
    let mut alive = vec![true; model.faces.len()];
    let mut pairs: Vec<(u32, u32)> = Vec::new();
    for collapse in 0..collapses.wedges.len() {
        let position_of = |wedge: u32| model.wedge_positions[wedge as usize] as usize;
        let id = collapse as u32;
        collapses.faces.row(collapse).iter().for_each(|&face| alive[face as usize] = false);
        collapses.faces.row(collapse).iter().for_each(|&face| touched.write(face, id, &mut pairs));
        for &[wedge, target] in collapses.wedges.row(collapse) {
            let from = std::mem::take(&mut around[position_of(wedge)]);
            let moved = from.into_iter().filter(|&face| alive[face as usize]);
            if target == NOWHERE {
                continue;
            }
            let onto = &mut around[position_of(target)];
            onto.retain(|&face| alive[face as usize]);
            onto.iter().for_each(|&face| touched.read(face, id, &mut pairs));
            for face in moved {
                touched.write(face, id, &mut pairs);
                onto.push(face);
            }
        }
    }
    pairs.sort_unstable();
    pairs.dedup();
    let mut pairs = pairs.into_iter().peekable();
    (0..collapses.wedges.len() as u32)
        .map(|id| {
            std::iter::from_fn(|| pairs.next_if(|pair| pair.0 == id).map(|pair| pair.1)).collect::<Vec<_>>()
        })
        .collect()
}

/// For each face the last collapse that changed it, and those that relied on it since.
struct Touched {
    last: Vec<u32>,
    readers: Vec<Vec<u32>>,
}

impl Touched {
    fn write(&mut self, face: u32, id: u32, pairs: &mut Vec<(u32, u32)>) {
        let last = std::mem::replace(&mut self.last[face as usize], id);
        let readers = std::mem::take(&mut self.readers[face as usize]);
        let before = readers.into_iter().chain([last]);
        pairs.extend(before.filter(|&other| other != NOWHERE && other != id).map(|other| (other, id)));
    }

    fn read(&mut self, face: u32, id: u32, pairs: &mut Vec<(u32, u32)>) {
        let last = self.last[face as usize];
        if last != NOWHERE && last != id {
            pairs.push((last, id));
        }
        self.readers[face as usize].push(id);
    }
}
