//! Paper 3: realism and speed of texture mapping.
//!
//! O. Dudnyk, "Methods and tools of increasing the realism and productivity of texture mapping in computer graphics
//! systems", thesis, Vinnytsia, 2018 (abstract, in Ukrainian). A pixel's footprint in the texture is an ellipse; a
//! Gaussian that follows the ellipse weights its texels. The thesis makes the weights more exact at the ellipse's edge,
//! and cheaper by tables. It computes texture coordinates along rows by additions, applies textures in object
//! space, and filters reliefs.
//!
//! | letter | step | file |
//! |---|---|---|
//! | A | footprint: the pixel's ellipse in texels, (1)…(3) | `footprint.rs` |
//! | B | Gaussian weight with the footprint's shape, (4) | `weights.rs` |
//! | C | edge texels: the cut-off volume V1 | `weights.rs` |
//! | D | weight maps, (5), (6) | [`crate::math::weight_map`] |
//! | E, F | modified Heckbert coordinates, (7), (8); ellipse parameters by increments, (9) | `coordinates/` |
//! | G | object-space texturing, filtered in the screen plane | `object_space/` |
//! | H | parallax mapping with anisotropic filtering | `relief/` |
//! | I | refined distance map | `relief/` |
//!
//! The table `[surface.NAME.relief]` of a scene ([`config`]) puts a relief below a plane; step H or step I draws the
//! relief. [`method`] describes a filter method. [`pass`] runs the method on the GPU over a tilted [`plane`], and
//! [`mod@reference`] computes the same picture in f64 on the CPU; [`agreement`] compares the two. [`baselines`] lists
//! published filters, and [`texels`] holds a texture. [`figures`] measures all methods.
//!
//! Errata. Each formula that can run is built twice, as printed and as corrected:
//! - (4) takes the lengths of the **rows** of J for the ellipse's axes and an angle from J's entries. That is right
//!   only where J is diagonal or a similarity. The exact form is `r^2 = |J^-1 q|^2`.
//! - (2) has no reconstruction term: at 88 degrees of tilt a sixth of the footprints hold no texel, so their sum of
//!   weights is 0. We add `k` to the diagonal of `J J^T`.
//! - (9) prints the denominator of d/dx in all four derivatives, and uses increments that the thesis does not define.
//! - V1's operator is illegible. We take V1 as the volume on the inner side of the cut.

pub mod agreement;
pub mod baselines;
pub mod config;
pub mod coordinates;
pub mod figures;
pub mod footprint;
pub mod method;
pub mod object_space;
pub mod pass;
pub mod plane;
pub mod reference;
pub mod relief;
pub mod texels;
pub mod weights;
