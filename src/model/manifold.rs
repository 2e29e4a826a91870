//! Turns faces that share points arbitrarily into a manifold. It removes folds, makes the windings of neighbours
//! consistent, and cuts the surface where several fans of faces still meet ("cutting", Gueziec, Taubin, Lazarus, Horn
//! 2001).

use super::topology::{Groups, half_edges, next_corner};
use glam::DVec3;
use std::collections::HashMap;

/// Faces during cleaning: indices of the file's vertices, and the points of these vertices.
#[derive(Default)]
pub(super) struct Faces {
    pub vertices: Vec<[u32; 3]>,
    pub points: Vec<[u32; 3]>,
}

impl Faces {
    /// Removes folds. A fold is a patch in which each face coincides with another face of opposite winding. The
    /// caller has already dropped one face of each such pair; `doubled` is true for the other. A fold is removed only
    /// if the faces outside it close the surface along most of the fold's rim. In all other cases, such as an isolated
    /// sheet, one side of the fold stays. Decimated scans have hundreds of folds. Returns the number of removed faces.
    pub(super) fn unfold(&mut self, doubled: &[bool]) -> usize {
        if !doubled.contains(&true) {
            return 0;
        }
        let edges = half_edges(self.points.iter().copied());
        let mut patches = Groups::new(self.points.len());
        // A vote for each edge between a patch and other faces: 1 if the other faces close the edge without the patch,
        // otherwise -1.
        let mut rim: Vec<(u32, i64)> = Vec::new();
        for edge in edges.chunk_by(|a, b| a.0 == b.0) {
            let (ours, others): (Vec<u32>, Vec<u32>) =
                edge.iter().map(|&(_, corner)| corner / 3).partition(|&face| doubled[face as usize]);
            let Some(&first) = ours.first() else { continue };
            ours.iter().for_each(|&face| patches.join(first, face));
            match others.len() {
                0 => {}
                1 => rim.push((first, -1)),
                _ => rim.push((first, 1)),
            }
        }
        let mut votes: HashMap<u32, i64> = HashMap::new();
        for (face, vote) in rim {
            *votes.entry(patches.first(face)).or_default() += vote;
        }
        let mut goes = |face: usize| {
            doubled[face] && votes.get(&patches.first(face as u32)).is_some_and(|&vote| vote > 0)
        };
        let stays: Vec<bool> = (0..self.points.len()).map(|face| !goes(face)).collect();
        self.keep(&stays)
    }

    /// Removes faces without area (`thin`) along edges with more than two faces: they cover nothing, and a cut there
    /// would separate faces that belong together. A thin face stays if none of its edges has more than two faces,
    /// because it fills a gap. Returns the number of removed faces.
    pub(super) fn thin(&mut self, thin: &[bool]) -> usize {
        if !thin.contains(&true) {
            return 0;
        }
        let mut edge_of = vec![0; self.points.len() * 3];
        let mut counts = Vec::new();
        for edge in half_edges(self.points.iter().copied()).chunk_by(|a, b| a.0 == b.0) {
            edge.iter().for_each(|&(_, corner)| edge_of[corner as usize] = counts.len());
            counts.push(edge.len());
        }
        let mut goes = |face: usize| {
            let edges = &edge_of[3 * face..3 * face + 3];
            let goes = thin[face] && edges.iter().any(|&edge| counts[edge] > 2);
            edges.iter().filter(|_| goes).for_each(|&edge| counts[edge] -= 1);
            goes
        };
        let stays: Vec<bool> = (0..self.points.len()).map(|face| !goes(face)).collect();
        self.keep(&stays)
    }

    /// Keeps only the faces marked in `stays`; returns the number of removed ones.
    fn keep(&mut self, stays: &[bool]) -> usize {
        for list in [&mut self.vertices, &mut self.points] {
            let mut stays = stays.iter();
            list.retain(|_| *stays.next().expect("one for each face"));
        }
        stays.iter().filter(|stays| !**stays).count()
    }

    /// Reverses faces so that two faces sharing an edge run along it in opposite directions; in each connected patch
    /// the smaller part is reversed. Contradictions (a Moebius strip) are left to the cut. Returns the number of
    /// reversed faces.
    pub(super) fn orient(&mut self) -> usize {
        let edges = half_edges(self.points.iter().copied());
        let mut mates = vec![u32::MAX; self.points.len() * 3];
        let mut agree = true;
        for edge in edges.chunk_by(|a, b| a.0 == b.0) {
            if let [(_, here), (_, there)] = *edge {
                mates[here as usize] = there;
                mates[there as usize] = here;
                agree &= self.start(here) != self.start(there);
            }
        }
        if agree {
            return 0;
        }
        let mut turned: Vec<Option<bool>> = vec![None; self.points.len()];
        for seed in 0..self.points.len() {
            if turned[seed].is_some() {
                continue;
            }
            turned[seed] = Some(false);
            let mut patch = vec![seed];
            let mut next = 0;
            while let Some(&face) = patch.get(next) {
                next += 1;
                // Neighbours are visited in face order, independent of winding, so that a reoriented model is not
                // reoriented again.
                let mut neighbours = [0, 1, 2].map(|k| (mates[3 * face + k], (3 * face + k) as u32));
                neighbours.sort_unstable();
                for (mate, corner) in neighbours.into_iter().filter(|(mate, _)| *mate != u32::MAX) {
                    let neighbour = mate as usize / 3;
                    if turned[neighbour].is_none() {
                        let same = self.start(corner) == self.start(mate);
                        turned[neighbour] = turned[face].map(|turned| turned != same);
                        patch.push(neighbour);
                    }
                }
            }
            let count = patch.iter().filter(|&&face| turned[face] == Some(true)).count();
            if 2 * count > patch.len() {
                patch.iter().for_each(|&face| turned[face] = turned[face].map(|turned| !turned));
            }
        }
        for (face, _) in turned.iter().enumerate().filter(|(_, turned)| **turned == Some(true)) {
            self.vertices[face].swap(1, 2);
            self.points[face].swap(1, 2);
        }
        turned.iter().filter(|turned| **turned == Some(true)).count()
    }

    /// Cuts the surface along every edge that is not shared by exactly two faces of opposite direction. Then, if the
    /// corners at a point fall into several fans without a common edge, each fan but the first gets its own position,
    /// appended to the existing ones. Two faces at a cut edge still share the edge if, at each of its ends, a chain of
    /// other faces leads from one to the other. Returns the number of cut edges and of added positions.
    ///
    /// Afterwards every edge is manifold. A fan of faces around a point has at most two ends. So at most two of the
    /// faces that met at a cut edge are in the same fan, and these two run along the edge in opposite directions.
    pub(super) fn cut(&mut self, positions: &mut Vec<DVec3>) -> [usize; 2] {
        let edges = half_edges(self.points.iter().copied());
        let mut fans = Groups::new(self.points.len() * 3);
        let mut cut_edges = 0;
        for edge in edges.chunk_by(|a, b| a.0 == b.0) {
            match *edge {
                [_] => {}
                [(_, here), (_, there)] if self.start(here) != self.start(there) => {
                    fans.join(here, next_corner(there));
                    fans.join(next_corner(here), there);
                }
                _ => cut_edges += 1,
            }
        }
        // The first fan of a point keeps it; each other fan gets a copy.
        let mut keeper = vec![u32::MAX; positions.len()];
        let mut copies: HashMap<u32, u32> = HashMap::new();
        for (corner, point) in self.points.as_flattened_mut().iter_mut().enumerate() {
            let fan = fans.first(corner as u32);
            let keeper = &mut keeper[*point as usize];
            if *keeper == u32::MAX {
                *keeper = fan;
            }
            if *keeper != fan {
                let position = positions[*point as usize];
                *point = *copies.entry(fan).or_insert_with(|| {
                    positions.push(position);
                    positions.len() as u32 - 1
                });
            }
        }
        [cut_edges, copies.len()]
    }

    /// The point where a half-edge starts.
    fn start(&self, corner: u32) -> u32 {
        self.points[corner as usize / 3][corner as usize % 3]
    }
}

#[cfg(test)]
mod tests {
    use crate::model::clean::by_hand::{SQUARE, cleaned, raw};
    use crate::model::{Model, Raw, generate, named};
    use glam::DVec3;

    fn raw_of(model: &Model) -> Raw {
        Raw { positions: model.positions.clone(), faces: model.faces.clone(), ..Raw::default() }
    }

    #[test]
    fn a_fin_is_cut_off_and_the_surface_below_stays_whole() {
        let below = generate::grid(5, 0);
        let mut finned = raw_of(&below);
        finned.positions.push(DVec3::Z);
        finned.faces.push([12, 13, 25]);
        let (model, report) = cleaned(&finned);
        assert_eq!((report.non_manifold_edges, report.split_positions), (1, 2));
        assert_eq!((model.topology().components, model.topology().boundary_edges), (2, 16 + 3));
        assert_eq!(model.faces[..32], below.faces);
        // If no other faces connect the three faces at either end of the edge, it is undecidable which two belong
        // together.
        let mut positions = SQUARE.to_vec();
        positions.push([0.5, 0.5, 1.0]);
        let (model, _) = cleaned(&raw(&positions, &[[0, 1, 2], [0, 2, 3], [0, 2, 4]]));
        assert_eq!(model.topology().components, 3);
    }

    #[test]
    fn a_thin_face_on_an_edge_is_removed_and_one_that_fills_a_gap_stays() {
        let below = generate::grid(5, 0);
        let mut capped = raw_of(&below);
        capped.positions.iter_mut().for_each(|p| *p = p.as_vec3().as_dvec3());
        let whole = cleaned(&capped).0;
        // Rounding to f32 moves the middle slightly off the edge.
        let middle = (capped.positions[12] + capped.positions[13]) / 2.0;
        capped.positions.push((middle + DVec3::splat(1e-9)).as_vec3().as_dvec3());
        capped.faces.push([12, 13, 25]);
        let (model, report) = cleaned(&capped);
        assert_eq!((report.thin_faces, report.non_manifold_edges, report.unused_vertices), (1, 0, 1));
        assert!(model == whole);
        // Two squares; one has an extra vertex on their common side.
        let mut positions = SQUARE.to_vec();
        positions.push([0.5, 0.5, 0.0]);
        let (model, report) = cleaned(&raw(&positions, &[[0, 2, 3], [0, 4, 2], [0, 1, 4], [4, 1, 2]]));
        assert_eq!((report.thin_faces, report.zero_area_faces), (0, 1));
        assert_eq!((model.topology().components, model.topology().boundary_edges), (1, 4));
    }

    #[test]
    fn two_tetrahedra_that_share_an_edge_become_two_closed_parts() {
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 1.0, 1.0],
            [0.0, -1.0, 0.0],
            [0.0, -1.0, 1.0],
        ];
        let tetrahedron = |[a, b, c, d]: [u32; 4]| [[a, c, b], [a, b, d], [b, c, d], [c, a, d]];
        let faces = [tetrahedron([0, 1, 2, 3]), tetrahedron([0, 1, 4, 5])].concat();
        let (model, report) = cleaned(&raw(&positions, &faces));
        let topology = model.topology();
        assert_eq!((report.split_positions, topology.components, topology.is_closed()), (2, 2, true));
    }

    #[test]
    fn a_fold_on_a_closed_surface_is_removed_with_its_back() {
        let mut folded = raw_of(&generate::sphere(3));
        let [a, b, c] = folded.faces[10];
        let tip = folded.positions.len() as u32;
        folded.positions.push(folded.positions[a as usize] * 2.0);
        // A fold: two triangles and their reverses, which leave the surface along an edge.
        folded.positions.push(folded.positions[b as usize] * 2.0);
        folded.faces.extend([[a, b, tip], [b, a, tip], [b, tip + 1, tip], [b, tip, tip + 1]]);
        let (model, report) = cleaned(&folded);
        assert_eq!((report.reversed_faces, report.folded_faces, report.non_manifold_edges), (2, 2, 0));
        assert_eq!(model.faces, generate::sphere(3).faces);
        // A reversed copy of a surface face is not a fold; the order of the two does not matter.
        for doubled in [vec![[a, b, c], [a, c, b]], vec![[a, c, b], [a, b, c]]] {
            let mut raw = raw_of(&generate::sphere(3));
            raw.faces.splice(10..11, doubled);
            let (model, report) = cleaned(&raw);
            assert_eq!((report.reversed_faces, report.folded_faces, model.faces.len()), (1, 0, 180));
            assert!(model.topology().is_closed());
        }
    }

    #[test]
    fn one_side_of_a_double_sided_sheet_stays() {
        let mut sheet = raw_of(&generate::grid(5, 0));
        let backs: Vec<[u32; 3]> = sheet.faces.iter().map(|&[a, b, c]| [b, a, c]).collect();
        sheet.faces.extend(backs);
        let (model, report) = cleaned(&sheet);
        assert_eq!((report.reversed_faces, report.folded_faces), (32, 0));
        assert_eq!(model.faces, generate::grid(5, 0).faces);
    }

    #[test]
    fn the_minority_winding_is_reversed() {
        let bunny = named("bunny").unwrap();
        let mut mixed = raw_of(&bunny);
        mixed.faces.iter_mut().step_by(3).for_each(|face| face.swap(1, 2));
        let (model, report) = cleaned(&mixed);
        assert_eq!((report.turned_faces, report.non_manifold_edges), (1225, 0));
        let winding = |[a, b, c]: [u32; 3]| {
            if a < b && a < c {
                [a, b, c]
            } else if b < c {
                [b, c, a]
            } else {
                [c, a, b]
            }
        };
        assert!(model.faces.iter().zip(&bunny.faces).all(|(a, b)| winding(*a) == winding(*b)));
    }

    #[test]
    fn a_moebius_strip_is_cut_once() {
        let half_turn = std::f64::consts::PI / 8.0;
        let ring = |index: u32| {
            let (sine, cosine) = libm::sincos(2.0 * half_turn * f64::from(index));
            let (rise, out) = libm::sincos(half_turn * f64::from(index));
            let end = |width: f64| {
                let radius = 2.0 + width * out;
                [radius * cosine, radius * sine, width * rise]
            };
            [end(-0.5), end(0.5)]
        };
        let positions: Vec<[f64; 3]> = (0..8).flat_map(ring).collect();
        let mut faces = Vec::new();
        for index in 0..8 {
            let [a, b] = [2 * index, 2 * index + 1];
            let [c, d] = if index == 7 { [1, 0] } else { [a + 2, b + 2] };
            faces.extend([[a, b, d], [a, d, c]]);
        }
        let (model, report) = cleaned(&raw(&positions, &faces));
        assert_eq!((report.non_manifold_edges, model.faces.len()), (1, 16));
        assert_eq!((model.topology().components, model.topology().boundary_edges), (1, 16 + 2));
    }

    #[test]
    fn triangles_that_touch_in_one_point_get_one_point_each() {
        let mut positions = SQUARE.to_vec();
        positions.push([-1.0, 0.0, 0.0]);
        let (model, report) = cleaned(&raw(&positions, &[[0, 1, 2], [0, 3, 4]]));
        assert_eq!((report.split_positions, report.non_manifold_edges, model.positions.len()), (1, 0, 6));
    }
}
