//! One collapse: whether it is allowed, its cost, and its distance from the model.

use super::hub::{EdgeKind, Link, MoveConstraint, RingEdge};
use super::lost::squared_to_segment;
use super::original::PARTS;
use super::queue::Ties;
use super::sequence::{CollapseCandidate, Examined, Near, Rules, Sequence};
use super::shape::samples;

/// Weight of the squared deviation times the area around the hub, relative to the quadrics. Weights 0, 0.3,
/// 1, 3 and 10 give mean errors of 0.97, 0.83, 0.82, 0.81 and 0.80 of `meshopt_simplify`'s on closed meshes;
/// the Hausdorff distance is smallest for 1 to 3.
const DEVIATION_WEIGHT: f64 = 3.0;

/// Cost factor of a collapse that turns a face too far, in phases that allow it.
const FLIP_FACTOR: f64 = 100.0;

/// Parts into which the sides of a new face are divided when the shift of the texture is measured for a key: the points
/// are the middles of two sides. 3 parts do not lower the stated errors at equal numbers of faces.
const KEY_PARTS: u32 = 2;

/// A position with more faces than this is heavy. Scans have up to 30 faces at a position, the end of a
/// cylinder a few hundred.
const MAX_FACES: usize = 256;

impl Sequence<'_> {
    pub(super) fn quadric_cost(&self, from: u32, to: u32) -> f64 {
        let along = self.surface.point(to) - self.surface.point(from);
        self.quadrics[from as usize].at(along) + self.quadrics[to as usize].at_origin()
    }

    /// Where the hub may move.
    pub(super) fn path(&self) -> MoveConstraint {
        if self.rules >= Rules::Crossing { MoveConstraint::Anywhere } else { self.hub.path() }
    }

    /// True for a position with very many faces. It neither moves nor is a target until other collapses have
    /// reduced the number of its faces. Examining it costs the square of this number, and every collapse
    /// beside it would examine it.
    pub(super) fn is_heavy(&self, position: u32) -> bool {
        self.rules < Rules::Crossing && self.surface.valence(position) > MAX_FACES
    }

    /// True if the wedges of the hub may be replaced by any of the target's.
    pub(super) fn may_tear(&self) -> bool {
        self.rules >= Rules::Crossing
    }

    /// The edges along which the hub may move.
    pub(super) fn ways(&self) -> impl Iterator<Item = &RingEdge> {
        let path = self.path();
        self.hub.edges.iter().filter(move |edge| path.allows(edge.kind) && !self.is_heavy(edge.end))
    }

    /// The cheapest allowed collapse of a position, or a cheaper one that may not be allowed and whose key is above
    /// `next_key`. Most keys become invalid before their positions reach the head of the queue, so whether their
    /// collapses are allowed need not be known.
    pub(super) fn cheapest(&mut self, position: u32, next_key: f64) -> Option<CollapseCandidate> {
        let candidate = self.best(position, Examined::Cost)?;
        if candidate.cost > next_key {
            return Some(candidate);
        }
        match self.allowed(&candidate.edge, candidate.cost, candidate.flips) {
            Ok(step) if !step.comes_last => Some(step),
            _ => self.best(position, Examined::Allowed),
        }
    }

    /// The cheapest collapse of a position. If there is none, the position waits.
    pub(super) fn best(&mut self, position: u32, examined: Examined) -> Option<CollapseCandidate> {
        if self.is_heavy(position) {
            return None;
        }
        self.look(position);
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.clear();
        candidates.extend(self.ways().map(|edge| (self.quadric_cost(position, edge.end), *edge)));
        let ties = Ties { seed: self.options.seed };
        candidates.sort_unstable_by(|x, y| {
            x.0.total_cmp(&y.0).then_with(|| ties.rank(x.1.end).cmp(&ties.rank(y.1.end)))
        });
        self.gather_points();
        candidates.truncate((MAX_FACES * MAX_FACES / self.hub.corners.len()).max(1));
        let mut best: Option<CollapseCandidate> = None;
        let mut enough = f64::INFINITY;
        let area = self.shape.area();
        for (min, edge) in &candidates {
            let dearest = best.map_or(f64::INFINITY, |best| best.key());
            if dearest <= *min {
                break;
            }
            self.shape.spread(&self.hub, &self.surface, edge.end);
            self.report.looks += self.hub.corners.len() + self.surface.valence(edge.end);
            let flips = self.shape.flips;
            if flips && self.rules == Rules::Strict {
                continue;
            }
            let factor = if flips { FLIP_FACTOR } else { 1.0 };
            let cost = factor * self.paced(edge, *min, area, dearest / factor, examined == Examined::Paced);
            if cost >= dearest {
                continue;
            }
            let step = match examined {
                Examined::Cost => Ok(CollapseCandidate::unchecked(edge, cost, flips)),
                Examined::Allowed | Examined::Paced => self.allowed(edge, cost, flips),
            };
            match step {
                Ok(step) if step.key() < dearest => best = Some(step),
                Ok(_) => {}
                Err(deviation) => enough = enough.min(deviation),
            }
        }
        self.candidates = candidates;
        if best.is_none() {
            self.wait(position, enough);
        }
        best
    }

    /// Makes a position the hub and reads the triangles around it.
    pub(super) fn look(&mut self, position: u32) {
        self.hub.look(&mut self.surface, position);
        self.report.looks += self.hub.corners.len();
        self.shape.look(&self.hub, &self.surface, &self.normals);
    }

    pub(super) fn gather_points(&mut self) {
        let position = self.hub.position;
        let of = |p: u32| (p, self.surface.point(p));
        self.points.clear();
        self.points.push(Near { position, point: self.surface.point(position), corner: 0 });
        for (corner, face) in self.hub.corners.iter().map(|corner| corner.face).enumerate() {
            let near = |p: u32| Near { position: p, point: self.surface.point(p), corner: corner as u32 };
            self.points.extend(self.lost.of(face).map(near));
        }
        self.old_off.clear();
        self.old_off.extend(self.hub.corners.iter().map(|corner| self.off_model[corner.face as usize]));
        self.model_points.clear();
        if self.model_faces.is_some() {
            let positions = self.points.iter().filter(|near| self.surface.is_position(near.position));
            self.model_points.extend(positions.map(|near| (near.position, near.point)));
            self.model_points.extend(self.hub.edges.iter().map(|edge| of(edge.end)));
        }
        self.near_faces.clear(self.model_points.len());
        self.border_points.clear();
        if let Some([into, _]) = self.hub.border() {
            self.border_points.push(of(position));
            self.border_points.extend(self.lost_of_border.of(position).map(of));
            self.border_points.extend(self.lost_of_border.of(into.end).map(of));
        }
        self.report.looks += self.points.len() + self.border_points.len();
    }

    /// The collapse along an edge. If it is not allowed, the error is the deviation at which it will be: infinite if no
    /// deviation is enough.
    pub(super) fn allowed(&self, edge: &RingEdge, cost: f64, flips: bool) -> Result<CollapseCandidate, f64> {
        let link = self.hub.link(&self.surface, edge);
        let pinched = match link {
            Link::Unchanged | Link::Closes => 0.0,
            Link::Pinches => self.hub.pinched_loop(&self.surface, edge.end),
            Link::Forbidden => return Err(f64::INFINITY),
        };
        let enough = pinched.max(self.hub.uncovered(&self.surface, edge.end));
        let comes_last = enough > self.deviation();
        if comes_last && self.rules < Rules::Pinching {
            return Err(enough);
        }
        let pairs = self.hub.wedge_pairs(&self.surface, edge.end, self.may_tear()).ok_or(f64::INFINITY)?;
        Ok(CollapseCandidate { edge: *edge, cost, pairs, link, flips, comes_last })
    }

    /// The cost of a collapse. In the second pass the cost is raised, if it is lower, to the queue key that belongs to
    /// the collapse's deviation. The distances of the new faces from the model, and the shift of the texture at
    /// many of their points, are part of the deviation only if `is_paced`. Stops early once the cost exceeds `limit`.
    fn paced(&mut self, edge: &RingEdge, min: f64, area: f64, limit: f64, is_paced: bool) -> f64 {
        let (cost, deviation) = self.with_deviation(edge, min, area, limit);
        let Some(pace) = &self.pace else { return cost };
        let cost = cost.max(pace.key(deviation));
        if !is_paced || cost > limit {
            return cost;
        }
        let [least, enough] = [cost, limit].map(|key| pace.deviation(key));
        let max = self.farthest_face(edge.end, least, enough);
        match &self.pace {
            Some(pace) if max > least => cost.max(pace.key(max)),
            _ => cost,
        }
    }

    /// True if the distances of the new faces from the model, and the shift of the texture there, do not raise a
    /// collapse's key above `next_key`. May be false for the few collapses that a rule makes expensive.
    pub(super) fn keeps_pace(&mut self, step: &CollapseCandidate, next_key: f64) -> bool {
        let Some(pace) = &self.pace else { return true };
        if step.flips || step.comes_last || step.link == Link::Pinches {
            return false;
        }
        let max = pace.deviation(next_key);
        self.shape.spread(&self.hub, &self.surface, step.edge.end);
        self.farthest_face(step.edge.end, max, max) <= max
    }

    /// The largest of `max`, the largest distance of the new faces from the model, and the largest shift of the texture
    /// there. Stops early once it exceeds `limit`.
    fn farthest_face(&mut self, end: u32, max: f64, limit: f64) -> f64 {
        let shift = self.squared_shift(end, PARTS, |squared| squared > limit * limit).sqrt();
        (0..self.shape.fan).fold(max.max(shift), |max, face| {
            if max > limit { max } else { self.off_model(face, max, PARTS, limit) }
        })
    }

    /// The cost of a collapse including its deviation, and the deviation alone. It measures vanished positions against
    /// the new faces, samples of the new faces against the old ones, and the appearance. Stops early, with a deviation
    /// that is too small, once the cost exceeds `limit`.
    fn with_deviation(&self, edge: &RingEdge, min: f64, area: f64, limit: f64) -> (f64, f64) {
        let factor = DEVIATION_WEIGHT * area;
        let enough = |max: f64| min + factor * max > limit;
        let mut max: f64 = 0.0;
        if let (EdgeKind::Border, Some([into, out])) = (edge.kind, self.hub.border()) {
            let segment = [into.end, out.end].map(|p| self.surface.point(p));
            max = self.border_points.iter().fold(max, |max, &(_, p)| max.max(squared_to_segment(p, segment)));
        }
        for near in &self.points {
            if enough(max) {
                break;
            }
            max = self.shape.raised_by_point(max, near.point, near.corner);
        }
        for (index, (_, triangle)) in self.shape.new[..self.shape.fan].iter().enumerate() {
            for sample in samples(triangle) {
                if enough(max) {
                    break;
                }
                max = self.shape.raised_by_sample(max, sample, index);
            }
        }
        if self.shading.is_some() && !enough(max) {
            max = max.max(self.squared_appearance_error(edge.end, KEY_PARTS, enough));
        }
        (min + factor * max, max.sqrt())
    }
}
