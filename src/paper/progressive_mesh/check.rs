//! Checks that a progressive mesh can be executed. This happens once, after loading a file, so that execution
//! needs no checks.
//!
//! All levels are executed on a copy of the index buffer as in the paper, and every index is checked before
//! use. The check takes at most a second for 870,000 faces with 20 moved faces per split.

use super::mesh::{Births, Level, NOWHERE, ProgressiveMesh};

/// Why a progressive mesh cannot be executed: the place and the fault.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {what}")]
pub struct MeshFlaw {
    place: String,
    what: String,
}

fn flaw<T>(place: impl Into<String>, what: impl Into<String>) -> Result<T, MeshFlaw> {
    Err(MeshFlaw { place: place.into(), what: what.into() })
}

/// Returns a flaw unless `condition` holds.
macro_rules! hold {
    ($condition:expr, $place:expr, $($what:tt)+) => {
        if !$condition {
            return flaw($place, format!($($what)+));
        }
    };
}

/// A corner that a split writes: (word of the index buffer, new vertex, replaced vertex).
pub(super) type FaceCorner = (u32, u32, u32);

impl ProgressiveMesh {
    /// Checks that every level can be reached. Levels grow, and every slot and vertex is in range and live when used. A
    /// split's slots contain its `splitVert`. Welded vertices have equal positions. The cycles of a permutation share
    /// no slot, and splits and cycles are in the normal form of [`super::mesh`]. All faces have three different live
    /// vertices. With births in place, no face has an area before the level at which it appears.
    ///
    /// # Errors
    /// The first flaw, in one line.
    pub fn check(&self) -> Result<(), MeshFlaw> {
        self.walk(|_| ())
    }

    /// As [`ProgressiveMesh::check`]. Also calls `meet` with every corner that the splits write, in order.
    pub(super) fn walk(&self, mut meet: impl FnMut(FaceCorner)) -> Result<(), MeshFlaw> {
        self.check_sizes()?;
        self.check_vertices()?;
        let mut faces = self.faces.clone();
        let mut permutation = 0;
        // For each slot the last permutation that moved it, counted from 1.
        let mut seen = vec![0u32; faces.len()];
        self.check_new_faces(0, 0, &faces)?;
        for level in 1..self.levels.len() {
            self.check_new_faces(level, self.levels[level - 1].faces, &faces)?;
            self.split(level, &mut faces, &mut meet)?;
            if self.swaps.levels.get(permutation) == Some(&(level as u32)) {
                self.permute(permutation, self.levels[level], &mut faces, &mut seen)?;
                permutation += 1;
            }
        }
        let beyond = self.swaps.levels.get(permutation);
        hold!(beyond.is_none(), "swaps", "levels are not ascending from 1 to the last: {beyond:?}");
        match self.births {
            Births::Tail => Ok(()),
            Births::InPlace => self.check_births(),
        }
    }

    /// Checks births in place: one level before a face appears, two of its corners must be at one position. Wedges of
    /// one position must have predecessors at one position.
    fn check_births(&self) -> Result<(), MeshFlaw> {
        let (predecessors, welded) = (self.predecessors(), &self.vertices.welded);
        let before = |vertex: u32| welded[predecessors[vertex as usize] as usize];
        let first = self.levels[0].vertices;
        for (vertex, &other) in
            (0..).zip(welded).skip(first as usize).filter(|&(vertex, &other)| vertex != other)
        {
            let together = other >= first && before(vertex) == before(other);
            hold!(
                together,
                format!("vertex {vertex}"),
                "it and {other} share a position, but their predecessors do not"
            );
        }
        for (level, pair) in (1..).zip(self.levels.windows(2)) {
            for face in pair[0].faces..pair[1].faces {
                let shown = |vertex: u32| {
                    if vertex < pair[0].vertices { welded[vertex as usize] } else { before(vertex) }
                };
                let [a, b, c] = self.faces[face as usize].map(shown);
                let place = || format!("level {level}, face {face}");
                hold!(a == b || b == c || c == a, place(), "it has an area before its level");
            }
        }
        Ok(())
    }

    fn check_sizes(&self) -> Result<(), MeshFlaw> {
        let (Some(first), Some(last)) = (self.levels.first(), self.levels.last()) else {
            return flaw("levels", "the list is empty");
        };
        let (vertices, faces) = (self.vertices.positions.len(), self.faces.len());
        hold!(last.vertices as usize == vertices, "last level", "{} vertices of {vertices}", last.vertices);
        hold!(last.faces as usize == faces, "last level", "{} faces of {faces}", last.faces);
        hold!(faces <= u32::MAX as usize / 3, "faces", "{faces}: their corners need more than 32 bits");
        for (level, pair) in self.levels.windows(2).enumerate() {
            let grow = pair[0].vertices <= pair[1].vertices && pair[0].faces <= pair[1].faces;
            hold!(grow, format!("level {}", level + 1), "fewer vertices or faces than the level before");
            let falls = pair[0].error >= pair[1].error;
            hold!(falls, format!("level {}", level + 1), "error {} after {}", pair[1].error, pair[0].error);
        }
        let errors = last.error >= 0.0 && first.error.is_finite();
        hold!(errors, "levels", "errors from {} to {}", first.error, last.error);
        let new = (last.vertices - first.vertices) as usize;
        let (targets, rows) = (self.splits.split_vertices.len(), self.splits.slots.len());
        hold!(
            targets == new && rows == new,
            "splits",
            "{targets} targets and {rows} rows for {new} vertices"
        );
        let ends = &self.swaps.cycle_ends;
        let carried = self.swaps.levels.len();
        hold!(ends.len() == carried, "swaps", "{} ends of cycles for {carried} levels", ends.len());
        hold!(ends.is_sorted(), "swaps", "the ends of their cycles are not ascending");
        let (end, cycles) = (ends.last().map_or(0, |&end| end as usize), self.swaps.cycles.len());
        hold!(end == cycles, "swaps", "{cycles} cycles, but levels have {end}");
        Ok(())
    }

    fn check_vertices(&self) -> Result<(), MeshFlaw> {
        let vertices = &self.vertices;
        let count = vertices.positions.len();
        let attributes = &vertices.attributes;
        let lists = [attributes.normals.len(), attributes.coordinates.len(), attributes.colors.len()];
        let whole = vertices.welded.len() == count && lists.iter().all(|&len| len == 0 || len == count);
        hold!(whole, "vertices", "{count} positions, {} welded, {lists:?} attributes", vertices.welded.len());
        hold!(vertices.centre.is_finite(), "centre", "{}", vertices.centre);
        for (vertex, (position, &welded)) in vertices.positions.iter().zip(&vertices.welded).enumerate() {
            let place = || format!("vertex {vertex}");
            hold!(position.iter().all(|x| x.is_finite()), place(), "position {position:?}");
            let first = welded as usize <= vertex && vertices.welded[welded as usize] == welded;
            hold!(first, place(), "welded to {welded}, which is not the first vertex at its position");
            let there = vertices.positions[welded as usize];
            hold!(*position == there, place(), "at {position:?}, welded to {welded} at {there:?}");
        }
        Ok(())
    }

    /// Checks the faces from slot `before` on, which appear at `level`.
    fn check_new_faces(&self, level: usize, before: u32, faces: &[[u32; 3]]) -> Result<(), MeshFlaw> {
        let Level { vertices, faces: after, .. } = self.levels[level];
        for (slot, &[a, b, c]) in (before..after).zip(&faces[before as usize..after as usize]) {
            let live = [a, b, c].iter().all(|&vertex| vertex < vertices);
            hold!(live, format!("level {level}, face {slot}"), "[{a}, {b}, {c}] of {vertices} live vertices");
            let three = a != b && b != c && c != a;
            hold!(three, format!("level {level}, face {slot}"), "[{a}, {b}, {c}] is not a triangle");
        }
        Ok(())
    }

    /// Executes the splits of `level`: writes each new vertex into its faces.
    fn split(
        &self,
        level: usize,
        faces: &mut [[u32; 3]],
        meet: &mut impl FnMut(FaceCorner),
    ) -> Result<(), MeshFlaw> {
        let (before, after, base) =
            (self.levels[level - 1], self.levels[level].vertices, self.levels[0].vertices);
        for vertex in before.vertices..after {
            let index = (vertex - base) as usize;
            let (target, slots) = (self.splits.split_vertices[index], self.splits.slots.row(index));
            let place = || format!("level {level}, vertex {vertex}");
            let live = target < before.vertices || (target == NOWHERE && slots.is_empty());
            hold!(
                live,
                place(),
                "splits {target} in {} faces, of {} live vertices",
                slots.len(),
                before.vertices
            );
            hold!(slots.is_sorted(), place(), "its slots are not ascending");
            for &slot in slots {
                hold!(slot < before.faces, place(), "slot {slot} of {} live faces", before.faces);
                let face = &mut faces[slot as usize];
                let Some(corner) = face.iter().position(|&corner| corner == target) else {
                    return flaw(place(), format!("slot {slot} has {face:?}, without {target}"));
                };
                face[corner] = vertex;
                meet((3 * slot + corner as u32, vertex, target));
            }
        }
        Ok(())
    }

    /// Executes permutation `index`. `seen` holds for each slot the last permutation that moved it, counted
    /// from 1.
    fn permute(
        &self,
        index: usize,
        live: Level,
        faces: &mut [[u32; 3]],
        seen: &mut [u32],
    ) -> Result<(), MeshFlaw> {
        let place = || format!("permutation of level {}", self.swaps.levels[index]);
        let mut min = None;
        for cycle in self.swaps.cycles_of(index) {
            let slots = self.swaps.cycles.row(cycle);
            hold!(slots.len() >= 2, place(), "a cycle of {} slots", slots.len());
            for &slot in slots {
                hold!(slot < live.faces, place(), "slot {slot} of {} live faces", live.faces);
                let last = std::mem::replace(&mut seen[slot as usize], index as u32 + 1);
                hold!(last <= index as u32, place(), "slot {slot} is in two cycles");
            }
            let ascending = min.replace(slots[0]).is_none_or(|before| before < slots[0]);
            let spelt = ascending && slots.iter().min() == Some(&slots[0]);
            hold!(
                spelt,
                place(),
                "a cycle from slot {}: each must begin with its lowest slot, and these must ascend",
                slots[0]
            );
            super::run::tswap(faces, slots);
        }
        Ok(())
    }
}
