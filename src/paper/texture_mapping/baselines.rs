//! Published filters, to which the figures compare the ellipse filter at equal cost.

/// A published filter by other authors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterBaseline {
    /// One trilinear sample. The longer column of the Jacobian selects the level (Williams, "Pyramidal parametrics",
    /// 1983).
    Trilinear,
    /// The device's anisotropic sampler with at most this many samples. Drivers differ, so there is no reference.
    Hardware(u32),
    /// The mean of at most this many trilinear samples along the longer column of the Jacobian
    /// (EXT_texture_filter_anisotropic).
    Anisotropic(u32),
    /// At most this many trilinear probes along the major axis, with Gaussian weights (McCormack, Perry, Farkas and
    /// Jouppi, "Feline: fast elliptical lines for anisotropic texture mapping", SIGGRAPH 1999).
    Feline(u32),
    /// This many Gaussian taps along the major axis (Mavridis and Papaioannou, "High quality elliptical texture
    /// filtering on GPU", I3D 2011). A tap is the mean of up to 16 trilinear samples; in the paper, a tap is a sample
    /// of the hardware's anisotropic sampler.
    Mavridis(u32),
    /// pbrt-v4's EWA: a reconstruction term of one texel, an axis ratio of at most 8, a mix of two levels (Pharr, Jakob
    /// and Humphreys, "Physically based rendering", 4th edition, section 10.4.5).
    Pbrt,
    /// This many single texels, drawn at random from the kernel (Pharr, Wronski, Salvi and Fajardo,
    /// "Filtering after shading with stochastic texture filtering", I3D 2024).
    Stochastic(u32),
    /// The mean over the footprint's bounding box, from four entries of a table of sums (Crow, "Summed-area tables for
    /// texture mapping", SIGGRAPH 1984).
    SummedArea,
}
