//! The faces of one permutation in numbers of their own, by the slots that they leave.
//!
//! A face's number is its birth, and neighbours are born far apart: a search among faces and vertices in their numbers
//! waits for memory four times a slot, which was half of a dragon's time to write and to read. The slots before the
//! permutation are an order for the vertex cache already, so that numbers by slot stay in the processor's.

use super::live::{Live, NONE};

/// Instead of a search: the face has its place.
const PLACED: u32 = u32::MAX;

/// Slots before a slot whose faces' neighbours are suggested for it.
const WINDOW: usize = 8;

/// Scratch of a permutation; between two of them the tables by slot, face and vertex have [`NONE`] throughout.
#[derive(Default)]
pub(super) struct Moving {
    /// The slots that get another face, ascending, and the faces that stand there first.
    pub slots: Vec<u32>,
    pub faces: Vec<u32>,
    /// For each slot of the mesh, and for each of its faces, the place in these lists.
    pub at_slot: Vec<u32>,
    at_face: Vec<u32>,
    /// The faces' corners in the order of their first use; what these are called, and back.
    corners: Vec<[u32; 3]>,
    vertices: Vec<u32>,
    at_vertex: Vec<u32>,
    /// Vertex n's moving faces are `around[starts[n] .. starts[n + 1]]`, ascending by their true numbers.
    starts: Vec<u32>,
    around: Vec<u32>,
    /// For each face the last search that suggested it, above all of them once it has its place.
    suggested: Vec<u32>,
    /// Searches for a slot's face so far.
    searches: u32,
    /// The corners in slot n stand at n modulo its length, for the last ones before `reached`.
    window: [[u32; 3]; WINDOW],
    reached: u32,
    /// The slot that the face before `reached` came from.
    came_from: u32,
}

impl Moving {
    /// The faces in `slots` are to move.
    pub fn begin(&mut self, live: &Live, slots: Vec<u32>) {
        self.at_slot.resize(live.corners.len(), NONE);
        self.at_face.resize(live.corners.len(), NONE);
        self.at_vertex.resize(live.around.len(), NONE);
        self.faces.clear();
        self.faces.extend(slots.iter().map(|&slot| live.face_at[slot as usize]));
        for (at, (&slot, &face)) in slots.iter().zip(&self.faces).enumerate() {
            self.at_slot[slot as usize] = at as u32;
            self.at_face[face as usize] = at as u32;
        }
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
        self.starts.clear();
        self.around.clear();
        self.starts.push(0);
        for &vertex in &*vertices {
            let faces = live.around.row(vertex as usize).iter().map(|&face| self.at_face[face as usize]);
            self.around.extend(faces.filter(|&at| at != NONE));
            self.starts.push(self.around.len() as u32);
        }
    }

    /// All have moved. Leaves `at_slot` to who used it last.
    pub fn end(&mut self) {
        self.faces.iter().for_each(|&face| self.at_face[face as usize] = NONE);
        self.vertices.drain(..).for_each(|vertex| self.at_vertex[vertex as usize] = NONE);
    }

    /// The next search is for `slot`: the faces since the last one stand where they stood.
    pub fn reach(&mut self, live: &Live, slot: u32) {
        for still in self.reached.max(slot.saturating_sub(WINDOW as u32))..slot {
            let corners = live.corners[live.face_at[still as usize] as usize];
            self.window[still as usize % WINDOW] = corners.map(|vertex| self.at_vertex[vertex as usize]);
            self.came_from = still;
        }
        self.reached = slot;
    }

    /// The slot that was reached gets the face `at`.
    pub fn place(&mut self, at: usize) {
        self.suggested[at] = PLACED;
        self.window[self.reached as usize % WINDOW] = self.corners[at];
        self.came_from = self.slots[at];
        self.reached += 1;
    }

    /// Whether a face has its place already.
    pub fn is_placed(&self, at: usize) -> bool {
        self.suggested[at] == PLACED
    }

    /// Suggests faces for the slot that was reached, likely ones first, none twice, until `enough` says that it needs no
    /// more: the face that followed on that of the slot before; then, for the slots before, the nearest first, the
    /// faces around each corner of theirs. Only faces without a place yet.
    pub fn suggest(&mut self, mut enough: impl FnMut(usize) -> bool) {
        self.searches += 1;
        let (searches, suggested) = (self.searches, &mut self.suggested);
        let mut offer = |at: u32| {
            let last = &mut suggested[at as usize];
            // A face that is placed has a number above all searches.
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
            && offer(at)
        {
            return;
        }
        for before in (self.reached.saturating_sub(WINDOW as u32)..self.reached).rev() {
            for vertex in self.window[before as usize % WINDOW].into_iter().filter(|&vertex| vertex != NONE) {
                let [start, end] = [0, 1].map(|next| self.starts[vertex as usize + next] as usize);
                if self.around[start..end].iter().any(|&at| offer(at)) {
                    return;
                }
            }
        }
    }
}
