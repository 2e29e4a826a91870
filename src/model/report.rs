//! The changes that cleaning made to a mesh, as counts and as text.

use super::{Model, Topology};
use serde::Serialize;
use std::fmt;

/// Counts of a file's content, of each change, and of the result.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MeshReport {
    /// In the file.
    pub vertices: usize,
    /// In the file; polygons count as their triangles.
    pub file_faces: usize,
    /// Vertices with a coordinate that is NaN, infinite or beyond 1e36.
    pub non_finite_vertices: usize,
    /// Vertices 1000 times as far out as 99.9 % of the others, or 100 times as far with no neighbour beyond that
    /// distance.
    pub outlying_vertices: usize,
    /// Faces dropped because they use a vertex of these two kinds.
    pub faces_set_aside: usize,
    /// Vertices at the position of an earlier one.
    pub welded_vertices: usize,
    /// Faces dropped because they use a vertex twice.
    pub index_degenerate_faces: usize,
    /// Faces dropped because two of their vertices have the same position.
    pub collapsed_faces: usize,
    /// Faces dropped because an earlier one has the same three positions and the same winding.
    pub duplicate_faces: usize,
    /// Faces dropped because an earlier one has the same three positions and the opposite winding.
    pub reversed_faces: usize,
    /// Faces dropped, with their reversed copies, because the surface is complete without these folds.
    pub folded_faces: usize,
    /// Faces without area (up to rounding to f32) dropped because one of their edges has two other faces.
    pub thin_faces: usize,
    /// Faces without area that were kept because they connect their neighbours.
    pub zero_area_faces: usize,
    /// Faces reversed to agree with most of their neighbours.
    pub turned_faces: usize,
    /// Edges that were cut: they have more than two faces, or two faces of contradicting winding.
    pub non_manifold_edges: usize,
    /// Positions added by cutting, at such edges and where fans of faces touch in a point.
    pub split_positions: usize,
    /// Vertices that no remaining face uses. Removed invalid vertices are not counted.
    pub unused_vertices: usize,
    /// Normals that were zero or not finite, replaced by those of their faces; coordinates that were not finite,
    /// replaced by 0.
    pub replaced_attributes: usize,
    /// f32 steps across the mesh's box, if all coordinates are f32 and there are fewer than 4096 steps. Finer detail
    /// was lost before the file was read.
    pub f32_steps: Option<usize>,
    /// Counts of the result.
    pub positions: usize,
    pub wedges: usize,
    pub faces: usize,
    pub topology: Topology,
}

impl MeshReport {
    /// Counts the result.
    pub(super) fn count(&mut self, model: &Model) {
        self.positions = model.positions.len();
        self.wedges = model.wedge_positions.len();
        self.faces = model.faces.len();
        self.topology = model.topology();
    }

    /// The changes as text; empty if only equal vertices were welded.
    pub fn changes(&self) -> Vec<String> {
        [
            ("vertices that are not finite or beyond 1e36, removed", self.non_finite_vertices),
            (
                "vertices more than 1000 times as far out as nearly all others, or 100 times and isolated, removed",
                self.outlying_vertices,
            ),
            ("faces of such vertices, dropped", self.faces_set_aside),
            ("faces that use a vertex twice, dropped", self.index_degenerate_faces),
            ("faces with two corners at one position, dropped", self.collapsed_faces),
            ("faces that repeat an earlier one, dropped", self.duplicate_faces),
            ("faces that are an earlier one reversed, dropped", self.reversed_faces),
            ("faces of folds on a surface that is complete without them, dropped", self.folded_faces),
            ("faces without area on edges with two other faces, dropped", self.thin_faces),
            ("faces without area, kept", self.zero_area_faces),
            ("faces reversed to agree with their neighbours", self.turned_faces),
            ("edges with more than two faces, or two of contradicting winding, cut", self.non_manifold_edges),
            ("positions added where the surface was cut or touched itself in a point", self.split_positions),
            ("vertices in no face, dropped", self.unused_vertices),
            ("invalid normals and coordinates, replaced", self.replaced_attributes),
        ]
        .iter()
        .filter(|(_, count)| *count > 0)
        .map(|(what, count)| format!("{what}: {count}"))
        .chain(self.f32_steps.map(|steps| {
            format!(
                "f32 steps across the mesh: {steps}, because it is small for its distance from the origin; finer \
                 detail is lost"
            )
        }))
        .collect()
    }
}

impl fmt::Display for MeshReport {
    /// One line for the input, one for each change, one for the result.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "read: {} vertices, {} faces", self.vertices, self.file_faces)?;
        for change in self.changes() {
            writeln!(f, "{change}")?;
        }
        let Topology { boundary_edges, components, seam_edges, .. } = self.topology;
        let edges =
            if boundary_edges == 0 { "closed".into() } else { format!("{boundary_edges} boundary edges") };
        write!(f, "clean: {} faces, {} positions, ", self.faces, self.positions)?;
        write!(f, "{} wedges ({seam_edges} edges on seams), {components} parts, {edges}", self.wedges)
    }
}
