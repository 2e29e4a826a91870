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
//! - [`session`]: frames, one after the other; [`figures`]: what is measured of all this;
//! - [`reference`]: the same in integers and f64 on the CPU; [`ruler`]: the proof that each texel is the right one.
//!
//! Where we differ from the print (errata; papers/1 of the design names each):
//! points sit on texel centres, not corners (2.2); the display table is apart from A1's states (3.);
//! `f` is clamped with `q`, `C = C1 (1-f) + C2 f`, G1 uses the unclamped `e`, and tiles carry a border (4.).

pub mod classic;
pub mod compact;
pub mod dedup;
pub mod display;
pub mod fade;
pub mod feedback;
pub mod figures;
pub mod footprint;
pub mod fused;
pub mod list;
pub mod lister;
pub mod marks;
pub mod pipeline;
pub mod prepass;
pub mod reference;
pub mod resident;
pub mod ruler;
pub mod scout;
pub mod session;
pub mod streaming;
pub mod surface;
pub mod texturing;
pub mod variants;

pub use crate::scene::{Compaction, Dedup, Filtering, Listing};
pub use streaming::Keying;
pub use variants::{Layout, Unfit, all_needs};

use crate::math::pyramid::Pyramid;
use crate::vk::{Error, Format, Gpu, Result};

/// How a pixel's triple is stored in `U1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum U1Format {
    /// The paper's: 32 bits in each of r, g, b. Few devices render to it.
    Rgb32,
    Rgba32,
    /// One word: q, i, j side by side.
    Packed,
}

/// How a pixel mixes its two levels (section 4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// `C1 (1-f) + C2 f`
    Corrected,
    /// `C1 f + C2 (1-f)`, as printed.
    Literal,
}

/// The settings of one variant. [`PAPER`] is the paper's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    /// `None`: the paper's format where the device renders to it, else the next in [`U1Format`]'s order.
    pub u1: Option<U1Format>,
    /// Who makes the list; the settings of stages 2 and 3 are the device's.
    pub list: Listing,
    /// n of [`Listing::Feedback`]: one pixel of 2^n a frame, 0 ..= 8.
    pub feedback_log2: u32,
    /// Stage 2.
    pub dedup: Dedup,
    /// p: the geometry shader's blocks are `2^p x 2^p` pixels, 0 ..= 4.
    pub block_log2: u32,
    /// The geometry shader emits a point only where the triple differs from the last one.
    pub memo: bool,
    pub keying: Keying,
    /// Stage 3.
    pub compact: Compaction,
    /// Its geometry shader's blocks are `2^p x 2^p` texels of `U2`, 0 ..= 2.
    pub compact_block_log2: u32,
    /// NA of the level formula.
    pub max_anisotropy: u32,
    pub filter: Filtering,
    /// Taps of a pixel, of the stochastic filter alone.
    pub samples: u32,
    pub interpolation: Interpolation,
    /// Frames in which a tile that has arrived is mixed with what was shown before it; 0: shown at once, as in the paper.
    pub fade_in_frames: u32,
    /// Triples that `U3` first has room for; more are found by a second run of the same frame.
    pub list_capacity: u32,
}

/// What the paper describes, with the p that it leaves open set to the best one measured on lavapipe.
pub const PAPER: Config = Config {
    u1: None,
    list: Listing::Device,
    feedback_log2: 6,
    dedup: Dedup::Geometry,
    block_log2: 3,
    memo: true,
    keying: Keying::Paper,
    compact: Compaction::TransformFeedback,
    compact_block_log2: 2,
    max_anisotropy: 1,
    filter: Filtering::Trilinear,
    samples: 1,
    interpolation: Interpolation::Corrected,
    fade_in_frames: 0,
    list_capacity: 65_536,
};

impl U1Format {
    pub const ALL: [U1Format; 3] = [U1Format::Rgb32, U1Format::Rgba32, U1Format::Packed];

    pub fn image_format(self) -> Format {
        match self {
            U1Format::Rgb32 => Format::Rgb32Uint,
            U1Format::Rgba32 => Format::Rgba32Uint,
            U1Format::Packed => Format::R32Uint,
        }
    }

    /// 32-bit words of a texel.
    pub fn words(self) -> usize {
        match self {
            U1Format::Rgb32 => 3,
            U1Format::Rgba32 => 4,
            U1Format::Packed => 1,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            U1Format::Rgb32 => "rgb32",
            U1Format::Rgba32 => "rgba32",
            U1Format::Packed => "packed",
        }
    }

    /// Whether (q, i, j) of this pyramid fit one word with all ones to spare for the background.
    pub fn fits(self, pyramid: &Pyramid) -> bool {
        let bits = pyramid.width_log2() + pyramid.height_log2() - 2 * pyramid.tile_log2();
        // The largest stored q is L-L'+1; its successor must not be reached, or all ones could be a triple.
        self != U1Format::Packed
            || (bits < 32 && pyramid.first_resident_level() < (1 << (32 - bits).min(31)) - 1)
    }

    /// The format to use: as configured, or the first that the device renders to.
    ///
    /// # Errors
    /// [`Error::Limit`] where the configured one cannot be, with the ones that can.
    pub fn choose(gpu: &Gpu, wanted: Option<U1Format>, pyramid: &Pyramid) -> Result<U1Format> {
        let usable = |format: &U1Format| gpu.renders_to(format.image_format()) && format.fits(pyramid);
        let found = match wanted {
            Some(format) => Some(format).filter(usable),
            None => U1Format::ALL.into_iter().find(usable),
        };
        found.ok_or_else(|| {
            let others: Vec<_> = U1Format::ALL.iter().filter(|f| usable(f)).map(|f| f.name()).collect();
            Error::Limit {
                object: "U1".into(),
                what: format!(
                    "format {} is not to be had for this device and texture; these are: {}",
                    wanted.map_or("auto", U1Format::name),
                    others.join(", ")
                ),
            }
        })
    }
}

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
