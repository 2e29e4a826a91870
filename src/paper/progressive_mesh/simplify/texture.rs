//! Texture coordinates: how far a collapse shifts the texture.
//!
//! A face interpolates the texture coordinates of its corners. Near a vanished position a level therefore shows another
//! texel than the model. The shift is the distance from where the level shows the texel to where the model shows it.
//! The point on the model is extrapolated from the vanished position along the model's faces, so the shift is exact to
//! first order.

use super::surface::WorkingMesh;
use super::triangle::DistanceTriangle;
use crate::model::Model;
use glam::{DMat2, DVec2, DVec3};
use std::iter::Sum;
use std::ops::Mul;

/// Regularization of the least squares, relative to the trace: keeps the matrix invertible if coordinates vary in one
/// direction only.
const REGULAR: f64 = 1e-9;

/// The square of the largest possible distance of two positions: the simplifier's unit cube has side 2
/// ([`super::surface::Normalisation`]).
const FARTHEST_SQUARED: f64 = 12.0;

/// The model's texture coordinates.
pub struct TextureShift {
    /// Texture coordinates of each wedge.
    coordinates: Vec<DVec2>,
    /// For each wedge the derivatives of the position with respect to s and t.
    slopes: Vec<[DVec3; 2]>,
}

impl TextureShift {
    /// `None` without texture coordinates. `surface` has all of the model's faces.
    pub fn of(model: &Model, surface: &WorkingMesh) -> Option<TextureShift> {
        let own = |st: &[f32; 2]| DVec2::from(st.map(f64::from));
        let coordinates: Vec<DVec2> = model.attributes.coordinates.iter().map(own).collect();
        if coordinates.is_empty() {
            return None;
        }
        // The least squares over the edges of the faces at the wedge.
        let mut squares = vec![DMat2::ZERO; coordinates.len()];
        let mut products = vec![[DVec3::ZERO; 2]; coordinates.len()];
        for face in 0..surface.faces() as u32 {
            let points = surface.triangle(face);
            let wedges = [0, 1, 2].map(|corner| surface.wedge(face, corner) as usize);
            for (corner, other) in [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)] {
                let edge = points[other] - points[corner];
                let step = coordinates[wedges[other]] - coordinates[wedges[corner]];
                squares[wedges[corner]] += DMat2::from_cols(step * step.x, step * step.y);
                let product = &mut products[wedges[corner]];
                *product = [product[0] + edge * step.x, product[1] + edge * step.y];
            }
        }
        let slope = |(square, product): (DMat2, [DVec3; 2])| {
            let trace = square.x_axis.x + square.y_axis.y;
            let inverse = (square + DMat2::from_diagonal(DVec2::splat(REGULAR * trace))).inverse();
            let column = |row: DVec2| product[0] * row.x + product[1] * row.y;
            // A wedge whose faces show one texel has no slope.
            if trace > 0.0 { [column(inverse.x_axis), column(inverse.y_axis)] } else { [DVec3::ZERO; 2] }
        };
        Some(TextureShift { slopes: squares.into_iter().zip(products).map(slope).collect(), coordinates })
    }

    /// The squared distance from a point of a new face to where the model shows its texel. `point` is a vanished
    /// position near it, and `own` the wedges there.
    pub fn squared_shift(&self, point: DVec3, own: &[u32], shown: &ShownTexels) -> f64 {
        // The weights of a thin face are those of a corner, which shows its own texel.
        if shown.triangle.is_thin() {
            return 0.0;
        }
        let texel = shown.mean(|wedge| self.coordinates[wedge as usize]);
        let from_point = shown.point() - point;
        let squared = |&wedge: &u32| {
            let ([s, t], off) = (self.slopes[wedge as usize], texel - self.coordinates[wedge as usize]);
            let is_plain = [s, t] == [DVec3::ZERO; 2];
            if is_plain { 0.0 } else { (s * off.x + t * off.y - from_point).length_squared() }
        };
        // On a seam, only the texel of the side that is shown counts.
        own.iter().map(squared).fold(FARTHEST_SQUARED, f64::min)
    }
}

/// A point of a face, from which attributes are interpolated.
pub struct ShownTexels<'a> {
    pub wedges: [u32; 3],
    pub weights: [f64; 3],
    pub triangle: &'a DistanceTriangle,
}

impl ShownTexels<'_> {
    /// The mean of the wedges' values.
    pub fn mean<T: Sum + Mul<f64, Output = T>>(&self, value: impl Fn(u32) -> T) -> T {
        self.wedges.into_iter().zip(self.weights).map(|(wedge, weight)| value(wedge) * weight).sum()
    }

    /// The point.
    pub fn point(&self) -> DVec3 {
        self.triangle.corners().into_iter().zip(self.weights).map(|(corner, weight)| corner * weight).sum()
    }
}
