//! The reference for all buffers of the run-time part: a level of detail, built from scratch from the model
//! and its collapses as in section 3.

use super::mesh::ProgressiveMesh;
use super::run::State;
use super::simplify::{Collapses, NOWHERE};
use crate::model::Model;
use std::collections::BTreeSet;

/// The faces of a level, as wedges of the model in the model's order: the full mesh after `ecol` from the
/// last level down to this one.
///
/// # Panics
/// If there is no such level, or the collapses are inconsistent: a face is removed twice, or a wedge is
/// removed while a face uses it.
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
                    assert!(new != NOWHERE, "collapse {collapse}: a remaining face uses wedge {old}");
                    *corner = new;
                }
            }
        }
    }
    faces.into_iter().flatten().collect()
}

/// The index buffer of a level of `mesh` with births in place. It has the faces of the next permutation's level. Each
/// vertex that is not live at `level` is replaced by its predecessor, repeatedly, until it is live.
///
/// # Panics
/// If there is no such level.
pub fn drawn_in_place(mesh: &ProgressiveMesh, level: u32) -> Vec<[u32; 3]> {
    let last = mesh.levels.len() as u32 - 1;
    let next = mesh.swaps.levels.iter().copied().find(|&swap| swap > level).unwrap_or(last);
    let mut state = State::new(mesh);
    state.go_to(mesh, next);
    let live = mesh.levels[level as usize].vertices;
    let shown = |vertex: u32| {
        let mut shown = vertex;
        while shown >= live.max(1) {
            let brought_by = mesh.levels.iter().position(|level| shown < level.vertices).expect("a level");
            let brought = mesh.levels[brought_by - 1].vertices..mesh.levels[brought_by].vertices;
            let split = |vertex: u32| mesh.splits.split_vertices[(vertex - mesh.levels[0].vertices) as usize];
            let own = [split(shown)].into_iter().chain(brought.map(split)).find(|&split| split != NOWHERE);
            shown = own.unwrap_or(0);
        }
        shown
    };
    state.live(mesh).iter().map(|face| face.map(shown)).collect()
}

/// The wedges of a level: all except those removed by the collapses above it.
///
/// # Panics
/// If there is no such level.
pub fn wedges_at(model: &Model, collapses: &Collapses, level: u32) -> BTreeSet<u32> {
    let above = collapses.errors.len() - level as usize;
    let gone: BTreeSet<u32> =
        (0..above).flat_map(|collapse| collapses.wedges.row(collapse)).map(|&[old, _]| old).collect();
    (0..model.wedge_positions.len() as u32).filter(|wedge| !gone.contains(wedge)).collect()
}

/// Faces as an oriented set: each is rotated so that its smallest corner comes first, and the faces are
/// sorted.
pub fn face_set<T: Ord + Clone>(faces: impl IntoIterator<Item = [T; 3]>) -> Vec<[T; 3]> {
    let turned = |mut face: [T; 3]| {
        let min = (0..3).min_by(|&a, &b| face[a].cmp(&face[b])).expect("three corners");
        face.rotate_left(min);
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
    fn a_set_of_faces_depends_on_orientation_but_not_on_first_corner_or_order() {
        let set = |faces: &[[u32; 3]]| face_set(faces.iter().copied());
        assert_eq!(set(&[[2, 0, 1], [3, 1, 0]]), set(&[[0, 3, 1], [0, 1, 2]]));
        assert_ne!(set(&[[0, 1, 2]]), set(&[[0, 2, 1]]));
        assert_ne!(set(&[[0, 1, 2]]), set(&[[0, 1, 2], [0, 1, 2]]));
    }
}
