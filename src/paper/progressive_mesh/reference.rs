//! A level of detail, built afresh from the model and its collapses, as section 3 says it: the truth for every buffer
//! that the run-time part holds.

use super::simplify::{Collapses, NOWHERE};
use crate::model::Model;
use std::collections::BTreeSet;

/// The faces of a level, in wedges of the model, in the model's order: the full mesh, and `ecol` from the last level down
/// to this one.
///
/// # Panics
/// If there is no such level, or the collapses contradict themselves: a face that vanishes twice, or a wedge that vanishes
/// while a face shows it.
pub fn faces_at(model: &Model, collapses: &Collapses, level: u32) -> Vec<[u32; 3]> {
    let levels = collapses.errors.len();
    assert!(level as usize <= levels, "level {level} of {levels}");
    let mut faces: Vec<Option<[u32; 3]>> = model.faces.iter().copied().map(Some).collect();
    for collapse in 0..levels - level as usize {
        for &face in collapses.faces.row(collapse) {
            let gone = faces[face as usize].take();
            assert!(gone.is_some(), "collapse {collapse} removes face {face} a second time");
        }
        for &[old, new] in collapses.wedges.row(collapse) {
            for corner in faces.iter_mut().flatten().flatten() {
                if *corner == old {
                    assert!(new != NOWHERE, "collapse {collapse}: a face that stays shows wedge {old}");
                    *corner = new;
                }
            }
        }
    }
    faces.into_iter().flatten().collect()
}

/// The wedges that are left at a level: all but those of the collapses above it.
///
/// # Panics
/// If there is no such level.
pub fn wedges_at(model: &Model, collapses: &Collapses, level: u32) -> BTreeSet<u32> {
    let above = collapses.errors.len() - level as usize;
    let gone: BTreeSet<u32> =
        (0..above).flat_map(|collapse| collapses.wedges.row(collapse)).map(|&[old, _]| old).collect();
    (0..model.wedge_positions.len() as u32).filter(|wedge| !gone.contains(wedge)).collect()
}

/// Faces as a set with orientation: each begins at its least corner, of which it has one, and all are sorted.
pub fn face_set<T: Ord + Clone>(faces: impl IntoIterator<Item = [T; 3]>) -> Vec<[T; 3]> {
    let turned = |mut face: [T; 3]| {
        let least = (0..3).min_by(|&a, &b| face[a].cmp(&face[b])).expect("three corners");
        face.rotate_left(least);
        face
    };
    let mut set: Vec<_> = faces.into_iter().map(turned).collect();
    set.sort_unstable();
    set
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_of_faces_knows_orientation_and_neither_first_corner_nor_order() {
        let set = |faces: &[[u32; 3]]| face_set(faces.iter().copied());
        assert_eq!(set(&[[2, 0, 1], [3, 1, 0]]), set(&[[0, 3, 1], [0, 1, 2]]));
        assert_ne!(set(&[[0, 1, 2]]), set(&[[0, 2, 1]]));
        assert_ne!(set(&[[0, 1, 2]]), set(&[[0, 1, 2], [0, 1, 2]]));
    }
}
