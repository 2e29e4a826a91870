//! The variants of each step by name; each is declared here once, with the line that documents and reports show.

use crate::scene::choices;

choices! {
    /// How a pixel's triple is stored in the request image (the paper's U1, section 2.1).
    pub enum RequestFormat {
        /// The paper's: 32 bits in each of r, g, b. Few devices render to it.
        Rgb32 = "rgb32",
        /// Four channels of 32 bits, the last unused.
        Rgba32 = "rgba32",
        /// One word: q, i, j side by side.
        Packed = "packed",
    }
}

choices! {
    /// In which grid a tile is addressed: the texel of the tile mask in which stage 2 sets bit q (section 2.2).
    pub enum TileAddress {
        /// The grid of level 0, texel `(i, j)`, as printed: one tile of level q can be listed up to `4^q` times.
        Level0 = "level-0",
        /// The grid of the tile's own level, texel `(i >> q, j >> q)`: each tile is listed once.
        OwnLevel = "own-level",
    }
}

choices! {
    /// How a tile's two levels are blended (section 4).
    pub enum Interpolation {
        /// `C1 (1 - f) + C2 f`.
        Corrected = "corrected",
        /// `C1 f + C2 (1 - f)`, as printed: the wrong way round.
        Literal = "literal",
    }
}

choices! {
    /// How a pixel's colour is taken from its tile (section 4). In the order of `filter.glsl`.
    pub enum Filtering {
        /// The paper's: bilinear in two levels, and between them; `max_anisotropy` such samples.
        Trilinear = "trilinear",
        /// Bilinear in the nearer of the two levels.
        Bilinear = "bilinear",
        /// `samples` single texels, each chosen with its weight in the trilinear filter: needs no border, and is noisy.
        Stochastic = "stochastic",
        /// Paper 3's: the texels of the footprint's ellipse, weighted by a Gaussian that follows its shape.
        Ellipse = "ellipse",
    }
}

choices! {
    /// In which order a frame's missing tiles are asked for; the paper leaves it to the device's list.
    pub enum Order {
        /// As listed: from the finest level to the coarsest.
        Finest = "finest",
        /// From the coarsest level to the finest: what covers most of the texture comes first.
        Coarsest = "coarsest",
    }
}

choices! {
    /// Which method makes the list of visible tiles from the pixels' triples.
    pub enum Listing {
        /// The paper's way: the device, in stages 2 and 3.
        Device = "device",
        /// Read-back: the host, from a copy of all of the request image, with a hash set.
        HostHash = "host-hash",
        /// Read-back: the host, from a copy of all of the request image, with a bit for each triple and a memo.
        HostBitmap = "host-bitmap",
        /// What engines ship: the host, from one pixel of 2^n a frame; subsampled, the list lags and may lack tiles.
        Feedback = "feedback",
    }
}

choices! {
    /// Stage 2: how the bits of the tile mask are set, one for each distinct triple (paper 1, section 2.2).
    pub enum Dedup {
        /// The paper's: a geometry shader's points for each block of pixels, merged by a logic OR.
        Geometry = "geometry",
        /// A point for each pixel, from a vertex shader alone: what the paper's blocks are measured against.
        Points = "points",
        /// Compute: each pixel ORs its bit into the tile mask.
        AtomicOr = "atomic-or",
        /// Compute: each pixel reads its bit, and ORs it in only where it is not yet set.
        TestOr = "test-or",
        /// Compute: of the lanes of a subgroup that hold the same triple, one ORs its bit.
        SubgroupUnique = "subgroup-unique",
        /// Compute: a workgroup gathers its bits in a hash table of shared memory, and ORs each word once.
        SharedHash = "shared-hash",
        /// Compute: 8 x 8 pixels an invocation, with the paper's memo before test and OR.
        TileMemo = "tile-memo",
        /// Compute: as tile-memo, four pixels at a time; a subgroup only looks while no triple changes.
        Runs = "runs",
        /// Compute: a workgroup keeps a bit for each tile of the whole pyramid in shared memory. Own-level tile
        /// addresses.
        Bitset = "bitset",
        /// Compute: each pixel stores the frame's number in its tile's byte (Hollemeersch et al. 2010).
        MarkBytes = "mark-bytes",
        /// No request image: the fragment shader that textures marks its own tile, hidden fragments' too where they
        /// are drawn before what hides them. A superset; one draw of the mesh.
        Fused = "fused",
        /// As fused, behind a draw of depth alone: only what is seen is shaded and marked. Exact.
        FusedExact = "fused-exact",
    }
}

choices! {
    /// Stage 3: how the tile mask becomes a list (paper 1, section 2.3).
    pub enum Compaction {
        /// The paper's: a geometry shader's points for each block of the mask, by transform feedback.
        TransformFeedback = "transform-feedback",
        /// Compute: each word of the mask counts its bits and reserves that many entries by one atomic addition.
        Append = "append",
        /// Compute: as append, with a prefix sum and one addition for each subgroup.
        Subgroup = "subgroup",
        /// Compute: as append, with a prefix sum in shared memory and one addition for each workgroup.
        Workgroup = "workgroup",
        /// Compute: groups count, then write; the list follows the mask's order, the same in every run.
        Ordered = "ordered",
        /// No pass: the fused draw appends a triple where it sets its mark first. For variant.dedup = fused,
        /// fused-exact.
        FusedAppend = "fused-append",
    }
}

impl Dedup {
    /// Whether one draw marks and textures, so that there is no request image.
    pub fn fused(self) -> bool {
        matches!(self, Dedup::Fused | Dedup::FusedExact)
    }
}

impl Compaction {
    /// Why [`Compaction::FusedAppend`] goes with no other stage 2, and the way out.
    pub const FUSED_APPEND_ALONE: &str = "the draw that marks appends, and this variant.dedup is a pass of its own; choose \"append\", or variant.dedup = \"fused-exact\"";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_in_a_scene_is_the_name_that_reports_show() {
        for value in Dedup::ALL {
            assert_eq!(serde_json::to_value(value).unwrap(), value.name());
            assert!(!value.about().is_empty() && !value.about().starts_with(' '));
        }
        for value in Compaction::ALL {
            assert_eq!(serde_json::to_value(value).unwrap(), value.name());
        }
    }
}
