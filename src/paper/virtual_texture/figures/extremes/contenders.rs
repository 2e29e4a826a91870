//! Who is sent to the edges: each dedup and each compaction at least once with either keying, the geometry shaders
//! with all their blocks, the host's lists, feedback that looks at every pixel, and the fused draws.

use crate::math::pyramid::Pyramid;
use crate::paper::virtual_texture::footprint::Footprint;
use crate::paper::virtual_texture::lister::Lister;
use crate::paper::virtual_texture::{Compaction, Config, Dedup, Keying, Listing, PAPER};
use crate::vk::{self, Gpu};

/// A variant that is ready, or the line that says why it cannot be.
pub struct Contender {
    pub name: String,
    pub config: Config,
    pub way: Result<Way, String>,
}

/// How a variant comes to its list.
pub enum Way {
    /// Passes over the `U1` that is drawn for all.
    OverU1(Lister),
    /// A draw of its own: a whole frame, for it also textures.
    Fused,
}

/// The reason why a device refuses a variant.
///
/// # Errors
/// The error itself, where it is not a refusal.
pub(super) fn refused(error: vk::Error) -> vk::Result<String> {
    match error {
        vk::Error::Limit { .. } | vk::Error::MissingFeature { .. } | vk::Error::OutOfMemory { .. } => {
            Ok(error.to_string())
        }
        broken => Err(broken),
    }
}

/// Whether the list may have tiles that nobody sees.
pub fn is_superset(config: &Config) -> bool {
    config.fused() && config.dedup != Dedup::FusedExact
}

/// Every dedup that is a pass over `U1` with a compaction that fits it, every compaction with a dedup that fits it, and
/// the others; named after what they do.
pub fn variants() -> Vec<(String, Config)> {
    let mut configs: Vec<Config> = Vec::new();
    let mut add = |config: Config| {
        if !configs.contains(&config) {
            configs.push(config);
        }
    };
    for keying in [Keying::Paper, Keying::Native] {
        let fits = |&(dedup, compact): &(Dedup, Compaction)| {
            Config { dedup, compact, keying, ..PAPER }.check(&papers_pyramid()).is_ok()
        };
        for [block_log2, compact_block_log2, memo] in [[0, 0, 0], [3, 1, 0], [3, 2, 1], [4, 2, 1]] {
            add(Config { block_log2, compact_block_log2, memo: memo == 1, keying, ..PAPER });
        }
        let of = |pair: (Dedup, Compaction)| Config { dedup: pair.0, compact: pair.1, keying, ..PAPER };
        for dedup in Dedup::staged() {
            Compaction::ALL.iter().map(|&compact| (dedup, compact)).find(fits).map(of).map(&mut add);
        }
        for &compact in Compaction::ALL {
            // The last ones are the fastest, and the likeliest partners.
            let staged: Vec<Dedup> = Dedup::staged().collect();
            staged.into_iter().rev().map(|dedup| (dedup, compact)).find(fits).map(of).map(&mut add);
        }
        for list in [Listing::HostHash, Listing::HostBitmap, Listing::Feedback] {
            add(Config { list, feedback_log2: 0, keying, ..PAPER });
        }
        for (dedup, compact) in FUSED {
            add(Config { dedup, compact, keying, ..PAPER });
        }
    }
    configs.into_iter().map(|config| (name(&config), config)).collect()
}

/// The pairs of fused draws that are looked at.
const FUSED: [(Dedup, Compaction); 3] = [
    (Dedup::FusedExact, Compaction::FusedAppend),
    (Dedup::FusedExact, Compaction::Append),
    (Dedup::Fused, Compaction::FusedAppend),
];

fn papers_pyramid() -> Pyramid {
    Pyramid::new(18, 17, 9, 4, None).expect("the paper's")
}

fn name(config: &Config) -> String {
    let dedup = match config.dedup {
        Dedup::Geometry => {
            format!("geometry p={}{}", config.block_log2, if config.memo { " memo" } else { "" })
        }
        other => other.name().to_owned(),
    };
    let keying = match config.keying {
        Keying::Paper => "paper",
        Keying::Native => "native",
    };
    match config.list {
        Listing::Device => format!("{dedup}, {}, {keying} keying", config.compact.name()),
        Listing::Feedback => format!("feedback of every pixel, {keying} keying"),
        host => format!("{}, {keying} keying", host.name()),
    }
}

/// All variants made ready for a pyramid. `stage1` decides the format of the `U1` that they will read.
///
/// # Errors
/// What is no refusal: device lost and the like.
pub fn contenders(gpu: &Gpu, pyramid: &Pyramid, stage1: &Footprint) -> vk::Result<Vec<Contender>> {
    let ready = |(name, config): (String, Config)| {
        let way = match config.check(pyramid) {
            Err(unfit) => Err(unfit.to_string()),
            Ok(()) if config.fused() => Ok(Way::Fused),
            Ok(()) => match Lister::new(gpu, pyramid, &config, stage1) {
                Ok(lister) => Ok(Way::OverU1(lister)),
                Err(error) => Err(refused(error)?),
            },
        };
        Ok(Contender { name, config, way })
    };
    variants().into_iter().map(ready).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_variant_stays_at_home_and_none_has_anothers_name() {
        let variants = variants();
        for keying in [Keying::Paper, Keying::Native] {
            let is_there = |is: &dyn Fn(&Config) -> bool| {
                variants.iter().any(|(_, config)| config.keying == keying && is(config))
            };
            for &dedup in Dedup::ALL {
                // A bit for each tile is native keying.
                let refused = dedup == Dedup::Bitset && keying == Keying::Paper;
                assert_ne!(is_there(&|config| config.dedup == dedup), refused, "{dedup:?}");
            }
            for &compact in Compaction::ALL {
                assert!(is_there(&|config| config.compact == compact), "{compact:?}");
            }
            for &list in Listing::ALL {
                assert!(is_there(&|config| config.list == list), "{list:?}");
            }
        }
        let names: std::collections::BTreeSet<&str> = variants.iter().map(|(name, _)| &**name).collect();
        assert_eq!(names.len(), variants.len());
    }
}
