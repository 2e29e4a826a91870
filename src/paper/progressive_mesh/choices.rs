//! The orders of faces and the other named settings, each declared once for scenes, figures and the command line.

use crate::scene::choices;

choices! {
    /// The order of faces in the index buffer (paper 2, section 5), or a baseline that draws levels by another method.
    pub enum FaceOrder {
        /// The standard algorithm: faces in the reverse order of their removal, and no permutations.
        Classical = "classical",
        /// The paper's greedy optimizer as printed.
        Paper = "paper",
        /// A greedy optimizer that prefers vertices with few faces left. Faces are reordered after each group of
        /// splits; the groups become larger as the mesh grows. On average over all splits, at most 23 faces are moved
        /// per split.
        Tail23 = "tail-23",
        /// As `tail-23`, but with at most 10 moved faces per split; each permutation reorders one region of
        /// the faces.
        Tail10 = "tail-10",
        /// New faces are placed beside their neighbours instead of at the buffer's tail, and are degenerate
        /// until a split adds them. A greedy optimizer with lookahead orders them; at most 23 moved faces per
        /// split.
        InPlace23 = "in-place-23",
        /// As `in-place-23`, but with at most 10 moved faces per split.
        InPlace10 = "in-place-10",
        /// A baseline: the live faces in random order.
        Random = "random",
        /// A baseline: the live faces, reordered by meshoptimizer at every level.
        ReOptimised = "re-optimised",
        /// A baseline: as `re-optimised`, but with meshoptimizer's optimizer for a FIFO cache of 16 entries (Tipsify).
        ReOptimisedFifo = "re-optimised-fifo",
        /// A baseline: as `re-optimised`, but in rings, for a FIFO cache of 16 entries (H. Hoppe, "Optimization of Mesh
        /// Locality for Transparent Vertex Caching", 1999, and his program MeshReorder).
        ReOptimisedRings = "re-optimised-rings",
        /// A baseline: a compute pass copies the live faces, in meshoptimizer's order of the full mesh.
        Compacted = "compacted",
        /// A baseline: an index list for each of a series of levels. At the levels between, the finer list is
        /// drawn, and its faces that are not live are degenerate (T. Forsyth,
        /// "Comparison of VIPM Methods", 2001).
        SkipLists = "skip-lists",
        /// A baseline: discrete meshes made by meshoptimizer's simplifier. The coarsest mesh with at least
        /// the level's number of faces is drawn.
        Discrete = "discrete",
    }
}

impl FaceOrder {
    /// True for a baseline, whose levels are not made by splits in one index buffer.
    pub const fn is_baseline(self) -> bool {
        use FaceOrder::*;
        matches!(
            self,
            Random | ReOptimised | ReOptimisedFifo | ReOptimisedRings | Compacted | SkipLists | Discrete
        )
    }
}

choices! {
    /// How much work the simplifier does.
    pub enum BuildEffort {
        /// One pass, by quadrics: the error rises in jumps.
        Fast = "fast",
        /// Two passes: the second also orders collapses by their deviation, so that the error rises evenly.
        Best = "best",
    }
}

choices! {
    /// What the error of a level measures. The simplifier orders collapses by it.
    pub enum ErrorMetric {
        /// Distances between the surfaces.
        Geometry = "geometry",
        /// Also the size of the region in which a collapse changes the shading visibly, and the distance by which it
        /// shifts the texture.
        Appearance = "appearance",
    }
}

choices! {
    /// Which processor executes splits, collapses and permutations.
    pub enum Apply {
        /// The host, in its own copy of the index buffer; the changed parts are uploaded.
        Cpu = "cpu",
        /// The host, in its own copy of the index buffer; the changed parts are copied into memory that the
        /// device reads directly, a buffer for each frame in flight. Not for baselines.
        Mapped = "mapped",
        /// Compute shaders, in place; not for baselines.
        Gpu = "gpu",
    }
}

choices! {
    /// The model's axis that points up.
    pub enum UpAxis {
        /// As in scans and glTF.
        Y = "y",
        /// As in maps.
        Z = "z",
    }
}

choices! {
    /// How several instances are arranged.
    pub enum Layout {
        /// Rows and columns that fill `area_m`, centred on the surface's position.
        Grid = "grid",
        /// Random positions and headings in `area_m`.
        Scatter = "scatter",
        /// Evenly spaced below the camera path `path`, each at a random distance of at most `aside_m` to the
        /// side.
        Along = "along",
    }
}
