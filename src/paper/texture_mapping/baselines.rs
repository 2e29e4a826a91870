//! The filters that the field has: what the ellipses must beat at equal cost.

/// A filter that is none of the thesis's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Baseline {
    /// One trilinear sample; the level by the longer of J's columns (Williams, "Pyramidal parametrics", 1983).
    Trilinear,
    /// The device's own anisotropic sampler, of at most so many samples. No reference: drivers do as they like.
    Hardware(u32),
    /// The mean of at most so many trilinear samples along the longer of J's columns (EXT_texture_filter_anisotropic).
    Anisotropic(u32),
    /// Gaussian trilinear probes along the major axis, at most so many (McCormack, Perry, Farkas and Jouppi, "Feline: fast
    /// elliptical lines for anisotropic texture mapping", SIGGRAPH 1999).
    Feline(u32),
    /// So many taps along the major axis, Gaussian, each the mean of up to 16 trilinear samples (Mavridis and Papaioannou, "High
    /// quality elliptical texture filtering on GPU", I3D 2011, whose taps are the hardware's).
    Mavridis(u32),
    /// pbrt-v4's EWA: one texel of reconstruction, a ratio of at most 8, two levels (Pharr, Jakob and Humphreys,
    /// "Physically based rendering", 4th edition, section 10.4.5).
    Pbrt,
    /// So many single texels, drawn at random from the kernel (Pharr, Wronski, Salvi and Fajardo, "Filtering after shading
    /// with stochastic texture filtering", I3D 2024).
    Stochastic(u32),
    /// The mean of the footprint's bounding box by four sums (Crow, "Summed-area tables for texture mapping", SIGGRAPH 1984).
    SummedArea,
}
