//! Which variants of stages 2 and 3 are sent to the edges: each dedup and each compaction at least once with either
//! keying, and the geometry shaders with all their blocks. The fused ones have no `U1` to be held against.

use super::examine::refused;
use crate::math::pyramid::Pyramid;
use crate::paper::virtual_texture::compact::CompactPass;
use crate::paper::virtual_texture::dedup::DedupPass;
use crate::paper::virtual_texture::footprint::Footprint;
use crate::paper::virtual_texture::{Compaction, Config, Dedup, Keying, PAPER};
use crate::vk::{self, Gpu};

/// A variant whose pipelines stand, or the line that says why they cannot.
pub struct Contender {
    pub name: String,
    pub config: Config,
    pub passes: Result<(DedupPass, CompactPass), String>,
}

/// Every dedup that is a pass over `U1` with a compaction that fits it, every compaction with a dedup that fits it; named after both.
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
    }
    configs.into_iter().map(|config| (name(&config), config)).collect()
}

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
    format!("{dedup}, {}, {keying} keying", config.compact.name())
}

/// All variants made ready for a pyramid. `stage1` decides the format of the `U1` that they will read.
///
/// # Errors
/// What is no refusal: device lost and the like.
pub fn contenders(gpu: &Gpu, pyramid: &Pyramid, stage1: &Footprint) -> vk::Result<Vec<Contender>> {
    let ready = |(name, config): (String, Config)| {
        let passes = match config.check(pyramid) {
            Err(unfit) => Err(unfit.to_string()),
            Ok(()) => match passes(gpu, pyramid, &config, stage1) {
                Ok(passes) => Ok(passes),
                Err(error) => Err(refused(error)?),
            },
        };
        Ok(Contender { name, config, passes })
    };
    variants().into_iter().map(ready).collect()
}

fn passes(
    gpu: &Gpu,
    pyramid: &Pyramid,
    config: &Config,
    stage1: &Footprint,
) -> vk::Result<(DedupPass, CompactPass)> {
    Ok((DedupPass::new(gpu, pyramid, config, stage1)?, CompactPass::new(gpu, pyramid, config)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_variant_stays_at_home_and_none_has_anothers_name() {
        let variants = variants();
        for dedup in Dedup::staged() {
            assert!(variants.iter().any(|(_, config)| config.dedup == dedup), "{dedup:?}");
        }
        for &compact in Compaction::ALL.iter().filter(|&&compact| compact != Compaction::FusedAppend) {
            assert!(variants.iter().any(|(_, config)| config.compact == compact), "{compact:?}");
        }
        let names: std::collections::BTreeSet<&str> = variants.iter().map(|(name, _)| &**name).collect();
        assert_eq!(names.len(), variants.len());
    }
}
