//! The orders of faces and the other named settings, each declared once for scenes, figures and the command line.

use crate::scene::choices;

choices! {
    /// The order of faces in the index buffer (paper 2, section 5), or a baseline that draws a level another way.
    pub enum FaceOrder {
        /// The standard algorithm: last removed first, and no permutations.
        Classical = "classical",
        /// The paper's greedy as printed.
        Paper = "paper",
        /// A greedy that prefers vertices with few faces left; groups that grow with the mesh; 23 moved faces a split.
        Tail23 = "tail-23",
        /// The same with 10 moved faces a split, a region of the mesh at a time.
        Tail10 = "tail-10",
        /// New faces beside their neighbours instead of at the buffer's tail, degenerate until they are born; rollouts;
        /// 23 moved faces a split.
        InPlace23 = "in-place-23",
        /// The same with 10 moved faces a split.
        InPlace10 = "in-place-10",
        /// A baseline: the live faces in random order.
        Random = "random",
        /// A baseline: every level reordered by meshoptimizer.
        ReOptimised = "re-optimised",
        /// A baseline: the same by its optimizer for a FIFO of 16 entries.
        ReOptimisedFifo = "re-optimised-fifo",
        /// A baseline: a compute pass copies the live faces in the full mesh's best order.
        Compacted = "compacted",
        /// A baseline: lists for a series of levels; faces that are not live are degenerate (Forsyth 2001).
        SkipLists = "skip-lists",
        /// A baseline: a discrete chain of meshes by meshoptimizer's simplifier, with its own levels.
        Discrete = "discrete",
    }
}

impl FaceOrder {
    /// Whether a level is drawn another way than as the beginning of one buffer that splits change in place.
    pub const fn is_baseline(self) -> bool {
        use FaceOrder::*;
        matches!(self, Random | ReOptimised | ReOptimisedFifo | Compacted | SkipLists | Discrete)
    }
}

choices! {
    /// How much work the simplifier does.
    pub enum BuildEffort {
        /// One pass, by quadrics: the error rises in jumps.
        Fast = "fast",
        /// Two passes: the second orders collapses by their deviation too, and the error rises evenly.
        Best = "best",
    }
}

choices! {
    /// Which processor executes splits, collapses and permutations.
    pub enum Apply {
        /// The host, in its own copy of the index buffer; the changed parts are copied.
        Cpu = "cpu",
        /// The host, in memory that the device reads in place, once for each frame in flight; nothing is copied. Not for
        /// baselines.
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
    /// How instances are spread.
    pub enum Layout {
        /// Rows and columns that fill `area_m` around the first instance's place.
        Grid = "grid",
        /// At random places and headings in that area.
        Scatter = "scatter",
        /// Evenly below the camera path `path`, each at random up to `aside_m` to the side.
        Along = "along",
    }
}
