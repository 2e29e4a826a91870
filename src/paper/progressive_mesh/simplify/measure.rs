//! The deviation of an executed collapse, and the assignment of vanished positions to the faces and border edges that
//! replace theirs.

use super::hub::EdgeKind;
use super::lost::squared_to_segment;
use super::sequence::{CollapseCandidate, Sequence};

impl Sequence<'_> {
    /// Assigns the hub and its vanished positions to their nearest faces. Returns the deviation of the
    /// collapse.
    pub(super) fn measure(&mut self, step: &CollapseCandidate) -> f64 {
        let end = step.edge.end;
        let mut off = std::mem::take(&mut self.off);
        self.shape.spread(&self.hub, &self.surface, end);
        off.clear();
        for index in 0..self.shape.fan {
            off.push((self.shape.new[index].0, self.off_model(index, 0.0, self.parts, f64::INFINITY)));
        }
        let appearance = self.squared_appearance_error(end, self.parts, |_| false).sqrt();
        let corners = self.hub.corners.iter().enumerate();
        let dropped: Vec<(u32, f64)> = corners
            .filter_map(|(at, corner)| {
                let bound = self.lost.dropped(corner.face)?;
                let (face, distance) = self.shape.heir(at);
                Some((face, bound + distance))
            })
            .collect();
        self.hub.corners.iter().for_each(|corner| self.lost.clear(corner.face));
        let mut max = appearance.max(self.hub.uncovered(&self.surface, end));
        for (face, bound) in dropped {
            max = max.max(bound);
            self.lost.inherit(face, bound);
        }
        for near in &self.points {
            let (squared, index) = self.shape.nearest(near.point, near.corner);
            let face = self.shape.new[index].0;
            max = max.max(squared.sqrt());
            self.lost.give(near.position, face, squared.sqrt());
        }
        for &(face, distance) in &off {
            let known = &mut self.off_model[face as usize];
            *known = distance;
            max = max.max(distance);
        }
        self.off = off;
        if let (EdgeKind::Border, Some([into, out])) = (step.edge.kind, self.hub.border()) {
            max = max.max(self.measure_border(into.end, out.end));
        }
        max
    }

    /// Assigns the hub and the vanished positions of its two border edges to the new border edge from `start`
    /// to `end`. Returns the largest distance from it.
    fn measure_border(&mut self, start: u32, end: u32) -> f64 {
        let segment = [start, end].map(|position| self.surface.point(position));
        let off = |point| squared_to_segment(point, segment).sqrt();
        let lists = &mut self.lost_of_border;
        let old = [self.hub.position, start];
        let dropped = old.iter().filter_map(|&list| lists.dropped(list)).reduce(f64::max);
        old.iter().for_each(|&list| lists.clear(list));
        let mut max: f64 = 0.0;
        if let Some(bound) = dropped {
            max = bound + off(self.surface.point(self.hub.position));
            lists.inherit(start, max);
        }
        for &(position, point) in &self.border_points {
            max = max.max(off(point));
            lists.give(position, start, off(point));
        }
        max
    }
}
