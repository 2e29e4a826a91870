//! Models: cleaned triangle meshes from files (scans, solids with seams), and generated ones.
//!
//! A file's mesh is untrusted until it is cleaned. A [`Model`] satisfies the invariants that all later steps rely on.

mod attributes;
mod check;
mod clean;
mod error;
pub mod fetch;
pub mod generate;
mod glb;
mod load;
mod manifold;
mod names;
mod number;
mod obj;
mod outliers;
mod ply;
mod raw;
mod report;
mod terrain;
mod topology;
mod write;

pub use clean::clean;
pub use error::{FilePosition, ModelError};
pub use fetch::{FETCHED, fetched};
pub use names::{NAMES, named};
pub mod mesh;
pub use raw::Raw;
pub use report::MeshReport;
pub use topology::Topology;
pub use write::MeshFormat;

use glam::DVec3;

/// A clean triangle mesh, in object units.
///
/// It has two index spaces. A *position* is a point of the surface and defines topology: equal positions are welded
/// (-0 = +0), except where a non-manifold vertex was split. A *wedge* (H. Hoppe, "Efficient Implementation of
/// Progressive Meshes", Computers & Graphics, 1998) is what the GPU calls a vertex: a position with one tuple of
/// attributes. Along a seam a position has several wedges. A model without attributes has one wedge for each position.
///
/// Invariants:
///
/// - every value is finite;
/// - every position is used by a wedge, and every wedge by a face;
/// - the three positions of a face differ, and no two faces have the same three;
/// - an edge has at most two faces, which run along it in opposite directions;
/// - the faces at a position form one fan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// In the object units of the file.
    pub positions: Vec<DVec3>,
    /// For each wedge, the index of its position.
    pub wedge_positions: Vec<u32>,
    pub attributes: Attributes,
    /// Wedges, counter-clockwise seen from outside, in the file's order.
    pub faces: Vec<[u32; 3]>,
}

/// Attributes of the wedges. Each list is empty or has one entry for each wedge.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attributes {
    /// Unit vectors.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates (s, t).
    pub coordinates: Vec<[f32; 2]>,
    /// Red, green, blue, alpha.
    pub colors: Vec<[u8; 4]>,
}

impl Model {
    /// Indices of the positions of a face's corners.
    pub fn face_positions(&self, face: usize) -> [u32; 3] {
        self.faces[face].map(|wedge| self.wedge_positions[wedge as usize])
    }

    /// The position of each wedge.
    pub fn wedge_points(&self) -> Vec<DVec3> {
        self.wedge_positions.iter().map(|&position| self.positions[position as usize]).collect()
    }
}
