//! Which variants of stages 2 and 3 go together, and what each needs of the device.

use super::choices::{Compaction, Dedup};
use super::{Config, Keying, Listing};
use crate::math::pyramid::Pyramid;
use crate::vk::{Feature, Need};
use thiserror::Error;

/// Settings that no device can run together.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("variant.{key} = {value:?}: {why}")]
pub struct Unfit {
    pub key: &'static str,
    pub value: &'static str,
    /// The reason, and what to choose instead.
    pub why: String,
}

/// How stage 2 leaves its marks for stage 3, in the order of the LAYOUT of marks.glsl.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// `U2`: an image with a texel for each tile of `M0`, and a bit for each level.
    U2,
    /// A bit for each bit that `U2` would have, level by level; with native keying in the order of
    /// [`Pyramid::tile_index`].
    Bits,
    /// A byte for each of those bits: the number of the frame that set it.
    Bytes,
}

impl Dedup {
    pub fn layout(self) -> Layout {
        match self {
            Dedup::Bitset | Dedup::Fused | Dedup::FusedExact => Layout::Bits,
            Dedup::MarkBytes => Layout::Bytes,
            _ => Layout::U2,
        }
    }

    /// Whether it draws points into the marks; else shaders store them.
    pub fn draws(self) -> bool {
        matches!(self, Dedup::Geometry | Dedup::Points)
    }

    /// Those that are a pass of their own over `U1`.
    pub fn staged() -> impl Iterator<Item = Dedup> {
        Dedup::ALL.iter().copied().filter(|dedup| !dedup.fused())
    }

    /// Device features.
    pub fn needs(self) -> Vec<Need> {
        let need =
            |feature| Need { feature, pass: "dedup", without: "variant.dedup = \"test-or\" does without" };
        match self {
            Dedup::Geometry => vec![need(Feature::GeometryShader), need(Feature::LogicOp)],
            Dedup::Points => vec![need(Feature::LogicOp)],
            Dedup::SubgroupUnique | Dedup::Runs => vec![need(Feature::Subgroups)],
            Dedup::MarkBytes => vec![need(Feature::ByteStores)],
            Dedup::Fused | Dedup::FusedExact => {
                vec![Need { pass: "fused", ..need(Feature::FragmentStores) }]
            }
            _ => Vec::new(),
        }
    }
}

impl Compaction {
    /// Device features.
    pub fn needs(self) -> Vec<Need> {
        let need =
            |feature| Need { feature, pass: "compact", without: "variant.compact = \"append\" does without" };
        match self {
            Compaction::TransformFeedback => {
                vec![need(Feature::GeometryShader), need(Feature::TransformFeedback)]
            }
            Compaction::Subgroup => vec![need(Feature::Subgroups)],
            _ => Vec::new(),
        }
    }
}

impl Config {
    /// Whether one draw marks and textures, so that there is no `U1`; lists that the host makes are of `U1`.
    pub fn fused(&self) -> bool {
        self.list == Listing::Device && self.dedup.fused()
    }

    /// Whether a draw of depth alone comes before the one that shades.
    pub fn draws_depth_alone(&self) -> bool {
        self.fused() && self.dedup == Dedup::FusedExact
    }

    /// Device features of stages 2 and 3, each once.
    pub fn needs(&self) -> Vec<Need> {
        let mut needs: Vec<Need> = Vec::new();
        if self.list != Listing::Device {
            return needs;
        }
        for need in self.dedup.needs().into_iter().chain(self.compact.needs()) {
            if !needs.iter().any(|other| (other.feature, other.pass) == (need.feature, need.pass)) {
                needs.push(need);
            }
        }
        needs
    }

    /// Whether the variants go together on textures like this. What depends on the device is told when their
    /// pipelines are made.
    ///
    /// # Errors
    /// The one that does not fit, why, and what would.
    pub fn check(&self, pyramid: &Pyramid) -> Result<(), Unfit> {
        if self.list != Listing::Device {
            return Ok(());
        }
        let unfit = |key, value, why: &str| Err(Unfit { key, value, why: why.into() });
        let (dedup, compact) = (self.dedup.name(), self.compact.name());
        let layout = self.dedup.layout();
        if self.dedup == Dedup::Bitset && self.keying == Keying::Paper {
            return unfit(
                "dedup",
                dedup,
                "it has a bit for each tile, the paper's keying several; choose variant.keying = \"native\"",
            );
        }
        // mark_index counts in 32 bits.
        if layout != Layout::U2 && most_triples(pyramid, self.keying) > 1 << 32 {
            return unfit(
                "dedup",
                dedup,
                "it numbers its marks with 32 bits, and this texture has more tiles; take larger tiles",
            );
        }
        if self.compact == Compaction::FusedAppend && !self.dedup.fused() {
            return unfit("compact", compact, Compaction::FUSED_APPEND_ALONE);
        }
        if self.compact == Compaction::TransformFeedback {
            if layout != Layout::U2 {
                return unfit(
                    "compact",
                    compact,
                    "it reads U2, which this variant.dedup does not fill; choose \"append\"",
                );
            }
            // compact.geom's room: 16 points a texel, so that 16 texels stay within Vulkan's promise of 256.
            if pyramid.first_resident_level() > 16 {
                return unfit(
                    "compact",
                    compact,
                    "it has room for 16 streamed levels; take larger tiles, or choose \"append\"",
                );
            }
        }
        Ok(())
    }
}

/// The most triples that a frame can have: the layouts without `U2` have a mark for each.
pub(super) fn most_triples(pyramid: &Pyramid, keying: Keying) -> u64 {
    let [columns, rows] = pyramid.tile_grid(0).map(u64::from);
    match keying {
        Keying::Paper => columns * rows * u64::from(pyramid.first_resident_level()),
        Keying::Native => pyramid.tile_count(),
    }
}

/// What it takes to run any variant: tests and figures that compare them open the device with these.
pub fn all_needs() -> Vec<Need> {
    let dedups = Dedup::ALL.iter().flat_map(|dedup| dedup.needs());
    dedups.chain(Compaction::ALL.iter().flat_map(|compact| compact.needs())).collect()
}
