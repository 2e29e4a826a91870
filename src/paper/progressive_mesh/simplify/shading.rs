//! Normals: how much of the surface a collapse makes look different.
//!
//! Vertices keep the model's normals, and a face interpolates those of its corners. At a vanished position the normal
//! of a level therefore differs from the model's. A difference of normals has no length, but the region in which it is
//! visible has one. Each vanished position counts with the area that it represents in the model, weighted by how
//! visible its difference is. The shading error of a collapse is the radius of a disc with the sum of these areas over
//! the faces around the hub. So a wanted error of `e` pixels lets an outline be `e` pixels off, and lets a disc of
//! radius `e` around each collapse look different.
//!
//! Measured with pm.shading: with the side of a square in place of the radius, or with 0.1 as [`VISIBLE`], outlines are
//! worse at equal numbers of faces. With 0.1 and half the radius, outlines are better, but at a wanted error of 8
//! pixels, regions that look different are 10 pixels wide.

use super::sequence::Sequence;
use super::wedges::nearest_wedge;
use glam::DVec3;
use std::f64::consts::PI;

/// A difference of unit normals that is visible, as the length of the chord between them. A surface of albedo 0.6 in
/// the default sunlight changes by 8 levels of 8-bit sRGB if its normal turns by 0.15 at 45 degrees from the sun.
const VISIBLE: f64 = 0.15;

/// The part of an area that counts if its normals differ by this squared chord: all of it from [`VISIBLE`] on, a
/// sixteenth at half of that.
pub(super) fn visible(squared: f64) -> f64 {
    (squared / (VISIBLE * VISIBLE)).powi(2).min(1.0)
}

impl Sequence<'_> {
    /// The larger of the squared shading error and the squared shift of the texture by the collapse of the hub onto
    /// `end`. The triangles must have been spread around `end`. The shift is measured with sides of faces divided into
    /// `parts`. Stops early, with an error that is too small, once `enough` returns true for this error. 0 without
    /// [`ShadingAttributes`](super::start::ShadingAttributes).
    pub(super) fn squared_appearance_error(
        &self,
        end: u32,
        parts: u32,
        enough: impl Fn(f64) -> bool + Copy,
    ) -> f64 {
        let Some(shading) = &self.shading else { return 0.0 };
        let Some(target) = self.targets(end) else { return 0.0 };
        // A part of the surface that vanishes shows nothing.
        if self.shape.new.is_empty() {
            return 0.0;
        }
        let mut error: f64 = 0.0;
        for near in self.points.iter().filter(|near| self.surface.is_position(near.position)) {
            if enough(error) {
                return error;
            }
            let (_, index) = self.shape.nearest(near.point, near.corner);
            let weights = self.shape.new[index].1.weights(near.point);
            let normals = self.shown_wedges(index, &target).map(|wedge| shading.normals[wedge as usize]);
            let normal: DVec3 =
                normals.into_iter().zip(weights).map(|(normal, weight)| normal * weight).sum();
            let shown = normal.normalize_or_zero();
            let own = self.wedges.of(near.position).iter().map(|&wedge| shading.normals[wedge as usize]);
            // On a crease, only the normal of the side that is shown counts.
            let squared = own.map(|own| own.distance_squared(shown)).fold(f64::INFINITY, f64::min);
            error += shading.areas[near.position as usize] * visible(squared) / PI;
        }
        error.max(self.squared_shift(end, parts, enough))
    }

    /// The largest squared shift of the texture at points of the new faces by the collapse of the hub onto `end`, with
    /// arguments as in [`Self::squared_appearance_error`]. 0 without texture coordinates.
    pub(super) fn squared_shift(&self, end: u32, parts: u32, enough: impl Fn(f64) -> bool + Copy) -> f64 {
        let Some(texture) = self.shading.as_ref().and_then(|shading| shading.texture.as_ref()) else {
            return 0.0;
        };
        let Some(target) = self.targets(end) else { return 0.0 };
        let mut max: f64 = 0.0;
        for (index, (_, triangle)) in self.shape.new[..self.shape.fan].iter().enumerate() {
            let wedges = self.shown_wedges(index, &target);
            max = max.max(texture.squared_shift(triangle.corners(), wedges, parts, enough));
            if enough(max) {
                break;
            }
        }
        max
    }

    /// For each of the hub's wedges the wedge that replaces it if the hub collapses onto `end`; `None` if the collapse
    /// is not allowed because of its wedges ([`Hub::wedge_pairs`](super::hub::Hub::wedge_pairs)).
    fn targets(&self, end: u32) -> Option<impl Fn(u32) -> u32 + '_> {
        let pairs = self.hub.wedge_pairs(&self.surface, end, self.may_tear())?;
        let choices = self.wedges.of(end);
        Some(move |wedge| pairs.target(wedge).unwrap_or_else(|| nearest_wedge(self.model, wedge, choices)))
    }

    /// The wedges of a new face, in the order of the corners of its triangle.
    fn shown_wedges(&self, index: usize, target: impl Fn(u32) -> u32) -> [u32; 3] {
        let face = self.shape.new[index].0;
        if index < self.shape.fan {
            let first = self.hub.corners[self.shape.parent(index)].index;
            let wedge = |corner: u8| self.surface.wedge(face, (first + corner) % 3);
            [target(wedge(0)), wedge(1), wedge(2)]
        } else {
            [0, 1, 2].map(|corner| self.surface.wedge(face, corner))
        }
    }
}
