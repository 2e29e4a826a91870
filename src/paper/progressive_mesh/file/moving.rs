//! The faces of one permutation, renumbered by their slots before the permutation.
//!
//! The original number of a face is its slot at birth, and neighbours are born far apart. A search by
//! original numbers misses the CPU cache four times per slot; these misses took half the time to write or read
//! the dragon. Before the permutation the slots are already in vertex-cache order, so a search by slots stays in
//! the CPU cache.

use super::live::{Live, NONE};

/// The number that replaces a face's search number once the face is placed.
const PLACED: u32 = u32::MAX;

/// A face is suggested for a slot if it shares a vertex with a face in one of this many slots before it.
const WINDOW: usize = 8;

/// Scratch memory of a permutation. Between permutations the tables by slot and vertex hold [`NONE`].
#[derive(Default)]
pub(super) struct Moving {
    /// The slots that get another face, ascending, and their faces before the permutation.
    pub slots: Vec<u32>,
    pub faces: Vec<u32>,
    /// For each slot of the mesh, its index in `slots`.
    pub at_slot: Vec<u32>,
    /// The corners of the moving faces, as indices into `vertices`.
    corners: Vec<[u32; 3]>,
    /// The vertices of the moving faces, in order of first use.
    vertices: Vec<u32>,
    /// For each vertex of the mesh, its index in `vertices`.
    at_vertex: Vec<u32>,
    /// Vertex n's moving faces are `around[starts[n] .. ends[n]]`, ascending by their original numbers. A
    /// search removes the placed faces that it meets, so that later searches around a hub do not visit them
    /// again.
    starts: Vec<u32>,
    ends: Vec<u32>,
    around: Vec<u32>,
    /// For each face the last search that suggested it; [`PLACED`] once the face is placed.
    suggested: Vec<u32>,
    /// Number of searches so far.
    searches: u32,
    /// Ring buffer of the corners in the last slots before `reached`: those in slot n are at index n modulo
    /// [`WINDOW`].
    window: [[u32; 3]; WINDOW],
    reached: u32,
    /// The former slot of the face that is now in slot `reached - 1`.
    came_from: u32,
}

impl Moving {
    /// Starts a permutation of the faces in `slots`.
    pub fn begin(&mut self, live: &Live, slots: Vec<u32>) {
        self.at_slot.resize(live.corners.len(), NONE);
        self.at_vertex.resize(live.around.len(), NONE);
        self.faces.clear();
        self.faces.extend(slots.iter().map(|&slot| live.face_at[slot as usize]));
        slots.iter().zip(0..).for_each(|(&slot, at)| self.at_slot[slot as usize] = at);
        self.suggested.clear();
        self.suggested.resize(slots.len(), 0);
        (self.slots, self.searches, self.reached) = (slots, 0, 0);
        self.number(live);
    }

    fn number(&mut self, live: &Live) {
        let (vertices, at_vertex) = (&mut self.vertices, &mut self.at_vertex);
        self.corners.clear();
        self.corners.extend(self.faces.iter().map(|&face| {
            live.corners[face as usize].map(|vertex| {
                let at = &mut at_vertex[vertex as usize];
                if *at == NONE {
                    *at = vertices.len() as u32;
                    vertices.push(vertex);
                }
                *at
            })
        }));
        self.list_faces();
    }

    /// Lists the moving faces of each vertex. It visits no other faces, so two moving faces of a hub with thousands of
    /// faces cause little work.
    fn list_faces(&mut self) {
        let Moving { faces, corners, vertices, starts, ends, around, .. } = self;
        ends.clear();
        ends.resize(vertices.len(), 0);
        corners.as_flattened().iter().for_each(|&vertex| ends[vertex as usize] += 1);
        starts.clear();
        let mut sum = 0;
        for end in ends.iter_mut() {
            starts.push(sum);
            sum += std::mem::replace(end, sum);
        }
        around.clear();
        around.resize(sum as usize, 0);
        for (corners, at) in corners.iter().zip(0..) {
            for &vertex in corners {
                let end = &mut ends[vertex as usize];
                around[*end as usize] = at;
                *end += 1;
            }
        }
        for (&start, &end) in starts.iter().zip(&*ends) {
            around[start as usize..end as usize].sort_unstable_by_key(|&at| faces[at as usize]);
        }
    }

    /// Ends the permutation. The caller resets `at_slot`.
    pub fn end(&mut self) {
        self.vertices.drain(..).for_each(|vertex| self.at_vertex[vertex as usize] = NONE);
    }

    /// Moves the next search to `slot`. The faces between the slot of the previous search and this slot keep their
    /// slots.
    pub fn reach(&mut self, live: &Live, slot: u32) {
        for still in self.reached.max(slot.saturating_sub(WINDOW as u32))..slot {
            let corners = live.corners[live.face_at[still as usize] as usize];
            self.window[still as usize % WINDOW] = corners.map(|vertex| self.at_vertex[vertex as usize]);
            self.came_from = still;
        }
        self.reached = slot;
    }

    /// Places face `at` into the reached slot.
    pub fn place(&mut self, at: usize) {
        self.suggested[at] = PLACED;
        self.window[self.reached as usize % WINDOW] = self.corners[at];
        self.came_from = self.slots[at];
        self.reached += 1;
    }

    /// True if a face is placed.
    pub fn is_placed(&self, at: usize) -> bool {
        self.suggested[at] == PLACED
    }

    /// Suggests unplaced faces for the reached slot, each once, likely ones first, until `enough` returns true. First
    /// comes the face that followed the previous slot's face before the permutation. Then come the faces around each
    /// corner of the faces in the [`WINDOW`] slots before the reached slot, nearest slot first.
    pub fn suggest(&mut self, mut enough: impl FnMut(usize) -> bool) {
        self.searches += 1;
        let (searches, suggested) = (self.searches, &mut self.suggested);
        // [`PLACED`] is above all search numbers.
        let mut offer = |suggested: &mut [u32], at: u32| {
            let last = &mut suggested[at as usize];
            let is_new = *last < searches;
            if is_new {
                *last = searches;
            }
            is_new && enough(at as usize)
        };
        if self.reached == 0 {
            return;
        }
        if let Some(&at) = self.at_slot.get(self.came_from as usize + 1).filter(|&&at| at != NONE)
            && offer(suggested, at)
        {
            return;
        }
        for before in (self.reached.saturating_sub(WINDOW as u32)..self.reached).rev() {
            for vertex in self.window[before as usize % WINDOW].into_iter().filter(|&vertex| vertex != NONE) {
                let start = &mut self.starts[vertex as usize];
                for place in *start as usize..self.ends[vertex as usize] as usize {
                    let at = self.around[place];
                    if suggested[at as usize] == PLACED {
                        // Shifts only the faces that this search has already offered.
                        self.around.copy_within(*start as usize..place, *start as usize + 1);
                        *start += 1;
                    } else if offer(suggested, at) {
                        return;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vertex_has_its_moving_faces_in_ascending_order_if_few_or_all_move() {
        let (count, mut live) = (400, Live::default());
        (0..=2 * count).for_each(|_| live.add_vertex());
        // A hub around vertex 0, whose faces' slots differ from their numbers.
        (0..count).for_each(|face| live.add_face([2 * face + 1, 0, (2 * face + 4) % (2 * count) + 1]));
        live.face_at.rotate_left(150);
        let mut moving = Moving::default();
        for slots in [vec![7, 8, 251, 300], (0..count).collect::<Vec<u32>>()] {
            moving.begin(&live, slots);
            for (at, &vertex) in moving.vertices.iter().enumerate() {
                let found = &moving.around[moving.starts[at] as usize..moving.ends[at] as usize];
                let faces: Vec<u32> = found.iter().map(|&at| moving.faces[at as usize]).collect();
                let row = live.around.row(vertex as usize).iter().copied();
                assert!(row.filter(|face| moving.faces.contains(face)).eq(faces));
            }
            moving.end();
        }
    }

    #[test]
    fn placed_faces_are_visited_once_and_the_others_stay_in_order() {
        let mut live = Live::default();
        (0..12).for_each(|_| live.add_vertex());
        (0..10).for_each(|face| live.add_face([0, face + 1, face + 2]));
        let mut moving = Moving::default();
        moving.begin(&live, (0..10).collect());
        let suggested = |moving: &mut Moving, max: usize| {
            let mut found = Vec::new();
            moving.suggest(|at| {
                found.push(at);
                found.len() == max
            });
            found
        };
        moving.place(4);
        assert_eq!(suggested(&mut moving, 4), [5, 0, 1, 2], "the following face, then those around vertex 0");
        moving.place(1);
        moving.place(6);
        assert_eq!(suggested(&mut moving, 3), [7, 0, 2]);
        assert_eq!(suggested(&mut moving, 9), [7, 0, 2, 3, 5, 8, 9]);
        let hub = moving.corners[0][0] as usize;
        assert_eq!(moving.ends[hub] - moving.starts[hub], 7);
    }
}
