//! The cost of an order of faces (paper 2, section 2): vertex transforms per vertex of the mesh.
//!
//! The lower bound is 1: each vertex is transformed once. Without reuse the cost is 3 x faces / vertices,
//! about 6 on closed meshes. The paper assumes a post-transform cache of about 16 to 32 vertices and gives no
//! replacement rule; the usual model is FIFO ([`Cache::Fifo`]). Today's devices have no such cache. They
//! reuse vertices within a batch: [`Cache::Batches`] models this, and [`Cache::H100`] models one device.
//!
//! All models count vertices by the indices of their input. The figures count positions
//! ([`Vertices::welded`](super::mesh::Vertices::welded)). A device transforms each wedge of a position separately, but
//! counting these transforms would hide the effect of the order at seams. Only orders that are optimised for batches
//! are counted by wedges: see [`OrderOptions::with_cache`](super::order::OrderOptions::with_cache).

mod bound;
mod levels;

use super::mesh::ProgressiveMesh;

pub use bound::lower_bound;
pub use levels::{LevelCosts, costs_of, drawn_faces, level_costs, live_faces, sampled_levels};

/// A count of vertex transforms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Transforms {
    /// Number of transformed vertices.
    pub transforms: u64,
    /// Number of distinct vertices in the faces.
    pub vertices: u64,
}

impl Transforms {
    /// Transforms per vertex; 1 without faces.
    pub fn per_vertex(self) -> f64 {
        match self.vertices {
            0 => 1.0,
            vertices => self.transforms as f64 / vertices as f64,
        }
    }
}

/// A model of vertex reuse. It counts the transforms of a list of faces, starting with an empty cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Cache {
    /// FIFO with this many entries.
    Fifo(u32),
    /// Batches of at most 32 vertices and 32 triangles, with no reuse between batches. meshoptimizer assumes this for
    /// NVIDIA's devices.
    Batches,
    /// The batches of an NVIDIA H100: as [`Cache::Batches`], but a vertex is found again only if its last use is at
    /// most 42 indices back. Otherwise it is transformed again and takes another place of the batch. The model was
    /// fitted to the vertex shader invocations of one draw in 15 orders of faces (pm.draw; triangle list, indices of 16
    /// bits, driver 580.159.04) and gives all 15 exactly, and three that were made and drawn later. B. Kerbl et al.
    /// ("Revisiting the Vertex Cache: Understanding and Optimizing Vertex Processing on the modern GPU", PACM CGIT
    /// 2018) found batches of 96 indices on a GeForce GTX 1080 Ti, which are 32 triangles, too.
    H100,
    /// Meshlets of at most 64 vertices and 126 triangles, filled in the order of the faces, with no reuse between
    /// meshlets. NVIDIA recommends this size for mesh shaders (C. Kubisch, "Introduction to Turing Mesh Shaders",
    /// 2018).
    Meshlets,
}

/// The caches in figures: FIFOs of 12 to 32 entries (the paper assumes 16 to 32), batches, those of an H100,
/// and meshlets.
pub const CACHES: [Cache; 7] = [
    Cache::Fifo(12),
    Cache::Fifo(16),
    Cache::Fifo(24),
    Cache::Fifo(32),
    Cache::Batches,
    Cache::H100,
    Cache::Meshlets,
];

impl Cache {
    /// The name in figures: `FIFO-16`, `batches`.
    pub fn name(self) -> String {
        match self {
            Cache::Fifo(entries) => format!("FIFO-{entries}"),
            Cache::Batches => "batches".into(),
            Cache::H100 => "batches of an H100".into(),
            Cache::Meshlets => "meshlets".into(),
        }
    }

    /// Vertices that the FIFO or a batch holds.
    pub const fn entries(self) -> u32 {
        match self {
            Cache::Fifo(entries) => entries,
            Cache::Batches | Cache::H100 => 32,
            Cache::Meshlets => 64,
        }
    }

    /// Triangles that a batch holds; `None` for a FIFO.
    pub const fn triangles(self) -> Option<u32> {
        match self {
            Cache::Fifo(_) => None,
            Cache::Batches | Cache::H100 => Some(32),
            Cache::Meshlets => Some(126),
        }
    }

    /// A vertex is found again only if its last use is at most this many indices back. `None`: no limit.
    pub const fn look_back(self) -> Option<usize> {
        match self {
            Cache::H100 => Some(42),
            _ => None,
        }
    }
}

/// Counts the transforms of many lists, and reuses its memory without clearing it.
pub struct Counter {
    cache: Cache,
    /// The time at which each vertex last entered the cache; with [`Cache::H100`], the time of its last use.
    entered: Vec<u64>,
    clock: u64,
}

impl Counter {
    /// A counter for vertices 0 … `vertices` - 1.
    ///
    /// # Panics
    /// If the cache holds fewer than three vertices.
    pub fn new(cache: Cache, vertices: usize) -> Self {
        assert!(!matches!(cache, Cache::Fifo(..3)), "{cache:?} holds less than a face");
        Self { cache, entered: vec![0; vertices], clock: 0 }
    }

    /// The transforms of `faces`, in their order, from an empty cache.
    ///
    /// # Panics
    /// If a face names a vertex beyond the counter's range.
    pub fn count(&mut self, faces: impl IntoIterator<Item = [u32; 3]>) -> Transforms {
        let entries = u64::from(self.cache.entries());
        match (self.cache.triangles(), self.cache.look_back()) {
            (None, _) => self.fifo(entries, faces),
            (Some(triangles), None) => self.batches(entries, u64::from(triangles), faces),
            (Some(triangles), Some(reach)) => {
                self.batches_that_look_back(entries, u64::from(triangles), reach as u64, faces)
            }
        }
    }

    /// A vertex is cached until `entries` further vertices have entered.
    fn fifo(&mut self, entries: u64, faces: impl IntoIterator<Item = [u32; 3]>) -> Transforms {
        // All earlier entries have left the cache.
        self.clock += entries;
        let start = self.clock;
        let mut vertices = 0;
        for vertex in faces.into_iter().flatten() {
            let entered = &mut self.entered[vertex as usize];
            if self.clock - *entered >= entries {
                vertices += u64::from(*entered <= start);
                self.clock += 1;
                *entered = self.clock;
            }
        }
        Transforms { transforms: self.clock - start, vertices }
    }

    /// A face that does not fit starts a new batch; a batch holds `max_vertices` and `max_triangles`.
    fn batches(
        &mut self,
        max_vertices: u64,
        max_triangles: u64,
        faces: impl IntoIterator<Item = [u32; 3]>,
    ) -> Transforms {
        let start = self.clock;
        let mut count = Transforms::default();
        // Vertices that entered after `batch` are in the current batch.
        let (mut batch, mut triangles) = (self.clock, 0);
        for face in faces {
            let new = face.iter().filter(|&&vertex| self.entered[vertex as usize] <= batch).count() as u64;
            if triangles == max_triangles || self.clock - batch + new > max_vertices {
                (batch, triangles) = (self.clock, 0);
            }
            triangles += 1;
            for vertex in face {
                let entered = &mut self.entered[vertex as usize];
                if *entered <= batch {
                    count.vertices += u64::from(*entered <= start);
                    count.transforms += 1;
                    self.clock += 1;
                    *entered = self.clock;
                }
            }
        }
        count
    }

    /// As [`Counter::batches`], with a limited look-back. The clock counts indices.
    fn batches_that_look_back(
        &mut self,
        max_vertices: u64,
        max_triangles: u64,
        reach: u64,
        faces: impl IntoIterator<Item = [u32; 3]>,
    ) -> Transforms {
        let start = self.clock;
        let mut count = Transforms::default();
        let (mut batch, mut places, mut triangles) = (start, 0, 0);
        for face in faces {
            // The corners that are not found in the batch, nor at an earlier corner of the face.
            let missed = |batch: u64| {
                let is_found = |corner: usize| {
                    let used = self.entered[face[corner] as usize];
                    let at = self.clock + 1 + corner as u64;
                    used > batch && at - used <= reach || face[..corner].contains(&face[corner])
                };
                (0..3).filter(|&corner| !is_found(corner)).count() as u64
            };
            let mut new = missed(batch);
            if triangles == max_triangles || places + new > max_vertices {
                (batch, places, triangles) = (self.clock, 0, 0);
                new = missed(batch);
            }
            triangles += 1;
            places += new;
            count.transforms += new;
            for vertex in face {
                let used = &mut self.entered[vertex as usize];
                count.vertices += u64::from(*used <= start);
                self.clock += 1;
                *used = self.clock;
            }
        }
        count
    }
}

/// The transforms of one list of faces: see [`Counter::count`].
pub fn transforms(cache: Cache, faces: &[[u32; 3]]) -> Transforms {
    let vertices = faces.iter().flatten().max().map_or(0, |&last| last as usize + 1);
    Counter::new(cache, vertices).count(faces.iter().copied())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of quads row by row, and the same faces interleaved.
    fn grid(side: u32) -> [Vec<[u32; 3]>; 2] {
        let quads = (0..side * side).map(|quad| (quad % side, quad / side));
        let corner = |x: u32, y: u32| y * (side + 1) + x;
        let faces: Vec<[u32; 3]> = quads
            .flat_map(|(x, y)| {
                let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x, y + 1), corner(x + 1, y + 1)];
                [[a, b, c], [c, b, d]]
            })
            .collect();
        let dealt = (0..7).flat_map(|first| faces.iter().skip(first).step_by(7).copied()).collect();
        [faces, dealt]
    }

    #[test]
    fn a_vertex_leaves_the_fifo_once_its_capacity_of_others_has_entered() {
        let fan: Vec<[u32; 3]> = (1..=20).map(|n| [0, n, n + 1]).collect();
        // Vertex 0 enters first. It leaves when vertex 17 enters, in face (0, 16, 17), and is transformed
        // again in the next face.
        assert_eq!(transforms(Cache::Fifo(16), &fan), Transforms { transforms: 23, vertices: 22 });
        assert_eq!(transforms(Cache::Fifo(22), &fan), Transforms { transforms: 22, vertices: 22 });
        // A hit does not renew an entry: vertex 0 is used by every face and still leaves.
        assert_eq!(transforms(Cache::Fifo(3), &[[0, 1, 2], [0, 2, 3], [0, 3, 4]]).transforms, 6);
        assert_eq!(transforms(Cache::Fifo(3), &[[0, 1, 2], [0, 2, 1], [2, 0, 1]]).transforms, 3);
    }

    #[test]
    fn counts_are_those_of_meshoptimizer() {
        for faces in grid(40) {
            let indices: Vec<u32> = faces.iter().flatten().copied().collect();
            let theirs = |cache, warp, group| {
                meshopt::analyze_vertex_cache(&indices, 41 * 41, cache, warp, group).vertices_transformed
            };
            for entries in [3, 12, 16, 24, 32] {
                let ours = transforms(Cache::Fifo(entries), &faces);
                assert_eq!(ours.transforms, u64::from(theirs(entries, 0, 0)), "FIFO-{entries}");
                assert_eq!(ours.vertices, 41 * 41);
            }
            for (cache, transformed) in
                [(Cache::Batches, theirs(32, 32, 32)), (Cache::Meshlets, theirs(64, 64, 126))]
            {
                let expected = Transforms { transforms: transformed.into(), vertices: 41 * 41 };
                assert_eq!(transforms(cache, &faces), expected, "{cache:?}");
            }
        }
    }

    #[test]
    fn an_h100_looks_back_over_42_indices() {
        let of = |last: [u32; 3]| {
            let faces: Vec<[u32; 3]> = [[0, 1, 2]].into_iter().chain([[1, 2, 2]; 13]).chain([last]).collect();
            transforms(Cache::H100, &faces)
        };
        // The two uses of vertex 0 are 42 and 43 indices apart.
        assert_eq!(of([0, 1, 2]), Transforms { transforms: 3, vertices: 3 });
        assert_eq!(of([1, 0, 2]), Transforms { transforms: 4, vertices: 3 });
    }

    #[test]
    fn a_counter_forgets_everything_between_two_lists() {
        for cache in CACHES {
            let [rows, dealt] = grid(9);
            let mut counter = Counter::new(cache, 100);
            let of = |counter: &mut Counter, faces: &[[u32; 3]]| counter.count(faces.iter().copied());
            let first = of(&mut counter, &rows);
            assert!(of(&mut counter, &dealt).per_vertex() > 1.5 * first.per_vertex(), "{}", cache.name());
            assert_eq!(of(&mut counter, &rows), first, "{}", cache.name());
        }
    }

    #[test]
    fn an_empty_list_costs_the_lower_bound() {
        assert_eq!(transforms(Cache::Batches, &[]).per_vertex(), 1.0);
    }
}
