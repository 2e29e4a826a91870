//! Connected components. Each component except the largest vanishes as a whole once its extent is at most the
//! deviation.

use super::surface::WorkingMesh;
use glam::DVec3;

/// A part of the model that shares no position with the rest.
pub struct Component {
    pub faces: Vec<u32>,
    /// Diagonal of its bounding box, in the simplifier's units: the error of its removal.
    pub extent: f64,
}

/// All components except the largest, which never vanishes, in order of decreasing extent.
pub fn lesser_components(surface: &WorkingMesh, positions: usize) -> Vec<Component> {
    let mut parents: Vec<u32> = (0..positions as u32).collect();
    for face in 0..surface.faces() as u32 {
        let [a, b, c] = surface.face(face);
        for other in [b, c] {
            let (root, joined) = (root(&mut parents, a), root(&mut parents, other));
            // The root is the lowest position of its component.
            parents[root.max(joined) as usize] = root.min(joined);
        }
    }
    let mut numbers = vec![u32::MAX; positions];
    let mut found: Vec<(Component, DVec3, DVec3)> = Vec::new();
    for face in 0..surface.faces() as u32 {
        let number = &mut numbers[root(&mut parents, surface.face(face)[0]) as usize];
        if *number == u32::MAX {
            *number = found.len() as u32;
            found.push((Component { faces: Vec::new(), extent: 0.0 }, DVec3::MAX, DVec3::MIN));
        }
        let (component, low, high) = &mut found[*number as usize];
        component.faces.push(face);
        for point in surface.triangle(face) {
            (*low, *high) = (low.min(point), high.max(point));
        }
    }
    let mut components: Vec<Component> = found
        .into_iter()
        .map(|(component, low, high)| Component { extent: (high - low).length(), ..component })
        .collect();
    // A stable sort: among equal components the first is kept longest.
    components.sort_by(|x, y| y.extent.total_cmp(&x.extent));
    components.drain(..components.len().min(1));
    components
}

/// The root of `at` in a forest of parents; the paths become shorter.
pub fn root(parents: &mut [u32], mut at: u32) -> u32 {
    while parents[at as usize] != at {
        let above = parents[parents[at as usize] as usize];
        parents[at as usize] = above;
        at = above;
    }
    at
}
