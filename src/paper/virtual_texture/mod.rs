//! Paper 1: super-large textures for virtual landscapes. The visible tiles are found entirely on the GPU.
//!
//! One file per step:
//! - [`footprint`], section 2.1: writes a triple (q, i, j) for each pixel into the request image; [`reach`]: the
//!   neighbouring tiles that a pixel's filter also needs (not in the paper);
//! - [`dedup`], section 2.2: a point for each distinct triple of a block, ORed into the tile mask;
//! - [`compact`], section 2.3: the set bits of the tile mask become the visible-tile list, by transform feedback;
//! - [`tile_mask`], [`visible_list`]: the outputs of stages 2 and 3; [`variants`]: which variants fit together;
//! - [`read_back`]: a baseline that copies the request image to the host and makes the list there; [`feedback`]: a
//!   baseline that copies a subset of the pixels;
//! - [`list_passes`]: the passes of the chosen method;
//! - [`streaming`], section 3: two caches, the update, the upload step and the loader;
//! - [`tile_pool`]: the resident tiles in video memory; [`page_table`]: for each tile, the resident tile that is shown
//!   for it;
//! - [`fade`]: blends new tiles in over some frames (optional, not in the paper);
//! - [`texturing`], section 4: the picture from the resident tiles; [`fused`]: stages 1, 2 and 4 in one draw;
//!   [`prepass`]: culling for the depth-only draw before [`fused`];
//! - [`shown`]: each pixel's shown and requested levels;
//! - [`prefetch`]: the tiles that the camera will see soon (optional, not in the paper);
//! - [`method`]: all passes of a variant; [`technique`]: the paper's part of a frame; [`figures`]: the measurements;
//! - [`counts`]: the work of stages 2 and 3 in texels, atomics and bytes, which are equal on every device;
//! - [`extremes`]: extreme inputs, and every variant compared with the reference on each of them;
//! - [`trade`]: time and error of combinations of settings, for `ortelius trade` and `auto`;
//! - [`mod@reference`]: the same steps in integers and f64 on the CPU; [`ruler`]: checks every fetched texel.
//!
//! The paper's letters, which comments use with its equations:
//!
//! | letter | name here | file |
//! |---|---|---|
//! | U1 | request image: a triple (q, i, j) for each pixel | [`footprint`] |
//! | U2 | tile mask: bit q of texel (i, j) | [`tile_mask`] |
//! | U3 | visible-tile list | [`visible_list`] |
//! | M0 | the grid of level 0's tiles | [`crate::math::pyramid`] |
//! | J1, N1 | tile pool in video memory, and its number of slots | [`tile_pool`] |
//! | J2, N2 | host tile cache, and its number of slots | [`streaming`] |
//! | G1 | resident mip tail: the levels that are always in video memory | [`tile_pool`] |
//! | H1, k1 | states in the tile pool, and the page table that the shader reads | [`streaming`], [`page_table`] |
//! | H2, k2 | states in the host cache | [`streaming`] |
//! | Q1, Q2 | upload queue, load queue | [`streaming`] |
//! | A1, A2, A3 | update, upload, loader threads | [`streaming`] |
//! | NA | the maximum number of samples along a footprint, 16 | [`texturing`] |
//!
//! Differences from the printed paper (errata):
//! - 2.2: points are drawn at texel centres, not corners.
//! - 3: the page table is separate from the tile states.
//! - 4: the weight `f` of level q + 1 is clamped whenever `q` is clamped; the blend is `C = C1 (1-f) + C2 f`; the
//!   resident mip tail (G1) uses the unclamped level `e`; tiles have a border.

pub mod choices;
pub mod compact;
mod compare;
pub mod config;
pub mod counts;
pub mod dedup;
pub mod disk;
mod dump;
pub mod extremes;
pub mod fade;
pub mod feedback;
pub mod figures;
pub mod footprint;
pub mod fused;
pub mod list_passes;
pub mod method;
pub mod page_table;
pub mod prefetch;
pub mod prepass;
pub mod reach;
pub mod read_back;
mod record;
pub mod reference;
pub mod ruler;
pub mod shown;
pub mod streaming;
pub mod technique;
pub mod texturing;
pub mod tile_mask;
pub mod tile_pool;
pub mod trade;
pub mod variants;
pub mod visible_list;

pub use choices::{
    Compaction, Dedup, Filtering, Interpolation, Listing, RequestDraw, RequestFormat, TileAddress,
};
pub use compare::{Again, PlainComparison};
pub use config::{Config, ONE_SAMPLE, PAPER, VirtualTextureSettings, lacks, needs};
pub use dump::{FootprintPicture, read_requests, read_words, texels_per_pixel};
pub use record::TextureFrameRecord;
pub use technique::{VirtualTexture, VirtualTextureError};
pub use variants::{MaskLayout, Unfit, all_needs};

use crate::math::pyramid::Pyramid;

/// The pyramid's sizes as specialization constants of the shaders.
fn pyramid_constants(
    pyramid: &Pyramid,
    requests: RequestFormat,
    filter: &config::Filter,
) -> [(&'static str, u32); 7] {
    [
        ("WIDTH_LOG2", pyramid.width_log2()),
        ("HEIGHT_LOG2", pyramid.height_log2()),
        ("TILE_LOG2", pyramid.tile_log2()),
        ("FIRST_RESIDENT_LEVEL", pyramid.first_resident_level()),
        ("REQUESTS_PACKED", u32::from(requests == RequestFormat::Packed)),
        ("BORDER", pyramid.border_texels()),
        ("REACHES", u32::from(filter.reaches(pyramid.border_texels()))),
    ]
}

fn with(constants: [(&'static str, u32); 7], more: &[(&'static str, u32)]) -> Vec<(&'static str, u32)> {
    constants.iter().chain(more).copied().collect()
}
