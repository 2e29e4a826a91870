//! The named variants of each step. A variant's doc comment is also its description in documents and reports.

use crate::math::weight_map::MapShape;
use crate::scene::choices;

choices! {
    /// How a pixel's triple is stored in the request image (the paper's U1, section 2.1).
    pub enum RequestFormat {
        /// The paper's: 32 bits in each of r, g, b. Few devices support it as a render target.
        Rgb32 = "rgb32",
        /// Four channels of 32 bits, the last unused.
        Rgba32 = "rgba32",
        /// One word: q, i, j side by side.
        Packed = "packed",
    }
}

choices! {
    /// Stage 1: the draw that writes the request image.
    pub enum RequestDraw {
        /// The paper's: a draw that only stores triples. The texturing draw follows and reads each pixel's triple.
        Separate = "separate",
        /// The texturing draw stores the triples in a second colour attachment, so the mesh is drawn once. The depth
        /// test keeps the triples of visible fragments, so the list is exact. Hidden fragments are textured, too.
        Texturing = "texturing",
    }
}

choices! {
    /// The grid of a tile's address (i, j): stage 2 sets bit q of texel (i, j) of the tile mask (section 2.2).
    pub enum TileAddress {
        /// The grid of level 0, texel `(i, j)`, as printed: one tile of level q can be listed up to `4^q` times.
        Level0 = "level-0",
        /// The grid of the tile's own level, texel `(i >> q, j >> q)`: each tile is listed once.
        OwnLevel = "own-level",
    }
}

choices! {
    /// How a tile's two levels are blended (section 4).
    pub enum Interpolation {
        /// `C1 (1 - f) + C2 f`: f is the weight of the next coarser level's colour C2.
        Corrected = "corrected",
        /// `C1 f + C2 (1 - f)`, as printed: the two weights are exchanged.
        Literal = "literal",
    }
}

choices! {
    /// How a pixel's colour is filtered from its tile (section 4). The filters have the order of the constants in
    /// `surface_filter_level.glsl`.
    pub enum Filtering {
        /// Paper 1's: at most `max_anisotropy` samples, each bilinear in two levels and interpolated between them.
        Trilinear = "trilinear",
        /// Bilinear in the nearer of the two levels.
        Bilinear = "bilinear",
        /// Single texels, `samples` of them, each chosen at random with its trilinear weight as the probability. This
        /// needs no border but is noisy.
        Stochastic = "stochastic",
        /// Paper 3's: the texels in the footprint's ellipse, weighted by a Gaussian of the ellipse's shape.
        Ellipse = "ellipse",
        /// At most `max_anisotropy` trilinear samples along the ellipse's major axis, weighted by a Gaussian (McCormack
        /// et al., "Feline", 1999).
        Feline = "feline",
        /// `max_anisotropy` taps along the ellipse's major axis, weighted by a Gaussian; each is the mean of up to 16
        /// trilinear samples (Mavridis and Papaioannou, "High quality elliptical texture filtering on GPU", 2011).
        Mavridis = "mavridis",
        /// The EWA filter of pbrt-v4: the texels of an ellipse with a ratio of at most 8, in two levels.
        Pbrt = "pbrt",
        /// Single texels, `samples` of them, at random positions in the ellipse, with the Gaussian as probability
        /// (Pharr et al., "Filtering after shading with stochastic texture filtering", 2024). Noisy.
        StochasticEllipse = "stochastic-ellipse",
    }
    refused {
        "summed-area" = "each tile would need a table of sums of 16 bytes per texel, 4 times the bytes of an rgba8 tile and \
                         32 times those of bc1; the figure tm.pareto measures it on a small texture; use \"ellipse\"",
        "hardware" = "a device's anisotropic sampler cannot be confined to a tile: some drivers take the footprint from \
                      neighbouring pixels, which may show another tile, and 16 samples would need a border of 36 texels; \
                      use \"trilinear\" with max_anisotropy, or \"feline\"",
        "object-space" = "it draws fragments of rotated polygons instead of filtering pixels; the figure tm.23 \
                          measures it; use \"ellipse\"",
    }
}

impl Filtering {
    /// True for paper 3's ellipse and for the published filters after it. These filters fetch single texels through the
    /// page table, so they need no border.
    pub fn is_of_paper_3(self) -> bool {
        self as u32 >= Filtering::Ellipse as u32
    }

    /// True if each picture has noise of its own.
    pub fn is_random(self) -> bool {
        matches!(self, Filtering::Stochastic | Filtering::StochasticEllipse)
    }
}

choices! {
    /// The footprint at a sphere's limb. There the sphere curves away within a pixel, but the plane of a facet does
    /// not.
    pub enum FilterLimb {
        /// Paper 1's: the footprint in the facet's plane, which may be many times as long as what the pixel sees.
        Facet = "facet",
        /// At most as long as the footprint in the middle of the outermost pixel: `sqrt(p R)` for a pixel of width p on
        /// the surface and a sphere of radius R.
        Bounded = "bounded",
    }
}

choices! {
    /// The ellipse that the weights of the filter `"ellipse"` follow: formula (4) of paper 3. The texels are always
    /// those of the exact ellipse. The values have the order of AXES in `ellipse.glsl`.
    pub enum FilterAxes {
        /// As printed: the axes are as long as the rows of the Jacobian.
        Rows = "rows",
        /// As printed, with the columns of the Jacobian instead of its rows.
        Columns = "columns",
        /// Exact for every Jacobian.
        Corrected = "corrected",
        /// A circle with the radius of the major axis.
        Round = "round",
    }
}

choices! {
    /// The texels that the filter `"ellipse"` visits.
    pub enum FilterScan {
        /// In each row, the texels between the ellipse's edges.
        RowSpan = "row-span",
        /// As in paper 3: all texels of the ellipse's bounding box. Texels outside the ellipse have no weight.
        BoundingBox = "bounding-box",
    }
}

choices! {
    /// The formula for `det V` of the filter `"ellipse"`. V is the ellipse's matrix at its level, J the Jacobian, s the
    /// kernel's squared radius.
    pub enum FilterDeterminant {
        /// `s^2 (det J)^2 + s k tr(J J^T) + k^2`: no term cancels.
        AllPositive = "all-positive",
        /// As in paper 3: `V11 V22 - V12^2`. In f32 its terms cancel if the ellipse is long; up to a ratio of 64 the
        /// relative error is below 1e-3.
        Subtracting = "subtracting",
    }
}

choices! {
    /// The weight of a texel that the ellipse's edge cuts, by the distance d in texels from its centre to the edge:
    /// step C of paper 3. The values have the order of EDGE in `weights.glsl`.
    pub enum FilterEdge {
        /// All or nothing, by the texel's centre.
        None = "none",
        /// The share of a Gaussian over the texel that lies inside the ellipse's edge, `Phi(d / 0.2)`; d is the texel's
        /// distance inside the edge, in texels.
        Exact = "exact",
        /// `0.5 + 2.151 d - 2.358 d^2`, an approximation of `"exact"`.
        Quadratic = "quadratic",
        /// `0.496 + 2.288 d - 3.074 d^2 + 0.956 d^3`, an approximation of `"exact"`.
        Cubic = "cubic",
        /// Three linear pieces, an approximation of `"exact"`.
        PiecewiseLinear = "piecewise-linear",
        /// `0.5 + d`: the covered area.
        AreaRamp = "area-ramp",
    }
}

choices! {
    /// The Gaussian of the filter `"ellipse"`, by the distance r from the footprint's centre, 1 at the ellipse's edge.
    pub enum FilterKernel {
        /// `exp(-2 r^2)`, and the edge is one pixel from the centre: the usual EWA filter.
        Ewa = "ewa",
        /// Paper 3's, with a support of two pixels: `exp(-3.125 r^2)`.
        Formula4 = "formula-4",
        /// Paper 3's, with a support of one pixel. It hardly antialiases.
        Diameter1 = "diameter-1",
        /// All texels of the ellipse have the same weight.
        Uniform = "uniform",
    }
    refused {
        "weight-map" = "a weight map approximates a kernel; name that kernel, and add weight_map = \"radial\"",
    }
}

impl FilterKernel {
    /// Pixels from the centre to r = 1, and alpha of `exp(-alpha r^2)`.
    pub fn radius_and_alpha(self) -> [f32; 2] {
        match self {
            FilterKernel::Ewa => [1.0, 2.0],
            FilterKernel::Formula4 => [1.0, 3.125],
            FilterKernel::Diameter1 => [0.5, 3.125],
            FilterKernel::Uniform => [1.0, 0.0],
        }
    }
}

choices! {
    /// The index of a table that replaces the evaluation of the Gaussian of the filter `"ellipse"`: step D of paper 3.
    /// The index is the texel's position, with r = 1 at the ellipse's edge.
    pub enum FilterMap {
        /// No table.
        None = "none",
        /// Indexed by x and y: `map_entries` x `map_entries` entries.
        Square = "square",
        /// Indexed by the absolute values of x and y: a quarter of the square.
        Quadrant = "quadrant",
        /// Indexed by r.
        Radial = "radial",
        /// Indexed by `r^2`, which needs no square root.
        SquaredRadius = "squared-radius",
    }
}

impl FilterMap {
    pub fn shape(self) -> Option<MapShape> {
        match self {
            FilterMap::None => None,
            FilterMap::Square => Some(MapShape::Square),
            FilterMap::Quadrant => Some(MapShape::Quadrant),
            FilterMap::Radial => Some(MapShape::Radial),
            FilterMap::SquaredRadius => Some(MapShape::SquaredRadius),
        }
    }
}

choices! {
    /// The order in which a frame's missing tiles are requested. The paper uses the order of the device's list.
    pub enum Order {
        /// As listed: from the finest level to the coarsest.
        Finest = "finest",
        /// From the coarsest level to the finest: the tiles that cover most of the texture come first.
        Coarsest = "coarsest",
    }
}

choices! {
    /// Which method makes the list of visible tiles from the pixels' triples. A pixel's triple is the level, row and
    /// column of the tile that it needs.
    pub enum Listing {
        /// The paper's: the device makes the list, in stages 2 and 3.
        Device = "device",
        /// Read-back: the host makes the list from a copy of the whole request image, with a hash set.
        HostHash = "host-hash",
        /// Read-back: as host-hash, but the set is a bitmap with one bit for each possible triple. A pixel with the
        /// same triple as the pixel before it is skipped.
        HostBitmap = "host-bitmap",
        /// Common in engines: in each frame, the host lists the tiles of one pixel in 2^n. The list lags and may lack
        /// tiles.
        Feedback = "feedback",
    }
}

choices! {
    /// Stage 2: how the tile mask gets one bit for each distinct triple (paper 1, section 2.2).
    pub enum Dedup {
        /// The paper's: a geometry shader emits points for each block of pixels; a logic OR merges them.
        Geometry = "geometry",
        /// A vertex shader emits a point for each pixel: the baseline for the paper's blocks.
        Points = "points",
        /// Compute: each pixel ORs its bit into the tile mask.
        AtomicOr = "atomic-or",
        /// Compute: each pixel reads its bit, and ORs it only if it is not set yet.
        TestOr = "test-or",
        /// Compute: one lane ORs the bit for all lanes of its subgroup with the same triple.
        SubgroupUnique = "subgroup-unique",
        /// Compute: a workgroup collects its bits in a hash table in shared memory, and ORs each word once.
        SharedHash = "shared-hash",
        /// Compute: each invocation handles 8 x 8 pixels. The paper's memo skips repeated triples before the test and
        /// the OR.
        TileMemo = "tile-memo",
        /// Compute: as tile-memo, four pixels at a time. While no lane's triple changes, a subgroup writes nothing.
        Runs = "runs",
        /// Compute: a workgroup keeps one bit per tile of the pyramid in shared memory. Needs own-level tile addresses.
        Bitset = "bitset",
        /// Compute: each pixel stores the frame's number in its tile's byte (C.-F. Hollemeersch,
        /// B. Pieters, P. Lambert and R. Van de Walle, "Accelerating Virtual Texturing Using CUDA", GPU Pro, 2010).
        MarkBytes = "mark-bytes",
        /// No request image: the texturing fragment shader marks its own tile. Fragments that are overdrawn later also
        /// mark, so the list is a superset. One draw of the mesh.
        Fused = "fused",
        /// As fused, after a depth-only draw: only visible fragments are shaded and marked. Exact.
        FusedExact = "fused-exact",
    }
}

choices! {
    /// Stage 3: how the tile mask becomes a list (paper 1, section 2.3).
    pub enum Compaction {
        /// The paper's: a geometry shader emits points for each block of the mask; transform feedback stores them.
        TransformFeedback = "transform-feedback",
        /// Compute: each word of the mask reserves entries for its set bits with one atomic addition.
        Append = "append",
        /// Compute: as append, with a prefix sum and one addition per subgroup.
        Subgroup = "subgroup",
        /// Compute: as append, with a prefix sum in shared memory and one addition per workgroup.
        Workgroup = "workgroup",
        /// Compute: workgroups count, then write. The list is in the mask's order, the same in every run.
        Ordered = "ordered",
        /// No pass: the fused draw appends a triple when it first sets the triple's bit. For variant.dedup = fused,
        /// fused-exact.
        FusedAppend = "fused-append",
    }
}

impl Dedup {
    /// True if one draw both marks and textures; there is then no request image.
    pub fn fused(self) -> bool {
        matches!(self, Dedup::Fused | Dedup::FusedExact)
    }
}

impl Compaction {
    /// Error: [`Compaction::FusedAppend`] with a stage 2 that is a separate pass.
    pub const FUSED_APPEND_ALONE: &str = "fused-append appends in the draw that marks, but this variant.dedup marks in \
        a separate pass; choose \"append\", or variant.dedup = \"fused-exact\"";
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
        for value in Compaction::ALL {
            assert_eq!(serde_json::to_value(value).unwrap(), value.name());
        }
    }
}
