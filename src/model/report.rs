//! What cleaning did to a mesh, in counts and in words.

use super::{Model, Topology};
use serde::Serialize;
use std::fmt;

/// Counts of what a file held, what was done to it, and what is left.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Report {
    /// In the file.
    pub vertices: usize,
    /// In the file, polygons counted as their triangles.
    pub file_faces: usize,
    /// Vertices with a coordinate that is NaN, infinite or beyond 1e36.
    pub non_finite_vertices: usize,
    /// Vertices 1000 times as far out as 999 of 1000 others, or 100 times and with no neighbour there.
    pub outlying_vertices: usize,
    /// Faces dropped because they use one of those two kinds.
    pub faces_set_aside: usize,
    /// Vertices that stand where an earlier one does.
    pub welded_vertices: usize,
    /// Faces dropped because they name a vertex twice.
    pub index_degenerate_faces: usize,
    /// Faces dropped because two of their vertices stand at the same place.
    pub collapsed_faces: usize,
    /// Faces dropped because an earlier one has the same three positions and the same winding.
    pub duplicate_faces: usize,
    /// Faces dropped because an earlier one has the same three positions and the other winding.
    pub reversed_faces: usize,
    /// Faces dropped with their backs because the surface is whole without these folds.
    pub folded_faces: usize,
    /// Faces without area (but for rounding to f32) dropped because an edge of theirs has two others.
    pub thin_faces: usize,
    /// Faces without area that were kept: they hold their neighbours together.
    pub zero_area_faces: usize,
    /// Faces turned round to agree with more of their neighbours.
    pub turned_faces: usize,
    /// Edges with more than two faces, or with two that cannot agree: cut apart.
    pub non_manifold_edges: usize,
    /// Positions added by cutting: at such edges, and where fans of faces touched in a point.
    pub split_positions: usize,
    /// Vertices that no face uses any more, those set aside not counted.
    pub unused_vertices: usize,
    /// Normals that were zero or not finite, now their faces'; coordinates that were not finite, now 0.
    pub replaced_attributes: usize,
    /// Steps of f32 across the mesh's box where all coordinates are f32's and there are fewer than 4096: what was
    /// smaller was lost before.
    pub f32_steps: Option<usize>,
    /// What is left.
    pub positions: usize,
    pub wedges: usize,
    pub faces: usize,
    pub topology: Topology,
}

impl Report {
    /// Enters what is left.
    pub(super) fn count(&mut self, model: &Model) {
        self.positions = model.positions.len();
        self.wedges = model.wedge_positions.len();
        self.faces = model.faces.len();
        self.topology = model.topology();
    }

    /// What was done, in words; nothing for a mesh that was clean but for equal vertices.
    pub fn changes(&self) -> Vec<String> {
        [
            ("vertices that are not finite or beyond 1e36, set aside", self.non_finite_vertices),
            (
                "vertices more than 1000 times as far out as nearly all others, or 100 times and alone, set aside",
                self.outlying_vertices,
            ),
            ("faces of such vertices, dropped", self.faces_set_aside),
            ("faces that name a vertex twice, dropped", self.index_degenerate_faces),
            ("faces with two corners at one place, dropped", self.collapsed_faces),
            ("faces that repeat an earlier one, dropped", self.duplicate_faces),
            ("faces that are the back of an earlier one, dropped", self.reversed_faces),
            ("faces of folds on a surface that is whole without, dropped", self.folded_faces),
            ("faces without area on edges of two others, dropped", self.thin_faces),
            ("faces without area, kept", self.zero_area_faces),
            ("faces turned round to agree with their neighbours", self.turned_faces),
            ("edges with more than two faces, or two that cannot agree, cut apart", self.non_manifold_edges),
            ("positions added where the surface was cut or touched itself in a point", self.split_positions),
            ("vertices in no face, dropped", self.unused_vertices),
            ("normals and coordinates that could not be used, replaced", self.replaced_attributes),
        ]
        .iter()
        .filter(|(_, count)| *count > 0)
        .map(|(what, count)| format!("{what}: {count}"))
        .chain(self.f32_steps.map(|steps| {
            format!("steps of f32 across the whole, so far is it from the origin: {steps}; what was finer is lost")
        }))
        .collect()
    }
}

impl fmt::Display for Report {
    /// One line for what was read, one for each change, one for what is left.
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
