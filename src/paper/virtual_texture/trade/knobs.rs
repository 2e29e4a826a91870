//! The knobs of a sweep, and the values of each.

use super::values::{Stages, Values};
use crate::paper::virtual_texture::choices::{
    Compaction, Dedup, FilterEdge, FilterMap, Filtering, Listing, RequestDraw, TileAddress,
};
use crate::paper::virtual_texture::config::MAX_SAMPLES;
use crate::scene::choices;
use crate::texture::source::TileFormat;

choices! {
    /// A key of the scene, or several that belong together.
    pub enum Knob {
        /// Coarser levels than the footprint requests.
        LevelBias = "level-bias",
        /// The filter, and its number of samples.
        Filter = "filter",
        /// The largest number of samples along the footprint.
        Anisotropy = "anisotropy",
        /// Paper 3's filter: the largest ratio of the ellipse's axes, the texels along its minor semi-axis, and the
        /// weights of texels at its edge.
        Ellipse = "ellipse",
        /// Paper 3's filter: a weight map in place of the Gaussian.
        WeightMap = "weight-map",
        /// The width of the border around each tile.
        Border = "border",
        /// Feedback from some of the pixels instead of the exact list.
        List = "list",
        /// Two other ways to the exact list: the texturing draw makes the whole list ("fused-exact"), or it stores each
        /// pixel's tile and compute shaders make the list ("one draw").
        Stages = "stages",
        /// Tiles of half a byte per texel.
        Format = "format",
        /// Smaller tile pools.
        GpuTiles = "gpu-tiles",
        /// Budgets of uploading and loading. Measured separately, because budgets do not change a settled frame.
        Budgets = "budgets",
    }
}

impl Knob {
    /// The knobs that change only how a texture is filtered.
    pub const OF_FILTER: [Knob; 4] = [Knob::Filter, Knob::Anisotropy, Knob::Ellipse, Knob::WeightMap];

    /// The values `at`, then a copy of `at` for each value of the knob.
    pub(super) fn turned(self, at: Values) -> Vec<Values> {
        let mut all = vec![at];
        match self {
            Knob::LevelBias => all.extend([0, 1, 2].map(|level_bias| Values { level_bias, ..at })),
            Knob::Filter => all.extend(filters(at)),
            Knob::Anisotropy => all.extend(RATIOS.map(|max_anisotropy| Values { max_anisotropy, ..at })),
            Knob::Ellipse => {
                let axes = [4, 16].into_iter().flat_map(|ratio| [1.0, 2.0, 4.0].map(|minor| (ratio, minor)));
                let ellipse = |(max_anisotropy, minor_texels)| Values {
                    filter: Filtering::Ellipse,
                    max_anisotropy,
                    minor_texels,
                    ..at
                };
                all.extend(axes.map(ellipse));
                // Without a ramp at the edge, fewer texels are read (scene.filters).
                let edges = [FilterEdge::AreaRamp, FilterEdge::None];
                let edges = edges
                    .into_iter()
                    .flat_map(|edge| [1.0, 2.0].map(|minor| Values { edge, ..ellipse((16, minor)) }));
                all.extend(edges);
            }
            Knob::WeightMap => all.extend(MAPS.map(|weight_map| Values { weight_map, ..at })),
            // A border costs memory and loading time. A border of 0 shows what the border is worth.
            Knob::Border => all.extend(BORDERS.map(|border| Values { border, ..at })),
            Knob::List => {
                all.extend(FEEDBACKS.map(|n| Values { list: Listing::Feedback, feedback_log2: n, ..at }));
            }
            Knob::Stages => all.extend(WHILE_TEXTURING.map(|stages| Values { stages, ..at })),
            Knob::Format => all.push(Values { format: TileFormat::Bc1, ..at }),
            // Fewer slots than visible tiles make the picture coarser.
            Knob::GpuTiles => {
                let fewer = [2, 4].map(|part| (at.gpu_tiles / part).max(1));
                all.extend(fewer.map(|gpu_tiles| Values { gpu_tiles, ..at }));
            }
            Knob::Budgets => {}
        }
        all
    }
}

/// The values `at` with the other filters.
fn filters(at: Values) -> Vec<Values> {
    // Only an ellipse has a ratio above the other filters' limit.
    let max = at.max_anisotropy.min(MAX_SAMPLES);
    let filters = [
        (Filtering::Trilinear, at.samples, max),
        // Bilinear filtering, and stochastic filtering with few taps, are tried only at the pixel's centre, not along
        // the footprint.
        (Filtering::Bilinear, at.samples, 1),
        (Filtering::Stochastic, 1, 1),
        (Filtering::Stochastic, 4, 1),
        (Filtering::Stochastic, 16, max),
        (Filtering::Stochastic, 64, max),
        (Filtering::Feline, at.samples, 4),
        (Filtering::Feline, at.samples, 16),
        (Filtering::Mavridis, at.samples, 4),
        (Filtering::Pbrt, at.samples, max),
        (Filtering::StochasticEllipse, 16, max),
    ];
    let values = |(filter, samples, max_anisotropy)| Values { filter, samples, max_anisotropy, ..at };
    filters.map(values).into()
}

/// Values of NA, the largest number of samples along a footprint.
pub(super) const RATIOS: [u32; 5] = [1, 2, 4, 8, 16];
/// With 64 entries per side, a square map has four times the radial map's NMSE, and a quadrant the same NMSE with 64
/// times as many entries (tm.24, 80 degrees). So two-dimensional maps are not tried.
const MAPS: [FilterMap; 3] = [FilterMap::None, FilterMap::Radial, FilterMap::SquaredRadius];
/// Borders in texels.
pub(super) const BORDERS: [u32; 4] = [0, 1, 2, 8];
/// Values of n: one pixel in 2^n.
const FEEDBACKS: [u32; 4] = [2, 4, 6, 8];
/// The values of [`Knob::Stages`].
const WHILE_TEXTURING: [Stages; 2] = [
    (RequestDraw::Separate, Dedup::FusedExact, Compaction::FusedAppend, TileAddress::OwnLevel),
    (RequestDraw::Texturing, Dedup::Runs, Compaction::Append, TileAddress::OwnLevel),
];
