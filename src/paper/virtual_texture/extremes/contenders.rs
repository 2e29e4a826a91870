//! The variants of vt.extremes. With NA = 1 each dedup and each compaction runs at least once with each tile address
//! that fits it, and the geometry shaders run with several block sizes. The host's lists, feedback with every pixel,
//! the fused draws and the texturing draw that stores triples complete the list. With NA = 16 samples reach into
//! neighbouring tiles. The methods that list such tiles in code of their own run: one for each layout of the tile mask,
//! the host's lists, the exact fused draw and the texturing draw that stores triples.

use crate::math::pyramid::Pyramid;
use crate::paper::virtual_texture::config::Filter;
use crate::paper::virtual_texture::footprint::FootprintPass;
use crate::paper::virtual_texture::list_passes::ListPasses;
use crate::paper::virtual_texture::{Compaction, Config, Dedup, Listing, PAPER, RequestDraw, TileAddress};
use crate::vk::{self, Gpu};

/// A variant that is ready, or the reason why it is refused.
pub struct ExtremeVariant {
    pub name: String,
    pub config: Config,
    pub way: Result<Way, String>,
}

/// How a variant makes its list.
pub enum Way {
    /// Passes over the common request image.
    OverRequests(ListPasses),
    /// A draw that also textures.
    WhileTexturing,
}

/// The reason why a device refuses a variant.
///
/// # Errors
/// The error itself, if it is not a refusal.
pub(super) fn refused(error: vk::Error) -> vk::Result<String> {
    match error {
        vk::Error::OutOfMemory { .. } => Ok(error.to_string()),
        other => other.unsupported(),
    }
}

/// True if the list may contain tiles that are not visible.
pub fn is_superset(config: &Config) -> bool {
    config.fused() && config.dedup != Dedup::FusedExact
}

/// All variants by name, for one NA.
pub fn variants(na: u32) -> Vec<(String, Config)> {
    let configs = if na == 1 { every_pass(&base(na)) } else { every_layout(&base(na)) };
    let suffix = if na == 1 { String::new() } else { format!(", NA = {na}") };
    configs.into_iter().map(|config| (format!("{}{suffix}", name(&config)), config)).collect()
}

/// The paper's variant with one NA.
pub fn base(na: u32) -> Config {
    Config { filter: Filter { max_anisotropy: na, ..PAPER.filter }, ..PAPER }
}

/// Every dedup pass with a compaction that fits it, every compaction with a dedup pass that fits it, the host's lists
/// and the fused draws.
fn every_pass(base: &Config) -> Vec<Config> {
    let mut configs: Vec<Config> = Vec::new();
    let mut add = |config: Config| {
        if !configs.contains(&config) {
            configs.push(config);
        }
    };
    for address in [TileAddress::Level0, TileAddress::OwnLevel] {
        let fits = |&(dedup, compact): &(Dedup, Compaction)| {
            Config { dedup, compact, address, ..*base }.check(&papers_pyramid()).is_ok()
        };
        for [block_log2, compact_block_log2, memo] in [[0, 0, 0], [3, 1, 0], [3, 2, 1], [4, 2, 1]] {
            add(Config { block_log2, compact_block_log2, memo: memo == 1, address, ..*base });
        }
        let of = |pair: (Dedup, Compaction)| Config { dedup: pair.0, compact: pair.1, address, ..*base };
        for dedup in Dedup::staged() {
            Compaction::ALL.iter().map(|&compact| (dedup, compact)).find(fits).map(of).map(&mut add);
        }
        for &compact in Compaction::ALL {
            // Searched in reverse order: the last variants are the fastest, so they are the most likely to be used.
            let staged: Vec<Dedup> = Dedup::staged().collect();
            staged.into_iter().rev().map(|dedup| (dedup, compact)).find(fits).map(of).map(&mut add);
        }
        for list in [Listing::HostHash, Listing::HostBitmap, Listing::Feedback] {
            add(Config { list, feedback_log2: 0, address, ..*base });
        }
        for (dedup, compact) in FUSED {
            add(Config { dedup, compact, address, ..*base });
        }
        add(Config { address, ..stores_triples(base) });
    }
    configs
}

/// The paper's variant; a dedup pass for each layout of the tile mask; the host's lists; the exact fused draw; the
/// texturing draw that stores triples.
fn every_layout(base: &Config) -> Vec<Config> {
    let own_level = Config { address: TileAddress::OwnLevel, compact: Compaction::Append, ..*base };
    let dedups = [Dedup::Runs, Dedup::Bitset, Dedup::MarkBytes, Dedup::FusedExact];
    let lists = [Listing::HostHash, Listing::HostBitmap];
    let of_dedups = dedups.map(|dedup| Config { dedup, ..own_level });
    let of_lists = lists.map(|list| Config { list, ..*base });
    let stores = Config { address: TileAddress::OwnLevel, ..stores_triples(base) };
    [*base].into_iter().chain(of_dedups).chain(of_lists).chain([stores]).collect()
}

/// The texturing draw that stores the triples.
fn stores_triples(base: &Config) -> Config {
    let (dedup, compact) = (Dedup::Runs, Compaction::Append);
    Config { request_draw: RequestDraw::Texturing, dedup, compact, ..*base }
}

/// The combinations of fused draws.
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
        other if config.request_draw == RequestDraw::Texturing => {
            format!("triples of the texturing draw, {}", other.name())
        }
        Dedup::Geometry => {
            format!("geometry p={}{}", config.block_log2, if config.memo { " memo" } else { "" })
        }
        other => other.name().to_owned(),
    };
    let address = config.address.name();
    match config.list {
        Listing::Device => format!("{dedup}, {}, {address} tile addresses", config.compact.name()),
        Listing::Feedback => format!("feedback of every pixel, {address} tile addresses"),
        host => format!("{}, {address} tile addresses", host.name()),
    }
}

/// Prepares all variants of one NA for a pyramid. `stage1` determines the format of the request image.
///
/// # Errors
/// Errors other than refusals, such as device lost.
pub fn contenders(
    gpu: &Gpu,
    pyramid: &Pyramid,
    stage1: &FootprintPass,
    na: u32,
) -> vk::Result<Vec<ExtremeVariant>> {
    let ready = |(name, config): (String, Config)| {
        let way = match config.check(pyramid) {
            Err(unfit) => Err(unfit.to_string()),
            Ok(()) if config.finds_while_texturing() => Ok(Way::WhileTexturing),
            Ok(()) => match ListPasses::new(gpu, pyramid, &config, stage1) {
                Ok(list_passes) => Ok(Way::OverRequests(list_passes)),
                Err(error) => Err(refused(error)?),
            },
        };
        Ok(ExtremeVariant { name, config, way })
    };
    variants(na).into_iter().map(ready).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_variant_is_included_and_names_are_unique() {
        let variants = variants(1);
        for address in [TileAddress::Level0, TileAddress::OwnLevel] {
            let is_there = |is: &dyn Fn(&Config) -> bool| {
                variants.iter().any(|(_, config)| config.address == address && is(config))
            };
            for &dedup in Dedup::ALL {
                // bitset has a bit per tile, so it needs own-level tile addresses.
                let refused = dedup == Dedup::Bitset && address == TileAddress::Level0;
                assert_ne!(is_there(&|config| config.dedup == dedup), refused, "{dedup:?}");
            }
            for &compact in Compaction::ALL {
                assert!(is_there(&|config| config.compact == compact), "{compact:?}");
            }
            for &draw in RequestDraw::ALL {
                assert!(is_there(&|config| config.request_draw == draw), "{draw:?}");
            }
            for &list in Listing::ALL {
                assert!(is_there(&|config| config.list == list), "{list:?}");
            }
        }
        let all: Vec<_> = [1, 16].into_iter().flat_map(super::variants).collect();
        let names: std::collections::BTreeSet<&str> = all.iter().map(|(name, _)| &**name).collect();
        assert_eq!(names.len(), all.len());
    }
}
