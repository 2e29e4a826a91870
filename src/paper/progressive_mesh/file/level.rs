//! One level of the file: its error, its splits, its new faces and its permutation.
//!
//! The code of this module is written once for both directions (see [`super::coder`]). When writing, the values come
//! from `source`, the mesh to write. When reading, `source` is `None`: the values come from the coder, and each value
//! is checked before use.

use super::coder::{Coder, tree};
use super::live::{Live, Marks, RingFace};
use super::models::{Models, Sizes};
use super::moving::Moving;
use crate::paper::progressive_mesh::mesh::{Level, NOWHERE, ProgressiveMesh};

/// Maximum number of suggestions: once a level has this many, further splits add no suggestions. Without this limit, a
/// small file could cause much work: each kept face of a hub can be a suggestion for every split, and costs only a
/// hundredth of a bit.
const ENOUGH_SUGGESTIONS: usize = 1 << 16;

/// Why a payload is invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LevelFault(pub &'static str);

/// The items of a chunk that are still to be coded, as declared by its head.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Left {
    pub vertices: u32,
    pub faces: u32,
    /// Slots whose face changes in permutations.
    pub moved: u32,
}

/// A mesh that grows level by level while it is written or read.
pub(super) struct Growing {
    /// The levels so far.
    pub mesh: ProgressiveMesh,
    pub(super) has: Has,
    pub(super) live: Live,
    pub(super) models: Models,
    pub sizes: Sizes,
    pub(super) moving: Moving,
    /// Scratch memory for the suggestions of a split.
    ends: Marks,
    /// Corners that splits may still replace in this chunk.
    pub(super) room: u64,
}

/// Which attributes the vertices have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Has {
    pub normals: bool,
    pub coordinates: bool,
    pub colors: bool,
}

/// A new vertex, and the vertex that it replaces.
#[derive(Clone, Copy)]
pub(super) struct LevelRow {
    pub new: u32,
    pub split: u32,
}

impl Growing {
    pub(super) fn new(has: Has) -> Self {
        Self {
            mesh: ProgressiveMesh::default(),
            has,
            live: Live::default(),
            models: Models::default(),
            sizes: Sizes::default(),
            moving: Moving::default(),
            ends: Marks::default(),
            room: 0,
        }
    }

    /// Codes the next level. `source` needs the splits up to this level, and its permutation, if it has one.
    pub(super) fn level(
        &mut self,
        coder: &mut impl Coder,
        source: Option<&ProgressiveMesh>,
        left: &mut Left,
    ) -> Result<(), LevelFault> {
        let mut mark = coder.spent_bits();
        let mut spent = |coder: &_, sum: &mut f64| {
            let now = Coder::spent_bits(coder);
            *sum += now - std::mem::replace(&mut mark, now);
        };
        let before = self.mesh.levels.last().copied();
        let level = self.level_counts(coder, source, before, left)?;
        spent(coder, &mut self.sizes.levels);
        let old = before.unwrap_or_default();
        let mut suggestions = Vec::new();
        for new in old.vertices..level.vertices {
            let split =
                if before.is_some() { self.split_vertex(coder, source, old.vertices)? } else { NOWHERE };
            self.live.add_vertex();
            if before.is_some() {
                self.taken_faces(coder, source, LevelRow { new, split }, &mut suggestions)?;
            }
            spent(coder, &mut self.sizes.splits);
            self.position(coder, source, LevelRow { new, split })?;
            spent(coder, &mut self.sizes.positions);
            self.attributes(coder, source, LevelRow { new, split })?;
            spent(coder, &mut self.sizes.attributes);
        }
        suggestions.sort_by_key(|&(doubt, _)| doubt);
        let known = source.map(|_| places(&suggestions));
        for count in 0..level.faces - old.faces {
            let want = source.map(|source| source.faces[self.mesh.faces.len()]);
            self.birth(coder, want.zip(known.as_deref()), &suggestions, count > 0)?;
        }
        spent(coder, &mut self.sizes.faces);
        self.mesh.levels.push(level);
        if before.is_some() {
            self.swaps(coder, source, left)?;
        }
        spent(coder, &mut self.sizes.swaps);
        match coder.is_overrun() {
            true => Err(LevelFault("its payload ends too early")),
            false => Ok(()),
        }
    }

    /// The numbers of new vertices and faces, and the error.
    fn level_counts(
        &mut self,
        coder: &mut impl Coder,
        source: Option<&ProgressiveMesh>,
        before: Option<Level>,
        left: &mut Left,
    ) -> Result<Level, LevelFault> {
        let old = before.unwrap_or(Level { error: f32::MAX, ..Level::default() });
        let want = source.map_or(old, |source| source.levels[self.mesh.levels.len()]);
        let models = &mut self.models;
        let vertices = models.vertices.code(coder, want.vertices - old.vertices);
        let faces = models.faces.code(coder, want.faces - old.faces);
        // Errors are non-negative and never rise, so their bits never rise either.
        let drop = models.error.code(coder, old.error.to_bits() - want.error.to_bits());
        let error = old.error.to_bits().checked_sub(drop).ok_or(LevelFault("an error is negative"))?;
        left.vertices =
            left.vertices.checked_sub(vertices).ok_or(LevelFault("more vertices than declared"))?;
        left.faces = left.faces.checked_sub(faces).ok_or(LevelFault("more faces than declared"))?;
        Ok(Level {
            vertices: old.vertices.checked_add(vertices).ok_or(LevelFault("2^32 vertices"))?,
            faces: old.faces.checked_add(faces).ok_or(LevelFault("2^32 faces"))?,
            error: f32::from_bits(error),
        })
    }

    /// Codes `splitVert` of the next vertex: one of the `old` vertices of the previous level.
    fn split_vertex(
        &mut self,
        coder: &mut impl Coder,
        source: Option<&ProgressiveMesh>,
        old: u32,
    ) -> Result<u32, LevelFault> {
        let want = source.map(|source| source.splits.split_vertices[self.mesh.splits.slots.len()]);
        let models = &mut self.models.splits;
        if coder.bit(&mut models.nowhere, want == Some(NOWHERE)) {
            return Ok(NOWHERE);
        }
        let near = neighbours(&self.live, old);
        let place = want.and_then(|want| near.iter().position(|&vertex| vertex == want));
        if coder.bit(&mut models.near, place.is_some()) {
            let place = models.neighbour.code(coder, place.unwrap_or(0) as u32);
            return near
                .get(place as usize)
                .copied()
                .ok_or(LevelFault("a split names a neighbour that does not exist"));
        }
        let age = models.age.code(coder, old.wrapping_sub(1).wrapping_sub(want.unwrap_or(0)));
        old.checked_sub(1)
            .and_then(|youngest| youngest.checked_sub(age))
            .ok_or(LevelFault("a split names a vertex that does not exist"))
    }

    /// Codes the faces in which the split vertex is replaced, and suggests new faces for the gap.
    fn taken_faces(
        &mut self,
        coder: &mut impl Coder,
        source: Option<&ProgressiveMesh>,
        row: LevelRow,
        suggestions: &mut Vec<(u8, [u32; 3])>,
    ) -> Result<(), LevelFault> {
        let slots = source.map(|source| source.splits.slots.row(self.mesh.splits.slots.len()));
        let ring = if row.split == NOWHERE { Vec::new() } else { self.live.ring(row.split) };
        let (mut changes, mut last) = (0, 2);
        let mut taken = Vec::with_capacity(ring.len());
        for (at, face) in ring.iter().enumerate() {
            let slot = self.live.slot_of[face.face as usize];
            let model = &mut self.models.splits.takes[changes][at.min(7)][last];
            let takes = coder.bit(model, slots.is_some_and(|slots| slots.binary_search(&slot).is_ok()));
            changes = (changes + usize::from(last != 2 && last != usize::from(takes))).min(3);
            last = usize::from(takes);
            taken.push(takes);
        }
        let count = taken.iter().filter(|taken| **taken).count();
        let room = self.room.checked_sub(count as u64);
        self.room = room.ok_or(LevelFault("more corners change than its bytes can hold"))?;
        if self.mesh.splits.slots.items().len() + count > u32::MAX as usize {
            return Err(LevelFault("2^32 corners change"));
        }
        if suggestions.len() < ENOUGH_SUGGESTIONS {
            self.ends.clear(self.live.around.len());
            suggest(&ring, &taken, row, &mut self.ends, suggestions);
        }
        let mut faces: Vec<u32> =
            ring.iter().zip(&taken).filter(|(_, taken)| **taken).map(|(face, _)| face.face).collect();
        let mut slots: Vec<u32> = faces.iter().map(|&face| self.live.slot_of[face as usize]).collect();
        faces.sort_unstable();
        slots.sort_unstable();
        self.mesh.splits.split_vertices.push(row.split);
        self.mesh.splits.slots.push(slots);
        if !faces.is_empty() {
            self.live.replace(row.split, &faces);
        }
        Ok(())
    }

    /// Codes the corners of a new face. `source`: the corners and the result of [`places`] when writing, `None` when
    /// reading. `later` is false for the level's first new face.
    fn birth(
        &mut self,
        coder: &mut impl Coder,
        source: Option<([u32; 3], &[Place])>,
        suggestions: &[(u8, [u32; 3])],
        later: bool,
    ) -> Result<(), LevelFault> {
        let models = &mut self.models.births;
        let found = source.and_then(|(want, places)| {
            let lowest = turned(want);
            let at = places.partition_point(|&(corners, _)| corners < lowest);
            let &(_, place) = places.get(at).filter(|(corners, _)| *corners == lowest)?;
            let [a, b, c] = suggestions[place as usize].1;
            let rotation = [[a, b, c], [b, c, a], [c, a, b]].iter().position(|&corners| corners == want);
            Some((place as usize, rotation.expect("the suggestion has the same corners")))
        });
        let (place, rotation) = found.unwrap_or((suggestions.len(), 0));
        let place = models.place[usize::from(later)].code(coder, place as u32);
        let vertices = self.live.around.len() as u32;
        let corners = match suggestions.get(place as usize) {
            Some(&(_, mut corners)) => {
                // Two coded bits can be 3, which rotates like 0.
                corners.rotate_left(tree(coder, &mut models.rotation, 2, rotation as u32) as usize % 3);
                corners
            }
            None => {
                let mut corner = |at: usize| {
                    let age =
                        models.corner.code(coder, source.map_or(0, |(want, _)| vertices - 1 - want[at]));
                    vertices.checked_sub(1)?.checked_sub(age)
                };
                let corners = [corner(0), corner(1), corner(2)];
                let [Some(a), Some(b), Some(c)] = corners else {
                    return Err(LevelFault("a face has a corner that does not exist"));
                };
                [a, b, c]
            }
        };
        if corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0] {
            return Err(LevelFault("a face has the same corner twice"));
        }
        self.mesh.faces.push(corners);
        self.live.add_face(corners);
        Ok(())
    }
}

/// A face's corners, rotated so that the lowest corner comes first.
fn turned(mut corners: [u32; 3]) -> [u32; 3] {
    let lowest = (0..3).min_by_key(|&at| corners[at]).expect("three corners");
    corners.rotate_left(lowest);
    corners
}

/// The corners of a suggestion, the lowest first, and its index.
type Place = ([u32; 3], u32);

/// The suggestions with their indices, sorted by corners. The split of a hub may suggest tens of thousands of faces,
/// too many for a linear search for each new face.
fn places(suggestions: &[(u8, [u32; 3])]) -> Vec<Place> {
    let numbered = (0..).zip(suggestions);
    let mut places: Vec<_> = numbered.map(|(place, &(_, corners))| (turned(corners), place)).collect();
    places.sort_unstable();
    places
}

/// The newest vertex and the vertices around it, without vertices beyond the first `old` vertices. Each vertex is
/// listed once, in the order of the newest vertex's faces.
fn neighbours(live: &Live, old: u32) -> Vec<u32> {
    let Some(newest) = live.around.len().checked_sub(1) else { return Vec::new() };
    let mut near = Vec::new();
    for &face in live.around.row(newest) {
        for vertex in live.corners[face as usize] {
            if vertex < old && !near.contains(&vertex) {
                near.push(vertex);
            }
        }
        // A hub with thousands of faces is not a useful neighbourhood.
        if near.len() >= 32 {
            break;
        }
    }
    near
}

/// Suggests faces that close the gap between the taken faces (in which the new vertex t replaces the split vertex s)
/// and the kept faces. The suggested faces have the corners s and t. The number of a suggestion orders the suggestions,
/// most likely first: 0 if taken and kept faces border the gap, 1 if only taken faces do, 2 if only kept faces do.
fn suggest(
    ring: &[RingFace],
    taken: &[bool],
    LevelRow { new, split }: LevelRow,
    ends: &mut Marks,
    suggestions: &mut Vec<(u8, [u32; 3])>,
) {
    const KEPT_FIRST: u32 = 1;
    const TAKEN_FIRST: u32 = 2;
    const KEPT_SECOND: u32 = 4;
    const TAKEN_SECOND: u32 = 8;
    for (face, &taken) in ring.iter().zip(taken) {
        let [first, second] = if taken { [TAKEN_FIRST, TAKEN_SECOND] } else { [KEPT_FIRST, KEPT_SECOND] };
        for (vertex, end) in [(face.first, first), (face.second, second)] {
            ends.set(vertex, ends.get(vertex).unwrap_or(0) | end);
        }
    }
    let has = |end: u32, vertex: u32| ends.get(vertex).unwrap_or(0) & end != 0;
    for (face, &taken) in ring.iter().zip(taken) {
        let (a, b) = (face.first, face.second);
        match taken {
            true => {
                if !has(TAKEN_SECOND, a) {
                    suggestions.push((u8::from(!has(KEPT_SECOND, a)), [split, a, new]));
                }
                if !has(TAKEN_FIRST, b) {
                    suggestions.push((u8::from(!has(KEPT_FIRST, b)), [new, b, split]));
                }
            }
            false => {
                if !has(KEPT_SECOND, a) && !has(TAKEN_SECOND, a) {
                    suggestions.push((2, [new, a, split]));
                }
                if !has(KEPT_FIRST, b) && !has(TAKEN_FIRST, b) {
                    suggestions.push((2, [split, b, new]));
                }
            }
        }
    }
}
