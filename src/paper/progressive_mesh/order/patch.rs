//! A part of a mesh that is reordered, with its own vertex numbers.

/// At most this many faces of a vertex are compared for a place: otherwise a fan around one vertex takes quadratic
/// time. Rollouts do not look around a vertex with more. Scans have up to 30 faces at a vertex.
pub(super) const MAX_FACES: u32 = 256;

/// Faces with compact vertex numbers, and the faces around each vertex.
pub(super) struct Patch {
    pub faces: Vec<[u32; 3]>,
    pub vertices: usize,
    /// Vertex v's faces are `around[starts[v] .. starts[v + 1]]`.
    pub starts: Vec<u32>,
    pub around: Vec<u32>,
}

/// Assigns compact vertex numbers for one patch after another. Its cost depends on the patch, not on the
/// mesh.
pub(super) struct Numbering {
    local: Vec<u32>,
    global: Vec<u32>,
}

const UNKNOWN: u32 = u32::MAX;

impl Numbering {
    /// A numbering for meshes of `vertices` vertices.
    pub fn new(vertices: usize) -> Self {
        Self { local: vec![UNKNOWN; vertices], global: Vec::new() }
    }

    /// A patch of `faces`, and `lists` in the patch's vertex numbers, without vertices outside the patch.
    pub fn patch(&mut self, faces: &[[u32; 3]], lists: &[Vec<u32>]) -> (Patch, Vec<Vec<u32>>) {
        let faces = self.compact(faces);
        let known = |list: &Vec<u32>| {
            let local = list.iter().map(|&vertex| self.local[vertex as usize]);
            local.filter(|&vertex| vertex != UNKNOWN).collect()
        };
        let lists = lists.iter().map(known).collect();
        let vertices = self.global.len();
        self.global.drain(..).for_each(|vertex| self.local[vertex as usize] = UNKNOWN);
        (Patch::new(faces, vertices), lists)
    }

    /// The faces in compact numbers: vertices have numbers in the order of first use, and keep them until the next call
    /// of [`Numbering::patch`]. Vertices near each other in `faces` are then near each other in memory.
    pub fn compact(&mut self, faces: &[[u32; 3]]) -> Vec<[u32; 3]> {
        faces.iter().map(|face| face.map(|vertex| self.number(vertex))).collect()
    }

    /// How many vertices have numbers.
    pub fn vertices(&self) -> usize {
        self.global.len()
    }

    fn number(&mut self, vertex: u32) -> u32 {
        let local = &mut self.local[vertex as usize];
        if *local == UNKNOWN {
            *local = self.global.len() as u32;
            self.global.push(vertex);
        }
        *local
    }
}

impl Patch {
    pub fn new(faces: Vec<[u32; 3]>, vertices: usize) -> Self {
        let mut starts = vec![0; vertices + 1];
        faces.iter().flatten().for_each(|&vertex| starts[vertex as usize + 1] += 1);
        for vertex in 0..vertices {
            starts[vertex + 1] += starts[vertex];
        }
        let mut next = starts.clone();
        let mut around = vec![0; 3 * faces.len()];
        for (face, corners) in faces.iter().enumerate() {
            for &vertex in corners {
                around[next[vertex as usize] as usize] = face as u32;
                next[vertex as usize] += 1;
            }
        }
        Self { faces, vertices, starts, around }
    }

    /// This patch with its faces rotated so that face `first` comes first.
    pub fn turned(&self, first: usize) -> Self {
        let mut faces = self.faces.clone();
        faces.rotate_left(first);
        Self::new(faces, self.vertices)
    }
}
