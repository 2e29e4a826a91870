//! Which variants of stages 2 and 3 fit together, and the device features that each needs.

use super::choices::{Compaction, Dedup, RequestDraw};
use super::{Config, Listing, TileAddress};
use crate::math::pyramid::Pyramid;
use crate::vk::{Feature, Need};
use thiserror::Error;

/// Settings that do not fit together on any device.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("variant.{key} = {value:?}: {why}")]
pub struct Unfit {
    pub key: &'static str,
    pub value: &'static str,
    /// The reason, and what to use instead.
    pub why: String,
}

/// Layout of the tile mask between stages 2 and 3, in the order of LAYOUT in tile_mask.glsl.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaskLayout {
    /// The paper's image: a texel for each tile of level 0 (`M0`), a bit for each level.
    Texels,
    /// A buffer with the same bits, level by level. With own-level tile addresses the order is that of
    /// [`Pyramid::tile_index`].
    Bits,
    /// A buffer with a byte for each of those bits: the number of the frame that set it.
    Bytes,
}

impl Dedup {
    pub fn layout(self) -> MaskLayout {
        match self {
            Dedup::Bitset | Dedup::Fused | Dedup::FusedExact => MaskLayout::Bits,
            Dedup::MarkBytes => MaskLayout::Bytes,
            _ => MaskLayout::Texels,
        }
    }

    /// True if the variant draws points into the mask. The shaders of all other variants store to the mask.
    pub fn draws(self) -> bool {
        matches!(self, Dedup::Geometry | Dedup::Points)
    }

    /// The variants that are a separate pass over the request image.
    pub fn staged() -> impl Iterator<Item = Dedup> {
        Dedup::ALL.iter().copied().filter(|dedup| !dedup.fused())
    }

    /// The device features that the variant needs.
    pub fn needs(self) -> Vec<Need> {
        let need = |feature| Need {
            feature,
            pass: "dedup",
            without: "variant.dedup = \"test-or\" does not need it",
        };
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
    /// The device features that the variant needs.
    pub fn needs(self) -> Vec<Need> {
        let need = |feature| Need {
            feature,
            pass: "compact",
            without: "variant.compact = \"append\" does not need it",
        };
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
    /// True if a single draw marks the visible tiles and draws the textured picture, without a request image. Lists
    /// that the host makes need the request image.
    pub fn fused(&self) -> bool {
        self.list == Listing::Device && self.dedup.fused()
    }

    /// True if one draw both finds the tiles of the pixels and textures them: fused, or with the request image as its
    /// second colour attachment.
    pub fn finds_while_texturing(&self) -> bool {
        self.fused() || self.request_draw == RequestDraw::Texturing
    }

    /// True if a depth-only draw precedes the shading draw.
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

    /// Replaces each variant of stages 2 and 3 that needs a feature that the device lacks, unless the scene states the
    /// variant. The replacement is the fastest variant without that feature in the figures vt.dedup and vt.compact.
    /// Returns a line with the missing features and the replacements, or `None` if nothing was replaced.
    pub fn fall_back(
        &mut self,
        is_stated: impl Fn(&str) -> bool,
        has: impl Fn(Feature) -> bool,
    ) -> Option<String> {
        let lack = |needs: Vec<Need>| needs.into_iter().map(|need| need.feature).find(|one| !has(*one));
        let words =
            |key, lack: Feature, name| format!("without {}, variant.{key} defaults to {name:?}", lack.name());
        let mut replaced = Vec::new();
        if self.list != Listing::Device {
            return None;
        }
        if let Some(feature) = lack(self.dedup.needs()).filter(|_| !is_stated("dedup")) {
            let runs = lack(Dedup::Runs.needs()).is_none();
            self.dedup = if runs { Dedup::Runs } else { Dedup::TestOr };
            replaced.push(words("dedup", feature, self.dedup.name()));
        }
        if let Some(feature) = lack(self.compact.needs()).filter(|_| !is_stated("compact")) {
            self.compact = Compaction::Append;
            replaced.push(words("compact", feature, self.compact.name()));
        }
        (!replaced.is_empty()).then(|| replaced.join("; "))
    }

    /// Checks that the variants fit together and fit this texture. Creating the pipelines checks device limits.
    ///
    /// # Errors
    /// The setting that does not fit, the reason, and an alternative.
    pub fn check(&self, pyramid: &Pyramid) -> Result<(), Unfit> {
        if self.list != Listing::Device {
            return Ok(());
        }
        let unfit = |key, value, why: &str| Err(Unfit { key, value, why: why.into() });
        let (dedup, compact) = (self.dedup.name(), self.compact.name());
        let layout = self.dedup.layout();
        if self.dedup == Dedup::Bitset && self.address == TileAddress::Level0 {
            return unfit(
                "dedup",
                dedup,
                "it has one bit per tile, but level-0 addresses need several; use variant.address = \"own-level\"",
            );
        }
        // mark_index counts in 32 bits.
        if layout != MaskLayout::Texels && max_triples(pyramid, self.address) > 1 << 32 {
            return unfit(
                "dedup",
                dedup,
                "it numbers its marks with 32 bits, but this texture needs more; use larger tiles",
            );
        }
        if self.compact == Compaction::FusedAppend && !self.dedup.fused() {
            return unfit("compact", compact, Compaction::FUSED_APPEND_ALONE);
        }
        if self.compact == Compaction::TransformFeedback {
            if layout != MaskLayout::Texels {
                return unfit(
                    "compact",
                    compact,
                    "it reads the tile mask as an image, which this variant.dedup does not write; use \"append\"",
                );
            }
            // compact.geom emits a point per level for each of up to 16 texels. With 16 levels that is 256 points,
            // the number that Vulkan guarantees.
            if pyramid.first_resident_level() > 16 {
                return unfit(
                    "compact",
                    compact,
                    "it supports 16 streamed levels; use larger tiles or \"append\"",
                );
            }
        }
        Ok(())
    }
}

/// Upper bound of a frame's distinct triples. The layouts `Bits` and `Bytes` have a mark for each.
pub(super) fn max_triples(pyramid: &Pyramid, address: TileAddress) -> u64 {
    let [columns, rows] = pyramid.tile_grid(0).map(u64::from);
    match address {
        TileAddress::Level0 => columns * rows * u64::from(pyramid.first_resident_level()),
        TileAddress::OwnLevel => pyramid.tile_count(),
    }
}

/// The needs of all variants, for tests and figures that compare variants on one device.
pub fn all_needs() -> Vec<Need> {
    let dedups = Dedup::ALL.iter().flat_map(|dedup| dedup.needs());
    dedups.chain(Compaction::ALL.iter().flat_map(|compact| compact.needs())).collect()
}

#[cfg(test)]
mod tests {
    use super::super::PAPER;
    use super::*;

    #[test]
    fn the_default_falls_back_to_what_the_device_can_run_unless_it_is_stated() {
        let of = |missing: &[Feature], stated: &str| {
            let mut config = PAPER;
            let words = config.fall_back(|key| key == stated, |feature| !missing.contains(&feature));
            let (dedup, compact) = (config.dedup, config.compact);
            assert_eq!(words.is_some(), (dedup, compact) != (PAPER.dedup, PAPER.compact), "{words:?}");
            (dedup, compact)
        };
        let own = (PAPER.dedup, PAPER.compact);
        for feature in Feature::ALL {
            let expected = match feature {
                Feature::GeometryShader => (Dedup::Runs, Compaction::Append),
                Feature::LogicOp => (Dedup::Runs, own.1),
                Feature::TransformFeedback => (own.0, Compaction::Append),
                _ => own,
            };
            assert_eq!(of(&[feature], ""), expected, "{feature:?}");
            assert_eq!(of(&[feature], "dedup"), (own.0, expected.1), "{feature:?}");
            assert_eq!(of(&[feature], "compact"), (expected.0, own.1), "{feature:?}");
        }
        assert_eq!(of(&Feature::ALL, ""), (Dedup::TestOr, Compaction::Append));
        assert!(Dedup::TestOr.needs().is_empty() && Compaction::Append.needs().is_empty());
    }
}
