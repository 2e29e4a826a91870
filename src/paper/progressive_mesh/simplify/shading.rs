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

use super::sequence::{Near, Sequence};
use super::start::nearest_wedge;
use super::texture::ShownTexels;
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
    /// `end`. The triangles must have been spread around `end`. Stops early, with an error that is too small, once
    /// `enough` returns true for this error. 0 without [`Shading`](super::start::Shading).
    pub(super) fn squared_appearance_error(&self, end: u32, enough: impl Fn(f64) -> bool) -> f64 {
        let Some(shading) = &self.shading else { return 0.0 };
        let torn = self.may_tear();
        // A part of the surface that vanishes shows nothing.
        if self.shape.new.is_empty() {
            return 0.0;
        }
        let Some(pairs) = self.hub.wedge_pairs(&self.surface, end, torn) else { return 0.0 };
        let choices = self.wedges.of(end);
        let target = |wedge| pairs.target(wedge).unwrap_or_else(|| nearest_wedge(self.model, wedge, choices));
        let (mut error, mut shift): (f64, f64) = (0.0, 0.0);
        for near in self.points.iter().filter(|near| self.surface.is_position(near.position)) {
            if enough(error.max(shift)) {
                break;
            }
            let shown = self.shown(near, target);
            let own = self.wedges.of(near.position);
            let normal = shown.mean(|wedge| shading.normals[wedge as usize]).normalize_or_zero();
            let normals = own.iter().map(|&wedge| shading.normals[wedge as usize]);
            // On a crease, only the normal of the side that is shown counts.
            let squared = normals.map(|own| own.distance_squared(normal)).fold(f64::INFINITY, f64::min);
            error += shading.areas[near.position as usize] * visible(squared) / PI;
            if let Some(texture) = &shading.texture {
                shift = shift.max(texture.squared_shift(near.point, own, &shown));
            }
        }
        error.max(shift)
    }

    /// What the new faces show at the point nearest to a vanished position.
    fn shown(&self, near: &Near, target: impl Fn(u32) -> u32) -> ShownTexels<'_> {
        let (_, index) = self.shape.nearest(near.point, near.corner);
        let (face, triangle) = &self.shape.new[index];
        let wedges = match index < self.shape.fan {
            true => {
                let first = self.hub.corners[self.shape.parent(index)].index;
                let wedge = |corner: u8| self.surface.wedge(*face, (first + corner) % 3);
                [target(wedge(0)), wedge(1), wedge(2)]
            }
            false => [0, 1, 2].map(|corner| self.surface.wedge(*face, corner)),
        };
        ShownTexels { wedges, weights: triangle.weights(near.point), triangle }
    }
}
