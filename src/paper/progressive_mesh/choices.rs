//! The orders of faces and the other named settings, each declared once for scenes, figures and the command line.

use crate::scene::choices;

choices! {
    /// The order of faces in the index buffer (paper 2, section 5), or a baseline that draws a level another way.
    pub enum FaceOrder {
        /// The standard algorithm: last removed first, and no permutations.
        Classical = "classical",
        /// The paper's greedy as printed.
        Paper = "paper",
        /// With a weight for vertices that have few faces left, and groups that grow with the mesh: 23 moved faces a split.
        Ours = "ours",
        /// The same with 10 moved faces a split.
        OursFewMoves = "ours-few-moves",
        /// As ours, the splits of a group in an order that suits the cache.
        Coherent = "coherent",
        /// The same with 10 moved faces a split.
        CoherentFewMoves = "coherent-few-moves",
        /// A baseline: the live faces in a random order.
        Random = "random",
        /// A baseline: every level ordered anew by meshoptimizer.
        ReOptimised = "re-optimised",
        /// A baseline: the same by its optimizer for a FIFO of 16 entries.
        ReOptimisedFifo = "re-optimised-fifo",
        /// A baseline: the full mesh's best order, of which a compute pass copies the live faces.
        Compacted = "compacted",
        /// A baseline: lists of a row of levels; what is not live of a list has no area (Forsyth 2001).
        SkipLists = "skip-lists",
        /// A baseline: a chain of meshes by meshoptimizer's simplifier, which has levels of its own.
        Discrete = "discrete",
    }
}

impl FaceOrder {
    /// Whether a level is drawn another way than as the beginning of one buffer that splits change in place.
    pub const fn is_rival(self) -> bool {
        use FaceOrder::*;
        matches!(self, Random | ReOptimised | ReOptimisedFifo | Compacted | SkipLists | Discrete)
    }
}

choices! {
    /// Which processor executes splits, collapses and permutations.
    pub enum Apply {
        /// The host, in its own copy of the index buffer; what it touched is copied.
        Cpu = "cpu",
        /// Compute shaders, in place; not for baselines.
        Gpu = "gpu",
    }
}

choices! {
    /// The model's axis that points up.
    pub enum UpAxis {
        /// As scans and glTF have it.
        Y = "y",
        /// As maps have it.
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
        /// Below the eye's way along `path`, evenly, each up to `aside_m` to its side at random.
        Along = "along",
    }
}
