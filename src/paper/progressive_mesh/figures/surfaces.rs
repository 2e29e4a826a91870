//! Shared by the figures on simplification: the baseline, and distances that do not depend on the scale.

use crate::model::Model;
use crate::reference::distance::{Distances, Triangles, compare_surfaces};
use anyhow::Context;
use glam::DVec3;
use meshopt::{SimplifyOptions, VertexDataAdapter};

/// The result of `meshopt_simplify`.
pub struct MeshoptSurface {
    pub faces: Vec<[u32; 3]>,
    /// Its stated error, in object units.
    pub stated: f64,
}

/// `meshopt_simplify` without options; only the target limits it.
pub fn baseline(
    positions: &[DVec3],
    faces: &[[u32; 3]],
    target_faces: usize,
) -> anyhow::Result<MeshoptSurface> {
    let floats: Vec<[f32; 3]> = positions.iter().map(|p| p.as_vec3().to_array()).collect();
    let vertices = VertexDataAdapter::new(bytemuck::cast_slice(&floats), size_of::<[f32; 3]>(), 0)
        .context("meshoptimizer rejects the vertices")?;
    let options = SimplifyOptions::ErrorAbsolute;
    let mut stated = 0.0_f32;
    let indices = faces.as_flattened();
    let left = meshopt::simplify(indices, &vertices, target_faces * 3, f32::MAX, options, Some(&mut stated));
    Ok(MeshoptSurface { faces: left.as_chunks().0.to_vec(), stated: f64::from(stated) })
}

/// The origin and unit of measurements: the box of the positions that a surface's faces use.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    centre: DVec3,
    /// Diagonal of the box, in object units.
    pub diagonal: f64,
}

impl Size {
    /// The box of a model.
    pub fn of(model: &Model) -> Size {
        Size::around(&model.positions)
    }

    /// The box of all positions.
    pub fn around(positions: &[DVec3]) -> Size {
        let low = positions.iter().fold(DVec3::MAX, |low, &p| low.min(p));
        let high = positions.iter().fold(DVec3::MIN, |high, &p| high.max(p));
        let half = (high - low) * 0.5;
        // Scaled first, because the square of a tiny or huge length would underflow or overflow.
        let max = half.max_element();
        let diagonal = if max > 0.0 { (half / max).length() * max * 2.0 } else { 0.0 };
        Size { centre: low + half, diagonal }
    }

    /// Positions relative to the centre, in diagonals.
    pub fn inside(&self, positions: &[DVec3]) -> Vec<DVec3> {
        positions.iter().map(|&p| (p - self.centre) / self.diagonal).collect()
    }

    /// Distances between two surfaces, in diagonals; `None` if one has only degenerate faces.
    pub fn distances(&self, one: Triangles, other: Triangles, samples: usize) -> Option<Distances> {
        let [first, second] = [one, other].map(|surface| self.inside(surface.positions));
        compare_surfaces(
            Triangles { positions: &first, ..one },
            Triangles { positions: &second, ..other },
            samples,
            1,
        )
    }
}

/// Distances between a model and other faces over `positions`, in diagonals of the model's box.
pub fn distances(
    model: &Model,
    positions: &[DVec3],
    faces: &[[u32; 3]],
    samples: usize,
) -> Option<Distances> {
    let all: Vec<[u32; 3]> = (0..model.faces.len()).map(|face| model.face_positions(face)).collect();
    let own = Triangles { positions: &model.positions, faces: &all };
    Size::of(model).distances(own, Triangles { positions, faces }, samples)
}
