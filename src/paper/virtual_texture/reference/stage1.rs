//! Compares stage 1 of a frame with the f64 reference, pixel by pixel. A difference is explained if the pixel is so
//! close to the border of a tile or level that f32 and fixed-point errors can cause it.

use super::picture::footprint;
use super::{Tolerance, possible_triples, triple};
use crate::math::pyramid::Pyramid;
use crate::model::mesh::SourceMesh;
use crate::reference::{ReferenceView, Sample};

/// How stage 1 compares with the reference.
#[derive(Clone, Debug, Default)]
pub struct Stage1Check {
    pub pixels: usize,
    /// Pixels whose triple differs from the reference.
    pub differing: usize,
    /// Unexplained differences: the pixel, its triple, and the reference's.
    pub unexplained: Vec<String>,
}

/// Upper bound of a device's position error, in pixels: twice the sum of two errors. The device snaps vertices to 1/256
/// pixel (lavapipe's subPixelPrecisionBits = 8), which moves an edge by at most half of that. Clip coordinates are f32
/// sums of 4 products with a relative error of 2^-22. In pixels, the products are at most 10 times the picture's longer
/// side, so this second error is at most 1/218 pixel at 1920 columns, and 1/26 at 16384.
pub fn radius_px(size: [u32; 2]) -> f64 {
    let clip_px = 2f64.powi(-22) * 10.0 * f64::from(size[0].max(size[1]));
    2.0 * (1.0 / 512.0 + clip_px)
}

/// The relative error of a triangle's gradients on devices that interpolate between snapped vertices: NVIDIA's do,
/// lavapipe does not. In the worst case two vertices move by 1/512 pixel in opposite directions along an altitude of
/// the triangle. For an altitude of 0.4 pixels the error is 1 % (measured on an H100: at most 0.9 % in 14,400 pixels
/// of `valley`).
pub fn snapping(sample: &Sample) -> f64 {
    1.0 / 256.0 / sample.altitude_px
}

/// The f32 error of (s, t) and of the derivatives. The sample's position is off by at most `radius_px`. An offset of at
/// most `largest_offset` is interpolated with a relative error of 2^-21 (three products and a division). A derivative
/// is the difference of two such values. The plane equation of s or t, extrapolated over 2000 pixels, adds 2^-10 of the
/// gradient (2^-21 per pixel). Snapped vertices add [`snapping`].
pub fn tolerance(sample: &Sample, largest_offset: f64, radius_px: f64) -> Tolerance {
    let d = &sample.fine;
    let gradient = [d.dsdx.abs() + d.dsdy.abs(), d.dtdx.abs() + d.dtdy.abs()];
    let offset = largest_offset * 2f64.powi(-21);
    Tolerance {
        coordinate: gradient.map(|g| radius_px * g + offset),
        derivative: gradient
            .map(|g| (2f64.powi(-10) + radius_px / 4.0 + snapping(sample)) * g + 2.0 * offset),
    }
}

/// The largest distance of a triangle's (s, t) from the corner of its cell. Cells are 2^-10 of the texture wide (see
/// [`crate::model::mesh`]).
fn largest_offset(mesh: &SourceMesh, triangle: u32) -> f64 {
    let [a, b, c] = mesh.triangles[triangle as usize].map(|vertex| mesh.coordinates[vertex as usize]);
    (a.max(b).max(c) - a.min(b).min(c)).max_element() + 2f64.powi(-10)
}

/// True if `found` is a possible outcome of the reference within the tolerance. A NaN coordinate defines only the
/// level: the first resident one, which requests no tile.
fn explains(
    sample: &Sample,
    found: [u32; 3],
    largest_offset: f64,
    pyramid: &Pyramid,
    radius_px: f64,
    max_anisotropy: u32,
) -> bool {
    if !(sample.s.is_finite() && sample.t.is_finite()) {
        return found[0] == pyramid.first_resident_level();
    }
    let tolerance = tolerance(sample, largest_offset, radius_px);
    let possible = possible_triples(&footprint(sample), &tolerance, pyramid, max_anisotropy);
    found.iter().zip(possible).all(|(value, [low, high])| (low..=high).contains(value))
}

/// Compares a frame's request image with the reference's picture of `mesh` in `view`.
pub fn compare_triples(
    triples: &[[u32; 3]],
    view: &ReferenceView,
    mesh: &SourceMesh,
    pyramid: &Pyramid,
    max_anisotropy: u32,
) -> Stage1Check {
    compare_surfaces(triples, view, pyramid, max_anisotropy, |triangle| Some(largest_offset(mesh, triangle)))
}

/// As [`compare_triples`], for several surfaces in one mesh. `carries` is the largest offset of a triangle's (s, t):
/// vertices store (s, t) as an origin and an offset. It is `None` for a triangle without virtual texture, which only
/// occludes.
pub fn compare_surfaces(
    triples: &[[u32; 3]],
    view: &ReferenceView,
    pyramid: &Pyramid,
    max_anisotropy: u32,
    carries: impl Fn(u32) -> Option<f64>,
) -> Stage1Check {
    let [width, height] = view.size();
    assert_eq!(triples.len(), width as usize * height as usize, "a triple for each pixel");
    let radius = radius_px(view.size());
    let mut check = Stage1Check { pixels: triples.len(), ..Stage1Check::default() };
    for (index, &found) in triples.iter().enumerate() {
        let (x, y) = (index as u32 % width, index as u32 / width);
        let seen = view.sample(x, y).filter(|sample| carries(sample.triangle).is_some());
        let equal = match &seen {
            None => found[0] == u32::MAX,
            Some(sample) if !(sample.s.is_finite() && sample.t.is_finite()) => {
                found[0] == pyramid.first_resident_level()
            }
            Some(sample) => {
                let truth = triple(&footprint(sample), pyramid, max_anisotropy);
                found == [truth.q, truth.i, truth.j]
            }
        };
        if equal {
            continue;
        }
        check.differing += 1;
        let candidates = view.candidates(x, y, radius);
        let explained = candidates.background && found[0] == u32::MAX
            || candidates.samples.iter().any(|sample| match carries(sample.triangle) {
                None => found[0] == u32::MAX,
                Some(offset) => {
                    found[0] != u32::MAX && explains(sample, found, offset, pyramid, radius, max_anisotropy)
                }
            });
        if !explained {
            let truth = seen.map(|sample| triple(&footprint(&sample), pyramid, max_anisotropy));
            check.unexplained.push(format!("({x}, {y}): {found:?}, not {truth:?}"));
        }
    }
    check
}
