//! Paper 1: super-large textures for virtual landscapes; the visible tiles are found wholly on the GPU.
//!
//! One file a step:
//! - [`footprint`], section 2.1: a triple (q, i, j) for each pixel, into `U1`;
//! - [`dedup`], section 2.2: a point for each distinct triple of a block, ORed into `U2`;
//! - [`compact`], section 2.3: the set bits of `U2` become the list `U3`, by transform feedback;
//! - [`marks`] and [`list`]: what stage 2 leaves for stage 3, and `U3` itself; [`variants`]: what goes together;
//! - [`classic`]: the list by copying `U1` to the host instead; [`feedback`]: by looking at few of its pixels;
//! - [`lister`]: whichever of them makes the list;
//! - [`streaming`], section 3: two caches, A1, A2, A3;
//! - [`resident`]: `J1` and `G1` in video memory; [`display`]: the table that says which tile shows what;
//! - [`fade`]: tiles that arrive are mixed in over some frames (ours, an option);
//! - [`texturing`], section 4: the picture from what is resident; [`fused`]: stages 1, 2 and 4 in one draw;
//!   [`prepass`]: what the draw of depth alone before it can leave out;
//! - [`scout`]: the tiles that the camera will see (ours, an option);
//! - [`method`]: a variant's passes together; [`technique`]: the paper's part of a frame;
//!   [`figures`]: what is measured of all this;
//! - [`mod@reference`]: the same in integers and f64 on the CPU; [`ruler`]: the proof that each texel is the right one.
//!
//! Where we differ from the print (errata; papers/1 of the design names each):
//! points sit on texel centres, not corners (2.2); the display table is apart from A1's states (3.);
//! `f` is clamped with `q`, `C = C1 (1-f) + C2 f`, G1 uses the unclamped `e`, and tiles carry a border (4.).

pub mod choices;
pub mod classic;
pub mod compact;
mod compare;
pub mod config;
pub mod dedup;
pub mod disk;
pub mod display;
mod dump;
pub mod fade;
pub mod feedback;
pub mod figures;
pub mod footprint;
pub mod fused;
pub mod list;
pub mod lister;
pub mod marks;
pub mod method;
pub mod prepass;
mod record;
pub mod reference;
pub mod resident;
pub mod ruler;
pub mod scout;
pub mod streaming;
pub mod technique;
pub mod texturing;
pub mod variants;

pub use choices::{Compaction, Dedup, Filtering, Interpolation, Keying, Listing, U1Format};
pub use compare::{Again, PlainComparison};
pub use config::{Config, PAPER, Settings, needs};
pub use dump::{FootprintPicture, read_u1, read_words};
pub use record::FrameRecord;
pub use technique::{VirtualTexture, VirtualTextureError};
pub use variants::{Layout, Unfit, all_needs};

use crate::math::pyramid::Pyramid;

/// The pyramid's numbers as the shaders' specialization constants.
fn pyramid_constants(pyramid: &Pyramid, u1: U1Format) -> [(&'static str, u32); 5] {
    [
        ("WIDTH_LOG2", pyramid.width_log2()),
        ("HEIGHT_LOG2", pyramid.height_log2()),
        ("TILE_LOG2", pyramid.tile_log2()),
        ("FIRST_RESIDENT_LEVEL", pyramid.first_resident_level()),
        ("U1_PACKED", u32::from(u1 == U1Format::Packed)),
    ]
}

fn with(constants: [(&'static str, u32); 5], more: &[(&'static str, u32)]) -> Vec<(&'static str, u32)> {
    constants.iter().chain(more).copied().collect()
}
