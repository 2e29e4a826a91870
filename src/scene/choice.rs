//! The variants of the list's making, of stages 2 and 3 by name. A scene names them, paper 1 builds them; each stands here once, with the
//! line that the reports show.

use serde::{Deserialize, Serialize};

/// An enum whose values have a name in scenes and a line that says what they do. The first is the default.
macro_rules! choices {
    ($(#[$meta:meta])* pub enum $name:ident {
        $(#[doc = $first_about:literal])+ $first:ident = $first_word:literal,
        $($(#[doc = $about:literal])+ $value:ident = $word:literal,)*
    }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
        pub enum $name {
            $(#[doc = $first_about])+
            #[default]
            #[serde(rename = $first_word)]
            $first,
            $($(#[doc = $about])+ #[serde(rename = $word)] $value,)*
        }

        impl $name {
            pub const ALL: &'static [$name] = &[$name::$first $(, $name::$value)*];

            /// As scenes spell it.
            pub fn name(self) -> &'static str {
                match self {
                    $name::$first => $first_word,
                    $($name::$value => $word,)*
                }
            }

            /// What it does.
            pub fn about(self) -> &'static str {
                match self {
                    $name::$first => concat!($($first_about),+),
                    $($name::$value => concat!($($about),+),)*
                }
                .trim()
            }
        }
    };
}

choices! {
    /// Who makes the list of visible tiles from the pixels' triples.
    pub enum Listing {
        /// The paper's way: the device, in stages 2 and 3.
        Device = "device",
        /// The classic: the host, from a copy of all of U1, with a hash set.
        HostHash = "host-hash",
        /// The classic: the host, from a copy of all of U1, with a bit for each triple and a memo.
        HostBitmap = "host-bitmap",
        /// What engines ship: the host, from one pixel of 2^n a frame; subsampled, the list lags and may lack tiles.
        Feedback = "feedback",
    }
}

choices! {
    /// Stage 2: how the pixels' triples become marks, one for each distinct triple (paper 1, section 2.2).
    pub enum Dedup {
        /// The paper's: a geometry shader's points for each block of pixels, merged by a logic OR.
        Geometry = "geometry",
        /// A point for each pixel, from a vertex shader alone: what the paper's blocks are measured against.
        Points = "points",
        /// Compute: each pixel ORs its bit into U2.
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
        /// Compute: a workgroup keeps a bit for each tile of the whole pyramid in shared memory. Native keying.
        Bitset = "bitset",
        /// Compute: each pixel stores the frame's number in its tile's byte (Hollemeersch et al. 2010).
        MarkBytes = "mark-bytes",
        /// No U1: the fragment shader that textures marks its own tile, hidden fragments' too where they are drawn before
        /// what hides them. A superset; one draw of the mesh.
        Fused = "fused",
        /// As fused, behind a draw of depth alone: only what is seen is shaded and marked. Exact.
        FusedExact = "fused-exact",
    }
}

choices! {
    /// Stage 3: how the marks become a list (paper 1, section 2.3).
    pub enum Compaction {
        /// The paper's: a geometry shader's points for each block of marks, by transform feedback.
        TransformFeedback = "transform-feedback",
        /// Compute: each word of marks counts its bits and takes so many places by one atomic addition.
        Append = "append",
        /// Compute: as append, with a prefix sum and one addition for each subgroup.
        Subgroup = "subgroup",
        /// Compute: as append, with a prefix sum in shared memory and one addition for each workgroup.
        Workgroup = "workgroup",
        /// Compute: groups count, then write; the list follows the marks' order, the same in every run.
        Ordered = "ordered",
        /// No pass: the fused draw appends a triple where it sets its mark first. For variant.dedup = fused, fused-exact.
        FusedAppend = "fused-append",
    }
}

impl Dedup {
    /// Whether one draw marks and textures, so that there is no `U1`.
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
        for value in Listing::ALL {
            assert_eq!(serde_json::to_value(value).unwrap(), value.name());
        }
        for value in Compaction::ALL {
            assert_eq!(serde_json::to_value(value).unwrap(), value.name());
        }
        assert_eq!(
            (Dedup::default(), Compaction::default()),
            (Dedup::Geometry, Compaction::TransformFeedback)
        );
    }
}
