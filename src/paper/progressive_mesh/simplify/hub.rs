//! The one-ring of a position that may be collapsed: its edges, its faces, and the allowed collapses.

use super::borders::BorderRadii;
use super::surface::{HubCorner, WorkingMesh};

/// An edge of the one-ring: from the hub to a neighbour.
#[derive(Clone, Copy, Debug)]
pub struct RingEdge {
    pub end: u32,
    pub kind: EdgeKind,
    /// Faces along the edge.
    pub faces: u32,
    /// The corner in which `end` follows the hub, and the corner in which `end` precedes it. If there are
    /// several, the last of each.
    ahead: Option<u32>,
    behind: Option<u32>,
}

/// The kind of an edge, by its faces. It decides what a collapse along the edge would do to borders and seams.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeKind {
    /// Two faces with the same wedges at both ends, or one face at a small hole (see `borders.rs`).
    Plain,
    /// Two faces with different wedges: attributes are discontinuous here.
    Seam,
    /// One face, at a border that restricts collapses.
    Border,
    /// Anything else: not manifold.
    Complex,
}

/// Up to this many corners, a linear search for an edge is faster than the table.
const FEW: usize = 16;

/// The neighbourhood of a position. The lists are reused from hub to hub.
pub struct Hub {
    pub position: u32,
    pub corners: Vec<HubCorner>,
    pub edges: Vec<RingEdge>,
    /// The ends of the edges, stored contiguously.
    ends: Vec<u32>,
    /// For each position the `turn` in which it was last a neighbour, and the index of its edge in that turn. Used only
    /// by hubs with more than [`FEW`] corners.
    seen: Vec<(u32, u32)>,
    turn: u32,
    pub borders: BorderRadii,
}

impl Hub {
    /// For positions below `count`.
    pub fn new(count: usize) -> Hub {
        Hub {
            position: 0,
            corners: Vec::new(),
            edges: Vec::new(),
            ends: Vec::new(),
            seen: vec![(0, 0); count],
            turn: 0,
            borders: BorderRadii::none(count),
        }
    }

    /// Makes a position the hub and collects its one-ring.
    pub fn look(&mut self, surface: &mut WorkingMesh, position: u32) {
        self.position = position;
        surface.gather(position, &mut self.corners);
        self.edges.clear();
        self.ends.clear();
        if self.turn == u32::MAX {
            self.seen.fill((0, 0));
            self.turn = 0;
        }
        self.turn += 1;
        for index in 0..self.corners.len() as u32 {
            let HubCorner { a, b, .. } = self.corners[index as usize];
            let edge = self.edge_for(a);
            edge.faces += 1;
            edge.ahead = Some(index);
            let edge = self.edge_for(b);
            edge.faces += 1;
            edge.behind = Some(index);
        }
        for index in 0..self.edges.len() {
            self.edges[index].kind = self.kind(surface, &self.edges[index]);
        }
    }

    fn edge_for(&mut self, end: u32) -> &mut RingEdge {
        let index = self.index_of(end).unwrap_or_else(|| {
            self.ends.push(end);
            self.edges.push(RingEdge { end, kind: EdgeKind::Plain, faces: 0, ahead: None, behind: None });
            self.edges.len() - 1
        });
        if self.corners.len() > FEW {
            self.seen[end as usize] = (self.turn, index as u32);
        }
        &mut self.edges[index]
    }

    /// The edge to a position.
    pub fn edge_to(&self, end: u32) -> Option<&RingEdge> {
        self.index_of(end).map(|index| &self.edges[index])
    }

    fn index_of(&self, end: u32) -> Option<usize> {
        // A few ends fit into one or two CPU cache lines. `seen` has an entry for every position and does not
        // fit.
        if self.corners.len() <= FEW {
            return self.ends.iter().position(|&known| known == end);
        }
        let (turn, edge) = self.seen[end as usize];
        (turn == self.turn).then_some(edge as usize)
    }

    fn kind(&self, surface: &WorkingMesh, edge: &RingEdge) -> EdgeKind {
        match (edge.faces, edge.ahead, edge.behind) {
            (1, ..) if self.borders.is_free([self.position, edge.end]) => EdgeKind::Plain,
            (1, ..) => EdgeKind::Border,
            (2, Some(_), Some(_)) if !surface.has_seams() => EdgeKind::Plain,
            (2, Some(ahead), Some(behind)) => {
                let along = |corner| self.wedges_along(surface, corner, edge.end);
                if along(ahead) == along(behind) { EdgeKind::Plain } else { EdgeKind::Seam }
            }
            _ => EdgeKind::Complex,
        }
    }

    /// The wedges of the hub and of `end` in the face of a corner.
    fn wedges_along(&self, surface: &WorkingMesh, corner: u32, end: u32) -> [u32; 2] {
        let HubCorner { face, index, a, .. } = self.corners[corner as usize];
        let other = if a == end { (index + 1) % 3 } else { (index + 2) % 3 };
        [surface.wedge(face, index), surface.wedge(face, other)]
    }

    /// The border edges into and out of the hub, in the faces' direction; `None` unless there is exactly one
    /// of each.
    pub fn border(&self) -> Option<[RingEdge; 2]> {
        let mut found = [None; 2];
        for edge in self.edges.iter().filter(|edge| edge.kind == EdgeKind::Border) {
            let side = &mut found[usize::from(edge.ahead.is_some())];
            if side.replace(*edge).is_some() {
                return None;
            }
        }
        Some([found[0]?, found[1]?])
    }

    /// The allowed directions, which depend only on the kinds of the hub's edges. An inner position may move
    /// anywhere, and a position on a border or seam only along it. A position where borders or seams end,
    /// cross or branch may not move.
    pub fn path(&self) -> MoveConstraint {
        let mut marked = self.edges.iter().filter(|edge| edge.kind != EdgeKind::Plain).map(|edge| edge.kind);
        match (marked.next(), marked.next(), marked.next()) {
            (None, ..) => MoveConstraint::Anywhere,
            // Two sheets share this edge; its collapse separates them again.
            (Some(EdgeKind::Complex), None, _) => MoveConstraint::Along(EdgeKind::Complex),
            (Some(one), Some(two), None) if one == two => MoveConstraint::Along(one),
            _ => MoveConstraint::Nowhere,
        }
    }

    /// For each of the hub's wedges in the faces along an edge, the wedge at the edge's end. If a wedge has
    /// two different targets, the result is `None`, or with `torn` the first target.
    pub fn wedge_pairs(&self, surface: &WorkingMesh, end: u32, torn: bool) -> Option<WedgePairs> {
        let mut pairs = WedgePairs::NONE;
        for (index, corner) in self.corners.iter().enumerate() {
            if corner.a != end && corner.b != end {
                continue;
            }
            let [from, to] = self.wedges_along(surface, index as u32, end);
            match pairs.target(from) {
                Some(other) if other != to && !torn => return None,
                Some(_) => {}
                None if pairs.count == MAX_PAIRS => return None,
                None => {
                    pairs.pairs[pairs.count] = [from, to];
                    pairs.count += 1;
                }
            }
        }
        Some(pairs)
    }

    /// The link condition. A collapse is forbidden if two faces would become equal, or if a position would lose its
    /// last face. If the hub and the end share a neighbour that belongs to none of the edge's faces, their edges to it
    /// become one edge. This closes a hole if the result has two faces, in opposite directions, and otherwise pinches
    /// the surface. It is also a pinch if two faces come to lie back to back and others are left around `end`. This
    /// happens where a tunnel has become flat. A later collapse along one of their edges removes both.
    pub fn link(&self, surface: &WorkingMesh, edge: &RingEdge) -> Link {
        let end = edge.end;
        let known = |position: u32| position != self.position && self.edge_to(position).is_some();
        let faces_left = surface.valence(end) + self.corners.len() - 2 * edge.faces as usize;
        if faces_left == 0
            || self.opposites(end).any(|third| surface.valence(third) <= self.shared(end, third))
        {
            return Link::Forbidden;
        }
        let mut link = Link::Unchanged;
        for corner in surface.corners(end).filter(|x| self.is_not(x)) {
            if known(corner.a) && known(corner.b) && self.has_face_with(corner.a, corner.b) {
                let is_equal = self.corners.iter().any(|x| x.a == corner.a && x.b == corner.b);
                if is_equal || faces_left <= 2 {
                    return Link::Forbidden;
                }
                link = Link::Pinches;
            }
            for position in [corner.a, corner.b] {
                if link != Link::Pinches && known(position) && !self.has_face_with(end, position) {
                    link = if self.closes(surface, end, position) { Link::Closes } else { Link::Pinches };
                }
            }
        }
        link
    }

    /// True if the edges of the hub and of `end` to a common neighbour are border edges of opposite directions.
    fn closes(&self, surface: &WorkingMesh, end: u32, neighbour: u32) -> bool {
        let mut along = surface.corners(end).filter(|x| x.a == neighbour || x.b == neighbour);
        let (Some(one), None) = (along.next(), along.next()) else { return false };
        self.edge_to(neighbour)
            .is_some_and(|edge| edge.faces == 1 && edge.ahead.is_some() == (one.b == neighbour))
    }

    /// The perimeter of the longest loop that a collapse onto `end` pinches. Its edges lead from the hub to `end`,
    /// on to a common neighbour, and back.
    pub fn pinched_loop(&self, surface: &WorkingMesh, end: u32) -> f64 {
        let length = |a: u32, b: u32| surface.point(a).distance(surface.point(b));
        let neighbours = surface.corners(end).filter(|x| self.is_not(x)).flat_map(|x| [x.a, x.b]);
        let pinched = neighbours.filter(|&position| {
            self.edge_to(position).is_some()
                && !self.has_face_with(end, position)
                && !self.closes(surface, end, position)
        });
        let rest = pinched.map(|position| length(end, position) + length(position, self.position));
        length(self.position, end) + rest.fold(0.0, f64::max)
    }

    /// A collapse onto `end` uncovers an edge if it removes all faces of the edge. The result is an upper bound of the
    /// distance of such an edge's points from the remaining surface; 0 if there is none. One end of the edge stays, and
    /// the other moves at most by the length of the collapsed edge.
    pub fn uncovered(&self, surface: &WorkingMesh, end: u32) -> f64 {
        let vanishes = |third: &u32| {
            self.edge_to(*third).is_some_and(|edge| edge.faces as usize == self.shared(end, *third))
                && !surface.corners(end).any(|x| self.is_not(&x) && (x.a == *third || x.b == *third))
        };
        let length = |to: u32| surface.point(self.position).distance(surface.point(to));
        let bounds = self.opposites(end).filter(vanishes).map(|third| (length(third) + length(end)) / 2.0);
        bounds.fold(0.0, f64::max)
    }

    /// How many faces the hub, `end` and a third position have in common.
    fn shared(&self, end: u32, third: u32) -> usize {
        self.opposites(end).filter(|&position| position == third).count()
    }

    /// True if the face of a corner at another position does not touch the hub.
    pub fn is_not(&self, corner: &HubCorner) -> bool {
        corner.a != self.position && corner.b != self.position
    }

    /// True if a face of the hub has both positions.
    fn has_face_with(&self, p: u32, q: u32) -> bool {
        self.corners.iter().any(|x| (x.a == p && x.b == q) || (x.a == q && x.b == p))
    }

    /// Third positions of the faces along the edge to `end`.
    fn opposites(&self, end: u32) -> impl Iterator<Item = u32> + '_ {
        self.corners.iter().filter_map(move |x| match end {
            _ if end == x.a => Some(x.b),
            _ if end == x.b => Some(x.a),
            _ => None,
        })
    }
}

/// Where a hub may move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MoveConstraint {
    Anywhere,
    /// Only along edges of this kind.
    Along(EdgeKind),
    Nowhere,
}

impl MoveConstraint {
    pub fn allows(self, kind: EdgeKind) -> bool {
        match self {
            MoveConstraint::Anywhere => true,
            MoveConstraint::Along(only) => kind == only,
            MoveConstraint::Nowhere => false,
        }
    }
}

/// The effect of a collapse on the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Link {
    /// The topology stays.
    Unchanged,
    /// Two border edges become one edge of two faces: closes a hole, or narrows it.
    Closes,
    /// Two sheets come to share an edge, or two faces: a handle or a neck becomes a pinch, or a tunnel becomes flat.
    Pinches,
    /// Would merge two faces into one, or leave a position without faces.
    Forbidden,
}

/// Maximum number of wedge pairs along one edge: one for each of two faces, more if several sheets share the
/// edge.
const MAX_PAIRS: usize = 4;

/// Some of a position's wedges, each with its replacement.
#[derive(Clone, Copy, Debug)]
pub struct WedgePairs {
    pairs: [[u32; 2]; MAX_PAIRS],
    count: usize,
}

impl WedgePairs {
    pub const NONE: WedgePairs = WedgePairs { pairs: [[0; 2]; MAX_PAIRS], count: 0 };

    /// The replacement of a wedge, if it has one here.
    pub fn target(&self, wedge: u32) -> Option<u32> {
        self.pairs[..self.count].iter().find(|pair| pair[0] == wedge).map(|pair| pair[1])
    }
}

#[cfg(test)]
mod tests {
    use super::super::curve::Curve;
    use super::*;
    use crate::model::Model;
    use glam::DVec3;

    #[test]
    fn an_edge_is_uncovered_if_a_collapse_removes_all_of_its_faces() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 4.0, 0.0], [1.0, 5.0, 0.0], [0.0, 5.0, 0.0]];
        // A triangle that hangs from another one, then also from a second one.
        for (faces, bound) in [
            (vec![[0, 1, 2], [2, 3, 4]], 2.5),
            (vec![[0, 1, 2], [2, 3, 4], [1, 3, 2]], 0.0),
            (vec![[0, 1, 2], [2, 3, 4], [0, 2, 4]], 0.0),
        ] {
            let positions = points.map(DVec3::from_array).to_vec();
            let model = Model { positions, wedge_positions: (0..5).collect(), faces, ..Model::default() };
            let curve = Curve::of(&model);
            let (mut surface, units) = WorkingMesh::new(&model, &curve);
            let mut hub = Hub::new(5);
            hub.look(&mut surface, curve.places[0]);
            let found = units.outside(hub.uncovered(&surface, curve.places[1]));
            assert!((found - bound).abs() < 1e-12, "{:?}: {found}", model.faces);
        }
    }
}
