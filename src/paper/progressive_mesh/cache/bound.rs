//! A lower bound on the transforms of any order of a mesh's faces, for a FIFO of k entries.
//!
//! Let a vertex be transformed once, as the n-th transform. Transform n + k evicts it. The last face that finds the
//! vertex in the cache may transform its two other corners, as transforms n + k and n + k + 1. So a neighbour that is
//! also transformed once is at most k + 1 transforms away. A vertex at the end of a path of r such neighbours is at
//! most r (k + 1) transforms away. Each of these vertices has a transform of its own. So if every vertex within r edges
//! of a vertex is transformed once, this ball has at most 2 r (k + 1) + 1 vertices. In a ball of more vertices, some
//! vertex is transformed twice. The bounds of disjoint balls add up.
//!
//! A larger bound is known only for regular meshes, in which each vertex has six neighbours. The faces that are drawn
//! during m consecutive transforms have at most m + k vertices: k in the cache before, and m that enter. V vertices of
//! the plane's triangular lattice have at most 3 V - sqrt(12 V - 3) edges (H. Harborth, "Lösung zu Problem 664A",
//! Elemente der Mathematik 29, 1974), and so at most 2 V - sqrt(12 V - 3) + 1 faces. For k = 16 and m = 330 these are
//! 628 faces, but N vertices have 2 N faces. So an order needs at least 660 / 628 = 1.051 transforms per vertex, if no
//! short path winds around the surface.
//!
//! Other meshes have no such bound, because faces around vertices with fewer neighbours have a shorter boundary. The
//! largest number of faces on V vertices would have to be found in each mesh. Its relaxation, which pays a price per
//! vertex and is solved by a maximum flow, does not help: the whole mesh is always the best set, or no face is.

use std::collections::VecDeque;

/// A lower bound on the transforms per vertex, at least 1. Disjoint balls are chosen greedily, so a better packing may
/// give a slightly larger bound. Degenerate faces connect no vertices.
pub fn lower_bound(faces: &[[u32; 3]], entries: u32) -> f64 {
    let vertices = faces.as_flattened().iter().max().map_or(0, |&last| last as usize + 1);
    let neighbours = neighbours(faces, vertices);
    let used = neighbours.iter().filter(|ring| !ring.is_empty()).count();
    let (mut taken, mut balls) = (vec![false; vertices], 0);
    let mut seen = vec![usize::MAX; vertices];
    for centre in 0..vertices {
        if let Some(ball) = ball(&neighbours, centre, entries, &taken, &mut seen) {
            ball.into_iter().for_each(|vertex| taken[vertex as usize] = true);
            balls += 1;
        }
    }
    1.0 + f64::from(balls) / used.max(1) as f64
}

fn neighbours(faces: &[[u32; 3]], vertices: usize) -> Vec<Vec<u32>> {
    let mut neighbours = vec![Vec::new(); vertices];
    for &[a, b, c] in faces.iter().filter(|[a, b, c]| a != b && b != c && c != a) {
        for [one, other] in [[a, b], [b, c], [c, a]] {
            neighbours[one as usize].push(other);
            neighbours[other as usize].push(one);
        }
    }
    neighbours.iter_mut().for_each(|ring| {
        ring.sort_unstable();
        ring.dedup();
    });
    neighbours
}

/// The smallest ball around `centre` in which some vertex must be transformed twice. `None` if there is no such ball,
/// or if it contains a taken vertex.
fn ball(
    neighbours: &[Vec<u32>],
    centre: usize,
    entries: u32,
    taken: &[bool],
    seen: &mut [usize],
) -> Option<Vec<u32>> {
    let (mut ball, mut whole) = (Vec::new(), 0);
    let mut queue = VecDeque::from([(centre as u32, 0)]);
    seen[centre] = centre;
    while let Some(&(vertex, radius)) = queue.front() {
        if radius > whole {
            // All vertices within `whole` edges are in the ball, and no others.
            if ball.len() > 2 * whole * (entries as usize + 1) + 1 {
                return Some(ball);
            }
            whole = radius;
        }
        if taken[vertex as usize] {
            return None;
        }
        queue.pop_front();
        ball.push(vertex);
        for &next in &neighbours[vertex as usize] {
            if std::mem::replace(&mut seen[next as usize], centre) != centre {
                queue.push_back((next, radius + 1));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::progressive_mesh::cache::{Cache, transforms};
    use crate::paper::progressive_mesh::order::scratch::torus;

    /// A tube of `around` x `along` vertices.
    fn tube(around: u32, along: u32) -> Vec<[u32; 3]> {
        let vertex = |x: u32, y: u32| y * around + x % around;
        let quads = (0..along - 1).flat_map(|y| (0..around).map(move |x| (x, y)));
        quads
            .flat_map(|(x, y)| {
                let [a, b, c, d] = [vertex(x, y), vertex(x + 1, y), vertex(x, y + 1), vertex(x + 1, y + 1)];
                [[a, b, c], [c, b, d]]
            })
            .collect()
    }

    #[test]
    fn in_a_tube_narrower_than_the_cache_the_bound_is_reached() {
        let faces = tube(5, 200);
        assert_eq!(transforms(Cache::Fifo(16), &faces).per_vertex(), 1.0);
        assert_eq!(lower_bound(&faces, 16), 1.0);
    }

    #[test]
    fn the_bound_of_a_wide_surface_exceeds_1_and_grows_for_smaller_caches() {
        let faces = torus(60).faces;
        let bound = lower_bound(&faces, 16);
        assert!(bound > 1.0005 && bound < 1.07, "{bound}");
        // A smaller cache has a larger bound. The bound is below (k - 1) / (k - 2), the cost of strips as wide as the
        // cache.
        assert!(lower_bound(&faces, 8) > bound && lower_bound(&faces, 8) < 7.0 / 6.0);
    }
}
