//! The orders of faces of paper 2 by their names: one for each, in scenes, figures and on the command line.

use serde::{Deserialize, Serialize};

/// The order of faces in the index buffer (paper 2, section 5), or one of the rivals, which draw a level another way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FaceOrder {
    /// Last removed first, and no permutations: the standard algorithm.
    Classical,
    /// The paper's greedy as printed.
    Paper,
    /// With a weight for vertices that have few faces left, and groups that grow with the mesh: 23 moved faces a split.
    #[default]
    Ours,
    /// The same with 10 moved faces a split.
    OursFewMoves,
    /// As ours, the splits of a group in an order that suits the cache.
    Coherent,
    CoherentFewMoves,
    /// A rival: the live faces in a random order.
    Random,
    /// A rival: every level ordered anew by meshoptimizer.
    ReOptimised,
    /// A rival: the same by its optimizer for a FIFO of 16 entries.
    ReOptimisedFifo,
    /// A rival: the full mesh's best order, of which a compute pass copies the live faces.
    Compacted,
    /// A rival: lists of a row of levels; what is not live of a list has no area (Forsyth 2001).
    SkipLists,
    /// A rival: a chain of meshes by meshoptimizer's simplifier, which has levels of its own.
    Discrete,
}

impl FaceOrder {
    pub const ALL: [FaceOrder; 12] = [
        FaceOrder::Classical,
        FaceOrder::Paper,
        FaceOrder::Ours,
        FaceOrder::OursFewMoves,
        FaceOrder::Coherent,
        FaceOrder::CoherentFewMoves,
        FaceOrder::Random,
        FaceOrder::ReOptimised,
        FaceOrder::ReOptimisedFifo,
        FaceOrder::Compacted,
        FaceOrder::SkipLists,
        FaceOrder::Discrete,
    ];

    /// As scenes spell it.
    pub const fn name(self) -> &'static str {
        match self {
            FaceOrder::Classical => "classical",
            FaceOrder::Paper => "paper",
            FaceOrder::Ours => "ours",
            FaceOrder::OursFewMoves => "ours-few-moves",
            FaceOrder::Coherent => "coherent",
            FaceOrder::CoherentFewMoves => "coherent-few-moves",
            FaceOrder::Random => "random",
            FaceOrder::ReOptimised => "re-optimised",
            FaceOrder::ReOptimisedFifo => "re-optimised-fifo",
            FaceOrder::Compacted => "compacted",
            FaceOrder::SkipLists => "skip-lists",
            FaceOrder::Discrete => "discrete",
        }
    }

    /// Whether a level is drawn another way than as the beginning of one buffer that splits change in place.
    pub const fn is_rival(self) -> bool {
        use FaceOrder::*;
        matches!(self, Random | ReOptimised | ReOptimisedFifo | Compacted | SkipLists | Discrete)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_has_the_name_that_scenes_spell() {
        for order in FaceOrder::ALL {
            assert_eq!(serde_json::to_value(order).unwrap(), order.name());
        }
    }
}
